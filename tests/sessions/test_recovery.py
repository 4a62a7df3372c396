"""Whether simulated studies prefer the true quantity, on strokes whose quantities are known numbers."""

import json

import numpy as np
import pytest

from daq_app.cli.main import run
from sessions.statistics import power
from sessions.statistics.power import AssumedEffects, recovery, twins

DEPTHS = (1.0, 2.0)


def strokes(seed, likeness):
    """Return two quantities of 12 people on four surfaces at two depths, correlated by `likeness`, and a bystander."""
    first, second, bystander = np.random.default_rng(seed).standard_normal((3, 12, 8))
    return {"sed": first, "shear": likeness * first + np.sqrt(1.0 - likeness**2) * second, "mu": bystander}


@pytest.mark.parametrize("quantity", ["sed", "shear", "mu"])
def test_a_quantity_that_scores_follow_closely_is_preferred_in_every_study(quantity):
    close = AssumedEffects(70.0, noise=4.0, level_sd=10.0, slope_sd=0.0)
    result = recovery(strokes(1, 0.5), 10, DEPTHS, quantity, close, 8, np.random.default_rng(2))
    assert (result.preferred, result.family, result.twins, result.surfaces) == (1.0, 1.0, (), 4)


@pytest.mark.parametrize("studies", [15, pytest.param(45, marks=pytest.mark.slow)])
def test_scores_that_follow_nothing_prefer_each_of_three_about_equally_often(studies):
    nothing = AssumedEffects(0.0, noise=4.0, level_sd=10.0, slope_sd=0.0)
    result = recovery(strokes(1, 0.0), 10, DEPTHS, "sed", nothing, studies, np.random.default_rng(2))
    assert result.preferred == pytest.approx(1.0 / 3.0, abs=0.2)  # three standard errors of 45 studies


def test_scores_spread_with_the_true_quantity_by_the_effect_over_the_root_of_twelve(monkeypatch):
    scores = []
    monkeypatch.setattr(power, "crossed_aic", lambda _who, _what, _condition, y, _x: scores.append(y) or 0.0)
    certain = AssumedEffects(30.0, noise=0.0, level_sd=0.0, slope_sd=0.0)
    recovery(strokes(1, 0.5), 12, DEPTHS, "sed", certain, 1, np.random.default_rng(2))
    assert np.std(scores[0]) == pytest.approx(30.0 / np.sqrt(12.0))  # as evenly over a range of 30


def test_a_twin_is_what_goes_with_the_true_quantity_in_either_sense():
    alike = strokes(1, 0.999)
    alike["pressure"] = -alike["sed"]
    assert twins(alike, "sed") == {"sed", "shear", "pressure"}
    assert twins(alike, "mu") == {"mu"}


def test_the_verb_simulates_studies_at_the_depths_asked_for(capsys, monkeypatch):
    for name, value in (("_SUBJECTS", (4,)), ("SURFACES", (3,)), ("RIVAL_SUBJECTS", (4,)), ("RIVAL_SURFACES", (3,))):
        monkeypatch.setattr(f"daq_app.cli.verbs.study.{name}", value)
    monkeypatch.setattr("daq_app.cli.verbs.study.RIVAL_STUDIES", 2)
    easy = ["study", "--power", "effect=80", "noise=1", "slope_sd=0", "--studies", "20", "--depths", "1.25", "1.75"]
    assert run([*easy, "--quantity", "shear_along_skin", "--json"]) == 0
    (document,) = json.loads(capsys.readouterr().out)["recovery"]
    assert (document["people"], document["surfaces"], document["depths"]) == (4, 3, [1.25, 1.75])
    assert (document["planted"], document["preferred"]) == ("shear_along_skin", 1.0)
    assert run(easy) == 0
    printed = capsys.readouterr().out
    assert "effect = 80 points, noise = 1 points, level_sd = 12 points, slope_sd = 0 of the effect" in printed
    assert "4 × 3 × 2" in printed
    assert run([*easy, "9"]) == 2
    assert "--depths" in capsys.readouterr().err


@pytest.mark.parametrize("quantity", ["sed", "shear"])
def test_a_quantity_is_preferred_where_scores_follow_little_of_a_strokes_own_difference(quantity):
    """Usual values of surfaces at two depths vary more than strokes do, and the other quantity goes with them."""
    draw = np.random.default_rng(5)
    usual, other = draw.standard_normal((2, 1, 8))
    own = draw.standard_normal((2, 30, 8))
    pool = {"sed": usual + 0.3 * own[0], "shear": 0.95 * usual + 0.31 * other + 0.05 * own[1]}
    effects = AssumedEffects(70.0, noise=3.0, level_sd=5.0, slope_sd=0.0)
    weights = [power.study_weights(pool, 12, 4, quantity, effects, draw, 0.2) for _ in range(8)]
    assert [max(study, key=study.__getitem__) for study in weights] == [quantity] * 8
