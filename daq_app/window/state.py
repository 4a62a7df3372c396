"""What the window knows: one frozen state, and how each message changes it. No Qt, no clock, no file."""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from msgspec import Struct

from daq_app.recorder import messages as m
from daq_app.recorder.device_history import Life
from daq_app.window.course_state import Judged, SessionState, begin_session, session_after
from daq_app.window.live_feed import Load
from daq_app.wording import tr
from drivers.catalog import Probe
from drivers.transducer import Health, TransducerInfo
from sessions.plan.plan import Frame
from sessions.plan.protocols.protocol import ENGLISH
from sessions.recording import LoggedEvent

Link = Literal["none", "connecting", "open", "lost"]
_FROM_RECORDER = frozenset(m.REPORTS)


class Tick(Struct, frozen=True):
    """Time has passed."""

    now: float  # [s] of the machine's monotonic clock


class Searching(Struct, frozen=True):
    """Devices are being looked for."""


class DevicesFound(Struct, frozen=True):
    """What answered when devices were looked for."""

    devices: tuple[Probe, ...]


class LifeKnown(Struct, frozen=True):
    """What a serial number has been through was looked up."""

    serial: str
    life: Life | None


class Dismissed(Struct, frozen=True):
    """The experimenter has read the sentence of a failure."""


class NewSession(Struct, frozen=True):
    """The experimenter leaves a session that has ended, for the page where the next is begun."""


class DrawingFailed(Struct, frozen=True):
    """A picture could not be drawn; the recording is not touched by it."""

    sentence: str


class LanguageChosen(Struct, frozen=True):
    """The language that the next session's subject reads was chosen."""

    language: str


Own = (
    Tick | Searching | DevicesFound | LifeKnown | Judged | Dismissed | NewSession | DrawingFailed | LanguageChosen
)  # fmt: skip
Message = m.Request | m.Report | Own  # what `fold` takes


@dataclass(frozen=True, slots=True)
class Zero:
    """A measured zero of the bench."""

    mean: m.Six  # in force, nothing subtracted [N, N mm]
    noise: m.Six  # standard deviation [N, N mm]
    readings: int
    duration: float  # [s]


@dataclass(frozen=True, slots=True)
class BenchState:
    """The transducer, and whether to trust it."""

    link: Link = "none"
    uri: str = ""
    info: TransducerInfo | None = None
    frame: Frame | None = None  # of a bench that knows it
    problem: str | None = None  # why the link is lost, or was not made
    searching: bool = False
    searched: bool = False  # a search has ended since somebody connected or let go
    devices: tuple[Probe, ...] = ()
    health: Health = field(default_factory=Health)
    rate: float = float("nan")  # measured [Hz]
    load: Load = field(default_factory=Load)
    peak: Load = field(default_factory=Load)  # since somebody acknowledged it
    saturated: int = 0  # since somebody acknowledged it
    silence: float = 0.0  # since the newest reading [s]
    taring: bool = False
    zero: Zero | None = None  # the latest
    first_zero: Zero | None = None  # the first since the bench was connected
    life: Life | None = None  # of its serial number, where anything is kept of it


def _fold_link(bench: BenchState, message: Message) -> BenchState:
    match message:
        case m.Connect(uri):
            return BenchState(link="connecting", uri=uri, devices=bench.devices)
        case m.Device(info, frame):
            return replace(bench, link="open", info=info, frame=frame, uri=info.uri, problem=None, life=None)
        case m.NoDevice():
            return BenchState(devices=bench.devices, problem=bench.problem)
        case m.Failed("Connect", sentence):
            return BenchState(devices=bench.devices, problem=sentence)
        case m.LinkDown(sentence):
            return replace(bench, link="lost", problem=sentence)
        case m.LinkBack(same=True):
            return replace(bench, link="open", problem=None)
        case m.LinkBack(info):
            problem = tr("another transducer answers now, with serial number {serial}", serial=info.serial)
            return replace(bench, link="lost", problem=problem)
        case m.SessionEnded(end=end) if end.cause == "device":
            return replace(bench, link="lost", problem=end.reason)
        case m.Gone(requested=False):
            return BenchState(devices=bench.devices)  # the recorder's process held the transducer
        case _:
            return bench


def _fold_readings(bench: BenchState, message: Message) -> BenchState:
    match message:
        case m.Tare():
            return replace(bench, taring=True)
        case m.Failed("Tare"):
            return replace(bench, taring=False)
        case m.Tared(mean, spread, _, readings, duration):
            return _set_zero(replace(bench, taring=False), mean, spread, readings, duration)
        case LoggedEvent(kind="zeroed", data=data):
            return _set_zero(bench, data["mean"], data["spread"], data["readings"], data["duration"])
        case m.HealthReport(health, rate, load, peak, saturated, silence):
            loads = {"load": Load(load), "peak": Load(peak)}
            return replace(bench, health=health, rate=rate, saturated=saturated, silence=silence, **loads)
        case LifeKnown(serial, life) if bench.info is not None and bench.info.serial == serial:
            return replace(bench, life=life)
        case m.AcknowledgeOverloads():
            return replace(bench, peak=Load(), saturated=0)
        case Searching():
            return replace(bench, searching=True)
        case DevicesFound(devices):
            return replace(bench, searching=False, searched=True, devices=devices)
        case _:
            return bench


def _set_zero(bench: BenchState, mean: Any, spread: Any, readings: int, duration: float) -> BenchState:  # noqa: ANN401
    """Return the bench with a zero given in raw units, (6,) each."""
    if bench.info is None or len(mean) != 6:
        return bench
    matrix = bench.info.calibration.matrix
    force = tuple((matrix @ np.asarray(mean, float)).tolist())
    # Noise of the axes is taken as independent in raw units: exact where the box has combined the gauges itself.
    noise = tuple(np.sqrt(matrix**2 @ np.asarray(spread, float) ** 2).tolist())
    zero = Zero(force, noise, readings, duration)  # type: ignore[arg-type]  # six of each, as `matrix` has rows
    return replace(bench, zero=zero, first_zero=bench.first_zero or zero)


@dataclass(frozen=True, slots=True)
class AppState:
    """Everything the window knows."""

    now: float = 0.0  # [s] of the machine's monotonic clock
    last_report: float | None = None  # when the recorder was last heard [s]
    bench: BenchState = field(default_factory=BenchState)
    session: SessionState | None = None
    failure: m.Failed | None = None  # the last request that could not be met
    exit_reason: str | None = None  # why the recorder's process is not there any more
    drawing_error: str | None = None  # what could not be drawn
    language: str = ENGLISH  # that the next session's subject reads, as it is chosen


def fold(state: AppState, message: Message) -> AppState:
    """Return the state after a message: what was sent to the recorder, what came from it, or the window's own."""
    if type(message) in _FROM_RECORDER:
        state = replace(state, last_report=state.now)
    bench = _fold_readings(_fold_link(state.bench, message), message)
    session = state.session and session_after(state.session, message, state.now)
    if bench is not state.bench or session is not state.session:
        state = replace(state, bench=bench, session=session)
    return _fold_window(state, message)


def _fold_window(state: AppState, message: Message) -> AppState:
    match message:
        case m.SessionBegun():
            return replace(state, session=begin_session(message, state.now), failure=None)
        case m.StartSession() | m.ResumeSession():
            return replace(state, failure=None)
        case NewSession() if state.session is not None and state.session.is_over:
            return replace(state, session=None)
        case m.Failed():
            return replace(state, failure=message)
        case m.Gone(requested, sentence):
            return replace(state, exit_reason=None if requested else sentence)
        case Tick(now):
            return replace(state, now=now)
        case Dismissed():
            return replace(state, failure=None, drawing_error=None)
        case DrawingFailed(sentence):
            return replace(state, drawing_error=sentence)
        case LanguageChosen(language):
            return replace(state, language=language)
        case _:
            return state
