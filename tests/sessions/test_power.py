"""Power of a study's test, against the t test of subjects' own slopes, and its error where there is no effect."""

import json

import numpy as np
import pytest
from scipy import stats

from daq_app.cli.main import run
from sessions.statistics.correlations import share_interval
from sessions.statistics.power import MU_RANGE, AssumedEffects, power

PLAIN = AssumedEffects(effect=10.0, noise=12.0, level_sd=12.0, slope_sd=0.0, friction_sd=0.0)


def test_with_alike_people_and_exact_friction_the_power_is_nearly_that_of_a_t_test_of_their_slopes():
    mu = np.linspace(*MU_RANGE, 5)
    slope = PLAIN.effect / np.ptp(mu)
    error = PLAIN.noise / np.sqrt(np.sum((mu - mu.mean()) ** 2))
    for design in power(PLAIN, (8, 16), (5,), 400, 1):
        n = design.subjects
        closed_form = stats.nct.sf(stats.t.ppf(0.975, n - 1), n - 1, slope / error * np.sqrt(n))
        assert design.share == pytest.approx(closed_form, abs=0.1)


def test_without_an_effect_the_test_detects_one_in_about_five_of_a_hundred():
    (design,) = power(AssumedEffects(effect=0.0), (10,), (5,), 600, 2)
    assert 0.02 <= (design.detections + design.wrong) / design.studies <= 0.08


@pytest.mark.parametrize(("ones", "cases"), [(0, 7), (4, 13), (348, 400), (400, 400), (1, 1)])
def test_the_interval_of_a_share_is_scipy_s_by_wilson(ones, cases):
    wilson = stats.binomtest(ones, cases).proportion_ci(method="wilson")
    assert share_interval(ones / cases, cases) == pytest.approx((wilson.low, wilson.high), abs=1e-12)


def test_more_subjects_find_more_and_spread_people_less():
    few, many = power(AssumedEffects(), (4, 12), (5,), 150, 3)
    assert share_interval(few.share, 150)[1] < many.share
    (spread,) = power(AssumedEffects(slope_sd=2.0), (12,), (5,), 150, 3)
    assert share_interval(spread.share, 150)[1] < many.share


def test_the_verb_prints_a_table_and_refuses_nonsense(capsys, monkeypatch):
    monkeypatch.setattr("daq_app.cli.verbs.study._SUBJECTS", (4,))
    monkeypatch.setattr("daq_app.cli.verbs.study.SURFACES", (3,))
    assert run(["study", "--power", "effect=30", "--studies", "20", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["planted"]["effect"] == 30.0
    assert [(design["subjects"], design["surfaces"]) for design in document["designs"]] == [(4, 3)]
    assert run(["study", "--power", "--studies", "20"]) == 0
    assert "We chose the default values; nobody measured them." in capsys.readouterr().out
    for wrong in (["effect"], ["effect=1000"], ["toe=1"], ["--studies", "2"], ["--seed", "-1"]):
        assert run(["study", "--power", *wrong]) == 2
        assert capsys.readouterr().err.startswith("daq-app: ")
    assert run(["study", "somewhere", "--power"]) == 2
