"""What the window shows of what it knows: words, numbers and what each button would send. No Qt."""

from dataclasses import dataclass
from typing import Literal

from daq_app.recorder import messages as m
from daq_app.window import view_bench, view_course, view_subject
from daq_app.window.course_state import SessionState
from daq_app.window.messages import Dismissed, Message
from daq_app.window.state import AppState
from daq_app.window.subject_texts import Translate
from daq_app.window.view_bench import BenchView
from daq_app.window.view_course import CourseView
from daq_app.window.view_subject import SubjectView
from daq_app.wording import sentence, tr

SILENT = 3.0  # a recorder that was not heard for longer is said to be silent [s]
UNSAVED = 3.0  # the recording lamp goes out when nothing became safe for longer [s]


@dataclass(frozen=True, slots=True)
class Lamp:
    """Whether what happens is being written down; fed by the store's acknowledgement alone."""

    grade: Literal["off", "on", "wrong"]
    words: str
    saved: str  # how old the last acknowledged thing is; empty where there is no session


@dataclass(frozen=True, slots=True)
class Banner:
    """One sentence that stays until its cause is gone."""

    grade: Literal["wrong", "look"]
    sentence: str
    action: str = ""  # label of its button; empty where there is none
    sends: Message | None = None


@dataclass(frozen=True, slots=True)
class View:
    """Everything the experimenter's window shows, save for the pictures."""

    heading: str
    simulated: str | None
    lamp: Lamp
    banner: Banner | None
    course: CourseView | None  # None: the page of a new session is shown
    bench: BenchView
    subject: SubjectView
    mirror: SubjectView | None = None  # what of it the experimenter sees; None where no session is in hand


def derive_view(state: AppState, translate: Translate = str) -> View:
    """Return what is to be shown of a state; `translate` makes the subject's language of English."""
    session = state.session
    simulated = session.simulated if session else None
    if session is None and state.bench.info is not None and state.bench.info.simulated:
        simulated = tr("SIMULATED transducer")
    return View(
        heading=tr("new session")
        if session is None
        else tr("subject {subject} · {protocol}", subject=session.plan.subject, protocol=session.plan.protocol),
        simulated=simulated,
        lamp=_lamp(state),
        banner=_banner(state),
        course=None if session is None else view_course.course_view(session, state.bench, state.now),
        bench=view_bench.bench_view(state.bench, recording=session is not None and not session.over),
        subject=view_subject.subject_view(session, translate, state.language),
        mirror=None if session is None else view_subject.mirror_view(session, translate),
    )


def _lamp(state: AppState) -> Lamp:
    session = state.session
    if session is None:
        return Lamp("off", tr("not recording"), "")
    if session.broken is not None:
        return Lamp("wrong", tr("NOT RECORDING"), "")
    if session.end is not None:
        return Lamp("off", _ended_words(session), "")
    running = duration(state.now - session.begun)
    if session.saved is None:
        return Lamp("off", tr("starting {running}", running=running), tr("not saved yet"))
    age = state.now - session.saved
    saved = tr("saved {age:.1f} s ago", age=age)
    if age > UNSAVED or state.gone is not None:
        return Lamp("wrong", tr("NOT RECORDING {running}", running=running), saved)
    return Lamp("on", tr("recording {running}", running=running), saved)


def _ended_words(session: SessionState) -> str:
    words = {
        "no": tr("ended"),
        "running": tr("ended, being sealed"),
        "cut short": tr("ended, not sealed"),
        "sealed": tr("ended and sealed"),
    }
    return words[session.sealing]


def _banner(state: AppState) -> Banner | None:
    """Return the worst that is to be said; one at a time."""
    session, bench = state.session, state.bench
    running = session is not None and not session.over
    if session is not None and (words := _cut_short(state, session)):
        again = m.ResumeSession(session.folder) if session.resumable else None
        return Banner("wrong", words, tr("Resume session") if again else "", again)
    if state.gone is not None and session is not None and session.sealing == "cut short":
        words = tr(
            "The recorder has ended while it sealed the session. Everything is kept: 'daq-app resume --end {folder}' "
            "seals it.",
            folder=session.folder,
        )
        return Banner("wrong", words)
    if state.gone is not None:
        return Banner("wrong", sentence(state.gone))
    if bench.link == "lost":
        lost = "" if not running else tr(" Readings are being lost; what came before is kept.")
        problem = (bench.problem or "").removeprefix("the transducer does not answer; ")  # which the banner says itself
        return Banner("wrong", tr("The transducer does not answer: {problem}.{lost}", problem=problem, lost=lost))
    if running and state.heard is not None and state.now - state.heard > SILENT:
        return Banner("wrong", tr("Nothing was heard from the recorder for {age:.0f} s.", age=state.now - state.heard))
    if over := bench.peak.over:
        words = tr(
            "Overload on {axes}: take the load off and check the transducer.", axes=", ".join(tr(axis) for axis in over)
        )
        return Banner("wrong", words, tr("Acknowledge"), m.AcknowledgeOverloads())
    if state.failed is not None:
        return Banner("look", sentence(state.failed.sentence), tr("Dismiss"), Dismissed())
    if state.drawing is not None:
        return Banner(
            "look",
            tr("Something in the window failed ({problem}); the recording goes on.", problem=state.drawing),
            tr("Dismiss"),
            Dismissed(),
        )
    if bench.link == "none" and bench.problem is not None:
        return Banner("look", tr("No transducer: {problem}", problem=bench.problem))
    return None


def _cut_short(state: AppState, session: SessionState) -> str:
    """Return why a session ended before its time; empty where it ended as somebody wished, or is being taken up."""
    end, bench, kept = session.end, state.bench, tr("What was saved until then is in {folder}.", folder=session.folder)
    if session.phase == "resuming":
        return ""
    if session.resumable and state.failed is not None and state.failed.request == "ResumeSession":
        return tr("The session was not taken up again: {why}. {kept}", why=state.failed.sentence.rstrip("."), kept=kept)
    if session.broken is not None:
        return tr("The recording has stopped: {why}. {kept}", why=session.broken.rstrip("."), kept=kept)
    if end is None or end.cause in ("finished", "aborted", "stopped"):
        return ""
    why = end.reason
    if end.cause == "device":
        why = tr("the transducer fell silent; it answers again") if bench.link == "open" else bench.problem or why
    return tr("The session was cut short: {why}. Everything until then is kept.", why=why)


def duration(seconds: float) -> str:
    """Return a time as hours, minutes and seconds.

    >>> duration(761.4)
    '00:12:41'
    """
    whole = max(int(seconds), 0)
    return f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}"
