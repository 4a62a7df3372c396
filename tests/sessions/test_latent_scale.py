"""One latent scale: judgements of every kind, made of the same values, give those values in Thurstone's unit."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sessions.report.tables.scales import latent_table
from sessions.statistics.findings import ConstantStimuli
from sessions.statistics.pooled import latent_scales
from sessions.statistics.psychometric import QUARTILE
from sessions.statistics.scales import JUDGEMENTS, Choice, of_comparisons, of_judgements, paired_scale
from sessions.statistics.scores import average

VALUES = {0: -1.2, 20: -0.5, 50: 0.1, 80: 0.4, 100: 1.2}  # mean 0
SCATTER = math.sqrt(0.5)  # of one judgement: the difference of two scatters by 1
PER_LOG_MU = 5.0  # latent values by log µ


def judgements(rng, people, repeats=1):
    """Subject, index and judgement about a level of the subject's own."""
    return [
        (f"P{n}", index, level + value + SCATTER * rng.standard_normal())
        for n in range(people)
        for level in [rng.normal(0.0, 3.0)]
        for _ in range(repeats)
        for index, value in VALUES.items()
    ]


def study(rng, people):
    """The trials of people who score, estimate and choose, and compare with a standard."""
    rows = [(who, {"index": i, "score": 50.0 + 12.0 * x}) for who, i, x in judgements(rng, people)]
    rows += [(who, {"index": i, "estimate": math.exp(0.3 * x)}) for who, i, x in judgements(rng, people, 3)]
    rows += [
        (who, {"index": i, "standard": 50, "mu": math.exp(v / PER_LOG_MU)})
        for who in ("P0",)
        for i, v in VALUES.items()
    ]
    chosen = [
        Choice(f"P{n}", a, b, bool(VALUES[a] - VALUES[b] > rng.standard_normal()))
        for n in range(people) for a in VALUES for b in VALUES if a != b
    ]  # fmt: skip
    blank = {"score": None, "estimate": None, "standard": None, "mu": None}
    trials = [(SimpleNamespace(subject=who), SimpleNamespace(**{**blank, **row})) for who, row in rows]
    jnds = [math.log(QUARTILE / PER_LOG_MU) + rng.normal(0.0, 0.2) for _ in range(people)]
    return latent_scales(trials, [paired_scale(chosen, "Thurstone V")], ConstantStimuli({}, None, average(jnds)))


def test_every_kind_of_judgement_finds_the_planted_values_in_one_unit():
    found = study(np.random.default_rng(4), 60)
    assert tuple(found) == JUDGEMENTS
    for values in found.values():
        assert {index: one.value for index, one in values.items()} == pytest.approx(VALUES, abs=0.2)
        assert all(one.low < one.value < one.high or index == 20 for index, one in values.items())


@pytest.mark.parametrize("people", [3, 5, 12])
def test_intervals_of_scores_hold_the_planted_values(people):
    rng = np.random.default_rng(11)
    held = []
    for _ in range(100):
        found = of_judgements(judgements(rng, people, 2))
        held += [one.low <= VALUES[index] <= one.high for index, one in found.items()]
    assert 0.92 <= np.mean(held) <= 0.99  # three standard errors of 500


def test_a_choice_of_unit_or_of_level_changes_no_latent_value():
    points = judgements(np.random.default_rng(2), 8)
    other = [(who, index, 7.0 * x + (40.0 if who == "P1" else -3.0)) for who, index, x in points]
    for index, one in of_judgements(points).items():
        again = of_judgements(other)[index]
        assert (again.value, again.low, again.high) == pytest.approx((one.value, one.low, one.high))


def test_one_just_noticeable_difference_is_0_674():
    found = of_comparisons({0: 0.4, 100: 0.5}, (math.log(math.log(1.25)),) * 3)
    assert found[100].value - found[0].value == pytest.approx(0.6745, abs=1e-4)


def test_too_few_people_and_answers_that_do_not_scatter_have_no_latent_scale():
    assert of_judgements(judgements(np.random.default_rng(1), 2)) == {}
    assert of_judgements([(f"P{n}", index, value) for n in range(5) for index, value in VALUES.items()]) == {}


def test_the_table_lays_all_kinds_beside_the_scores_and_is_left_out_of_scores_alone():
    latent = study(np.random.default_rng(4), 20)
    means = tuple(SimpleNamespace(index=index, mean=50.0 + 12.0 * value) for index, value in VALUES.items())
    one = SimpleNamespace(descriptor="stickiness", scores=means, indices=tuple(VALUES), latent=latent)
    shown = latent_table([one])
    assert [column.name for column in shown.columns[1:]] == ["mean score", *(f"by {kind}" for kind in JUDGEMENTS)]
    assert [row[0].text for row in shown.groups[0].rows] == [str(index) for index in VALUES]
    assert all(cell.interval for row in shown.groups[0].rows for cell in row[2:])
    one.latent = {"scores": latent["scores"]}
    assert latent_table([one]) is None
