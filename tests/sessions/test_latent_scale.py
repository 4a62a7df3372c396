"""One latent scale: judgements of every kind, made of the same values, give those values in Thurstone's unit."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sessions.report.tables.scales import latent_table
from sessions.statistics.findings import ConstantStimuli
from sessions.statistics.pooled import latent_scales
from sessions.statistics.psychometric import QUARTILE
from sessions.statistics.scales import JUDGEMENTS, Choice, latent_comparisons, latent_judgements, paired_scale
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
    rows = [(subject, {"index": i, "score": 50.0 + 12.0 * x}) for subject, i, x in judgements(rng, people)]
    rows += [(subject, {"index": i, "estimate": math.exp(0.3 * x)}) for subject, i, x in judgements(rng, people, 3)]
    rows += [
        (subject, {"index": i, "standard": 50, "mu": math.exp(v / PER_LOG_MU)})
        for subject in ("P0",)
        for i, v in VALUES.items()
    ]
    choices = [
        Choice(f"P{n}", a, b, bool(VALUES[a] - VALUES[b] > rng.standard_normal()))
        for n in range(people) for a in VALUES for b in VALUES if a != b
    ]  # fmt: skip
    blank = {"score": None, "estimate": None, "standard": None, "mu": None}
    trials = [(SimpleNamespace(subject=subject), SimpleNamespace(**{**blank, **row})) for subject, row in rows]
    jnds = [math.log(QUARTILE / PER_LOG_MU) + rng.normal(0.0, 0.2) for _ in range(people)]
    return latent_scales(trials, [paired_scale(choices, "Thurstone V")], ConstantStimuli({}, None, average(jnds)))


def test_every_kind_of_judgement_recovers_the_true_values_in_one_unit():
    scales = study(np.random.default_rng(4), 60)
    assert tuple(scales) == JUDGEMENTS
    for values in scales.values():
        assert {index: estimate.value for index, estimate in values.items()} == pytest.approx(VALUES, abs=0.2)
        assert all(estimate.low < estimate.value < estimate.high or index == 20 for index, estimate in values.items())


@pytest.mark.parametrize("people", [3, 5, 12])
def test_intervals_of_scores_hold_the_true_values(people):
    rng = np.random.default_rng(11)
    coverage = []
    for _ in range(100):
        scale = latent_judgements(judgements(rng, people, 2))
        coverage += [estimate.low <= VALUES[index] <= estimate.high for index, estimate in scale.items()]
    assert 0.92 <= np.mean(coverage) <= 0.99  # three standard errors of 500


def test_a_choice_of_unit_or_of_level_changes_no_latent_value():
    points = judgements(np.random.default_rng(2), 8)
    rescaled = [(subject, index, 7.0 * x + (40.0 if subject == "P1" else -3.0)) for subject, index, x in points]
    for index, estimate in latent_judgements(points).items():
        other = latent_judgements(rescaled)[index]
        assert (other.value, other.low, other.high) == pytest.approx((estimate.value, estimate.low, estimate.high))


def test_one_just_noticeable_difference_is_0_674():
    scale = latent_comparisons({0: 0.4, 100: 0.5}, (math.log(math.log(1.25)),) * 3)
    assert scale[100].value - scale[0].value == pytest.approx(0.6745, abs=1e-4)


def test_too_few_people_and_answers_that_do_not_scatter_have_no_latent_scale():
    assert latent_judgements(judgements(np.random.default_rng(1), 2)) == {}
    assert latent_judgements([(f"P{n}", index, value) for n in range(5) for index, value in VALUES.items()]) == {}


def test_the_table_lays_all_kinds_beside_the_scores_and_is_left_out_of_scores_alone():
    latent = study(np.random.default_rng(4), 20)
    means = tuple(SimpleNamespace(index=index, mean=50.0 + 12.0 * value) for index, value in VALUES.items())
    finding = SimpleNamespace(descriptor="stickiness", scores=means, indices=tuple(VALUES), latent=latent)
    table = latent_table([finding])
    assert [column.name for column in table.columns[1:]] == ["mean score", *(f"by {kind}" for kind in JUDGEMENTS)]
    assert [row[0].text for row in table.groups[0].rows] == [str(index) for index in VALUES]
    assert all(cell.interval for row in table.groups[0].rows for cell in row[2:])
    finding.latent = {"scores": latent["scores"]}
    assert latent_table([finding]) is None
