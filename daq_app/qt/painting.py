"""Painting by hand: arrays as shapes, a widget with a cached background, and small marks of a state."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import ceil
from typing import Any, Literal

import numpy as np
from PySide6.QtCore import QByteArray, QDataStream, QPoint, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen, QPixmap, QPolygonF, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget
from shiboken6 import VoidPtr

from daq_app.qt.tokens import GRID, LIGHT, Tokens, theme_of
from drivers.arrays import Array, Indices

_ELEMENT = np.dtype([("kind", ">i4"), ("x", ">f8"), ("y", ">f8")])  # of a path in Qt's serial format
_TAIL = (0).to_bytes(4, "big") + (1).to_bytes(4, "big")  # start of the last subpath; fill rule: overlaps are filled
Grade = Literal["off", "on", "well", "look", "wrong"]


def blank(widget: QWidget, colour: str) -> QPixmap:
    """Return a pixmap of a widget's size in screen pixels, never a pixel short at fractional scaling."""
    ratio = widget.devicePixelRatioF()
    pixmap = QPixmap(ceil(widget.width() * ratio), ceil(widget.height() * ratio))
    pixmap.setDevicePixelRatio(ratio)
    pixmap.fill(QColor(colour))
    return pixmap


def paint_fitted(painter: QPainter, picture: QPixmap) -> QRect:
    """Paint a picture at the top, as large as fits with its proportions; return its rectangle."""
    window, ratio = painter.window(), painter.device().devicePixelRatioF()
    smooth = Qt.TransformationMode.SmoothTransformation
    pixmap = picture.scaled(window.size() * ratio, Qt.AspectRatioMode.KeepAspectRatio, smooth)
    pixmap.setDevicePixelRatio(ratio)
    box = QRect(QPoint(), pixmap.deviceIndependentSize().toSize())
    box.moveLeft(window.center().x() - box.width() // 2)
    painter.drawPixmap(box.topLeft(), pixmap)
    return box


def sheer(colour: str, alpha: int) -> QColor:
    """Return a colour with transparency, from 0 (transparent) to 255 (opaque)."""
    shade = QColor(colour)
    shade.setAlpha(alpha)
    return shade


def fine(colour: str | QColor, style: Qt.PenStyle = Qt.PenStyle.SolidLine) -> QPen:
    """Return a pen one screen pixel wide at any scaling."""
    pen = QPen(QColor(colour), 1, style)
    pen.setCosmetic(True)
    return pen


def draw_line(painter: QPainter, x: Array, y: Array) -> None:
    """Draw the line through points (n,) with a fine pen, two screen pixels high.

    It is drawn twice, a pixel apart: a pen of two pixels takes a hundred times as long.
    """
    pieces = lines(x, y)
    pixel = 1.0 / painter.device().devicePixelRatio()
    for offset in (0.0, pixel):
        painter.translate(0.0, offset)
        for piece in pieces:
            painter.drawPolyline(piece)
    painter.translate(0.0, -pixel)


def lines(x: Array, y: Array) -> list[QPolygonF]:
    """Return the line through points (n,) in pieces, broken where a coordinate is nan."""
    points = np.empty((len(x), 2))
    points[:, 0], points[:, 1] = x, y
    finite = np.zeros(len(x) + 2, np.bool_)
    finite[1:-1] = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(finite[1:] != finite[:-1])
    return [_polygon(points[begin:end]) for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)]


def _polygon(points: Array) -> QPolygonF:
    """Return a polygon of points (n, 2), n > 0, written directly into Qt's memory, as in pyqtgraph."""
    polygon = QPolygonF()
    polygon.resize(len(points))
    # VoidPtr's stub lacks these arguments.
    memory: Any = VoidPtr(polygon.data(), points.nbytes, True)  # pyrefly: ignore[bad-argument-type, bad-argument-count]
    np.frombuffer(memory, np.float64).reshape(-1, 2)[:] = points
    return polygon


def faces(corners: Array, shades: Indices) -> Iterator[tuple[int, QPainterPath]]:
    """Yield closed polygons (f, k, 2) as one path for each shade (f,), to be filled together."""
    order = np.argsort(shades, kind="stable")
    sorted_shades = shades[order]
    elements = np.empty(corners.shape[:2], _ELEMENT)
    elements["kind"] = 1  # a line to the point ...
    elements["kind"][:, 0] = 0  # ... or a new subpath there
    elements["x"], elements["y"] = corners[order, :, 0], corners[order, :, 1]
    edges = np.flatnonzero(np.diff(sorted_shades, prepend=-1, append=-1)).tolist()
    for begin, end in pairwise(edges):
        polygons = elements[begin:end]
        path = QPainterPath()
        stream = QDataStream(QByteArray(polygons.size.to_bytes(4, "big") + polygons.tobytes() + _TAIL))
        stream >> path  # reads into `path`
        yield int(sorted_shades[begin]), path


def fill_faces(
    painter: QPainter, corners: Array, fraction: Array, shades: Sequence[QColor], *, edges: bool = False
) -> None:
    """Fill polygons (f, k, 2), each with the shade at its fraction (f,) of `shades`; with `edges` their sides too."""
    shade = (np.clip(np.nan_to_num(fraction), 0.0, 1.0) * (len(shades) - 1)).astype(np.int64)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
    for number, path in faces(corners, shade):
        painter.setPen(QPen(shades[number], 0) if edges else Qt.PenStyle.NoPen)
        painter.setBrush(shades[number])
        painter.drawPath(path)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)


class PaintedWidget(QWidget):
    """Fills its room; a subclass paints the background, and on it in its `paintEvent`."""

    def __init__(self) -> None:
        super().__init__()
        self._ground: QPixmap | None = None  # the static background ...
        self.theme = LIGHT  # ... and its theme
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)  # nothing behind it needs painting
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.redraw()

    def redraw(self) -> None:
        """Redraw everything, including the background."""
        self._ground = None
        self.update()

    def painter_on_ground(self) -> QPainter:
        """Return an active painter on the widget, after painting the background."""
        ratio, theme = self.devicePixelRatioF(), theme_of(self)
        if self._ground is None or self._ground.devicePixelRatio() != ratio or theme is not self.theme:
            self.theme = theme
            self._ground = self.draw_ground()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._ground)
        return painter

    def draw_ground(self) -> QPixmap:
        """Return the static background in the widget's size."""
        raise NotImplementedError


class Lamp(QWidget):
    """A lamp: a ring when off, a disc when well or recording, a triangle for attention, a square when wrong."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._grade: Grade = "off"
        self._name = name
        self.setFixedSize(2 * GRID + 4, 2 * GRID + 4)
        self.show_grade("off", "off")

    def show_grade(self, grade: Grade, text: str) -> None:
        self.setAccessibleName(f"{self._name}: {text}")
        self.setToolTip(text)
        if grade != self._grade:
            self._grade = grade
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        t = theme_of(self)
        colour = {"off": t.quiet, "on": t.record, "well": t.quiet, "look": t.look, "wrong": t.wrong}[self._grade]
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QRectF(self.rect()).adjusted(3, 3, -3, -3)
        painter.setPen(QPen(QColor(colour), 2))
        if self._grade != "off":
            painter.setBrush(QColor(colour))
        match self._grade:
            case "look":
                middle = box.center().x()
                painter.drawPolygon(QPolygonF([QPointF(middle, box.top()), box.bottomRight(), box.bottomLeft()]))
            case "wrong":
                painter.drawRect(box)
            case _:
                painter.drawEllipse(box)


def paint_arrow(painter: QPainter, x: float, tail: float, tip: float, wing: QPointF) -> None:
    """Paint an upright arrow; `wing` is the offset of its barbs' ends, aside and back from the tip [pixel]."""
    back = wing.y() if tail > tip else -wing.y()
    painter.drawLine(QPointF(x, tail), QPointF(x, tip))
    for side in (-wing.x(), wing.x()):
        painter.drawLine(QPointF(x, tip), QPointF(x + side, tip + back))


def mark_failed_solve(painter: QPainter, centre: QPointF, tokens: Tokens) -> None:
    """Mark the point of a failed solve, visible on any background: a ring with a cross."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for colour, width in ((tokens.surface, 5.0), (tokens.wrong, 2.5)):
        painter.setPen(QPen(QColor(colour), width))
        painter.drawEllipse(centre, 11.0, 11.0)
        painter.drawLine(centre + QPointF(-7, -7), centre + QPointF(7, 7))
        painter.drawLine(centre + QPointF(-7, 7), centre + QPointF(7, -7))
