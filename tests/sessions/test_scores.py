import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings import new_writer
from scipy import stats

from sessions.plan.plan import Block, Frame, SessionPlan, Stimulus, Trial
from sessions.recording import Recording
from sessions.report import findings
from sessions.report.tables.session import tables
from sessions.statistics.correlations import relation, slope_interval
from sessions.statistics.scores import (
    Score,
    ScoreTable,
    distinct_sessions,
    grades_of,
    mean_scores,
    reversed_subjects,
    score_matrix,
    score_table,
    subject_scores,
)
from sessions.strokes.analysis import analyse


def table(subject, values, *, session=None, descriptor="stickiness", indices=(0, 20, 50, 80, 100)):
    scores = tuple(Score(subject, descriptor, i, v) for i, v in zip(indices, values, strict=False))
    return ScoreTable(session or f"{subject}-visit", subject, False, scores)


def points_with_r(r):
    """Five points whose Pearson r is r by construction: two orthogonal unit vectors, mixed."""
    u = np.array([-2, -1, 0, 1, 2]) / math.sqrt(10)
    v = np.array([2, -1, -2, -1, 2]) / math.sqrt(14)
    return list(u), list(r * u + math.sqrt(1 - r * r) * v)


def test_the_interval_of_ten_subjects_is_2_262157_standard_errors_wide_each_way():
    values = [41, 48, 55, 39, 52, 44, 47, 58, 50, 46]
    (mean,) = mean_scores(table(f"P{i:02}", [v], indices=(50,)) for i, v in enumerate(values))
    error = math.sqrt(sum((v - 48) ** 2 for v in values) / 9 / 10)
    assert (mean.n, mean.mean) == (10, 48)
    assert mean.high - mean.mean == pytest.approx(2.262157 * error, rel=1e-6)
    assert mean.mean - mean.low == pytest.approx(2.262157 * error, rel=1e-6)


def test_repeats_of_one_subject_are_averaged_before_subjects_are_counted():
    tables = [table("P01", [10], session="a"), table("P01", [30], session="b"), table("P02", [40])]
    (mean,) = mean_scores(tables)
    assert (mean.n, mean.mean) == (2, 30)


def test_a_session_handed_in_twice_counts_once():
    visit = table("P01", [10, 20])
    assert distinct_sessions([visit, table("P02", [5]), visit]) == (visit, table("P02", [5]))


def test_one_subject_alone_has_a_mean_and_a_reason_instead_of_an_interval():
    (mean,) = mean_scores([table("P01", [37])])
    assert (mean.mean, mean.low, mean.high, mean.sd) == (37, None, None, None)
    assert "one subject" in mean.reason
    (mean,) = mean_scores([table("P01", [37]), table("P02", [39])])
    assert (mean.mean, mean.high - mean.mean) == (38, pytest.approx(12.7062, abs=1e-4))  # t(0.975, 1), by tables


def test_an_interval_ends_where_the_scale_does():
    (mean,) = mean_scores(table(f"P{i}", [v], indices=(100,)) for i, v in enumerate([100, 100, 99, 100, 93]))
    error = math.sqrt(sum((v - 98.4) ** 2 for v in (100, 100, 99, 100, 93)) / 4 / 5)
    assert (mean.low, mean.high) == (pytest.approx(98.4 - 2.776445 * error), 100)


def test_subjects_who_all_answer_alike_tell_no_interval():
    (mean,) = mean_scores(table(f"P{i}", [100], indices=(100,)) for i in range(9))
    assert (mean.mean, mean.sd, mean.low, mean.high) == (100, 0, None, None)
    assert "no interval" in mean.reason


@pytest.mark.parametrize(("r", "low", "high"), [(0.95, 0.42, 0.997), (0.97, 0.61, 0.998)])
def test_the_interval_of_r_from_five_points_is_as_wide_as_fisher_says(r, low, high):
    correlation = relation(*points_with_r(r), labels=(0, 20, 50, 80, 100))
    assert correlation.pearson == pytest.approx(r)
    assert (round(correlation.low, 2), round(correlation.high, 3)) == (low, high)


def test_a_perfect_order_of_five_has_the_exact_p_of_two_in_120():
    correlation = relation([1, 2, 3, 4, 5], [1, 2, 4, 8, 16], labels=(0, 20, 50, 80, 100))
    assert correlation.spearman == pytest.approx(1)
    assert correlation.spearman_p == pytest.approx(2 / 120)


def test_means_that_are_equal_but_for_round_off_share_their_rank():
    result = relation([1, 2, 3, 4], [np.mean([0.1, 0.2, 0.3]), np.mean([0.3, 0.2, 0.1]), 1, 2], labels=(1, 2, 3, 4))
    assert result.spearman == pytest.approx(math.sqrt(0.9))  # ranks 1.5 1.5 3 4: 4.5 / sqrt(5 * 4.5)


def test_the_published_slipperiness_friction_is_out_of_order_at_55_only():
    index, mu = (0, 20, 55, 75, 100), (0.62, 0.55, 0.44, 0.52, 0.24)  # the published Table 2
    correlation = relation(index, mu, labels=index)
    # One neighbouring pair is exchanged: rho = -(1 - 6 * 2 / (5 * 24)) = -0.9.
    assert correlation.spearman == pytest.approx(-0.9)
    assert dict(correlation.without)[55] < correlation.pearson < 0


def test_the_interval_of_rho_is_bonett_and_wrights():
    x = list(range(10))
    y = [1, 0, 2, 4, 3, 5, 6, 9, 7, 8]  # sum of d^2: 1 + 1 + 1 + 1 + 4 + 1 + 1 = 10, rho = 1 - 60 / 990
    correlation = relation(x, y, labels=x)
    rho = 1 - 60 / 990
    half = 1.959964 * ((1 + rho * rho / 2) / 7) ** 0.5
    assert correlation.spearman == pytest.approx(rho)
    expected = [math.tanh(math.atanh(rho) + side * half) for side in (-1, 1)]
    assert [correlation.spearman_low, correlation.spearman_high] == pytest.approx(expected, rel=1e-6)


def test_the_line_is_the_least_squares_line():
    correlation = relation([0, 1, 2, 3], [1, 3, 5, 7], labels=(0, 1, 2, 3))
    assert (correlation.slope, correlation.intercept) == (pytest.approx(2), pytest.approx(1))


def test_the_interval_of_the_slope_is_the_t_interval_of_its_standard_error():
    x, y = [0.0, 1.0, 2.0, 4.0, 7.0], [1.0, 0.5, 2.5, 3.0, 9.0]
    line = stats.linregress(x, y)
    half = stats.t.ppf(0.975, 3) * line.stderr
    assert slope_interval(relation(x, y, labels=x)) == pytest.approx((line.slope - half, line.slope + half))


def test_a_perfect_r_has_no_interval_and_says_so():
    correlation = relation([0, 1, 2, 3], [1, 3, 5, 7], labels=(0, 1, 2, 3))
    assert correlation.low is None
    assert "perfect" in correlation.reason


@pytest.mark.parametrize(
    ("x", "y", "why"), [([1, 2], [3, 4], "too few"), ([], [], "too few"), ([1, 2, 3], [4, 4, 4], "vary")]
)
def test_without_a_correlation_there_is_a_reason_and_no_number(x, y, why):
    correlation = relation(x, y, labels=tuple(range(len(x))))
    assert (correlation.pearson, correlation.spearman, correlation.slope) == (None, None, None)
    assert why in correlation.reason


def test_three_points_have_an_r_but_no_interval():
    correlation = relation([1, 2, 3], [1, 3, 2], labels=(1, 2, 3))
    assert correlation.pearson == pytest.approx(0.5)
    assert (correlation.low, correlation.high) == (None, None)


def test_a_subject_whose_scores_fall_with_the_index_is_named():
    tables = [table("P01", [0, 20, 50, 80, 100]), table("P02", [90, 70, 50, 30, 5])]
    ((subject, descriptor, r),) = reversed_subjects(tables)
    assert (subject, descriptor) == ("P02", "stickiness")
    assert r < -0.9


def test_the_matrix_of_scores_holds_a_row_a_subject():
    assert score_matrix([table("P02", [1, 2]), table("P01", [3])], "stickiness") == {
        "P01": {0: 3},
        "P02": {0: 1, 20: 2},
    }


@given(st.lists(st.floats(0, 100), min_size=2, max_size=12))
def test_the_mean_lies_inside_its_interval_whatever_was_answered(values):
    (mean,) = mean_scores(table(f"P{i}", [v]) for i, v in enumerate(values))
    assert mean.low is None or 0 <= mean.low <= mean.mean <= mean.high <= 100


@given(st.permutations([("P01", 3.0), ("P02", 50.0), ("P03", 97.0)]))
def test_the_order_of_the_sessions_does_not_matter(answers):
    means = mean_scores(table(subject, [v]) for subject, v in answers)
    assert means[0].mean == pytest.approx(50)
    assert {s.subject for s in subject_scores(table(p, [v]) for p, v in answers)} == {"P01", "P02", "P03"}


@pytest.mark.parametrize(
    ("answers", "sentence", "row"),
    [
        (["number", "number"], "1 number on a scale of the subject's own", (2, "2", "7.5")),
        (["none", "choice"], "1 choice of one of two", (2, "1, then 2", "1")),
    ],
)
def test_answers_that_are_no_scores_on_the_line_are_shown_and_never_averaged_with_them(
    tmp_path, answers, sentence, row
):
    trials = tuple(
        Trial(n, "b", Stimulus("d", n, f"K{n}"), 1, 1, answer=answer, compared_with=1 if answer == "choice" else None)
        for n, answer in enumerate(answers, 1)
    )
    plan = SessionPlan("made", "S01", 0, "none", (Block("b", "Stroke.", 1, 2.0, ("", ""), trials),), False, Frame())
    writer = new_writer(tmp_path / "s", info=None, plan=plan)
    for n, answer in enumerate(answers, 1):
        writer.event("take_started", n, {"take": 1})
        if n == 2:
            event = ("number_given", {"number": 7.5}) if answer == "number" else ("chosen", {"choice": "first"})
            writer.event(event[0], n, event[1])
        writer.event("take_kept", n, {"take": 1})
    writer.event("ended", data={"reason": "done"})
    writer.close()
    recording = Recording.open(tmp_path / "s")
    assert [record.outcome for record in recording.trials] in (["not answered", "numbered"], ["presented", "chosen"])
    table = score_table(recording)
    assert table.scores == ()
    assert sentence in table.other_answers
    assert mean_scores([table]) == ()
    report = findings(recording, analyse(recording))
    assert [experiment.other_answers for experiment in report.experiments] == [(row,)]
    assert [one.name for one in tables(report)["scores"]] == ["table-other-answers"]
    assert report.excluded == ()


@pytest.mark.parametrize(
    ("answers", "sentence"),
    [
        ({0: 2.0, 20: 30.0, 50: 55.0}, "the grading holds"),
        ({0: 2.0, 20: 60.0, 50: 55.0}, "does not hold: 50 was judged no higher than 20"),
        ({0: 5.0, 20: 5.0}, "does not hold: 20 was judged no higher than 0"),
        ({0: 5.0}, "too few answers"),
    ],
)
def test_a_pre_evaluation_says_whether_the_makers_grading_holds_and_counts_nowhere_else(tmp_path, answers, sentence):
    trials = tuple(
        Trial(n, "b", Stimulus("d", index, f"K{n}"), 1, 1, "pre-evaluation") for n, index in enumerate(answers, 1)
    )
    plan = SessionPlan("made", "S01", 0, "none", (Block("b", "Stroke.", 1, 2.0, ("", ""), trials),), False, Frame())
    writer = new_writer(tmp_path / "s", info=None, plan=plan)
    for n, score in enumerate(answers.values(), 1):
        writer.event("take_started", n, {"take": 1})
        writer.event("scored", n, {"score": score})
        writer.event("take_kept", n, {"take": 1})
    writer.event("ended", data={"reason": "done"})
    writer.close()
    recording = Recording.open(tmp_path / "s")
    assert sentence in grades_of(recording.trials)["d"]
    assert score_table(recording).scores == ()
