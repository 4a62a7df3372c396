"""Preparing a session in the real window: cards, the bench, a session that was cut short, and a rehearsal."""

from dataclasses import replace
from pathlib import Path

import pytest
from protocol_texts import OWN
from PySide6.QtCore import QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QFileDialog, QLabel
from qt_events import wheel

from daq_app.qt.cards import CardFrame
from daq_app.recorder.messages import Connect, Disconnect
from daq_app.window.checklist import Card
from daq_app.window.new_session import UnfinishedSession
from daq_app.window.state import DevicesFound, Searching
from daq_app.window.view import Lamp

pytestmark = pytest.mark.qt


def test_without_a_transducer_no_field_reaches_beyond_the_page(driver):
    window, page = driver.window, driver.window.page
    window.bridge.send(Disconnect())
    driver.until(lambda: driver.state.bench.link == "none", "the end of the link")
    try:
        driver.application.processEvents()
        inside = page.frames["Subject"].parentWidget()
        assert inside.minimumSizeHint().width() <= inside.parentWidget().width()
        assert page.height_above.isVisible()
        edge = page.height_above.mapTo(page, page.height_above.rect().topRight()).x()
        assert edge < page.width()
    finally:
        window.bridge.send(Connect("sim:?rate=200"))
        driver.until(lambda: driver.state.bench.link == "open", "the simulated bench")


def test_a_name_as_long_as_may_be_typed_widens_no_card(driver):
    page = driver.window.page
    try:
        for line in (page.study, page.folder, page.subject):
            line.setText("x" * 300)
        driver.application.processEvents()
        inside = page.frames["Subject"].parentWidget()
        assert inside.minimumSizeHint().width() <= inside.parentWidget().width()
        assert "x" * 300 in page.frames["Study and protocol"].accessibleName()
    finally:
        for line, text in ((page.study, ""), (page.folder, "recordings"), (page.subject, "")):
            line.setText(text)


def test_what_is_below_the_top_stays_in_place_while_the_transducer_says_more(driver):
    window, words = driver.window, ("nothing lost", "no readings for 3 s", "no readings for 12 s")
    size, places = window.size(), {}
    window.bridge.blockSignals(True)
    try:
        for width in (1280, *range(1360, 1600, 40)):
            window.resize(width, 1000)
            for _ in range(3):  # until the rows at the top have found their heights
                driver.application.processEvents()
            for lamp_words in words:
                bench = replace(driver.view.bench, name="SIMULATED Net F/T SI-36-0.5", lamp_text=lamp_words)
                window.header.show_view(replace(driver.view, bench=bench, heading="subject P07 · sensotact-friction"))
                driver.application.processEvents()
                places.setdefault(width, set()).add(window.to_do.mapTo(window, window.to_do.rect().topLeft()).y())
    finally:
        window.bridge.blockSignals(False)
        window.header.show_view(driver.view)
        window.resize(size)
    assert {width: len(there) for width, there in places.items()} == dict.fromkeys(places, 1)


def test_what_the_transducer_says_at_length_is_cut_with_an_ellipsis_and_kept_for_screen_readers(driver):
    window, words = driver.window, "500 saturated, transducer saturated or converter error"
    label = window.header._device
    window.bridge.blockSignals(True)
    try:
        bench = replace(driver.view.bench, name="SIMULATED Net F/T SI-36-0.5", lamp_text=words)
        for width in (1366, 1440):
            window.resize(width, 900)
            for _ in range(3):  # until the rows at the top have found their places
                window.header.show_view(replace(driver.view, bench=bench, heading="subject P07 · sensotact-friction"))
                driver.application.processEvents()
            line = label.text().partition(": ")[2]
            assert line.startswith("500\u00a0saturated,")
            assert line.endswith("…")
            assert label.fontMetrics().horizontalAdvance(line) <= label.width()
            assert words in label.accessibleName()
    finally:
        window.bridge.blockSignals(False)
        window.header.show_view(driver.view)
        window.resize(1440, 900)


def test_no_card_moves_while_a_code_is_typed_and_who_strokes_is_chosen(driver):
    page, places = driver.window.page, set()

    def look():
        for _ in range(3):  # until the words have their lines
            driver.application.processEvents()
        places.add(tuple(frame.y() for frame in page.frames.values()))

    page.simulated.setChecked(True)  # whose words are the longest
    look()
    places.clear()
    for code in ("", "P", "Ada Lovelace", "P07"):
        page.subject.setText(code)
        look()
    page.people_score.setChecked(True)
    look()
    assert len(places) == 1


def test_the_wheel_over_a_list_scrolls_the_page_and_chooses_nothing(driver):
    page = driver.window.page
    for box in (page.protocol, page.stroking, page.studies):
        before = box.currentText()
        assert not wheel(driver.application, box, box.rect().center(), -2)
        assert box.currentText() == before


def test_the_card_of_the_transducer_says_its_zero_noise_and_life_and_enter_connects_it(driver):
    window, row = driver.window, driver.window.page.transducer
    window.act("tare")
    driver.until(lambda: driver.state.bench.zero is not None and not driver.state.bench.taring, "a zero")
    zero = driver.state.bench.zero
    driver.until(
        lambda: row.summary.text().startswith("SIMULATED Net F/T SI-36-0.5: nothing lost.\n"), "readings in time"
    )
    lines = row.summary.text().replace("\xa0", " ").split("\n")
    assert lines[1] == f"Zero: over {zero.duration:.1f} s, n = {zero.readings}."
    noise, unit = lines[2].removeprefix("Noise: ").split(",")[0].split()
    assert (float(noise), unit) == (float(f"{1000 * max(zero.noise[:3]):.2g}"), "mN")
    assert lines[3].startswith("Life: ")
    row.connect_button.click()
    driver.until(lambda: driver.state.bench.link == "none", "the end of the link")
    assert row.summary.text() == "no transducer: not connected."
    assert window.to_do.primary.text().startswith("Connect")
    QTest.keyClick(window.page.subject, Qt.Key.Key_Return)
    driver.until(lambda: driver.state.bench.link == "open", "the simulated bench")
    assert row.connect_button.accessibleName() == "Disconnect the transducer"


def test_the_strip_at_the_top_says_lamp_subject_device_and_language_and_has_no_button(driver):
    header = driver.window.header
    names = {label.accessibleName() or label.text() for label in header.findChildren(QLabel)}
    assert {"new session", "not recording", "language that the subject reads English (en)"} <= names
    assert any(name.startswith("SIMULATED Net F/T") for name in names)
    assert header.findChildren(QAbstractButton) == []


def test_nothing_at_the_top_moves_while_the_clock_counts(driver):
    header, places = driver.window.header, set()
    driver.window.bridge.blockSignals(True)
    try:
        for second in range(10):
            header.show_view(replace(driver.view, lamp=Lamp("on", f"recording 00:00:0{second}", "")))
            driver.application.processEvents()
            places.add(header._lamp.x())
    finally:
        driver.window.bridge.blockSignals(False)
    header.show_view(driver.view)
    assert len(places) == 1


def test_start_lights_when_every_card_is_ready_and_a_card_that_is_mended_says_so_at_once(driver):
    window, page = driver.window, driver.window.page
    assert not window.to_do.primary.isEnabled()
    assert page.frames["Subject"].accessibleName().startswith("Subject: not ready. Give a code")
    QTest.keyClicks(page.subject, "P20")
    assert window.to_do.primary.isEnabled()
    assert page.frames["Subject"].accessibleName() == "Subject: ready."
    page.seed.setText("many")
    assert not window.to_do.primary.isEnabled()
    assert "whole number" in page.frames["Study and protocol"].message.text()
    page.seed.clear()
    assert window.to_do.primary.isEnabled()


def test_start_brings_the_card_that_its_headline_names_into_sight(driver):
    window, page = driver.window, driver.window.page
    size = window.size()
    window.resize(1366, 640)
    page.subject.setText("P07")
    page.folder.setText(__file__)
    driver.application.processEvents()
    message = page.frames["Disk"].message
    try:
        assert message.visibleRegion().isEmpty()
        window.act("primary")
        driver.application.processEvents()
        assert message.visibleRegion().boundingRect().height() == message.height()
    finally:
        page.folder.setText("recordings")
        page.subject.clear()
        window.resize(size)


def test_words_that_start_makes_bold_are_read_whole(driver):
    frame, grown = CardFrame("Subject"), []
    message = frame.message
    frame.show()
    for width in range(200, 400, 20):
        frame.resize(width, 300)
        frame.show_card(Card("Subject", ready=False, text=f"Give a code of letters and digits, never a name: {width}"))
        heights = []
        for _ in range(2):
            driver.application.processEvents()
            room = QRect(0, 0, message.width(), 1000)
            words = message.fontMetrics().boundingRect(room, Qt.TextFlag.TextWordWrap, message.text())
            assert message.height() >= words.height(), width
            heights.append(words.height())
            frame.insist()
        grown.append(heights[1] > heights[0])
    frame.hide()
    assert any(grown)


def test_a_search_that_finds_nothing_says_so_and_what_to_do(driver):
    bridge, bench = driver.window.bridge, driver.window.bench
    bridge.send(Searching())
    assert "Looking" in bench._search_label.text()
    bridge.send(DevicesFound(()))
    assert bench._search_label.text().startswith("No transducer answered. Check power and cable")
    assert bench._search_label.isVisibleTo(bench)


def test_a_session_that_was_cut_short_is_offered_above_every_card(driver, tmp_path):
    page = driver.window.page
    page.cut_short.show_sessions((UnfinishedSession(tmp_path, "P03: 2 of 10 trials done"),))
    assert (
        page.cut_short._description.text().replace("\xa0", " ") == "P03: 2 of 10 trials done"
    )  # on as many lines as they need
    assert not page.cut_short._sessions.isVisible()  # of one session there is no choice
    driver.application.processEvents()
    offer = page.cut_short.go_on.mapTo(page, page.cut_short.go_on.rect().bottomLeft()).y()
    assert all(frame.mapTo(page, frame.rect().topLeft()).y() > offer for frame in page.frames.values())
    page.cut_short.show_sessions(())


def test_sessions_that_were_cut_short_are_looked_for_in_the_folder_that_is_chosen(driver, tmp_path, monkeypatch):
    folder, page = tmp_path / "elsewhere", driver.window.page
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    cut_short = (UnfinishedSession(folder / "P03", "P03: 2 of 10 trials done"),)
    monkeypatch.setattr("daq_app.qt.cards.unfinished_sessions", lambda place: cut_short if place == folder else ())
    page.folder.setText("~/elsewhere")
    page.folder.editingFinished.emit()
    driver.until(page.cut_short.isVisible, "the offer to go on")
    page.cut_short.show_sessions(())


def test_a_session_that_a_recorder_without_a_window_still_holds_is_offered_as_soon_as_it_lets_go(driver, monkeypatch):
    cut_short, looks = driver.window.page.cut_short, []
    cut_short._again.setInterval(10)

    def look(place):
        looks.append(place)
        return (UnfinishedSession(place / "P03", "P03", in_use=len(looks) < 3),)

    monkeypatch.setattr("daq_app.qt.cards.unfinished_sessions", look)
    driver.window.page.look_for_unfinished_sessions()
    cut_short.show_sessions((UnfinishedSession(looks[0] / "P03", "P03", in_use=True),))
    assert not cut_short.isVisible()
    driver.until(cut_short.isVisible, "the offer to go on")
    driver.until(lambda: not cut_short._again.isActive(), "the last look")
    assert len(looks) == 3
    cut_short.show_sessions(())


def test_a_protocol_of_ones_own_is_rehearsed_from_its_first_trial_to_its_last(driver, tmp_path):
    page = driver.window.page
    (tmp_path / "own.toml").write_text(OWN)
    page.add_protocol(str(tmp_path / "own.toml"))
    page.simulated.setChecked(True)
    QTest.keyClicks(page.subject, "P21")
    QTest.keyClick(page.subject, Qt.Key.Key_Return)
    driver.sealed()
    assert [trial.outcome for trial in driver.session.trials] == ["done", "done"]
    assert "SIMULATED" in driver.view.simulated
    assert Path(driver.session.folder).name.startswith("P21_own_")


def test_a_protocol_is_piloted_by_key_without_a_subject_and_apart_from_every_session(driver, tmp_path):
    window, page = driver.window, driver.window.page
    (tmp_path / "own.toml").write_text(OWN)
    page.add_protocol(str(tmp_path / "own.toml"))
    assert not window.to_do.primary.isEnabled()  # nobody is named
    window.setFocus()
    QTest.keyClick(window, Qt.Key.Key_F5)
    driver.sealed()
    folder = Path(driver.session.folder)
    assert folder.parent == Path(page.folder.text()) / "pilots"
    assert folder.name.startswith("PILOT_own_")
    assert driver.session.plan.forces
    assert [trial.outcome for trial in driver.session.trials] == ["done", "done"]
    assert all(trial.answer.startswith("score") for trial in driver.session.trials)
    assert "SIMULATED" in driver.view.simulated


def test_where_no_file_is_chosen_after_all_protocol_and_language_stay_as_they_were(driver, monkeypatch):
    page = driver.window.page
    page.protocol.setCurrentText("magnitude-estimation")
    page.protocol.activated.emit(page.protocol.currentIndex())
    language = page.screen_fields.language
    language.setCurrentIndex(language.findData("de"))
    meanwhile = []

    def nothing(*_):
        meanwhile.append(page.protocol.currentText())
        return "", ""

    monkeypatch.setattr(QFileDialog, "getOpenFileName", nothing)
    last = page.protocol.count() - 1
    page.protocol.setCurrentIndex(last)  # as a click on the row does
    assert language.currentData() is None  # a file yet to be chosen has no languages
    page.protocol.activated.emit(last)
    assert [*meanwhile, page.protocol.currentText()] == ["magnitude-estimation"] * 2
    assert language.currentData() == "de"
    language.setCurrentIndex(language.findData("en"))


@pytest.mark.parametrize("button", ["_pilot", "_preview"])
def test_a_pilot_and_a_preview_of_a_protocol_that_cannot_be_read_say_why(driver, tmp_path, button):
    window, page = driver.window, driver.window.page
    (tmp_path / "wrong.toml").write_text("name = ")
    page.add_protocol(str(tmp_path / "wrong.toml"))
    QTest.mouseClick(getattr(page, button), Qt.MouseButton.LeftButton)
    assert driver.session is None
    assert "wrong.toml" in window.notice._label.text()
