"""Scales from choices between two: against a textbook's season of baseball, another maximiser, and known values."""

import math

import numpy as np
import pytest
from scipy import optimize, stats

from sessions.statistics.scales import Choice, consistence, paired_scale

# Games of the American League East in 1987: home team in the row, its wins and losses against the team of the column
# (Agresti 2002, Categorical Data Analysis, 2nd ed., Table 10.11).
TEAMS = ("Milwaukee", "Detroit", "Toronto", "New York", "Boston", "Cleveland", "Baltimore")
SEASON = (
    (None, (4, 3), (4, 2), (4, 3), (6, 1), (4, 2), (6, 0)),
    ((3, 3), None, (4, 2), (4, 3), (6, 0), (6, 1), (4, 3)),
    ((2, 5), (4, 3), None, (2, 4), (4, 3), (4, 2), (6, 0)),
    ((3, 3), (5, 1), (2, 5), None, (4, 3), (4, 2), (6, 1)),
    ((5, 1), (2, 5), (3, 3), (4, 2), None, (5, 2), (6, 0)),
    ((2, 5), (3, 3), (3, 4), (4, 3), (4, 2), None, (2, 4)),
    ((2, 5), (1, 5), (1, 6), (2, 4), (1, 6), (3, 4), None),
)


def season():
    return [
        Choice("league", home, away, won)
        for home, row in enumerate(SEASON)
        for away, games in enumerate(row)
        if games is not None
        for won, count in zip((True, False), games, strict=True)
        for _ in range(count)
    ]


def test_a_season_of_baseball_has_the_printed_abilities_and_home_advantage():
    scale = paired_scale(season())
    worth = np.exp([scale.values[n].value for n in range(7)])
    # Agresti's Table 10.11, column 5, and his 0.302 for the home team
    assert (worth / worth.sum()).round(3).tolist() == [0.220, 0.190, 0.164, 0.157, 0.137, 0.088, 0.044]
    assert round(scale.first.value, 3) == 0.302
    assert scale.first.low is None
    assert "needs 3" in scale.interval_reason


@pytest.mark.parametrize("model", ["Bradley–Terry", "Thurstone V"])
def test_the_values_are_where_a_general_maximiser_finds_the_likelihood_greatest(model):
    cdf = stats.logistic.cdf if model == "Bradley–Terry" else stats.norm.cdf
    choices = season()

    def loss(beta):
        values = np.append(beta[:6], -beta[:6].sum())
        chance = cdf([values[c.first] - values[c.second] + beta[6] for c in choices])
        return -np.sum(np.log(np.where([c.first_chosen for c in choices], chance, 1.0 - chance)))

    best = optimize.minimize(loss, np.zeros(7), method="BFGS", options={"gtol": 1e-9}).x
    scale = paired_scale(choices, model)
    assert [scale.values[n].value for n in range(6)] == pytest.approx(best[:6], abs=1e-6)
    assert scale.first.value == pytest.approx(best[6], abs=1e-6)
    own = sum(
        n * math.log(n / sum(games))
        for row in SEASON for games in row if games is not None for n in games if n
    )  # fmt: skip
    assert scale.deviance == pytest.approx(2.0 * (loss(best) + own), abs=1e-6)
    assert scale.freedom == 42 - 7


def random_choices(rng, values, first, subjects, spread=0.0, repeats=1):
    """Return choices of subjects who compare every pair in each order, by Thurstone's law."""
    choices = []
    for subject in range(subjects):
        own = values + rng.normal(0.0, spread, len(values))
        for a in range(len(values)):
            for b in range(len(values)):
                for _ in range(repeats * (a != b)):
                    first_chosen = rng.normal(own[a] - own[b] + first, 1.0) > 0.0
                    choices.append(Choice(f"P{subject}", a, b, bool(first_chosen)))
    return choices


@pytest.mark.parametrize(("subjects", "repeats"), [(4, 3), (20, 1)])
def test_intervals_hold_true_values_in_90_to_98_of_a_hundred(subjects, repeats):
    values, first = np.array([-0.8, -0.3, 0.0, 0.4, 0.7]), 0.2
    coverage, studies = np.zeros(6), 60
    for study in range(studies):
        rng = np.random.default_rng([11, study])
        scale = paired_scale(random_choices(rng, values, first, subjects, 0.2, repeats), "Thurstone V")
        # people of different scales make the mean chance flatter: 1 / sqrt(1 + 2 spread^2) of the values
        truth = np.append(values, first) / math.sqrt(1.0 + 2.0 * 0.2**2)
        ends = [*scale.values.values(), scale.first]
        coverage += [interval.low <= true <= interval.high for interval, true in zip(ends, truth, strict=True)]
    assert 0.90 <= coverage.sum() / (6 * studies) <= 0.98


def test_a_surface_that_was_always_chosen_has_no_finite_value_and_is_named():
    always = [Choice("P1", 0, 1, True), Choice("P1", 1, 2, True), Choice("P1", 2, 1, True), Choice("P2", 2, 0, False)]
    scale = paired_scale(always)
    assert not scale.values
    assert "preferred to 0," in scale.reason
    assert paired_scale([]).reason


def test_pairs_that_were_each_compared_once_make_a_scale():
    games = [(0, 1, True), (2, 1, False), (2, 3, True), (0, 3, False), (0, 2, True), (3, 1, False)]
    values = paired_scale([Choice("P1", *game) for game in games]).values
    # 0 and 1 won two of three: 1/2 between them and 3/4 against each of the others are as many
    assert values[0].value == pytest.approx(values[1].value)
    assert values[1].value - values[2].value == pytest.approx(math.log(3.0))


def test_preference_is_not_told_from_order_where_one_surface_was_always_first():
    star = [Choice("P1", 0, other, won) for other in (20, 50) for won in (True, False, True)]
    scale = paired_scale(star)
    assert not scale.values
    assert "in both orders" in scale.reason


def test_a_circle_of_three_is_one_triad_and_an_order_none():
    order = [Choice("P1", a, b, True) for a in range(5) for b in range(a + 1, 5)]
    assert consistence(order)["P1"].zeta == 1.0
    circle = [Choice("P2", 0, 1, True), Choice("P2", 1, 2, True), Choice("P2", 0, 2, False)]
    consistency = consistence(circle)["P2"]
    assert (consistency.triads, consistency.most, consistency.zeta) == (1, 1, 0.0)
    # A regular tournament of seven has 14 circular triads, as many as there can be (Kendall and Babington Smith 1940)
    regular = [Choice("P3", a, (a + step) % 7, True) for a in range(7) for step in (1, 2, 3)]
    assert (consistence(regular)["P3"].triads, consistence(regular)["P3"].zeta) == (14, 0.0)
    # Of four, one beats two and the other pair likewise: two circular triads, the most there can be (same source)
    even = [Choice("P4", a, b, True) for a, b in ((0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3))]
    assert (consistence(even)["P4"].triads, consistence(even)["P4"].zeta) == (2, 0.0)
    assert not consistence([*circle, Choice("P2", 1, 0, True)])  # a pair chosen once each way
