"""What a study's page shows of choices between two and of estimates."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sessions.report.tables.scales import psychometric_sentences, psychometric_table, scale_sentences, scales_table
from sessions.statistics.pooled import choices, constant_stimuli, exponent, latent_scales
from sessions.statistics.psychometric import Psychometric
from sessions.statistics.scales import MODELS, Choice, consistence, paired_scale
from sessions.statistics.scores import Average, IntervalEstimate


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
    assert fit.endswith(", by chi squared: few answers to a pair make p too small or too great.")


def test_subjects_with_a_tied_pair_are_counted_beside_those_with_a_coefficient_of_consistence():
    pairs = [(a, b) for a in (0, 50, 100) for b in (0, 50, 100) if a != b]
    answers = [Choice(f"P{n}", a, b, a > b) for n in range(2) for a, b in pairs]
    answers += [Choice("P9", a, b, first_chosen=True) for a, b in pairs]  # the first each time: every pair is tied
    assert scale_sentences(descriptor(answers))[-1] == (
        "Stickiness: of 3 subjects 2 compared every pair without a tie, and 2 of these chose by one order without a "
        "circle; mean coefficient of consistence 1.00."
    )


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


def test_the_interval_of_an_exponent_holds_the_true_one_with_and_without_errors_of_mu():
    rng, moduli, mu = np.random.default_rng(0), (2.0, 7.0, 40.0, 11.0), {1: 0.3, 2: 0.5, 3: 0.8}
    estimates = [
        row(f"P{subject}", index=index, mu=friction, estimate=modulus * friction**1.5 * float(rng.lognormal(0, 0.05)))
        for subject, modulus in enumerate(moduli)
        for index, friction in mu.items()
    ]
    table = SimpleNamespace(descriptor="stickiness", scales=(), consistence={}, exponent=exponent(estimates))
    (sentence,) = scale_sentences(table)
    interval = r"([\d.]+) \((?:95 % interval )?([\d.]+) to ([\d.]+)\)"
    numbers = re.fullmatch(
        f"Stickiness: if estimates are a power of µ, its exponent by 12 trials of 4 subjects is {interval} with µ "
        "taken as exact, "
        rf"{interval} with errors in both\.",
        sentence,
    )
    for value, low, high in np.reshape([float(number) for number in numbers.groups()], (2, 3)):
        assert low < value < high
        assert low < 1.5 < high < low + 0.3


def test_a_subject_with_an_estimate_of_zero_counts_for_no_exponent_and_for_no_latent_value():
    """A zero left out alone would raise that subject's least surface, and flatten the law of the others."""
    rng = np.random.default_rng(2)
    trials = [
        row(
            f"P{subject}", index=index, mu=0.2 + 0.005 * index, estimate=float((0.2 + 0.005 * index) * rng.lognormal(1))
        )
        for subject in range(5)
        for index in (0, 20, 50, 80, 100)
        for _ in range(2)
    ]
    for _, trial in trials:
        trial.score = None
    zero = [(visit, trial) for visit, trial in trials if visit.subject == "P0"]
    other_trials = [(visit, trial) for visit, trial in trials if visit.subject != "P0"]
    zero[0][1].estimate = 0.0
    assert exponent(trials) == exponent(other_trials)
    assert latent_scales(trials, (), None) == latent_scales(other_trials, (), None)


def logs(*ratios):
    return IntervalEstimate(*(None if ratio is None else math.log(ratio) for ratio in ratios))


PSE = logs(1.25, 1.1, 1.5)


@pytest.mark.parametrize(
    ("jnd", "words"),
    [
        (logs(1.18, 1.1, 1.27), "18 % of it (10 to 27)"),
        (logs(1.18, 1.1, None), "above 10 % of it"),
        (logs(1.0, None, 1.27), "below 27 % of it"),
        (logs(1.18, None, 1.27), "bounded on neither side"),
    ],
)
def test_equal_and_just_noticeable_friction_of_one_subject_are_reported_in_ratios_of_mu(jnd, words):
    function = Psychometric(40, PSE, jnd, IntervalEstimate(0.04, None, None), rises=False)
    equal, falling = psychometric_sentences(("friction", {"S1": function}, (None, None)))
    assert equal == (
        "Friction: by 40 answers the surface felt equal to the standard has 1.25 (95 % interval 1.10 to 1.50) "
        f"times its µ; the just noticeable difference is {words}, with 4 % lapses."
    )
    assert falling == "Friction: 1 of 1 subject chose the surface of less µ more often."


def test_means_over_subjects_are_geometric_and_stand_in_the_last_row():
    function = Psychometric(40, PSE, logs(1.18, 1.1, 1.27), IntervalEstimate(0.04, 0.0, 0.11))
    refusal = Psychometric(9, reason="too few")
    pse = Average(2, math.log(1.2), 0.1, math.log(1.1), math.log(1.3))
    low, middle, high = (math.log(math.log(ratio)) for ratio in (1.1, 1.15, 1.2))
    results = ("friction", {"S1": function, "S2": function, "S3": refusal}, (pse, Average(2, middle, 0.1, low, high)))
    assert psychometric_sentences(results) == [
        "Friction: over 2 of 3 subjects the surface felt equal to the standard has 1.20 (95 % interval 1.10 to 1.30) "
        "times its µ; over 2 the just noticeable difference is 15 % of it (10 to 20)."
    ]
    steps = ("friction", dict.fromkeys(("S1", "S2"), function), (replace(pse, n=2), None))
    assert psychometric_sentences(steps)[0].endswith(
        " 1.20 (95 % interval 1.10 to 1.30) times its µ; every subject's answers step between two comparisons, "
        "so no just noticeable difference is above 0."
    )
    some = ("friction", dict.fromkeys(("S1", "S2"), function), (pse, Average(1, middle, None, None, None)))
    assert psychometric_sentences(some)[0].endswith(
        "over the 1 whose just noticeable difference is above 0 it is 15 % of it, too great for all 2."
    )
    first, _, withheld, mean = psychometric_table([results]).groups[0].rows
    assert [cell.text for cell in first[2:5]] == ["1.25", "18", "4.0"]
    assert {cell.note for cell in withheld[2:5]} == {"too few"}
    assert [cell.text for cell in mean[:4]] == ["geometric mean", "of 2 and 2", "1.20", "15"]
    assert psychometric_sentences(("friction", {"S3": refusal, "S4": refusal}, (None, None))) == [
        "Friction: no subject's answers give a psychometric function; the table says why."
    ]
