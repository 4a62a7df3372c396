"""The window without a mouse, without colours, without eyes, on small screens and in other countries."""

import re

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QLocale, QPoint, QPointF, Qt
from PySide6.QtGui import QAccessible, QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QLabel,
    QScrollArea,
    QWidget,
)

from daq_app.qt import answer_fields, preferences
from daq_app.qt.keys import KEYS, act_of
from daq_app.qt.live_panel import FINITE, LivePanel
from daq_app.window.live_trace import CHANNELS
from daq_app.window.new_session import UnfinishedSession
from daq_app.window.view_course import Button
from tests.daq_app.qt.written_text import controls, laid_over, unreached_controls

pytestmark = pytest.mark.qt

PACE = 1.0  # no test here waits for a session


def test_every_control_has_a_name_for_screen_readers(driver):
    for window in (driver.window, driver.window.subject):
        assert [w for w in controls(window) if not w.accessibleName().strip()] == []


def test_every_painted_widget_says_what_it_shows(driver):
    window = driver.window
    paintings = [window.live.map, *window.live.plots, window.subject.line, *window.bench._bars.values()]
    assert all(widget.accessibleName() for widget in paintings)


def test_the_tab_key_goes_through_the_page_from_top_to_bottom_and_reaches_every_control(driver):
    window = driver.window
    page = window.page
    page.subject.setFocus()
    order, reached = [], set()
    for _ in range(60):
        focus = window.focusWidget()
        if focus in reached:
            break
        reached.add(focus)
        order.append(focus)
        QTest.keyClick(focus, Qt.Key.Key_Tab)
    fields = [page.subject, page.stroking, page.answering, page.with_forces, page.area]
    fields += [page.studies, page.protocol, page.seed, page.people_score, page.folder]
    places = [order.index(widget) for widget in fields]
    assert places == sorted(places)
    assert unreached_controls(window, reached) == []


def test_a_click_leaves_space_to_the_primary_button(driver):
    for button in driver.window.findChildren(QAbstractButton):
        assert not button.focusPolicy() & Qt.FocusPolicy.ClickFocus, button.accessibleName()


def test_every_key_of_the_list_is_obeyed_and_no_two_are_the_same():
    assert len({entry.key for entry in KEYS}) == len(KEYS)
    special = {"Space": Qt.Key.Key_Space, "F1": Qt.Key.Key_F1, "Esc": Qt.Key.Key_Escape}
    special |= {f"F{number}": Qt.Key(Qt.Key.Key_F1 + number - 1) for number in range(2, 8)}
    for entry in KEYS:
        modifiers = Qt.KeyboardModifier
        modifier = modifiers.ControlModifier if entry.key.startswith("Ctrl+") else modifiers.NoModifier
        name = entry.key.removeprefix("Ctrl+")
        key = special.get(name) or Qt.Key(ord(name))
        assert act_of(QKeyEvent(QEvent.Type.KeyPress, key, modifier)) == entry.act


def test_f1_shows_the_keys_and_escape_hides_them(driver):
    driver.window.setFocus()
    QTest.keyClick(driver.window, Qt.Key.Key_F1)
    assert driver.window.keys.isVisible()
    QTest.keyClick(driver.window, Qt.Key.Key_Escape)
    assert not driver.window.keys.isVisible()


@pytest.mark.parametrize("size", [(1366, 768), (911, 512), (3840, 2160)])
def test_the_window_fits_the_screen_and_nothing_is_laid_over_anything_else(driver, size):
    window = driver.window
    window.resize(*size)
    driver.application.processEvents()
    assert (window.width(), window.height()) == size
    parts = (window.header, window.to_do, window._left, window.live, window.bench, window.strip)
    assert laid_over(window, parts) == []


def test_of_a_window_lower_than_its_panels_all_can_be_scrolled_to(driver):
    window = driver.window
    window.resize(683, 384)  # a screen of 1366 x 768 that shows everything twice as large
    driver.application.processEvents()
    assert (window.width(), window.height()) == (683, 384)
    area = next(area for area in window.rooms.findChildren(QScrollArea) if area.isAncestorOf(window.middle))
    assert area.horizontalScrollBar().maximum() == 0
    for widget in (window.middle.redo, window.live.plots[1], window.to_do.primary):
        if area.isAncestorOf(widget):
            area.ensureWidgetVisible(widget)
        place = widget.rect().translated(widget.mapTo(window, widget.rect().topLeft()))
        assert window.rect().contains(place)
        assert widget.height() >= widget.minimumHeight()


def test_in_the_lowest_window_a_field_that_the_program_goes_to_is_seen(driver):
    window, field = driver.window, driver.window.page.folder
    window.resize(683, 384)
    driver.application.processEvents()
    assert field.visibleRegion().isEmpty()
    field.setFocus()
    driver.until(lambda: field.visibleRegion().boundingRect() == field.rect(), "the whole field")


def test_in_the_lowest_window_a_session_offered_late_leaves_the_field_in_use_in_sight(driver, tmp_path):
    window, page = driver.window, driver.window.page
    window.resize(683, 384)
    driver.application.processEvents()
    page.subject.setFocus()
    driver.until(lambda: page.subject.visibleRegion().boundingRect() == page.subject.rect(), "the whole field")
    page.cut_short.show_sessions((UnfinishedSession(tmp_path, "P03: 2 of 10 trials done"),))
    try:
        for _ in range(10):
            driver.application.processEvents()
        assert page.subject.visibleRegion().boundingRect() == page.subject.rect()
    finally:
        page.cut_short.show_sessions(())


def test_the_panels_stay_in_place_when_the_current_step_takes_a_second_line(driver):
    window, places = driver.window, []
    window.resize(1366, 768)
    two_lines = "Mount sample K3 with its arrow away from the subject, then press Space to measure the zero."
    window.bridge.blockSignals(True)
    try:
        for sentence in ("Mount sample K3.", two_lines):
            for _ in range(3):
                window.to_do.show_what(sentence, None, 0)
                driver.application.processEvents()
            places.append(window._below.y())
    finally:
        window.bridge.blockSignals(False)
    line = window.to_do.sentence.fontMetrics().horizontalAdvance(two_lines)
    assert 1.0 < line / window.to_do.sentence.width() < 2.0
    assert places[0] == places[1]


def test_in_the_lowest_window_a_session_begins_at_its_plans_top_and_a_note_is_typed_where_it_is_seen(driver):
    window = driver.window
    window.resize(683, 384)
    driver.application.processEvents()
    driver.begin()
    driver.go_on("mounting")
    panel, line = window._below.viewport(), window.course.line
    assert window.course.mapTo(panel, QPoint()).y() == 0
    QTest.keyClick(window, Qt.Key.Key_N)
    driver.until(lambda: line.visibleRegion().boundingRect() == line.rect(), "the whole line of the note")
    assert laid_over(window.course, (window.course._question, line, window.course._do)) == []


def test_what_to_do_now_is_whole_in_the_lowest_window_with_a_banner_of_three_lines_and_two_buttons(driver):
    window = driver.window
    window.resize(683, 384)
    window.notice.warn("The session was cut short. " * 6)
    sentence = "The session was cut short and can be resumed at the same trial."
    window.to_do.show_what(sentence, Button("Resume", "Space"), 0)
    window.to_do.second.show()
    driver.application.processEvents()
    sentence, first, second = window.to_do.sentence, window.to_do.primary, window.to_do.second
    assert sentence.height() >= sentence.heightForWidth(sentence.width())
    assert not first.geometry().intersects(second.geometry())
    assert window.to_do.rect().contains(first.geometry().united(second.geometry()))


def test_no_button_beside_the_plan_cuts_its_words_off(driver):
    course = driver.window.course
    before = course.buttons["end"].text(), course.buttons["redo"].text()
    course.buttons["end"].setText("New Ctrl+N")  # once the session has ended, the longest it says
    course.buttons["redo"].setText("Redo 98–99 R")  # of two that are compared, late in a long session
    course.ensurePolished()
    edges = course.layout().contentsMargins()
    width = course._bottom.widget(0).layout().sizeHint().width() + edges.left() + edges.right()
    assert width <= driver.window._left.width()
    course.buttons["end"].setText(before[0])
    course.buttons["redo"].setText(before[1])


def test_below_1366_pixels_the_bench_folds_and_a_key_unfolds_it(driver):
    window = driver.window
    window.resize(1200, 800)
    assert window.strip.isVisible()
    assert not window.bench.isVisible()
    window.act("bench")
    assert window.bench.isVisible()
    window.act("bench")
    window._bench_shown = None
    window.resize(1440, 900)
    assert window.bench.isVisible()


def fit_line(subject):
    """Let the line fit its screen, and return what is known of that."""
    subject.fit_screen()
    return preferences.millimetres(subject.screen())


def test_a_key_chooses_the_kinematics_of_the_live_model_and_the_choice_is_remembered(driver):
    window, model = driver.window, driver.window.bridge.model
    original = preferences.settings
    for kinematics, value in (("finite", "yes"), ("small", "no")):
        QTest.keyClick(window, Qt.Key.Key_M)
        assert model.kinematics == kinematics
        assert original().value(FINITE) == value
        again = LivePanel(window.bridge.feed, model)
        assert again.bar.finite.isChecked() == (kinematics == "finite")


def test_what_the_live_model_says_of_the_readings_stands_in_the_window(driver):
    model, finger = driver.window.bridge.model, driver.window.live.finger
    driver.window.resize(1920, 1080)  # the cards of a new session leave the finger no place in less
    model.prepare()
    driver.until(lambda: finger.accessibleName().endswith("Model at small strain: nothing touches."), "the model")
    assert len(model.provisional.row) > 0
    model.close()


@pytest.mark.parametrize("locale", ["de_DE", "ja_JP", "tr_TR"])
def test_numbers_have_a_point_in_every_country(driver, locale):
    before = QLocale()
    QLocale.setDefault(QLocale(locale))
    try:
        driver.window.live._read_at = 0.0
        driver.until(lambda: "." in driver.window.live.bar.values["N"].text(), "a number")
        text = repr(driver.view)
        assert not re.search(r"\d,\d", text)
    finally:
        QLocale.setDefault(before)


# ---- the subject's line


def shown_line(driver):
    line = driver.window.subject.line
    driver.window.subject.show()
    driver.window.subject._pages.setCurrentIndex(1)
    driver.window.subject._answer_fields.setCurrentWidget(driver.window.subject._scale)
    driver.application.processEvents()
    line.begin(("low", "high"))
    return line


def test_a_click_is_answered_where_it_was_seen_at_every_place_of_the_line(driver):
    line = shown_line(driver)
    half_a_pixel = 100 * 0.5 / (answer_fields.LENGTH * line._pixels_per_mm)
    for position in (0.0, 12.5, 50.0, 87.5, 100.0):
        QTest.mouseClick(line, Qt.MouseButton.LeftButton, pos=line.point_at(position).toPoint())
        assert line.answer.score == pytest.approx(position, abs=half_a_pixel + 0.06)
    assert line.answer.device == "mouse"
    assert line.answer.corrections == 4


def test_there_is_no_mark_before_the_first_touch_and_no_next_without_an_answer(driver):
    line = shown_line(driver)
    empty = line.grab().toImage()
    driver.window.subject._answer_changed()
    assert not driver.window.subject.next.isVisibleTo(driver.window.subject)
    QTest.mouseClick(line, Qt.MouseButton.LeftButton, pos=line.point_at(30.0).toPoint())
    assert line.grab().toImage() != empty
    assert driver.window.subject.next.isVisibleTo(driver.window.subject._pages.widget(1))
    line.begin(("low", "high"))
    assert line.grab().toImage() == empty


def test_a_touch_is_recorded_as_a_touch(driver):
    line = shown_line(driver)
    device = QTest.createTouchDevice()
    place = line.point_at(25.0).toPoint()
    QTest.touchEvent(line, device).press(0, place, line).commit()
    QTest.touchEvent(line, device).release(0, place, line).commit()
    assert line.answer.device == "touch"
    assert line.answer.score == pytest.approx(25.0, abs=0.3)


def test_the_line_is_100_mm_long_by_the_ruler_that_was_held_to_it(driver):
    subject = driver.window.subject
    screen = subject.screen()
    before = fit_line(subject).pixels
    assert preferences.store_ruler_length(screen, 80.0) is not None  # a line meant to be 100 mm measured 80
    assert fit_line(subject).pixels == pytest.approx(before * 100 / 80)
    assert fit_line(subject).checked
    length = subject.line.point_at(100.0) - subject.line.point_at(0.0)
    assert QPointF(length).x() == pytest.approx(100 * before * 100 / 80, abs=1e-6)
    assert preferences.store_ruler_length(screen, 3.0) is None
    preferences.settings().clear()
    assert fit_line(subject).pixels == pytest.approx(before)


def test_no_widget_of_the_subject_shows_a_number_or_a_tick(driver):
    subject: QWidget = driver.window.subject
    line = shown_line(driver)
    QTest.keyClick(line, Qt.Key.Key_Right)
    widgets = [w for w in subject._pages.widget(1).findChildren(QWidget) if w.isVisible()]
    assert line in widgets
    texts = [w.text() for w in widgets if hasattr(w, "text")]
    assert not any(re.search(r"\d", text) for text in texts)


@pytest.mark.usefixtures("application")
def test_the_line_is_a_slider_to_assistive_technology_which_may_move_it():
    line = answer_fields.ScoreLine(lambda: 0.0)
    line.begin(("not at all", "very"))
    reader = QAccessible.queryAccessibleInterface(line)
    assert reader.role() == QAccessible.Role.Slider
    assert "No answer yet" in reader.text(QAccessible.Text.Description)
    assert not line.answered
    reader.valueInterface().setCurrentValue(72)
    assert line.answer.score == 72.0
    QTest.keyClick(line, Qt.Key.Key_Left)
    assert reader.valueInterface().currentValue() == 71
    line.begin(("not at all", "very"))
    assert not line.answered


def test_a_number_is_read_aloud_with_its_value(driver):
    bar = driver.window.live.bar
    bar.show_numbers(np.full((len(CHANNELS), 3), 0.5))
    assert bar.values["N"].accessibleName() == "Normal force 0.50 N"
    assert bar.values["mu"].accessibleName() == "Friction coefficient 0.50"


def test_no_name_for_screen_readers_hides_the_value_that_a_label_shows(driver):
    labels = [label for label in driver.window.findChildren(QLabel) if label.text() and label.accessibleName()]
    assert driver.window.bench._fields["rate"] in labels
    silent = [label for label in labels if label.text() != "–"]
    texts = {s: s.text().replace("\u200b", "").replace("\xa0", " ") for s in silent if s.text() != "SIMULATED"}
    assert [text for s, text in texts.items() if text not in s.accessibleName().replace("\xa0", " ")] == []
    assert driver.window.bench._fields["rate"].accessibleName().startswith("rate ")


def test_every_drop_down_is_read_aloud_with_one_label_and_what_is_chosen(driver):
    lists = driver.window.findChildren(QComboBox)
    assert len(lists) >= 6
    for box in lists:
        reader = QAccessible.queryAccessibleInterface(box)
        relations = reader.relations()
        labels = [of.text(QAccessible.Text.Name) for of, how in relations if how & QAccessible.RelationFlag.Label]
        assert labels == [box.accessibleName()]
        assert labels[0].strip()
        assert reader.text(QAccessible.Text.Value) == box.currentText()


@pytest.mark.parametrize("size", [16, 64, 256])
def test_the_window_has_an_icon_that_is_drawn_at_every_size(driver, size):
    picture = driver.window.windowIcon().pixmap(size, size).toImage()
    assert picture.width() == size
    colours = {picture.pixelColor(x, y).rgb() for x in range(0, size, 2) for y in range(0, size, 2)}
    assert len(colours) > 3
