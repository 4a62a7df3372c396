"""What a study's page shows of choices between two and of estimates."""

from types import SimpleNamespace

import numpy as np

from sessions.report.tables.scales import scale_sentences, scales_table
from sessions.statistics.pooled import choices, constant_stimuli, exponent
from sessions.statistics.scales import MODELS, Choice, consistence, paired_scale


def descriptor(answers, result=None):
    return SimpleNamespace(
        descriptor="stickiness",
        indices=(0, 50, 100),
        scales=tuple(paired_scale(answers, model) for model in MODELS),
        consistence=consistence(answers),
        exponent=result,
    )


def answers_of(subjects, seed):
    rng = np.random.default_rng(seed)
    value = {0: -0.6, 50: 0.0, 100: 0.6}
    return [
        Choice(f"P{n}", a, b, bool(rng.normal(value[a] - value[b] + 0.2, 1.0) > 0.0))
        for n in range(subjects) for a in value for b in value if a != b
    ]  # fmt: skip


def test_each_surface_has_a_row_with_both_values_and_their_intervals_and_the_first_s_advantage_comes_last():
    table = scales_table([descriptor(answers_of(40, 1))])
    rows = table.groups[0].rows
    assert [row[0].text for row in rows] == ["0", "50", "100", "first of two"]
    assert all(len(row) == 3 for row in rows)
    assert not table.notes
    (fit, _) = scale_sentences(descriptor(answers_of(40, 1)))
    assert "Bradley–Terry" in fit
    assert "on 3 degrees of freedom" in fit  # six ordered pairs, two values and the first's advantage


def test_without_a_finite_scale_the_rows_have_the_reason():
    always = [Choice(f"P{n}", a, b, a > b) for n in range(4) for a in (0, 50, 100) for b in (0, 50, 100) if a != b]
    table = scales_table([descriptor(always)])
    assert any("preferred to 100" in note for note in map(str, table.notes))
    assert scale_sentences(descriptor(always)) == [
        "Stickiness: 4 of 4 subjects chose by one order without a circle; mean coefficient of consistence 1.00."
    ]


def row(subject, **values):
    visit = SimpleNamespace(subject=subject)
    return visit, SimpleNamespace(
        **{"choice": None, "before": None, "standard": None, "estimate": None, "mu": None, **values}
    )


def test_a_choice_is_between_the_surface_of_its_trial_and_the_one_before():
    trials = [row("P1", index=20), row("P1", index=80, before=20, choice="first"), row("P1", index=50, choice="second")]
    assert choices(trials) == [Choice("P1", 20, 80, True)]


def test_a_choice_against_a_standard_is_of_no_scale_but_of_a_psychometric_function():
    trials = [row("P1", index=20), row("P1", index=80, before=20, choice="first", standard=80)]
    assert choices(trials) == []
    assert list(
        constant_stimuli([(SimpleNamespace(subject="P1", session="a"), trial) for _, trial in trials]).functions
    ) == ["P1"]


def test_estimates_without_friction_have_no_exponent_and_say_why():
    assert exponent([row("P1", index=1)]) is None
    result = exponent([row("P1", index=1, estimate=3.0)])
    assert "no trial has both" in result.reason
    table = SimpleNamespace(descriptor="stickiness", scales=(), consistence={}, exponent=result)
    assert scale_sentences(table)[0].startswith("Stickiness: no exponent of the estimates by µ")
