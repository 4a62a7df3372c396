import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QImage, QPainter

from daq_app.qt.painting import faces, lines

pytestmark = pytest.mark.qt


def test_a_line_is_broken_where_a_point_is_unknown_and_every_other_point_is_kept():
    x = np.arange(8.0)
    y = np.array([np.nan, 1.0, 2.0, np.nan, np.nan, 5.0, 6.5, 7.0])
    pieces = [[(p.x(), p.y()) for p in piece] for piece in lines(x, y)]
    assert pieces == [[(1.0, 1.0), (2.0, 2.0)], [(5.0, 5.0), (6.0, 6.5), (7.0, 7.0)]]
    assert lines(np.empty(0), np.empty(0)) == []


def test_faces_are_filled_each_in_its_shade_and_what_they_surround_is_not():
    picture = QImage(90, 90, QImage.Format.Format_RGB32)
    picture.fill(QColor("white"))
    edges = {10.0: 30.0, 30.0: 60.0, 60.0: 80.0}
    around = [(a, b) for a in edges for b in edges if (a, b) != (30.0, 30.0)]
    corners = np.array([[(a, b), (edges[a], b), (edges[a], edges[b]), (a, edges[b])] for a, b in around])
    painter = QPainter(picture)
    painter.setPen(Qt.PenStyle.NoPen)
    colours = {0: QColor("black"), 5: QColor("red")}
    for shade, path in faces(corners, np.array([5 if a == 10.0 else 0 for a, _ in around])):
        painter.setBrush(colours[shade])
        painter.drawPath(path)
    painter.end()

    def expected(x, y):
        inside = 10 < x < 80 and 10 < y < 80 and not (30 < x < 60 and 30 < y < 60)
        return "white" if not inside else "red" if x < 30 else "black"

    places = [(x, y) for x in range(5, 90, 10) for y in range(5, 90, 10)]
    assert all(picture.pixelColor(x, y) == QColor(expected(x, y)) for x, y in places)
    assert list(faces(np.empty((0, 4, 2)), np.empty(0, np.int64))) == []
