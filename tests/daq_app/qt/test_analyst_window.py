"""The analyst's window, driven as a person does, on a recorded session that is analysed by the real work."""

import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pyqtgraph
import pytest
from PIL import Image
from PySide6.QtCore import QItemSelection, QItemSelectionModel, QPoint, QPointF, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QAbstractScrollArea, QComboBox, QLineEdit, QListWidget, QSlider
from qt_events import wheel

from daq_app.analyst import messages as m
from daq_app.analyst.field_list import FIELD_CHOICES
from daq_app.analyst.frame import Contact, Film, Finger, Frame, Instant, Parts
from daq_app.analyst.lineage import lineage
from daq_app.analyst.raw import RawReadings
from daq_app.analyst.seen import finger_words
from daq_app.analyst.shown import condition, numbers, points
from daq_app.analyst.state import AnalystState, chosen, rows
from daq_app.qt.analyst_window import AnalystWindow
from daq_app.qt.field_bar import ALL_TRIALS, FIXED
from daq_app.qt.lineage_label import LineageLabel
from daq_app.qt.tokens import LIGHT
from sessions.report.contents import Fact
from tests.sessions.report_example import example

SESSION = Path(__file__).parents[2] / "data" / "sessions" / "version-1" / "sealed"
CONTROLS = (QAbstractButton, QComboBox, QLineEdit, QListWidget, QSlider)


class Nobody:
    """Work that is never done; what was asked for is kept."""

    def __init__(self):
        self.asked = []

    def poll(self):
        return ()

    def ask(self, asked):
        self.asked.append(asked)

    def close(self):
        """Do nothing."""


@pytest.fixture(scope="module")
def one_window(application):
    made = AnalystWindow(SESSION, LIGHT, Nobody())
    made.show()
    yield made
    made.close()
    application.processEvents()


@pytest.fixture
def window(one_window):
    """The window as it is when a session was just opened and predicted."""
    one_window.resize(1440, 900)
    one_window.state = AnalystState(SESSION)
    one_window.model.tabs.setCurrentIndex(0)
    one_window.take(m.Found("predicted", example()))
    one_window.take(m.Idle())
    one_window._work.asked.clear()
    return one_window


def until(application, condition):
    end = time.monotonic() + 120.0  # of a machine that hangs, not of a slow one
    while not condition():
        assert time.monotonic() < end
        application.processEvents()
        time.sleep(0.005)


def frame(sed):
    square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    contact = Contact(np.array([0.0, 1.0]), np.zeros(2), np.ones(2), np.ones(2), ("stick", "slip"))
    return Frame(square, {"sed": np.full(3, sed)}, {"skin": square}, square, contact, np.array([sed, sed]))


PARTS, ARCS = Parts(np.array([[0, 1, 2]]), np.array([[0, 0, 1, 1, 2, 2, 2, 2]]), np.array([1])), np.array([0.0, 1.0])


def film(**more):
    told = [Instant(0.1 * i, 1.0, 0.0 if i < 2 else 0.5, 0.001 * i, 1.0, 0.1, 3, i) for i in range(4)]
    return Film(PARTS, tuple(frame(0.001 * i) for i in range(4)), tuple(told), ARCS, **more)


def raw(stroke, n=50):
    time_s = np.linspace(stroke.onset - 0.1, stroke.lift + 0.1, n)
    whole = np.arange(n)
    return RawReadings(
        "here", "counts", whole + 7, whole, whole, whole, time_s, np.ones((n, 6)), time_s, time_s, "zero"
    )


def test_a_point_of_prediction_against_score_chooses_its_trial_in_every_column(window):
    point = points(window.state)[-1]
    spot = next(s for s in window.trials.points.points() if s.data() == point.row)
    window.trials._point_clicked(None, [spot])
    assert window.trials.list.currentRow() == point.row
    assert window.stroke.stroke.accessibleName().endswith(f"stroke {chosen(window.state).stroke.number}")
    assert m.Choose(point.row) in window._work.asked


def test_another_quantity_than_the_sed_is_held_against_the_scores_and_stands_among_the_numbers(window):
    report = example()
    pressures = {said.stroke: -0.001 * at for at, said in enumerate(report.predictions, 1)}  # [MPa]
    told = (replace(said, responses={"pressure": (pressures[said.stroke], 2e-7)}) for said in report.predictions)
    window.take(m.Found("predicted", replace(report, predictions=tuple(told))))
    responses = window.trials.responses
    responses.setCurrentText("pressure [kPa]")
    responses.activated.emit(responses.currentIndex())
    listed = rows(window.state)
    assert [point.response for point in points(window.state)] == pytest.approx(
        [1e3 * pressures[listed[point.row].stroke.number] for point in points(window.state)]
    )
    assert sorted(spot.pos().y() for spot in window.trials.points.points()) == sorted(
        point.response for point in points(window.state)
    )
    row = next(at for at, line in enumerate(listed) if line.stroke is not None and line.stroke.number in pressures)
    window.take(m.Choose(row))
    shown = f"{abs(1e3 * pressures[listed[row].stroke.number]):.3f}"
    name = f"pressure {condition(report, listed[row].prediction)}, averaged over the ending"
    assert dict(numbers(window.state))[name].startswith(f"−{shown} kPa ± ")
    assert dict(numbers(window.state))[name].endswith(" % by the mesh; model: no estimate")
    responses.setCurrentIndex(0)
    responses.activated.emit(0)
    assert name not in dict(numbers(window.state))


def test_the_table_of_all_strokes_chooses_a_trial_and_the_scene_tells_what_the_model_was_given(window):
    table = window.stroke.friction
    assert len(table.texts()) == len(window.state.report.strokes)
    table.go_to(3)
    assert window.state.row == 3
    said = chosen(window.state).prediction
    cells = {name: value for name, value, _ in window.model.scene.texts()}
    assert cells["µ of this trial"] == f"{said.mu:.4f}"
    assert cells["indentation"] == f"{said.indentation:.3g} mm"


def test_a_click_on_the_head_sorts_by_value_and_a_line_still_chooses_its_trial(window):
    table = window.stroke.friction
    table.sortByColumn(2, Qt.SortOrder.AscendingOrder)
    shown = [float(line[2]) for line in table.texts()]
    assert shown == sorted(shown)
    least = min(window.state.report.strokes, key=lambda stroke: stroke.mu_dynamic)
    table.setCurrentIndex(table.model().index(0, 0))
    assert chosen(window.state).stroke.number == least.number
    table.sortByColumn(-1, Qt.SortOrder.AscendingOrder)
    assert [line[0] for line in table.texts()] == [str(s.trial) for s in window.state.report.strokes]


def test_ctrl_c_copies_the_selected_range_as_tab_separated_values(window):
    table = window.stroke.friction
    model = table.model()
    table.selectionModel().select(
        QItemSelection(model.index(0, 1), model.index(1, 2)), QItemSelectionModel.SelectionFlag.ClearAndSelect
    )
    QTest.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    first, second = table.texts()[:2]
    assert QGuiApplication.clipboard().text() == f"{first[1]}\t{first[2]}\n{second[1]}\t{second[2]}"


def test_every_sed_carries_its_depth_its_strain_and_the_errors_of_mesh_and_model(window):
    effects = (Fact("viscosity", "below 0.01 to 4 % of the SED"), Fact("warning", "99 mm"), Fact("bone", "2 %"))
    report = replace(example(), model="small strain, settled sliding, τ max mean", left_out=effects)
    window.take(m.Found("predicted", report))
    [said] = [row.prediction for row in rows(window.state)[:1]]
    condition = f"SED at {said.indentation:.3g} mm, small strain"
    error = f"{1000 * said.sed:.3f} kPa ± 0.1 % by the mesh; model: viscosity below 0.01 to 4 % of the SED"
    assert said.error_estimate == pytest.approx(0.001)
    assert f"{condition} {error}" in finger_words(window.state)
    assert dict(numbers(window.state))[f"{condition}, averaged over the ending"] == error
    assert f"{condition} {error}" in [link.words for link in lineage(window.state)]


def test_the_wheel_zooms_a_stroke_and_home_or_a_double_click_shows_all_of_it_again(application, window):
    view = window.stroke.stroke
    plot = view._plots[0]
    whole = plot.getPlotItem().getViewBox().viewRange()[0]

    def shown():
        application.processEvents()
        return plot.getPlotItem().getViewBox().viewRange()[0]

    def zoom():
        plot.getPlotItem().getViewBox().scaleBy((0.2, 0.2))
        assert shown() != pytest.approx(whole)

    zoom()
    window.take(m.Idle())
    assert shown() != pytest.approx(whole)  # news of something else leaves the zoom
    QTest.keyClick(window, Qt.Key.Key_Home)
    assert shown() == pytest.approx(whole)
    zoom()
    QTest.mouseDClick(plot.viewport(), Qt.MouseButton.LeftButton)
    assert shown() == pytest.approx(whole)


def test_stopping_is_answered_at_once_and_keeps_what_was_found(window):
    window.take(m.Step(0.5, "predicting"))
    window.stop.click()
    assert window._work.asked[-1] == m.Stop()
    window.take(m.Cancelled())
    assert "kept" in window.state.told
    assert window.trials.list.count() == len(rows(window.state))


def test_an_edge_is_moved_by_keys_and_recorded_with_enter(window):
    stroke = chosen(window.state).stroke
    handle = window.stroke.stroke.handles["steady begin"]
    window.stroke.decisions.by.setText("E02")
    window.stroke.decisions.why.setText("a ramp")
    handle.setFocus()
    QTest.keyClick(handle, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    QTest.keyClick(handle, Qt.Key.Key_Left)
    assert not any(isinstance(asked, m.Move) for asked in window._work.asked)
    QTest.keyClick(handle, Qt.Key.Key_Return)
    moved = window._work.asked[-1]
    assert (moved.stroke, moved.edge, moved.by, moved.why) == (stroke.number, "steady begin", "E02", "a ramp")
    assert moved.time == pytest.approx(stroke.steady[0] + 0.045)


def test_an_edge_that_is_dragged_is_recorded_where_it_is_let_go_and_escape_takes_a_key_back(
    application, window, monkeypatch
):
    monkeypatch.setitem(pyqtgraph.CONFIG_OPTIONS, "mouseRateLimit", 0)  # this mouse is quicker than any hand
    stroke = chosen(window.state).stroke
    view = window.stroke.stroke
    for _ in range(3):  # axes take their width when they are painted
        window.grab()
        application.processEvents()
    plot, line = view._plots[1], view._lines["steady begin"][1]
    box = plot.getPlotItem().getViewBox()
    at = [plot.mapFromScene(box.mapViewToScene(QPointF(line.value() + by, box.viewRange()[1][0]))) for by in (0.0, 0.2)]
    places = [at[0] + (at[1] - at[0]) * step / 5 - QPoint(0, 20) for step in range(6)]
    mouse = plot.viewport()
    QTest.mouseMove(mouse, places[0])
    QTest.mousePress(mouse, Qt.MouseButton.LeftButton, pos=places[0])
    for place in places[1:]:
        QTest.mouseMove(mouse, place)
        application.processEvents()
    assert not any(isinstance(asked, m.Move) for asked in window._work.asked)
    QTest.mouseRelease(mouse, Qt.MouseButton.LeftButton, pos=places[-1])
    moved = window._work.asked[-1]
    pixel = box.viewPixelSize()[0]
    assert (moved.edge, moved.time) == ("steady begin", pytest.approx(stroke.steady[0] + 0.2, abs=2 * pixel))
    window.take(m.Problem("The disk is full."))  # it was not recorded: the edge goes back
    assert line.value() == pytest.approx(stroke.steady[0] - stroke.trace.origin)
    handle = view.handles["onset"]
    before = handle.text()
    QTest.keyClick(handle, Qt.Key.Key_Left)
    assert handle.text() != before
    QTest.keyClick(handle, Qt.Key.Key_Escape)
    assert handle.text() == before


def test_ctrl_z_undoes_and_ctrl_shift_z_redoes_and_the_buttons_say_what(window):
    held, bar = Qt.KeyboardModifier.ControlModifier, window.stroke.decisions
    assert not bar.undo.isEnabled()
    QTest.keyClick(window, Qt.Key.Key_Z, held)
    assert not any(isinstance(asked, m.Undo) for asked in window._work.asked)
    window.take(
        m.Found("predicted", example(), m.History(("onset of trial 1", "lift of trial 2"), ("steady of trial 3",)))
    )
    assert not any(isinstance(asked, m.Undo) for asked in window._work.asked)
    assert bar.undo.accessibleName() == "undo lift of trial 2, Ctrl+Z"
    assert bar.redo.accessibleName() == "redo steady of trial 3, Ctrl+Shift+Z"
    QTest.keyClick(window, Qt.Key.Key_Z, held)
    window.take(m.Found("predicted", example(), m.History(("onset of trial 1",), ("lift of trial 2",))))
    assert bar.redo.accessibleName() == "redo lift of trial 2, Ctrl+Shift+Z"
    QTest.keyClick(window, Qt.Key.Key_Z, held | Qt.KeyboardModifier.ShiftModifier)
    assert [asked.again for asked in window._work.asked if isinstance(asked, m.Undo)] == [False, True]


def test_history_is_stepped_by_keys_and_says_what_the_finger_does(window):
    key = chosen(window.state).key
    window.model.history.click()
    assert window._work.asked[-1] == m.ShowHistory(key)
    window.take(m.Filmed(key, film()))
    player, canvas = window.model.player, window.model.finger
    assert "Step 4 of 4" in canvas.accessibleName()
    assert "kPa; mesh, model: no estimate" in canvas.accessibleName()
    for _ in range(3):
        QTest.keyClick(player, Qt.Key.Key_Left)
    assert "pressing down" in canvas.accessibleName()
    QTest.keyClick(player, Qt.Key.Key_Space)
    assert player.playing
    QTest.keyClick(player, Qt.Key.Key_Space)
    assert not player.playing
    window.model.near.click()
    assert not canvas.grab().isNull()


def test_the_pointer_over_a_stroke_reads_time_forces_and_friction(application, window):
    view = window.stroke.stroke
    plot = view._plots[0]
    view.show_all()
    application.processEvents()
    trace = chosen(window.state).stroke.trace
    i = len(trace.time) // 2
    at = plot.getPlotItem().getViewBox().mapViewToScene(QPointF(trace.time[i], trace.normal[i]))
    QTest.mouseMove(plot.viewport(), plot.mapFromScene(at))
    application.processEvents()
    pattern = r"([\d.]+) s · N ([\d.]+) N · T ([\d.]+) N · µ ([\d.]+)"
    time_s, normal, tangential, mu = map(float, re.fullmatch(pattern, plot.words.text()).groups())
    assert plot.words.isVisible()
    near = list(np.round(trace.time, 3)).index(time_s)
    assert abs(near - i) <= 1
    assert (normal, tangential, mu) == pytest.approx(
        (trace.normal[near], trace.tangential[near], trace.mu[near]), rel=1e-3
    )


def small_finger(application, window):
    """Return the canvas with the triangle of `film`, its settled state, and where it paints a place [mm]."""
    window.take(m.Filmed(chosen(window.state).key, film()))
    application.processEvents()
    canvas = window.model.finger
    canvas.sight.look_at(None)
    canvas.sight.set_line(None)

    def pixel(x, y):
        return QPointF(*canvas.view().placed(np.array([[x, y]]))[0]).toPoint()

    return canvas, pixel


def drag(application, widget, begin, end, held=Qt.KeyboardModifier.NoModifier):
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, held, begin)
    QTest.mouseMove(widget, end)
    application.processEvents()
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, held, end)


def test_the_wheel_zooms_the_finger_about_the_pointer_and_home_or_a_double_click_shows_all(application, window):
    canvas, pixel = small_finger(application, window)
    whole, at = canvas.view(), pixel(0.5, 0.25)
    wheel(application, canvas.viewport(), at, 3)
    assert canvas.view().per_mm == pytest.approx(1.02**45 * whole.per_mm)  # as pyqtgraph documents its wheel
    assert canvas.view().place(at.x(), at.y()) == pytest.approx(whole.place(at.x(), at.y()))
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
    view, press = canvas.view(), lambda key, held: QTest.keyClick(canvas, key, held)
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
    fields.ranges.setCurrentIndex(FIXED)
    fields.low.setValue(1.0)
    fields.high.setValue(2.5)
    for _ in range(2):
        assert canvas._look.range == (1.0, 2.5)
        QTest.keyClick(window.model.player, Qt.Key.Key_Left)
    canvas._bar.region.setRegion((63, 207))  # as a handle of the colour bar is dragged, a quarter of the way to its end
    canvas._bar.region.sigRegionChangeFinished.emit(canvas._bar.region)
    assert fields.mode == FIXED
    assert canvas._look.range == pytest.approx((1.0, fields.high.value()), abs=0.015)
    assert fields.high.value() > 2.5
    fields.high.setValue(2.5)
    fields.low.setValue(2.5)  # no range: the automatic one is shown
    assert canvas._look.range != (2.5, 2.5)
    fields.which.setCurrentIndex(len(FIELD_CHOICES) - 1)
    assert fields.mode == ALL_TRIALS
    assert canvas._look.field.unit == "mm"
    assert not canvas.grab().isNull()
    fields.which.setCurrentIndex(0)


def test_a_failed_solve_says_where_when_and_why_and_its_last_good_state_stays(window):
    key = chosen(window.state).key
    window.take(m.Filmed(key, film(lost=(0.5, 0.5)), "The drag wedges it."))
    words = window.model.why.text()
    assert "is step 4: at 0.300 s" in words
    assert words.endswith("The drag wedges it.")
    assert window.model.finger._look.lost == (0.5, 0.5)
    window.model.player.step(-1)
    assert window.model.finger._look.lost is None


def test_how_far_a_failed_solve_came_is_asked_for_without_being_told(window):
    report = example()
    first = replace(report.predictions[0], sed=None, reasons={"sed": "It wedges."})
    window.take(m.Found("predicted", replace(report, predictions=(first, *report.predictions[1:]))))
    at = next(i for i, row in enumerate(rows(window.state)) if row.prediction is first)
    window.ask(m.Choose(at))
    assert m.ShowHistory(rows(window.state)[at].key) in window._work.asked
    assert "It wedges." in window.model.finger.accessibleName()


def test_readings_are_replayed_with_play_pause_speed_seek_and_step(window):
    stroke = chosen(window.state).stroke
    window.take(m.Read(stroke.number, raw(stroke)))
    player, view = window.stroke.player, window.stroke.stroke
    player.seek(20)
    assert len(view._recorded[0].getData()[0]) == 21
    QTest.keyClick(player, Qt.Key.Key_Right)
    assert len(view._recorded[0].getData()[0]) == 22
    player.speed.setCurrentIndex(0)
    player.speed.activated.emit(0)
    player.toggle()
    assert player.playing
    player.toggle()
    QTest.keyClick(player, Qt.Key.Key_End)
    assert len(view._recorded[0].getData()[0]) == 50


def test_every_link_of_the_way_back_is_followed_by_keys(application, window):
    way = LineageLabel(LIGHT)
    way.show_links(lineage(window.state))
    way.show()
    way.activateWindow()
    way.setFocus()
    application.processEvents()
    followed = []
    way.followed.connect(followed.append)
    for _ in range(6):
        QTest.keyClick(way, Qt.Key.Key_Tab)
        QTest.keyClick(way, Qt.Key.Key_Return)
    way.close()
    assert followed == ["session", "trial", "prediction", "friction", "window", "readings"]


def test_the_way_back_ends_at_the_first_raw_reading_of_the_steady_window(window):
    stroke = chosen(window.state).stroke
    window.take(m.Read(stroke.number, raw(stroke)))
    window._follow("readings")
    table = window.stroke.readings.table
    row = table.currentIndex().row()
    assert [table.model().index(at, 0).data() for at in (row - 1, row)] == ["", "steady"]
    assert table.model().index(row, 1).data() == str(row + 7)


def test_pictures_are_drawn_only_when_they_are_looked_at_and_saved_in_three_formats(window, monkeypatch):
    assert not any(isinstance(asked, m.Draw) for asked in window._work.asked)
    window.model.tabs.setCurrentIndex(1)
    assert [asked.name for asked in window._work.asked if isinstance(asked, m.Draw)] == ["course"]
    window.take(m.Drawn("course", "forces", window.grab().toImage() and b"\x89PNG"))
    monkeypatch.setattr("daq_app.qt.picture_view.QFileDialog.getSaveFileName", lambda *_: ("out/picture", ""))
    for made in window.model.picture.save.buttons:
        made.click()
    written = [asked for asked in window._work.asked if isinstance(asked, m.Write)]
    assert [(one.what, one.path) for one in written] == [
        ("picture course", f"out/picture.{ending}") for ending in ("svg", "png", "csv")
    ]


def test_a_field_other_than_the_sed_is_saved_as_it_is_shown_and_marked_as_simulated(window, monkeypatch, tmp_path):
    window.take(m.Filmed(chosen(window.state).key, film()))
    window.model.fields.which.setCurrentIndex(len(FIELD_CHOICES) - 1)
    field, canvas = FIELD_CHOICES[-1], window.model.finger
    monkeypatch.setattr("daq_app.qt.picture_view.QFileDialog.getSaveFileName", lambda *_: (str(tmp_path / "u"), ""))
    for made in window.model.save.buttons:
        made.click()
        assert window._words.accessibleName().startswith("Saved: ")
    assert not any(isinstance(asked, m.Write) for asked in window._work.asked)
    with Image.open(tmp_path / "u.png") as written:
        assert written.size == (2 * canvas.width(), 2 * canvas.height())
    assert "SIMULATED" in (tmp_path / "u.svg").read_text()
    head, names, *numbers = (tmp_path / "u.csv").read_text().splitlines()
    assert (head[:11], names) == ("# SIMULATED", f"x [mm],y [mm],{field.axis}")
    shown = canvas.frame
    table = np.array([line.split(",") for line in numbers], float)
    np.testing.assert_allclose(table, np.column_stack([shown.nodes, field.of(shown)]), rtol=1e-8)
    monkeypatch.setattr(
        "daq_app.qt.picture_view.QFileDialog.getSaveFileName", lambda *_: (str(tmp_path / "none" / "u"), "")
    )
    window.model.save.buttons[0].click()
    assert window._words.accessibleName().endswith("choose another folder.")
    window.model.fields.which.setCurrentIndex(0)


def test_a_history_is_saved_as_a_film_of_all_its_states_with_one_range_of_colours(application, window, tmp_path):
    window.take(m.Filmed(chosen(window.state).key, film()))
    for _ in range(5):  # the columns have found their widths
        application.processEvents()
    ranges, show = set(), window.model._moved
    window.model._moved = lambda at: (show(at), ranges.add(window.model.finger._look.range))
    window.model.write_film(tmp_path / "film.gif")
    until(application, lambda: "Saved" in window._words.accessibleName())
    window.model._moved = show
    with Image.open(tmp_path / "film.gif") as written:
        assert (written.n_frames, written.info["duration"]) == (4, 100)
        assert written.size == (window.model.finger.width(), window.model.finger.height())
    assert len(ranges) == 1
    assert "Step 4 of 4" in window.model.finger.accessibleName()


def test_a_film_as_mp4_has_every_state_for_a_tenth_of_a_second(application, window, tmp_path):
    window.take(m.Filmed(chosen(window.state).key, film()))
    window.model.write_film(tmp_path / "film.mp4")
    until(application, lambda: "Saved" in window._words.accessibleName())
    finger = window.model.finger
    width, height = finger.width() // 2 * 2, finger.height() // 2 * 2
    read = [
        imageio_ffmpeg.get_ffmpeg_exe(),
        "-i",
        str(tmp_path / "film.mp4"),
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-",
    ]
    done = subprocess.run(read, capture_output=True, check=True)
    assert re.search(rf"Video: h264.*{width}x{height}.* 10 fps", done.stderr.decode())
    pictures = np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3)
    assert len(pictures) == 4
    assert np.std(pictures[-1]) > 10.0  # there is something to see


def test_a_film_as_mp4_without_its_encoder_is_one_sentence(application, window, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    window.take(m.Filmed(chosen(window.state).key, film()))
    window.model.write_film(tmp_path / "film.mp4")
    until(application, lambda: "daq-app[film]" in window._words.accessibleName())
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_is_cancelled_leaves_no_file(application, window, tmp_path):
    window.take(m.Filmed(chosen(window.state).key, film()))
    writer = window.model.write_film(tmp_path / "film.gif")
    writer._dialog.cancel()
    until(application, lambda: "The film was cancelled" in window._words.accessibleName())
    assert list(tmp_path.iterdir()) == []


def test_a_second_session_is_shown_beside_the_first(window):
    window.take(m.Compared("other", example()))
    table = window.model.compared.table
    assert len(table.texts()) == len({(p.experiment, p.index) for p in window.state.report.predictions})
    assert {line[3] for line in table.texts()} == {"+0.000"}
    assert m.Draw("compared") in window._work.asked


def two_fingers(application, window, factor=1.5):
    """Show the settled finger of the chosen trial beside one of another session with `factor` times its SED."""
    row = chosen(window.state)
    window.take(m.Answered(row.prediction, Finger(PARTS, frame(0.002), ARCS)))
    other = Finger(PARTS, frame(0.002 * factor), ARCS)
    window.take(m.Compared("other", replace(example(), session="later"), {row.key: other}))
    window.model.tabs.setCurrentIndex(0)
    application.processEvents()
    return window.model.finger, window.model.other


def test_the_compared_session_s_finger_stands_beside_and_both_are_moved_as_one(application, window):
    first, second = two_fingers(application, window)
    assert first.isVisible()
    assert second.isVisible()
    assert abs(first.width() - second.width()) <= 1
    assert second.accessibleName().startswith("B  later")
    wheel(application, second.viewport(), QPoint(60, 90), 2)
    shown = [(canvas.view().x, canvas.view().y, canvas.view().per_mm) for canvas in (first, second)]
    assert shown[0] == pytest.approx(shown[1], rel=0.01)  # one may be a pixel wider
    assert first._look.range == second._look.range
    drag(application, first.viewport(), QPoint(60, 90), QPoint(90, 90), Qt.KeyboardModifier.ShiftModifier)
    assert second.sight.line == first.sight.line is not None
    window.model.both.click()
    assert not second.isVisible()
    first.sight.set_line(None)
    first.sight.look_at(None)


def test_the_pointer_over_one_finger_reads_both(application, window):
    first, _ = two_fingers(application, window)
    inside = QPointF(*first.view().placed(np.array([[0.2, 0.2]]))[0]).toPoint()
    QTest.mouseMove(first.viewport(), inside)
    application.processEvents()
    said = window.model.probe.accessibleName().split("  |  ")
    assert [words.split(" · ")[0] for words in said] == ["SED 2 kPa", "SED 3 kPa"]


def test_the_plot_under_two_fingers_has_a_curve_of_each(application, window):
    two_fingers(application, window)
    plot = window.model.plot
    plot.source.setCurrentIndex(0)
    (_, own), (_, others) = plot.values
    np.testing.assert_allclose(others, 1.5 * own)
    assert plot._read(1.0) == "1.000 mm · A 2 kPa   1.000 mm · B 3 kPa"


def test_a_stimulus_that_the_compared_session_lacks_has_a_sentence_in_place_of_a_finger(application, window):
    row = chosen(window.state)
    window.take(m.Answered(row.prediction, Finger(PARTS, frame(0.002), ARCS)))
    gone = row.prediction.experiment, row.prediction.index
    rest = tuple(p for p in example().predictions if (p.experiment, p.index) != gone)
    window.take(m.Compared("other", replace(example(), session="later", predictions=rest)))
    window.model.tabs.setCurrentIndex(0)
    application.processEvents()
    assert window.model.other.accessibleName() == "B  later has no answer to this stimulus."


def test_every_control_has_a_name_and_tab_reaches_it(window):
    window.take(m.Filmed(chosen(window.state).key, film()))
    found = [w for kind in CONTROLS for w in window.findChildren(kind)]
    controls = [w for w in found if not isinstance(w.parent(), QComboBox | QAbstractScrollArea)]
    ours = [w for w in controls if w.parent().metaObject().className() != "QTabBar"]
    assert [w for w in ours if not w.accessibleName().strip()] == []
    window.activateWindow()
    window.trials.list.setFocus()
    seen = set()
    for _ in range(80):
        focused = window.focusWidget()
        seen.add(focused)
        window.focusNextChild()
    QTest.keyClick(window, Qt.Key.Key_F1)
    assert window.keys.isVisible()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not window.keys.isVisible()
    reachable = [w for w in ours if w.isVisible() and w.isEnabled() and w.focusPolicy() & Qt.FocusPolicy.TabFocus]
    assert [w.accessibleName() for w in reachable if w not in seen] == []


def test_the_window_fits_every_screen_and_nothing_is_laid_over_anything_else(application, window):
    for size in ((3840, 2160), (1366, 768), (911, 512), (683, 384)):
        window.resize(*size)
        application.processEvents()
        assert (window.width(), window.height()) == size
        parts = [w for w in (window.way, *window._parts, window.report, window.stop, window.export) if w.isVisible()]
        boxes = [w.rect().translated(w.mapTo(window, w.rect().topLeft())) for w in parts]
        for i, box in enumerate(boxes):
            assert window.rect().contains(box)
            assert not any(box.intersects(other) for other in boxes[i + 1 :])


def test_a_recorded_session_is_opened_and_analysed_while_the_window_stays_alive(application):
    window = AnalystWindow(SESSION, LIGHT)
    until(application, lambda: window.state.stage != "opening" or window.state.step is None)
    assert window.state.report is not None, window.state.told
    assert window.state.report.session == SESSION.name
    window.close()
