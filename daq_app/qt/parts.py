"""How labels, buttons and panels of the window are made, so that all of them look and are named alike."""

import re
from collections.abc import Callable, Iterable
from typing import TypeVar

from PySide6.QtCore import QByteArray, QEvent, QSize, Qt
from PySide6.QtGui import QKeyEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QBoxLayout,
    QCheckBox,
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLayout,
    QLineEdit,
    QListWidget,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QSplitter,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from daq_app.qt.preferences import DRAWER, DRAWER_SIZES, settings
from daq_app.qt.tokens import GRID, TARGET
from daq_app.wording import tr

Margins = int | tuple[int, int, int, int]  # around a layout: left, top, right, bottom [px]
B = TypeVar("B", bound=QBoxLayout)
Part = QWidget | QLayout | int | tuple[QWidget | QLayout, int]  # with its stretch; a number alone is empty room
SHARES = (500, 300)  # of the width, before somebody moved the handle [-]


def label(text: str = "", role: str = "value", *, wrap: bool = False) -> QLabel:
    """Return a label; `role` is one of the style sheet's."""
    text_label = QLabel(text)
    text_label.setProperty("role", role)
    text_label.setWordWrap(wrap)
    text_label.setTextFormat(Qt.TextFormat.PlainText)
    return text_label


# Spaces that no line ends at: between a number and its unit, a symbol and its number, before a dot that parts facts.
_TIES = re.compile(
    r"(?<=\d) (?=(?:[%°]|[mkµM]?(?:N|Pa|Hz|m|s|B)[²³]?)(?!\w))|(?<=N) (?=mm\b)|(?<=[µ±×≤τ]) (?=[\d−–m])"
    r"|(?<=\d) (?=of \d)|(?<=\d of) (?=\d)| (?=·)"
)


def breakable(text: str) -> str:
    r"""Return a text whose lines may end within a long word, but not within a quantity.

    >>> breakable("µ 0.43, 2 N mm · 10 % of 3 trials, 5 of 10").split(" ")
    ['µ\xa00.43,', '2\xa0N\xa0mm\xa0·', '10\xa0%', 'of', '3', 'trials,', '5\xa0of\xa010']
    """
    return re.sub(r"[^\s/]{30}", "\\g<0>\u200b", _TIES.sub("\u00a0", text))


def whole_facts(row: str) -> str:
    r"""Return a row of facts, two or more spaces apart, each of which stays whole where it takes a second line.

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
    """A label of as many lines as its text needs at the width it has, a long path too.

    Its surroundings get no height for a width: scrolled, they would be as high as they like, not as there is room.
    """

    def __init__(self, role: str, grade: str = "", *, keeps_room: bool = False) -> None:
        """Show nothing; one that `keeps_room` has at least a line, and never less than it once needed at its width.

        So what stands around words that come and go does not move.
        """
        super().__init__()
        self._keeps_room, self._least = keeps_room, 1
        self.setProperty("role", role)
        self.setProperty("grade", grade)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
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
        """Take the room that bolder words need."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._fit()

    def _fit(self) -> None:
        self.setMinimumHeight(0)  # which Qt would count among what the text needs
        height = max(self.heightForWidth(max(self.width(), 60)), self._least)
        if self._keeps_room:
            self._least = height
        self.setFixedHeight(height)


def button(text: str, name: str, act: Callable[[], object], role: str = "", *, checkable: bool = False) -> QPushButton:
    """Return a button that says `name` to screen readers, and with `checkable` stays pressed until the next press."""
    push = QPushButton(text)
    push.setAccessibleName(name)
    if role:
        push.setProperty("role", role)
    push.setAutoDefault(False)
    push.setCheckable(checkable)
    push.clicked.connect(lambda: act())
    return push


class _Choice(QComboBox):
    """A list that the wheel passes over: turned to scroll the page, it would choose another entry unseen.

    On Linux Qt gives what is chosen for the name of such a list. Its own name is that of a label beside it, which
    nobody sees: screen readers read the label, then what is chosen.
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
        """Move the label to the parent that the list is given."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.ParentChange:
            self._label.setParent(self.parentWidget())

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()


def choice(name: str, entries: Iterable[str] = ()) -> QComboBox:
    """Return a list to choose from that says `name` to screen readers, and takes the room it is given."""
    box = _Choice(name)
    box.addItems(list(entries))
    box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
    return box


def row_list(name: str) -> QListWidget:
    """Return a list whose rows take a second line where they are longer than it is wide."""
    rows = QListWidget()
    rows.setAccessibleName(name)
    rows.setWordWrap(True)
    rows.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    rows.setResizeMode(QListWidget.ResizeMode.Adjust)
    return rows


class EntryLine(QLineEdit):
    """A line that keeps Enter and Esc to itself: Enter there is not the window's primary button."""

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
    """Say whether keys pressed on a widget are text that is typed."""
    if isinstance(widget, QComboBox):
        return widget.isEditable()
    return isinstance(widget, QLineEdit | QAbstractSpinBox) and not widget.isReadOnly()


def fill(layout: B, *parts: Part) -> B:
    """Return a layout with further parts at its end."""
    for item in parts:
        content, stretch = item if isinstance(item, tuple) else (item, 0)
        if isinstance(content, QWidget):
            layout.addWidget(content, stretch)
        elif isinstance(content, QLayout):
            layout.addLayout(content, stretch)
        else:
            layout.addStretch(content)
    return layout


def hbox(*parts: Part, on: QWidget | None = None, margins: Margins = 0, spacing: int | None = None) -> QHBoxLayout:
    """Return parts beside each other, as the layout of a widget or within another layout."""
    return _arrange(QHBoxLayout(), parts, on, margins, spacing)


def vbox(*parts: Part, on: QWidget | None = None, margins: Margins = 0, spacing: int | None = None) -> QVBoxLayout:
    """Return parts below each other, as `hbox` does beside each other."""
    return _arrange(QVBoxLayout(), parts, on, margins, spacing)


def _arrange(layout: B, parts: tuple[Part, ...], on: QWidget | None, margins: Margins, spacing: int | None) -> B:
    layout.setContentsMargins(*(margins if isinstance(margins, tuple) else (margins,) * 4))
    if spacing is not None:
        layout.setSpacing(spacing)
    if on is not None:
        on.setLayout(layout)
    return fill(layout, *parts)


def set_horizontal(layout: QBoxLayout, horizontal: bool) -> None:
    """Put the parts of a layout beside each other, or below each other where there is no room for that."""
    layout.setDirection(QBoxLayout.Direction.LeftToRight if horizontal else QBoxLayout.Direction.TopToBottom)


def stack_pages(*pages: QWidget) -> QStackedWidget:
    """Return a stack of pages of which one is shown, the first at the beginning."""
    stack = QStackedWidget()
    for page in pages:
        stack.addWidget(page)
    return stack


def label_grid(values: Iterable[tuple[str, QWidget]], across: int = 1, role: str = "quiet") -> QGridLayout:
    """Return a grid of widgets behind their labels, `across` pairs in a row, labels in a role of the style sheet."""
    grid = QGridLayout()
    grid.setHorizontalSpacing(GRID)
    grid.setVerticalSpacing(2)
    alignment = Qt.AlignmentFlag.AlignTop if across == 1 else Qt.AlignmentFlag(0)  # beside what may wrap
    for index, (name, widget) in enumerate(values):
        row, column = index // across, 2 * (index % across)
        grid.addWidget(label(name, role), row, column, alignment)
        grid.addWidget(widget, row, column + 1)
        grid.setColumnStretch(column + 1, 1)
    return grid


def scroll_area(inside: QWidget, area: QScrollArea | None = None) -> QScrollArea:
    """Return a frameless area, a new one unless given, in which `inside` moves where it is greater than its room."""
    area = area or QScrollArea()
    area.setWidget(inside)
    area.setWidgetResizable(True)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    inside.setObjectName("inside")
    area.setStyleSheet("QScrollArea, QWidget#inside { background: transparent; border: none; }")
    return area


def regrade(widget: QWidget, value: str, property_name: str = "grade") -> None:
    """Give a widget another grade, or role, of the style sheet."""
    if widget.property(property_name) != value:
        widget.setProperty(property_name, value)
        for child in (widget, *widget.findChildren(QWidget)):
            child.style().unpolish(child)
            child.style().polish(child)


def set_text(widget: QLabel, text: str, name: str = "", grade: str | None = None) -> None:
    """Show a text. A screen reader says it after the `name` of what it shows; without a name the text alone."""
    widget.setText(breakable(text) if widget.wordWrap() else text)  # Qt itself does nothing where it is the same
    if name:
        widget.setAccessibleName(f"{name} {text or tr('nothing')}")
    if grade is not None:
        regrade(widget, grade)


def field(text: str, widget: QWidget, *more: QWidget) -> QVBoxLayout:
    """Return a caption over an input field, and further widgets beside the field."""
    caption = label(text, "quiet", wrap=True)
    if not isinstance(widget, _Choice):  # it has a label of its own
        caption.setBuddy(widget)
    return vbox(caption, hbox((widget, 1), *more), spacing=4)


def tick(text: str, name: str) -> QCheckBox:
    """Return a box to tick that says `name` to screen readers."""
    box = QCheckBox(text)
    box.setAccessibleName(name)
    box.setMinimumHeight(TARGET - GRID)
    return box


def entry(name: str, empty: str = "") -> QLineEdit:
    """Return a line to type in that says `name` to screen readers, and shows `empty` while it is."""
    line = QLineEdit()
    line.setPlaceholderText(empty)
    line.setAccessibleName(name)
    return line


class Openness:
    """Whether a part is open, remembered under a `key` where there is room for the part and its neighbour.

    Where there is none it begins closed, and opening it is not remembered. `on_change` is called when it has changed.
    """

    def __init__(self, key: str, on_change: Callable[[], object]) -> None:
        self._key, self._on_change = key, on_change
        self._wish = settings().value(key) != "no"
        self._instead = False  # it was opened where there is no room
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
    """What is always there, and a drawer at its right that remembers whether it is open and how wide it is."""

    def __init__(self, main: QWidget, drawer: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._main, self._drawer = main, drawer
        self.addWidget(main)
        self.addWidget(drawer)
        self.setChildrenCollapsible(False)
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
        """Return the height that those of its two parts need that are shown [px]."""
        layouts = [layout for pane in (self._main, self._drawer) if not pane.isHidden() and (layout := pane.layout())]
        return max(layout.totalMinimumSize().height() for layout in layouts)

    def _show_panes(self) -> None:
        self._drawer.setVisible(bool(self.open))
        self._main.setVisible(self.open.room or not self.open)
