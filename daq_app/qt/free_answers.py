"""The other two ways to answer: a number on one's own scale, and which of two."""

from collections.abc import Callable

from PySide6.QtCore import QRegularExpression, Qt, Signal
from PySide6.QtGui import QKeyEvent, QRegularExpressionValidator
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QPushButton, QWidget

from daq_app.qt.parts import button, fill
from daq_app.qt.tokens import GRID
from daq_app.window.answer import Choice, Which
from daq_app.window.subject_texts import SubjectText as Text
from sessions.plan.plan import Hand
from sessions.run.steps import Event

POINTS = ".,\u066b\uff0e\uff0c"  # Latin, Arabic and full-width ones, before a number's fraction
NUMBER = QRegularExpression(
    rf"\d{{0,9}}[{POINTS}]?\d{{0,9}}", QRegularExpression.PatternOption.UseUnicodePropertiesOption
)  # what can be typed of one
LARGE = 36  # type of the number [device-independent pixels]
WORDS = 24  # type of the buttons
WIDE, HIGH = 220, 96  # a button, at least


class _Field(QWidget):
    """Takes an answer that is no place on a line."""

    changed = Signal()

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__()
        self.now = now
        self.answer = Choice()

    @property
    def answered(self) -> bool:
        """Say whether there is an answer."""
        return self.answer.value is not None

    def answer_event(self, hand: Hand | None) -> Event:
        """Return the answer."""
        return self.answer.judgement(hand)


class NumberField(_Field):
    """Takes a number above 0; a comma is a point."""

    def __init__(self, scale: float, now: Callable[[], float]) -> None:
        """Show an empty field; `now` tells the session clock [s]."""
        super().__init__(now)
        self.field = QLineEdit()
        self.field.setAccessibleName(Text.OWN_NUMBER)
        self.field.setFixedWidth(round(260 * scale))
        self.field.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.field.setStyleSheet(f"font-size: {round(LARGE * scale)}px;")
        self.field.setValidator(QRegularExpressionValidator(NUMBER, self.field))
        self.field.textEdited.connect(self._typed)
        fill(QHBoxLayout(self), 1, self.field, 1)
        self.setFocusProxy(self.field)

    def begin(self) -> None:
        """Begin another answer."""
        self.answer = Choice()
        self.field.clear()
        self.changed.emit()

    def _typed(self, text: str) -> None:
        try:
            number = float(text.strip().translate(dict.fromkeys(map(ord, POINTS), ".")))
        except ValueError:
            number = None
        self.answer = self.answer.typed(self.now(), number)
        self.changed.emit()


class ChoiceOfTwo(_Field):
    """Two buttons of the same size; the one that is chosen stays pressed."""

    def __init__(self, scale: float, now: Callable[[], float]) -> None:
        """Show two buttons; `now` tells the session clock [s]."""
        super().__init__(now)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(Text.OF_TWO)
        self.first = self._button(Text.FIRST, "first", scale)
        self.second = self._button(Text.SECOND, "second", scale)
        layout = QHBoxLayout(self)
        layout.setSpacing(4 * GRID)
        fill(layout, 1, self.first, self.second, 1)

    def begin(self) -> None:
        """Begin another answer."""
        self._take(Choice())

    def set_words(self, first: str, second: str) -> None:
        """Name the buttons."""
        for choice, words in ((self.first, first), (self.second, second)):
            choice.setText(words)
            choice.setAccessibleName(words)

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Choose with 1 and 2, or the arrows: the first stands where reading begins."""
        mirrored = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        keys: dict[int, Which] = {
            Qt.Key.Key_1: "first",
            Qt.Key.Key_Right if mirrored else Qt.Key.Key_Left: "first",
            Qt.Key.Key_2: "second",
            Qt.Key.Key_Left if mirrored else Qt.Key.Key_Right: "second",
        }
        if event.key() in keys:
            self._take(self.answer.chosen(self.now(), keys[event.key()], "keyboard"))
        else:
            super().keyPressEvent(event)

    def _button(self, words: str, which: Which, scale: float) -> QPushButton:
        choice = button(words, words, lambda: self._take(self.answer.chosen(self.now(), which, "mouse")))
        choice.setCheckable(True)
        choice.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        # In a sheet of its own: the window's sets the height of every button.
        size = f"min-width: {round(WIDE * scale)}px; min-height: {round(HIGH * scale)}px;"
        choice.setStyleSheet(f"font-size: {round(WORDS * scale)}px; {size}")
        return choice

    def _take(self, answer: Choice) -> None:
        self.answer = answer
        self.first.setChecked(answer.value == "first")
        self.second.setChecked(answer.value == "second")
        self.changed.emit()
