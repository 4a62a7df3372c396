"""What the window knows: one frozen state, and how each message changes it. No Qt, no clock, no file."""

from dataclasses import dataclass, field, replace

from daq_app.recorder import messages as m
from daq_app.window.bench_state import BenchState, bench_after
from daq_app.window.course_state import SessionState, session_after, session_begun
from daq_app.window.messages import Dismissed, DrawingFailed, LanguageChosen, Message, NewSession, Tick
from sessions.plan.protocols.languages import ENGLISH

_FROM_RECORDER = frozenset(m.REPORTS)


@dataclass(frozen=True, slots=True)
class AppState:
    """Everything the window knows."""

    now: float = 0.0  # [s] of the machine's monotonic clock
    heard: float | None = None  # when the recorder was last heard [s]
    bench: BenchState = field(default_factory=BenchState)
    session: SessionState | None = None
    failed: m.Failed | None = None  # the last request that could not be met
    gone: str | None = None  # why the recorder's process is not there any more
    drawing: str | None = None  # what could not be drawn
    language: str = ENGLISH  # that the next session's subject reads, as it is chosen


def fold(state: AppState, message: Message) -> AppState:
    """Return the state after a message: what was sent to the recorder, what came from it, or the window's own."""
    if type(message) in _FROM_RECORDER:
        state = replace(state, heard=state.now)
    bench = bench_after(state.bench, message)
    session = state.session and session_after(state.session, message, state.now)
    if bench is not state.bench or session is not state.session:
        state = replace(state, bench=bench, session=session)
    return _of_the_window(_of_the_session(state, message), message)


def _of_the_session(state: AppState, message: Message) -> AppState:
    match message:
        case m.SessionBegun():
            return replace(state, session=session_begun(message, state.now), failed=None)
        case m.StartSession() | m.ResumeSession():
            return replace(state, failed=None)
        case NewSession() if state.session is not None and state.session.over:
            return replace(state, session=None)
        case m.Failed():
            return replace(state, failed=message)
        case m.Gone(requested, sentence):
            return replace(state, gone=None if requested else sentence)
        case _:
            return state


def _of_the_window(state: AppState, message: Message) -> AppState:
    match message:
        case Tick(now):
            return replace(state, now=now)
        case Dismissed():
            return replace(state, failed=None, drawing=None)
        case DrawingFailed(sentence):
            return replace(state, drawing=sentence)
        case LanguageChosen(language):
            return replace(state, language=language)
        case _:
            return state
