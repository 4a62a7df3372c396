"""Rows of lists are whole: where they are longer than the list is wide, they take a second line."""

import pytest
from PySide6.QtCore import QRect, QSize
from PySide6.QtWidgets import QStyleFactory

from daq_app.qt import tokens
from daq_app.qt.parts import RowList

pytestmark = pytest.mark.qt

LONG, SHORT = "✓  12  K50   µ 0.44   number 0.125   flawed", "○  13  R35"


def test_a_row_that_is_longer_than_its_list_is_wide_takes_as_many_lines_as_it_needs(application):
    rows = RowList("plan")
    rows.addItems([LONG, SHORT])
    rows.show()  # in the style that the application has
    words = rows.fontMetrics().horizontalAdvance(LONG)
    rows.resize(words + 60, 200)
    application.processEvents()
    long, short = (rows.visualItemRect(rows.item(at)).height() for at in (0, 1))
    assert long == short
    rows.resize(2 * words // 3, 200)
    application.processEvents()
    line = rows.fontMetrics().height()  # the style may leave room around a row, but not between its lines
    assert rows.visualItemRect(rows.item(0)).height() >= short + 0.9 * line
    assert rows.visualItemRect(rows.item(1)).height() == short
    rows.hide()


def test_a_row_on_one_line_is_painted_whole_at_every_width_of_its_list(application):
    rows = RowList("plan")
    fusion = QStyleFactory.create("Fusion")
    fusion.setParent(rows)  # which does not keep its style alive
    rows.setStyle(fusion)
    rows.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    rows.addItems([LONG, SHORT])
    rows.show()
    words = rows.fontMetrics().horizontalAdvance(LONG)
    lines, pictures = [], []
    for width in range(words - 20, words + 60):
        rows.resize(width, 200)
        application.processEvents()
        row = rows.visualItemRect(rows.item(0))
        lines.append(row.height())
        pictures.append(rows.viewport().grab(QRect(row.topLeft(), QSize(words - 20, row.height()))).toImage())
    assert lines[0] > lines[-1]
    assert all(picture == pictures[-1] for line, picture in zip(lines, pictures, strict=True) if line == lines[-1])
    rows.hide()
