# ruff: noqa: N803, N806 - the letters of the literature
"""Tissues that relax at finite strain: closed forms, derivatives, what is never gained, limits, the whole finger."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver import Relaxation, solve
from solver.accuracy.audits import course_audits
from solver.body.finite import FiniteBody
from solver.constitutive import Hooke, NeoHooke, Past, Prony, overstress
from solver.constitutive import stress as relaxed_stress
from solver.constitutive import tangent as relaxed_tangent
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState, Newton, Termination
from solver.equilibrium.relaxation import CondensedRelaxing
from solver.progress import listening
from tests.solver.finite_examples import block
from tests.solver.oracle import finite as oracle
from tests.solver.oracle.laws import overstress_energy, overstress_tangent
from tests.solver.test_relaxing import TABLE, TIMES, materials_with
from tests.solver.test_relaxing import published as published_scene

published = partial(published_scene, kinematics="finite")
entries = st.floats(-0.4, 0.4)
gradients = st.tuples(entries, entries, entries, entries).map(lambda g: np.eye(2) + np.reshape(g, (2, 2)))
tensors = st.tuples(*[st.floats(0.5, 2.0)] * 2, st.floats(-0.4, 0.4), st.floats(0.5, 2.0)).map(np.array)
G = 0.027


def one_term(tau, g=0.3):
    return Past.at_rest(np.array([[g * G]]), np.array([[tau]]))


def shear_by(gamma):
    return np.array([[1.0, gamma], [0.0, 1.0]])


@given(T=tensors, F=gradients, direction=gradients)
def test_within_a_step_the_stress_is_the_derivative_of_an_energy_and_the_tangent_that_of_the_stress(T, F, direction):
    small = 1e-30
    complex_F = F + 1j * small * direction
    slope = overstress_energy(T, complex_F).imag / small
    np.testing.assert_allclose(np.sum(overstress(T, F) * direction), slope, rtol=1e-10, atol=1e-12)
    bend = overstress(T, complex_F).imag / small
    stress_change = np.einsum("aAbB,bB->aA", overstress_tangent(T, F), direction)
    np.testing.assert_allclose(stress_change, bend, rtol=1e-9, atol=1e-11)


@given(path=st.lists(gradients, min_size=1, max_size=4), angle=st.floats(-4.0, 4.0))
def test_turning_the_body_turns_the_stress_and_nothing_else(path, angle):
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    past, turned_past = one_term(0.7), one_term(0.7)
    for F in path:
        T_here, T_turned = past.over(0.5)[0], turned_past.over(0.5)[0]
        past, turned_past = past.after(F[None], 0.5), turned_past.after((R @ F)[None], 0.5)
    np.testing.assert_allclose(turned_past.energy(), past.energy(), rtol=1e-9, atol=1e-14)
    stress = overstress(T_here, path[-1])
    np.testing.assert_allclose(overstress(T_turned, R @ path[-1]), R @ stress, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("tau", sorted(TABLE))
def test_a_block_sheared_by_half_relaxes_as_the_standard_linear_solid_does_whatever_the_steps(tau):
    """In simple shear the network's stress is linear in the shear at any size (Green and Tobolsky 1946)."""
    law, past, last_time, stresses = NeoHooke(G, 0.0), one_term(tau), 0.0, []
    for time in sorted({0.25, 0.75, *TIMES}):
        F = shear_by(0.5 * min(time, 1.0))
        T = past.over(time - last_time)[0]
        past, last_time = past.after(F[None], time - last_time), time
        if time in TIMES:
            cauchy = overstress(T, F) @ F.T
            stresses.append(0.7 * min(time, 1.0) + cauchy[0, 1] / (G * 0.5))
    assert law.shear == pytest.approx(G / 2.0)
    np.testing.assert_allclose(stresses, TABLE[tau], atol=6e-7)


def test_the_normal_stress_of_a_steadily_growing_shear_converges_at_second_order_to_its_closed_form():
    """N1 = 2 G (rate tau)^2 (1 - (1 + t/tau) exp(-t/tau)) (Bird, Armstrong and Hassager 1987, start of shear)."""
    tau, rate, errors = 0.6, 0.8, []
    expected = 2.0 * 0.3 * G * (rate * tau) ** 2 * (1.0 - (1.0 + 1.0 / tau) * np.exp(-1.0 / tau))
    for steps in (8, 16, 32):
        past = one_term(tau)
        for number in range(1, steps + 1):
            F = shear_by(rate * number / steps)
            T = past.over(1.0 / steps)[0]
            past = past.after(F[None], 1.0 / steps)
        cauchy = overstress(T, F) @ F.T
        errors.append(abs(cauchy[0, 0] - cauchy[1, 1] - expected) / expected)
    assert errors[-1] < 1e-3
    assert np.log2(errors[0] / errors[1]) > 1.9
    assert np.log2(errors[1] / errors[2]) > 1.9


@given(path=st.lists(gradients, min_size=1, max_size=6))
def test_held_still_energy_only_falls_and_the_networks_stay_positive(path):
    past = one_term(0.7)
    for F in path:
        past = past.after(F[None], 0.3)
        metric = past.metric[0, 0]
        assert metric[0] * metric[1] > metric[2] ** 2
        assert metric[3] > 0.0
        assert past.energy()[0] >= -1e-16
    energies = [past.energy()[0]]
    for _ in range(6):
        past = past.after(path[-1][None], 0.4)
        energies.append(past.energy()[0])
    assert (np.diff(energies) <= 1e-16).all()


def test_the_work_done_on_a_cycle_is_what_is_lost_and_fine_steps_balance_it():
    """Lost: g G/(2 tau) times the sum of a + 1/a - 2, in time; the cycle returns the body alone."""
    steps, tau = 2000, 0.5
    past, work, dissipation, last_F = one_term(tau), 0.0, 0.0, shear_by(0.0)
    P = np.zeros((2, 2))
    for number in range(1, steps + 1):
        F = shear_by(0.6 * np.sin(2.0 * np.pi * number / steps))
        last_P, T = P, past.over(1.0 / steps)[0]
        P = overstress(T, F)
        work += np.sum((P + last_P) / 2.0 * (F - last_F))
        past, last_F = past.after(F[None], 1.0 / steps), F
        A, B = (_tensor(t) for t in (past.metric[0, 0], past.previous[0]))
        eigen = np.linalg.eigvals(A @ np.linalg.inv(B)).real
        dissipation += 0.3 * G / (2.0 * tau) * np.sum(eigen + 1.0 / eigen - 2.0) / steps
    assert dissipation > 0.0
    assert work == pytest.approx(dissipation + past.energy()[0], rel=1e-4)


def _tensor(t):
    return np.array([[t[0], t[2], 0.0], [t[2], t[1], 0.0], [0.0, 0.0, t[3]]])


def test_at_once_the_tissue_has_its_own_moduli_and_in_the_end_the_relaxed_ones():
    law = Prony(0.08, 0.48, ((0.2, 0.07), (0.4, 1.4)))
    past = Past.at_rest(np.array([[g * law.shear for g, _ in law.terms]]), np.array([[tau for _, tau in law.terms]]))
    end = NeoHooke(*law.long_term_moduli.engineering)
    A = relaxed_tangent(end, np.eye(2)) + overstress_tangent(past.over(1e-9)[0], np.eye(2))
    hooke = Hooke(0.08, 0.48)
    np.testing.assert_allclose([A[0, 0, 0, 0], A[0, 0, 1, 1], A[0, 1, 0, 1]],
                               [hooke.lame + 2 * hooke.shear, hooke.lame, hooke.shear], rtol=1e-7)  # fmt: skip
    F = np.array([[1.3, 0.4], [-0.1, 0.8]])
    past = past.after(F[None], 1e-9)
    for _ in range(3):
        residual_stress = overstress(past.over(20.0)[0], F)
        past = past.after(F[None], 20.0)
    assert np.abs(residual_stress).max() < 1e-6 * np.abs(relaxed_stress(end, F)).max()


def test_after_a_sudden_strain_the_stress_of_the_shape_falls_as_the_exponential():
    F, past = np.array([[1.3, 0.4], [-0.1, 0.8]]), one_term(0.5)
    instantaneous = overstress(past.over(1e-9)[0], F)
    past = past.after(F[None], 1e-9)
    for time in (0.2, 0.5, 1.5):
        np.testing.assert_allclose(overstress(past.over(time)[0], F), np.exp(-time / 0.5) * instantaneous, rtol=1e-7)


def relaxing_block(distortion=0.06):
    law = Prony(0.08, 0.48, ((0.3, 0.5),))
    body = FiniteBody.of(block(distortion=distortion, seed=1), [NeoHooke(*law.long_term_moduli.engineering)])
    relaxing = CondensedRelaxing(body, [law])
    rng = np.random.default_rng(3)
    u = rng.uniform(-0.015, 0.015, body.mesh.nodes.shape)
    u[body.mesh.held] = 0.0
    start = replace(EquilibriumState.undeformed(body.condensed), u=u)
    relaxing.ready(0.2)
    relaxing.commit(start.u, 0.2)
    relaxing.ready(0.3)
    return Newton(relaxing), start, rng


def oracle_forces_and_tangents(newton, u, pressure):
    """Forces (e, 18) and tangents (e, 18, 18) in plain NumPy."""
    body, T = newton.condensed.body, newton.condensed.tensor
    force, tangent = oracle.forces_and_tangents(body, u, pressure)
    gradient = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1)
    bend = overstress_tangent(T, oracle.deformation(body, u))
    count = len(body.elements.nodes)
    relaxing_part = np.einsum("eq,eqaAbB,eqiA,eqjB->eiajb", body.elements.weight, bend, gradient, gradient)
    return force + newton.condensed.excess(u), tangent + relaxing_part.reshape(count, 18, 18)


def test_compiled_forces_and_tangents_agree_with_the_plain_ones_and_with_differences():
    newton, start, rng = relaxing_block()
    body, pressure = newton.condensed.body, np.zeros((len(newton.condensed.body.elements.nodes), 3))
    u = start.u + 0.3 * start.u[::-1]
    u[body.mesh.held] = 0.0
    assert newton.condensed.assemble(u, pressure) > 0.0
    force, tangent = oracle_forces_and_tangents(newton, u, pressure)
    inside = np.linalg.inv(tangent[:, 16:, 16:])
    across = tangent[:, :16, 16:] @ inside
    outer = tangent[:, :16, :16] - across @ tangent[:, 16:, :16]
    expected = np.zeros(body.size + 1)
    np.add.at(expected, body.elements.unknown.reshape(-1, 16), force[:, :16] - (across @ force[:, 16:, None])[:, :, 0])
    scale = np.abs(tangent).max()
    np.testing.assert_allclose(np.tril(newton.condensed.system.tangent), np.tril(outer), atol=1e-12 * scale)
    np.testing.assert_allclose(newton.condensed.all_forces, expected[:-1], atol=1e-13 * scale)
    # the same forces for a tangent kept from there
    other_u = 0.7 * u
    assert newton.condensed.assemble(other_u, None) > 0.0
    force, _ = oracle_forces_and_tangents(newton, other_u, pressure)
    expected[:] = 0.0
    np.add.at(expected, body.elements.unknown.reshape(-1, 16), force[:, :16] - (across @ force[:, 16:, None])[:, :, 0])
    np.testing.assert_allclose(newton.condensed.all_forces, expected[:-1], atol=1e-13 * scale)
    direction, h = rng.normal(size=u.shape), 1e-6
    local = direction[body.elements.nodes].reshape(len(body.elements.nodes), 18)
    ahead, behind = (newton.condensed.excess(u + sign * h * direction) for sign in (1.0, -1.0))
    elastic_tangent = oracle.forces_and_tangents(body, u, pressure)[1]
    change = np.einsum("eij,ej->ei", tangent - elastic_tangent, local)
    np.testing.assert_allclose((ahead - behind) / (2 * h), change, atol=1e-7 * np.abs(change).max())


def test_a_pressed_block_is_in_equilibrium_with_what_it_holds_of_the_past():
    newton, _, _ = relaxing_block(distortion=0.0)
    body = newton.condensed.body
    state = EquilibriumState.undeformed(body.condensed)
    newton.condensed.past = Past.at_rest(newton.condensed.past.shear, newton.condensed.past.tau)
    pushes = []
    for depth, duration in ((0.1, 0.1), (0.2, 0.1), (0.2, 0.5), (0.2, 5.0)):
        newton.condensed.ready(duration)
        state = newton.solve(state, LoadState(depth, 0.3), Termination(1e-9))
        force, _ = oracle.forces_and_tangents(body, state.u, np.zeros((len(body.elements.nodes), 3)))
        total = np.zeros(body.mesh.nodes.shape)
        np.add.at(total, body.elements.nodes, (force + newton.condensed.excess(state.u)).reshape(-1, 9, 2))
        total[body.mesh.skin] -= state.reaction
        total[body.mesh.held] = 0.0
        assert np.abs(total).max() < 1e-9 * state.force[1]
        newton.condensed.commit(state.u, duration)
        pushes.append(state.force[1])
    assert pushes[1] > pushes[2] > pushes[3]


def test_what_a_pressed_block_keeps_and_friction_does_not_take_is_what_its_tissue_loses():
    """Lost: g G/(2 tau) times the sum of a + 1/a - 2 over the eigenvalues of A B^-1, over the block and in time."""
    newton, _, _ = relaxing_block(distortion=0.0)
    body, weight = newton.condensed.body, newton.condensed.body.elements.weight.ravel()
    newton.condensed.past = Past.at_rest(newton.condensed.past.shear, newton.condensed.past.tau)
    state, states, rates, steps, time = EquilibriumState.undeformed(body.condensed), [], [0.0], 24, 0.5
    for number in range(1, steps + 1):
        newton.condensed.ready(time / steps)
        state = newton.solve(state, LoadState(0.2 * number / steps, 0.3), Termination(1e-9))
        newton.condensed.commit(state.u, time / steps)
        states.append(state)
        metrics = [
            np.array([_tensor(t) for t in tensors])
            for tensors in (newton.condensed.past.metric[:, 0], newton.condensed.past.previous)
        ]
        eigen = np.linalg.eigvals(metrics[0] @ np.linalg.inv(metrics[1])).real
        rate = (
            newton.condensed.past.shear[:, 0]
            / (2.0 * newton.condensed.past.tau[:, 0])
            * np.sum(eigen + 1.0 / eigen - 2.0, axis=1)
        )
        rates.append(float(rate @ weight))
    dissipation = float(np.trapezoid(rates, dx=time / steps))
    audits = course_audits(newton, [EquilibriumState.undeformed(newton.condensed), *states], relaxing=True)
    push, depth = np.array([0.0, *(s.force[1] for s in states)]), np.array([0.0, *(s.load.depth for s in states)])
    work = float(np.trapezoid(push, depth))
    assert audits["course_viscous_work"] == pytest.approx(dissipation / work, rel=0.02)
    assert dissipation > 0.02 * work
    assert "course_work_balance" not in audits


def bone_work(course):
    """Work done at the bone [N mm per mm], from what a result tells of its course."""
    columns = (course.normal_force, -course.bone_y, course.tangential_force, course.bone_x)
    push, depth, drag, travel = (np.concatenate([[0.0], values]) for values in columns)
    return abs(np.trapezoid(push, depth)) + abs(np.trapezoid(drag, travel))


@pytest.mark.slow
def test_pressed_lightly_the_finger_relaxes_as_at_small_strain():
    tissues = materials_with(Relaxation(0.3, 0.07), Relaxation(0.2, 0.3))
    predictions = [solve(published(tissues, kinematics=k, indentation=0.02)) for k in ("small", "finite")]
    small, finite = (p.history for p in predictions)
    assert finite.time[24] == small.time[25] == 1.0
    for name in ("sed_ending", "normal_force"):
        first, second = getattr(small, name), getattr(finite, name)
        np.testing.assert_allclose(second[11:25] / second[-1], first[12:26] / first[-1], rtol=0.01)
    assert finite.normal_force.max() > 1.2 * finite.normal_force[-1]
    # the slides differ in length
    dissipation = [p.audits["course_viscous_work"] * bone_work(p.history) for p in predictions]
    assert dissipation[1] == pytest.approx(dissipation[0], rel=0.01)


def test_in_the_end_a_sliding_finger_has_its_relaxed_moduli_and_overshoots_on_the_way():
    tissues = materials_with(Relaxation(0.3, 0.07), Relaxation(0.2, 1.4))
    prediction = solve(published(tissues))
    assert prediction.audits["course_against_direct"] < 1e-6
    assert prediction.audits["inner_forces"] < 1e-9
    assert prediction.audits["work_balance"] < 1e-9
    assert 5e-4 < prediction.audits["course_viscous_work"] < 0.01  # of the work that a slide of 1,844 mm took
    assert prediction.history.normal_force.max() > 1.2 * prediction.normal_force
    assert prediction.history.sed_ending[-1] == pytest.approx(prediction.sed_ending, rel=1e-6)


def test_a_relaxing_course_says_at_every_step_what_it_does_and_why_it_takes_steps():
    messages = []
    with listening(lambda stage, part: messages.append((stage, part))):
        prediction = solve(published(materials_with(Relaxation(0.3, 0.07)), indentation=0.3))
    course = [(stage, part) for stage, part in messages if "relax" in stage]
    assert len(course) >= len(prediction.history.time)
    for stage in dict.fromkeys(stage for stage, _ in course):
        parts = [part for other_stage, part in course if other_stage == stage]
        assert parts == sorted(parts)
        assert 0.0 <= parts[0] < parts[-1] <= 1.0
