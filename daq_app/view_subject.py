"""What the subject sees: never a code, an index or a score, so that nothing gives the stimulus away."""

from dataclasses import dataclass
from typing import Literal

from daq_app.course_state import SessionState
from sessions import steps


@dataclass(frozen=True, slots=True)
class SubjectView:
    """One page for the subject."""

    kind: Literal["wait", "read", "stroke", "scale"]
    title: str
    text: str = ""
    ends: tuple[str, str] = ("", "")
    key: tuple[int, int] = (0, 0)  # trial and take: another one begins with an empty line
    hand: Literal["left", "right"] = "right"  # that answers: where Next stands


def subject_view(session: SessionState | None) -> SubjectView:
    """Return what is shown to the subject now."""
    if session is None:
        return SubjectView("wait", "Welcome", "The experimenter will begin in a moment.")
    hand = session.plan.answering_hand or "right"
    instruction = session.block.instruction if session.block else ""
    match session.phase:
        case "idle":
            return SubjectView("wait", "Welcome", "The experimenter will begin in a moment.", hand=hand)
        case "mounting" | "taring":
            return SubjectView("read", "Please wait", instruction, hand=hand)
        case "ready" | "stroking":
            return SubjectView("stroke", "Stroke the surface once", instruction, hand=hand)
        case "scoring":
            return _scale(session, hand)
        case "paused" | "resuming":
            return SubjectView("wait", "Pause", "The experimenter will go on in a moment.", hand=hand)
        case "closing" | "ended":
            return SubjectView("wait", "Thank you", "You can rest your hand now.", hand=hand)


def _scale(session: SessionState, hand: Literal["left", "right"]) -> SubjectView:
    trial = session.of(session.trial)
    if trial is None or not isinstance(session.asked, steps.AskScore):
        return SubjectView("wait", "Please wait", hand=hand)
    title = f"Judge the {trial.trial.stimulus.descriptor} of the surface"
    key = (trial.trial.number, trial.takes)
    return SubjectView("scale", title, "", session.asked.scale_ends, key, hand)
