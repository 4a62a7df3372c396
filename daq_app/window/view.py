"""The window's view of its state: words, numbers and the message of each button. No Qt."""

from dataclasses import dataclass
from typing import Literal

from daq_app.recorder import messages as m
from daq_app.window.course_state import SessionState
from daq_app.window.state import AppState, Dismissed, Message
from daq_app.window.subject import SubjectView, Translate, mirror_view, subject_view
from daq_app.window.view_bench import SILENT, BenchView, bench_view, no_readings
from daq_app.window.view_course import CourseView, course_view
from daq_app.wording import sentence, tr, tr_noop
from sessions.recording.recovery import LIFT_PATIENCE

ENDED = {  # by how far the sealing is
    "no": tr_noop("ended"), "running": tr_noop("ended, being sealed"),
    "cut short": tr_noop("ended, not sealed"), "sealed": tr_noop("ended and sealed"),
}  # fmt: skip
UNSAVED = 3.0  # time without newly safe data after which the recording lamp goes out [s]


@dataclass(frozen=True, slots=True)
class Lamp:
    """Whether data are being stored, by the store's acknowledgements only."""

    grade: Literal["off", "on", "wrong"]
    text: str
    age: str  # age of the latest acknowledged data; empty without a session


@dataclass(frozen=True, slots=True)
class Banner:
    """One sentence that stays until its cause is gone."""

    grade: Literal["wrong", "look"]
    sentence: str
    action: str = ""  # label of its button; empty without one
    sends: Message | None = None


@dataclass(frozen=True, slots=True)
class View:
    """Everything the experimenter's window shows, except for the pictures."""

    heading: str
    simulated: str | None
    lamp: Lamp
    banner: Banner | None
    course: CourseView | None  # None: the page of a new session is shown
    bench: BenchView
    subject: SubjectView
    mirror: SubjectView | None = None  # the experimenter's view of it; None without a session


def derive_view(state: AppState, translate: Translate = str) -> View:
    """Return the view of a state; `translate` converts English to the subject's language."""
    session = state.session
    simulated = session.simulated if session else None
    if session is None and state.bench.info is not None and state.bench.info.simulated:
        simulated = tr("SIMULATED transducer")
    heading = tr("new session")
    if session is not None:
        heading = tr("subject {subject} · {protocol}", subject=session.plan.subject, protocol=session.plan.protocol)
    return View(
        heading=heading,
        simulated=simulated,
        lamp=_lamp(state),
        banner=_banner(state),
        course=None if session is None else course_view(session, state.bench, state.now),
        bench=bench_view(state.bench, recording=session is not None and not session.is_over, unheard=_unheard(state)),
        subject=subject_view(session, translate, state.language),
        mirror=None if session is None else mirror_view(session, translate),
    )


def _unheard(state: AppState) -> float:
    """Return the time since the recorder's last report [s]."""
    return 0.0 if state.last_report is None else state.now - state.last_report


def _lamp(state: AppState) -> Lamp:
    session = state.session
    if session is None:
        return Lamp("off", tr("not recording"), "")
    if session.fault is not None:
        return Lamp("wrong", tr("NOT RECORDING"), "")
    if session.end is not None:
        return Lamp("off", tr(ENDED[session.sealing]), "")
    running = duration(state.now - session.start)
    if session.saved_at is None:
        return Lamp("off", tr("starting {running}", running=running), tr("not saved yet"))
    age = state.now - session.saved_at
    saved_text = tr("saved {age:.1f} s ago", age=age)
    if age > UNSAVED or state.exit_reason is not None:
        return Lamp("wrong", tr("NOT RECORDING {running}", running=running), saved_text)
    return Lamp("on", tr("recording {running}", running=running), saved_text)


def _banner(state: AppState) -> Banner | None:
    """Return the most severe message as a banner, None if there is none."""
    session, bench = state.session, state.bench
    running = session is not None and not session.is_over
    if session is not None and (sentence_text := _cut_short(state, session)):
        return Banner("wrong", sentence_text)  # the current step's button resumes, if that is possible
    if state.exit_reason is not None and session is not None and session.sealing == "cut short":
        sentence_text = tr(
            "The recorder ended while sealing. Everything is saved: 'daq-app resume --end {folder}' seals it.",
            folder=session.folder,
        )
        return Banner("wrong", sentence_text)
    if state.exit_reason is not None:
        return Banner("wrong", sentence(state.exit_reason))
    if sentence_text := no_readings(bench, running=running):
        return Banner("wrong", sentence_text)
    if running and (age := _unheard(state)) > SILENT:
        warning = tr(
            "The recorder has not answered for {age:.0f} s: this computer or its disk may be busy. "
            "End other programs; what was saved is safe.",
            age=age,
        )
        return Banner("wrong", warning)
    if overloads := bench.peak.overloads:
        axes = ", ".join(tr(axis) for axis in overloads)
        warning = tr("Overload on {axes}: take the load off and check the transducer.", axes=axes)
        return Banner("wrong", warning, tr("Acknowledge"), m.AcknowledgeOverloads())
    if (failed := _failed_request(state)) is not None:
        return failed
    if state.drawing_error is not None:
        warning = tr("Part of the window failed ({problem}); the recording continues.", problem=state.drawing_error)
        return Banner("look", warning, tr("Dismiss"), Dismissed())
    if bench.link == "none" and bench.problem is not None:
        return Banner("look", tr("No transducer: {problem}", problem=bench.problem))
    return None


def _failed_request(state: AppState) -> Banner | None:
    """Return what the last failed request says; None if there is none."""
    if state.holder:
        text = tr(
            "The recorder of another session ({session}) holds this transducer. If its window is gone, it ends when "
            "the finger has lifted, after {patience:.0f} s at most. Then connect again, or resume that session.",
            session=state.holder,
            patience=LIFT_PATIENCE,
        )
        return Banner("look", text)
    if (failure := state.failure) is None:
        return None
    text = tr("The session was not resumed: {why}", why=failure.sentence)
    text = sentence(text if failure.request == "ResumeSession" else failure.sentence)
    return Banner("look", text, tr("Dismiss"), Dismissed())


def _cut_short(state: AppState, session: SessionState) -> str:
    """Return why a session ended early; empty if it ended as intended, or is being resumed."""
    end, bench, safe = session.end, state.bench, tr("What was saved until then is in {folder}.", folder=session.folder)
    if session.phase == "resuming":
        return ""
    if session.resumable and state.failure is not None and state.failure.request == "ResumeSession":
        reason = state.failure.sentence.rstrip(".")
        return tr("The session was not resumed: {why}. {kept}", why=reason, kept=safe)
    if session.fault is not None:
        return tr("The recording has stopped: {why}. {kept}", why=session.fault.rstrip("."), kept=safe)
    if end is None or end.cause in ("finished", "aborted", "stopped"):
        return ""
    reason = end.reason
    if end.cause == "device":
        reason = tr("the transducer went silent; it answers again") if bench.link == "open" else bench.problem or reason
    if end.cause == "disk":  # its reason names the safe data
        return tr("The session was cut short: {why}.", why=reason)
    return tr("The session was cut short: {why}. Everything until then is saved.", why=reason)


def duration(seconds: float) -> str:
    """Return a time as hours, minutes and seconds.

    >>> duration(761.4)
    '00:12:41'
    """
    total_s = max(int(seconds), 0)
    return f"{total_s // 3600:02d}:{total_s // 60 % 60:02d}:{total_s % 60:02d}"
