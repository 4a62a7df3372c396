"""Arrays as what a painter draws, without a Python object for each point."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QByteArray, QDataStream
from PySide6.QtGui import QPainterPath, QPolygonF
from shiboken6 import VoidPtr

Array = NDArray[np.float64]

_ELEMENT = np.dtype([("kind", ">i4"), ("x", ">f8"), ("y", ">f8")])  # of a path in Qt's own serial form
_TAIL = (0).to_bytes(4, "big") + (1).to_bytes(4, "big")  # where the last part begins; overlaps are filled


def lines(x: Array, y: Array) -> list[QPolygonF]:
    """Return the line through points (n,) in pieces: it is broken where a coordinate is nan."""
    known = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(np.diff(known, prepend=False, append=False))
    points = np.column_stack([x, y])
    return [_polygon(points[a:b]) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)]


def _polygon(points: Array) -> QPolygonF:
    """Return points (n, 2), n > 0, as Qt holds them: written into its own memory, as pyqtgraph does it."""
    made = QPolygonF()
    made.resize(len(points))
    memory: Any = VoidPtr(made.data(), points.nbytes, True)  # pyright: ignore[reportCallIssue]  its stub knows none
    np.frombuffer(memory, np.float64).reshape(-1, 2)[:] = points
    return made


def faces(corners: Array) -> QPainterPath:
    """Return closed polygons (f, k, 2), to be filled at once."""
    made = QPainterPath()
    count, each = corners.shape[:2]
    if not count:
        return made
    elements = np.empty((count, each), _ELEMENT)
    elements["kind"] = 1  # draws a line to it ...
    elements["kind"][:, 0] = 0  # ... or begins anew there
    elements["x"], elements["y"] = corners[..., 0], corners[..., 1]
    stream = QDataStream(QByteArray(elements.size.to_bytes(4, "big") + elements.tobytes() + _TAIL))
    stream >> made  # pyright: ignore[reportUnusedExpression]  it reads into `made`
    return made
