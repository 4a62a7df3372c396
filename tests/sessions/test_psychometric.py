"""Psychometric functions: against R's probit, psignifit, another maximiser, and simulated observers."""

import math

import numpy as np
import pytest
from scipy import optimize, special, stats

from sessions.statistics import psychometric as module
from sessions.statistics.psychometric import QUARTILE, Level, psychometric

# Brightness of a light by one of 35 units (Gegenfurtner 1992, Behav. Res. Methods 24, 560): level, presented, brighter.
BRIGHTNESS = ((10, 49, 2), (20, 48, 3), (30, 48, 13), (40, 50, 31), (50, 47, 38), (60, 49, 48))
SCATTERED = ((-0.6, 1), (-0.4, 4), (-0.2, 3), (-0.1, 10), (0.1, 12), (0.2, 10), (0.4, 19), (0.6, 18))  # of 20 each


def brightness():
    return [Level(float(at), brighter, presented) for at, presented, brighter in BRIGHTNESS]


def scattered():
    return [Level(at, choices, 20) for at, choices in SCATTERED]


def test_without_lapses_the_function_is_the_probit_that_r_prints(monkeypatch):
    # R: glm(cbind(Yes, Trial - Yes) ~ Intensity, binomial(link = "probit")) prints -2.874139, 0.077472, deviance 2.8119
    monkeypatch.setattr(module, "MOST_LAPSES", 0.0)
    fit = psychometric(brightness())
    assert fit.pse.value == pytest.approx(2.874139 / 0.077472, abs=3e-4)
    assert fit.jnd.value == pytest.approx(0.6744898 / 0.077472, abs=1e-4)
    assert fit.deviance == pytest.approx(2.8119, abs=5e-5)
    assert (fit.freedom, fit.lapse.value, fit.correlation.value, fit.answers) == (4, 0.0, 0.0, 291)


@pytest.mark.parametrize(
    ("levels", "pse", "jnd", "lapse", "correlation"),
    [  # psignifit 4.3: experiment_type="equal asymptote", sigmoid="norm", flat priors, its MAP in these terms
        (brightness(), 37.40263, 7.58846, 0.041513, 0.0),
        (scattered(), 0.025836, 0.249896, 0.040744, 0.005152),
    ],
)
def test_with_lapses_and_scatter_the_function_is_the_one_that_psignifit_finds(levels, pse, jnd, lapse, correlation):
    fit = psychometric(levels)
    assert fit.pse.value == pytest.approx(pse, rel=5e-4)
    assert fit.jnd.value == pytest.approx(jnd, rel=5e-4)
    assert fit.lapse.value == pytest.approx(lapse, rel=2e-3)
    assert fit.correlation.value == pytest.approx(correlation, abs=2e-5)


def loss(at, levels):
    """Return what another likelihood of beta-binomial answers falls short of 0 by."""
    pse, slope, lapse, correlation = at
    if not (0.0 <= lapse <= 0.5 and 0.0 < correlation < 0.5):
        return 1e9
    beta = (1.0 - correlation) / correlation
    total = 0.0
    for level in levels:
        p = lapse / 2.0 + (1.0 - lapse) * stats.norm.cdf(slope * (level.log_ratio - pse))
        total -= stats.betabinom.logpmf(level.choices, level.presented, p * beta, (1.0 - p) * beta)
    return total


def test_the_estimate_is_where_another_maximiser_finds_the_beta_binomial_likelihood_greatest():
    fit = psychometric(scattered())
    best = optimize.minimize(
        loss, [0.0, 3.0, 0.05, 0.01], (scattered(),), method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-11}
    )
    assert [
        fit.pse.value, QUARTILE / fit.jnd.value, fit.lapse.value, fit.correlation.value
    ] == pytest.approx(best.x, rel=1e-4)  # fmt: skip
    coefficient = sum(math.log(math.comb(level.presented, level.choices)) for level in scattered())
    assert fit.log_likelihood + coefficient == pytest.approx(-best.fun, abs=1e-7)


@pytest.mark.parametrize(
    ("answers", "at"),
    [  # log ratio, chosen, presented, order; and pse, slope, order, lapse, theta that another search found
        (
            [(-0.449, 0, 4, 0), (-0.428, 0, 14, 0), (-0.381, 0, 8, 0), (-0.302, 1, 9, 0), (-0.271, 0, 16, 0),
             (0.055, 1, 7, 0)],
            (0.43034, 2.72956, 0.0, 0.0, 1e-6),
        ),
        (
            [(-0.484, 0, 19, 1), (-0.484, 0, 16, -1), (-0.134, 0, 8, 1), (-0.134, 3, 17, -1), (0.181, 12, 19, 1),
             (0.181, 5, 14, -1), (0.251, 14, 14, 1), (0.251, 17, 17, -1), (0.401, 12, 14, 1), (0.401, 16, 16, -1)],
            (0.181275, 270.713, 0.00131396, 0.0676787, 0.0577828),
        ),
    ],
)  # fmt: skip
def test_of_several_maxima_the_greatest_is_found(answers, at):
    pse, slope, order, lapse, theta = at
    x, choices, presented, side = np.array(answers).T
    p = lapse / 2.0 + (1.0 - lapse) * stats.norm.cdf(slope * (x - pse + order * side))
    likelihood = stats.betabinom.logpmf(choices, presented, p / theta, (1.0 - p) / theta).sum()
    fit = psychometric([Level(*answer) for answer in answers])
    assert fit.log_likelihood + np.log(special.binom(presented, choices)).sum() >= likelihood - 1e-5


def test_an_end_of_an_interval_is_where_the_likelihood_adjusted_for_three_fitted_parameters_has_dropped():
    def adjusted(at):  # of cells of 20 answers: correlated answers tell less by 1 + 19 times their correlation
        return loss(at, scattered()) - 1.5 * math.log(1.0 + 19.0 * at[3])

    def least(fixed=()):
        minimum = optimize.minimize(
            lambda at: adjusted([*fixed, *at]), [0.0, 3.0, 0.05, 0.02][len(fixed) :], method="Nelder-Mead",
            options={"xatol": 1e-8, "fatol": 1e-11, "maxiter": 4000},
        )  # fmt: skip
        return minimum.fun

    # Five cells are left: Student's interval of a mean is where n ln(1 + t^2 / n) has been lost.
    fall = 2.5 * math.log(1.0 + stats.t.ppf(0.975, 5) ** 2 / 5.0)
    assert least([psychometric(scattered()).pse.high]) - least() == pytest.approx(fall, abs=5e-3)


def observer(rng, ratios, each, truth, correlation=0.0):
    """Return the answers of an observer to `each` presentations of every ratio in either order."""
    pse, spread, lapse, order = truth
    levels = []
    for ratio in ratios:
        for side in (-1, 1):
            p = lapse / 2.0 + (1.0 - lapse) * special.ndtr((ratio - pse + order * side) / spread)
            if correlation:
                beta = (1.0 - correlation) / correlation
                p = rng.beta(p * beta, (1.0 - p) * beta)
            levels.append(Level(ratio, int(rng.binomial(each, p)), each, side))
    return levels


SIX = (-0.45, -0.3, -0.15, 0.15, 0.3, 0.45)
STICKY = tuple(math.log(mu / 0.48) for mu in (0.28, 0.44, 0.64, 0.67))  # of the paper's surfaces by index 50


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ratios", "lapse", "correlation"), [(SIX, 0.04, 0.0), (SIX, 0.0, 0.0), (STICKY, 0.04, 0.0), (SIX, 0.04, 0.05)]
)
def test_intervals_hold_the_values_of_simulated_observers_in_90_to_98_of_a_hundred(ratios, lapse, correlation):
    parameters, coverage, fits = (0.05, 0.25, lapse, 0.04), np.zeros(4), 0
    for study in range(200):
        fit = psychometric(observer(np.random.default_rng([5, study]), ratios, 10, parameters, correlation))
        if fit.reason:
            continue
        fits += 1
        truth = (parameters[0], parameters[1] * QUARTILE, parameters[2], parameters[3])
        ends = (fit.pse, fit.jnd, fit.lapse, fit.order)
        coverage += [
            (level.low is None or level.low <= true) and (level.high is None or true <= level.high)
            for level, true in zip(ends, truth, strict=True)
        ]
    assert fits >= 198
    assert 0.90 <= coverage.sum() / (4 * fits) <= 0.98


def test_an_observer_who_says_the_opposite_has_the_same_pse_and_jnd():
    levels = observer(np.random.default_rng(1), SIX, 40, (0.05, 0.25, 0.02, 0.0))
    forward = psychometric(levels)
    opposite = psychometric([Level(v.log_ratio, v.presented - v.choices, v.presented, v.order) for v in levels])
    assert (forward.rises, opposite.rises) == (True, False)
    for name in ("pse", "jnd", "lapse"):
        assert getattr(opposite, name).value == pytest.approx(getattr(forward, name).value, abs=1e-5)


@pytest.mark.parametrize(
    ("levels", "reason"),
    [
        ([], "takes 3 comparisons"),
        ([Level(-0.2, 2, 10), Level(0.2, 8, 10)], "takes 3 comparisons"),
        ([Level(x, 5, 10) for x in SIX], "hardly depend on friction"),
        ([Level(x, 10, 10) for x in SIX], "hardly depend on friction"),
    ],
)
def test_answers_that_fix_no_function_say_why(levels, reason):
    fit = psychometric(levels)
    assert fit.pse is None
    assert reason in fit.reason


def test_answers_that_step_between_two_levels_bound_the_jnd_above_and_the_pse_on_both_sides():
    fit = psychometric([Level(x, 10 * (x > 0.0), 10) for x in SIX])
    assert (fit.jnd.value, fit.jnd.low) == (0.0, 0.0)

    # Ten answers all right, as likely as may be: a beta law of uniform shape, Γ(p + 10) / (Γ(p) 10!) at p = Φ(slope x)
    def loss(slope):
        p = stats.norm.cdf(slope * np.array(SIX[3:]))
        return -2.0 * np.sum(special.gammaln(p + 10) - special.gammaln(p) - special.gammaln(11))

    fall = 1.5 * math.log(1.0 + stats.f.ppf(0.95, 1, 3) / 3.0)  # six levels, three parameters
    slope = optimize.brentq(lambda at: loss(at) - fall, 1.0, 50.0)
    assert fit.jnd.high == pytest.approx(QUARTILE / slope, rel=0.01)
    assert -0.3 < fit.pse.low < -0.14 < 0.14 < fit.pse.high < 0.3


def test_a_jnd_that_the_answers_do_not_bound_has_no_upper_end(monkeypatch):
    monkeypatch.setattr(module, "MOST_LAPSES", 0.0)
    fit = psychometric([Level(-0.3, 3, 10), Level(-0.1, 4, 10), Level(0.1, 6, 10), Level(0.3, 7, 10)])
    assert fit.jnd.high is None
    assert fit.jnd.low > 0.0


def test_answers_that_are_single_or_all_one_way_tell_no_scatter():
    """A step has the same likelihood, 1, whatever the scatter; one answer has no other to go with."""
    sides = [(x, side) for x in (-0.4, -0.2, 0.2, 0.4) for side in (1, -1)]
    step = psychometric([Level(x, 10 * (x > 0.0), 10, side) for x, side in sides])
    single = psychometric([Level(x, int(x > 0.0), 1) for x, side in sides if side > 0])
    assert (step.correlation, single.correlation) == (None, None)
    assert step.pse is not None
    assert psychometric([Level(x, 2 + 6 * (x > 0.0), 10, side) for x, side in sides]).correlation is not None


def test_an_order_at_the_end_of_what_was_searched_is_bounded_on_one_side():
    fit = psychometric([Level(x, 10 * (side > 0), 10, side) for x in (-0.4, -0.2, 0.2, 0.4) for side in (1, -1)])
    assert fit.order.low is None
    assert fit.order.high < 0.0
