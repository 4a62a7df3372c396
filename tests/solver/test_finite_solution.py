"""Scenes at finite strain from their keys to a prediction, with its error, its audits, or its refusal."""

import json
from dataclasses import replace

import pytest

from solver.failures import NoSteadyState
from solver.reference import SLIPPERINESS, STICKINESS, scene
from solver.scene import Friction, Loading, Scene, Solve
from solver.solution import answers, solve

# Ending-averaged SED [MPa], normal and tangential force [N/mm] of the published finger: means of two independent codes
# (quadrilaterals with exact contact, up to 36,000 unknowns; high-order triangles with penalty contact, 27,000).
REFERENCE = {
    "slipperiness 0": (0.0019115, 0.08142, 0.05048),
    "slipperiness 55": (0.0025631, 0.09056, 0.03985),
    "slipperiness 100": (0.0039081, 0.10361, 0.02487),
    "stickiness 0": (0.009656, 0.26279, 0.05666),
}


def finite(surface, **options):
    return replace(scene(surface), solve=Solve("finite", **options))


@pytest.fixture(scope="module")
def four():
    surfaces = [SLIPPERINESS[0], SLIPPERINESS[2], SLIPPERINESS[4], STICKINESS[0]]
    return dict(zip(REFERENCE, answers([finite(surface) for surface in surfaces]), strict=True))


@pytest.mark.parametrize("name", REFERENCE)
def test_the_published_surfaces_come_out_within_their_own_error_estimate(four, name):
    found, (sed, normal, tangential) = four[name], REFERENCE[name]
    reference = 0.0022  # what the two codes differ by, at most
    assert found.sed_ending == pytest.approx(sed, rel=found.error_estimate + reference)
    assert found.normal_force == pytest.approx(normal, rel=found.normal_force_error + reference)
    assert found.tangential_force == pytest.approx(tangential, rel=found.tangential_force_error + reference)
    assert found.error_estimate < 0.03


@pytest.mark.parametrize("name", REFERENCE)
def test_forces_balance_and_nothing_is_exceeded(four, name):
    audits = dict(four[name].audits)
    assert audits.pop("smallest_det_F") > 0.5
    assert all(value < 1e-8 for value in audits.values()), audits


def test_a_result_is_json_and_says_what_was_modelled(four):
    document = json.loads(json.dumps(four["stickiness 0"].to_dict(), allow_nan=False))
    assert document["model"]["kinematics"].startswith("finite strain")
    assert "finite strain" not in document["model"]["left_out"]


@pytest.mark.parametrize(
    "surface",
    [*(pytest.param(surface, marks=pytest.mark.slow) for surface in STICKINESS[1:-1]), STICKINESS[-1]],
    ids=lambda s: str(s.index),
)
def test_where_no_settled_sliding_exists_there_is_no_number_but_both_limits(surface):
    with pytest.raises(NoSteadyState) as refusal:
        solve(finite(surface))
    # Without a bound the branch ends at mu = 0.373 (several meshes and orders of a study of this finger).
    assert refusal.value.limit_mu == pytest.approx(0.373, rel=0.04)
    assert refusal.value.limit_indentation < 2.0


def test_the_marched_course_ends_in_the_state_found_directly():
    found = solve(finite(SLIPPERINESS[4], course="history"))
    assert found.audits["course_against_direct"] < 1e-9
    assert found.history.sed_ending[-1] == found.sed_ending
    assert found.history.bone_y[-1] == pytest.approx(-1.5)
    assert found.history.time[39] == pytest.approx(1.0)


def test_small_and_finite_strain_agree_where_the_press_is_shallow():
    pressed = Scene(friction=Friction(0.3), loading=Loading(0.02, "+x", 15.0))
    small, large = (solve(replace(pressed, solve=Solve(kinematics))) for kinematics in ("small", "finite"))
    assert large.normal_force == pytest.approx(small.normal_force, rel=0.02)
    assert large.sed_ending == pytest.approx(small.sed_ending, rel=0.03)
