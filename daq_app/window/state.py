"""The window's state, one frozen dataclass, and its changes by each message. No Qt, no clock, no file."""

from collections.abc import Mapping
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
    """A search for devices is running."""


class DevicesFound(Struct, frozen=True):
    """The result of a search for devices."""

    devices: tuple[Probe, ...]


class LifeKnown(Struct, frozen=True):
    """The history of a serial number was read."""

    serial: str
    life: Life | None


class TransducerHolders(Struct, frozen=True):
    """Transducers of unfinished sessions that a recorder still writes."""

    sessions: dict[str, str]  # in words, by the transducer's address


class Dismissed(Struct, frozen=True):
    """The experimenter has dismissed the message of a failure."""


class NewSession(Struct, frozen=True):
    """The experimenter leaves an ended session for the page of a new one."""


class DrawingFailed(Struct, frozen=True):
    """A picture could not be drawn; the recording is not affected."""

    sentence: str


class LanguageChosen(Struct, frozen=True):
    """The subject's language for the next session was chosen."""

    language: str


Own = (
    Tick | Searching | DevicesFound | LifeKnown | Judged | TransducerHolders | Dismissed | NewSession | DrawingFailed
    | LanguageChosen
)  # fmt: skip
Message = m.Request | m.Report | Own  # messages of `fold`


@dataclass(frozen=True, slots=True)
class Zero:
    """A measured zero of the bench."""

    mean: m.Six  # as a load, nothing subtracted [N, N mm]
    noise: m.Six  # standard deviation [N, N mm]
    readings: int
    duration: float  # [s]


@dataclass(frozen=True, slots=True)
class BenchState:
    """The transducer and its health."""

    link: Link = "none"
    uri: str = ""
    info: TransducerInfo | None = None
    frame: Frame | None = None  # of a simulated or recorded bench
    problem: str | None = None  # why the link is lost or failed
    refused_uri: str = ""  # address of a transducer that could not be opened
    searching: bool = False
    searched: bool = False  # a search has ended since the last connecting or disconnecting
    devices: tuple[Probe, ...] = ()
    health: Health = field(default_factory=Health)
    rate: float = float("nan")  # measured [Hz]
    load: Load = field(default_factory=Load)
    peak: Load = field(default_factory=Load)  # since it was acknowledged
    saturated: int = 0  # since it was acknowledged
    silence: float = 0.0  # since the newest reading [s]
    taring: bool = False
    zero: Zero | None = None  # the latest
    first_zero: Zero | None = None  # the first since the bench was connected
    life: Life | None = None  # of its serial number, if it has a history


def _fold_link(bench: BenchState, message: Message) -> BenchState:
    match message:
        case m.Connect(uri):
            return BenchState(link="connecting", uri=uri, devices=bench.devices)
        case m.Device(info, frame):
            return replace(bench, link="open", info=info, frame=frame, uri=info.uri, problem=None, life=None)
        case m.NoDevice() if bench.link != "connecting":  # else the former one makes room
            return BenchState(devices=bench.devices, problem=bench.problem)
        case m.Failed("Connect", sentence):
            return BenchState(devices=bench.devices, problem=sentence, refused_uri=bench.uri)
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
            return BenchState(devices=bench.devices)  # the transducer is gone with the recorder's process
        case _:
            return bench


def _fold_readings(bench: BenchState, message: Message) -> BenchState:
    match message:
        case m.Tare():
            return replace(bench, taring=True)
        case m.Failed("Tare"):
            return replace(bench, taring=False)
        case m.Tared(mean, spread, readings, duration):
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
    # Noise of the axes is assumed independent in raw units: exact if the box itself combines the gauges.
    noise = tuple(np.sqrt(matrix**2 @ np.asarray(spread, float) ** 2).tolist())
    zero = Zero(force, noise, readings, duration)  # type: ignore[arg-type]  # six of each, as `matrix` has rows
    return replace(bench, zero=zero, first_zero=bench.first_zero or zero)


@dataclass(frozen=True, slots=True)
class AppState:
    """The whole state of the window."""

    now: float = 0.0  # [s] of the machine's monotonic clock
    last_report: float | None = None  # time of the recorder's last report [s]
    bench: BenchState = field(default_factory=BenchState)
    session: SessionState | None = None
    failure: m.Failed | None = None  # the last failed request
    exit_reason: str | None = None  # why the recorder's process has ended
    drawing_error: str | None = None  # of a picture
    language: str = ENGLISH  # of the next session's subject, as chosen
    holders: Mapping[str, str] = field(default_factory=dict)  # other recorders' sessions, by transducer address

    @property
    def holder(self) -> str:
        """Return the session whose recorder holds the transducer that could not be opened; "" if none does."""
        return self.holders.get(self.bench.refused_uri, "")


def fold(state: AppState, message: Message) -> AppState:
    """Return the state after a message: a request to the recorder, a report from it, or the window's own."""
    if type(message) in _FROM_RECORDER:
        state = replace(state, last_report=state.now)
    if state.failure is not None and state.failure.request == type(message).__name__:  # it is tried again
        state = replace(state, failure=None)
    bench = _fold_readings(_fold_link(state.bench, message), message)
    session = state.session and session_after(state.session, message, state.now)
    if bench is not state.bench or session is not state.session:
        state = replace(state, bench=bench, session=session)
    if isinstance(message, TransducerHolders):
        return _fold_holders(state, message.sessions)
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


def _fold_holders(state: AppState, sessions: Mapping[str, str]) -> AppState:
    """Return the state with these holders of transducers; it says so if they let go of the one that was refused."""
    after = replace(state, holders=sessions)
    if not state.holder or after.holder:
        return after
    problem = tr("the recorder that held it has let it go; connect again, or resume its session")
    return replace(after, failure=None, bench=replace(state.bench, problem=problem, refused_uri=""))
