"""A bone that yields, a cut that is driven and a nail plate change the finger as mechanics says they must."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Finger, Friction, Material, Materials, Receptor, SceneError, Solve, solve
from solver.mesh.mesher import BONE, Outline, Sizing, finger_mesh
from solver.scene.published import SLIPPERINESS, scene

KINEMATICS = ("small", "finite")
BASE = scene(SLIPPERINESS[0])


def solve_finger(kinematics, finger=None, bone=None, mu=0.3):
    materials = Materials() if bone is None else replace(Materials(), bone=bone)
    variant = replace(BASE, finger=finger or Finger(), materials=materials, friction=Friction(mu))
    return solve(replace(variant, solve=Solve(kinematics, "steady", 0.5)))


@pytest.mark.parametrize("kinematics", KINEMATICS)
@pytest.mark.parametrize("ratio", [1e6, 1e10])
def test_a_meshed_bone_that_is_stiff_enough_gives_the_rigid_bones_answer(kinematics, ratio):
    rigid = solve_finger(kinematics)
    with_bone = solve_finger(kinematics, Finger(bone="meshed"), Material(0.034 * ratio, 0.3))
    assert with_bone.dofs > rigid.dofs
    assert with_bone.sed_ending == pytest.approx(rigid.sed_ending, rel=10.0 / ratio + 1e-8)
    assert with_bone.normal_force == pytest.approx(rigid.normal_force, rel=10.0 / ratio + 1e-8)
    assert max(with_bone.audits["equilibrium_x"], with_bone.audits["equilibrium_y"]) < 1e-5


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_without_friction_what_is_freed_presses_back_less_and_what_is_held_more(kinematics):
    """Of two bodies at one depth, the one with more freedom stores less energy at every depth, so it resists less."""
    usual_force = solve_finger(kinematics, mu=0.0).normal_force
    soft_bone = Material(0.034, 0.48)  # of fat
    assert solve_finger(kinematics, Finger(bone="meshed"), soft_bone, mu=0.0).normal_force < 0.97 * usual_force
    assert solve_finger(kinematics, Finger(cut="driven"), mu=0.0).normal_force > (1.0 - 1e-3) * usual_force
    assert solve_finger(kinematics, Finger(nail_length=12.0), mu=0.0).normal_force > 1.02 * usual_force


def test_how_the_cut_is_held_matters_less_the_further_away_it_is():
    def difference(length):
        free, driven = (solve_finger("small", Finger(shaft_length=length, cut=cut)) for cut in ("free", "driven"))
        return abs(driven.sed_ending / free.sed_ending - 1.0)

    assert difference(40.0) < 0.3 * difference(15.0)


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_what_is_held_stays_with_the_bone_and_takes_its_part_of_the_force(kinematics):
    prediction = solve_finger(kinematics, Finger(cut="driven", nail_length=10.0))
    outline, mesh = Outline.of(Finger(nail_length=10.0)), prediction.mesh
    for arc in (outline.palmar_cut, outline.dorsal_cut, outline.dorsal, outline.nail_end):
        place = outline.tissue(np.array(arc), np.array(0.0))
        node = np.linalg.norm(mesh.nodes - place, axis=1).argmin()
        np.testing.assert_allclose(mesh.nodes[node], place, atol=1e-12)
        np.testing.assert_array_equal(prediction.displacement[node], 0.0)
    assert max(prediction.audits["equilibrium_x"], prediction.audits["equilibrium_y"]) < 1e-7


def test_the_bones_elements_fill_it_from_a_third_of_its_radius():
    geometry = finger_mesh(Finger(bone="meshed"), Receptor(), Sizing(8, 1.5))
    corners = geometry.mesh.nodes[geometry.mesh.elements[geometry.mesh.region == BONE][:, [0, 1, 2, 3]]]
    next_corners = np.roll(corners, -1, axis=1)
    area = np.sum(corners[..., 0] * next_corners[..., 1] - corners[..., 1] * next_corners[..., 0]) / 2.0
    shaft, radius, core = 14.0, 1.5, 0.5
    exact = np.pi / 2 * (radius**2 - core**2) + 2 * (radius - core) * shaft
    assert area == pytest.approx(exact, rel=5e-3)  # elements' corners cut off a little of the arc


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"bone": "soft"}, "finger.bone"),
        ({"cut": "held"}, "finger.cut"),
        ({"nail_length": -1.0}, "finger.nail_length"),
        ({"nail_length": 15.0}, "finger.nail_length"),
    ],
)
def test_options_that_mean_nothing_are_refused(change, key):
    with pytest.raises(SceneError) as refusal:
        Finger(**change)
    assert refusal.value.key == key
