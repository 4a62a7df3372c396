"""Sessions in the real window, from the first key to the last, against the recorded session."""

import os
import signal
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QRect, Qt
from PySide6.QtGui import QCloseEvent, QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from qt_events import click

from daq_app.qt import header
from daq_app.qt.header import Notice
from daq_app.window.view import Banner
from sessions.plan.protocols.protocol import protocol_file
from sessions.plan.study import create_study

pytestmark = pytest.mark.qt

ENTER, SPACE = Qt.Key.Key_Return, Qt.Key.Key_Space


def one_trial(driver, *, presses=3, stays=True):
    """Mount, let the simulated hand stroke, score with the arrow keys; a stroke that is `stays` stays meanwhile."""
    window, number = driver.window, driver.session.trial
    driver.go_on("scoring")
    driver.until(lambda: driver.session.trial_state(number).quality is not None, "what is said of the stroke")
    if stays:
        driver.until(
            lambda: window.live.plots[0]._end_label == "lift + 1 s", "the stroke stays while its score is awaited"
        )
    driver.answer(*[Qt.Key.Key_Right] * presses)


def test_a_whole_session_with_a_tare_and_a_redo_by_keyboard_alone(driver):
    window = driver.window
    window.setFocus()
    QTest.keyClick(window, Qt.Key.Key_T)
    driver.until(lambda: driver.state.bench.zero is not None, "the zero")
    window.page.subject.setFocus()
    driver.begin()
    one_trial(driver, presses=1)
    one_trial(driver, presses=4)
    # The second trial is taken up again, with a reason that is typed.
    QTest.keyClick(window, Qt.Key.Key_R)
    if window.course.asking:
        QTest.keyClicks(window.course.line, "the finger slipped")
        QTest.keyClick(window.course.line, ENTER)
    driver.until(lambda: driver.session.trial == 2 and driver.session.phase == "mounting", "the second trial again")
    while driver.session.phase != "closing":
        one_trial(driver)
    QTest.keyClick(window, SPACE)
    recording = driver.sealed()
    assert recording.end["complete"]
    assert [record.score for record in recording.trials] == [50.0, 52.0, 52.0]
    assert recording.trials[1].take.number == 2
    assert [take.number for take in recording.trials[1].other_takes] == [1]
    answers = [event.data for event in recording.events if event.kind == "scored"]
    assert [position for _, position in answers[0]["positions"]] == [50.0]
    assert [position for _, position in answers[1]["positions"]] == [50.0, 51.0, 52.0, 53.0]
    assert all(data["input_device"] == "keyboard" for data in answers)
    assert driver.state.failure is None
    assert driver.state.drawing_error is None
    qualities = [trial.quality for trial in driver.session.trials]
    assert all(quality is not None and quality.stroke.mu_dynamic is not None for quality in qualities)
    QTest.keyClick(window, SPACE)
    assert driver.session is None


def test_a_recorder_that_is_killed_is_one_banner_and_the_session_goes_on_at_the_same_trial(driver):
    driver.begin("P08")
    one_trial(driver)
    folder, row = driver.session.folder, driver.view.course.rows[1]
    assert "µ" in row.outcome
    os.kill(driver.window.bridge._client.pid, signal.SIGKILL)
    driver.until(lambda: driver.view.banner is not None, "the banner")
    assert driver.view.banner.grade == "wrong"
    assert driver.view.lamp.grade == "wrong"
    assert driver.view.course.primary.label == "Resume session"
    QTest.keyClick(driver.window, SPACE)
    assert driver.session.phase == "resuming"
    driver.phase("mounting")
    assert driver.session.folder == folder
    assert driver.session.trial == 2
    assert driver.view.course.rows[1].kind == "done"
    driver.until(lambda: driver.view.course.rows[1] == row, "the friction from before")
    assert driver.view.course.stroke.text.startswith(f"Stroke on {driver.session.trials[0].code}")
    assert "steady" not in {mark.kind for mark in driver.session.marks}  # that stream has ended
    one_trial(driver)
    driver.window.act("end")
    QTest.keyClicks(driver.window.course.line, "enough")
    QTest.keyClick(driver.window.course.line, ENTER)
    recording = driver.sealed()
    assert [record.outcome for record in recording.trials] == ["scored", "scored", "open"]
    assert [event.kind for event in recording.events].count("resumed") == 1


def test_a_subject_is_enrolled_by_key_and_a_session_of_its_study_runs_by_itself_and_says_it_is_simulated(driver):
    page = driver.window.page
    text = protocol_file("sensotact-friction").read_text(encoding="utf-8")
    study = Path(page.folder.text()) / "pilot"
    create_study(study, text, 11, blinded=True)
    page.simulated.setChecked(True)
    QTest.keyClicks(page.subject, "S01")
    QApplication.sendEvent(page, QEvent(QEvent.Type.ActivationChange))  # back from where the study was made
    assert [page.studies.itemText(at) for at in range(page.studies.count())] == ["", "pilot"]
    QTest.keyClick(page.studies, Qt.Key.Key_Down)
    assert page.form().study == "pilot"
    assert "not enrolled" in page.frames["Subject"].message.text()
    assert not driver.window.to_do.primary.isEnabled()
    assert not page.protocol.isEnabled()
    QTest.keyClick(page._enrol, SPACE)
    assert "S01 is enrolled" in page.frames["Subject"].message.text()
    assert not page._enrol.isVisible()
    QTest.keyClick(page.subject, ENTER)
    driver.sealed()
    assert Path(driver.session.folder).parent == study
    assert driver.session.end.complete
    assert [trial.outcome for trial in driver.session.trials] == ["done"] * 10
    assert "SIMULATED" in driver.view.simulated
    assert not driver.window.subject.isVisible()


def test_an_error_while_drawing_is_said_and_the_session_goes_on(driver, monkeypatch):
    driver.begin("P09")

    def fails(*_):
        raise ValueError("no such picture")

    monkeypatch.setattr(driver.window.live, "draw", fails)
    monkeypatch.setattr(driver.window.bridge.model, "add", fails)
    driver.until(lambda: driver.view.banner is not None, "the banner")
    assert "the recording continues" in driver.view.banner.sentence
    one_trial(driver, stays=False)
    assert driver.view.lamp.grade == "on"


def test_a_wrong_form_begins_nothing_and_typing_goes_to_the_wrong_field(driver):
    window = driver.window
    QTest.keyClicks(window.page.subject, "Ada Lovelace")
    QTest.keyClick(window.page.subject, ENTER)
    assert driver.session is None
    words = window.page.frames["Subject"].message
    assert "never a name" in words.text()
    assert words.isVisible()
    assert words.property("grade") == "wrong"
    assert window.focusWidget() is window.page.subject
    window.page.subject.setText("P07")
    assert "never a name" not in words.text()  # at once, not at the next Start
    assert words.property("grade") == ""


def test_closing_while_a_session_is_recorded_asks_once_and_leaves_a_session_that_can_be_resumed(driver, monkeypatch):
    driver.begin("P10")
    window = driver.window
    window.close()
    assert window.isVisible()
    assert "close again" in window.notice._label.text()
    driver.go_on("scoring")
    driver.until(lambda: window.notice._label.text() == "", "the session goes on: nothing is asked any more")
    monkeypatch.setattr(window.bridge, "end", lambda: None)
    monkeypatch.setattr(QGuiApplication, "quit", lambda: None)
    for leaves in (False, True):
        event = QCloseEvent()
        window.closeEvent(event)
        assert event.isAccepted() is leaves
        assert "close again" in window.notice._label.text()


@pytest.mark.usefixtures("application")
def test_a_question_stays_long_enough_to_be_read_while_a_pilot_goes_on(monkeypatch):
    time = [100.0]
    monkeypatch.setattr(header, "monotonic", lambda: time[0])
    notice = Notice(print)
    notice.show_view(None, "", "stroke")
    notice.warn("close again")
    notice.show_view(None, "", "score")
    assert notice.warning == "close again"
    time[0] += header.LEGIBLE
    notice.show_view(None, "", "score")
    assert notice.warning == ""


@pytest.mark.usefixtures("application")
def test_a_notice_is_not_seen_before_its_window():
    assert not Notice(print).isVisible()


def test_the_warning_of_a_tablet_gives_way_to_others_and_goes_when_it_answers_again(driver, monkeypatch):
    window, server = driver.window, SimpleNamespace(connected=False)
    driver.begin("P13")
    monkeypatch.setattr(window, "tablet", SimpleNamespace(server=server))
    window.show_view(driver.view)
    assert "tablet does not answer" in window.notice._label.text()
    window.close()
    window.show_view(driver.view)
    assert "close again" in window.notice._label.text()
    window.notice.warn("")
    window.show_view(driver.view)
    server.connected = True
    window.show_view(driver.view)
    assert "tablet" not in window.notice._label.text()


def test_on_a_second_screen_the_subject_sees_every_page_from_the_first_on_and_the_keyboard_stays(driver, monkeypatch):
    window = driver.window
    window.subject.hide()
    other = SimpleNamespace(availableGeometry=lambda: QRect(1500, 0, 800, 600))
    monkeypatch.setattr(QGuiApplication, "screens", lambda: [window.screen(), other])
    driver.begin("P12")
    assert window.subject.isVisible()
    assert "Keep your fingers off" in window.subject._text.text()
    assert window.subject.testAttribute(Qt.WidgetAttribute.WA_ShowWithoutActivating)
    window.subject.close()
    assert "F6 opens it again" in window.notice._label.text()
    driver.go_on("ready", "stroking")
    assert not window.subject.isVisible()  # whoever closed it is not contradicted before an answer is due
    driver.phase("scoring")
    driver.until(window.subject.isVisible, "the page for an answer")


def test_after_the_ruler_the_experimenters_window_is_in_front_on_one_screen(driver):
    window = driver.window
    QTest.keyClick(window, Qt.Key.Key_M, Qt.KeyboardModifier.ControlModifier)
    assert window.subject.isVisible()
    assert window.subject.measuring
    window.subject.ruler.finished.emit()
    assert not window.subject.isVisible()
    driver.until(window.isActiveWindow, "the experimenter's window")


def test_what_is_below_the_sentence_stays_in_place_when_a_shorter_one_comes(driver):
    window, to_do = driver.window, driver.window.to_do
    window.resize(1100, 900)
    long = "Mount sample K50, its arrow away from the subject. Then press Space to zero. " * 2
    places = []
    for sentence in (long, "Stroke on K50 is being recorded."):
        for _ in range(5):  # the layout follows in steps
            to_do.show_what(sentence, None, 1)
            driver.application.processEvents()
        places.append(window.middle.mapTo(window, window.middle.rect().topLeft()).y())
    assert places[0] == places[1]
    window.resize(1440, 900)


def test_a_warning_stands_beside_a_banner_and_gives_way_to_what_the_session_says(driver):
    notice, banner = driver.window.notice, Banner("wrong", "The transducer does not answer: no readings for 1 s.")
    notice.show_view(banner, "", "Mount")
    notice.warn("Close again.")
    for seconds in (2, 3):  # the banner counts
        sentence = f"The transducer does not answer: no readings for {seconds} s."
        notice.show_view(replace(banner, sentence=sentence), "", "Mount")
        assert "does not answer" in notice._label.text()
        assert notice._label.text().endswith("Close again.")
    notice.show_view(None, "To be done again: trial 5 (K50).", "Mount")
    assert notice._label.text() == "To be done again: trial 5 (K50)."


def test_numbers_on_ones_own_scale_and_practice_before_them_are_asked_for_and_kept(driver):
    window = driver.window
    window.page.protocol.setCurrentText("magnitude-estimation")
    window.page.practice.setChecked(True)
    driver.begin("P11", scores_only=True)
    assert driver.view.course.headline.startswith("Practice: mount sample")
    driver.go_on("ready")
    driver.go_on("scoring")
    assert driver.view.subject.kind == "number"
    QTest.keyClicks(window.subject.number.field, "12,5")
    QTest.keyClick(window.subject.number.field, ENTER)
    driver.until(lambda: driver.session.trials[0].outcome == "done", "the next trial")
    assert driver.session.trials[0].answer == "number 12.5"
    window.act("note")
    QTest.keyClicks(window.course.line, "a door slammed")
    QTest.keyClick(window.course.line, ENTER)
    driver.until(lambda: driver.session.notes == ("a door slammed",), "the note")
    [answer] = [event.data for event in driver.abort().events if event.kind == "number_given"]
    assert (answer["number"], answer["input_device"]) == (12.5, "keyboard")


def test_which_of_two_is_chosen_with_a_key_and_kept(driver):
    window = driver.window
    window.page.protocol.setCurrentText("paired-comparison")
    driver.begin("P12", scores_only=True)
    for _ in range(2):
        number = driver.session.trial
        driver.go_on("ready")
        QTest.keyClick(window, SPACE)
        driver.until(lambda n=number: driver.session.trial != n or driver.session.phase == "scoring", "the second")
    driver.phase("scoring")
    assert driver.view.subject.kind == "choice"
    QTest.keyClick(window.subject.choice, Qt.Key.Key_1)
    QTest.keyClick(window.subject.choice, Qt.Key.Key_2)
    QTest.keyClick(window.subject.choice, ENTER)
    driver.until(lambda: driver.session.trials[1].outcome == "done", "the next trial")
    assert driver.session.trials[1].answer == "the second"


def test_on_one_screen_the_experimenters_window_comes_back_when_a_question_is_taken_back(driver):
    window = driver.window
    driver.begin("P13", scores_only=True)
    driver.go_on("ready")
    driver.go_on("scoring")
    driver.until(window.subject.isVisible, "the page for an answer")
    QTest.keyClick(window.subject, Qt.Key.Key_0)
    driver.phase("mounting")
    driver.until(window.isActiveWindow, "the experimenter's window")
    assert not window.subject.isVisible()


def test_a_tile_shows_the_stroke_of_its_trial_until_the_next_onset(driver):
    window, middle = driver.window, driver.window.middle
    assert not middle.strip.isVisible()
    driver.begin("P30")
    assert [tile.text()[0] for tile in middle.strip.tiles] == ["▶", "○", "○"]
    one_trial(driver, stays=False)
    stroke = driver.session.trial_state(1).quality.stroke
    first = middle.strip.tiles[0]
    click(first)
    assert middle.trial.isVisible()
    assert not window.live.isVisible()
    assert first.isChecked()
    code = driver.session.trials[0].trial.stimulus.code
    assert middle.trial.heading.text().startswith(f"Trial 1, {code}: done")
    assert middle.trial.cells["mu"].accessibleName() == f"Friction coefficient {stroke.mu_dynamic:.2f}"
    steady = (stroke.curve.time >= stroke.steady[0]) & (stroke.curve.time <= stroke.steady[1])
    assert np.mean(stroke.curve.normal[steady]) == pytest.approx(stroke.normal_force, rel=0.02)
    driver.application.processEvents()
    still, newest = middle.trial.grab().toImage(), window.bridge.feed.trace.newest
    driver.until(lambda: window.bridge.feed.trace.newest > newest + 1.0, "further readings")
    assert middle.trial.grab().toImage() == still
    click(middle.strip.tiles[2])
    assert middle.trial.verdict.text() == "Its stroke is still to come."
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert window.live.isVisible()
    QTest.keyClick(window, Qt.Key.Key_I)
    assert middle.inspected == 1
    QTest.keyClick(window, Qt.Key.Key_Space)  # the course goes on behind it
    driver.until(lambda: middle.inspected is None, "the next onset")
    assert not middle.trial.isVisible()
    driver.abort()
    click(first)
    assert middle.trial.isVisible()  # a session that is over can be looked through


def test_the_mirror_shows_the_subjects_page_without_the_answer_that_is_given(driver):
    window, mirror = driver.window, driver.window.course.mirror
    mirror.open.set_room(room=True)
    driver.begin("P37")
    assert mirror.open
    driver.go_on("scoring")
    assert mirror.picture.isVisible()
    assert mirror.picture.page._question.text() == window.subject._question.text()
    before = mirror.picture.grab().toImage()
    QTest.keyClick(window.subject.line, Qt.Key.Key_Right)
    QTest.keyClick(window.subject.line, Qt.Key.Key_PageUp)
    driver.application.processEvents()
    assert window.subject.line.answered
    assert not mirror.picture.page.line.answered
    assert mirror.picture.grab().toImage() == before
    click(mirror.tab)
    assert not mirror.picture.isVisible()
    QTest.keyClick(window, Qt.Key.Key_V)
    assert mirror.picture.isVisible()
