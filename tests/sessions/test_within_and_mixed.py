"""Statistics over subjects, against published numbers and closed forms."""

import math
from itertools import chain

import numpy as np
import pytest
from scipy import optimize, stats

from sessions.statistics.mixed_model import difference_of_squares, mixed_model, reml_fit, spreads
from sessions.statistics.within_subjects import (
    agreement,
    differences,
    equal_moduli,
    holm,
    repeated_correlation,
    within_means,
    z_scores,
)

# Intramural pH and PaCO2 of eight subjects: Bland & Altman 1995 (BMJ 310:446), table 1.
PH = """6.68 6.53 6.43 6.33|6.85 7.06 7.13 7.17|7.40 7.42 7.41 7.37 7.34 7.35 7.28 7.30 7.34|7.36 7.33 7.29 7.30 7.35|
7.35 7.30 7.30 7.37 7.27 7.28 7.32 7.32|7.38 7.30 7.29 7.33 7.31 7.33|6.86 6.94 6.92|
7.19 7.29 7.21 7.25 7.20 7.19 6.77 6.82"""
CO2 = """3.97 4.12 4.09 3.97|5.27 5.37 5.41 5.44|5.67 3.64 4.32 4.73 4.96 5.04 5.22 4.82 5.07|5.67 5.10 5.53 4.75 5.51|
4.28 4.44 4.32 3.23 4.46 4.72 4.75 4.99|4.78 4.73 5.12 4.93 5.03 4.93|6.85 6.44 6.52|
5.28 4.56 4.34 4.32 4.41 3.69 6.09 5.58"""


def test_the_correlation_within_subjects_is_the_published_one():
    rows = [[float(word) for word in part.split()] for part in PH.split("|")]
    co2 = [[float(word) for word in part.split()] for part in CO2.split("|")]
    subjects = [str(i) for i, row in enumerate(rows) for _ in row]
    correlation = repeated_correlation(subjects, [*chain(*rows)], [*chain(*co2)])
    # The value of R's rmcorr (Bakdash & Marusich 2017) and of pingouin: r(38) = -0.507, p = 0.000847, -0.71 to -0.23.
    assert correlation.dof == 38
    assert correlation.r == pytest.approx(-0.507, abs=5e-4)
    assert correlation.low == pytest.approx(-0.71, abs=5e-3)
    assert correlation.high == pytest.approx(-0.23, abs=5e-3)
    assert correlation.p == pytest.approx(0.000847, abs=2e-6)


def test_the_interval_of_one_subject_is_fishers_of_an_ordinary_correlation():
    x, y = np.random.default_rng(5).normal(size=(2, 12)) + np.arange(12.0)
    expected = stats.pearsonr(x, y)
    correlation = repeated_correlation(["a"] * 12, x, y)
    assert (correlation.r, correlation.p) == pytest.approx((expected.statistic, expected.pvalue))
    assert (correlation.low, correlation.high) == pytest.approx(tuple(expected.confidence_interval(0.95)))


def test_the_interval_for_other_people_is_that_of_the_jackknife_over_them():
    rng = np.random.default_rng(3)
    names, x = np.repeat(list("abcdef"), 5), rng.normal(size=30)
    y = x + 0.5 * rng.normal(size=30)

    def z(rows):
        own = [names[rows] == name for name in np.unique(names[rows])]
        a, b = (np.concatenate([v[rows][o] - v[rows][o].mean() for o in own]) for v in (x, y))
        return np.arctanh(stats.pearsonr(a, b).statistic)

    whole = z(np.ones(30, bool))
    pseudo = [6 * whole - 5 * z(names != name) for name in "abcdef"]
    test = stats.ttest_1samp(pseudo, 0.0)
    correlation = repeated_correlation(names, x, y)
    assert correlation.people == pytest.approx(tuple(np.tanh(test.confidence_interval(0.95))))
    assert correlation.people_p == pytest.approx(test.pvalue)


def test_subjects_who_are_all_alike_tell_nothing_of_other_people():
    components = repeated_correlation(list("aaabbbccc"), [1.0, 2.0, 3.0] * 3, [1.0, 2.5, 3.1] * 3)
    assert (components.people, components.people_p) == (None, None)
    table = {subject: {0: level, 50: level + 30.0} for subject, level in (("a", 1.0), ("b", 4.0), ("c", 9.0))}
    assert [(mean.low, mean.high) for mean in within_means(table)] == [(None, None)] * 2


def test_subjects_with_one_trial_tell_nothing_of_what_goes_on_within_them():
    who, x, y = list("aaabbbccc"), [1.0, 2.0, 3.0] * 3, [1.0, 2.5, 3.1, 2.0, 2.2, 4.0, 0.0, 1.5, 1.2]
    alone = repeated_correlation(who, x, y)
    more = repeated_correlation([*who, *"defgh"], [*x, 1.0, 2.0, 3.0, 1.0, 2.0], [*y, 5.0, 1.0, 4.0, 2.0, 3.0])
    assert more == alone
    assert alone.subjects == 3
    first = mixed_model(who, y, {"x": x}).term("x")
    second = mixed_model([*who, *"defgh"], [*y, 5.0, 1.0, 4.0, 2.0, 3.0], {"x": [*x, 1.0, 2.0, 3.0, 1.0, 2.0]}).term(
        "x"
    )
    assert (first.high - first.estimate) / (second.high - second.estimate) < 3.0
    one_varies = mixed_model([*"aaabbcc"], [1.0, 2.0, 3.5, 2.0, 2.1, 4.0, 4.2], {"x": [1, 2, 3, 2, 2, 1, 1]})
    assert one_varies == "x varies between the scores of 1 of 3 subjects, and it takes two"


def test_levels_of_subjects_do_not_matter_within_them():
    x, y = [1, 2, 3, 1, 2, 3], [1.0, 2.5, 3.0, 101.0, 102.5, 103.0]
    correlation = repeated_correlation(["a"] * 3 + ["b"] * 3, x, y)
    alone = stats.pearsonr([1, 2, 3], [1.0, 2.5, 3.0]).statistic
    assert correlation.r == pytest.approx(alone)
    assert repeated_correlation(["a", "b"], [1, 2], [1, 2]) is None


def test_of_two_stimuli_the_interval_within_is_the_paired_one_over_the_root_of_two():
    table = {"a": {0: 10.0, 1: 30.0}, "b": {0: 20.0, 1: 35.0}, "c": {0: 50.0, 1: 80.0}, "left out": {0: 5.0}}
    means = within_means(table)
    differences = np.array([20.0, 15.0, 30.0])
    half = stats.t.ppf(0.975, 2) * differences.std(ddof=1) / math.sqrt(2 * 3)
    assert [mean.n for mean in means] == [3, 3]
    assert [mean.mean for mean in means] == pytest.approx([80 / 3, 145 / 3])
    assert [mean.high - mean.mean for mean in means] == pytest.approx([half, half])


def test_scores_that_are_equal_but_for_round_off_tie_and_do_not_vary():
    third = float(np.mean([0.1, 0.2, 0.3]))  # 0.20000000000000004
    assert z_scores({"flat": {0: 0.1, 50: 0.1, 100: 0.1}}) == {}  # the mean of three times 0.1 is not 0.1
    assert z_scores({"repeats": {0: float(np.mean([33.3] * 6)), 50: 33.3, 100: 33.3}}) == {}
    assert differences({"A": {0: 0.1, 50: 0.2}, "B": {0: 0.2, 50: 0.3}, "C": {0: 0.3, 50: 0.4}}) == ()
    near, exact = ({k: {0: a, 50: 0.2, 100: 0.1 * int(k)} for k in "1234"} for a in (third, 0.2))
    assert agreement(near) == agreement(exact)


def test_agreement_is_one_where_all_order_alike_and_kendalls_example_comes_out():
    alike = {str(k): {i: float(i * (k + 1)) for i in range(5)} for k in range(4)}
    concordance = agreement(alike)
    assert concordance.kendall_w == pytest.approx(1.0)
    # Kendall & Babington Smith's form by hand: ranks of three judges over four objects, R = 4, 8, 7, 11; S = 25.
    ranks = {"a": {0: 1, 1: 3, 2: 2, 3: 4}, "b": {0: 1, 1: 2, 2: 4, 3: 3}, "c": {0: 2, 1: 3, 2: 1, 3: 4}}
    concordance = agreement(ranks)
    assert concordance.kendall_w == pytest.approx(12 * 25 / (9 * (64 - 4)))


def test_a_balanced_mixed_model_has_the_slope_and_error_of_the_closed_form():
    rng = np.random.default_rng(4)
    x = np.tile(np.arange(5.0), 12)
    subjects = [f"S{k}" for k in range(12) for _ in range(5)]
    levels = np.repeat(rng.normal(0, 20, 12), 5)
    score = 10.0 + 3.0 * x + levels + rng.normal(0, 4, 60)
    fit = reml_fit(score, np.column_stack([np.ones(60), x]), subjects, random_terms=1)
    # Balanced, with the same x for all: the slope is that of least squares within subjects.
    centred = score - np.repeat(score.reshape(12, 5).mean(axis=1), 5)
    expected = float((x - 2.0) @ centred) / float((x - 2.0) @ (x - 2.0))
    residuals = centred - expected * (x - 2.0)
    residual = math.sqrt(float(residuals @ residuals) / (60 - 12 - 1))
    assert fit.estimates[1] == pytest.approx(expected, rel=1e-6)
    assert fit.within == pytest.approx(residual, rel=1e-3)
    assert fit.errors[1] == pytest.approx(residual / math.sqrt(12 * 10.0), rel=1e-3)
    assert not fit.singular


def test_drift_and_carry_over_are_told_apart_from_the_energy():
    rng = np.random.default_rng(5)
    subjects, sed, place, before, score = [], [], [], [], []
    for k in range(40):
        order = rng.permutation(5)
        for i, index in enumerate(order):
            previous = float(order[i - 1]) if i else 2.0
            subjects.append(str(k))
            sed.append(float(index))
            place.append(float(i))
            before.append(previous)
            score.append(5.0 * index + 1.5 * i - 2.0 * previous + 3.0 * (k % 7) + rng.normal(0, 1))
    model = mixed_model(subjects, score, {"sed": sed, "place": place, "before": before})
    for name, true_value in (("sed", 5.0), ("place", 1.5), ("before", -2.0)):
        assert model.term(name).low < true_value < model.term(name).high
        assert model.term(name).high - model.term(name).low < 0.5


def test_where_nothing_can_be_said_nothing_is():
    assert "too few" in mixed_model(["a"] * 5, [1.0] * 5, {"x": [1.0, 2, 3, 4, 5]})
    assert "does not vary" in mixed_model(["a", "b"] * 5, list(range(10)), {"x": [1.0] * 10})
    assert within_means({"a": {0: 1.0}}) == ()
    assert agreement({}) is None


def test_a_subject_who_missed_a_surface_keeps_its_modulus():
    """Of an exact law of power all subjects agree at one modulus, and ratios of surfaces are those of the law."""
    law, moduli = {0: 0.24, 50: 0.44, 100: 0.67}, {"a": 2.0, "b": 7.0, "c": 40.0}
    logs = {
        name: {i: math.log(modulus * mu**1.5) for i, mu in law.items() if (name, i) != ("c", 100)}
        for name, modulus in moduli.items()
    }
    equal = equal_moduli(logs)
    assert [row[0] for row in equal.values()] == pytest.approx([equal["a"][0]] * 3)
    assert equal["c"][50] - equal["c"][0] == pytest.approx(1.5 * math.log(0.44 / 0.24))
    assert equal["a"][0] == pytest.approx(1.5 * math.log(0.24) + np.mean(np.log(list(moduli.values()))))


def test_standardised_scores_have_no_level_and_equal_moduli_keep_ratios():
    table = {"a": {0: 10.0, 1: 20.0, 2: 40.0}, "b": {0: 1.0, 1: 2.0, 2: 4.0}, "flat": {0: 5.0, 1: 5.0}}
    z = z_scores(table)
    assert list(z) == ["a", "b"]
    assert sum(z["a"].values()) == pytest.approx(0.0)
    assert z["a"][2] == pytest.approx(z["b"][2])
    equal = equal_moduli({name: {index: math.log(table[name][index]) for index in table[name]} for name in "ab"})
    assert equal["a"] == pytest.approx(equal["b"])
    assert equal["a"][2] - equal["a"][0] == pytest.approx(math.log(4.0))


def test_p_values_of_several_comparisons_are_those_of_r_p_adjust_holm():
    # R 4.2: p.adjust(c(0.01, 0.02, 0.03, 0.04, 0.05), "holm"); and c(0.04, 0.001, 0.9, 0.02)
    assert holm([0.01, 0.02, 0.03, 0.04, 0.05]) == pytest.approx([0.05, 0.08, 0.09, 0.09, 0.09])
    assert holm([0.04, 0.001, 0.9, 0.02]) == pytest.approx([0.08, 0.004, 0.9, 0.06])


def test_differences_between_stimuli_are_paired_and_leave_each_subjects_level_out():
    table = {"A": {0: 10.0, 50: 14.0}, "B": {0: 60.0, 50: 66.0}, "C": {0: 30.0, 50: 38.0}, "D": {0: 99.0}}
    (difference,) = differences(table)
    assert (difference.low_index, difference.high_index, difference.n, difference.mean) == (0, 50, 3, 6.0)
    # t(0.975, 2) = 4.302653 times 2 / sqrt(3), by tables
    assert (difference.low, difference.high) == pytest.approx((6.0 - 4.968275, 6.0 + 4.968275), abs=1e-5)
    assert difference.p == pytest.approx(stats.ttest_rel([14.0, 66.0, 38.0], [10.0, 60.0, 30.0]).pvalue)
    assert difference.p_holm == difference.p


# Distance of pituitary to pterygomaxillary fissure of 27 children at 8, 10, 12 and 14 years [mm]: Potthoff & Roy 1964
# (Biometrika 51:313), table 1.
DISTANCE = """26 25 29 31|21.5 22.5 23 26.5|23 22.5 24 27.5|25.5 27.5 26.5 27|20 23.5 22.5 26|24.5 25.5 27 28.5|
22 22 24.5 26.5|24 21.5 24.5 25.5|23 20.5 31 26|27.5 28 31 31.5|23 23 23.5 25|21.5 23.5 24 28|17 24.5 26 29.5|
22.5 25.5 25.5 26|23 24.5 26 30|22 21.5 23.5 25|21 20 21.5 23|21 21.5 24 25.5|20.5 24 24.5 26|23.5 24.5 25 26.5|
21.5 23 22.5 23.5|20 21 21 22.5|21.5 22.5 23 25|23 23 23.5 24|20 21 22 21.5|16.5 19 19 19.5|24.5 25 28 28"""


def children():
    """Return child, distance and age of each visit."""
    rows = [[float(word) for word in part.split()] for part in DISTANCE.split("|")]
    return [str(k) for k in range(27) for _ in range(4)], [*chain(*rows)], [8.0, 10.0, 12.0, 14.0] * 27


def test_the_mixed_model_with_slopes_of_their_own_is_the_published_one():
    # Pinheiro & Bates 2000, Mixed-Effects Models in S and S-PLUS, section 4.2: lme of distance on age - 11.
    child, distance, age = children()
    model = mixed_model(child, distance, {"age": age})
    level, slope = model.term("intercept"), model.term("age")
    t = stats.t.ppf(0.975, 26)
    assert (level.estimate, slope.estimate) == pytest.approx((24.023, 0.66019), abs=6e-4)
    assert ((level.high - level.low) / 2 / t, (slope.high - slope.low) / 2 / t) == pytest.approx(
        (0.42966, 0.07125), abs=6e-6
    )
    assert (model.between_sd, model.slope_sd, model.within_sd) == pytest.approx((2.1343, 0.22643, 1.31004), abs=6e-5)
    assert not model.singular


def offset_by(c, seed=5):
    """Return the model of scores on an SED that lies `c` kPa up and spreads by half of one."""
    rng = np.random.default_rng(seed)
    subjects = [str(k) for k in range(10) for _ in range(5)]
    x = c + np.tile(np.linspace(-0.7, 0.7, 5), 10) * np.repeat(rng.normal(1.0, 0.1, 10), 5)
    place = np.concatenate([rng.permutation(5) for _ in range(10)])
    score = 50.0 + 40.0 * (x - c) + place + np.repeat(rng.normal(0, 3, 10), 5) + rng.normal(0, 5, 50)
    return mixed_model(subjects, score.tolist(), {"sed": x.tolist(), "place": place.tolist()})


def test_an_offset_of_the_predictions_changes_no_number_of_the_model():
    near, far = offset_by(0.0), offset_by(1000.0)
    assert far.middle - near.middle == pytest.approx(1000.0)
    for a, b in zip(near.terms, far.terms, strict=True):
        assert (b.estimate, b.low, b.high) == pytest.approx((a.estimate, a.low, a.high), rel=1e-8)
    assert (far.between_sd, far.slope_sd, far.within_sd) == pytest.approx(
        (near.between_sd, near.slope_sd, near.within_sd), rel=1e-6, abs=1e-6
    )


def restricted_deviance(theta, y, columns, codes):
    """Return -2 log restricted likelihood written out with the whole covariance matrix (Harville 1977)."""
    factor = np.array([[theta[0], 0.0], [theta[1], theta[2]]])
    v = np.eye(len(y)) + (columns[:, :2] @ factor @ factor.T @ columns[:, :2].T) * (codes[:, None] == codes)
    inverse = np.linalg.inv(v)
    information = columns.T @ inverse @ columns
    residuals = y - columns @ np.linalg.solve(information, columns.T @ inverse @ y)
    dof = len(y) - columns.shape[1]
    square = residuals @ inverse @ residuals / dof
    return sum(np.linalg.slogdet(m)[1] for m in (v, information)) + dof * (1.0 + np.log(2.0 * np.pi * square))


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_nothing_is_likelier_than_the_fit_singular_or_not_and_rounding_moves_its_last_bits_alone(seed):
    rng = np.random.default_rng(seed)
    codes = np.repeat(np.arange(10), 5)
    columns = np.column_stack([np.ones(50), np.tile(np.linspace(-1, 1, 5), 10), rng.uniform(-1, 1, 50)])
    y = columns @ [50.0, 30.0, 2.0] + (seed > 2) * np.repeat(rng.normal(0, 5, 10), 5) + rng.normal(0, 4, 50)
    fit, again = (reml_fit(y * (1.0 + step), columns, codes, 2) for step in (0.0, rng.uniform(-1, 1, 50) * 2e-16))
    assert fit.deviance == pytest.approx(
        min(
            optimize.minimize(restricted_deviance, start, (y, columns, codes), "Nelder-Mead", tol=1e-10).fun
            for start in ([1.0, 0.0, 1.0], [0.3, 0.1, 0.1])
        ),
        abs=1e-8,
    )
    for name in ("estimates", "errors", "among"):
        first, second = getattr(fit, name), getattr(again, name)
        assert np.abs(first - second).max() <= 1e-12 * np.abs(first).max()


def test_what_all_subjects_share_has_the_degrees_of_freedom_of_a_fit_to_each_alone():
    rng = np.random.default_rng(7)
    subjects = [*"aaaabbbbcccc", *"defgh"]  # five of one trial: a level each, and no slope
    x, place = rng.normal(size=(2, 17))
    term = mixed_model(subjects, rng.normal(50.0, 9.0, 17), {"x": x, "place": place}).term("place")
    dof = 17 - 8 - 3 - 1  # trials less levels, slopes on x and the slope on the place
    error = (term.high - term.estimate) / stats.t.ppf(0.975, dof)
    assert term.p == pytest.approx(2.0 * stats.t.sf(abs(term.estimate) / error, dof))


def test_where_each_subject_lies_on_a_line_of_its_own_there_is_no_error_to_tell():
    subjects, x = [str(k) for k in range(4) for _ in range(5)], [0.0, 1.0, 2.0, 3.0, 4.0] * 4
    own = [10.0 * int(k) + (1.0 + int(k)) * along for k, along in zip(subjects, x, strict=True)]
    assert "line of their own" in mixed_model(subjects, own, {"x": x})


def test_of_two_stimuli_the_slope_is_the_paired_t_test():
    rng = np.random.default_rng(6)
    y = rng.normal(50.0, 10.0, (7, 1)) + rng.normal([0.0, 10.0], 5.0, (7, 2))
    slope = mixed_model([str(k) for k in range(7) for _ in range(2)], y.ravel(), {"x": [0.0, 1.0] * 7}).term("x")
    test = stats.ttest_1samp(y[:, 1] - y[:, 0], 0.0)
    assert (slope.low, slope.high) == pytest.approx(tuple(test.confidence_interval(0.95)), rel=1e-6)
    assert slope.p == pytest.approx(test.pvalue, rel=1e-6)


@pytest.mark.slow
def test_a_kept_library_comes_to_the_same_model():
    from statsmodels.regression.mixed_linear_model import MixedLM

    child, distance, age = children()
    columns = np.column_stack([np.ones(108), np.array(age) - 11.0])
    theirs = MixedLM(np.array(distance), columns, np.array(child), columns).fit(reml=True, method="lbfgs")
    ours = reml_fit(np.array(distance), columns, child, 2)
    assert ours.estimates == pytest.approx(theirs.fe_params, rel=1e-6)
    assert ours.errors == pytest.approx(theirs.bse_fe, rel=1e-4)
    assert ours.among == pytest.approx(theirs.cov_re, rel=1e-3)


def test_the_spread_of_subjects_has_the_closed_forms_of_its_limits():
    # A mean square alone: chi squared with 9 degrees of freedom, 2.7004 and 19.0228 by tables.
    alone = difference_of_squares(1.0, 9, 0.0, 10**8)
    assert (alone.low, alone.high) == pytest.approx((math.sqrt(9 / 19.0228), math.sqrt(9 / 2.7004)), rel=1e-5)
    # The lower end leaves 0 where an F test tells the two apart: F(0.975; 9, 20) is 2.8365 by tables.
    assert difference_of_squares(2.836, 9, 1.0, 20).low == 0.0
    assert difference_of_squares(2.838, 9, 1.0, 20).low > 0.0


def test_in_a_balanced_design_the_spreads_are_those_of_the_analysis_of_variance():
    rng = np.random.default_rng(3)
    y = rng.normal(0, 4, (10, 5)) + rng.normal(0, 6, (10, 1))
    components = spreads([str(k) for k in range(10) for _ in range(5)], y.ravel().tolist(), [])
    within = ((y - y.mean(axis=1, keepdims=True)) ** 2).sum() / 40
    assert components.left.sd**2 == pytest.approx(within)
    assert components.level.sd**2 == pytest.approx(y.mean(axis=1).var(ddof=1) - within / 5)
    assert components.slope is None
    assert spreads(["a", "a", "b", "b"], [1.0, 2.0, 3.0, 4.0], []) is None
