"""One answer as it is given, with every position, time and correction; and whose a key is meanwhile. No Qt."""

from dataclasses import dataclass, replace
from math import isfinite
from typing import Literal

from daq_app.window.view_subject import Kind
from sessions.plan.plan import Hand
from sessions.run.steps import MagnitudeEstimate, PairedChoice, Scored

Device = Literal["mouse", "touch", "pen", "keyboard"]
Which = Literal["first", "second"]

MIDDLE = 50.0  # where the first key press puts the mark, whichever key it is
STEP = 1.0  # an arrow moves the mark by so much ...
LEAP = 10.0  # ... and Page Up or Page Down by this
PAUSE = 1.0  # key presses further apart than this are two answers, not one [s]
DIGITS = 1  # of a score: a mark can be placed no finer
Owner = Literal["text", "answer", "course"]
GIVES = frozenset({"Enter", "Space"})  # the answer that stands
PLACES = frozenset({"Left", "Right", "Up", "Down", "PgUp", "PgDown", "Home", "End"})  # the mark on the line
TYPES = frozenset({*"0123456789.,", "Backspace", "Del"})  # a number
CHOOSES = frozenset({"1", "2", "Left", "Right"})  # one of two
ANSWERS: dict[Kind, frozenset[str]] = {
    "read": frozenset(),
    "line": PLACES | GIVES,
    "number": TYPES | GIVES,
    "choice": CHOOSES | GIVES,
}


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer so far; empty until the line was touched."""

    positions: tuple[tuple[float, float], ...] = ()  # (session clock [s], 0 to 100)
    corrections: int = 0  # how often an answer that stood was changed
    device: Device | None = None  # that gave the last position
    down: bool = False  # a finger or button is down

    @property
    def score(self) -> float | None:
        """Return where the mark stands; None before the first touch."""
        return round(self.positions[-1][1], DIGITS) if self.positions else None

    def pressed(self, time: float, position: float, device: Device) -> "Answer":
        """Return the answer after the line was touched, clicked or tapped on [s, 0 to 100]."""
        again = self.corrections + bool(self.positions)
        return replace(self._moved(time, position, device), corrections=again, down=True)

    def dragged(self, time: float, position: float, device: Device) -> "Answer":
        """Return the answer after what is held down has moved; one answer, however far it goes."""
        return self._moved(time, position, device) if self.down else self

    def released(self) -> "Answer":
        """Return the answer after the finger or button has left."""
        return replace(self, down=False)

    def stepped(self, time: float, by: float) -> "Answer":
        """Return the answer after a key moved the mark by so much; the first key puts it in the middle."""
        if not self.positions:
            return self._moved(time, MIDDLE, "keyboard")
        last, before = self.positions[-1]
        again = self.corrections + (time - last > PAUSE or self.device != "keyboard")
        return replace(self._moved(time, before + by, "keyboard"), corrections=again)

    def scored(self, hand: Hand | None) -> Scored:
        """Return the event of an answer that is given."""
        first = self.positions[0][0] if self.positions else None
        return Scored(self.score, self.positions, first, self.corrections, hand, self.device)

    def _moved(self, time: float, position: float, device: Device) -> "Answer":
        place = min(max(position, 0.0), 100.0)
        if self.positions and self.positions[-1][1] == place:
            return replace(self, device=device)
        return replace(self, positions=(*self.positions, (time, place)), device=device)


@dataclass(frozen=True, slots=True)
class Choice:
    """A number, or one of two, as it is given: what stands, and how it came to stand."""

    value: float | Which | None = None
    first_touch: float | None = None  # [s, session clock]
    corrections: int = 0  # how often another value took the place of one
    device: Device | None = None

    def chosen(self, time: float, value: Which, device: Device) -> "Choice":
        """Return the answer with one of two at `time` [s]."""
        first = time if self.first_touch is None else self.first_touch
        return Choice(value, first, self.corrections + (self.value not in (None, value)), device)

    def typed(self, time: float, number: float | None) -> "Choice":
        """Return the answer with another number in the field at `time` [s]; one that is not above 0 is none.

        What stands while a number is typed is not yet an answer that is corrected.
        """
        value = number if number is not None and number > 0.0 and isfinite(number) else None
        first = time if self.first_touch is None else self.first_touch
        return Choice(value, first, self.corrections, "keyboard")

    def judgement(self, hand: Hand | None) -> MagnitudeEstimate | PairedChoice:
        """Return the event of an answer that is given."""
        if self.value in ("first", "second"):
            return PairedChoice(self.value, self.first_touch, self.corrections, hand, self.device)
        number = self.value if isinstance(self.value, float) else None
        return MagnitudeEstimate(number, self.first_touch, self.corrections, hand, self.device)


def owner(key: str, asks: Kind, *, typing: bool, from_subject: bool = False) -> Owner:
    """Return whose a key is while the subject is asked for `asks`, whichever window has the keyboard.

    While the experimenter types, every key is the text's, also one that reached the subject's window; of those that
    the text leaves to its own window, none is an answer.

    >>> owner("1", "choice", typing=False), owner("1", "choice", typing=True), owner("1", "line", typing=False)
    ('answer', 'text', 'course')
    """
    if typing and (from_subject or key in ANSWERS[asks]):
        return "text"
    return "answer" if key in ANSWERS[asks] else "course"
