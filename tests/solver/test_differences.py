"""Differences between surfaces that are solved together: how good they are, and what is said where they are not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from solver import Finger, Friction, Loading, Material, Materials, Scene, Solve, solve, solve_many
from solver.accuracy.contrasts import TOLD, finer, off, off_by, together
from solver.accuracy.error_estimate import FINENESS
from solver.scene.published import STICKINESS, scene


def test_differences_are_off_by_a_part_of_what_the_other_mesh_that_changes_them_most_makes_of_them():
    numbers = np.array([[1.0, 2.0, 0.5], [1.1, 2.2, 0.7], [1.2, 2.1, 0.6]])
    others = np.stack([numbers + 0.3, 1.0 * numbers], axis=1)  # each is up to 60 % off, and their differences are not
    assert off_by(numbers, others, 0.5) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    others[1, 0, 1] += 0.01
    others[1, 1, 1] -= 0.02
    assert off_by(numbers, others, 0.5) == pytest.approx([0.0, 0.5 * 0.02 / 0.2, 0.0], abs=1e-12)


def test_nobody_minds_differences_that_are_off_by_less_than_a_1000th_of_a_per_cent_of_the_numbers():
    numbers = np.full((2, 1), 3.0)
    others = numbers[:, None] + [[[0.0]], [[3e-5]]]
    assert off_by(numbers, others, 0.9)[0] < TOLD < off_by(numbers, others, 1.1)[0]


@pytest.mark.parametrize(
    ("tolerance", "changed", "held", "warned"),
    [(None, 0.004, False, True), (None, 0.001, False, False), (0.01, 0.001, True, True)],
)
def test_without_a_tolerance_forces_are_not_held_to_their_range_but_warned_of_where_a_sensor_could_tell(
    tolerance, changed, held, warned
):
    def surface(force):
        numbers = (1.0 + 10.0 * (force - 1.0), force, 0.3, 2.0)
        other = np.array([numbers[0], force + (changed if force > 1.0 else 0.0), 0.3, 2.0])
        asked = replace(scene(STICKINESS[0]), solve=Solve(tolerance=tolerance))
        names = ("sed_ending", "normal_force", "tangential_force", "indentation")
        return SimpleNamespace(scene=asked, beside=other[None], **dict(zip(names, numbers, strict=True)))

    found = off([surface(1.0), surface(1.01)])
    assert (found.share > TOLD) == held
    assert ("Differences in normal force" in found.warning) == warned


def test_variants_of_one_surface_and_surfaces_pressed_otherwise_are_not_told_apart():
    one, other = scene(STICKINESS[0]), scene(STICKINESS[2])
    deeper = replace(other, loading=Loading(1.0, "+x"))
    variant = replace(other, solve=Solve(evidence="quick"))
    assert together([one, deeper, variant, other]) == [[0, 3]]
    assert together([one, deeper, variant, one]) == []


@pytest.mark.parametrize(("share", "mesh"), [(0.06, 10), (0.12, 16), (5.0, 24)])
def test_the_next_mesh_is_one_that_may_tell_surfaces_apart(share, mesh):
    assert finer((10, 12, 16, 20, 24), 8, share) == mesh


# Three surfaces for one finger, whose normal forces (finite strain) or SED (small) differ by 2 and 0.6 %: indentation,
# contact angle, moduli, and for each surface mu, bound and the mean of three solves on far finer meshes.
HARDLY_DIFFERENT = {
    "finite": (
        1.9453824434540352,
        52.768285531663444,
        (0.12561350965518028, 0.10102004119009433, 0.03731941227568045),
        (
            (0.31708494247858965, 0.01876643849318715, (0.00377605525, 0.258807410, 0.0820639326)),
            (0.3775009024088661, None, (0.00342437463, 0.253646986, 0.0957519661)),
            (0.17302156508179378, None, (0.0111661969, 0.256314119, 0.0443478701)),
        ),
    ),
    "small": (
        0.9946963522975397,
        71.54826541385889,
        (0.17506644897696486, 0.0989132821156936, 0.03613420814511986),
        (
            (0.5566218765428702, 0.012322557398619328, (0.00289504299, 0.0730953659, 0.0406864797)),
            (0.5975862051326736, 0.007267728220609088, (0.00289523829, 0.0699444578, 0.0273257913)),
            (0.3909704583472945, None, (0.00291362589, 0.0699464803, 0.0273470074)),
        ),
    ),
}


def hardly_different(kinematics, tolerance, course="steady"):
    """Return the surfaces, and the truth (3, 3) of them."""
    depth, angle, moduli, surfaces = HARDLY_DIFFERENT[kinematics]
    asked = Scene(
        finger=Finger(contact_angle=angle),
        materials=Materials(*(Material(modulus, 0.48) for modulus in moduli)),
        friction=Friction(0.0),
        loading=Loading(depth, "+x"),
        solve=Solve(kinematics, course, tolerance=tolerance),
    )
    return [replace(asked, friction=Friction(mu, bound)) for mu, bound, _ in surfaces], np.array(
        [truth for _, _, truth in surfaces]
    )


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", HARDLY_DIFFERENT)
def test_differences_between_surfaces_that_hardly_differ_are_good_to_5_percent_of_their_range_at_any_tolerance(
    kinematics,
):
    asked, true = hardly_different(kinematics, 0.01)  # on the coarsest mesh they were up to 41 % of their range off
    together = solve_many(asked)
    found = np.array([(p.sed_ending, p.normal_force, p.tangential_force) for p in together])
    assert (np.ptp(found - true, axis=0) < 0.05 * np.ptp(true, axis=0)).all()
    assert solve(together[0].scene).dofs < together[0].dofs


def test_surfaces_that_the_finest_mesh_does_not_tell_apart_say_in_what_and_by_how_much(monkeypatch):
    monkeypatch.setitem(FINENESS, "small", (5, 6, 8))
    asked, true = hardly_different("small", None)
    found = solve_many(asked)
    seds = np.array([p.sed_ending for p in found])
    wrong = np.ptp(seds - true[:, 0]) / np.ptp(true[:, 0])
    assert wrong > 0.02
    (told,) = {w for p in found for w in p.warnings if w.startswith("Differences in SED")}
    part = float(told.split(" may be off by ")[1].split(" %")[0])
    assert 100.0 * wrong < part < 1000.0 * wrong
    quick = solve_many([replace(s, solve=Solve(evidence="quick")) for s in asked])
    assert not [w for p in quick for w in p.warnings if w.startswith("Differences")]


@pytest.mark.slow
def test_courses_of_surfaces_that_hardly_differ_are_marched_and_told_once_on_a_mesh_that_tells_them_apart():
    asked, true = hardly_different("small", None, "history")
    told = []
    together = solve_many(asked, watch=lambda number, *_: told.append(number))
    assert told == [0, 1, 2]
    found = np.array([p.sed_ending for p in together])
    assert np.ptp(found - true[:, 0]) < 0.05 * np.ptp(true[:, 0])
    assert solve(asked[0]).dofs < together[0].dofs
