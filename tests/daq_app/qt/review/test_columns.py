"""Review, driven as a person does, on a recorded session that is analysed by the real work."""

import re
from dataclasses import replace

import numpy as np
import pyqtgraph
import pytest
from PySide6.QtCore import QItemSelection, QItemSelectionModel, QPoint, QPointF, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest

from daq_app.analyst import state as m
from daq_app.analyst.finger_words import finger_text
from daq_app.analyst.session_words import condition, lineage, numbers, points
from daq_app.analyst.state import rows, selected_row
from daq_app.analyst.stroke import EDGES
from daq_app.qt import preferences, start
from daq_app.qt.analyst_window import AnalystWindow
from daq_app.qt.stroke_column import AUTHOR, DecisionsBar
from daq_app.qt.tokens import LIGHT
from sessions.report.contents import Fact
from tests.daq_app.qt.review.examples import SESSION, Nobody, film, raw, until
from tests.daq_app.qt.written_text import controls, laid_over, unreached_controls
from tests.sessions.report_example import example


def texts(table):
    """Return the lines of a table as they are sorted now."""
    model = table.model()
    columns = range(model.columnCount())
    return [tuple(str(model.index(row, column).data()) for column in columns) for row in range(model.rowCount())]


def test_a_point_of_prediction_against_score_chooses_its_trial_in_every_column(window):
    point = points(window.state)[-1]
    spot = next(s for s in window.trials.points.points() if s.data() == point.row)
    window.trials._point_clicked(None, [spot])
    assert window.trials.list.currentRow() == point.row
    assert window.stroke.stroke.accessibleName().endswith(f"stroke {selected_row(window.state).stroke.number}")
    assert m.Choose(point.row) in window._work.requests


def test_a_session_without_strokes_says_so_and_where_its_answers_are(window):
    window.take(m.ReportReady("analysed", replace(example(), strokes=(), predictions=())))
    assert window.trials.none.isVisible()
    assert window.trials.none.text() == "This session has no stroke. Its answers are kept: Export\u2026 writes them."
    assert not window.trials.list.isVisible()
    window.take(m.ReportReady("analysed", example()))
    assert window.trials.list.isVisible()


def test_another_quantity_than_the_sed_is_held_against_the_scores_and_stands_among_the_numbers(window):
    report = example()
    pressures = {prediction.stroke: -0.001 * at for at, prediction in enumerate(report.predictions, 1)}  # [MPa]
    predictions = (replace(p, responses={"pressure": (pressures[p.stroke], 2e-7)}) for p in report.predictions)
    window.take(m.ReportReady("predicted", replace(report, predictions=tuple(predictions))))
    responses = window.trials.responses
    responses.setCurrentText("pressure [kPa]")
    responses.activated.emit(responses.currentIndex())
    table = rows(window.state)
    values = [point.response for point in points(window.state)]
    expected = [1e3 * pressures[table[point.row].stroke.number] for point in points(window.state)]
    assert values == pytest.approx(expected)
    assert sorted(spot.pos().y() for spot in window.trials.points.points()) == sorted(values)
    row = next(at for at, line in enumerate(table) if line.stroke is not None and line.stroke.number in pressures)
    window.take(m.Choose(row))
    text = f"{abs(1e3 * pressures[table[row].stroke.number]):.3f}"
    name = f"pressure {condition(report, table[row].prediction)}, averaged over the ending"
    assert dict(numbers(window.state))[name].startswith(f"−{text} kPa ± ")
    assert dict(numbers(window.state))[name].endswith(" % by the mesh; model: no estimate")
    responses.setCurrentIndex(0)
    responses.activated.emit(0)
    assert name not in dict(numbers(window.state))


def test_the_table_of_all_strokes_chooses_a_trial_and_the_scene_tells_what_the_model_was_given(window):
    table = window.stroke.friction
    assert len(texts(table)) == len(window.state.report.strokes)
    table.go_to(3)
    assert window.state.row == 3
    prediction = selected_row(window.state).prediction
    cells = {name: value for name, value, _ in texts(window.model.scene)}
    assert cells["µ of this trial"] == f"{prediction.mu:.4f}"
    assert cells["indentation"] == f"{prediction.indentation:.3g} mm"


def test_a_click_on_the_head_sorts_by_value_and_a_line_still_chooses_its_trial(window):
    table = window.stroke.friction
    table.sortByColumn(2, Qt.SortOrder.AscendingOrder)
    values = [float(line[2]) for line in texts(table)]
    assert values == sorted(values)
    least = min(window.state.report.strokes, key=lambda stroke: stroke.mu_dynamic)
    table.setCurrentIndex(table.model().index(0, 0))
    assert selected_row(window.state).stroke.number == least.number
    table.sortByColumn(-1, Qt.SortOrder.AscendingOrder)
    assert [line[0] for line in texts(table)] == [str(s.trial) for s in window.state.report.strokes]


def test_ctrl_c_copies_the_selected_range_as_tab_separated_values(window):
    table = window.stroke.friction
    model = table.model()
    cells, how = QItemSelection(model.index(0, 1), model.index(1, 2)), QItemSelectionModel.SelectionFlag.ClearAndSelect
    table.selectionModel().select(cells, how)
    QTest.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    first, second = texts(table)[:2]
    assert QGuiApplication.clipboard().text() == f"{first[1]}\t{first[2]}\n{second[1]}\t{second[2]}"


def test_every_sed_carries_its_depth_its_strain_and_the_errors_of_mesh_and_model(window):
    effects = (Fact("viscosity", "below 0.01 to 4 % of the SED"), Fact("warning", "99 mm"), Fact("bone", "2 %"))
    report = replace(example(), model="small strain, settled sliding, τ max mean", left_out=effects)
    window.take(m.ReportReady("predicted", report))
    [prediction] = [row.prediction for row in rows(window.state)[:1]]
    condition = f"SED at {prediction.indentation:.3g} mm, small strain"
    error = f"{1000 * prediction.sed:.3f} kPa ± 0.1 % by the mesh; model: viscosity below 0.01 to 4 % of the SED"
    assert prediction.error_estimate == pytest.approx(0.001)
    assert f"{condition} {error}" in finger_text(window.state)
    assert dict(numbers(window.state))[f"{condition}, averaged over the ending"] == error
    [link] = [link for link in lineage(window.state) if link.target == "prediction"]
    assert link.text == f"SED {1000 * prediction.sed:.3f} kPa"  # the line is short: what hovers says the rest
    assert link.detail == f"{condition} {error}, averaged over the ending"
    assert link.detail in window.lineage.accessibleName()


def test_while_the_model_is_at_work_no_trial_is_said_to_lack_its_answer(window):
    window.trials.show_state(m.AnalystState(SESSION))
    assert window.trials.none.text() == "The model has not answered yet."
    window.take(m.ReportReady("predicted", replace(example(), predictions=())))
    assert window.trials.none.text().startswith("No trial has both")


def test_a_plot_of_nothing_has_no_scale_and_a_sentence_says_so(window):
    def scales():
        plots = *window.stroke.stroke._plots, window.model.plot.plot
        return [plot.getPlotItem().getAxis(side).style["showValues"] for plot in plots for side in ("left", "bottom")]

    window.take(m.ReportReady("predicted", example()))
    assert scales()[:4] == [True] * 4
    assert window.trials.relation.isVisibleTo(window)
    window.take(m.ReportReady("predicted", replace(example(), strokes=(), predictions=())))
    assert scales() == [False] * 6
    assert not window.trials.relation.isVisibleTo(window)
    assert window.trials.none.isVisibleTo(window)


def test_the_wheel_zooms_a_stroke_and_home_or_a_double_click_shows_all_of_it_again(application, window):
    view = window.stroke.stroke
    plot = view._plots[0]
    whole = plot.getPlotItem().getViewBox().viewRange()[0]

    def view_range():
        application.processEvents()
        return plot.getPlotItem().getViewBox().viewRange()[0]

    def zoom():
        plot.getPlotItem().getViewBox().scaleBy((0.2, 0.2))
        assert view_range() != pytest.approx(whole)

    zoom()
    window.take(m.Idle())
    assert view_range() != pytest.approx(whole)  # news of something else leaves the zoom
    QTest.keyClick(window, Qt.Key.Key_Home)
    assert view_range() == pytest.approx(whole)
    zoom()
    QTest.mouseDClick(plot.viewport(), Qt.MouseButton.LeftButton)
    assert view_range() == pytest.approx(whole)


def test_stopping_is_answered_at_once_and_keeps_what_was_found(window):
    window.take(m.Step(0.5, "predicting"))
    window.stop.click()
    assert window._work.requests[-1] == m.Stop()
    window.take(m.Cancelled())
    assert "kept" in window.state.outcome
    assert window.trials.list.count() == len(rows(window.state))


def test_an_edge_is_moved_by_keys_and_recorded_with_enter(window):
    stroke = selected_row(window.state).stroke
    handle = window.stroke.stroke.handles["steady begin"]
    window.stroke.decisions.author_field.setText("E02")
    window.stroke.decisions.reason_field.setText("a ramp")
    handle.setFocus()
    QTest.keyClick(handle, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    QTest.keyClick(handle, Qt.Key.Key_Left)
    assert not any(isinstance(request, m.Move) for request in window._work.requests)
    QTest.keyClick(handle, Qt.Key.Key_Return)
    move = window._work.requests[-1]
    assert (move.stroke, move.edge, move.author, move.reason) == (stroke.number, "steady begin", "E02", "a ramp")
    assert move.time == pytest.approx(stroke.steady[0] + 0.045)


def test_an_edge_that_is_dragged_is_recorded_where_it_is_let_go_and_escape_takes_a_key_back(
    application, window, monkeypatch
):
    monkeypatch.setitem(pyqtgraph.CONFIG_OPTIONS, "mouseRateLimit", 0)  # this mouse is quicker than any hand
    stroke = selected_row(window.state).stroke
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
    assert not any(isinstance(request, m.Move) for request in window._work.requests)
    QTest.mouseRelease(mouse, Qt.MouseButton.LeftButton, pos=places[-1])
    move = window._work.requests[-1]
    pixel = box.viewPixelSize()[0]
    assert (move.edge, move.time) == ("steady begin", pytest.approx(stroke.steady[0] + 0.2, abs=2 * pixel))
    window.take(m.Problem("The disk is full."))  # it was not recorded: the edge goes back
    assert line.value() == pytest.approx(stroke.steady[0] - stroke.trace.origin)
    handle = view.handles["onset"]
    assert (before := handle.text()).endswith(" s")
    QTest.keyClick(handle, Qt.Key.Key_Left)
    assert handle.text() != before
    QTest.keyClick(handle, Qt.Key.Key_Escape)
    assert handle.text() == before


def test_the_words_of_edges_that_are_close_together_are_read_as_those_of_edges_apart(application, window):
    view, report = window.stroke.stroke, example()

    def words(begin, end):
        """Return the picture of the word of the lift, and the places of those of the steady window."""
        steady = report.strokes[0].onset + begin, report.strokes[0].lift - end
        strokes = (replace(report.strokes[0], steady=steady), *report.strokes[1:])
        window.take(m.ReportReady("predicted", replace(report, strokes=strokes)))
        for _ in range(3):
            view.grab()
            application.processEvents()
        places = [view._lines[edge][0].label.textItem.sceneBoundingRect() for edge in EDGES]
        return view._plots[0].grab(places[-1].adjusted(2, 2, -2, -2).toRect()).toImage(), places[1:3]

    apart, _ = words(0.5, 0.6)
    close, _ = words(0.5, 0.045)
    assert close == apart
    begin, end = words(0.8, 1.35)[1]
    assert not begin.adjusted(0, 4, 0, -4).intersects(end.adjusted(0, 4, 0, -4))  # without the margins of their lines


def test_ctrl_z_undoes_and_ctrl_shift_z_redoes_and_the_buttons_say_what(window):
    control, bar = Qt.KeyboardModifier.ControlModifier, window.stroke.decisions
    assert not bar.undo.isEnabled()
    QTest.keyClick(window, Qt.Key.Key_Z, control)
    assert not any(isinstance(request, m.Undo) for request in window._work.requests)
    window.take(m.ReportReady("predicted", example(), m.History("lift of trial 2", "steady of trial 3")))
    assert not any(isinstance(request, m.Undo) for request in window._work.requests)
    assert bar.undo.accessibleName() == "undo lift of trial 2, Ctrl+Z"
    assert bar.redo.accessibleName() == "redo steady of trial 3, Ctrl+Shift+Z"
    QTest.keyClick(window, Qt.Key.Key_Z, control)
    window.take(m.ReportReady("predicted", example(), m.History("onset of trial 1", "lift of trial 2")))
    assert bar.redo.accessibleName() == "redo lift of trial 2, Ctrl+Shift+Z"
    QTest.keyClick(window, Qt.Key.Key_Z, control | Qt.KeyboardModifier.ShiftModifier)
    assert [request.redo for request in window._work.requests if isinstance(request, m.Undo)] == [False, True]


def test_the_pointer_over_a_stroke_reads_time_forces_and_friction(application, window):
    view = window.stroke.stroke
    plot = view._plots[0]
    window._go_to(1)
    application.processEvents()
    view.show_all()
    application.processEvents()
    trace = selected_row(window.state).stroke.trace
    i = len(trace.time) // 2
    at = plot.getPlotItem().getViewBox().mapViewToScene(QPointF(trace.time[i], trace.normal[i]))
    QTest.mouseMove(plot.viewport(), plot.mapFromScene(at))
    application.processEvents()
    pattern = r"([\d.]+) s · N ([\d.]+) N · T ([\d.]+) N · µ ([\d.]+)"
    time_s, normal, tangential, mu = map(float, re.fullmatch(pattern, plot.readout.text()).groups())
    assert plot.readout.isVisible()
    near = list(np.round(trace.time, 3)).index(time_s)
    assert abs(near - i) <= 1
    assert (normal, tangential, mu) == pytest.approx(
        (trace.normal[near], trace.tangential[near], trace.mu[near]), rel=1e-3
    )


def test_readings_are_replayed_with_play_pause_speed_seek_and_step(window):
    stroke = selected_row(window.state).stroke
    window.take(m.Excerpt(stroke.number, raw(stroke)))
    player, view = window.stroke.player, window.stroke.stroke
    player.seek(20)
    assert len(view._raw_curves[0].getData()[0]) == 21
    QTest.keyClick(player, Qt.Key.Key_Right)
    assert len(view._raw_curves[0].getData()[0]) == 22
    player.speed.setCurrentIndex(0)
    player.speed.activated.emit(0)
    player.toggle()
    assert player.playing
    player.toggle()
    QTest.keyClick(player, Qt.Key.Key_End)
    assert len(view._raw_curves[0].getData()[0]) == 50


def test_a_second_session_is_shown_beside_the_first(window):
    window.take(m.OtherSession(example()))
    table = window.model.comparison.table
    assert len(texts(table)) == len({(p.experiment, p.index) for p in window.state.report.predictions})
    assert {line[3] for line in texts(table)} == {"+0.000"}
    assert m.Draw("compared") in window._work.requests


def test_the_comparison_follows_a_decision_that_changes_the_first_session(window):
    report = example()
    window.take(m.OtherSession(report))
    count = window._work.requests.count(m.Draw("compared"))
    predictions = tuple(replace(prediction, mu=prediction.mu + 0.1) for prediction in report.predictions)
    window.take(m.ReportReady("predicted", replace(report, predictions=predictions)))
    assert {line[3] for line in texts(window.model.comparison.table)} == {"−0.100"}
    assert window._work.requests.count(m.Draw("compared")) == count + 1


def test_who_decides_is_remembered_with_all_else_that_the_window_remembers(window):
    by = window.stroke.decisions.author_field
    by.setText("E07")
    by.editingFinished.emit()
    assert preferences.settings().value(AUTHOR) == "E07"
    assert DecisionsBar(window.ask).author_field.text() == "E07"
    preferences.settings().remove(AUTHOR)


def test_every_control_has_a_name_and_tab_reaches_it(window):
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    assert [w for w in controls(window) if not w.accessibleName().strip()] == []
    window.activateWindow()
    window.trials.list.setFocus()
    reached = set()
    for _ in range(80):
        reached.add(window.focusWidget())
        window.focusNextChild()
    QTest.keyClick(window, Qt.Key.Key_F1)
    assert window.keys.isVisible()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not window.keys.isVisible()
    assert unreached_controls(window, reached) == []


def test_the_window_fits_every_screen_and_nothing_is_laid_over_anything_else(application, window):
    for size in ((3840, 2160), (1366, 768), (911, 512), (683, 384)):
        window.resize(*size)
        application.processEvents()
        assert (window.width(), window.height()) == size
        buttons = (window.stop, window.go_on, window.report, window.export)
        parts = (window.lineage, *window._panels, window.progress, *buttons)
        assert laid_over(window, parts) == []
        window.take(m.Step(0.5, "working"))
        application.processEvents()
        assert window.progress.isVisible()
        assert laid_over(window, parts) == []
        window.take(m.Idle())


def test_at_the_size_it_asks_for_the_window_shows_three_columns(application, window):
    window.resize(window.sizeHint())
    application.processEvents()
    assert not window._pages.isVisible()
    assert all(column.isVisible() for column in window._columns.values())


def test_a_session_opened_by_its_verb_shows_three_columns_where_the_screen_has_room(application, monkeypatch):
    windows = []
    monkeypatch.setattr(start, "_show_window", lambda create, _: windows.append(create(application)) or 0)
    monkeypatch.setattr("daq_app.qt.analyst_window.Analyst", lambda _: Nobody())
    start.window([str(SESSION)])
    (window,) = windows
    room = window.screen().availableSize() - preferences.FRAME
    assert window.size() == window.sizeHint().boundedTo(room)
    window.close()


def test_a_recorded_session_is_opened_and_analysed_while_the_window_stays_alive(application):
    window = AnalystWindow(SESSION, LIGHT)
    until(application, lambda: window.state.stage != "opening" or window.state.step is None)
    assert window.state.report is not None, window.state.outcome
    assert window.state.report.session == SESSION.name
    window.close()


def test_a_column_that_needs_more_room_for_what_has_come_gets_it_at_once(application, window):
    window.stroke.player.time_label.setText("")
    window.resize(1284, 860)
    application.processEvents()
    stroke = selected_row(window.state).stroke
    window.take(m.Excerpt(stroke.number, raw(stroke)))  # the time of a reading stands in a row that was full
    areas = window._areas
    until(application, lambda: all(area.horizontalScrollBar().maximum() == 0 for area in areas))
    assert not window._narrow
