import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QImage, QPainter

from daq_app.qt.shapes import faces, lines

pytestmark = pytest.mark.qt


def test_a_line_is_broken_where_a_point_is_unknown_and_every_other_point_is_kept():
    x = np.arange(8.0)
    y = np.array([np.nan, 1.0, 2.0, np.nan, np.nan, 5.0, 6.5, 7.0])
    pieces = [[(p.x(), p.y()) for p in piece] for piece in lines(x, y)]
    assert pieces == [[(1.0, 1.0), (2.0, 2.0)], [(5.0, 5.0), (6.0, 6.5), (7.0, 7.0)]]
    assert lines(np.empty(0), np.empty(0)) == []


def test_faces_are_filled_and_what_they_surround_is_not():
    picture = QImage(90, 90, QImage.Format.Format_RGB32)
    picture.fill(QColor("white"))
    low, high = [10.0, 30.0, 60.0], [30.0, 60.0, 80.0]
    squares = [(a, b, c, d) for a, c in zip(low, high, strict=True) for b, d in zip(low, high, strict=True)]
    around = [corner for corner in squares if corner != (30.0, 30.0, 60.0, 60.0)]
    corners = np.array([[(a, b), (c, b), (c, d), (a, d)] for a, b, c, d in around])
    painter = QPainter(picture)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor("black"))
    painter.drawPath(faces(corners))
    painter.end()
    black = {(x, y) for x in range(5, 90, 10) for y in range(5, 90, 10) if picture.pixelColor(x, y) == QColor("black")}
    assert black == {(x, y) for x in range(15, 80, 10) for y in range(15, 80, 10)} - {
        (x, y) for x in (35, 45, 55) for y in (35, 45, 55)
    }
    assert faces(np.empty((0, 4, 2))).isEmpty()
