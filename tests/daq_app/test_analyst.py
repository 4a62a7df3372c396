"""The analyst's window knows a session folder without Qt."""

import time
from dataclasses import replace
from pathlib import Path

import pytest

from daq_app.analyst import (
    AnalystState,
    Cancelled,
    Choose,
    Found,
    Problem,
    Step,
    Write,
    Written,
    chosen,
    finger_pictures,
    fold,
    lineage,
    numbers,
    pictures,
    points,
    progress_words,
    rows,
)
from daq_app.analyst_process import Analyst
from sessions.exports.figures.style import Panel, Plate
from tests.sessions.report_example import example

FINGER = tuple(Panel(f"finger-{i}", "", "<svg/>", (), ()) for i in range(40))


@pytest.fixture(scope="module")
def state():
    told = example()
    plates = (Plate("finger", "", FINGER), Plate("friction", "", (Panel("friction", "", "<svg/>", (), ()),)))
    return fold(AnalystState(Path("recordings/P07")), Found("predicted", told, plates))


def test_every_stroke_has_a_line_that_names_its_trial(state):
    listed = rows(state)
    assert [row.stroke for row in listed if row.stroke] == list(state.report.strokes)
    for row in listed:
        assert row.prediction is None or row.stroke is None or row.prediction.stroke == row.stroke.number
        assert row.trial is None or row.words.startswith(str(row.trial))


def test_a_point_of_prediction_against_score_chooses_its_trial_everywhere(state):
    found = points(state)
    assert found
    for point in found:
        after = fold(state, Choose(point.row))
        said = chosen(after).prediction
        assert (said.experiment, said.index) == (point.experiment, point.index)
        assert 1000.0 * said.sed == pytest.approx(point.sed_kpa)


def test_a_choice_beyond_the_list_is_its_end(state):
    assert fold(state, Choose(1000)).row == len(rows(state)) - 1
    assert fold(state, Choose(-3)).row == 0


def test_numbers_are_walked_back_to_the_window_of_readings_they_came_from(state):
    at = next(i for i, row in enumerate(rows(state)) if row.stroke and row.stroke.steady)
    after = fold(state, Choose(at))
    stroke = chosen(after).stroke
    assert f"{stroke.steady[0]:.3f} to {stroke.steady[1]:.3f} s" in lineage(after)
    assert numbers(after)[-1] == ("from", lineage(after))


def test_a_number_that_is_withheld_says_why(state):
    first = state.report.strokes[0]
    bare = replace(first, mu_max=None, reasons={"mu_max": "the zero drifted"})
    told = replace(state, report=replace(state.report, strokes=(bare,)), row=0)
    assert dict(numbers(told))["µ at its greatest"] == "–  the zero drifted"


def test_the_finger_shown_is_that_of_the_chosen_trial(state):
    for number, field in enumerate(state.report.fields):
        at = next(
            i
            for i, row in enumerate(rows(state))
            if row.prediction and (row.prediction.experiment, row.prediction.index) == (field.experiment, field.index)
        )
        if rows(state)[at].prediction.sed is not None:
            assert finger_pictures(fold(state, Choose(at))) == FINGER[2 * number : 2 * number + 2]
    assert [panel.name for panel in pictures(state)] == ["friction"]


@pytest.mark.parametrize(
    ("message", "going_on", "told"),
    [
        (Step(0.3, "predicting"), True, ""),
        (Write("csv", "out"), True, ""),
        (Written("out"), False, "Written: out"),
        (Problem("No."), False, "No."),
        (Cancelled(), False, "Stopped. What was done before is kept."),
    ],
)
def test_what_was_found_stays_whatever_comes_after(state, message, going_on, told):
    after = fold(state, message)
    assert (after.report, after.plates) == (state.report, state.plates)
    assert (after.step is not None, after.told) == (going_on, told)


def test_nothing_is_shown_of_a_session_before_it_is_open():
    empty = AnalystState(Path("x"))
    assert (rows(empty), numbers(empty), points(empty), pictures(empty)) == ((), (), (), ())
    assert chosen(fold(empty, Choose(2))) is None
    assert progress_words(empty.step) == "opening  0 %"


def wait(analyst, wanted):
    said = []
    end = time.monotonic() + 120.0  # of a machine that hangs, not of a slow one
    while not any(isinstance(message, wanted) for message in said):
        assert time.monotonic() < end
        said += analyst.poll()
        time.sleep(0.01)
    return said


def test_a_folder_that_is_no_session_is_told_in_a_sentence(tmp_path):
    analyst = Analyst(tmp_path)
    try:
        assert str(tmp_path) in wait(analyst, Problem)[-1].sentence
    finally:
        analyst.close()
