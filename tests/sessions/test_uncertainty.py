"""The uncertainty of friction carried to the SED, against solving the draws themselves."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sessions import uncertainty
from sessions.analysis.bootstrap import BootstrapSettings, friction_draws, stroke_intervals
from sessions.plan import Block, SessionPlan
from sessions.prediction import PredictionOptions, predict, seds_with
from sessions.uncertainty import sed_intervals

PLANTED = Path(__file__).parents[1] / "end_to_end" / "test_planted_truth.py"
_spec = importlib.util.spec_from_file_location("planted_truth", PLANTED)
assert _spec is not None
assert _spec.loader is not None
planted_truth = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(planted_truth)


@pytest.fixture(scope="module")
def analysis():
    visit = planted_truth.visit(1)
    kept = [visit.parts[4], visit.parts[0]]  # sticky and hardly so
    return replace(visit, parts=kept, planted=[visit.planted[4], visit.planted[0]]).analysed()


@pytest.fixture(scope="module")
def prediction(analysis):
    trials = tuple(trial for trial, _ in planted_truth.visit(1).parts if trial.number in (1, 5))
    block = Block("b", "", 1, 2.0, ("", ""), trials[::-1])
    plan = SessionPlan("sensotact", "S1", 0, "given", (block,), forces=True, frame=planted_truth.FRAME)
    return predict(analysis, plan, PredictionOptions(course="steady"))


@pytest.fixture(scope="module")
def intervals(analysis, prediction):
    return sed_intervals(analysis, prediction)


def test_draws_are_those_of_the_intervals_of_friction(analysis):
    mu, tau_max = friction_draws(analysis.strokes[0], 0, "maximum")
    found = stroke_intervals(analysis.strokes[0], 0)
    assert np.quantile(mu, [0.025, 0.975]).tolist() == list(found.mu_max)
    assert np.quantile(tau_max, [0.025, 0.975]).tolist() == list(found.tau_max)
    assert np.corrcoef(mu, tau_max)[0, 1] > 0.5  # one error of calibration moves both


def test_derivatives_give_what_solving_the_draws_gives(analysis, prediction, intervals):
    # The other route: the solver run at forty draws of the friction.
    row, found = prediction.trials[0], intervals[0]
    assert found.method == "derivatives"
    mu, tau_max = friction_draws(analysis.strokes[0], 0, "maximum")
    solved = seds_with([(row, float(m), float(t)) for m, t in zip(mu[:40], tau_max[:40], strict=True)])
    low, high = np.quantile(solved, [0.025, 0.975])
    carried = found.by_mu * (mu[:40] - row.mu) + found.by_tau_max * (tau_max[:40] - row.tau_max)
    assert np.quantile(row.sed + carried, [0.025, 0.975]) == pytest.approx([low, high], abs=0.05 * (high - low))
    assert found.low < row.sed < found.high


def test_a_stickier_surface_has_the_wider_interval(intervals):
    wide, narrow = (one.high - one.low for one in intervals)
    assert wide > 3 * narrow > 0


def test_twice_the_error_of_calibration_makes_the_interval_nearly_twice_as_wide(analysis, prediction, intervals):
    doubled = sed_intervals(analysis, prediction, BootstrapSettings(gain_error=0.02))[0]
    assert (doubled.high - doubled.low) / (intervals[0].high - intervals[0].low) == pytest.approx(2.0, rel=0.1)


def test_where_the_sed_bends_draws_are_solved_and_missing_states_are_counted(analysis, prediction, monkeypatch):
    def bent(cases, _=None):
        return tuple(None if abs(mu - row.mu) > 0.03 else 1.0 + (mu - row.mu) ** 2 for row, mu, _ in cases)

    monkeypatch.setattr(uncertainty, "seds_with", bent)
    narrow, wide = (sed_intervals(analysis, prediction, BootstrapSettings(gain_error=e))[0] for e in (0.004, 0.05))
    assert narrow.method == wide.method == "sampling"
    assert 1.0 <= narrow.low < narrow.high
    assert wide.low is None
    assert "have no settled state" in wide.reason


def test_a_trial_without_a_prediction_keeps_its_reason(analysis, prediction):
    row = replace(prediction.trials[0], prediction=None, reasons={"sed": "No stroke was found in this trial."})
    found = sed_intervals(analysis, replace(prediction, trials=(row,)))
    assert found[0].reason == "No stroke was found in this trial."
    assert found[0].low is None
