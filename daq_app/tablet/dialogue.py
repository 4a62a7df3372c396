"""Messages between the tablet and the program, the page shown, and the handling of its answers. No Qt."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct, structs

from daq_app.window.course_state import SessionState
from daq_app.window.subject import Answer, Choice, Device, Kind, SubjectView, Translate, Which
from daq_app.window.subject import SubjectText as Text
from sessions.plan.plan import Hand
from sessions.run.steps import Event, MagnitudeEstimate, Note, PairedChoice, Scored

LARGEST = 1 << 24  # of a message [bytes]: an hour of an answer's positions, 60 a second
Short = Annotated[str, Meta(max_length=200)]
PixelsPerMm = Annotated[float, Meta(ge=1.0, le=40.0)]

# ---- from the tablet
AnswerEvent = Scored | MagnitudeEstimate | PairedChoice
_ANSWERS: Mapping[Kind, tuple[type, ...]] = {
    "read": (), "line": (Scored,), "number": (MagnitudeEstimate,), "choice": (PairedChoice,),
}  # fmt: skip
_WORDS = (  # of the page itself
    Text.NEXT, Text.FIRST, Text.SECOND, Text.THANKS, Text.OFFLINE, Text.LINE, Text.UNANSWERED, Text.ANSWERED,
    Text.OWN_NUMBER, Text.TWO_MEANINGS, Text.OF_TWO, Text.PRESSING,
)  # fmt: skip


class Hello(Struct, frozen=True, tag="hello"):
    """A tablet's first message, with the typed code, or with the token it got for that code."""

    code: Short = ""
    token: Short = ""
    pixels_per_mm: PixelsPerMm | None = None  # CSS pixels; None: not measured with a ruler


class Ruler(Struct, frozen=True, tag="ruler"):
    """The line was measured with a ruler."""

    pixels_per_mm: PixelsPerMm


class Act(Struct, frozen=True, array_like=True):
    """One act of the subject on the page."""

    time: float  # clock of the tablet [ms]
    kind: Literal["press", "drag", "release", "step", "number", "choose"]
    value: float | Which | None  # 0 to 100 on the line, a step on it, a number, or one of two
    device: Device


class AnswerGiven(Struct, frozen=True, tag="given"):
    """An answer, sent repeatedly until it is stored."""

    key: Short  # of the question
    acts: tuple[Act, ...]
    sent: float  # clock of the tablet [ms]


FromTablet = Hello | Ruler | AnswerGiven

# ---- to the tablet


class Welcome(Struct, frozen=True, tag="welcome"):
    """The tablet is admitted; it reconnects with the token."""

    token: str


class Refused(Struct, frozen=True, tag="refused"):
    """The tablet is not admitted."""

    sentence: str


class Page(Struct, frozen=True, tag="page"):
    """The page to show."""

    view: SubjectView
    key: str  # of the question; empty if none is asked
    direction: Literal["ltr", "rtl"]
    setting: bool  # no session is running: the tablet is being set up
    words: dict[str, str]  # the page's own, in the subject's language


class Stored(Struct, frozen=True, tag="stored"):
    """The answer to a question is stored, or no longer needed: the tablet stops sending it."""

    key: str


class Force(Struct, frozen=True, tag="force"):
    """The normal force of the finger."""

    part: float  # of the bar [-]


ToTablet = Welcome | Refused | Page | Stored | Force

decode = msgspec.json.Decoder(FromTablet).decode  # raises msgspec.DecodeError for other messages


def encode(message: ToTablet) -> str:
    """Return a message as JSON text."""
    return msgspec.json.encode(message).decode()


class Dialogue:
    """Sends the subject's page, and passes each answer on once."""

    def __init__(self, send: Callable[[ToTablet], None]) -> None:
        """Begin; `send` takes messages to the tablet."""
        self._send = send
        self._page: Page | None = None
        self._session: SessionState | None = None
        self._open_keys: set[str] = set()  # keys of answers passed on and not yet stored

    def show(self, view: SubjectView, session: SessionState | None, translate: Translate, *, mirrored: bool) -> None:
        """Show a page through `translate`, right to left if `mirrored`, and acknowledge answers now stored."""
        self._session = session
        if session is None or session.is_over:
            self._open_keys.clear()  # answers not stored are sent again
        for key in tuple(self._open_keys):
            self._acknowledge(key)
        key = _key(session, *view.key) if view.asks and session is not None else ""
        texts = {word.name.lower(): translate(word) for word in _WORDS}
        page = Page(view, key, "rtl" if mirrored else "ltr", session is None, texts)
        if page != self._page:
            if self._page is not None and self._page.key != key:
                self._open_keys.discard(key)  # asked again: the recorder refused its answer, as in a pause
            self._page = page
            self._send(page)

    def take(self, answer: AnswerGiven, clock: Callable[[float], float]) -> Event | None:
        """Return the recorder's event for an answer; None if it has that answer already, or no session is running.

        `clock` converts the tablet's clock [ms] to the session's [s]. An answer no longer needed becomes a note.
        In a pause none is taken, because the tablet sends it again when its question is repeated.
        """
        session, page, key = self._session, self._page, answer.key
        if session is None or session.is_over or page is None or self._acknowledge(key):
            return None
        if session.phase == "paused" or (key == page.key and key in self._open_keys):
            return None
        event = event_of(answer.acts, clock, session.plan.answering_hand)
        if key == page.key and isinstance(event, _ANSWERS[page.view.kind]):
            self._open_keys.add(key)
            return event
        self._open_keys.discard(key)
        self._send(Stored(key))
        return Note(f"The tablet answered a question that was no longer open ({key}): {structs.astuple(event)[0]}")

    def _acknowledge(self, key: str) -> bool:
        """Confirm to the tablet an answer that is stored; return whether it is."""
        session = self._session
        if session is None:
            return False
        answers = (trial for trial in session.trials if trial.answer is not None)
        safe = any(_key(session, trial.trial.number, trial.takes) == key for trial in answers)
        if safe:
            self._open_keys.discard(key)
            self._send(Stored(key))
        return safe


def event_of(acts: Sequence[Act], clock: Callable[[float], float], hand: Hand | None) -> AnswerEvent:
    """Return the answer event made of a subject's acts."""
    line, choice = Answer(), Choice()
    for act in acts:
        time = clock(act.time)
        match act.kind, act.value:
            case "press", float(position):
                line = line.press(time, position, act.device)
            case "drag", float(position):
                line = line.drag(time, position, act.device)
            case "release", _:
                line = line.release()
            case "step", float(step):
                line = line.step(time, step)
            case "number", float() | None as number:
                choice = choice.type_number(time, number)
            case "choose", "first" | "second" as option:
                choice = choice.choose(time, option, act.device)
            case _:
                pass  # a value that does not match its act
    return choice.judgement(hand) if choice != Choice() else line.release().judgement(hand)


def _key(session: SessionState, trial: int, take: int) -> str:
    """Return a name of a question that is unique over all sessions."""
    return f"{Path(session.folder).name}, trial {trial}, take {take}"
