"""Labels, buttons and panels of the window, with a common look and names for screen readers."""

import re
from collections.abc import Callable, Iterable

from PySide6.QtCore import QByteArray, QEvent, QSize, Qt
from PySide6.QtGui import QKeyEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QComboBox,
    QFrame,
    QGridLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from daq_app.qt.layout import hbox, vbox
from daq_app.qt.preferences import DRAWER, DRAWER_SIZES, settings
from daq_app.qt.tokens import GRID, TARGET
from daq_app.wording import tr

SHARES = (500, 300)  # of the width, before the handle is moved [-]


def label(text: str = "", role: str = "value", *, wrap: bool = False) -> QLabel:
    """Return a label; `role` is one of the style sheet's."""
    text_label = QLabel(text, textFormat=Qt.TextFormat.PlainText, wordWrap=wrap)
    text_label.setProperty("role", role)
    return text_label


# Spaces without a line break: between number and unit, symbol and number, and before a dot that separates facts.
_TIES = re.compile(
    r"(?<=\d) (?=(?:[%°]|[mkµM]?(?:N|Pa|Hz|m|s|B)[²³]?)(?!\w))|(?<=N) (?=mm\b)|(?<=[µ±×≤τ]) (?=[\d−–m])"
    r"|(?<=\d) (?=of \d)|(?<=\d of) (?=\d)| (?=·)"
)
_LONG, _TEN = re.compile(r"[^\s/]{30,}"), re.compile(".{10}")  # word, and its parts


def breakable(text: str) -> str:
    r"""Return a text that may wrap within a long word, but not within a quantity.

    >>> breakable("µ 0.43, 2 N mm · 10 % of 3 trials, 5 of 10").split(" ")
    ['µ\xa00.43,', '2\xa0N\xa0mm\xa0·', '10\xa0%', 'of', '3', 'trials,', '5\xa0of\xa010']
    >>> breakable(f"subject {'W' * 32}").split("\u200b")
    ['subject WWWWWWWWWW', 'WWWWWWWWWW', 'WWWWWWWWWW', 'WW']
    """
    return _LONG.sub(lambda word: _TEN.sub("\\g<0>\u200b", word[0]), _TIES.sub("\u00a0", text))


def whole_facts(row: str) -> str:
    r"""Return a row of facts, two or more spaces apart, that wraps only between facts.

    >>> whole_facts("✓  3  R29   no answer")
    '✓  3  R29   no\xa0answer'
    """
    return re.sub(r"(?<! ) (?! )", "\u00a0", row)


class Panel(QFrame):
    """A frame with a role of the style sheet and a name for screen readers."""

    def __init__(self, name: str = "", role: str = "panel") -> None:
        super().__init__()
        self.setProperty("role", role)
        self.setAccessibleName(name)


class WrappedLabel(QLabel):
    """A label with as many lines as its text needs at its width, even for a long path.

    It reports no height for width: in a scroll area its surroundings would get their preferred height.
    """

    def __init__(self, role: str, grade: str = "", *, keeps_room: bool = False) -> None:
        """Show nothing; with `keeps_room` it has at least a line, and never shrinks at the same width.

        So changing text does not move the parts around it.
        """
        super().__init__(textFormat=Qt.TextFormat.PlainText, wordWrap=True)
        self._keeps_room, self._least = keeps_room, 1
        self.setProperty("role", role)
        self.setProperty("grade", grade)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)

    def show_text(self, text: str) -> None:
        display = re.sub(r"/(?!s\b)", "/\u200b", breakable(text))
        if display != self.text():
            self.setText(display)
            self.setAccessibleName(text)
            self._fit()
        self.setVisible(self._keeps_room or bool(text))

    def hasHeightForWidth(self) -> bool:
        return False

    def resizeEvent(self, event: QResizeEvent) -> None:
        if event.size().width() != event.oldSize().width():
            self._least = self.fontMetrics().height() if self._keeps_room else 1
            self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """Adjust the height to a bolder font."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._fit()

    def _fit(self) -> None:
        self.setMinimumHeight(0)  # else Qt would include it in the needed height
        height = max(self.heightForWidth(max(self.width(), 60)), self._least)
        if self._keeps_room:
            self._least = height
        self.setFixedHeight(height)


def button(text: str, name: str, act: Callable[[], object], role: str = "", *, checkable: bool = False) -> QPushButton:
    """Return a button named `name` for screen readers; with `checkable` it stays pressed until the next press."""
    push = QPushButton(text, autoDefault=False)
    push.setAccessibleName(name)
    if role:
        push.setProperty("role", role)
    push.setCheckable(checkable)
    push.clicked.connect(lambda: act())
    return push


class _Choice(QComboBox):
    """A drop-down list that ignores the wheel, which would change the selection while scrolling the page.

    On Linux Qt reports the selected entry as the name of such a list. A hidden label next to it has its real name:
    screen readers read the label, then the selection.
    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._label = QLabel(name)
        self._label.setBuddy(self)
        self._label.hide()

    def sizeHint(self) -> QSize:
        return super().sizeHint().expandedTo(QSize(0, TARGET))

    def changeEvent(self, event: QEvent) -> None:
        """Move the label to the new parent of the list."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.ParentChange:
            self._label.setParent(self.parentWidget())

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()


def choice(name: str, entries: Iterable[str] = ()) -> QComboBox:
    """Return a drop-down list named `name` for screen readers, which fills its room."""
    box = _Choice(name)
    box.addItems(list(entries))
    box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
    return box


class RowList(QListWidget):
    """A list whose rows wrap if they are longer than its width."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setWordWrap(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setResizeMode(QListWidget.ResizeMode.Adjust)


class EntryLine(QLineEdit):
    """An input line that consumes Enter and Esc, so that Enter does not press the primary button."""

    def __init__(self, keep: Callable[[], None], leave: Callable[[], None]) -> None:
        super().__init__()
        self._keep, self._leave = keep, leave

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._keep()
        elif event.key() == Qt.Key.Key_Escape:
            self._leave()
        else:
            super().keyPressEvent(event)


def is_text_field(widget: QWidget | None) -> bool:
    """Say whether keys pressed on a widget are typed text."""
    if isinstance(widget, QComboBox):
        return widget.isEditable()
    return isinstance(widget, QLineEdit | QAbstractSpinBox) and not widget.isReadOnly()


def label_grid(values: Iterable[tuple[str, QWidget]], across: int = 1, role: str = "quiet") -> QGridLayout:
    """Return a grid of labelled widgets, `across` pairs in a row, labels in a role of the style sheet."""
    grid = QGridLayout()
    grid.setHorizontalSpacing(GRID)
    grid.setVerticalSpacing(2)
    alignment = Qt.AlignmentFlag.AlignTop if across == 1 else Qt.AlignmentFlag(0)  # next to text that may wrap
    for index, (name, widget) in enumerate(values):
        row, column = index // across, 2 * (index % across)
        grid.addWidget(label(name, role), row, column, alignment)
        grid.addWidget(widget, row, column + 1)
        grid.setColumnStretch(column + 1, 1)
    return grid


def regrade(widget: QWidget, value: str, property_name: str = "grade") -> None:
    """Change the grade, or role, of a widget in the style sheet."""
    if widget.property(property_name) != value:
        widget.setProperty(property_name, value)
        for child in (widget, *widget.findChildren(QWidget)):
            child.style().unpolish(child)
            child.style().polish(child)


def set_text(widget: QLabel, text: str, name: str = "", grade: str | None = None) -> None:
    """Show a text, which a screen reader reads after `name`, or alone without one."""
    widget.setText(breakable(text) if widget.wordWrap() else text)  # Qt ignores an equal text
    if name:
        widget.setAccessibleName(f"{name} {text or tr('nothing')}")
    if grade is not None:
        regrade(widget, grade)


def field(text: str, widget: QWidget, *more: QWidget) -> QVBoxLayout:
    """Return a caption above an input field, and further widgets next to the field."""
    caption = label(text, "quiet", wrap=True)
    if not isinstance(widget, _Choice):  # which has its own label
        caption.setBuddy(widget)
    return vbox(caption, hbox((widget, 1), *more), spacing=4)


def tick(text: str, name: str) -> QCheckBox:
    """Return a check box named `name` for screen readers."""
    box = QCheckBox(text)
    box.setAccessibleName(name)
    box.setMinimumHeight(TARGET - GRID)
    return box


def entry(name: str, empty: str = "") -> QLineEdit:
    """Return an input line named `name` for screen readers, with the placeholder `empty`."""
    line = QLineEdit(placeholderText=empty)
    line.setAccessibleName(name)
    return line


class Openness:
    """Whether a part is open, remembered under a `key` if there is room for the part and its neighbour.

    Without room it begins closed, and opening it is not remembered. `on_change` is called after a change.
    """

    def __init__(self, key: str, on_change: Callable[[], object]) -> None:
        self._key, self._on_change = key, on_change
        self._wish = settings().value(key) != "no"
        self._instead = False  # opened without room, in place of the neighbour
        self.room = True

    def __bool__(self) -> bool:
        """Say whether it is open."""
        return self._wish if self.room else self._instead

    def set_room(self, room: bool) -> None:
        if room != self.room:
            self.room, self._instead = room, False
            self._on_change()

    def toggle(self) -> None:
        if self.room:
            self._wish = not self._wish
            settings().setValue(self._key, "yes" if self._wish else "no")
        else:
            self._instead = not self._instead
        self._on_change()


class Drawer(QSplitter):
    """A permanent part with a drawer on its right, whose openness and width are remembered."""

    def __init__(self, main: QWidget, drawer: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal, childrenCollapsible=False)
        self._main, self._drawer = main, drawer
        self.addWidget(main)
        self.addWidget(drawer)
        for index, share in enumerate(SHARES):
            self.setStretchFactor(index, share)
        self.setSizes(list(SHARES))
        sizes = settings().value(DRAWER_SIZES)
        if isinstance(sizes, QByteArray):
            self.restoreState(sizes)
        self.handle(1).setAccessibleName(tr("edge of the drawer"))
        self.splitterMoved.connect(lambda: settings().setValue(DRAWER_SIZES, self.saveState()))
        self.open = Openness(DRAWER, self._show_panes)
        self._show_panes()

    def least_height(self) -> int:
        """Return the height that its visible parts need [px]."""
        layouts = [layout for pane in (self._main, self._drawer) if not pane.isHidden() and (layout := pane.layout())]
        return max(layout.totalMinimumSize().height() for layout in layouts)

    def _show_panes(self) -> None:
        self._drawer.setVisible(bool(self.open))
        self._main.setVisible(self.open.room or not self.open)
