"""What the subject sees: nothing that gives the stimulus away, save what the protocol says is to be shown."""

from dataclasses import dataclass, replace
from typing import Literal

from daq_app.window.course_state import SessionState
from daq_app.window.subject_texts import SubjectText as Text
from daq_app.window.subject_texts import Translate, usual_question
from sessions.plan.plan import Hand
from sessions.plan.protocols.languages import ENGLISH
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
    language: str = ENGLISH
    force: bool = False  # how hard the finger presses is shown; never how hard it drags, which tells the surface

    @property
    def asks(self) -> bool:
        """Say whether an answer is waited for."""
        return self.kind != "read"


def subject_view(session: SessionState | None, translate: Translate = str, language: str = ENGLISH) -> SubjectView:
    """Return what is shown to the subject now, in the language that `translate` makes of English.

    `language` is the code of the one that is chosen before there is a session, which has its own.
    """
    if session is None:
        return SubjectView("read", translate(Text.WELCOME), translate(Text.BEGINS), language=language)
    return replace(_Page(session, translate).view(), language=session.plan.language)


def mirror_view(session: SessionState, translate: Translate = str) -> SubjectView:
    """Return what the experimenter sees of the subject's page, without what the protocol keeps from the experimenter.

    The bar of the force is left out too: in a picture that stands still it would show none.
    """
    plan = session.plan
    kept = {"forces", *({"trial count"} - set(plan.shown.experimenter))}
    shown = replace(plan.shown, subject=tuple(one for one in plan.shown.subject if one not in kept))
    return subject_view(replace(session, plan=replace(plan, shown=shown)), translate)


@dataclass(frozen=True, slots=True)
class _Page:
    """What a session in hand shows."""

    session: SessionState
    say: Translate

    def view(self) -> SubjectView:
        session, shown = self.session, self.session.plan.shown.subject
        match session.phase:
            case "idle":
                return self._read(self.say(Text.WELCOME), self.say(Text.BEGINS))
            case "mounting" | "taring":
                return self._read(self.say(Text.WAIT), self._notice(self.say(Text.HANDS_OFF)))
            case "ready" | "stroking":
                force = session.plan.forces and "forces" in shown
                instruction = session.block.instruction if session.block and "instruction" in shown else ""
                return replace(self._read(self._stroke(), self._notice(instruction)), force=force)
            case "scoring":
                return self._question()
            case "settling":
                return self._read(self.say(Text.THANKS), self.say(Text.LIFT))
            case "resting":
                return self._read(self.say(Text.REST), self.say(Text.RESTING))
            case "paused" | "resuming":
                return self._read(self.say(Text.PAUSE), self.say(Text.GOES_ON))
            case "closing" | "ended" if session.resumable:
                return self._read(self.say(Text.PAUSE), self.say(Text.GOES_ON))
            case "closing" | "ended":
                return self._read(self.say(Text.THANKS), self.say(Text.REST_HAND))

    def _read(self, title: str, text: str = "") -> SubjectView:
        return SubjectView("read", title, text, hand=self.session.plan.answering_hand or "right")

    def _stroke(self) -> str:
        trial = self.session.of(self.session.trial)
        allowed = 1 if trial is None else self.session.plan.strokes_allowed(trial.trial)
        return self.say(Text.STROKE) if allowed == 1 else self.say(Text.STROKES).format(number=allowed)

    def _notice(self, to_do: str) -> str:
        """Return what to do with the finger, and what the protocol lets the subject know beside it."""
        session = self.session
        shown, trial = session.plan.shown.subject, session.of(session.trial)
        parts = [to_do]
        if session.block is not None and session.block.phase == "practice":
            parts.insert(0, self.say(Text.PRACTICE))
        if trial is not None and "trial count" in shown:
            parts.append(self.say(Text.COUNT).format(number=trial.trial.number, count=len(session.trials)))
        if trial is not None and "code" in shown:
            parts.append(self.say(Text.SAMPLE).format(code=trial.trial.stimulus.code))
        return " ".join(part for part in parts if part)

    def _question(self) -> SubjectView:
        trial, hand = self.session.of(self.session.trial), self.session.plan.answering_hand or "right"
        if trial is None:
            return self._read(self.say(Text.WAIT))
        key = (trial.trial.number, trial.takes)
        match self.session.command:
            case steps.AskScore(_, ends, ticks, question):
                title = question or self._judge(trial.trial.stimulus.descriptor)
                return SubjectView("line", title, "", ends, ticks, key, hand)
            case steps.AskNumber(_, question):
                title = question or self._judge(trial.trial.stimulus.descriptor)
                return SubjectView("number", title, self.say(Text.NUMBER), key=key, hand=hand)
            case steps.AskChoice(_, _, question):
                return SubjectView("choice", question or self.say(Text.WHICH), "", key=key, hand=hand)
            case _:
                return self._read(self.say(Text.WAIT))

    def _judge(self, descriptor: str) -> str:
        """Return the usual question; a descriptor is a word of the protocol's own language."""
        if self.session.plan.language == ENGLISH:
            return usual_question(descriptor)
        return self.say(Text.JUDGE)
