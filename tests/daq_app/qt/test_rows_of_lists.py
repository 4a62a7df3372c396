"""Rows of lists are whole: where they are longer than the list is wide, they take a second line."""

import pytest

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
