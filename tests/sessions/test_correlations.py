"""Correlations, their differences and intervals, against published values and formulas."""

import math

import numpy as np
import pytest
from scipy import stats

from sessions.statistics.correlations import (
    contrast,
    jackknife,
    leave_one_out_error,
    partial_correlation,
    required_cases,
    steiger_z,
)


@pytest.mark.parametrize(
    ("first", "second", "mutual", "n", "z"),
    [(0.0228, 0.3522, 0.3718, 553, -7.1345), (0.2493, 0.3395, 0.4082, 553, -2.0660)],
)
def test_steigers_z_is_what_the_package_cocor_prints(first, second, mutual, n, z):
    assert steiger_z(first, second, mutual, n) == pytest.approx(z, abs=2e-3)  # its correlations have four decimals


def test_the_interval_of_a_difference_is_that_of_zous_worked_example():
    difference = contrast(0.396, 0.179, 0.088, 66)
    assert (difference.low, difference.high) == pytest.approx((-0.093, 0.517), abs=5e-4)


def test_correlations_that_are_hardly_less_than_one_have_a_difference_with_an_interval():
    difference = contrast(0.9999999871286794, 0.999999999202874, 0.999999983262, 4)  # of three columns alike to 1e-4
    assert difference.low <= difference.difference <= difference.high


def test_a_rival_with_the_other_sign_is_turned_round_before_it_is_compared():
    assert contrast(0.6, -0.5, -0.3, 30) == contrast(0.6, 0.5, 0.3, 30)


def test_steigers_test_at_the_number_of_cases_needed_has_eighty_per_cent_power():
    first, second, mutual = 0.75, 0.6, 0.5
    n = required_cases(first, second, mutual)
    draw = np.random.default_rng(5)
    r = np.array([[1.0, first, second], [first, 1.0, mutual], [second, mutual, 1.0]])
    detections = 0
    for cases in draw.multivariate_normal(np.zeros(3), r, size=(2000, n)):
        (_, a, b), (_, _, c), _ = np.corrcoef(cases.T)
        detections += abs(steiger_z(a, b, c, n)) > 1.959964
    assert detections / 2000 == pytest.approx(0.8, abs=0.03)  # three standard errors of 2000 draws


def test_equal_correlations_are_told_apart_by_no_number_of_cases():
    assert required_cases(0.9, 0.9, 0.5) is None


def test_a_partial_correlation_is_that_of_what_the_third_variable_leaves():
    x, y, z = np.random.default_rng(2).normal(size=(3, 12))
    residuals = [v - np.polyval(np.polyfit(z, v, 1), z) for v in (x, y)]
    r = np.corrcoef([x, y, z])
    assert partial_correlation(r[0, 1], r[0, 2], r[1, 2]) == pytest.approx(np.corrcoef(residuals)[0, 1])
    assert math.isnan(partial_correlation(0.9, 1.0, 0.9))


def test_the_left_out_error_is_that_of_lines_fitted_without_each_point():
    x, y = np.random.default_rng(3).normal(size=(2, 6))
    errors = [y[i] - np.polyval(np.polyfit(np.delete(x, i), np.delete(y, i), 1), x[i]) for i in range(len(x))]
    assert leave_one_out_error(x, y) == pytest.approx(math.sqrt(np.mean(np.square(errors))))
    assert leave_one_out_error([0.0, 0.0, 1.0], [1.0, 2.0, 3.0]) is None  # without the last nothing varies


def test_the_jackknife_of_a_mean_is_the_t_test_of_its_values():
    values = np.random.default_rng(6).normal(1.0, 1.0, 7)
    test = stats.ttest_1samp(values, 0.0)
    difference = jackknife(values.mean(), np.array([np.delete(values, n).mean() for n in range(7)]))
    assert difference == pytest.approx((*test.confidence_interval(0.95), test.pvalue))
