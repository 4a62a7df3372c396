"""An interactive picture of the model's finger: moved, zoomed, probed, and cut by a line."""

from math import ceil
from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QSizePolicy

from daq_app.analyst.frame import FIELD_CHOICES, Frame, Line, View, probe_text
from daq_app.qt.finger_painter import FingerPainter, Look, whole_box
from daq_app.qt.parts import breakable
from daq_app.qt.plots import name_axis, pg, style_axis
from daq_app.qt.tokens import SMALL, Tokens, font, px
from daq_app.wording import tr, tr_noop

_HELP = tr_noop(
    "Wheel, + and −: zoom. Drag or arrows: move. Home or double-click: all. Shift and drag: draw a line. "
    "By keys, Shift and arrows move its end, Ctrl and arrows its beginning, and Del takes it away."
)
SHADES = 64
ZOOM = 1.25  # zoom factor of a key: three presses double the picture [-]
_STEP = 0.1  # step of the picture by an arrow key, relative to its width [-]
END_STEP = 0.2  # step of a line's end by an arrow key, relative to `_STEP` [-]
_LEAST = 110  # height of the finger, before the font's scale [px]
BAR_LINES = 3.5  # of text: height of the colour bar
LEAST_LINES = 2.2  # room for text above a finger: shorter text does not move the picture
NEAREST, _FARTHEST = 0.2, 500.0  # least and greatest width shown [mm]
# Black lines are drawn on the colours: magma begins a fifth above its dark end, and zero of a signed field is pale.
MAPS = {False: ("magma", 1.0, 0.2), True: ("CET-D1A", 0.0, 1.0)}
LINE_KEYS = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier
_ARROWS = {
    Qt.Key.Key_Left: (-_STEP, 0.0), Qt.Key.Key_Right: (_STEP, 0.0), Qt.Key.Key_Up: (0.0, _STEP),
    Qt.Key.Key_Down: (0.0, -_STEP),
}  # fmt: skip


class Sight(QObject):
    """The visible part of the finger, and the line over it; canvases of one size share it."""

    changed = Signal()
    cut = Signal()  # a line was drawn or removed
    pointed = Signal(object)  # point under the pointer (x, y) [mm]; None once it left

    def __init__(self) -> None:
        super().__init__()
        self.region: QRectF | None = None  # [mm]; None: all of it
        self.line: Line | None = None
        self.draws_line = False  # the mouse draws a line in place of moving the picture
        self.captions: tuple[str, ...] = ("",)  # above each finger

    def look_at(self, region: QRectF | None) -> None:
        """Show a part of the finger [mm]; None shows all of it."""
        self.region = region
        self.changed.emit()

    def set_line(self, line: Line | None) -> None:
        self.line = line
        self.changed.emit()
        self.cut.emit()


class FingerCanvas(pg.GraphicsLayoutWidget):
    """A picture of one frame in pyqtgraph's view box, with its colour bar below."""

    range_chosen = Signal(tuple)  # ends of the colours, from the bar's handles

    def __init__(self, tokens: Tokens, sight: Sight | None = None) -> None:
        """Show nothing yet; canvases with the same `sight` move together."""
        pg.GraphicsLayoutWidget.__init__(self)
        self.sight = sight or Sight()
        self._tokens, self._font = tokens, font(SMALL)
        self.frame: Frame | None = None
        self.look = Look(FIELD_CHOICES[0], (0.0, 1.0))
        self._caption = ""
        self._fits: tuple[Frame, ...] = ()  # frames that fit into the initial view
        self._pointer: QPointF | None = None
        self._shades = {signed: _shades(*colour_map) for signed, colour_map in MAPS.items()}
        self.setBackground(tokens.surface)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self._least = px(_LEAST)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setToolTip(tr(_HELP))
        self.setAccessibleName(tr("finger of the model: none"))
        self._box, self._bar = _Box(self.sight), self._colour_bar()
        self.ci.addItem(self._box, 0, 0)
        self.ci.addItem(self._bar, 1, 0)
        self._box.sigResized.connect(self._fit_region)
        self.sight.changed.connect(self._fit_region)
        self._fit_region()

    def show_frame(self, frame: Frame | None, caption: str, look: Look, linked: tuple[Frame, ...] = ()) -> None:
        """Show a state with a `look`, without changing the view. Frames that are `linked` with it fit in too."""
        fits = linked or (() if frame is None else (frame,))
        if frame is self.frame and fits == self._fits and (caption, look) == (self._caption, self.look):
            return
        if look.near != self.look.near:
            self.sight.region = None
        self.frame, self._caption, self.look, self._fits = frame, caption, look, fits
        self.setAccessibleName(caption or tr("finger of the model: none"))
        low, high = look.range
        self._bar.rounding = (high - low) / 100.0
        self._bar.setColorMap(pg.ColorMap(np.linspace(0.0, 1.0, SHADES), self._shades[look.field.signed]))
        self._bar.setLevels(look.range)
        self._bar.setVisible(frame is not None)
        self._fit_region()
        self._probe()

    def view(self) -> View:
        """Return the view that maps points of the finger to the canvas."""
        region, plot_box = self._box.viewRect(), self._plot_rect()
        middle, per_mm = region.center(), plot_box.width() / region.width()
        return View(middle.x(), middle.y(), plot_box.center().x(), plot_box.center().y(), per_mm)

    def readout_at(self, position: tuple[float, float]) -> str:
        return "" if self.frame is None else probe_text(self.frame, self.look.field, *position)

    def draw(self, painter: QPainter, heading: str) -> None:
        """Draw the canvas on the window's background colour, with a `heading` such as SIMULATED above, and end."""
        above = self.size_with(heading).height() - self.height()
        painter.fillRect(QRectF(0, 0, self.width(), above), QColor(self._tokens.surface))
        painter.setFont(self._font)
        painter.setPen(QColor(self._tokens.look))
        painter.drawText(QRectF(4, 0, self.width() - 8, above), int(Qt.TextFlag.TextWordWrap), heading)
        self.render(painter, QRectF(0, above, self.width(), self.height()), self.rect())
        painter.end()

    def size_with(self, heading: str) -> QSize:
        return self.size() + QSize(0, ceil(self._height_of(heading)))

    def drawForeground(self, painter: QPainter, rect: QRectF) -> None:
        painter.setFont(self._font)
        if self.frame is not None:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            picture = FingerPainter(painter, self._tokens, self.view(), self._plot_rect(), self.frame)
            picture.paint(self.look, self._shades[self.look.field.signed], self.sight.line)
        painter.setPen(QColor(self._tokens.quiet))
        caption_box, flags = QRectF(4.0, 0.0, self.width() - 8.0, self._above()), Qt.TextFlag.TextWordWrap
        painter.drawText(caption_box, int(flags), breakable(self._caption))

    def paintEvent(self, event: QPaintEvent) -> None:
        pg.GraphicsLayoutWidget.paintEvent(self, event)
        if self.hasFocus():
            painter = QPainter(self.viewport())
            painter.setPen(QPen(QColor(self._tokens.act), 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._box.draws = self.sight.draws_line or bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        pg.GraphicsLayoutWidget.mousePressEvent(self, event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        pg.GraphicsLayoutWidget.mouseMoveEvent(self, event)
        self._pointer = event.position()
        self._probe()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        event.accept()
        self.sight.look_at(None)

    def leaveEvent(self, event: QEvent) -> None:
        self._pointer = None
        self._probe()
        pg.GraphicsLayoutWidget.leaveEvent(self, event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = Qt.Key(event.key())
        if key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._box.zoom(ZOOM)
        elif key == Qt.Key.Key_Minus:
            self._box.zoom(1.0 / ZOOM)
        elif key == Qt.Key.Key_Home:
            self.sight.look_at(None)
        elif key == Qt.Key.Key_Delete and self.sight.line is not None:
            self.sight.set_line(None)
        elif key in _ARROWS and event.modifiers() & LINE_KEYS:
            self._move_end(key, begins=bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier))
        elif key in _ARROWS:
            self._box.move(*_ARROWS[key])
        else:
            event.ignore()

    def _move_end(self, key: Qt.Key, *, begins: bool) -> None:
        """Move the beginning or the end of the line by an arrow key; the first press draws it from the middle."""
        region = self._box.viewRect()
        line = self.sight.line or ((region.center().x(), region.center().y()),) * 2
        dx, dy = (END_STEP * step * region.width() for step in _ARROWS[key])
        x, y = line[0 if begins else 1]
        moved_end = (x + dx, y + dy)
        self.sight.set_line((moved_end, line[1]) if begins else (line[0], moved_end))

    def _probe(self) -> None:
        pointer, position = self._pointer, None
        if pointer is not None and self.frame is not None and self._plot_rect().contains(pointer):
            position = self.view().from_screen(pointer.x(), pointer.y())
        self.sight.pointed.emit(position)

    def _fit_region(self) -> None:
        """Show the selected part, or all of it at the bottom of the box."""
        above, line = self._above(), QFontMetricsF(self._font).height()
        least = self._least * (1 if self.look.lost is None else 2)  # a marked place must differ from others
        self.setMinimumSize(80, round(above + BAR_LINES * line) + least)  # two fit next to each other
        self.ci.layout.setContentsMargins(0.0, above, 0.0, 0.0)
        axis: Any = self._bar.getAxis("bottom")
        width = QFontMetricsF(self._font).horizontalAdvance(self.look.field.axis)
        name_axis(axis, self.look.field.axis if width < self.width() else f"[{self.look.field.unit}]")
        region, box = self.sight.region, self._box.rect()
        if region is None and self._fits and box.height() > 1.0:
            boxes = np.array([whole_box(frame, self.look) for frame in self._fits])
            left, below = boxes.min(axis=0)[[0, 2]].tolist()
            right, high = boxes.max(axis=0)[[1, 3]].tolist()
            room = max(box.height() - line - 2.0, 1.0)  # above a line of text below the tractions
            view = View.fit((left, right, below, high), 0.0, 0.0, box.width(), room)
            x0, x1, y0, y1 = view.visible(0.0, 0.0, box.width(), box.height())
            region = QRectF(x0, y0, x1 - x0, y1 - y0)
        if region is not None:
            self._box.setRange(region, padding=0.0)
        self.viewport().update()

    def _plot_rect(self) -> QRectF:
        return QRectF(self._box.mapRectToScene(self._box.rect()))

    def _above(self) -> float:
        """Return the height of the text [pixel], the same above every finger."""
        return max(LEAST_LINES * QFontMetricsF(self._font).height(), *map(self._height_of, self.sight.captions))

    def _height_of(self, text: str) -> float:
        """Return the height of a text wrapped to the width of the canvas [pixel]."""
        box = QRectF(0.0, 0.0, self.width() - 8.0, 1.0)
        return QFontMetricsF(self._font).boundingRect(box, int(Qt.TextFlag.TextWordWrap), breakable(text)).height()

    def _colour_bar(self) -> Any:  # noqa: ANN401  pyqtgraph has no types
        pens = {"pen": self._tokens.text, "hoverPen": self._tokens.act, "hoverBrush": f"{self._tokens.act}80"}
        line = QFontMetricsF(self._font).height()
        bar = pg.ColorBarItem(width=line - 4.0, orientation="h", colorMapMenu=False, **pens)
        style_axis(bar.getAxis("bottom"), self._tokens, self._font)
        self.ci.layout.setRowFixedHeight(1, BAR_LINES * line)  # fixed room for colours, ticks and the field's name
        bar.hide()
        bar.sigLevelsChangeFinished.connect(lambda: self.range_chosen.emit(bar.levels()))
        return bar


class _Box(pg.ViewBox):
    """Moves and zooms the finger like every plot, to scale; dragging with Shift, or in line mode, draws a line."""

    def __init__(self, sight: Sight) -> None:
        pg.ViewBox.__init__(self, lockAspect=True, enableMenu=False, defaultPadding=0.0)
        self._sight = sight
        self.draws = False  # the drag moves the end of a line
        self.setLimits(minXRange=NEAREST, maxXRange=_FARTHEST)
        self.sigRangeChangedManually.connect(self._share_region)

    def zoom(self, factor: float) -> None:
        """Enlarge the finger by `factor` about the centre."""
        self.scaleBy((1.0 / factor, 1.0 / factor))
        self._share_region()

    def move(self, dx: float, dy: float) -> None:
        """Move the view to the right and up, relative to the visible width."""
        width = self.viewRect().width()
        self.translateBy(x=dx * width, y=dy * width)
        self._share_region()

    def mouseDragEvent(self, ev: Any, axis: int | None = None) -> None:  # noqa: ANN401  pyqtgraph has no types
        if not self.draws:
            pg.ViewBox.mouseDragEvent(self, ev, axis)
            return
        ev.accept()
        begin, end = (self.mapToView(point) for point in (ev.buttonDownPos(), ev.pos()))
        self._sight.set_line(((begin.x(), begin.y()), (end.x(), end.y())))

    def _share_region(self, *_: object) -> None:
        self._sight.look_at(QRectF(self.viewRect()))


def _shades(name: str, first: float, last: float) -> list[QColor]:
    table = pg.colormap.get(name).map(np.linspace(first, last, SHADES), mode="byte")
    return [QColor(int(r), int(g), int(b)) for r, g, b, *_ in table]
