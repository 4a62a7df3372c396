"""Numbers in the tables of a report, worked out by hand from what was found."""

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
from report_example import TABLES, example
from scipy import stats

from sessions.report.contents import GroundTruth
from sessions.report.tables.predictions import afferent_table, direction_table, force_table, prediction_table
from sessions.report.tables.session import answer_tables, ground_truth_table, relation_table, score_table


@pytest.fixture(scope="module")
def report():
    return example()


def numbers(text):
    """Return the numbers in a cell's text, with their true minus signs."""
    return [float(number.replace("−", "-")) for number in re.findall(r"−?[\d.]+", text)]


def rows_by_trial(table):
    return {int(row[0].text): row for group in table.groups for row in group.rows}


def test_friction_of_a_prediction_has_the_interval_of_the_number_that_the_model_was_given(report):
    printed = replace(report, predictions=tuple(replace(p, tau_max=p.tau_max / 100) for p in report.predictions))
    strokes = {stroke.number: stroke for stroke in report.strokes}
    for findings in (report, printed):
        rows = rows_by_trial(prediction_table(findings))
        for prediction in findings.predictions:
            stroke, (mu, rule, tau_max) = strokes[prediction.stroke], rows[prediction.trial][2:5]
            assert numbers(mu.text) == pytest.approx([prediction.mu], abs=5e-4)
            assert numbers(tau_max.text) == pytest.approx([1e3 * prediction.tau_max], rel=5e-3)
            if not stroke.bootstrap:
                assert (mu.interval, tau_max.interval) == ("", "")
                continue
            ends = stroke.bootstrap["mu_max" if rule.text == "maximum" else "mu_dynamic"]
            assert numbers(mu.interval) == pytest.approx(ends, abs=5e-4)
            share = 1e3 * prediction.tau_max / stroke.tau_max  # kPa, by the reading of tau_max
            expected = [end * share for end in stroke.bootstrap["tau_max"]]
            assert numbers(tau_max.interval) == pytest.approx(expected, rel=6e-3)


def test_forces_of_the_model_stand_beside_the_measured_ones_and_by_the_width(report):
    rows = rows_by_trial(force_table(report))
    for prediction in report.predictions:
        per_mm, normal, measured, tangential = rows[prediction.trial][2:6]
        low, high = prediction.interval.normal_force
        assert numbers(per_mm.text) == pytest.approx([0.2, 0.2 * prediction.normal_force_error], abs=1e-4)
        assert numbers(per_mm.interval) == pytest.approx([low / report.width, high / report.width], abs=1e-4)
        assert numbers(normal.text) == pytest.approx([3.0, 3.0 * prediction.normal_force_error], abs=1e-3)
        assert numbers(normal.interval) == pytest.approx([low, high], abs=5e-3)
        assert numbers(measured.text) == pytest.approx([3.1])
        assert numbers(tangential.interval) == pytest.approx(prediction.interval.tangential_force, abs=5e-3)


def test_both_ways_are_compared_as_distal_to_proximal_over_proximal_to_distal(report):
    rows = rows_by_trial(direction_table(report))
    for prediction in report.predictions:
        ratio = rows[prediction.trial][6]
        (a, b), (c, d) = ((band.low, band.high) for band in (prediction.interval, prediction.opposite_interval))
        other_way = prediction.direction == 1  # then the way back is the opposite one
        expected = 0.7 if other_way else 1 / 0.7
        assert numbers(ratio.text) == pytest.approx([expected], abs=5e-4)
        limits = [c / b, d / a] if other_way else [a / d, b / c]  # a range holds the ratio wherever both lie
        assert numbers(ratio.interval) == pytest.approx(limits, abs=5e-4)


def test_firing_stands_beside_the_quantity_that_the_afferent_answers_to_in_its_unit(report):
    responses = {"von_mises": (0.0123, 0.0002), "shear_along_skin": (-0.25, 0.004)}
    predictions = tuple(replace(p, responses=responses) for p in report.predictions)
    for name, expected in (("von_mises", [12.3, 0.2]), ("shear_along_skin", [-0.25, 0.004])):
        table = afferent_table(replace(report, predictions=predictions, afferent_quantity=name))
        for row in rows_by_trial(table).values():
            assert numbers(row[2].text) == pytest.approx(expected)


def test_an_estimate_is_off_by_its_share_of_the_true_number(report):
    first = report.strokes[0]
    prediction = report.predictions[0]
    truth = GroundTruth(first.trial, prediction.mu / 1.25, first.tau_max / 0.8, first.speed, -first.direction)
    (row,) = ground_truth_table(replace(report, ground_truth=(truth,))).groups[0].rows
    assert [row[n].text for n in (4, 7, 10, 11)] == ["+25.0", "−20.0", "0.0", "wrong"]
    assert numbers(row[3].interval) == pytest.approx(first.bootstrap["mu_max"], abs=5e-4)


def test_scipy_comes_to_the_same_mean_scores_of_the_answers(report):
    tables = answer_tables(report)
    for experiment, table, group in zip(report.experiments, tables, score_table(report).groups, strict=True):
        answers = np.array([*experiment.answers.values()], dtype=float)  # (subjects, indices)
        assert [row[0].text for row in table.groups[0].rows] == [*experiment.answers]
        assert [column.name for column in table.columns[1:]] == [f"index {index}" for index in experiment.indices]
        cells = [[float(cell.text) for cell in row[1:]] for row in table.groups[0].rows]
        np.testing.assert_allclose(cells, answers, atol=0.051)
        n = len(answers)
        for row, index, column in zip(group.rows, experiment.indices, answers.T, strict=True):
            assert [row[0].text, row[1].text] == [str(index), str(n)]
            sd = column.std(ddof=1)
            ends = np.clip(stats.t.interval(0.95, n - 1, column.mean(), stats.sem(column)), 0.0, 100.0)  # of the line
            assert numbers(row[2].text + " " + row[3].text) == pytest.approx([column.mean(), *ends], abs=0.051)
            sd_ends = sd * ((n - 1) / stats.chi2.ppf([0.975, 0.025], n - 1)) ** 0.5
            assert numbers(row[4].text + " " + row[4].interval) == pytest.approx([sd, *sd_ends], abs=0.051)


def test_scipy_comes_to_the_same_relation_of_prediction_and_mean_score(report):
    for experiment, group in zip(report.experiments, relation_table(report).groups, strict=True):
        sed = [TABLES[experiment.descriptor][index][3] for index in experiment.indices]  # [MPa]
        means = np.array([*experiment.answers.values()], dtype=float).mean(axis=0)
        rows = {row[0].text: row[1:] for row in group.rows}
        for name, x in (("mean score", means), ("index", np.array(experiment.indices, dtype=float))):
            n, r, ends, rho, _, p, slope, without = rows[name]
            pearson, spearman = stats.pearsonr(x, sed), stats.spearmanr(x, sed)
            assert n.text == str(len(sed))
            assert numbers(r.text + ends.text) == pytest.approx(
                [pearson.statistic, *pearson.confidence_interval(0.95)], abs=0.0051
            )
            assert numbers(rho.text) == pytest.approx([spearman.statistic], abs=0.0051)
            orders = [stats.spearmanr(order, sed).statistic for order in itertools.permutations(x)]
            exact = np.mean(np.abs(orders) > abs(spearman.statistic) - 1e-9)
            assert numbers(p.text) == pytest.approx([exact], abs=0.0051)
            assert numbers(slope.text) == pytest.approx([1e6 * stats.linregress(x, sed).slope], rel=0.0051)  # [Pa]
            remaining = [stats.pearsonr(np.delete(x, i), np.delete(sed, i)).statistic for i in range(len(sed))]
            labels = [int(part.split(":")[0]) for part in without.text.split(", ")]
            assert labels == list(experiment.indices)
            values = [numbers(part.split(":")[1])[0] for part in without.text.split(", ")]
            assert values == pytest.approx(remaining, abs=0.0051)
