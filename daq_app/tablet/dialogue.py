"""The conversation with the tablet: which page it shows, and what becomes of its answers. No Qt."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from daq_app.tablet.messages import Act, AnswerGiven, Page, Stored, ToTablet
from daq_app.window.answer import Answer, Choice
from daq_app.window.course_state import SessionState
from daq_app.window.subject_texts import SubjectText as Text
from daq_app.window.subject_texts import Translate
from daq_app.window.view_subject import Kind, SubjectView
from sessions.plan.plan import Hand
from sessions.run.steps import Event, MagnitudeEstimate, Note, PairedChoice, Scored

Answered = Scored | MagnitudeEstimate | PairedChoice
ANSWERS: Mapping[Kind, tuple[type, ...]] = {
    "read": (),
    "line": (Scored,),
    "number": (MagnitudeEstimate,),
    "choice": (PairedChoice,),
}
WORDS = (
    Text.NEXT,
    Text.FIRST,
    Text.SECOND,
    Text.THANKS,
    Text.OFFLINE,
    Text.LINE,
    Text.UNANSWERED,
    Text.ANSWERED,
    Text.OWN_NUMBER,
    Text.OF_TWO,
    Text.PRESSING,
)  # of the page itself


class Dialogue:
    """Sends the subject's page, and hands each answer on once."""

    def __init__(self, send: Callable[[ToTablet], None]) -> None:
        """Begin; `send` takes what goes to the tablet."""
        self._send = send
        self._page: Page | None = None
        self._session: SessionState | None = None
        self._waiting: set[str] = set()  # keys of answers that were handed on and are not yet stored

    def show(self, view: SubjectView, session: SessionState | None, say: Translate, *, mirrored: bool) -> None:
        """Show a page, in the language that `say` makes of English, and acknowledge the answers that are stored.

        `mirrored` says that the language is read from right to left.
        """
        self._session = session
        if session is None or session.over:
            self._waiting.clear()  # what the recorder has not stored is sent again
        for key in tuple(self._waiting):
            self._acknowledge(key)
        page = Page(
            view.kind,
            _key(session, *view.key) if view.asks and session is not None else "",
            view.title,
            view.text,
            view.ends,
            view.ticks,
            view.hand,
            view.language,
            "rtl" if mirrored else "ltr",
            view.force,
            session is None,
            {word.name.lower(): say(word) for word in WORDS},
        )
        if page != self._page:
            self._page = page
            self._send(page)

    def take(self, answer: AnswerGiven, clock: Callable[[float], float]) -> Event | None:
        """Return the recorder's command for an answer; None where it knows already, or no session runs.

        `clock` makes of the tablet's clock [ms] that of the session [s]. An answer that nobody asks for any more is
        returned as a note, so that it is not lost.
        """
        session, page, key = self._session, self._page, answer.key
        if session is None or session.over or page is None or key in self._waiting or self._acknowledge(key):
            return None
        event = event_of(answer.acts, clock, session.plan.answering_hand)
        if key == page.key and isinstance(event, ANSWERS[page.kind]):
            self._waiting.add(key)
            return event
        self._send(Stored(key))
        return Note(f"The tablet gave an answer that was no longer asked for ({key}): {_value(event)}")

    def _acknowledge(self, key: str) -> bool:
        """Tell the tablet that an answer is stored, where it is; return whether it is."""
        session = self._session
        if session is None:
            return False
        stored = any(of.answer is not None and _key(session, of.trial.number, of.takes) == key for of in session.trials)
        if stored:
            self._waiting.discard(key)
            self._send(Stored(key))
        return stored


def event_of(acts: Sequence[Act], clock: Callable[[float], float], hand: Hand | None) -> Answered:
    """Return the answer that the acts of a subject make."""
    line, choice = Answer(), Choice()
    for act in acts:
        time = clock(act.time)
        match act.kind, act.value:
            case "press", float(position):
                line = line.pressed(time, position, act.device)
            case "drag", float(position):
                line = line.dragged(time, position, act.device)
            case "release", _:
                line = line.released()
            case "step", float(by):
                line = line.stepped(time, by)
            case "number", float() | None as number:
                choice = choice.typed(time, number)
            case "choose", "first" | "second" as which:
                choice = choice.chosen(time, which, act.device)
            case _:
                pass  # a value that does not go with its act
    return choice.judgement(hand) if choice != Choice() else line.released().scored(hand)


def _value(event: Answered) -> float | str | None:
    """Return what an answer says."""
    match event:
        case Scored(score):
            return score
        case MagnitudeEstimate(number):
            return number
        case PairedChoice(choice):
            return choice


def _key(session: SessionState, trial: int, take: int) -> str:
    """Return the name of a question that no other question in any session has."""
    return f"{Path(session.folder).name}, trial {trial}, take {take}"
