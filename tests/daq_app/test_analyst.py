"""The analyst's window knows a session folder without Qt."""

import itertools
import re
import shutil
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq_app.analyst import state as m
from daq_app.analyst.finger_words import compare_reports, finger_text
from daq_app.analyst.frame import FIELD_ERRORS, Frame, FrameMesh
from daq_app.analyst.process import Analyst
from daq_app.analyst.session_words import lineage, numbers, points, progress_text, row_text, session_pictures
from daq_app.analyst.state import AnalystState, fold, rows, selected_row
from daq_app.analyst.stroke import EDGE_DISTANCE, EDGES, RawFile, clamp_edge, decision_of, edges_of, history, reversal
from daq_app.analyst.work import Work, sentence_of
from sessions.recording import Recording
from sessions.recording.derived import set_gain_error
from sessions.report import findings
from sessions.report.contents import AnswerFinding
from sessions.strokes import AnalysisSettings, analyse
from sessions.strokes.decisions import Decision, Decisions, read
from solver.prediction import Skin
from tests.sessions.report_example import example

undo, redo = partial(reversal, redo=False), partial(reversal, redo=True)

SESSION = Path(__file__).parents[1] / "data" / "sessions" / "version-1" / "sealed"
NOTHING = np.empty(0)
BARE = FrameMesh(np.empty((0, 3), np.int64), np.empty((0, 8), np.int64), np.empty(0, np.int64))
PLACE = np.zeros((1, 2))
FINGER = Frame(BARE, PLACE, {"sed": np.zeros(1)}, {}, PLACE, Skin(*[NOTHING] * 4, ()), NOTHING)


@pytest.fixture(scope="module")
def state():
    return fold(AnalystState(Path("recordings/P07")), m.ReportReady("predicted", example()))


@pytest.fixture(scope="module")
def steady(state):
    return next(stroke for stroke in state.report.strokes if stroke.steady and stroke.onset is not None)


def test_every_stroke_has_a_line_that_names_its_trial(state):
    lines = rows(state)
    assert [row.stroke for row in lines if row.stroke] == list(state.report.strokes)
    for row, words in zip(lines, [row_text(row) for row in rows(state)], strict=True):
        assert row.prediction is None or row.stroke is None or row.prediction.stroke == row.stroke.number
        assert row.trial is None or words.lstrip().startswith(str(row.trial))


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (("scored", 37.4), "score 37"),
        (("numbered", 0.125), "number 0.125"),
        (("numbered", 123456789.0), "number 123456789"),
        (("chosen", "second"), "the second"),
    ],
)
def test_a_line_says_what_the_subject_answered_to_its_trial(state, answer, words):
    finding = AnswerFinding(3, "stickiness", 20, "K20", *answer)
    after = fold(state, m.ReportReady("predicted", replace(state.report, answers=(finding,))))
    assert [row.trial for row in rows(after) if words in row_text(row)] == [3]


def test_the_answers_shown_are_those_that_the_session_recorded():
    recording = Recording.open(SESSION)
    scores = {event.trial: event.data["score"] for event in recording.events if event.kind == "scored"}
    answers = findings(recording, analyse(recording)).answers
    assert answers
    assert {one.trial: one.answer for one in answers} == {trial: it for trial, it in scores.items() if it is not None}


def test_a_session_of_scores_alone_has_a_line_for_each_answer():
    answers = [AnswerFinding(n, "stickiness", 20, "K20", "scored", 10.0 * n) for n in (1, 2)]
    report = replace(example(), strokes=(), predictions=(), answers=tuple(answers))
    state = fold(AnalystState(Path("x")), m.ReportReady("predicted", report))
    assert [row_text(row) for row in rows(state)] == [
        "\u20071  stickiness 20  score 10",
        "\u20072  stickiness 20  score 20",
    ]
    second = fold(state, m.Choose(1))
    assert selected_row(second).trial == 2
    assert numbers(second) == ()
    assert [link.target for link in lineage(second)] == ["session", "trial"]


def test_a_trial_without_a_stroke_stands_at_its_place_and_moves_no_choice(state):
    second = state.report.strokes[1]
    bare = replace(state.report, strokes=tuple(s for s in state.report.strokes if s is not second), predictions=())
    chosen_third = fold(fold(AnalystState(Path("x")), m.ReportReady("analysed", bare)), m.Choose(1))
    assert selected_row(chosen_third).trial == 3
    prediction = replace(state.report.predictions[1], stroke=None, sed=None)
    ready = m.ReportReady("predicted", replace(bare, predictions=(prediction,)))
    for message in (m.TrialAnswer(prediction, None), ready):
        after = fold(chosen_third, message)
        assert [row.trial for row in rows(after)] == list(range(1, 11))
        assert rows(after)[1].stroke is None
        assert selected_row(after).trial == 3


def test_a_point_of_prediction_against_score_chooses_its_trial_everywhere(state):
    all_points = points(state)
    assert all_points
    for point in all_points:
        after = fold(state, m.Choose(point.row))
        prediction = selected_row(after).prediction
        (group,) = (group for group in state.report.experiments if group.name == prediction.experiment)
        assert point.score in [score.mean for score in group.scores if score.index == prediction.index]
        assert 1000.0 * prediction.sed == pytest.approx(point.response)


def test_a_choice_beyond_the_list_is_its_end(state):
    assert fold(state, m.Choose(1000)).row == len(rows(state)) - 1
    assert fold(state, m.Choose(-3)).row == 0


def test_a_number_is_walked_back_to_its_readings_link_by_link(state, steady):
    at = next(i for i, row in enumerate(rows(state)) if row.stroke is steady)
    links = lineage(fold(state, m.Choose(at)))
    assert [link.target for link in links] == ["session", "trial", "prediction", "friction", "window", "readings"]
    assert f"{steady.steady[0]:.3f} to {steady.steady[1]:.3f} s" in links[4].text


def test_a_number_that_is_withheld_says_why(state):
    first = state.report.strokes[0]
    bare = replace(first, mu_max=None, reasons={"mu_max": "the zero drifted"})
    withheld = replace(state, report=replace(state.report, strokes=(bare,)), row=0)
    assert dict(numbers(withheld))["µ at its greatest"] == "–  the zero drifted"


@pytest.mark.parametrize(
    ("message", "going_on", "outcome"),
    [
        (m.Step(0.3, "predicting"), True, ""),
        (m.Write("csv", "out"), True, ""),
        (m.Idle(), False, ""),
        (m.Problem("No."), False, "No."),
        (m.Cancelled(), False, "Stopped. Finished results are kept."),
    ],
)
def test_what_was_found_stays_whatever_comes_after(state, message, going_on, outcome):
    after = fold(state, message)
    assert after.report == state.report
    assert (after.step is not None, after.outcome) == (going_on, outcome)


def test_nothing_is_shown_of_a_session_before_it_is_open():
    empty = AnalystState(Path("x"))
    assert (rows(empty), numbers(empty), points(empty), session_pictures(empty.report)) == ((), (), (), ())
    assert selected_row(fold(empty, m.Choose(2))) is None
    assert progress_text(empty.step) == "opening  0 %"


# ---- the model's answers come one by one


def test_answers_are_shown_as_they_come_and_stay_when_the_work_is_stopped(state):
    bare = fold(AnalystState(Path("x")), m.ReportReady("analysed", replace(state.report, predictions=())))
    prediction = state.report.predictions[1]
    after = fold(fold(bare, m.TrialAnswer(prediction, FINGER)), m.Cancelled())
    assert after.report.predictions == (prediction,)
    assert after.fingers == {(prediction.trial, prediction.stroke): FINGER}
    assert after.halted
    assert "stopped" in finger_text(fold(after, m.Choose(0)))


def test_a_moved_window_takes_back_the_answer_to_its_stroke_alone(state, steady):
    with_fingers = state
    for prediction in state.report.predictions:
        with_fingers = fold(with_fingers, m.TrialAnswer(prediction, FINGER))
    changed_stroke = replace(steady, mu_dynamic=steady.mu_dynamic + 0.01)
    strokes = tuple(changed_stroke if s is steady else s for s in state.report.strokes)
    after = fold(with_fingers, m.ReportReady("analysed", replace(state.report, strokes=strokes, predictions=())))
    unanswered = {s.number for s in strokes} - {p.stroke for p in after.report.predictions}
    assert unanswered == {steady.number}
    assert {stroke for _, stroke in after.fingers} == {s.number for s in strokes} - {steady.number}


# ---- edges and decisions


def test_edges_stand_in_order_of_time_and_say_who_moved_them(steady):
    moved_stroke = replace(steady, decided={"steady": "decision 1 by E02"})
    edges = edges_of(moved_stroke)
    assert [edge.edge for edge in edges] == list(EDGES)
    assert [edge.time for edge in edges] == sorted(edge.time for edge in edges)
    assert [bool(edge.decision) for edge in edges] == [False, True, True, False]


def test_a_stroke_without_a_steady_window_is_offered_one(steady):
    edges = edges_of(replace(steady, steady=None))
    assert [edge.present for edge in edges] == [True, False, False, True]
    assert edges[0].time < edges[1].time < edges[2].time < edges[3].time


@given(at=st.sampled_from(EDGES), time=st.floats(-10.0, 1000.0))
def test_an_edge_never_passes_its_neighbours(steady, at, time):
    limit = clamp_edge(steady, at, time)
    times = {one.edge: one.time for one in edges_of(steady)} | {at: limit}
    in_order = [times[edge] for edge in EDGES]
    assert all(b - a >= EDGE_DISTANCE * (1 - 1e-6) for a, b in itertools.pairwise(in_order))


def test_a_moved_edge_is_a_decision_with_who_why_and_what_stood_there(steady):
    begin, end = steady.steady
    decision = decision_of(steady, "steady begin", begin + 0.1, "E02", "a ramp")
    assert (decision.by, decision.why, decision.what, decision.old) == ("E02", "a ramp", "steady", (begin, end))
    assert decision.new == pytest.approx((begin + 0.1, end))
    assert (decision.trial, decision.stroke) == (steady.trial, steady.within)
    lift = decision_of(steady, "lift", steady.lift + 0.05, "E02", "late")
    assert (lift.what, lift.old) == ("lift", steady.lift)
    assert lift.new == pytest.approx(steady.lift + 0.05)


def test_undo_and_redo_go_back_and_forth_over_every_decision_and_all_of_it_stays_written():
    def value(decisions):
        return [line.new for line in decisions.in_force]

    decisions = Decisions()
    for new in (1.0, 2.0):
        decisions = decisions.with_line(Decision("E02", "dragged", "onset", 1, 1, 0.5, new))
    values = [value(decisions)]
    for step in (undo, undo, redo, redo, undo):
        decisions = decisions.with_line(step(decisions, "E03"))
        values.append(value(decisions))
    assert values == [[2.0], [1.0], [], [1.0], [2.0], [1.0]]
    assert len(decisions.lines) == 7
    assert undo(Decisions(), "E03") is None
    again = decisions.with_line(Decision("E02", "dragged", "onset", 1, 1, 1.0, 3.0))
    assert redo(again, "E03") is None


def test_the_history_names_what_undo_and_redo_would_do_next():
    decisions = Decisions()
    for what in ("onset", "lift"):
        decisions = decisions.with_line(Decision("E02", "dragged", what, 1, 1, 0.5, 1.0))
    onset, lift = "onset of stroke 1 of trial 1", "lift of stroke 1 of trial 1"
    histories = [history(decisions)]
    for step in (undo, undo, redo):
        decisions = decisions.with_line(step(decisions, "E03"))
        histories.append(history(decisions))
    assert [(entry.undo, entry.redo) for entry in histories] == [(lift, ""), (onset, lift), ("", onset), (onset, lift)]


# ---- two sessions


def test_two_sessions_are_held_against_each_other_stimulus_by_stimulus(state):
    report = state.report
    first = report.predictions[0]
    higher = replace(first, mu=first.mu + 0.1, sed=first.sed + 0.001)
    other = replace(report, predictions=(higher, *report.predictions[1:]))
    pairs = dict(compare_reports(report, other))
    assert len(pairs) == len({(p.experiment, p.index) for p in report.predictions})
    for key, (mu, sed, score) in pairs.items():
        same = key != f"{first.experiment} {first.index}"
        assert mu[1] - mu[0] == pytest.approx(0.0 if same else 0.1)
        assert sed[1] - sed[0] == pytest.approx(0.0 if same else 1.0)
        assert score[1] == score[0]


def test_a_stimulus_that_one_session_lacks_has_no_number_of_it(state):
    report = state.report
    shorter = replace(report, predictions=report.predictions[1:])
    first_prediction = report.predictions[0]
    first, second = dict(compare_reports(report, shorter))[f"{first_prediction.experiment} {first_prediction.index}"][0]
    assert first is not None
    assert second is None


# ---- the work


@pytest.fixture
def at_work(tmp_path):
    """A recorded session, opened, and how its window's state follows what is done with it."""
    states = [AnalystState(tmp_path / "session")]
    shutil.copytree(SESSION, tmp_path / "session")
    work = Work(tmp_path / "session", lambda message: states.append(fold(states[-1], message)))
    return work, states


def test_a_window_moved_in_a_session_is_a_decision_beside_it_and_its_numbers_follow(at_work, tmp_path):
    work, states = at_work
    before = states[-1].report.strokes[0]
    work.do(m.Move(1, "steady begin", before.steady[0] + 0.1, "E02", "a ramp"))
    after = states[-1].report.strokes[0]
    assert after.steady == pytest.approx((before.steady[0] + 0.1, before.steady[1]))
    assert "E02" in after.decided["steady"]
    assert "a ramp" in after.decided["steady"]
    assert after.normal_force != before.normal_force
    work.do(m.Undo("E03"))
    assert states[-1].report.strokes[0].steady == before.steady
    assert states[-1].outcome.startswith("Undone, as decision 2: decision 1 by E02: steady of stroke 1 of trial 1")
    work.do(m.Undo("E03", redo=True))
    assert states[-1].report.strokes[0].steady == after.steady
    assert len(read(tmp_path / "session").lines) == 3


def test_a_compared_session_comes_with_the_fingers_of_its_answers(at_work):
    work, states = at_work
    work.do(m.Compare(str(SESSION)))
    other = states[-1].comparison
    predictions = {(p.trial, p.stroke): p for p in other.report.predictions if p.sed is not None}
    assert set(other.fingers) == set(predictions) != set()
    for key, finger in other.fingers.items():
        np.testing.assert_allclose(finger.row, list(predictions[key].row.values()))


def test_a_file_that_cannot_be_written_is_reported_with_its_name_and_what_to_do(at_work, tmp_path):
    work, _ = at_work
    with pytest.raises(FileNotFoundError) as refusal:
        work.do(m.Write("picture course", str(tmp_path / "nowhere" / "course.png")))
    assert sentence_of(refusal.value) == f"{tmp_path}/nowhere/course.png: no such file or directory; check its name"


def test_what_is_said_of_one_trial_does_not_stay_with_the_next(state):
    told_state = fold(state, m.Problem("Trial 1 has no history."))
    assert fold(told_state, m.Choose(state.row)).outcome == "Trial 1 has no history."
    assert fold(told_state, m.Choose(state.row + 1)).outcome == ""


def test_the_readings_shown_are_those_of_the_file_and_their_rows_are_reported(at_work):
    work, states = at_work
    work.do(m.ShowReadings(1))
    readings = states[-1].excerpt.readings
    with h5py.File(SESSION / "session.h5") as file:
        first, last = map(int, readings.location.split("rows ")[1].split(" to "))
        np.testing.assert_array_equal(file["readings/raw"][first : last + 1], readings.block.raw)
        np.testing.assert_array_equal(file["readings/sequence"][first : last + 1], readings.block.sequence)
        np.testing.assert_array_equal(file["readings/counter"][first : last + 1], readings.block.counter)


def test_the_zero_of_shown_readings_is_that_of_the_last_moments_before_contact_whatever_the_rate_is_said_to_be():
    recording = Recording.open(SESSION)
    finding = findings(recording, analyse(recording, AnalysisSettings())).strokes[0]
    readings = RawFile(recording).around(finding)
    unknown = replace(recording, info=replace(recording.info, rate=float("nan")))
    assert RawFile(unknown).around(finding).zero == readings.zero
    time = readings.block.time
    free = (time < finding.onset) & (time > time[time < finding.onset][-1] - 0.3)
    assert readings.zero == f"mean before contact, readings: {free.sum()}"
    assert readings.normal[free].mean() == pytest.approx(0.0, abs=1e-9)


def test_a_calibration_error_that_was_set_for_a_session_is_followed_in_its_window_too(tmp_path):
    session, messages = shutil.copytree(SESSION, tmp_path / "session"), []
    set_gain_error(session, 0.003)
    Work(session, messages.append)
    assert "0.3 % of each axis, set" in messages[-1].report.interval_kind


def wait(analyst, kind):
    messages = []
    end = time.monotonic() + 120.0  # of a machine that hangs, not of a slow one
    while not any(isinstance(message, kind) for message in messages):
        assert time.monotonic() < end
        messages += analyst.poll()
        time.sleep(0.01)
    return messages


def test_a_folder_that_is_no_session_is_reported_in_a_sentence(tmp_path):
    analyst = Analyst(tmp_path)
    try:
        assert str(tmp_path) in wait(analyst, m.Problem)[-1].sentence
    finally:
        analyst.close()


def test_a_written_picture_says_the_condition_and_the_errors_of_its_sed(at_work, tmp_path):
    work, _ = at_work
    work.go_on()
    prediction = next(prediction for prediction in work._report.predictions if prediction.sed is not None)
    words = f"SED at {prediction.indentation:.3g} mm, small strain {1000.0 * prediction.sed:.3f} kPa ± "
    for name in (f"finger {prediction.stroke}", f"contact {prediction.stroke}"):
        work.do(m.Write(f"picture {name}", str(tmp_path / "written.csv")))
        (head, *_) = (tmp_path / "written.csv").read_text().splitlines()
        assert words in head
        assert head.endswith(FIELD_ERRORS)
        work.do(m.Write(f"picture {name}", str(tmp_path / "written.svg")))
        lines = re.findall(r">([^<>]+)</text>", (tmp_path / "written.svg").read_text())
        assert words.strip() in " ".join(lines)
    work.do(m.ShowHistory((prediction.trial, prediction.stroke)))
    work.do(m.Write(f"picture finger {prediction.stroke} 0", str(tmp_path / "written.csv")))
    assert "Step 1 of " in (tmp_path / "written.csv").read_text().splitlines()[0]
