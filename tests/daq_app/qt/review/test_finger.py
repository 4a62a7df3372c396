"""The finger in Review: viewport, fields, probe, history, films and a second finger beside it."""

import re
import subprocess
import sys
from dataclasses import replace

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import QLocale, QPoint, QPointF, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QProgressDialog
from qt_events import wheel

from daq_app.analyst import state as m
from daq_app.analyst.frame import FIELD_CHOICES, FIELD_ERRORS
from daq_app.analyst.state import rows, selected_row
from daq_app.qt.plots import ALL_TRIALS, FIXED_RANGE, OWN, FieldBar
from tests.daq_app.qt.review.examples import drag, film, frame
from tests.sessions.report_example import example


def test_history_is_stepped_by_keys_and_says_what_the_finger_does(window):
    key = selected_row(window.state).key
    window.model.history.click()
    assert window._work.requests[-1] == m.ShowHistory(key)
    window.take(m.FingerHistory(key, film()))
    player, canvas = window.model.player, window.model.finger
    assert "Step 4 of 4" in canvas.accessibleName()
    assert "kPa at small strain; mesh, model: no estimate" in canvas.accessibleName()
    for _ in range(3):
        QTest.keyClick(player, Qt.Key.Key_Left)
    assert "pressing down" in canvas.accessibleName()
    QTest.keyClick(player, Qt.Key.Key_Space)
    assert player.playing
    QTest.keyClick(player, Qt.Key.Key_Space)
    assert not player.playing
    window.model.near.click()
    assert not canvas.grab().isNull()


def small_finger(application, window):
    """Return the canvas with the triangle of `film`, its settled state, and where it paints a place [mm]."""
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    application.processEvents()
    canvas = window.model.finger
    canvas.sight.look_at(None)
    canvas.sight.set_line(None)

    def pixel(x, y):
        return QPointF(*canvas.view().to_screen(np.array([[x, y]]))[0]).toPoint()

    return canvas, pixel


def test_the_wheel_zooms_the_finger_about_the_pointer_and_home_or_a_double_click_shows_all(application, window):
    canvas, pixel = small_finger(application, window)
    whole, at = canvas.view(), pixel(0.5, 0.25)
    wheel(application, canvas.viewport(), at, 3)
    assert canvas.view().per_mm == pytest.approx(1.02**45 * whole.per_mm)  # as pyqtgraph documents its wheel
    assert canvas.view().from_screen(at.x(), at.y()) == pytest.approx(whole.from_screen(at.x(), at.y()))
    QTest.keyClick(canvas, Qt.Key.Key_Home)
    assert canvas.view() == whole
    QTest.keyClick(canvas, Qt.Key.Key_Plus)
    assert canvas.view().per_mm == pytest.approx(1.25 * whole.per_mm)
    QTest.keyClick(canvas, Qt.Key.Key_Minus)
    assert canvas.view().per_mm == pytest.approx(whole.per_mm)
    QTest.keyClick(canvas, Qt.Key.Key_Right)
    assert canvas.view().x > whole.x
    QTest.mouseDClick(canvas.viewport(), Qt.MouseButton.LeftButton)
    assert canvas.view() == whole


def test_a_drag_moves_the_finger_and_the_next_step_of_its_history_leaves_it_there(application, window):
    canvas, _ = small_finger(application, window)
    before = canvas.view()
    drag(application, canvas.viewport(), QPoint(60, 80), QPoint(90, 60))
    after = canvas.view()
    assert (before.x - after.x) * before.per_mm == pytest.approx(30.0)
    assert (before.y - after.y) * before.per_mm == pytest.approx(20.0)
    QTest.keyClick(window.model.player, Qt.Key.Key_Left)
    assert canvas.view() == after
    assert canvas.sight.line is None


def test_a_line_is_drawn_moved_and_taken_away_by_keys(application, window):
    canvas, _ = small_finger(application, window)
    view, press = canvas.view(), lambda key, modifier: QTest.keyClick(canvas, key, modifier)
    for _ in range(5):
        press(Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    press(Qt.Key.Key_Up, Qt.KeyboardModifier.ControlModifier)
    assert canvas.view() == view  # the picture stays where it is
    (x, y), (to_x, to_y) = canvas.sight.line
    assert (to_x - x) * view.per_mm == pytest.approx(5 * 0.02 * canvas.width())
    assert (y - to_y) * view.per_mm == pytest.approx(0.02 * canvas.width())
    QTest.keyClick(canvas, Qt.Key.Key_Delete)
    assert canvas.sight.line is None


def test_the_probe_says_the_field_its_unit_the_place_and_the_tissue_under_the_pointer(application, window):
    canvas, pixel = small_finger(application, window)
    at = pixel(0.25, 0.25)
    QTest.mouseMove(canvas.viewport(), at)
    application.processEvents()
    words = window.model.probe.accessibleName()
    assert words.startswith("SED 3 kPa · x 0.2")
    assert words.endswith("dermis")
    QTest.keyClick(window.model.player, Qt.Key.Key_Left)  # another state under the pointer at rest
    assert window.model.probe.accessibleName().startswith("SED 2 kPa · x 0.2")
    QTest.mouseMove(canvas.viewport(), pixel(0.9, 0.9))
    application.processEvents()
    assert window.model.probe.accessibleName().endswith("no tissue")


def test_a_line_that_is_drawn_with_shift_plots_the_field_along_it(application, window):
    canvas, pixel = small_finger(application, window)
    drag(application, canvas.viewport(), pixel(0.1, 0.3), pixel(0.6, 0.3), Qt.KeyboardModifier.ShiftModifier)
    ((place, values),) = window.model.plot.values
    assert place[-1] == pytest.approx(0.5, abs=2.0 / canvas.view().per_mm)
    np.testing.assert_allclose(values, 3.0)
    assert window.model.plot.plot.accessibleName() == "SED [kPa]: from A to B [mm]"


def test_colours_that_are_fixed_stay_through_the_history_and_another_field_frees_them(application, window):
    canvas, _ = small_finger(application, window)
    fields = window.model.fields
    fields.ranges.setCurrentIndex(FIXED_RANGE)
    fields.low.setValue(1.0)
    fields.high.setValue(2.5)
    for _ in range(2):
        assert canvas.look.range == (1.0, 2.5)
        QTest.keyClick(window.model.player, Qt.Key.Key_Left)
    canvas._bar.region.setRegion((63, 207))  # as a handle of the colour bar is dragged, a quarter of the way to its end
    canvas._bar.region.sigRegionChangeFinished.emit(canvas._bar.region)
    assert fields.mode == FIXED_RANGE
    assert canvas.look.range == pytest.approx((1.0, fields.high.value()), abs=0.015)
    assert fields.high.value() > 2.5
    fields.high.setValue(2.5)
    fields.low.setValue(2.5)  # no range: the automatic one is shown
    assert canvas.look.range != (2.5, 2.5)
    fields.field_choice.setCurrentIndex(len(FIELD_CHOICES) - 1)
    assert fields.mode == ALL_TRIALS
    assert canvas.look.field.unit == "mm"
    assert not canvas.grab().isNull()
    fields.field_choice.setCurrentIndex(0)


@pytest.mark.parametrize("locale", ["en_US", "de_DE", "ar_EG"])
@pytest.mark.parametrize("typed", ["2.5", "2,5"])
@pytest.mark.usefixtures("application")
def test_an_end_of_the_colours_is_typed_with_a_point_or_a_comma_in_every_country(locale, typed):
    before = QLocale()
    QLocale.setDefault(QLocale(locale))
    try:
        fields = FieldBar()
        fields.ranges.setCurrentIndex(FIXED_RANGE)
        fields.high.lineEdit().selectAll()
        QTest.keyClicks(fields.high, typed)
        QTest.keyClick(fields.high, Qt.Key.Key_Return)
        assert (fields.high.value(), fields.high.text()) == (2.5, "2.500 kPa")
    finally:
        QLocale.setDefault(before)


def test_a_failed_solve_says_where_when_and_why_and_its_last_good_state_stays(window):
    key = selected_row(window.state).key
    window.take(m.FingerHistory(key, film(lost=(0.5, 0.5)), "The drag wedges it."))
    words = window.model.failure_label.accessibleName()
    assert "is step 4: at 0.300 s" in words
    assert words.endswith("The drag wedges it.")
    assert window.model.finger.look.lost == (0.5, 0.5)
    window.model.player.step(-1)
    assert window.model.finger.look.lost is None


def test_how_far_a_failed_solve_came_is_asked_for_without_being_told(window):
    report = example()
    first = replace(report.predictions[0], sed=None, reasons={"sed": "It wedges."})
    window.take(m.ReportReady("predicted", replace(report, predictions=(first, *report.predictions[1:]))))
    at = next(i for i, row in enumerate(rows(window.state)) if row.prediction is first)
    window.ask(m.Choose(at))
    assert m.ShowHistory(rows(window.state)[at].key) in window._work.requests
    assert "It wedges." in window.model.finger.accessibleName()


def test_pictures_are_drawn_only_when_they_are_looked_at_and_saved_in_three_formats(window, monkeypatch):
    assert not any(isinstance(request, m.Draw) for request in window._work.requests)
    window.model.tabs.setCurrentIndex(1)
    assert [request.name for request in window._work.requests if isinstance(request, m.Draw)] == ["course"]
    window.take(m.SessionPicture("course", "forces", window.grab().toImage() and b"\x89PNG"))
    monkeypatch.setattr("daq_app.qt.pictures.QFileDialog.getSaveFileName", lambda *_: ("out/picture", ""))
    for button in window.model.picture.save.buttons:
        button.click()
    requests = [request for request in window._work.requests if isinstance(request, m.Write)]
    assert [(write.document, write.path) for write in requests] == [
        ("picture course", f"out/picture.{ending}") for ending in ("svg", "png", "csv")
    ]


def test_a_field_other_than_the_sed_is_saved_as_it_is_shown_and_marked_as_simulated(window, monkeypatch, tmp_path):
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    window.model.fields.field_choice.setCurrentIndex(len(FIELD_CHOICES) - 1)
    field, canvas = FIELD_CHOICES[-1], window.model.finger
    monkeypatch.setattr("daq_app.qt.pictures.QFileDialog.getSaveFileName", lambda *_: (str(tmp_path / "u"), ""))
    for button in window.model.save.buttons:
        button.click()
        assert window._progress_label.accessibleName().startswith("Saved: ")
    assert not any(isinstance(request, m.Write) for request in window._work.requests)
    with Image.open(tmp_path / "u.png") as image:
        assert image.size == (2 * canvas.width(), 2 * canvas.size_with(window.model._heading()).height())
        assert image.height > 2 * canvas.height() + 2 * canvas.fontMetrics().height()
    assert "SIMULATED" in (tmp_path / "u.svg").read_text()
    head, errors, words, names, *numbers = (tmp_path / "u.csv").read_text().splitlines()
    assert (head[:11], names) == ("# SIMULATED", f"x [mm],y [mm],{field.axis}")
    assert errors == f"# {FIELD_ERRORS}"
    assert "at small strain; mesh, model: no estimate" in words
    state = canvas.frame
    table = np.array([line.split(",") for line in numbers], float)
    np.testing.assert_allclose(table, np.column_stack([state.nodes, field.values_of(state)]), rtol=1e-8)
    monkeypatch.setattr(
        "daq_app.qt.pictures.QFileDialog.getSaveFileName", lambda *_: (str(tmp_path / "none" / "u"), "")
    )
    window.model.save.buttons[0].click()
    assert window._progress_label.accessibleName().endswith("choose another folder.")
    window.model.fields.field_choice.setCurrentIndex(0)


def test_a_history_is_saved_as_a_film_of_all_its_states_with_one_range_of_colours(application, window, tmp_path):
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    for _ in range(5):  # the columns have found their widths
        application.processEvents()
    ranges, show = set(), window.model._show_step
    window.model._show_step = lambda at: (show(at), ranges.add(window.model.finger.look.range))
    window.model.write_film(tmp_path / "film.gif")
    assert "Saved" in window._progress_label.accessibleName()
    window.model._show_step = show
    with Image.open(tmp_path / "film.gif") as image:
        assert (image.n_frames, image.info["duration"]) == (4, 100)
        assert image.size == window.model.finger.size_with(window.model._heading()).toTuple()
    assert len(ranges) == 1
    assert "Step 4 of 4" in window.model.finger.accessibleName()


def test_a_film_as_mp4_has_every_state_for_a_tenth_of_a_second(window, tmp_path):
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    window.model.write_film(tmp_path / "film.mp4")
    assert "Saved" in window._progress_label.accessibleName()
    width, height = (length // 2 * 2 for length in window.model.finger.size_with(window.model._heading()).toTuple())
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(tmp_path / "film.mp4")]
    command += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    process = subprocess.run(command, capture_output=True, check=True)
    assert re.search(rf"Video: h264.*{width}x{height}.* 10 fps", process.stderr.decode())
    pictures = np.frombuffer(process.stdout, np.uint8).reshape(-1, height, width, 3)
    assert len(pictures) == 4
    assert np.std(pictures[-1]) > 10.0  # there is something to see


def test_a_film_as_mp4_without_its_encoder_is_one_sentence(window, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    window.model.write_film(tmp_path / "film.mp4")
    assert "daq-app[film]" in window._progress_label.accessibleName()
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_is_cancelled_leaves_no_file(window, tmp_path):
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    QTimer.singleShot(0, lambda: window.findChildren(QProgressDialog)[-1].cancel())
    window.model.write_film(tmp_path / "film.gif")
    assert "The film was cancelled" in window._progress_label.accessibleName()
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_fails_unexpectedly_leaves_the_state_and_the_colours_that_were_shown(window, tmp_path, monkeypatch):
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    window.model.fields.ranges.setCurrentIndex(OWN)
    before = window.model.finger.look.range

    def run_out(_canvas, _head, show, *_):
        show(0)
        raise MemoryError

    monkeypatch.setattr("daq_app.qt.model_column.write_film", run_out)
    with pytest.raises(MemoryError):
        window.model.write_film(tmp_path / "film.gif")
    assert "Step 4 of 4" in window.model.finger.accessibleName()
    assert window.model.finger.look.range == before
    window.model.fields.ranges.setCurrentIndex(ALL_TRIALS)


def two_fingers(application, window, factor=1.5):
    """Show the settled finger of the chosen trial beside one of another session with `factor` times its SED."""
    row = selected_row(window.state)
    window.take(m.TrialAnswer(row.prediction, frame(0.002)))
    other = frame(0.002 * factor)
    window.take(m.OtherSession(replace(example(), session="later"), {row.key: other}))
    window.model.tabs.setCurrentIndex(0)
    application.processEvents()
    return window.model.finger, window.model.compared_finger


def test_the_compared_session_s_finger_stands_beside_and_both_are_moved_as_one(application, window):
    first, second = two_fingers(application, window)
    assert first.isVisible()
    assert second.isVisible()
    assert abs(first.width() - second.width()) <= 1
    assert second.accessibleName().startswith("B  later")
    wheel(application, second.viewport(), QPoint(60, 90), 2)
    views = [(canvas.view().x, canvas.view().y, canvas.view().per_mm) for canvas in (first, second)]
    assert views[0] == pytest.approx(views[1], rel=0.01)  # one may be a pixel wider
    assert first.look.range == second.look.range
    drag(application, first.viewport(), QPoint(60, 90), QPoint(90, 90), Qt.KeyboardModifier.ShiftModifier)
    assert second.sight.line == first.sight.line is not None
    window.model.together.click()
    assert not second.isVisible()
    first.sight.set_line(None)
    first.sight.look_at(None)


def test_the_pointer_over_one_finger_reads_both(application, window):
    first, _ = two_fingers(application, window)
    inside = QPointF(*first.view().to_screen(np.array([[0.2, 0.2]]))[0]).toPoint()
    QTest.mouseMove(first.viewport(), inside)
    application.processEvents()
    readings = window.model.probe.accessibleName().split("  |  ")
    assert [words.split(" · ")[0] for words in readings] == ["SED 2 kPa", "SED 3 kPa"]


def test_the_plot_under_two_fingers_has_a_curve_of_each(application, window):
    two_fingers(application, window)
    plot = window.model.plot
    plot.source.setCurrentIndex(0)
    (_, own), (_, second) = plot.values
    np.testing.assert_allclose(second, 1.5 * own)
    assert plot._read(1.0) == "1.000 mm · A 2 kPa   1.000 mm · B 3 kPa"


def test_a_stimulus_that_the_compared_session_lacks_has_a_sentence_in_place_of_a_finger(application, window):
    row = selected_row(window.state)
    window.take(m.TrialAnswer(row.prediction, frame(0.002)))
    stimulus = row.prediction.experiment, row.prediction.index
    remaining = tuple(p for p in example().predictions if (p.experiment, p.index) != stimulus)
    window.take(m.OtherSession(replace(example(), session="later", predictions=remaining)))
    window.model.tabs.setCurrentIndex(0)
    application.processEvents()
    assert window.model.compared_finger.accessibleName() == "B  later has no answer to this stimulus."
