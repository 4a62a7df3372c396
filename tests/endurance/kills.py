"""A session that is killed again and again: client, recorder or both, at a random moment of a chosen state."""

import json
import os
import random
import shutil
import signal
import sys
import time
from dataclasses import replace

import numpy as np
from desk import PLAN, Desk

from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import (
    Connect,
    Device,
    Failed,
    Gone,
    Live,
    People,
    ResumeSession,
    Sealed,
    Sealing,
    SessionBegun,
    StartSession,
)
from sessions.recording import LoggedEvent, Recording, RecordingError
from sessions.recording.schema import event_row
from sessions.run.resuming import check_resumable, resumption
from sessions.run.runner import Status
from sessions.run.steps import AskBegin, AskFinish, AskMount, AskScore, AskStroke, Pause, Resume

PACE = 4.0
DEADLINE = 120.0  # of a machine that hangs [s]
SHORT = replace(PLAN, blocks=(replace(PLAN.blocks[0], trials=PLAN.blocks[0].trials[:2]),))
STATES = ("beginning", "idle", "mounting", "taring", "ready", "stroking", "scoring", "paused", "closing", "sealing")
VICTIMS = ("recorder", "client", "both")


def fields_of(message):
    """Return what the client tells of a report."""
    match message:
        case SessionBegun():
            return {"state": "begun"}
        case Live(stream=stream) if len(message.sequence):
            return {"stream": stream, "shown": int(message.sequence[-1])}
        case LoggedEvent():
            return {"event": [*event_row(message)]}
        case Status():
            return {"state": message.state, "readings": message.safe.readings}
        case Sealing():
            return {"state": "sealing"}
        case Sealed() | Gone() | Failed():
            return {"state": "done"}
        case _:
            return {}


def client(folder, pipe, *, pausing):
    """Be the client: begin or resume the session, answer a little later, and report every message down `pipe`."""

    def report(**fields):
        os.write(pipe, (json.dumps(fields) + "\n").encode())

    chance = random.Random()
    recorder = Recorder.start(PACE)
    report(pid=recorder.pid)
    desk = Desk(recorder)
    if (folder / "session.sqlite").exists():
        recorder.send(ResumeSession(str(folder)))
    else:
        recorder.send(Connect("sim:?seed=7"))
        desk.until(Device)
        recorder.send(StartSession(SHORT, str(folder), People("simulated hand", 7)))
    report(state="beginning")
    fields = {}
    while fields.get("state") != "done":
        for message in recorder.poll(0.02):
            fields = fields_of(message)
            report(**fields)
            if isinstance(message, AskBegin | AskMount | AskScore | AskFinish | AskStroke):
                time.sleep(chance.uniform(0.0, 0.15))
                if pausing and isinstance(message, AskStroke):
                    pausing = False
                    recorder.send(Pause())
                    time.sleep(0.4)
                    recorder.send(Resume())
                desk.answer(message)


class Killing:
    """One kill: what was acknowledged before it, and what is in the file after it."""

    def __init__(self, folder, state, victim, chance):
        self.folder, self.state, self.victim = folder, state, victim
        self.events, self.safe, self.newest_by_stream, self.recorder = [], 0, {}, None
        self.reached = False
        self.states = set()
        self.lost = 0.0  # simulated seconds of readings that were shown and are not in the file
        self._chance = chance
        if state == "idle":
            shutil.rmtree(folder, ignore_errors=True)  # no session comes back to it
        self._before = self._count()
        reading, writing = os.pipe()
        sys.stdout.flush()
        process = os.fork()
        if process == 0:
            try:
                os.close(reading)
                client(folder, writing, pausing=state == "paused")
            finally:
                os._exit(0)
        os.close(writing)
        self._process = process
        self._buffer = b""
        with os.fdopen(reading, "rb", buffering=0) as pipe:
            os.set_blocking(reading, False)
            self._watch(pipe)

    def _watch(self, pipe):
        """Follow the client's messages; kill a random while after the state is reached."""
        self._until_due(pipe)
        if self.victim in ("recorder", "both") and self.recorder is not None:
            self._kill(self.recorder)
        if self.victim in ("client", "both"):
            os.kill(self._process, signal.SIGKILL)
        # A message that was on its way at the kill counts as received.
        end = time.monotonic() + (0.3 if self.victim == "recorder" else 0.05)
        while time.monotonic() < end and self._took(pipe):
            pass
        if self.victim == "recorder":
            os.kill(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)

    def _until_due(self, pipe):
        """Wait for the state, and a random while longer; or until the session is done without it."""
        deadline = time.monotonic() + DEADLINE
        while not self.reached and "done" not in self.states:
            assert time.monotonic() < deadline, f"{self.state}, {self.victim}: only {self.states} in {DEADLINE:g} s"
            if not self._took(pipe):
                return
            self.reached = self.state in self.states
            time.sleep(0.001)
        due = time.monotonic() + self._chance.uniform(0.0, 0.35)
        while time.monotonic() < due and self._took(pipe):
            time.sleep(0.001)

    def _kill(self, pid):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            self.reached = False

    def _took(self, pipe):
        """Note what has come down the pipe; False at its end."""
        data = pipe.read(1 << 20)
        if data == b"":
            return False
        *lines, self._buffer = (self._buffer + (data or b"")).split(b"\n")
        for line in lines:
            self._note(json.loads(line))
        return True

    def _note(self, fields):
        self.recorder = fields.get("pid", self.recorder)
        self.safe = max(self.safe, fields.get("readings", 0))
        self.states.add(fields.get("state"))
        if "event" in fields:
            self.events.append(tuple(fields["event"]))
        if "shown" in fields:
            self.newest_by_stream[fields["stream"]] = fields["shown"]

    def _count(self):
        try:
            return len(Recording.open(self.folder).readings())
        except RecordingError:
            return 0

    def check(self):
        """Check that what was acknowledged is there, that no more than a second is missing, and where it goes on."""
        self._wait_for_the_recorder()  # one that was killed while its disk was busy may still be dying
        try:
            recording = Recording.open(self.folder)
        except RecordingError:
            assert self.events == []
            assert self.safe == 0
            shutil.rmtree(self.folder, ignore_errors=True)
            return
        rows = [event_row(event) for event in recording.events]
        if self.events:
            first = self.events[0][0] - 1
            assert rows[first : first + len(self.events)] == self.events
        block = recording.readings()
        assert len(block) >= self.safe
        assert np.all(np.diff(block.sequence) == 1)
        if self.newest_by_stream and len(block) > self._before:
            seam = [event.data["sequence_offset"] for event in recording.events if event.kind == "readings_joined"]
            newest = self.newest_by_stream[max(self.newest_by_stream)]
            self.lost = max(newest + (seam[-1] if seam and self._before else 0) - int(block.sequence[-1]), 0) / 200.0
        if self.victim == "client" and recording.end is not None:
            assert recording.end["cause"] in ("client", "finished")
            assert len(block) == recording.end["readings"]
        self._cut_tail()
        if (self.folder / "MANIFEST.json").exists() or (recording.end and recording.end.get("complete")):
            shutil.rmtree(self.folder)  # the next kill begins a new session
            return
        check_resumable(recording)
        place = resumption(recording.plan, recording.events)
        trials = {event.trial for event in recording.events if event.kind == "take_kept"}
        trials |= {trial for kind, trial, _ in place.due_lines if kind == "take_kept"}
        assert [c.trial.number for c in place.commands if hasattr(c, "trial")] in ([len(trials) + 1], [])

    def _cut_tail(self):
        """Cut a copy's log short at random: a beginning of the session must be left."""
        log = self.folder / "session.sqlite-wal"
        if not log.exists():
            return
        room = self.folder.with_name("cut")
        shutil.copytree(self.folder, room)
        content = log.read_bytes()
        (room / log.name).write_bytes(content[: max(len(content) - self._chance.randrange(1, 200_000), 0)])
        try:
            sequence = Recording.open(room).readings().sequence
            assert np.all(np.diff(sequence) == 1)
        except RecordingError as error:
            assert "no such table" in str(error) or (room / "session.sqlite").stat().st_size < 8192  # noqa: PT017
        finally:
            shutil.rmtree(room)

    def _wait_for_the_recorder(self):
        deadline = time.monotonic() + 60
        while self.recorder is not None and time.monotonic() < deadline:
            try:
                os.kill(self.recorder, 0)
            except ProcessLookupError:
                return
            time.sleep(0.02)
