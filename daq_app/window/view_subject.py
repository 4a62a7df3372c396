"""What the subject sees: nothing that gives the stimulus away, save what the protocol says is to be shown."""

from dataclasses import dataclass
from typing import Literal

from daq_app.window.course_state import SessionState
from sessions.plan.plan import Hand
from sessions.run import steps

Kind = Literal["read", "line", "number", "choice"]


@dataclass(frozen=True, slots=True)
class SubjectView:
    """One page for the subject."""

    kind: Kind  # something to read, or a way to answer
    title: str
    text: str = ""
    ends: tuple[str, str] = ("", "")  # of the line
    ticks: int = 0  # on the line, between its ends
    key: tuple[int, int] = (0, 0)  # trial and take: another one begins with an empty answer
    hand: Hand = "right"  # that answers: where Next stands
    force: bool = False  # how hard the finger presses is shown; never how hard it drags, which tells the surface

    @property
    def asks(self) -> bool:
        """Say whether an answer is waited for."""
        return self.kind != "read"


WAITING = ("Welcome", "The experimenter will begin in a moment.")
HANDS_OFF = "Keep your fingers off the surface."  # what to do on it is told when it is time to do it
THANKS = ("Thank you", "You can rest your hand now.")
PAUSE = ("Pause", "The experimenter will go on in a moment.")


def subject_view(session: SessionState | None) -> SubjectView:
    """Return what is shown to the subject now."""
    if session is None:
        return SubjectView("read", *WAITING)
    hand = session.plan.answering_hand or "right"
    match session.phase:
        case "idle":
            return SubjectView("read", *WAITING, hand=hand)
        case "mounting" | "taring":
            return SubjectView("read", "Please wait", _told(session, HANDS_OFF), hand=hand)
        case "ready" | "stroking":
            force = session.plan.forces and "forces" in session.plan.shown.subject
            return SubjectView("read", _stroke(session), _told(session, _instruction(session)), hand=hand, force=force)
        case "scoring":
            return _question(session, hand)
        case "settling":
            return SubjectView("read", "Thank you", "Please lift your finger off the surface.", hand=hand)
        case "resting":
            return SubjectView("read", "Rest", "Rest your hand. The experimenter will go on with you.", hand=hand)
        case "paused" | "resuming":
            return SubjectView("read", *PAUSE, hand=hand)
        case "closing" | "ended":
            return SubjectView("read", *(PAUSE if session.resumable else THANKS), hand=hand)


def _stroke(session: SessionState) -> str:
    trial = session.of(session.trial)
    allowed = 1 if trial is None else session.plan.strokes_allowed(trial.trial)
    return "Stroke the surface once" if allowed == 1 else f"Stroke the surface up to {allowed} times"


def _instruction(session: SessionState) -> str:
    return session.block.instruction if session.block and "instruction" in session.plan.shown.subject else ""


def _told(session: SessionState, to_do: str) -> str:
    """Return what to do with the finger, and what the protocol lets the subject know beside it."""
    shown, trial = session.plan.shown.subject, session.of(session.trial)
    parts: list[str] = []
    if session.block is not None and session.block.phase != "main":
        parts.append("This one is for practice." if session.block.phase == "practice" else "")
    parts.append(to_do)
    if trial is not None and "trial count" in shown:
        parts.append(f"Surface {trial.trial.number} of {len(session.trials)}.")
    if trial is not None and "code" in shown:
        parts.append(f"Sample {trial.trial.stimulus.code}.")
    return " ".join(part for part in parts if part)


def _question(session: SessionState, hand: Hand) -> SubjectView:
    trial = session.of(session.trial)
    if trial is None:
        return SubjectView("read", "Please wait", hand=hand)
    key = (trial.trial.number, trial.takes)
    usual = f"Judge the {trial.trial.stimulus.descriptor} of the surface"
    match session.asked:
        case steps.AskScore(_, ends, ticks, question):
            return SubjectView("line", question or usual, "", ends, ticks, key, hand)
        case steps.AskNumber(_, question):
            text = "Give a number above 0, on your own scale."
            return SubjectView("number", question or usual, text, key=key, hand=hand)
        case steps.AskChoice(_, _, question):
            return SubjectView("choice", question or "Which one?", "", key=key, hand=hand)
        case _:
            return SubjectView("read", "Please wait", hand=hand)
