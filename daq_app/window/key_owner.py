"""Whose a key is: the text's that is being typed, the subject's answer, or the session's course. No Qt."""

from typing import Literal

from daq_app.window.view_subject import Kind

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
