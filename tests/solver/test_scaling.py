"""A finger four times as large, or as stiff, does the same: no length and no stress of the solver is an absolute one.

Factors are powers of two, so that round-off scales too.
"""

from dataclasses import replace

import pytest

from solver import Friction, Loading, Materials, Prediction, Scene, Solve, SolveFailure, solve
from solver.verification.random_scenes import random_scene

QUICK = Solve("finite", tolerance=0.01, evidence="quick")
SLIDE = Scene(friction=Friction(0.3), loading=Loading(1.5), solve=QUICK)
SCENES = {
    "small strain": replace(SLIDE, solve=replace(QUICK, kinematics="small")),
    "a slide with a shear limit": replace(SLIDE, friction=Friction(0.5, 0.02)),
    "more friction than a slide has": replace(SLIDE, friction=Friction(0.9), loading=Loading(2.0, "-x")),
}
SLOW_SCENES = {
    "a drag below the friction limit": replace(SLIDE, loading=Loading(normal_force=0.06, tangential_force=0.01)),
    "a press with friction": replace(SLIDE, loading=Loading(1.0, "none")),
    "stiff skin": replace(random_scene("extreme", 50006, "finite"), solve=QUICK),
    "a deep press": replace(random_scene("deep", 50002, "finite"), solve=QUICK),
}


def larger(scene, factor):
    """Return the scene with all lengths times `factor`; forces per mm grow alike."""
    finger, loading, receptor = scene.finger, scene.loading, scene.receptor
    lengths = ("tip_radius", "epidermis", "dermis", "shaft_length", "bone_radius")
    x, y = finger.bone_centre
    finger = replace(
        finger, bone_centre=(factor * x, factor * y), **{name: factor * getattr(finger, name) for name in lengths}
    )
    controls = ("indentation", "normal_force", "tangential_force", "speed")
    loading = replace(loading, **{name: _times(factor, getattr(loading, name)) for name in controls})
    across, along = receptor.ending
    receptor = replace(receptor, depth=factor * receptor.depth, ending=(factor * across, factor * along))
    return replace(scene, finger=finger, loading=loading, receptor=receptor)


def stiffer(scene, factor):
    """Return the scene with all stresses times `factor`; forces grow alike."""
    tissues = Materials(*(replace(tissue, E=factor * tissue.E) for tissue in scene.materials.by_region))
    forces = ("normal_force", "tangential_force")
    loading = replace(scene.loading, **{name: _times(factor, getattr(scene.loading, name)) for name in forces})
    friction = replace(scene.friction, tau_max=_times(factor, scene.friction.tau_max))
    return replace(scene, materials=tissues, friction=friction, loading=loading)


def _times(factor, value):
    return None if value is None else factor * value


def outcome(scene, length=1.0, stress=1.0):
    """Return what `scene` ends in, and its numbers in units of `length` and `stress`."""
    try:
        answer = solve(scene)
    except SolveFailure as failure:
        limits = (failure.limit_mu, _times(1.0 / length, failure.limit_indentation))
        return type(failure), [limit for limit in limits if limit is not None]
    force = length * stress
    forces = [answer.normal_force / force, answer.tangential_force / force]
    return Prediction, [answer.sed_ending / stress, answer.indentation / length, answer.error_estimate, *forces]


def assert_same(scene, changed, **units):
    kind, numbers = outcome(scene)
    changed_kind, changed_numbers = outcome(changed, **units)
    assert changed_kind is kind
    assert changed_numbers == pytest.approx(numbers, rel=1e-9)


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_a_larger_finger_does_the_same(scene):
    assert_same(scene, larger(scene, 4.0), length=4.0)


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_a_stiffer_finger_does_the_same(scene):
    assert_same(scene, stiffer(scene, 4.0), stress=4.0)


@pytest.mark.slow
@pytest.mark.parametrize("scene", SLOW_SCENES.values(), ids=SLOW_SCENES)
def test_a_smaller_and_softer_finger_does_the_same(scene):
    assert_same(scene, larger(stiffer(scene, 0.25), 0.25), length=0.25, stress=0.25)
