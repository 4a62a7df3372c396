"""Firing of the afferent, against closed forms of its own equations and the statistics it declares."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from sessions.prediction.afferent import (
    PARAMETERS,
    AfferentSettings,
    firing_rate,
    parameters,
    session_firing,
    settings_with,
    spike_times,
    usual_settings,
)
from sessions.report.trials import afferent_facts
from solver.prediction import Response
from solver.quantities import NAMES

USUAL = AfferentSettings()
PLAIN = replace(USUAL, threshold=0.0)  # whose closed forms are short


def test_a_constant_sed_adapts_as_the_exponential_does():
    time, rate = firing_rate(np.array([0.0, 6.0]), np.array([0.01, 0.01]), 0.01, PLAIN)
    expected = 5.0 + 20.0 - 6.0 * (1.0 - np.exp(-time / 1.5))
    assert rate == pytest.approx(expected, abs=1e-3)


def test_a_ramp_adds_the_dynamic_part_and_adapts_late():
    time, rate = firing_rate(np.array([0.0, 1.0]), np.array([0.0, 0.01]), 0.01, PLAIN)
    # x = t, dx/dt = 1, a = t - tau (1 - exp(-t / tau)).
    expected = 5.0 + 20.0 * time + 4.0 - 6.0 * (time - 1.5 * (1.0 - np.exp(-time / 1.5)))
    assert rate[1:] == pytest.approx(expected[1:], abs=1e-3)


def test_the_rate_stays_within_its_bounds():
    _, rate = firing_rate(np.array([0.0, 0.01, 1.0]), np.array([0.0, 0.5, 0.5]), 0.01, USUAL)
    assert rate.max() == 100.0
    falling = replace(USUAL, background=0.0, adaptation_gain=60.0)
    assert firing_rate(np.array([0.0, 9.0]), np.array([0.01, 0.01]), 0.01, falling)[1].min() == 0.0


def test_a_steady_rate_gives_its_count_and_the_declared_regularity():
    time = np.arange(0.0, 400.0, 1e-2)
    spikes = spike_times(time, np.full_like(time, 25.0), np.random.default_rng(1), USUAL)
    intervals = np.diff(spikes)
    assert len(spikes) == pytest.approx(10_000, abs=100)  # five standard deviations of 0.2 sqrt(10000)
    assert intervals.std() / intervals.mean() == pytest.approx(0.2, abs=0.01)
    assert intervals.min() >= USUAL.refractory


def rows(seds, interval=None):
    time = np.array([0.0, 1.0, 3.0])
    ramp = np.array([0.0, 1.0, 1.0])[:, None]
    # The SED, and every other quantity a hundred times as large and below zero.
    values = [np.array([sed if name == "sed" else -100.0 * sed for name in NAMES]) for sed in seds]
    return tuple(
        SimpleNamespace(
            trial=i,
            history=SimpleNamespace(time=time, responses=ramp * value),
            interval=interval,
            responses={name: Response(response, 0.0) for name, response in zip(NAMES, value.tolist(), strict=True)},
        )
        for i, value in enumerate(values, 1)
    )


def test_the_interval_of_an_sed_goes_through_to_the_rates():
    interval = SimpleNamespace(low=0.008, high=0.012)
    _, (bare_firing,) = session_firing(SimpleNamespace(trials=rows([0.01])))
    _, (firing,) = session_firing(SimpleNamespace(trials=rows([0.01], interval)))
    assert (bare_firing.settled_interval, bare_firing.peak_interval) == (None, None)
    # Drive 1 at the reference of 10 kPa, straight in the SED beyond a threshold of 4 Pa: 14 imp/s for it.
    assert firing.settled_interval == pytest.approx((19.0 - 14.0 * 0.2, 19.0 + 14.0 * 0.2), abs=2e-2)
    assert firing.peak_interval[0] < firing.rate.max() < firing.peak_interval[1]


def test_the_order_of_surfaces_is_that_of_the_sed_whatever_the_exponent():
    seds = [0.0086, 0.0094, 0.0052, 0.0087, 0.0053]
    for exponent in (0.5, 1.0):
        reference, firings = session_firing(SimpleNamespace(trials=rows(seds)), replace(USUAL, exponent=exponent))
        assert reference == 0.0086
        assert stats.spearmanr(seds, [firing.settled_rate for firing in firings]).statistic == pytest.approx(1.0)


def test_an_afferent_answers_to_the_size_of_any_quantity_by_the_threshold_of_one_per_cent_strain():
    interval = SimpleNamespace(low=0.008, high=0.012)
    for name, threshold in (("stretch_along_skin", 0.01), ("pressure", 0.08 * 0.01), ("sed_deviatoric", 4e-6)):
        usual = usual_settings(name)
        assert usual.threshold == pytest.approx(threshold)
        trials = rows([0.004, 0.01, 0.02], interval)
        reference, firings = session_firing(SimpleNamespace(trials=trials), usual)
        assert reference == pytest.approx(1.0)
        # A line from the rate at rest at the threshold to 14 imp/s more at the reference.
        expected = [5.0 + 14.0 * (size - threshold) / (1.0 - threshold) for size in (0.4, 1.0, 2.0)]
        assert [firing.settled_rate for firing in firings] == pytest.approx(expected)
        assert {firing.settled_interval for firing in firings} == {None}
        by_name = {parameter["name"]: parameter for parameter in parameters(usual, reference)}
        assert (
            by_name["threshold"]["unit"]
            == by_name["reference"]["unit"]
            == ("-" if name == "stretch_along_skin" else "MPa")
        )
        assert by_name["threshold"]["standing"] == "assumed"


def test_a_course_that_is_known_of_the_sed_alone_makes_no_firing_of_another_quantity():
    trials = rows([0.01])
    trials[0].history.responses[:, 1:] = np.nan
    assert session_firing(SimpleNamespace(trials=trials), usual_settings("pressure"))[1] == ()
    assert len(session_firing(SimpleNamespace(trials=trials))[1]) == 1


def test_the_same_seed_gives_the_same_spikes_and_each_trial_its_own():
    (_, once), (_, again) = (session_firing(SimpleNamespace(trials=rows([0.008, 0.008]))) for _ in range(2))
    assert once[0].spikes.tolist() == again[0].spikes.tolist()
    assert once[0].spikes.tolist() != once[1].spikes.tolist()


def test_every_parameter_is_reported_with_its_standing():
    assert {*PARAMETERS, "quantity"} == {field.name for field in fields(AfferentSettings)}
    assert {parameter["standing"] for parameter in parameters(USUAL) if parameter["name"] != "seed"} == {"assumed"}


def test_up_to_its_threshold_the_unit_only_fires_at_rest_and_at_the_reference_the_drive_is_one():
    deaf = replace(USUAL, threshold=0.004, adaptation_gain=0.0)
    for sed, rate in ((0.004, 5.0), (0.01, 25.0), (0.007, 15.0)):  # background; with the static gain; half of it
        assert firing_rate(np.array([0.0, 1.0]), np.full(2, sed), 0.01, deaf)[1][-1] == pytest.approx(rate)


def test_the_usual_threshold_is_the_sed_of_one_per_cent_strain_in_the_dermis():
    assert pytest.approx(0.5 * 0.08 * 0.01**2) == USUAL.threshold


def test_a_parameter_that_somebody_set_is_reported_as_set_and_the_reference_as_assumed():
    by_name = {parameter["name"]: parameter for parameter in parameters(settings_with({"static_gain": 30.0}), 0.0086)}
    assert (by_name["static_gain"]["value"], by_name["static_gain"]["standing"]) == (30.0, "set")
    assert (by_name["reference"]["value"], by_name["reference"]["standing"]) == (0.0086, "assumed")
    assert {one["standing"] for name, one in by_name.items() if name not in ("static_gain", "seed")} == {"assumed"}


def test_a_page_tells_every_parameter_with_its_unit_and_whether_it_is_assumed_or_set():
    facts = {fact.name: fact for fact in afferent_facts(settings_with({"static_gain": 30.0}), 7.5e-3)}
    assert (facts["reference"].value, facts["threshold"].value) == ("7.5 kPa", "0.004 kPa")
    assert facts["static gain"].value == "30 imp/s"
    assert {name for name, fact in facts.items() if not fact.remark.startswith("assumed: ")} == {"static gain", "seed"}


@pytest.mark.parametrize("wrong", [{"loudness": 1.0}, {"variation": 0.0}, {"threshold": -1.0}, {"static_gain": np.nan}])
def test_a_parameter_that_is_none_or_means_nothing_is_refused(wrong):
    with pytest.raises(ValueError, match=r"afferent|not allowed"):
        settings_with(wrong)
