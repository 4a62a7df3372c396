"""The Run room in the real window: its tiles, a trial that is inspected, its pictures, and the drawer."""

from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QPushButton
from qt_events import click

from daq_app.qt import preferences, tokens
from daq_app.qt.bench_panel import BenchStrip
from daq_app.qt.course_panel import CoursePanel
from daq_app.qt.live_panel import LivePanel
from daq_app.qt.middle import InspectedTrial, TrialStrip
from daq_app.qt.preferences import DRAWER, DRAWER_SIZES
from daq_app.window.course_state import Mark
from daq_app.window.live_model import SettledSolve
from daq_app.window.live_trace import CHANNELS, LiveTrace
from daq_app.window.state import NewSession
from daq_app.window.view_course import Inspection, PlanRow, Tile
from tests.daq_app.qt.written_text import cut_off
from tests.daq_app.session_messages import stroke_at

pytestmark = pytest.mark.qt
PACE = 1.0  # no test here waits for a stroke

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def own_panel(driver):
    """Return signals of a transducer of its own, and a function that shows readings of all its channels until then."""
    feed = SimpleNamespace(trace=LiveTrace(100.0))
    panel = LivePanel(feed, driver.window.bridge.model)
    panel.resize(1200, 800)
    panel.show()
    driver.application.processEvents()

    def feed_readings(first, last, value=lambda time: np.ones(len(time)), marks=()):
        time = np.arange(first, last, 0.01)
        feed.trace.add(time, np.tile(value(time), (len(CHANNELS), 1)))
        panel.draw(marks, last)

    yield feed, panel, feed_readings
    panel.hide()


def at_size(driver, *size):
    """Return the window and its signals, the window being of a size and having the keyboard."""
    driver.window.resize(*size)
    driver.application.processEvents()
    driver.window.setFocus()
    return driver.window, driver.window.live


def test_the_drawer_is_opened_by_key_and_mouse_and_remembers_that_and_its_width(driver):
    window, live = at_size(driver, 1920, 1000)
    try:
        assert live.map.isVisible()
        QTest.keyClick(window, Qt.Key.Key_D)
        assert not live.map.isVisible()
        assert live.tab.accessibleName().startswith("open the drawer")
        assert preferences.settings().value(DRAWER) == "no"
        again = LivePanel(window.bridge.feed, window.bridge.model)
        assert not again.drawer.open
        click(live.tab)
        assert live.map.isVisible()
        handle = live.drawer.handle(1)
        before = live.drawer.sizes()
        middle = handle.rect().center()
        QTest.mousePress(handle, LEFT, pos=middle)
        QTest.mouseMove(handle, middle - QPoint(60, 0))
        QTest.mouseRelease(handle, LEFT, pos=middle - QPoint(60, 0))
        assert live.drawer.sizes()[1] == pytest.approx(before[1] + 60, abs=3)
        again = LivePanel(window.bridge.feed, window.bridge.model)
        again.resize(live.size())
        again.show()
        driver.application.processEvents()
        assert again.drawer.sizes()[1] == pytest.approx(live.drawer.sizes()[1], rel=0.05)
        again.hide()
    finally:
        for key in (DRAWER, DRAWER_SIZES):
            preferences.settings().remove(key)


def test_where_there_is_no_room_for_both_the_drawer_takes_the_place_of_the_stroke(driver):
    window, live = at_size(driver, 1000, 700)
    for visible, hidden in ((0, 3), (3, 0), (0, 3)):
        assert live.plots[visible].isVisible()
        assert not live.plots[hidden].isVisible()
        QTest.keyClick(window, Qt.Key.Key_D)
    assert preferences.settings().value(DRAWER) is None  # what there was no room for is no wish


def test_the_finger_is_seen_all_through_a_trial_on_the_smallest_screen_with_a_whole_bench(driver):
    window, live = at_size(driver, 1366, 768)
    driver.begin()
    driver.until(lambda: window.to_do.sentence.text().startswith("Mount"), "the first trial")
    driver.application.processEvents()
    assert live.finger.isVisible()


def test_the_trial_in_hand_stays_among_the_rows_that_are_seen_when_the_plan_gets_lower(application):
    panel = CoursePanel(lambda _: None)
    rows = tuple(PlanRow("current" if at == 9 else "done", "✓", f"{at}  K50") for at in range(20))
    panel._view = SimpleNamespace(rows=rows)
    panel._show_rows(rows)
    panel.show()
    for height in (900, 380):
        panel.resize(316, height)
        for _ in range(3):
            application.processEvents()
        place = panel.plan.visualItemRect(panel.plan.item(9))
        assert panel.plan.viewport().rect().contains(place)
    panel.hide()


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_an_inspected_trial_is_read_whole_where_there_is_least_room(application, type_size, scale):
    type_size(scale)
    panel = InspectedTrial(lambda: None)
    panel.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    cells = (("N", "12.34 N"), ("T", "12.34 N"), ("mu", "0.41"), ("speed", "120 mm/s"))
    words = "Redo: the finger was not lifted between strokes. Lift the finger between strokes."
    heading, stroke = "Trial 12, D86, take 2: done again, score 40", stroke_at(np.linspace(0.0, 3.0, 50))
    panel.show_trial(Inspection(12, heading, words, words, "refused", cells, stroke))
    panel.resize(420, round(640 * scale))  # as the middle of a window of 1366 pixels at 200 % is
    panel.show()
    application.processEvents()
    assert panel.width() == 420
    assert cut_off(panel) == []
    panel.hide()


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_of_sixty_trials_the_one_in_hand_is_in_sight_and_no_tile_cuts_its_words(application, type_size, scale):
    type_size(scale)
    strip = TrialStrip(lambda _: None)
    strip.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    strip.resize(600, strip.height())
    strip.show()
    kinds = ["done"] * 40 + ["current"] + ["coming"] * 19
    strip.show_tiles(tuple(Tile(at + 1, f"D{at:02d}", kind) for at, kind in enumerate(kinds)))
    application.processEvents()
    application.processEvents()
    tile = strip.tiles[40]
    place = tile.mapTo(strip.viewport(), tile.rect().center())
    assert strip.viewport().rect().contains(place)
    assert all(widget.size().expandedTo(widget.sizeHint()) == widget.size() for widget in strip.tiles)
    strip.hide()


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_the_folded_bench_cuts_no_words_and_covers_none_where_it_is_lowest(application, type_size, scale):
    type_size(scale)
    strip = BenchStrip(lambda: None)
    strip.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    strip.show()
    strip.show_view(SimpleNamespace(lamp="wrong", lamp_text="does not answer", bars=()))
    application.processEvents()
    strip.resize(strip.width(), strip.minimumSizeHint().height())
    application.processEvents()
    text = strip.findChild(QLabel)
    assert text.height() >= text.heightForWidth(text.width()) > text.fontMetrics().height()
    assert text.geometry().top() > strip.findChild(QPushButton).geometry().bottom()
    strip.hide()


@pytest.mark.usefixtures("application")
def test_a_tile_of_a_session_that_is_over_cannot_be_pressed():
    strip = TrialStrip(lambda _: None)
    strip.show_tiles(tuple(Tile(number, "K50", "coming") for number in range(1, 4)))
    strip.show()
    third = strip.tiles[2]
    strip.show_tiles((Tile(1, "D86", "current"),))
    assert len(strip.tiles) == 1
    assert not third.isVisible()


def test_a_stroke_stays_drawn_however_long_its_score_is_awaited(own_panel):
    _, panel, feed_readings = own_panel
    marks = (Mark("onset", 2.0, 2.0), Mark("lift", 5.0, 5.0))

    def curve_until(first, last):
        feed_readings(first, last, lambda time: np.where((time > 2.0) & (time < 5.0), 3.0, 0.0), marks)
        return panel.plots[0]._columns.values

    curve = curve_until(0.0, 20.0)
    assert np.nanmax(curve) == 3.0
    for minute in range(4):
        later_curve = curve_until(20.0 + 60.0 * minute, 80.0 + 60.0 * minute)
    np.testing.assert_array_equal(later_curve, curve)


@pytest.mark.parametrize("opened", [False, True])
@pytest.mark.parametrize("width", [240, 420, 800])
def test_buttons_over_the_pictures_are_whole_or_not_there(driver, width, opened):
    panel = LivePanel(driver.window.bridge.feed, driver.window.bridge.model)
    panel.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    panel.set_room(room=False)
    panel.show()
    if opened:
        panel.toggle_drawer()
    visible = set()
    for height in range(150, 420, 15):
        panel.resize(width, height)
        for _ in range(3):
            driver.application.processEvents()
        for act in (panel.bar.finite, panel.bar.length, panel.bar.hold):
            visible.add(act.isVisible())
            if act.isVisible():
                assert act.visibleRegion().boundingRect() == act.rect(), height
                assert act.height() >= act.sizeHint().height()
    panel.hide()
    assert visible == {False, True}


def test_a_picture_is_held_only_once_there_is_one_and_no_longer_than_its_transducer_sends(own_panel):
    feed, panel, feed_readings = own_panel
    click(panel.bar.hold)
    assert not panel.bar.hold.isChecked()

    def ends_after(first, last):
        feed_readings(first, last)
        return panel.plots[0]._end_label, panel.plots[4]._end_label, panel.bar.hold.isChecked()

    assert ends_after(100.0, 105.0) == ("now", "now", False)
    click(panel.bar.hold)
    assert ends_after(105.0, 106.0) == ("held", "held", True)
    feed.trace = LiveTrace(100.0)  # of a transducer that was plugged in anew
    assert ends_after(0.0, 1.0) == ("now", "now", False)


def test_a_transducer_that_sends_nothing_now_has_no_number_now(own_panel):
    _, panel, feed_readings = own_panel
    feed_readings(0.0, 1.0, lambda time: np.full(len(time), 3.0))
    assert panel.bar.values["N"].text() == "3.00 N"
    assert (len(panel.map._trail), panel.plots[0]._end_label) == (50, "now")
    panel.draw((), 2.5, silent=True)
    assert panel.bar.values["N"].text() == "–"
    assert (len(panel.map._trail), panel.plots[0]._end_label) == (0, "last reading")
    assert panel.finger.toolTip() == "Nothing is measured that the model could follow."
    feed_readings(2.5, 3.0)
    assert panel.plots[0]._end_label == "now"


def test_a_visit_of_scores_only_has_no_force_plots_that_stay_empty(driver):
    window = driver.window
    driver.begin("P31", scores_only=True)
    assert not any(plot.isVisible() for plot in window.live.plots)
    assert not window.live.bar.values["N"].isVisible()
    assert window.middle.stroke.text() == "No forces are recorded: this visit is of scores only."
    driver.abort()
    window.bridge.send(NewSession())
    driver.until(lambda: driver.session is None, "the next session")
    assert any(plot.isVisible() for plot in window.live.plots)


def test_the_page_of_a_new_session_shows_no_full_solve_of_the_last_subjects_stroke(driver):
    bridge = driver.window.bridge
    driver.begin("P32", scores_only=True)
    driver.abort()
    bridge.model.settled = SettledSolve((1.2, 2.0), 0.004, 0.01, 0.0041, np.empty(0), None, 2.0, "small")
    bridge.send(NewSession())
    assert bridge.model.settled is None
