"""The way back in Review, from the number to its readings: one line of links."""

import re

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from daq_app.analyst import state as m
from daq_app.analyst.session_words import lineage
from daq_app.analyst.state import selected_row
from daq_app.qt.analyst_window import LineageLabel
from tests.daq_app.qt.review.examples import raw


def test_the_way_back_takes_two_rows_in_half_a_small_screen_and_no_link_is_broken(window):
    way = LineageLabel()
    way.show_links(lineage(window.state))
    assert way.heightForWidth(660) <= 2.5 * way.fontMetrics().lineSpacing()
    links = re.findall(">([^<]+)</a>", way.text())
    assert len(links) == 6
    assert not any(" " in link for link in links)


def test_every_link_of_the_way_back_is_followed_by_keys(application, window):
    way = LineageLabel()
    way.show_links(lineage(window.state))
    way.show()
    way.activateWindow()
    way.setFocus()
    application.processEvents()
    links = []
    way.followed.connect(links.append)
    for _ in range(6):
        QTest.keyClick(way, Qt.Key.Key_Tab)
        QTest.keyClick(way, Qt.Key.Key_Return)
    way.close()
    assert links == ["session", "trial", "prediction", "friction", "window", "readings"]


def test_the_way_back_ends_at_the_first_raw_reading_of_the_steady_window(window):
    stroke = selected_row(window.state).stroke
    window.take(m.Excerpt(stroke.number, raw(stroke)))
    window._follow("readings")
    table = window.stroke.readings.table
    row = table.currentIndex().row()
    assert [table.model().index(at, 0).data() for at in (row - 1, row)] == ["", "steady"]
    assert table.model().index(row, 1).data() == str(row + 7)
