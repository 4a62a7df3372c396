"""The rooms of the window, its menu, and what it remembers, in the real window."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from PySide6.QtCore import QSize, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMenu, QWidget

from daq_app.analyst.state import Choose
from daq_app.qt import preferences, tokens
from daq_app.qt.rooms import about_text
from daq_app.recorder.messages import Stop
from tests.daq_app.qt.review.examples import SESSION, Nobody

pytestmark = pytest.mark.qt
PACE = 1.0  # no test here waits for a stroke


@pytest.fixture
def rooms(driver, monkeypatch):
    """Return the rooms; a session that is opened is not analysed, in a process that takes a second to begin."""
    monkeypatch.setattr("daq_app.qt.analyst_window.Analyst", lambda _: Nobody())
    yield driver.window.rooms
    driver.window.rooms.review.leave()
    driver.window.go_to("prepare")


def entries(menu):
    """Return every entry of a menu and of those below it, by its words without the key."""
    actions = {}
    for action in menu.actions():
        below = action.menu()
        if isinstance(below, QMenu):
            actions |= entries(below)
        else:
            actions[action.text().split("\t")[0]] = action
    return actions


def test_theme_and_size_of_type_are_chosen_and_remembered(driver):
    window = driver.window
    actions = entries(window.menuBar())
    plot, page = window.live.plots[0], window.page.screen_fields.thumbnail
    try:
        actions["Dark"].trigger()
        assert tokens.theme_of(window) == tokens.DARK
        assert plot.grab().toImage().pixelColor(1, 1).name() == tokens.DARK.surface  # what is painted by hand follows
        driver.application.processEvents()
        assert page._picture.toImage().pixelColor(2, 2).name() == tokens.DARK.ground
        assert tokens.preferred_tokens() == tokens.DARK
        actions["150 %"].trigger()
        assert preferences.preferred_scale() == 1.5
        assert preferences.type_scale() == 1.0  # until the next start: no part of a window is larger than the rest
        assert "next start" in window.notice._label.text()
    finally:
        actions["System"].trigger()
        preferences.settings().remove(preferences.SCALE)


def test_the_rail_opens_the_rooms_that_can_be_entered_and_says_why_another_cannot(driver, rooms):
    rail = driver.window.rail.buttons
    assert (rooms.room, rail["prepare"].isChecked()) == ("prepare", True)
    assert not rail["run"].isEnabled()
    assert "start one in Prepare" in rail["run"].toolTip()
    driver.begin()
    assert (rooms.room, rail["run"].isChecked()) == ("run", True)
    assert not rail["prepare"].isEnabled()
    assert "end it" in rail["prepare"].accessibleDescription()


def test_a_session_that_has_ended_is_opened_with_the_mouse_and_a_key_leads_back(driver, rooms):
    window = driver.window
    driver.begin()
    window.bridge.send(Stop())
    folder = driver.sealed().folder
    driver.application.processEvents()
    assert window.to_do.second.isVisible()
    assert window.course.buttons["end"].accessibleName() == "New: new session, after one has ended"
    QTest.mouseClick(window.to_do.second, Qt.MouseButton.LeftButton)
    assert rooms.room == "review"
    assert rooms.analyst.state.folder == folder
    assert preferences.recent_sessions()[0] == folder.absolute()
    assert rooms.review.recent.item(0).data(Qt.ItemDataRole.UserRole) == str(folder.absolute())
    QTest.keyClick(rooms.analyst.trials.list, Qt.Key.Key_F3)  # from wherever the keyboard is
    assert rooms.room == "run"


def test_a_key_of_the_course_leads_back_from_review_and_does_nothing_unseen(driver, rooms):
    window = driver.window
    driver.begin()
    rooms.open(SESSION)
    trial, phase = driver.session.trial, driver.session.phase
    window.act("primary")
    assert rooms.room == "run"
    assert (driver.session.trial, driver.session.phase) == (trial, phase)


def test_keys_of_review_serve_wherever_the_keyboard_is(driver, rooms):
    window = driver.window
    rooms.open(SESSION)
    window.setFocus()
    QTest.keyClick(window, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    assert window.focusWidget() is rooms.analyst.trials.list
    window.setFocus()
    QTest.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert rooms.room == "review"
    QTest.keyClick(window, Qt.Key.Key_F1)
    assert (rooms.analyst.keys.isVisible(), window.keys.isVisible()) == (True, False)


@pytest.mark.parametrize(("width", "list_shown"), [(683, False), (1366, True)])
def test_review_is_as_narrow_as_the_screen_and_gives_up_its_list_for_that(driver, rooms, width, list_shown):
    window = driver.window
    before = window.size()
    rooms.open(SESSION)
    window.go_to("prepare")

    def resized():
        window.resize(width, 600)
        return window.width() == width

    driver.until(resized, "a room that nobody sees to give way")
    rooms.open(SESSION)
    driver.application.processEvents()
    assert window.width() == width
    assert rooms.review.recent.isVisible() == list_shown
    rooms.review.leave()
    assert rooms.review.recent.isVisible()
    window.resize(before)


def test_review_opens_on_the_newest_session_and_a_click_on_another_takes_its_place(driver, rooms, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    preferences.remember_session(other)
    preferences.remember_session(SESSION)
    driver.window.act("go to review")
    assert rooms.analyst.state.folder == SESSION.absolute()
    rooms.review.recent.itemClicked.emit(rooms.review.recent.item(1))
    assert rooms.analyst.state.folder == other
    other.rmdir()
    assert other not in preferences.recent_sessions()  # what is gone is not offered


def test_the_name_of_a_session_is_whole_in_the_list(driver, rooms, tmp_path):
    folder = tmp_path / "P03_a-protocol-of-our-own_20261128T082638-rescued"
    folder.mkdir()
    preferences.remember_session(folder)
    driver.window.act("go to review")
    driver.application.processEvents()
    recent = rooms.review.recent
    assert recent.item(0).text() == "P03\na-protocol-of-our-own\n2026-11-28 08:26:38-rescued"
    assert recent.visualItemRect(recent.item(0)).width() <= recent.viewport().width()
    assert recent.visualItemRect(recent.item(0)).height() >= 4 * recent.fontMetrics().height()


def test_a_session_that_is_open_stays_as_it_is_when_it_is_chosen_again(rooms, monkeypatch):
    monkeypatch.chdir(SESSION.parent)
    rooms.open(Path(SESSION.name))
    analyst = rooms.analyst
    rooms.review.recent.itemClicked.emit(rooms.review.recent.item(0))
    assert rooms.analyst is analyst


def test_a_session_that_is_open_follows_the_theme_with_its_plots_and_all_that_it_shows(driver, rooms, monkeypatch):
    monkeypatch.undo()
    actions = entries(driver.window.menuBar())
    rooms.open(SESSION)
    driver.until(lambda: rooms.analyst.state.report is not None, "the report")
    try:
        for theme, room, colours in (("Dark", "review", tokens.DARK), ("Light", "prepare", tokens.LIGHT)):
            driver.window.go_to(room)
            actions[theme].trigger()
            driver.application.processEvents()
            driver.window.go_to("review")
            driver.application.processEvents()
            plot = rooms.analyst.stroke.stroke._plots[0]
            assert plot.backgroundBrush().color().name() == colours.surface
            assert rooms.analyst.state.report is not None  # which takes longer to compute than to hand over
        rooms.analyst.ask(Choose(0))
        driver.until(lambda: rooms.analyst.state.row == 0 and rooms.analyst.state.step is None, "the trial")
    finally:
        actions["System"].trigger()


def test_a_new_session_that_is_asked_for_in_review_is_prepared_in_sight(driver, rooms):
    window = driver.window
    driver.begin()
    window.bridge.send(Stop())
    driver.sealed()
    rooms.open(SESSION)
    QTest.keyClick(window, Qt.Key.Key_N, Qt.KeyboardModifier.ControlModifier)
    assert driver.session is None
    assert rooms.room == "prepare"


def test_every_entry_of_the_menu_does_something_and_course_entries_wait_for_a_session(driver, rooms):
    window = driver.window
    actions = entries(window.menuBar())
    assert actions.keys() >= {"Open session…", "Write report…", "Export…", "Keys", "About daq-app", "Dark", "150 %"}
    assert not actions["End…"].isEnabled()
    assert not actions["Write report…"].isEnabled()
    actions["Keys"].trigger()
    assert window.keys.isVisible()
    actions["Keys"].trigger()
    rooms.open(SESSION)
    assert actions["Write report…"].isEnabled()
    actions["Prepare"].trigger()
    assert rooms.room == "prepare"


def test_the_window_opens_where_it_was_closed(driver):
    before, after = QWidget(), QWidget()
    before.setGeometry(60, 40, 444, 333)
    before.show()
    driver.application.processEvents()
    preferences.save_place(before)
    preferences.restore_place(after)
    assert after.geometry() == before.geometry()
    before.close()


@pytest.mark.usefixtures("application")
def test_a_window_opens_for_the_first_time_as_large_as_it_likes_where_the_screen_has_room(monkeypatch):
    monkeypatch.setattr(preferences, "settings", lambda: SimpleNamespace(value=lambda _: None))
    window = QWidget()
    screen = window.screen().availableSize()
    for likes, takes in (((0.9, 0.8), (0.9, 0.8)), ((2.0, 0.5), (1.0, 0.5))):
        preferred, granted = (QSize(int(screen.width() * a), int(screen.height() * b)) for a, b in (likes, takes))
        window.sizeHint = lambda preferred=preferred: preferred
        preferences.restore_place(window)
        assert window.size().height() == granted.height()
        assert granted.width() - 16 <= window.width() <= granted.width()


def test_about_names_the_versions_it_stands_on():
    words = about_text()
    assert "unknown" not in words
    assert all(name in words for name in ("daq-app", "Python 3", "Qt 6", "numpy", "numba"))
