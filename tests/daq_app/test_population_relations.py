"""The true relation of a synthetic study, that of people at large, against what can be worked out by hand."""

import math

import numpy as np
import pytest

from daq_app.simulation import synthetic
from daq_app.simulation.synthetic import relations
from simulators.stroke import paper_surfaces
from simulators.subject import SLIPPERIEST, STICKIEST, SubjectSettings

GAIN, NOISE, RISE = 0.75, 4.0, 2.0  # of a score per index, points, kPa per unit of µ


@pytest.fixture(autouse=True)
def few(monkeypatch):
    monkeypatch.setattr(synthetic, "SAMPLE_SIZE", 400)


def straight(loads):
    """Return SEDs [MPa] that rise with friction in a straight line."""
    return [1e-3 * (5.0 + RISE * mu) for mu, *_ in loads]


def test_people_who_judge_by_friction_alone_have_the_slope_of_their_scale_over_that_of_the_model():
    people = SubjectSettings(gain=GAIN, gain_spread=0.0, judgement_noise=NOISE, friction_weight=1.0)
    relation = relations(people, straight)["stickiness"]
    assert relation["slope"] == pytest.approx(GAIN * 100.0 / (STICKIEST - SLIPPERIEST) / RISE)
    mus = np.array([s.mu for (name, _), s in paper_surfaces().items() if name == "stickiness"])
    squares = float(np.sum((relation["slope"] * RISE * (mus - mus.mean())) ** 2))
    assert relation["r"] == pytest.approx(math.sqrt(squares / (squares + 4 * NOISE**2)))


def test_fingers_gains_drift_and_carry_over_leave_the_slope_where_it_is():
    people = SubjectSettings(
        gain=GAIN, gain_spread=0.05, friction_weight=1.0, drift=0.4, carry_over=0.04, moisture=0.08
    )
    relation = relations(people, straight)
    assert relation["stickiness"]["slope"] == pytest.approx(GAIN * 100.0 / (STICKIEST - SLIPPERIEST) / RISE, rel=0.01)
    assert relation["slipperiness"]["slope"] == pytest.approx(
        -GAIN * 100.0 / (STICKIEST - SLIPPERIEST) / RISE, rel=0.01
    )


def test_where_the_sed_bends_the_slope_is_the_mean_of_the_slopes_that_people_have():
    # With an SED of RISE µ², a finger of f times the friction has f times the scores but f² times the SEDs. Its slope
    # goes with 1 / f, whose mean over a log-normal f is exp(sd² / 2). All trials pooled would give exp(-3.5 sd²).
    sd, mus = 0.2, np.array([s.mu for (name, _), s in paper_surfaces().items() if name == "stickiness"])
    people = SubjectSettings(gain=GAIN, gain_spread=0.0, friction_weight=1.0, moisture=sd, drift=0.4, carry_over=0.04)
    slope = relations(people, lambda loads: [1e-3 * RISE * mu**2 for mu, *_ in loads])["stickiness"]["slope"]
    usual = GAIN * 100.0 / (STICKIEST - SLIPPERIEST) * np.cov(mus, mus**2)[0, 1] / np.var(mus**2, ddof=1) / RISE
    assert slope == pytest.approx(usual * math.exp(sd**2 / 2), rel=0.03)


def test_a_surface_without_a_settled_slide_leaves_nothing_to_hold_a_study_against():
    assert relations(SubjectSettings(), lambda loads: [None] * len(loads)) == {}
