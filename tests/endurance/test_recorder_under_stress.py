"""A recorder that is stopped in every state, and one that is put to sleep: `make test-long`."""

import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections import defaultdict

import numpy as np
import pytest
from desk import PLAN, Desk

from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import (
    Connect,
    Device,
    Failed,
    LinkBack,
    LinkDown,
    Live,
    People,
    ResumeSession,
    SessionBegun,
    SessionEnded,
    StartSession,
    Stop,
)
from drivers.clock import RealClock
from sessions.recording import Recording
from sessions.run.runner import Status
from sessions.run.steps import AskBegin, AskMount, AskScore, AskStroke, Pause, Redo
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox

pytestmark = pytest.mark.slow

STATES = ("begun", "idle", "mounting", "taring", "ready", "stroking", "scoring", "paused")
ROUNDS = 10
LIMIT = 0.2  # [s]
ASLEEP = 3.0  # [s]


def reach(desk, state):
    """Go on with a session until it is in this state."""
    if state == "begun":
        desk.until(SessionBegun)
        return
    if state == "paused":
        desk.until(AskStroke)
        desk.recorder.send(Pause())
    while desk.until(Status).state != state:
        pass


def stop_times(recorder, desk, chance):
    """Return how long it took to stop connections to a box that accepts calls and says nothing [s]."""
    times = []
    with socket.create_server(("127.0.0.1", 0)) as silent:
        for _ in range(ROUNDS):
            recorder.send(Connect(f"net-ft://127.0.0.1?http={silent.getsockname()[1]}"))
            caller, _ = silent.accept()
            time.sleep(chance.uniform(0.0, 0.1))
            began = time.monotonic()
            recorder.send(Stop())
            desk.until(Failed)
            times.append(time.monotonic() - began)
            caller.close()
    return times


def test_a_stop_is_answered_within_a_fifth_of_a_second_in_every_state(tmp_path):
    chance = random.Random(3)
    times_of = defaultdict(list)
    with Recorder.start() as recorder:
        desk = Desk(recorder)
        recorder.send(Connect("sim:?seed=7"))
        desk.until(Device)
        for number in range(ROUNDS * len(STATES)):
            state = STATES[number % len(STATES)]
            folder = tmp_path / str(number)
            # Nobody answers in a state that is left by an answer.
            command = {"idle": AskBegin, "mounting": AskMount, "scoring": AskScore}.get(state)
            desk.instead = {} if command is None else {command: lambda _: None}
            recorder.send(StartSession(PLAN, str(folder), People("simulated hand", 7)))
            reach(desk, state)
            time.sleep(chance.uniform(0.0, 0.1))
            began = time.monotonic()
            recorder.send(Stop())
            end = desk.until(SessionEnded).end
            times_of[state].append(time.monotonic() - began)
            assert end.cause == "stopped"
            assert Recording.open(folder).end["cause"] == "stopped"
        times_of["connecting"] = stop_times(recorder, desk, chance)
    for state, times in times_of.items():
        print(f"\nstop while {state}: median {np.median(times) * 1e3:.0f} ms, most {max(times) * 1e3:.0f} ms", end="")
    print(f"\nload of this computer: {os.getloadavg()[0]:.1f}")
    assert all(np.median(times) < LIMIT for times in times_of.values())


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="puts a process to sleep, which needs POSIX")
def test_a_recorder_that_slept_loses_no_reading_that_the_system_kept_for_it(tmp_path):
    box = subprocess.Popen(
        [sys.executable, "-m", "daq_app", "simulate", "net-ft", "--json"], stdout=subprocess.PIPE, text=True
    )
    try:
        output = ""
        while "net-ft://" not in output:
            output += box.stdout.readline()
        uri = next(word for word in output.replace('"', " ").split() if word.startswith("net-ft://"))
        with Recorder.start() as recorder:
            desk = Desk(recorder, {AskMount: lambda _: None})
            recorder.send(Connect(uri))
            desk.until(Device)
            recorder.send(StartSession(PLAN, str(tmp_path / "s")))
            desk.until(Live, 30)
            os.kill(recorder.pid, signal.SIGSTOP)
            time.sleep(ASLEEP)
            recorder.poll()
            assert recorder.silence > ASLEEP - 0.5
            os.kill(recorder.pid, signal.SIGCONT)
            desk.until(Live, 30)
            recorder.send(Stop())
            end = desk.until(SessionEnded).end
        recording = Recording.open(tmp_path / "s")
        block = recording.readings()
        assert end.health.received == len(block) == end.readings
        gap = int(block.sequence[-1]) + 1 - int(block.sequence[0]) - len(block)
        assert gap == end.health.lost
        losses = sum(event.data.get("lost", 0) for event in recording.events if event.kind == "losses")
        assert losses == gap
        print(f"\nasleep for {ASLEEP:g} s: {len(block)} readings, {gap} lost, and as many counted")
    finally:
        box.terminate()
        box.communicate()


PULLS = 4


def test_a_cable_pulled_again_and_again_costs_a_trial_each_time_and_the_session_ends_whole(tmp_path):
    clock = RealClock()
    box = NetFtBox(Bench(7), clock)
    box.start()
    numbers = dict(pair.split("=") for pair in box.uri.partition("?")[2].split("&"))
    ports = tuple(int(numbers[name]) for name in ("rdt", "tcp", "http"))
    folder = tmp_path / "s"
    with Recorder.start() as recorder:
        desk = Desk(recorder, {AskStroke: lambda _: recorder.send(Redo("nobody strokes this bench"))})
        recorder.send(Connect(box.uri))
        desk.until(Device)
        box.close()
        desk.until(LinkDown)
        box = NetFtBox(Bench(7), clock, ports=ports)
        box.start()
        assert desk.until(LinkBack).same
        recorder.send(StartSession(PLAN, str(folder)))
        for _ in range(PULLS):
            desk.until(AskStroke)
            box.close()
            report = desk.until(SessionEnded)
            assert (report.end.cause, report.resumable) == ("device", True)
            box = NetFtBox(Bench(7), clock, ports=ports)
            box.start()
            assert desk.until(LinkBack).same
            recorder.send(ResumeSession(str(folder)))
            desk.until(SessionBegun)
        desk.until(AskStroke)
        recorder.send(Stop())
        assert desk.until(SessionEnded).end.cause == "stopped"
    box.close()
    recording = Recording.open(folder)
    assert sum(event.kind == "resumed" for event in recording.events) == PULLS
    assert np.all(np.diff(recording.readings().time) > 0)
    assert np.all(np.diff(recording.readings().sequence) >= 1)
    print(
        f"\n{PULLS} times unplugged during a session: {len(recording.readings())} readings, none twice or out of order"
    )
