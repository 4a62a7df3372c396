"""A state of the model's finger that is looked at: moved, zoomed, probed, and cut by a line."""

from typing import Any

import numpy as np
import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFontMetricsF,
    QKeyEvent,
    QLinearGradient,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.analyst.field_list import FIELD_CHOICES, FieldChoice, ticks
from daq_app.analyst.frame import Frame, Parts
from daq_app.analyst.probe import Line, probe_words
from daq_app.analyst.viewport import View
from daq_app.qt.finger_painter import FingerPainter, Look, whole_box
from daq_app.qt.tokens import SMALL, Tokens, font
from daq_app.wording import tr

pg: Any = pyqtgraph  # it has no types

NO_PARTS = Parts(np.empty((0, 3), np.int64), np.empty((0, 8), np.int64), np.empty(0, np.int64))
SHADES = 64
NOTCH = 120.0  # of a wheel, in Qt's eighths of a degree
ZOOM = 1.25  # of a notch or a key [-]: three of them double the picture
STEP = 0.1  # of the picture's width that an arrow key moves it
END_STEP = 0.2  # of `STEP`, by which an arrow key moves an end of a line
# Black lines lie on the colours: magma begins a fifth above its dark end, and nought of a signed field is pale.
MAPS = {False: ("magma", 1.0, 0.2), True: ("CET-D1A", 0.0, 1.0)}
LINE_KEYS = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier
ARROWS = {
    Qt.Key.Key_Left: (STEP, 0.0),
    Qt.Key.Key_Right: (-STEP, 0.0),
    Qt.Key.Key_Up: (0.0, STEP),
    Qt.Key.Key_Down: (0.0, -STEP),
}


class Sight(QObject):
    """Which part of the finger is looked at, and the line over it; canvases of one size share it."""

    changed = Signal()
    cut = Signal()  # a line was drawn or taken away
    pointed = Signal(object)  # place under the pointer (x, y) [mm]; None where it left

    def __init__(self) -> None:
        """Look at all of it."""
        super().__init__()
        self.view: View | None = None  # None: all of it
        self.line: Line | None = None
        self.draws_line = False  # the mouse draws a line in place of moving the picture
        self.lines = 2.2  # of words over each finger


class FingerCanvas(QWidget):
    """A picture of one frame."""

    def __init__(self, tokens: Tokens, scale: float, sight: Sight | None = None) -> None:
        """Show nothing yet; canvases with the same `sight` move together."""
        super().__init__()
        self.sight = sight or Sight()
        self.sight.changed.connect(self._renew)
        self._tokens, self._scale = tokens, scale
        self._frame: Frame | None = None
        self._parts = NO_PARTS
        self._look = Look(FIELD_CHOICES[0], (0.0, 1.0))
        self._words = ""
        self._kept: QPixmap | None = None
        self._fits: tuple[Frame, ...] = ()  # all of them are seen before anybody moves or zooms
        self._pointer: QPointF | None = None
        self._held: QPointF | None = None  # where a button was pressed, or moved to since
        self._drawing = False  # what is held is the end of a line
        self._shades = {signed: _shades(*what) for signed, what in MAPS.items()}
        self.setMinimumSize(80, round(160 * scale))  # two stand beside each other
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setToolTip(
            tr(
                "Wheel, + and −: zoom. Drag or arrows: move. Home or double-click: all. Shift and drag: draw a line. "
                "By keys, Shift and arrows move its end, Ctrl and arrows its beginning, and Del takes it away."
            )
        )
        self.setAccessibleName(tr("finger of the model: none"))

    def show_frame(
        self, frame: Frame | None, parts: Parts, words: str, look: Look, linked: tuple[Frame, ...] = ()
    ) -> None:
        """Show a state, and how; what was moved or zoomed stays so. Frames that are `linked` with it fit in too."""
        fits = linked or (() if frame is None else (frame,))
        if frame is self._frame and fits == self._fits and (words, look) == (self._words, self._look):
            return
        if look.near != self._look.near:
            self.sight.view = None
        self._frame, self._parts, self._words, self._look, self._fits = frame, parts, words, look, fits
        self.setAccessibleName(words or tr("finger of the model: none"))
        self._renew()
        self._probe()

    def view(self) -> View | None:
        """Return what is shown, or None without a finger."""
        if self.sight.view is not None or not self._fits:
            return self.sight.view
        box, boxes = self._box(), np.array([whole_box(frame, self._look) for frame in self._fits])
        left, below = boxes.min(axis=0)[[0, 2]].tolist()
        right, above = boxes.max(axis=0)[[1, 3]].tolist()
        return View.fitted((left, right, below, above), box.left(), box.top(), box.width(), box.height())

    def show_view(self, view: View | None) -> None:
        """Show a part of the finger; None shows all of it."""
        self.sight.view = view
        self.sight.changed.emit()

    def zoom(self, factor: float, at: QPointF | None = None) -> None:
        """Show the finger `factor` times as large; what is at a pixel stays there, at first the middle."""
        view, place = self.view(), at or self._box().center()
        if view is not None:
            self.show_view(view.zoomed(factor, place.x(), place.y()))

    def set_line(self, line: Line | None) -> None:
        """Draw a line [mm], or none."""
        self.sight.line = line
        self.sight.changed.emit()
        self.sight.cut.emit()

    def words_at(self, place: tuple[float, float]) -> str:
        """Return what is at a place [mm]; "" without a finger."""
        return "" if self._frame is None else probe_words(self._frame, self._parts, self._look.field, *place)

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802  Qt's name
        """Zoom about the pointer."""
        self.zoom(ZOOM ** (event.angleDelta().y() / NOTCH), event.position())
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802  Qt's name
        """Take hold of the picture, or begin a line."""
        view = self.view()
        if event.button() != Qt.MouseButton.LeftButton or view is None:
            event.ignore()
            return
        self._held = event.position()
        self._drawing = self.sight.draws_line or bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if self._drawing:
            place = view.place(self._held.x(), self._held.y())
            self.set_line((place, place))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802  Qt's name
        """Move the picture or the line's end with a button held; say what is under the pointer."""
        view, at = self.view(), event.position()
        if view is None or self._frame is None:
            return
        if self._held is not None and self._drawing and self.sight.line is not None:
            self.set_line((self.sight.line[0], view.place(at.x(), at.y())))
        elif self._held is not None:
            self.show_view(view.moved(at.x() - self._held.x(), at.y() - self._held.y()))
            self._held = at
            return
        self._pointer = at
        self._probe()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Let go; a line without a length is taken away."""
        self._held = None
        if self.sight.line is not None and self.sight.line[0] == self.sight.line[1]:
            self.set_line(None)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:  # noqa: N802  Qt's name
        """Show all of it."""
        event.accept()
        self.show_view(None)

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802  Qt's name
        """Say nothing of a place any more."""
        self._pointer = None
        self._probe()
        super().leaveEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Zoom with + and −, move with arrows, show all with Home, draw a line; leave other keys to the window."""
        key, view = event.key(), self.view()
        if key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self.zoom(ZOOM)
        elif key == Qt.Key.Key_Minus:
            self.zoom(1.0 / ZOOM)
        elif key == Qt.Key.Key_Home:
            self.show_view(None)
        elif key == Qt.Key.Key_Delete and self.sight.line is not None:
            self.set_line(None)
        elif key in ARROWS and view is not None and event.modifiers() & LINE_KEYS:
            self._move_end(view, key, begins=bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier))
        elif key in ARROWS and view is not None:
            across, down = ARROWS[Qt.Key(key)]
            self.show_view(view.moved(across * self.width(), down * self.width()))
        else:
            super().keyPressEvent(event)

    def _move_end(self, view: View, key: int, *, begins: bool) -> None:
        """Move the beginning or the end of the line as an arrow key points; the first draws it from the middle."""
        middle = self._box().center()
        line = self.sight.line or (view.place(middle.x(), middle.y()),) * 2
        across, down = ARROWS[Qt.Key(key)]
        along = END_STEP * self.width() / view.per_mm
        x, y = line[0 if begins else 1]
        moved = (x - across * along, y + down * along)
        self.set_line((moved, line[1]) if begins else (line[0], moved))

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Paint anew at another size."""
        self._kept = None
        super().resizeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint the picture, or what was painted before."""
        if self._kept is None:
            ratio = self.devicePixelRatioF()
            self._kept = QPixmap(round(self.width() * ratio), round(self.height() * ratio))
            self._kept.setDevicePixelRatio(ratio)
            self._kept.fill(Qt.GlobalColor.transparent)
            painter = QPainter(self._kept)
            self._paint_on(painter)
            painter.end()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._kept)
        if self.hasFocus():
            painter.setPen(QPen(QColor(self._tokens.act), 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))

    @property
    def frame(self) -> Frame | None:
        """The state that is shown."""
        return self._frame

    @property
    def field(self) -> FieldChoice:
        """The field that is shown in colour."""
        return self._look.field

    def draw(self, painter: QPainter, head: str) -> None:
        """Draw what is shown on paper of the window's colour, with a `head` such as SIMULATED over it, "" for none."""
        painter.fillRect(self.rect(), QColor(self._tokens.surface))
        self._paint_on(painter)
        painter.setPen(QColor(self._tokens.look))
        painter.drawText(self._box(), int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop), f"{head} ")

    def _paint_on(self, painter: QPainter) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(font(SMALL, self._scale))
        self._paint(painter)

    def _probe(self) -> None:
        """Say which place is under the pointer."""
        view, at = self.view(), self._pointer
        inside = view is not None and at is not None and self._box().contains(at)
        self.sight.pointed.emit(view.place(at.x(), at.y()) if inside and view is not None and at is not None else None)

    def _renew(self) -> None:
        self._kept = None
        self.update()

    def _box(self) -> QRectF:
        """Return where the finger is: under its lines of words, over the colours and their ticks."""
        line = self._line_height()
        above = self.sight.lines * line
        return QRectF(0, above, self.width(), max(self.height() - above - 2.5 * line, 1.0))

    def _line_height(self) -> float:
        metrics = QFontMetricsF(font(SMALL, self._scale))
        return metrics.height()

    def _paint(self, painter: QPainter) -> None:
        line = self._line_height()
        painter.setPen(QColor(self._tokens.quiet))
        words = QRectF(4, 0, self.width() - 8, self.sight.lines * line)
        painter.drawText(words, int(Qt.AlignmentFlag.AlignLeft | Qt.TextFlag.TextWordWrap), self._words)
        view = self.view()
        if self._frame is None or view is None:
            return
        picture = FingerPainter(painter, self._tokens, view, self._box(), self._frame, self._parts)
        picture.paint(self._look, self._shades[self._look.field.signed], self.sight.line)
        self._paint_bar(painter, QRectF(8, self._box().bottom() + 4, self.width() - 16, 2.4 * line))

    def _paint_bar(self, painter: QPainter, box: QRectF) -> None:
        """Draw the colours with their ticks, and the field's name with its unit."""
        low, high = self._look.range
        line, words = self._line_height(), self._look.field.axis
        name = min(painter.fontMetrics().horizontalAdvance(words) + 12.0, 0.6 * box.width())
        strip = QRectF(box.left() + line, box.top() + 2, max(box.width() - name - 2.0 * line, 1.0), line - 4)
        gradient = QLinearGradient(strip.topLeft(), strip.topRight())
        shades = self._shades[self._look.field.signed]
        for step in range(SHADES):
            gradient.setColorAt(step / (SHADES - 1), shades[step])
        painter.fillRect(strip, QBrush(gradient))
        painter.setPen(QColor(self._tokens.text))
        for tick in ticks(low, high):
            x = strip.left() + strip.width() * (tick - low) / (high - low)
            painter.drawLine(QPointF(x, strip.bottom()), QPointF(x, strip.bottom() + 4))
            at = QRectF(x - 40, strip.bottom() + 4, 80, line)
            painter.drawText(at, int(Qt.AlignmentFlag.AlignCenter), f"{tick:g}".replace("-", "−"))
        painter.setPen(QColor(self._tokens.quiet))
        label = QRectF(box.right() - name, box.top(), name, 2.0 * line)
        painter.drawText(
            label, int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap), words
        )


def _shades(name: str, first: float, last: float) -> list[QColor]:
    """Return the colours of a part of a named map."""
    table = pg.colormap.get(name).map(np.linspace(first, last, SHADES), mode="byte")
    return [QColor(int(r), int(g), int(b)) for r, g, b, *_ in table]
