"""Letters that Qt's own style writes are whole, and words have as many lines as they need."""

from itertools import combinations, pairwise

import pytest
from pyqtgraph import InfLineLabel, LegendItem, PlotCurveItem
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFontMetricsF
from PySide6.QtWidgets import QMainWindow, QStyleFactory, QTabWidget, QWidget

from daq_app.qt import tokens
from daq_app.qt.keys import KeysPage
from daq_app.qt.parts import WrappedLabel
from daq_app.qt.plots import ZoomedPlot
from daq_app.qt.stroke_view import StrokeView
from daq_app.qt.tables import TextTable
from tests.daq_app.qt.painted_text import contrast
from tests.sessions.report_example import stroke

pytestmark = pytest.mark.qt


def lowest_ink(tabs):
    """Return the lowest row of the second tab in which something is written [px]."""
    image, box = tabs.grab().toImage(), tabs.tabRect(1).adjusted(6, 6, -6, -4)
    return max(
        y
        for y in range(box.top(), box.bottom())
        for x in range(box.left(), box.right())
        if contrast(QColor(tokens.LIGHT.ground).name(), image.pixelColor(x, y).name()) > 1.5
    )


def test_the_letters_of_a_tab_that_is_not_chosen_are_whole(application):
    widget = QTabWidget()
    fusion = QStyleFactory.create("Fusion")
    fusion.setParent(widget)  # which does not keep its style alive
    widget.setStyle(fusion)
    widget.setPalette(tokens.palette(tokens.LIGHT))
    widget.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    for words in ("one", "two"):
        widget.addTab(QWidget(), words)
    widget.show()
    rows = []
    for words in ("HHHH", "gjpqy"):
        widget.setTabText(1, words)
        application.processEvents()
        rows.append(lowest_ink(widget.tabBar()))
    metrics = QFontMetricsF(widget.tabBar().font())
    below = metrics.tightBoundingRect("gjpqy").bottom() - metrics.tightBoundingRect("HHHH").bottom()
    assert rows[1] - rows[0] > below - 0.5
    widget.hide()


@pytest.mark.usefixtures("application")
@pytest.mark.parametrize("keeps", [False, True])
def test_words_take_the_lines_they_need_at_the_width_they_have_now(keeps):
    window = QWidget()
    narrow, fresh = WrappedLabel("value", keeps_room=keeps), WrappedLabel("value")
    for one in (narrow, fresh):
        one.setParent(window)
    window.show()
    for width in (90, 400):
        narrow.resize(width, 20)
        narrow.show_text(10 * "several words ")
    fresh.resize(400, 20)
    fresh.show_text(10 * "several words ")
    assert narrow.height() == fresh.height()
    window.hide()


@pytest.mark.parametrize(("height", "scrolled"), [(1000, False), (500, True)])
def test_every_key_is_seen_at_once_where_the_window_has_room_for_the_list(application, height, scrolled):
    window = QMainWindow()
    window.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    window.resize(1280, height)
    window.show()
    keys = KeysPage(window)
    keys.toggle()
    application.processEvents()
    assert (keys._area.verticalScrollBar().maximum() > 0) is scrolled
    assert keys.height() <= height
    window.hide()  # nothing may lie over the windows of other tests


@pytest.mark.usefixtures("application")
def test_numbers_stand_at_the_right_of_a_column_of_numbers_and_at_the_left_above_a_long_text():
    table = TextTable("facts", ("name", "value", "digits"))
    table.show_lines((("\u00b5", "0.48", "2"), ("material", 20 * "a long text ", "\u2013")))
    cells = table.model()
    places = [cells.data(cells.index(0, at), Qt.ItemDataRole.TextAlignmentRole) for at in range(3)]
    right = Qt.AlignmentFlag.AlignRight
    assert [place is not None and right in Qt.AlignmentFlag(place) for place in places] == [False, False, True]


@pytest.mark.usefixtures("application")
@pytest.mark.parametrize("greatest", [0.9, 10.0, 28.0])
@pytest.mark.parametrize("height", [30, 50, 90, 300])
def test_numbers_of_a_low_plot_do_not_lie_on_each_other(height, greatest):
    axis = ZoomedPlot(tokens.LIGHT).getPlotItem().getAxis("left")
    line = QFontMetricsF(axis.style["tickFont"]).height()
    _, always = axis.tickValues(0.0, greatest, height)[0]  # of finer ones pyqtgraph writes those that find room
    apart = [(b - a) * height / greatest for a, b in pairwise(always)]
    assert min(apart, default=line) >= line
    assert height < 90 or len(always) >= 3


def test_the_name_of_a_vertical_axis_is_whole_in_the_lowest_plot_of_a_stroke(application):
    view = StrokeView(tokens.LIGHT)
    view.resize(view.minimumSizeHint())
    view.show()
    for plot in view.findChildren(ZoomedPlot):
        plot.show_numbers(visible=True)
        for _ in range(5):  # the axes have found their sizes
            application.processEvents()
        name = plot.getPlotItem().getAxis("left").label.sceneBoundingRect()
        assert plot.sceneRect().top() <= name.top() < name.bottom() <= plot.sceneRect().bottom()
    view.hide()


@pytest.mark.parametrize("size", [(560, 320), (560, 700), (1400, 500)])
def test_words_of_edges_and_the_names_of_curves_lie_above_the_forces_and_not_on_each_other(application, size):
    view = StrokeView(tokens.LIGHT)
    view.show_stroke(stroke(1, "stickiness", 50))
    view.resize(*size)
    view.show()
    for _ in range(5):
        application.processEvents()
    items = view.findChildren(ZoomedPlot)[0].scene().items()
    curves = [item for item in items if isinstance(item, PlotCurveItem) and item.name() in ("N", "T")]
    highest = min(curve.mapRectToScene(curve.boundingRect()).top() for curve in curves)
    words = [item for item in items if isinstance(item, InfLineLabel | LegendItem) and item.isVisible()]
    rooms = [item.mapRectToScene(item.boundingRect()).adjusted(4, 4, -4, -4) for item in words]  # less empty margins
    assert len(rooms) == 5
    assert max(room.bottom() for room in rooms) < highest
    assert not any(one.intersects(other) for one, other in combinations(rooms, 2))
    view.hide()
