"""A plot that the wheel zooms and the mouse moves, and that says what is under the pointer."""

from collections.abc import Callable, Sequence
from typing import Any

import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QKeyEvent, QMouseEvent

from daq_app.qt.parts import label
from daq_app.qt.remembered import type_scale
from daq_app.qt.tokens import GRID, SMALL, Tokens, font
from daq_app.wording import tr

pg: Any = pyqtgraph  # it has no types: who draws by it imports it from here


def style_axis(axis: Any, tokens: Tokens, type_face: QFont) -> None:  # noqa: ANN401  pyqtgraph has no types
    """Give an axis the colours of a theme and a type face."""
    axis.setTickFont(type_face)
    axis.setLabel(**{"font-size": f"{type_face.pixelSize()}px"})
    axis.setPen(QColor(tokens.line))
    axis.setTextPen(QColor(tokens.quiet))
    axis.enableAutoSIPrefix(False)


def name_axis(axis: Any, words: str) -> None:  # noqa: ANN401  pyqtgraph has no types
    """Set the label of an axis, centred: pyqtgraph centres a new label only when the axis is resized."""
    if words != axis.labelText:
        axis.setLabel(words)
        axis.resizeEvent()


class ZoomedPlot(pg.PlotWidget):
    """A plot in the colours of a theme; `reset` shows all of it, `read` says what stands at a place across."""

    reset: Callable[[], None]
    read: Callable[[float], str] | None = None

    def __init__(self, tokens: Tokens) -> None:
        base: Any = super()
        base.__init__(background=tokens.surface)
        scale = type_scale()
        self._names: Any = None
        self._text = tokens.text
        self.setMinimumSize(120, round(100 + 160 * (scale - 1)))  # the axes take what the type needs
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setToolTip(tr("Wheel: zoom. Drag: move. Home or double-click: show all."))
        item: Any = self.getPlotItem()
        self.reset = item.enableAutoRange
        self._pointer = pg.InfiniteLine(angle=90, pen=pg.mkPen(tokens.text, width=1))
        item.addItem(self._pointer, ignoreBounds=True)
        self.words = label("", "tight")
        self.words.setParent(self)
        self.words.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.words.setStyleSheet(f"background: {tokens.surface}; padding: 0 {GRID // 2}px;")
        self._hide_words()
        item.setMenuEnabled(False)
        item.hideButtons()
        for side in ("left", "bottom"):
            style_axis(item.getAxis(side), tokens, font(SMALL, scale))

    def name_across(self, words: str) -> None:
        """Name the horizontal axis in one or two lines, under its numbers."""
        axis: Any = self.getPlotItem().getAxis("bottom")
        name_axis(axis, words)
        above = axis.style["tickTextOffset"][1] + QFontMetricsF(axis.style["tickFont"]).height()
        axis.setHeight(round(above + axis.label.boundingRect().height()))

    def name_curves(self, curves: Sequence[Any], corner: tuple[float, float] = (0.5, 1.0)) -> None:
        """Name curves, each beside a piece of its line; `corner` is where, from 0, 0 at the top left to 1, 1."""
        if self._names is not None:
            self._names.scene().removeItem(self._names)
            self._names = None
        if curves:
            size = f"{font(SMALL, type_scale()).pixelSize()}px"
            self._names = pg.LegendItem(offset=None, colCount=len(curves), labelTextSize=size, pen=None, brush=None)
            self._names.setParentItem(self.getPlotItem().getViewBox())
            self._names.anchor(corner, corner)
            self._names.setLabelTextColor(self._text)
            for curve in curves:
                self._names.addItem(curve, curve.name())

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Show all with Home; leave every other key to the window."""
        if event.key() == Qt.Key.Key_Home:
            self.reset()
        else:
            event.ignore()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802  Qt's name
        """Say what stands at the pointer, as far as the plot knows it."""
        base: Any = super()
        base.mouseMoveEvent(event)
        item: Any = self.getPlotItem()
        box = item.getViewBox()
        scene = self.mapToScene(event.position().toPoint())
        inside = box.sceneBoundingRect().contains(scene)
        x = float(box.mapSceneToView(scene).x())
        words = self.read(x) if self.read is not None and inside else ""
        if not words:
            self._hide_words()
            return
        self._pointer.setPos(x)
        self._pointer.show()
        self.words.setText(words)
        self.words.adjustSize()
        room = box.sceneBoundingRect()
        left = room.left() if scene.x() > room.center().x() else room.right() - self.words.width()
        self.words.move(round(left), round(room.top()))
        self.words.show()

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802  Qt's name
        """Say nothing of a place any more."""
        self._hide_words()
        base: Any = super()
        base.leaveEvent(event)

    def _hide_words(self) -> None:
        self.words.hide()
        self._pointer.hide()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:  # noqa: N802  Qt's name
        """Show all."""
        event.accept()
        self.reset()
