"""Stevens' exponent: exact laws, a known exponent under errors in both, and Deming's closed form."""

import numpy as np
import pytest

from sessions.file_access import json_text
from sessions.statistics.scales import stevens_exponent

MU = np.array([0.24, 0.36, 0.44, 0.52, 0.62])


def study(rng, exponent, subjects=12, noise=0.15, error=0.08):
    people, surfaces, answers, mus = [], [], [], []
    for subject in range(subjects):
        unit = np.exp(rng.normal(2.0, 0.8))
        own = exponent + rng.normal(0.0, 0.1)
        for surface, mu in enumerate(MU):
            people.append(f"P{subject:02d}")
            surfaces.append(surface)
            answers.append(unit * mu**own * np.exp(rng.normal(0.0, noise)))
            mus.append(mu * np.exp(rng.normal(0.0, error)))
    return people, surfaces, answers, mus


def test_an_exact_law_is_found_by_both_routes_whatever_unit_a_subject_chose():
    people = [f"P{n}" for n in range(4) for _ in MU]
    mu = np.tile(MU, 4)
    answers = np.repeat([1.0, 7.0, 100.0, 0.2], len(MU)) * mu**0.8
    exponent = stevens_exponent(people, np.tile(range(5), 4).tolist(), answers, mu)
    assert exponent.deming[0] == pytest.approx(0.8, rel=1e-12)


def test_where_what_was_measured_errs_the_plain_slope_is_too_flat_and_deming_s_is_not():
    exponents = [stevens_exponent(*study(np.random.default_rng([3, n]), 1.1, error=0.2)) for n in range(16)]
    assert np.mean([exponent.plain.estimate for exponent in exponents]) < 0.95
    assert np.mean([exponent.deming[0] for exponent in exponents]) == pytest.approx(1.1, abs=0.1)


def test_magnitudes_that_are_the_same_for_all_leave_the_plain_slope():
    people, surfaces, answers, _ = study(np.random.default_rng(5), 0.9, subjects=3)
    exact = np.tile(MU, 3)
    exponent = stevens_exponent(people, surfaces, answers, exact)
    assert exponent.deming[0] == pytest.approx(np.polyfit(np.log(exact), np.log(answers), 1)[0], rel=1e-9)


def test_subjects_who_are_all_alike_give_no_interval():
    people, surfaces = np.repeat(["a", "b", "c"], 5).tolist(), np.tile(range(5), 3).tolist()
    exponent = stevens_exponent(people, surfaces, np.tile([2.0, 3.1, 5.0, 6.2, 8.5], 3).tolist(), np.tile(MU, 3))
    assert exponent.deming[1:] == (None, None)
    json_text({"error_ratio": exponent.error_ratio, "deming": exponent.deming})  # raises for what JSON has not


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    ("subjects", "studies"), [(4, 50), pytest.param(4, 150, marks=SLOW), pytest.param(12, 150, marks=SLOW)]
)
def test_intervals_hold_the_true_exponent_in_90_of_a_hundred_studies_or_more(subjects, studies):
    exponents = [stevens_exponent(*study(np.random.default_rng([4, n]), 1.1, subjects)) for n in range(studies)]
    coverage = [exponent.deming[1] <= 1.1 <= exponent.deming[2] for exponent in exponents]
    assert np.mean(coverage) >= 0.90  # three standard errors of 150 below 95 %


def test_too_few_subjects_and_missing_cells_are_said():
    people, surfaces, answers, mu = study(np.random.default_rng(0), 1.0, subjects=2)
    assert "3 subjects" in stevens_exponent(people, surfaces, answers, mu).reason
    people, surfaces, answers, mu = study(np.random.default_rng(0), 1.0)
    exponent = stevens_exponent(people[1:], surfaces[1:], answers[1:], mu[1:])
    assert exponent.plain is not None
    assert "missed a surface" in exponent.reason
