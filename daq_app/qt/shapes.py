"""Arrays as what a painter draws, without a Python object for each point."""

from collections.abc import Iterator
from itertools import pairwise
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QByteArray, QDataStream, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen, QPixmap, QPolygonF
from PySide6.QtWidgets import QWidget
from shiboken6 import VoidPtr

Array = NDArray[np.float64]

_ELEMENT = np.dtype([("kind", ">i4"), ("x", ">f8"), ("y", ">f8")])  # of a path in Qt's own serial form
_TAIL = (0).to_bytes(4, "big") + (1).to_bytes(4, "big")  # where the last part begins; overlaps are filled


def blank(widget: QWidget, colour: str) -> QPixmap:
    """Return a picture as large as a widget, in the pixels of its screen: never a pixel short where scaling is odd."""
    ratio = widget.devicePixelRatioF()
    pixmap = QPixmap(ceil(widget.width() * ratio), ceil(widget.height() * ratio))
    pixmap.setDevicePixelRatio(ratio)
    pixmap.fill(QColor(colour))
    return pixmap


def sheer(colour: str, alpha: int) -> QColor:
    """Return a colour that lets what is behind it through, from 0 all of it to 255 nothing."""
    shown = QColor(colour)
    shown.setAlpha(alpha)
    return shown


def fine(colour: str | QColor, style: Qt.PenStyle = Qt.PenStyle.SolidLine) -> QPen:
    """Return a pen one pixel of the screen wide, whatever the scaling."""
    pen = QPen(QColor(colour), 1, style)
    pen.setCosmetic(True)
    return pen


def draw_line(painter: QPainter, x: Array, y: Array) -> None:
    """Draw the line through points (n,) with a fine pen, two pixels of the screen high.

    It is drawn twice, a pixel apart: a pen of two pixels takes a hundred times as long.
    """
    pieces = lines(x, y)
    pixel = 1.0 / painter.device().devicePixelRatio()
    for down in (0.0, pixel):
        painter.translate(0.0, down)
        for piece in pieces:
            painter.drawPolyline(piece)
    painter.translate(0.0, -pixel)


def lines(x: Array, y: Array) -> list[QPolygonF]:
    """Return the line through points (n,) in pieces: it is broken where a coordinate is nan."""
    points = np.empty((len(x), 2))
    points[:, 0], points[:, 1] = x, y
    known = np.zeros(len(x) + 2, np.bool_)
    known[1:-1] = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(known[1:] != known[:-1])
    return [_polygon(points[a:b]) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)]


def _polygon(points: Array) -> QPolygonF:
    """Return points (n, 2), n > 0, as Qt holds them: written into its own memory, as pyqtgraph does it."""
    polygon = QPolygonF()
    polygon.resize(len(points))
    memory: Any = VoidPtr(polygon.data(), points.nbytes, True)  # pyright: ignore[reportCallIssue]  its stub knows none
    np.frombuffer(memory, np.float64).reshape(-1, 2)[:] = points
    return polygon


def faces(corners: Array, shades: NDArray[np.int64]) -> Iterator[tuple[int, QPainterPath]]:
    """Return closed polygons (f, k, 2) as one path for each of their shades (f,), to be filled at once."""
    order = np.argsort(shades, kind="stable")
    sorted_shades = shades[order]
    elements = np.empty(corners.shape[:2], _ELEMENT)
    elements["kind"] = 1  # draws a line to it ...
    elements["kind"][:, 0] = 0  # ... or begins anew there
    elements["x"], elements["y"] = corners[order, :, 0], corners[order, :, 1]
    edges = np.flatnonzero(np.diff(sorted_shades, prepend=-1, append=-1)).tolist()
    for begin, end in pairwise(edges):
        part = elements[begin:end]
        path = QPainterPath()
        stream = QDataStream(QByteArray(part.size.to_bytes(4, "big") + part.tobytes() + _TAIL))
        stream >> path  # pyright: ignore[reportUnusedExpression]  it reads into `path`
        yield int(sorted_shades[begin]), path
