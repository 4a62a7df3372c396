"""The uncertainty of friction carried to the SED, against solving the draws themselves."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sessions import uncertainty
from sessions.analysis.bootstrap import BootstrapSettings, friction_draws, stroke_intervals
from sessions.plan import Block, SessionPlan
from sessions.prediction import PredictionOptions, predict, scene_along, seds_of, with_loads
from sessions.side_by_side import with_alternatives
from sessions.uncertainty import with_intervals

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
    return predict(analysis, plan, PredictionOptions(course="steady", intervals=True))


@pytest.fixture(scope="module")
def intervals(analysis, prediction):
    return [row.interval for row in with_intervals(analysis, prediction).trials]


@pytest.fixture(scope="module")
def beside(analysis, prediction):
    """Return the sticky trial with its variants, and the options."""
    options = replace(prediction.options, beside="small", beside_intervals=True)
    alone = replace(prediction, trials=prediction.trials[:1], options=options)
    return with_intervals(analysis, with_alternatives(alone))


def test_draws_are_those_of_the_intervals_of_friction(analysis):
    mu, tau_max, normal = friction_draws(analysis.strokes[0], 0, "maximum")
    found = stroke_intervals(analysis.strokes[0], 0)
    assert np.quantile(mu, [0.025, 0.975]).tolist() == list(found.mu_max)
    assert np.quantile(tau_max, [0.025, 0.975]).tolist() == list(found.tau_max)
    assert np.quantile(normal, [0.025, 0.975]).tolist() == list(found.normal_force)
    assert np.corrcoef(mu, tau_max)[0, 1] > 0.5  # one error of calibration moves both


def test_derivatives_give_what_solving_the_draws_gives(analysis, prediction, intervals):
    # The other route: the solver run at forty draws of the friction.
    row, found = prediction.trials[0], intervals[0]
    assert found.method == "derivatives"
    mu, tau_max, _ = friction_draws(analysis.strokes[0], 0, "maximum")
    scene = row.prediction.scene
    solved = seds_of([with_loads(scene, {"mu": m, "tau_max": t}) for m, t in zip(mu[:40], tau_max[:40], strict=True)])
    low, high = np.quantile(solved, [0.025, 0.975])
    carried = found.by_mu * (mu[:40] - row.mu) + found.by_tau_max * (tau_max[:40] - row.tau_max)
    assert np.quantile(row.sed + carried, [0.025, 0.975]) == pytest.approx([low, high], abs=0.05 * (high - low))
    assert found.low < row.sed < found.high


def test_a_stickier_surface_has_the_wider_interval(intervals):
    wide, narrow = (one.high - one.low for one in intervals)
    assert wide > 3 * narrow > 0


def test_twice_the_error_of_calibration_makes_the_interval_nearly_twice_as_wide(analysis, prediction, intervals):
    alone = replace(prediction, trials=prediction.trials[:1])
    doubled = with_intervals(analysis, alone, BootstrapSettings(gain_error=0.02)).trials[0].interval
    assert (doubled.high - doubled.low) / (intervals[0].high - intervals[0].low) == pytest.approx(2.0, rel=0.1)


def test_where_the_sed_bends_draws_are_solved_and_missing_states_are_counted(analysis, prediction, monkeypatch):
    alone = replace(prediction, trials=prediction.trials[:1])

    def bent(scenes, _=None):
        off = [scene.friction.mu - alone.trials[0].mu for scene in scenes]
        return tuple(None if abs(x) > 0.03 else 1.0 + x**2 for x in off)

    monkeypatch.setattr(uncertainty, "seds_of", bent)
    narrow, wide = (
        with_intervals(analysis, alone, BootstrapSettings(gain_error=e)).trials[0].interval for e in (0.004, 0.05)
    )
    assert narrow.method == wide.method == "sampling"
    assert 1.0 <= narrow.low < narrow.high
    assert wide.low is None
    assert "have no settled state" in wide.reason


def test_a_trial_without_a_prediction_keeps_its_reason(analysis, prediction):
    reasons = {"sed": "No stroke was found in this trial."}
    row = replace(prediction.trials[0], prediction=None, reasons=reasons)
    found = with_intervals(analysis, replace(prediction, trials=(row,))).trials[0]
    assert found.interval.reason == found.opposite_interval.reason == "No stroke was found in this trial."
    assert found.interval.low is None


def test_the_other_way_and_every_variant_have_intervals_that_hold_their_seds(beside):
    (row,) = beside.trials
    assert row.opposite_interval.low < row.opposite_sed < row.opposite_interval.high
    assert len(row.alternatives) == 4
    for one in row.alternatives:
        assert one.interval.low < one.sed < one.interval.high
        assert one.interval.method == "derivatives"


def test_pressed_by_the_force_measured_the_uncertainty_of_that_force_is_in_the_interval(analysis, beside):
    (row,) = beside.trials
    pressed = next(one for one in row.alternatives if one.variant.driven == "force")
    _, _, normal = friction_draws(analysis.strokes[0], 0, "maximum")
    least, most = np.quantile(normal, [0.025, 0.975])
    scene = scene_along(row, pressed.variant, beside.options)
    low, high = seds_of([with_loads(scene, {"force": least}), with_loads(scene, {"force": most})])
    assert pressed.interval.by_force == pytest.approx((high - low) / (most - least), rel=0.02)
    assert pressed.interval.high - pressed.interval.low >= 0.95 * (high - low)
