"""One session in the recorder: begun or resumed, run with the client as its operator, and sealed."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from daq_app.recorder import messages as m
from daq_app.recorder.bench import Bench, NotNow
from daq_app.recorder.device_history import remember_zero
from daq_app.recorder.display import Display
from daq_app.recorder.pipes import Inbox
from daq_app.simulation.wiring import SimulatedHand, SimulatedPeople, SimulatedSubject, SurfaceOf, simulated_surface
from drivers.clock import Clock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan
from sessions.plan.study import StudyError, study_key
from sessions.recording import LoggedEvent, Recording, RecordingError, SessionWriter, Setting, provenance
from sessions.recording.head import certificate_for, simulated_sentence, software_versions, without_home
from sessions.recording.manifest import is_sealed
from sessions.recording.recovery import LIFT_PATIENCE, fold_log
from sessions.recording.storage import RESERVE, check_room, unsafe
from sessions.run import resuming
from sessions.run.runner import STOPPED_BY_USER, Continuation, Ending, Operator, run_session
from sessions.run.steps import Command, Event

WHY = "a session is being recorded"
# For SetThreadExecutionState of Windows: until the next call; keep the system on (not the screen).
CONTINUOUS, SYSTEM_REQUIRED = 0x8000_0000, 0x0000_0001


@contextmanager
def awake() -> Generator[bool]:
    """Keep the computer awake in the context; yields True if the system was asked, which it may still refuse.

    The request ends with this process, even if it is killed. A closed lid or an empty battery overrides it.
    """
    process = None
    command = holder(os.getpid(), sys.platform)
    if command is not None and shutil.which(command[0]) is not None:
        with suppress(OSError):
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
    try:
        yield process is not None or _windows(CONTINUOUS | SYSTEM_REQUIRED)
    finally:
        _windows(CONTINUOUS)
        if process is not None:
            process.terminate()
            with suppress(subprocess.TimeoutExpired):
                process.wait(1.0)


def holder(pid: int, system: str) -> Sequence[str] | None:
    """Return a command that keeps the computer awake while the process `pid` lives; None if none is known.

    >>> holder(7, "darwin")
    ('caffeinate', '-i', '-w', '7')
    """
    if system == "darwin":
        return "caffeinate", "-i", "-w", str(pid)
    if system == "linux":  # tail ends with the process it watches, even after a crash
        options = ("--what=sleep:idle", "--who=daq-app", f"--why={WHY}", "--mode=block")
        return "systemd-inhibit", *options, "tail", f"--pid={pid}", "-f", "/dev/null"
    return None


def _windows(state: int) -> bool:
    """Set the execution state of Windows; return False on other systems, or if it refuses."""
    import ctypes

    windows = getattr(ctypes, "windll", None)
    return windows is not None and windows.kernel32.SetThreadExecutionState(state) != 0


CLIENT_GONE = "the window or terminal that ran the session is gone"
ANY_FOLDER = "recorded in an unsafe folder"  # name of a setting
SURFACE_FRICTION = "planted friction"  # name of a setting: descriptor, index and friction of simulated surfaces
Send = Callable[[m.Report], None]


@dataclass(frozen=True, slots=True)
class SessionSetup:
    """Everything that a session needs to run."""

    plan: SessionPlan
    writer: SessionWriter
    clock: Clock
    people: m.People
    info: TransducerInfo | None
    clock_offset_ns: int = 0
    continuation: Continuation | None = None
    earlier_events: tuple[LoggedEvent, ...] = ()  # of the session that is resumed


def begin(request: m.StartSession, bench: Bench, clock: Clock) -> SessionSetup:
    """Begin recording in a new folder. Raises RecordingError, SetupError or NotNow."""
    plan, people = request.plan, request.people
    if plan.forces and bench.connected is None:
        raise NotNow("a session with forces needs a transducer, and none is connected; connect one")
    info = _transducer_info(bench) if plan.forces else None
    folder = Path(request.folder)
    _check_people(people, plan, bench, folder)
    check_room(folder, plan, None if info is None else info.rate)
    settings = [*request.settings, *_people_settings(people, bench.uri if info is not None else None)]
    settings += _folder_settings(folder, any_folder=request.any_folder)
    writer = SessionWriter.create(
        folder,
        plan,
        info,
        {**provenance(clock, settings), "selftest": certificate_for(folder)},
        subject_simulated=people.kind != "people",
        clock=clock,
        reserve=RESERVE,
    )
    return SessionSetup(plan, writer, clock, people, info)


def resume(request: m.ResumeSession, bench: Bench, clock: Clock) -> SessionSetup:
    """Resume a session that was cut short. Raises RecordingError, NotNow, and as opening its transducer does."""
    folder = Path(request.folder)
    if is_sealed(folder):
        raise RecordingError(f"{folder} is sealed: nothing is added to it; begin a new session")
    fold_log(folder, Recording.open(folder).events)  # fails first while another recorder writes and holds the device
    recording = Recording.open(folder)
    resuming.check_resumable(recording)
    _folder_settings(folder, any_folder=ANY_FOLDER in _recorded_settings(recording))
    check_room(folder, recording.plan, None if recording.info is None else recording.info.rate)
    factor = float(recording.provenance["clock"]["factor"])
    if clock.factor != factor:
        raise NotNow(f"{folder} was recorded at pace {factor:g}: start the recorder with this pace")
    resumption, last = resuming.resumption(recording.plan, recording.events), recording.last_block()
    going_on, gap = resuming.continue_clock(recording, last, clock, datetime.now(UTC))
    people = _recorded_people(recording)
    if request.people is not None:  # the bench keeps its surfaces
        people = replace(request.people, friction=people.friction)
    with _own_transducer(request, recording, bench) as info:
        _check_people(people, recording.plan, bench, folder)
        if simulated_sentence(info, people.kind != "people") != recording.simulated_sentence:
            raise NotNow("what was simulated at the beginning must be simulated again, and nothing else")
        writer = SessionWriter.open(folder, going_on, reserve=RESERVE)
    continuation = Continuation(resumption, resuming.resumed_data(gap, info, software_versions()), last)
    earlier = tuple(recording.events)
    return SessionSetup(recording.plan, writer, going_on, people, info, going_on.offset_ns, continuation, earlier)


def run(prepared: SessionSetup, bench: Bench, display: Display, inbox: Inbox, send: Send) -> None:
    """Run the session to its end, report it, and seal it unless it can be resumed. Raises RecordingError."""
    writer = prepared.writer
    operator = _Operator(prepared, bench, display, inbox, send)
    writer.safe = operator.take_safe
    simulated = simulated_sentence(prepared.info, prepared.people.kind != "people")
    folder, kind = str(writer.folder), prepared.people.kind
    offset_ns = prepared.clock_offset_ns
    send(m.SessionBegun(folder, prepared.plan, kind, simulated, offset_ns, prepared.earlier_events))
    with awake():
        end = run_session(
            prepared.plan,
            writer,
            operator,
            bench.lend(offset_ns) if prepared.plan.forces else None,
            resumed=prepared.continuation,
            stop=operator.stop,
            progress=send,
        )
    resumable = end.cause in resuming.RESUMABLE
    send(m.SessionEnded(str(writer.folder), end, resumable))  # a new one if the first was removed
    if end.cause == "device":
        bench.lose(end.reason)
    if not resumable:
        from sessions.recording.archive import seal  # HDF5 is slow to load, and nothing is waiting now

        send(m.Sealing(str(writer.folder)))
        seal(writer.folder)
        send(m.Sealed(str(writer.folder)))


def _recorded_settings(recording: Recording) -> dict[str, Any]:
    return {name: setting["value"] for name, setting in recording.provenance.get("settings", {}).items()}


def _recorded_people(recording: Recording) -> m.People:
    values = _recorded_settings(recording)
    with suppress(msgspec.DecodeError, msgspec.ValidationError):
        friction = msgspec.json.decode(values.get(SURFACE_FRICTION, "[]"))
        people = {"kind": values["people"], "seed": values.get("people seed", 0), "friction": friction}
        return msgspec.convert(people, m.People)
    return m.People()


class _Operator:
    """The runner's operator, made of the client and simulated people."""

    def __init__(self, prepared: SessionSetup, bench: Bench, display: Display, inbox: Inbox, send: Send) -> None:
        self._bench = bench
        self._display = display
        self._inbox = inbox
        self._send = send
        self._clock = prepared.clock
        self._info = prepared.info
        self._helper = _helper(prepared, bench)
        self._touching = False
        self._alone_ns: int | None = None  # when the client was noticed to be gone

    def show(self, command: Command) -> None:
        """Send the command to the client and to simulated people."""
        self._send(command)
        if self._helper is not None:
            self._helper.show(command)

    def poll(self) -> Sequence[Event]:
        """Return the new events; refuse requests that have to wait for the end of the session."""
        self._display.look(self._bench.health, streaming=self._info is not None)
        acts: list[Event] = []
        for request in self._inbox.take_requests():
            match request:
                case m.AcknowledgeOverloads():
                    self._display.acknowledge()
                case m.Stop() | m.Shutdown():
                    pass  # handled by `stop`
                case m.Connect() | m.Disconnect() | m.Tare() | m.StartSession() | m.ResumeSession():
                    name = type(request).__name__
                    self._send(m.Failed(name, f"a session is running: {name} has to wait for its end"))
                case _:
                    acts.append(request)
        return acts if self._helper is None else (*acts, *self._helper.poll())

    def stop(self) -> Ending | None:
        """Return why the session must end now: a stop, or the client is gone and no finger touches; else None.

        Requests that came before the client went are carried out first.
        """
        if self._inbox.stop_wanted.is_set():
            return "stopped", STOPPED_BY_USER
        if not self._inbox.exhausted:
            return None
        now_ns = self._clock.now_ns()
        self._alone_ns = now_ns if self._alone_ns is None else self._alone_ns
        if self._touching and now_ns - self._alone_ns < LIFT_PATIENCE * 1e9:
            return None
        return "client", CLIENT_GONE

    def take_safe(self, events: Sequence[LoggedEvent]) -> None:
        """Send the events now safe, and remember whether a finger touches."""
        for event in events:
            self._send(event)
            if event.kind in ("contact_onset", "finger_lifted", "take_discarded"):
                self._touching = event.kind == "contact_onset"
            elif event.kind == "zeroed":
                self._display.set_zero(tuple(event.data["mean"]))
                if self._info is not None:
                    remember_zero(self._info, event.data["mean"], event.data["spread"])


def _helper(prepared: SessionSetup, bench: Bench) -> Operator | None:
    people = prepared.people
    connected = bench.connected if prepared.plan.forces else None
    if people.kind == "people":
        return None
    subject, surface = SimulatedSubject(people.seed), _surface_of(people, prepared.plan, prepared.writer.folder)
    if people.kind == "simulated people":
        helper = SimulatedPeople(subject, prepared.clock, connected, surface)
    else:
        helper = SimulatedHand(subject, connected, surface)
    trials = {trial.number: trial for trial in prepared.plan.trials}
    for event in prepared.earlier_events:
        if event.kind == "stroke_asked" and event.trial is not None:
            helper.count_stroke(trials[event.trial])
    return helper


def _surface_of(people: m.People, plan: SessionPlan, folder: Path) -> SurfaceOf:
    """Return a function from a trial to its simulated surface, using the study's key if codes are blinded."""
    try:
        key = study_key(folder.parent) if plan.blinded else None
    except StudyError as error:
        raise NotNow(f"simulated people must know which stimulus is which: {error}") from error
    return lambda trial: simulated_surface(trial if key is None else key.reveal(trial), people.friction)


def _check_people(people: m.People, plan: SessionPlan, bench: Bench, folder: Path) -> None:
    """Raise NotNow if simulated people would have to stroke a real bench, or cannot identify stimuli."""
    if people.kind != "people":
        _surface_of(people, plan, folder)
    simulated_bench = bench.connected is not None and bench.connected.bench is not None
    if people.kind == "simulated people" and plan.forces and not simulated_bench:
        raise NotNow("simulated people stroke the simulated bench only: connect sim:")
    if people.kind == "simulated hand" and not (plan.forces and simulated_bench):
        raise NotNow("a simulated hand strokes the simulated bench only: connect sim:, and record forces")


def _people_settings(people: m.People, uri: str | None) -> list[Setting]:
    """Return the settings from which a resumption restores people and device."""
    settings = [Setting("people", people.kind, "", "set")]
    if people.kind != "people":
        settings.append(Setting("people seed", people.seed, "", "set"))
    if people.friction:
        settings.append(Setting(SURFACE_FRICTION, msgspec.json.encode(people.friction).decode(), "", "set"))
    if uri is not None:
        settings.append(Setting("device", without_home(uri), "", "set"))
    return settings


def _folder_settings(folder: Path, *, any_folder: bool) -> list[Setting]:
    """Return the setting that records an unsafe folder, if it is one. Raises RecordingError unless any is allowed."""
    sentence = unsafe(folder)
    if sentence is None:
        return []
    if not any_folder:
        raise RecordingError(sentence)
    return [Setting(ANY_FOLDER, sentence.partition(";")[0].replace(str(folder.resolve()), "the folder"), "", "set")]


@contextmanager
def _own_transducer(request: m.ResumeSession, recording: Recording, bench: Bench) -> Generator[TransducerInfo | None]:
    """Hold the session's transducer open and yield its info; None for a visit that only scores."""
    if recording.info is None:
        if request.uri is not None:
            raise NotNow("the session began without a transducer, and continues without one")
        yield None
        return
    with bench.instead(request.uri or _recorded_settings(recording).get("device") or recording.info.uri):
        info = _transducer_info(bench)
        resuming.check_same_transducer(recording.info, info)
        yield info


def _transducer_info(bench: Bench) -> TransducerInfo:
    """Return the transducer's info in the form that is recorded."""
    assert bench.connected is not None
    info = bench.connected.transducer.info
    return replace(info, uri=without_home(info.uri))
