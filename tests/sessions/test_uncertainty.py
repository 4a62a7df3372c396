"""The uncertainty of friction carried to the SED, against solving the draws themselves."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import test_ground_truth as ground_truth

from sessions.plan.plan import Block, SessionPlan
from sessions.prediction import PredictionOptions, predict, uncertainty
from sessions.prediction.scenes import scene_along, settled_predictions, with_loads
from sessions.prediction.uncertainty import with_alternatives, with_intervals
from sessions.strokes.bootstrap import BootstrapSettings, friction_draws, stroke_intervals
from simulators.bench import BenchSettings
from solver.response.nearby import Gradient

# Of a levelled face and a calibration without cross-talk, so that the friction's interval is narrow.
LEVEL = BootstrapSettings(tilt_error=(0.0, 0.0), cross_talk=0.0)


def drawn_with(settings, prediction, **options):
    """Return a prediction with intervals from other settings of the bootstrap than its analysis has."""
    strokes = SimpleNamespace(strokes=prediction.analysis.strokes, bootstrap=settings)
    return with_intervals(replace(prediction, analysis=strokes), **options)


@pytest.fixture(scope="module")
def analysis():
    visit = ground_truth.visit(1)
    parts = [visit.parts[4], visit.parts[0]]  # sticky and hardly so
    return replace(visit, parts=parts, strokes=[visit.strokes[4], visit.strokes[0]]).analyse()


@pytest.fixture(scope="module")
def prediction(analysis):
    trials = tuple(trial for trial, _ in ground_truth.visit(1).parts if trial.number in (1, 5))
    block = Block("b", "", 1, 2.0, ("", ""), trials[::-1])
    plan = SessionPlan("sensotact", "S1", 0, "given", (block,), forces=True, frame=ground_truth.FRAME)
    return predict(analysis, plan, PredictionOptions(course="steady", intervals=True))


@pytest.fixture(scope="module")
def intervals(prediction):
    return [row.interval for row in drawn_with(LEVEL, prediction).trials]


@pytest.fixture(scope="module")
def with_variants(prediction):
    """Return the trial that is hardly sticky with its variants: its force turns no tissue inside out."""
    options = replace(prediction.options, variants="small", variant_intervals=True)
    alone = replace(prediction, trials=prediction.trials[1:], options=options)
    return with_alternatives(with_intervals(alone))


def seds_of(scenes):
    """Return the SEDs of scenes, each solved from nothing: the other route."""
    return [prediction.sed_ending for prediction in settled_predictions(scenes)]


def test_draws_are_those_of_the_intervals_of_friction(analysis):
    mu, tau_max, normal = friction_draws(analysis.strokes[0], 0, "maximum")
    intervals = stroke_intervals(analysis.strokes[0], 0)
    assert np.quantile(mu, [0.025, 0.975]).tolist() == list(intervals.mu_max)
    assert np.quantile(tau_max, [0.025, 0.975]).tolist() == list(intervals.tau_max)
    assert np.quantile(normal, [0.025, 0.975]).tolist() == list(intervals.normal_force)
    assert np.corrcoef(mu, tau_max)[0, 1] > 0.5  # one error of calibration moves both


def test_derivatives_give_what_solving_the_draws_gives(analysis, prediction, intervals):
    row, interval = prediction.trials[0], intervals[0]
    assert interval.method == "derivatives"
    mu, tau_max, _ = friction_draws(analysis.strokes[0], 0, "maximum", LEVEL)
    scene = row.prediction.scene
    solutions = settled_predictions(
        [with_loads(scene, {"mu": m, "tau_max": t}) for m, t in zip(mu[:24], tau_max[:24], strict=True)]
    )
    low, high = np.quantile([solution.sed_ending for solution in solutions], [0.025, 0.975])
    offsets = interval.by_mu * (mu[:24] - row.mu) + interval.by_tau_max * (tau_max[:24] - row.tau_max)
    assert np.quantile(row.sed + offsets, [0.025, 0.975]) == pytest.approx([low, high], abs=0.05 * (high - low))
    assert interval.low < row.sed < interval.high
    for name, value in (("normal_force", row.normal_force), ("tangential_force", row.tangential_force)):
        low, high = getattr(interval, name)
        forces = np.array([getattr(solution, name) for solution in solutions]) * scene.finger.width
        assert low < value < high
        assert 0.85 <= np.mean((low <= forces) & (forces <= high)) <= 1.0
        # 95 % of normal draws, two dozen of which are solved: those spread otherwise than all by what their mu does.
        spread = 2 * 1.96 * np.std(forces) * np.std(mu) / np.std(mu[:24])
        assert (high - low) / spread == pytest.approx(1.0, abs=0.25)


def test_a_stickier_surface_has_the_wider_interval(intervals):
    wide, narrow = (interval.high - interval.low for interval in intervals)
    assert wide > 3 * narrow > 0


def test_twice_the_error_of_calibration_makes_the_interval_nearly_twice_as_wide(prediction, intervals):
    alone = replace(prediction, trials=prediction.trials[:1])
    doubled = drawn_with(replace(LEVEL, gain_error=0.02), alone).trials[0].interval
    assert (doubled.high - doubled.low) / (intervals[0].high - intervals[0].low) == pytest.approx(2.0, rel=0.1)


class FormulaSlide:
    """A slide whose SED is a formula of what mu and tau_max are off; none where mu is 0.03 off."""

    def __init__(self, formula, by_mu, row):
        self.formula, self.by_mu, self.row = formula, by_mu, row

    def derivatives(self):
        none = Gradient(0.0, 0.0, 0.0, None)
        sed = none._replace(mu=self.by_mu)
        return SimpleNamespace(sed=sed, normal=none, tangential=none, indentation=none)

    def seds(self, scenes):
        off = [(scene.friction.mu - self.row.mu, scene.friction.tau_max - self.row.tau_max) for scene in scenes]
        return np.array([[np.nan if abs(mu) > 0.03 else self.formula(mu, tau)] * 2 for mu, tau in off])


def interval_of(prediction, monkeypatch, formula, by_mu=0.0, gain_error=0.004):
    row = prediction.trials[0]
    slide = FormulaSlide(formula, by_mu, row)
    monkeypatch.setattr(uncertainty, "slides", lambda scenes, _=None: iter([slide] * len(scenes)))
    alone = replace(prediction, trials=(row,))
    return drawn_with(replace(LEVEL, gain_error=gain_error), alone).trials[0].interval


def test_where_the_sed_bends_draws_are_solved_and_missing_states_are_counted(prediction, monkeypatch):
    def bent(mu, _):
        return 1.0 + mu**2

    narrow, wide = (interval_of(prediction, monkeypatch, bent, gain_error=e) for e in (0.004, 0.05))
    assert narrow.method == wide.method == "sampling"
    assert prediction.trials[0].sed <= narrow.low < narrow.high
    assert wide.low is None
    assert "have no settled state" in wide.reason


def test_what_bends_only_where_both_loads_change_together_is_seen(prediction, monkeypatch):
    # Straight along mu and along tau_max alone, so that no draw off in one of them would tell.
    def crossed(mu, tau_max):
        return 1.0 + mu + 2000.0 * mu * tau_max

    straight = interval_of(prediction, monkeypatch, lambda mu, _: 1.0 + mu, by_mu=1.0)
    assert straight.method == "derivatives"
    assert interval_of(prediction, monkeypatch, crossed, by_mu=1.0).method == "sampling"


def test_draws_that_are_solved_give_the_interval_of_all_of_them(analysis, prediction, monkeypatch):
    interval = interval_of(prediction, monkeypatch, lambda mu, _: np.exp(60.0 * mu), by_mu=60.0)
    row = prediction.trials[0]
    mu = friction_draws(analysis.strokes[0], 0, "maximum", replace(LEVEL, gain_error=0.004)).mu
    low, high = row.sed - 1.0 + np.exp(60.0 * (np.quantile(mu, [0.025, 0.975]) - row.mu))
    assert interval.method == "sampling"
    assert [interval.low, interval.high] == pytest.approx([low, high], abs=0.03 * (high - low))


def test_a_trial_without_a_prediction_keeps_its_reason(prediction):
    reasons = dict.fromkeys(("sed", "opposite_sed"), "No stroke was found in this trial.")
    row = replace(prediction.trials[0], prediction=None, opposite=None, reasons=reasons)
    trial = with_intervals(replace(prediction, trials=(row,))).trials[0]
    assert trial.interval.reason == trial.opposite_interval.reason == "No stroke was found in this trial."
    assert trial.interval.low is None


def test_the_other_way_and_every_variant_have_intervals_that_hold_their_seds(with_variants):
    (row,) = with_variants.trials
    assert row.opposite_interval.low < row.opposite_sed < row.opposite_interval.high
    assert len(row.alternatives) == 4
    for alternative in row.alternatives:
        assert alternative.interval.low < alternative.sed < alternative.interval.high
        assert alternative.interval.method in ("derivatives", "sampling")


def test_pressed_by_the_force_measured_the_uncertainty_of_that_force_is_in_the_interval(analysis, with_variants):
    (row,) = with_variants.trials
    variant = next(alternative for alternative in row.alternatives if alternative.variant.driven == "force")
    _, _, normal = friction_draws(analysis.strokes[1], 1, "maximum", LEVEL)
    least, most = np.quantile(normal, [0.025, 0.975])
    scene = scene_along(row, variant.variant, with_variants.options)
    low, high = seds_of([with_loads(scene, {"force": least}), with_loads(scene, {"force": most})])
    assert variant.interval.by_force == pytest.approx((high - low) / (most - least), rel=0.02)
    assert variant.interval.high - variant.interval.low >= 0.95 * (high - low)


def test_the_depth_that_matches_holds_the_uncertainty_of_force_and_friction(analysis, with_variants):
    """Against slopes from solves at both ends of each load, by which all draws are carried."""
    (row,) = with_variants.trials
    variant = next(alternative for alternative in row.alternatives if alternative.variant.driven == "force")
    assert (row.matching_depth, row.matching_depth_interval) == (variant.indentation, variant.interval.indentation)
    draws = dict(zip(("mu", "tau_max", "force"), friction_draws(analysis.strokes[1], 1, "maximum"), strict=True))
    ends = {name: np.quantile(sample, [0.025, 0.975]).tolist() for name, sample in draws.items()}
    scene = scene_along(row, variant.variant, with_variants.options)
    solutions = settled_predictions([with_loads(scene, {name: end}) for name, pair in ends.items() for end in pair])
    depths = np.array([solution.indentation for solution in solutions]).reshape(-1, 2)
    slopes = np.diff(depths)[:, 0] / np.diff(list(ends.values()))[:, 0]
    offsets = sum(slope * (sample - sample.mean()) for slope, sample in zip(slopes, draws.values(), strict=True))
    low, high = np.quantile(offsets, [0.025, 0.975])
    assert np.ptp(row.matching_depth_interval) == pytest.approx(high - low, rel=0.05)
    assert 0.0 < row.matching_depth_error < 0.01


# Many solves, most of them at finite strain: make test-long


def shallow(visit, number):
    """Return the analysis of one stroke of a visit, and the plan of its trial pressed 1 mm deep."""
    (part,) = (part for part in visit.parts if part[0].number == number)
    alone = replace(visit, parts=[part], strokes=[visit.strokes[number - 1]])
    block = Block("b", "", 1, 1.0, ("", ""), (part[0],))
    plan = SessionPlan("sensotact", "S1", 0, "given", (block,), forces=True, frame=ground_truth.FRAME)
    return alone.analyse(), plan


FINITE = PredictionOptions(course="steady", kinematics="finite", intervals=True)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 4])  # with the bound felt, a little sticky, very
def test_at_finite_strain_draws_lie_where_the_derivatives_carry_them(number):
    """Against each draw's own solve from nothing, on a mesh of its own."""
    analysis, plan = shallow(ground_truth.visit(1), number)
    (row,) = drawn_with(LEVEL, predict(analysis, plan, FINITE)).trials
    interval, scene = row.interval, row.prediction.scene
    draws = friction_draws(analysis.strokes[0], 0, "maximum", LEVEL)
    mu, tau_max = draws.mu[:60], draws.tau_max[:60]
    seds = np.array(seds_of([with_loads(scene, {"mu": m, "tau_max": t}) for m, t in zip(mu, tau_max, strict=True)]))
    linear = row.sed + interval.by_mu * (mu - row.mu) + interval.by_tau_max * (tau_max - row.tau_max)
    assert np.abs(linear - seds).max() < 0.1 * (interval.high - interval.low)
    assert 0.90 <= np.mean((interval.low <= seds) & (seds <= interval.high)) <= 0.99


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_intervals_of_200_visits_hold_the_sed_of_the_true_friction(kinematics):
    """The benches of the coverage of friction itself; the truth is the solve at the true friction, from nothing."""
    options, hits = replace(FINITE, kinematics=kinematics), []
    for seed in range(1000, 1200):
        gains = np.random.default_rng([seed, 9]).normal(1.0, 0.01, 6).tolist()
        visit = ground_truth.visit(seed, BenchSettings(gains=tuple(gains)))
        analysis, plan = shallow(visit, 2)
        (row,) = drawn_with(LEVEL, predict(analysis, plan, options), both_ways=False).trials
        truth = visit.strokes[1]
        (sed,) = seds_of([with_loads(row.prediction.scene, {"mu": truth.mu, "tau_max": truth.tau_max})])
        hits.append(row.interval.low <= sed <= row.interval.high)
    assert 0.90 <= np.mean(hits) <= 0.98


@pytest.mark.slow
def test_at_finite_strain_no_interval_is_reported_where_draws_or_all_have_no_settled_slide():
    analysis, plan = shallow(ground_truth.visit(1), 2)
    beyond = predict(analysis, plan, replace(FINITE, indentation=2.0))
    (row,) = with_intervals(beyond).trials
    assert row.interval.low is None
    assert row.interval.reason == row.reasons["sed"]
    assert "settled sliding up to mu = 0.3" in row.interval.reason
    near = predict(analysis, plan, replace(FINITE, indentation=1.82))  # of at most 1.83 mm with the friction found
    (row,) = with_intervals(near).trials
    assert row.interval.low is None
    assert "of 60 draws of the friction have no settled state" in row.interval.reason
    largest = int(np.argmax(friction_draws(analysis.strokes[0], 0, "maximum").mu))
    mu, tau_max, _ = (column[largest] for column in friction_draws(analysis.strokes[0], 0, "maximum"))
    assert settled_predictions([with_loads(row.prediction.scene, {"mu": mu, "tau_max": tau_max})]) == (None,)
