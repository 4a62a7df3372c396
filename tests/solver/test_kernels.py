# ruff: noqa: N806 - the letters of the literature
"""The compiled loops agree with their NumPy twin, and the tangent with differences."""

import subprocess
import sys

import numpy as np
import pytest

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK, compile_loop, contact_system
from solver._kernels import elements as element_loops
from solver.body.finite import CondensedFinite, FiniteBody
from solver.constitutive import LAWS, NeoHooke
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState, Newton
from tests.solver.finite_examples import block, finger
from tests.solver.oracle import finite as oracle


def distorted_body(law, seed=1):
    body = FiniteBody.of(block(distortion=0.06, seed=seed), [law])
    u = np.random.default_rng(seed).uniform(-0.015, 0.015, body.mesh.nodes.shape)
    u[body.mesh.held] = 0.0
    return body, u


def assemble(body, u, pressure):
    condensed = CondensedFinite(body)
    least_det = element_loops.assemble(u, pressure, True, body.elements, condensed.system)
    return condensed, least_det


MEMBERS = [law(0.08, nu) for law in LAWS for nu in (0.48, 0.4999)]


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_compiled_forces_and_tangent_agree_with_the_plain_ones(law):
    body, u = distorted_body(law)
    pressure = np.random.default_rng(2).normal(0.0, 0.01, (len(body.elements.nodes), 3))
    condensed, least_det = assemble(body, u, pressure)
    force, _ = oracle.system(body, u, pressure)
    _, tangent = oracle.condense_centres(body, u, pressure)
    np.testing.assert_allclose(condensed.all_forces, force, atol=1e-13 * np.abs(tangent).max())
    np.testing.assert_allclose(np.tril(condensed.system.tangent), np.tril(tangent), atol=1e-12 * np.abs(tangent).max())
    assert least_det == pytest.approx(np.linalg.det(oracle.deformation(body, u)).min(), rel=1e-12)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_forces_for_a_tangent_kept_from_another_state_agree_with_the_plain_ones(law):
    body, u = distorted_body(law)
    condensed, _ = assemble(body, u, oracle.pressure(body, u))
    _, tangent = oracle.forces_and_tangents(body, u, oracle.pressure(body, u))
    other_u = distorted_body(law, seed=5)[1]
    least_det = element_loops.assemble(other_u, oracle.pressure(body, other_u), False, body.elements, condensed.system)
    force, _ = oracle.forces_and_tangents(body, other_u, oracle.pressure(body, other_u))
    centre = np.linalg.solve(tangent[:, 16:, 16:], force[:, 16:, None])
    expected, free = np.zeros(body.size), body.elements.unknown.reshape(-1, 16) >= 0
    condensed_force = force[:, :16] - (tangent[:, :16, 16:] @ centre)[:, :, 0]
    np.add.at(expected, body.elements.unknown.reshape(-1, 16)[free], condensed_force[free])
    np.testing.assert_allclose(condensed.all_forces, expected, atol=1e-13 * np.abs(tangent).max())
    np.testing.assert_allclose(condensed.system.recovery_matrix[:, :, 16], centre[:, :, 0], atol=1e-12)
    assert least_det == pytest.approx(np.linalg.det(oracle.deformation(body, other_u)).min(), rel=1e-12)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_forces_of_a_strain_that_is_nearly_nothing_keep_their_own_digits(law):
    """They are those of the undeformed body's stiffness, but for the strain itself: stiff bone has such."""
    body, u = distorted_body(law)
    small = 1e-12 * u
    _, tangent = oracle.condense_centres(body, np.zeros_like(u), np.zeros((len(body.elements.nodes), 3)))
    condensed, _ = assemble(body, small, oracle.pressure(body, small))
    unknown = body.elements.unknown.reshape(-1, 16)
    local_u = np.where(unknown >= 0, small[body.elements.nodes[:, :8]].reshape(-1, 16), 0.0)
    expected = np.zeros(body.size)
    np.add.at(expected, unknown[unknown >= 0], (tangent @ local_u[:, :, None])[:, :, 0][unknown >= 0])
    np.testing.assert_allclose(condensed.all_forces, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_forces_are_the_derivative_of_the_energy_and_the_tangent_that_of_the_forces(law):
    body, u = distorted_body(law)
    direction = np.random.default_rng(3).normal(size=u.shape)
    pressure = oracle.pressure(body, u)
    force, tangent = oracle.forces_and_tangents(body, u, pressure)
    local = direction[body.elements.nodes].reshape(len(body.elements.nodes), 18)
    h = 1e-6
    slope = (oracle.energy(body, u + h * direction) - oracle.energy(body, u - h * direction)) / (2 * h)
    assert np.sum(force * local) == pytest.approx(slope, rel=1e-7)
    ahead = oracle.forces_and_tangents(body, u + h * direction, pressure)[0]
    behind = oracle.forces_and_tangents(body, u - h * direction, pressure)[0]
    change = np.einsum("eij,ej->ei", tangent, local)
    np.testing.assert_allclose((ahead - behind) / (2 * h), change, atol=1e-7 * np.abs(change).max())


@pytest.mark.parametrize("columns", [1, 2, 5, 12])
@pytest.mark.parametrize("held", ["top", "sides and top"])
def test_the_body_eliminated_part_by_part_is_the_body_solved_at_once(columns, held):
    body = FiniteBody.of(block(columns=columns, rows=3, distortion=0.1, held=held), [NeoHooke(0.08, 0.48)])
    u = np.zeros(body.mesh.nodes.shape)
    condensed, _ = assemble(body, u, np.zeros((len(body.elements.nodes), 3)))
    _, tangent = oracle.system(body, u, np.zeros((len(body.elements.nodes), 3)))
    force = np.random.default_rng(0).normal(size=body.size)
    skin = np.random.default_rng(1).normal(size=2 * len(body.mesh.skin))
    skin_force, stiffness = oracle.condense_to_skin(force, tangent, len(skin))
    assert condensed.inside.factorise(condensed.system.tangent)
    condensed_force = force.copy()
    np.testing.assert_allclose(condensed.inside.condense(condensed_force), skin_force, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(condensed.inside.stiffness, stiffness, rtol=1e-9, atol=1e-12 * np.abs(stiffness).max())
    inside = body.size - len(skin)
    for force_inside, load in ((condensed_force, force), (np.zeros(body.size), np.zeros(body.size))):
        expected = np.linalg.solve(tangent[:inside, :inside], -load[:inside] - tangent[:inside, inside:] @ skin)
        unknowns = condensed.inside.back_substitute(force_inside, skin)
        np.testing.assert_allclose(unknowns, np.r_[expected, skin], rtol=1e-9, atol=1e-9)


def test_a_tangent_without_stiffness_cannot_be_eliminated():
    condensed = CondensedFinite(FiniteBody.of(block(), [NeoHooke(0.08, 0.48)]))
    assert not condensed.inside.factorise(np.zeros_like(condensed.system.tangent))


@compile_loop
def solve_system(matrix, rhs, size):
    return contact_system.solve(matrix, rhs, size)


def test_the_system_of_contact_is_solved_as_a_dense_solver_solves_it():
    rng = np.random.default_rng(0)
    for size in range(1, 12):
        matrix, rhs = rng.normal(size=(size, size)) + 4.0 * np.eye(size), rng.normal(size=(size, 4))
        solution = rhs.copy()
        assert solve_system(np.r_[matrix.ravel(), 7.0], solution, size)
        np.testing.assert_allclose(solution, np.linalg.solve(matrix, rhs), rtol=1e-9)
    assert not solve_system(np.zeros(4), np.ones((2, 4)), 2)


def test_tributary_lengths_add_up_and_agree_with_the_plain_ones():
    x = np.cumsum(np.random.default_rng(0).uniform(0.1, 0.3, 9))
    length = np.empty(9)
    contact_system.tributary(x, (np.arange(9) % 2).astype(np.int32), length)
    np.testing.assert_allclose(length, oracle.tributary(x), rtol=1e-13)
    assert length.sum() == pytest.approx(x[-1] - x[0])


def test_contact_rows_are_the_derivatives_of_their_conditions():
    body, u = distorted_body(NeoHooke(0.08, 0.48))
    newton = Newton(body.condensed)
    start = EquilibriumState.undeformed(newton.condensed)
    state = np.array([STICK, SLIP, SHEAR_LIMITED, SHEAR_LIMITED, SHEAR_LIMITED, SLIP, OPEN], np.int32)
    sense = np.array([1, 1, -1, -1, -1, -1, 1], np.int32)
    load = LoadState(0.05, 0.4, 0.01, 0)
    anchor = newton.skin_x + 0.01

    def conditions(u):
        pressure = oracle.pressure(body, u)
        equilibrium = EquilibriumState(u, pressure, state, sense, start.reaction, load, 0)
        force = oracle.system(body, u, pressure)[0]
        place = equilibrium.skin_positions(newton.condensed)
        length = oracle.tributary(place[:, 0])
        out = force.copy()
        for i in range(len(body.mesh.skin)):
            x = body.size - 2 * len(body.mesh.skin) + 2 * i
            y = x + 1
            if state[i] != OPEN:
                out[y] = place[i, 1] - load.depth
            if state[i] == STICK:
                out[x] = place[i, 0] - anchor[i]
            elif state[i] == SLIP:
                out[x] = force[x] - sense[i] * load.mu * force[y]
            elif state[i] == SHEAR_LIMITED:
                out[x] = force[x] - sense[i] * load.tau * length[i]
        return out, equilibrium

    # the centres must be in equilibrium, since the condensed force is that of a body whose centres are
    u = relax_centres(body, u)
    residual, start_state = conditions(u)
    assert newton.linearise(start_state, anchor)
    residuals = []
    for part in (1e-4, -1e-4):
        stepped, largest, _ = newton.apply_step(start_state, load, newton.steps[:, 0], anchor, part)
        assert largest == pytest.approx(np.abs(stepped.u - u).max() / abs(part), rel=1e-6)
        residuals.append(conditions(relax_centres(body, stepped.u))[0])
    ahead, behind = residuals
    np.testing.assert_allclose((ahead - behind) / 2e-4, -residual, atol=1e-7 * np.abs(residual).max())


def relax_centres(body, u):
    u = u.copy()
    for _ in range(8):
        force, tangent = oracle.forces_and_tangents(body, u, oracle.pressure(body, u))
        u[body.elements.nodes[:, 8]] -= np.linalg.solve(tangent[:, 16:, 16:], force[:, 16:, None])[:, :, 0]
    return u


def test_probed_energy_of_an_even_squeeze_is_the_laws_own():
    newton, probes, _ = finger(4)
    body = newton.condensed.body
    F = np.array([[1.1, 0.2], [0.05, 0.9]])
    u = body.mesh.nodes @ (F - np.eye(2)).T
    Q = np.sum(F * F) - 2.0 - 2.0 * np.log(np.linalg.det(F))
    expected = body.elements.shear / 2.0 * Q + body.elements.lame / 2.0 * np.log(np.linalg.det(F)) ** 2
    np.testing.assert_allclose(probes.energy(u), expected[probes.endings.probes.element], rtol=1e-9)


@pytest.mark.slow
def test_no_bit_depends_on_which_loops_a_process_called_before():
    solving = (
        "from dataclasses import replace\n"
        "from solver.scene.published import SLIPPERINESS, scene\n"
        "from solver.response.solution import solve\n"
        "slippery = scene(SLIPPERINESS[0])\n"
        "slippery = replace(slippery, solve=replace(slippery.solve, kinematics='finite'))\n"
        "prediction = solve(slippery)\n"
        "print(prediction.sed_ending.hex(), prediction.error_estimate.hex(), prediction.normal_force.hex())\n"
    )
    other_loops = (
        "import numpy as np\n"
        "from solver._kernels import active_set, contact_system\n"
        "from solver.arrays import ContactStates, LoadArguments, Skin, SkinPosition\n"
        "state, zero = np.zeros(3, np.int32), np.zeros(3)\n"
        "skin, load = Skin(state, state, zero), LoadArguments(0.1, 0.1, 0.1, 1)\n"
        "contact_system.tributary(np.arange(3.0), np.array([0, 1, 0], np.int32), zero)\n"
        "contact_system.bounded_length(zero, skin, zero)\n"
        "states = ContactStates(state, state.copy(), np.zeros((3, 2)))\n"
        "active_set.update_contact_states(states, SkinPosition(zero, zero, zero), load, skin, zero.copy())\n"
    )
    alone, after_other_loops = (
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
        for script in (solving, other_loops + solving)
    )
    assert alone == after_other_loops
