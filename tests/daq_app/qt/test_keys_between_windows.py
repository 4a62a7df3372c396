"""Keys that reach one window and are meant for the other, and what the window is left with when something ends."""

import os
import signal
import time
from dataclasses import replace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPushButton

from daq_app.qt.preferences import settings
from daq_app.qt.start import SIMULATED_BENCH
from daq_app.recorder.messages import Connect, Disconnect
from sessions.run import steps
from sessions.run.replay import different_events, replay

pytestmark = pytest.mark.qt

ENTER, SPACE, ESCAPE = Qt.Key.Key_Return, Qt.Key.Key_Space, Qt.Key.Key_Escape
PACE = 3.0  # a simulated hand strokes 1.2 s after a redo, and the undoing must come before it


def test_an_answer_to_a_recorder_that_is_gone_takes_nothing_away_and_space_resumes(driver):
    driver.begin()
    driver.go_on("scoring")
    subject = driver.window.subject
    QTest.keyClick(subject.line, Qt.Key.Key_Right)
    os.kill(driver.window.bridge._client.pid, signal.SIGKILL)
    driver.until(lambda: driver.view.banner is not None, "the banner")
    assert not subject.scoring
    QTest.keyClick(subject, Qt.Key.Key_A)  # no request goes to a recorder that is not there
    driver.window.bridge.send(steps.Scored(50.0))
    assert driver.view.course.primary.label == "Resume session"
    QTest.keyClick(subject, SPACE)  # from whichever window
    driver.phase("mounting")
    assert driver.session.trial == 1
    driver.go_on("scoring")


def test_an_answer_can_be_given_with_keys_that_reach_the_experimenters_window(driver):
    window = driver.window
    driver.begin()
    driver.go_on("scoring")
    window.setFocus()
    for key in (Qt.Key.Key_Right, Qt.Key.Key_PageUp):
        QTest.keyClick(window, key)
    assert window.subject.line.answer.score == 60.0
    driver.answer(on=window)
    assert driver.session.trials[0].answer == "score 60"


def test_the_page_leaves_the_experimenters_screen_with_the_answer_also_where_there_is_another(driver, monkeypatch):
    driver.begin()
    driver.go_on("scoring")
    subject, own = driver.window.subject, driver.window.screen()
    monkeypatch.setattr(QGuiApplication, "screens", lambda: [own, own])
    assert subject.isVisible()
    driver.answer(Qt.Key.Key_Right)
    assert not subject.isVisible()


def test_no_key_answers_on_a_page_that_was_closed_and_its_mark_waits(driver):
    window = driver.window
    driver.begin()
    driver.go_on("scoring")
    QTest.keyClick(window.subject.line, Qt.Key.Key_Right)
    window.subject.close()
    for key in (Qt.Key.Key_PageUp, ENTER, SPACE):
        QTest.keyClick(window, key)
    assert (driver.session.phase, window.subject.line.answer.score) == ("scoring", 50.0)
    assert "was closed" in window.notice._label.text()
    QTest.keyClick(window, Qt.Key.Key_F6)
    assert window.notice._label.text() == ""
    driver.answer(on=window)
    assert driver.session.trials[0].answer == "score 50"


def test_a_report_that_comes_between_the_answer_and_its_record_asks_for_no_second_answer(driver):
    driver.begin()
    driver.go_on("scoring")
    subject, view = driver.window.subject, driver.view.subject
    QTest.keyClick(subject.line, Qt.Key.Key_Right)
    subject.show_view(view, None)
    assert subject.line.answer.score == 50.0
    with_answer = driver.window.bridge.view
    QTest.keyClick(subject.line, ENTER)
    driver.window.show_view(with_answer)
    assert not subject.scoring
    driver.until(lambda: driver.session.trial == 2, "the next trial")
    driver.go_on("scoring")
    assert subject.scoring
    assert subject.line.answer.score is None


def test_while_a_note_is_typed_every_key_is_the_notes_and_none_an_answer(driver):
    window = driver.window
    driver.begin()
    driver.go_on("scoring")
    QTest.keyClick(window.subject, Qt.Key.Key_N)
    assert window.course.asking
    QTest.keyClicks(window.course.line, "1")
    QTest.keyClicks(window.subject.line, "0 rs")  # after a click on the subject's window, say
    for key in (Qt.Key.Key_PageUp, Qt.Key.Key_Up):
        QTest.keyClick(window.course.line, key)
        QTest.keyClick(window.subject.line, key)
    assert window.course.line.text() == "10 rs"
    assert not window.subject.line.answered
    assert driver.session.phase == "scoring"
    QTest.keyClick(window.subject, ESCAPE)
    assert not window.course.asking
    QTest.keyClick(window.subject.line, Qt.Key.Key_Right)
    assert window.subject.line.answered


def test_ctrl_z_in_an_empty_entry_brings_no_words_of_an_entry_before(driver):
    driver.begin()
    driver.go_on("scoring")
    course = driver.window.course
    QTest.keyClick(driver.window, Qt.Key.Key_N)
    QTest.keyClicks(course.line, "a note")
    QTest.keyClick(course.line, ENTER)
    assert not course.asking
    QTest.keyClick(driver.window, Qt.Key.Key_N)
    QTest.keyClick(course.line, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert course.line.text() == ""


def begin_scoring(driver):
    """Begin a visit without forces, and go on to the first answer."""
    driver.begin(scores_only=True)
    driver.go_on("ready")
    driver.go_on("scoring")


def test_the_keys_of_the_course_work_in_the_field_where_the_subject_types_a_number(driver):
    window = driver.window
    window.page.protocol.setCurrentText("magnitude-estimation")
    begin_scoring(driver)
    field = window.subject.number.field
    QTest.keyClicks(field, "20")
    QTest.keyClick(field, Qt.Key.Key_N)
    assert window.course.asking
    QTest.keyClick(window.course.line, ESCAPE)
    assert field.text() == "20"
    QTest.keyClick(field, Qt.Key.Key_P)
    driver.phase("paused")


def test_a_number_that_reaches_the_experimenters_window_is_typed_whole_and_its_0_is_no_refusal(driver):
    window = driver.window
    window.page.protocol.setCurrentText("magnitude-estimation")
    begin_scoring(driver)
    window.setFocus()
    QTest.keyClicks(window, "20")
    assert driver.session.phase == "scoring"
    assert window.subject.number.field.text() == "20"
    driver.answer(on=window)
    assert driver.session.trials[0].answer == "number 20"


def requests_of(driver, patch):
    """Return the list of what the window sends from now on, while nothing reaches the recorder."""
    messages = []
    patch.setattr(driver.window.bridge, "send", messages.append)
    return messages


def test_a_press_meant_for_another_step_does_not_confirm_the_one_that_an_answer_on_a_tablet_brings(driver, monkeypatch):
    window = driver.window
    begin_scoring(driver)
    QApplication.setDoubleClickInterval(60_000)  # however slow this machine is
    try:
        window.bridge.send(steps.Scored(40.0))  # as from a tablet
        driver.until(lambda: driver.session.trial == 2 and driver.session.phase == "mounting", "the next trial")
        with monkeypatch.context() as patch:
            messages = requests_of(driver, patch)
            QTest.keyClick(window, SPACE)
            QTest.mouseClick(window.to_do.primary, Qt.MouseButton.LeftButton)
            assert messages == []
            QApplication.setDoubleClickInterval(0)
            QTest.keyClick(window, SPACE)
            assert messages == [driver.view.course.primary.sends]
    finally:
        QApplication.setDoubleClickInterval(0)


def test_a_step_counts_as_seen_from_when_it_was_painted_even_by_a_window_that_was_busy(driver, monkeypatch):
    to_do = driver.window.to_do
    begin_scoring(driver)
    monkeypatch.setattr(to_do, "paintEvent", lambda _: None)
    window_is_busy, view = 0.2, driver.view
    try:
        to_do.show_what("Mount it.", replace(view.course.buttons["note"], sends=steps.StimulusMounted("K1")), 0)
        time.sleep(window_is_busy)
        monkeypatch.undo()
        QApplication.setDoubleClickInterval(round(1e3 * window_is_busy / 2))
        to_do.repaint()
        assert not to_do.perceived
        driver.until(lambda: to_do.perceived, "the time to see it")
    finally:
        QApplication.setDoubleClickInterval(0)
        driver.window.show_view(view)


def test_enter_of_a_subject_goes_on_with_nothing_however_slowly_it_is_pressed_and_space_gives_no_answer(
    driver, monkeypatch
):
    window = driver.window
    begin_scoring(driver)
    QTest.keyClick(window.subject.line, Qt.Key.Key_Right)
    for place in (window.subject, window.subject.line, window):
        QTest.keyClick(place, SPACE)  # the experimenter's, who does not wait
    assert (driver.session.phase, window.subject.line.answer.score) == ("scoring", 50.0)
    driver.answer()
    with monkeypatch.context() as patch:
        messages = requests_of(driver, patch)
        for place in (window.subject, window, window.course.plan) * 3:
            QTest.keyClick(place, ENTER)
            QTest.keyClick(place, Qt.Key.Key_Enter)
        assert messages == []
        assert "Space goes on" in window.notice._label.text()
        QTest.keyClick(window.subject, SPACE)
        assert messages == [driver.view.course.primary.sends]


def test_enter_goes_on_where_no_person_answers_at_this_computer(driver, monkeypatch):
    begin_scoring(driver)
    driver.answer(Qt.Key.Key_Right)
    monkeypatch.setattr(driver.window.keyboard, "_answered_by_keys", lambda: False)  # but on a tablet
    messages = requests_of(driver, monkeypatch)
    QTest.keyClick(driver.window, ENTER)
    assert messages == [driver.view.course.primary.sends]
    monkeypatch.undo()


def test_a_reason_that_is_typed_while_the_course_goes_on_discards_no_other_trial_than_the_one_asked_about(driver):
    window, course = driver.window, driver.window.course
    begin_scoring(driver)
    QTest.keyClick(window, Qt.Key.Key_S)
    assert "trial 1 (" in course._question.text()
    QTest.keyClicks(course.line, "it was dropped")
    window.bridge.send(steps.Scored(40.0))  # meanwhile the subject answers, on another screen
    driver.until(lambda: driver.session.trial == 2, "the next trial")
    QTest.keyClick(course.line, ENTER)
    assert course.asking
    assert course.line.text() == "it was dropped"
    assert "trial 2 (" in course._question.text()
    assert [trial.outcome for trial in driver.session.trials[:2]] == ["done", "coming"]
    QTest.keyClick(course.line, ENTER)
    driver.until(lambda: driver.session.trials[1].outcome == "skipped", "the second trial left out")


def test_redo_names_its_trial_on_both_buttons_and_in_its_question(driver):
    window = driver.window
    driver.begin(scores_only=True)
    driver.go_on("ready")
    code = driver.session.trials[0].trial.stimulus.code
    assert (window.middle.redo.text(), window.course.buttons["redo"].text()) == ("Redo 1  R", "Redo 1 R")
    QTest.keyClick(window.subject, Qt.Key.Key_R)
    assert f"trial 1 ({code})" in window.course._question.text()
    QTest.keyClick(window.course.line, ESCAPE)


def test_the_button_below_a_reason_says_what_enter_does(driver):
    course, texts = driver.window.course, []
    driver.begin(scores_only=True)
    driver.go_on("ready")
    for act in ("redo", "end", "note"):
        driver.window.act(act)
        texts += [
            push.text() for push in course.findChildren(QPushButton) if push.isVisible() and "Enter" in push.text()
        ]
        QTest.keyClick(course.line, ESCAPE)
    assert texts == ["Redo 1  Enter", "End  Enter", "Note  Enter"]


def test_a_redo_by_mistake_is_undone_with_a_key_and_the_replay_of_the_session_agrees(driver, tmp_path):
    window = driver.window
    driver.begin()
    driver.go_on("scoring")
    driver.until(lambda: driver.session.trial_state(1).quality is not None, "what is said of the stroke")
    assert not window.middle.undo.isVisible()
    QTest.keyClick(window, Qt.Key.Key_R)
    if window.course.asking:
        QTest.keyClicks(window.course.line, "mistaken")
        QTest.keyClick(window.course.line, ENTER)
    driver.until(lambda: driver.view.course.buttons["undo"].enabled, "a redo that can be undone")
    assert window.middle.undo.text() == "Undo redo 1  Ctrl+Z"
    QTest.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    driver.until(lambda: driver.session.phase == "scoring", "the score is asked for again")
    driver.answer(Qt.Key.Key_Right)
    window.bridge.send(steps.Redo("mistaken too"))
    driver.until(lambda: driver.session.trial == 1 and window.middle.undo.isVisible(), "the first trial again")
    QTest.mouseClick(window.middle.undo, Qt.MouseButton.LeftButton)
    driver.until(lambda: driver.session.trial == 2 and driver.session.phase == "mounting", "the second trial")
    assert driver.session.trial_state(1).quality is not None
    recording = driver.abort()
    first = recording.trials[0]
    assert (first.outcome, first.score, first.take.number) == ("scored", 50.0, 1)
    assert [take.discard_reason for take in first.other_takes] == ["the redo was undone"]
    replica = replay(recording, tmp_path / "replayed", None, lambda *_: None)
    assert not list(different_events(recording, replica))


def test_the_page_of_the_next_session_has_no_code_proposes_the_next_and_enter_begins_none(driver):
    driver.begin()
    driver.abort()
    QTest.keyClick(driver.window, SPACE)
    assert driver.session is None
    assert driver.window.page.subject.text() == ""
    assert driver.window.page.subject.placeholderText() == "e.g. P08"  # after P07
    QTest.keyClick(driver.window.page.subject, ENTER)
    assert "never a name" in driver.window.page.frames["Subject"].message.text()
    assert driver.session is None


def test_the_enter_that_keeps_the_rulers_length_begins_no_session(driver):
    window = driver.window
    QTest.keyClicks(window.page.subject, "P07")
    window.act("ruler")
    length = window.subject.ruler._length
    QTest.keyClicks(length, "100")
    QTest.keyClick(length, ENTER)
    driver.until(lambda: not window.subject.measuring, "the end of the measuring")
    end = time.monotonic() + 0.5
    driver.until(lambda: time.monotonic() > end)
    settings().clear()
    assert driver.session is None
    assert driver.view.lamp.text == "not recording"


def test_enter_in_the_address_connects_what_was_typed_and_a_wrong_one_is_named_and_can_be_mended(driver):
    window, choice = driver.window, driver.window.bench._choice
    window.bridge.send(Disconnect())
    driver.until(lambda: driver.state.bench.link == "none", "the end of the link")
    try:
        for address, words in (("simm:", "simm"), ("sim:?rate=100", "")):
            choice.setFocus()
            choice.lineEdit().selectAll()
            QTest.keyClicks(choice, address)
            QTest.keyClick(choice, ENTER)
            driver.until(lambda: driver.state.bench.link in ("none", "open"), "an answer")
            sentence = "" if driver.view.banner is None else driver.view.banner.sentence
            assert words in sentence
            assert "None" not in sentence
        assert driver.state.bench.link == "open"
        assert driver.state.bench.info.rate == 100.0
        assert driver.session is None
    finally:
        window.bridge.send(Connect(SIMULATED_BENCH))
        driver.until(lambda: driver.state.bench.link == "open", "the simulated bench")


def test_an_address_that_is_being_typed_stays_when_other_devices_are_found(driver):
    panel, view = driver.window.bench, driver.view.bench
    panel._choice.setEditText("net-ft://10.0.0.9")
    panel._show_devices(replace(view, uri=""))
    assert panel._choice.currentText() == "net-ft://10.0.0.9"
    assert panel._selected_uri() == "net-ft://10.0.0.9"
    panel._show_devices(view)


def test_the_address_of_the_bench_is_that_of_the_transducer_which_a_session_brought(driver):
    panel, view = driver.window.bench, driver.view.bench
    try:
        panel.show_view(replace(view, uri="net-ft://10.0.0.9"))
        assert panel._choice.currentText() == "net-ft://10.0.0.9"
    finally:
        panel.show_view(view)


def test_a_key_for_the_zero_says_in_a_session_that_each_trial_measures_its_own(driver):
    driver.begin()
    driver.window.act("tare")
    assert driver.window.notice.warning.startswith("Each trial measures its own zero")
