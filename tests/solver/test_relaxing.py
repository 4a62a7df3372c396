"""Tissues that relax: closed forms of homogeneous states, the limits at once and in the end, and the whole finger."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Material, Materials, Relaxation, Scene, Solve, solve
from solver.body import Probes
from solver.constitutive import Prony
from solver.equilibrium import relaxation as relaxing
from solver.equilibrium.relaxation import RelaxingBody
from solver.mesh import block
from solver.scene.published import SLIPPERINESS, scene
from tests.solver.finite_examples import boundary_nodes
from tests.solver.oracle import relaxing as oracle

TIMES = [0.5, 1.0, 1.5, 2.0, 3.0, 6.0]
# E(t)/E0 = 1 - g + g exp(-t/tau), g = 0.3, strain ramped to 1 within 1 s and held: stress/E0 (elementary integral)
TABLE = {
    0.1: [0.379798, 0.729999, 0.700202, 0.700001, 0.700000, 0.700000],
    1.0: [0.468041, 0.889636, 0.815020, 0.769763, 0.725664, 0.701278],
    10.0: [0.496312, 0.985488, 0.971564, 0.958320, 0.933738, 0.873157],
}


def body_held_all_round(law):
    """A block whose whole boundary is held, its probes, and its boundary nodes' positions."""
    mesh = block(np.linspace(0, 2, 4), np.linspace(0, 1, 3), held=False)
    mesh = replace(mesh, held=boundary_nodes(mesh), skin=mesh.skin[:0])
    body = RelaxingBody(mesh, [law])
    count = len(mesh.elements)
    return (
        body,
        Probes.at(mesh, body.elastic.centre, np.arange(count), np.full((count, 2), 0.3)),
        mesh.nodes * mesh.driven,
    )


def ramp_and_hold(law, gradient):
    """Yield time, body and probes while the displacement `gradient` ramps within 1 s and is held."""
    body, probes, places = body_held_all_round(law)
    before = 0.0
    for time in sorted({0.25, 0.75, *TIMES}):
        body.ready(time - before, min(time, 1.0) * places @ gradient.T)
        body.advance(np.zeros((0, 2)))
        before = time
        forces = oracle.forces(body, [law])
        inside = np.ones(len(forces), bool)
        inside[body.mesh.held] = False
        assert np.abs(forces[inside]).max() < 1e-14
        yield time, body, probes


@pytest.mark.parametrize("tau", sorted(TABLE))
def test_a_sheared_block_relaxes_as_the_standard_linear_solid_does_whatever_the_steps(tau):
    law = Prony(0.08, 0.48, ((0.3, tau),))
    shear = np.array([[0.0, 0.01], [0.0, 0.0]])
    stresses = {t: oracle.stress(body, probes) for t, body, probes in ramp_and_hold(law, shear)}
    ratios = [stresses[t][:, 0, 1] / (law.shear * 0.01) for t in TIMES]
    np.testing.assert_allclose(ratios, np.array(TABLE[tau])[:, None] * np.ones(len(ratios[0])), atol=6e-7)


def test_a_block_pressed_between_walls_keeps_its_bulk_stress_and_relaxes_by_its_shear_alone():
    law = Prony(0.08, 0.48, ((0.3, 1.0),))
    gradient = np.array([[0.0, 0.0], [0.0, -0.01]])
    stresses = {t: oracle.stress(body, probes) for t, body, probes in ramp_and_hold(law, gradient)}
    for time, part in zip(TIMES, TABLE[1.0], strict=True):
        expected = -0.01 * (law.bulk * min(time, 1.0) + 4.0 / 3.0 * law.shear * part)
        np.testing.assert_allclose(stresses[time][:, 1, 1], expected, rtol=1e-6)


def test_a_light_press_relaxes_alike_at_small_and_at_finite_strain():
    tissue = Material(0.08, 0.2, prony=(Relaxation(0.6, 0.5),))
    press = Scene(materials=Materials(tissue, tissue, tissue), friction=Friction(0.0), loading=Loading(0.05, "none"))
    forces = []
    for kinematics in ("small", "finite"):
        history = solve(replace(press, solve=Solve(kinematics, "history", 0.02, "quick"))).history
        forces.append(np.interp([0.5, 1.0, 2.0], history.time, history.normal_force))
    assert forces[0][1] > 1.3 * forces[0][2]  # it relaxes by far more than what both may differ by
    np.testing.assert_allclose(*forces, rtol=2e-3)


def test_a_body_is_kept_ready_for_the_last_few_lengths_of_steps_and_makes_the_others_anew(monkeypatch):
    """A course of steps of ever other lengths would else hold the factors of each."""
    law = Prony(0.08, 0.48, ((0.3, 1.0),))
    lengths = [0.1 * n for n in (1, 2, 3, 4, 5, 6, 1, 2, 7, 7, 1)]

    def take_steps():
        body, probes, places = body_held_all_round(law)
        for number, step in enumerate(lengths):
            body.ready(step, 0.01 * number * places @ np.array([[0.0, 1.0], [0.0, 0.0]]).T)
            body.advance(np.zeros((0, 2)))
        return body, body.energy(probes)

    relaxing_body, energy = take_steps()
    assert relaxing_body._elastic_body.cache_info().currsize == relaxing.STEP_LENGTHS < len(set(lengths))
    monkeypatch.setattr(relaxing, "STEP_LENGTHS", 100)
    np.testing.assert_array_equal(take_steps()[1], energy)


def test_the_energy_is_that_of_the_springs_alone():
    tau, g = 1.0, 0.3
    law = Prony(0.08, 0.48, ((g, tau),))
    shear = np.array([[0.0, 0.01], [0.0, 0.0]])
    energies = {t: body.energy(probes) for t, body, probes in ramp_and_hold(law, shear)}
    instantaneous = law.shear * 0.01**2 / 2.0
    for time in (1.0, 1.5, 2.0, 3.0, 6.0):
        damped = tau * (1.0 - np.exp(-1.0 / tau)) * np.exp(-(time - 1.0) / tau)  # of the strain in the damped spring
        np.testing.assert_allclose(energies[time], instantaneous * (1.0 - g + g * damped**2), rtol=1e-9)


def materials_with(*terms):
    usual = Materials()
    tissues = {name: replace(usual.of(name), prony=terms) for name in ("epidermis", "dermis", "fat")}
    return replace(usual, **tissues)


def published(materials, course="history", kinematics="small", **loading):
    slippery = scene(SLIPPERINESS[4])
    changed_loading = replace(slippery.loading, **loading)
    return replace(slippery, materials=materials, loading=changed_loading, solve=Solve(kinematics, course, 0.5))


def test_terms_that_relax_nothing_leave_the_elastic_course_as_it_was():
    elastic, inert = solve(published(Materials())), solve(published(materials_with(Relaxation(0.0, 0.01))))
    count = int((elastic.history.time <= 1.0).sum())
    np.testing.assert_allclose(inert.history.sed_ending[:count], elastic.history.sed_ending[:count], rtol=1e-9)
    assert inert.sed_ending == pytest.approx(elastic.sed_ending, rel=1e-9)


@pytest.mark.slow
def test_terms_that_take_for_ever_leave_the_pressing_as_it_was():
    elastic = solve(published(Materials(), slide="none")).history
    slow = solve(published(materials_with(Relaxation(0.3, 1e6)), slide="none")).history
    np.testing.assert_allclose(slow.sed_ending[:26], elastic.sed_ending[:26], rtol=2e-6)


def test_in_the_end_the_finger_has_its_relaxed_moduli_and_sliding_overshoots_on_the_way():
    tissues = materials_with(Relaxation(0.3, 0.07), Relaxation(0.2, 1.4))
    prediction = solve(published(tissues))
    long_term = Materials(*(_softened(tissues.of(name), 0.5) for name in ("epidermis", "dermis", "fat")))
    elastic = solve(published(long_term, course="steady"))
    assert prediction.sed_ending == pytest.approx(elastic.sed_ending, rel=1e-5)
    assert prediction.normal_force == pytest.approx(elastic.normal_force, rel=1e-5)
    assert prediction.audits["course_against_direct"] < 1e-5
    assert prediction.history.normal_force.max() > 1.2 * prediction.normal_force
    assert prediction.history.sed_ending[-1] == pytest.approx(prediction.sed_ending, rel=1e-5)


def _softened(tissue, part):
    """The elastic tissue with `part` of the shear modulus and the same bulk modulus."""
    shear, bulk = part * tissue.E / (2 * (1 + tissue.nu)), tissue.E / (3 * (1 - 2 * tissue.nu))
    return Material(9 * bulk * shear / (3 * bulk + shear), (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear)))


@pytest.mark.parametrize(
    ("kinematics", "of_force", "of_depth"),
    [("small", 1e-9, 1e-12), pytest.param("finite", 1e-7, 1e-9, marks=pytest.mark.slow)],
)
def test_a_given_force_presses_a_relaxing_finger_deeper_with_time(kinematics, of_force, of_depth):
    loading = {"indentation": None, "normal_force": 0.05, "slide": "none"}
    prediction = solve(published(materials_with(Relaxation(0.5, 0.5)), kinematics=kinematics, **loading))
    depth, time = -prediction.history.bone_y, prediction.history.time
    np.testing.assert_allclose(prediction.history.normal_force[time >= 1.0], 0.05, rtol=of_force)
    assert (np.diff(depth[time >= 1.0]) > -of_depth).all()
    assert depth[-1] > 1.1 * depth[np.argmin(np.abs(time - 1.0))]


def test_a_held_force_is_waited_for_as_long_as_the_softened_tissue_creeps():
    prediction = solve(published(materials_with(Relaxation(0.9, 1.0)), indentation=None, normal_force=0.01))
    assert prediction.audits["course_against_direct"] < 1e-6
    assert prediction.history.time[-1] > 14.0 * 1.0 / (1.0 - 0.9)
