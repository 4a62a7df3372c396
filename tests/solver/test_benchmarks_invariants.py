"""What must hold in the finger's own scene, whatever its numbers: balance, work, mirror, rate, scale, mesh."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solver import Friction, Loading, Material, Materials, Scene
from solver._kernels import SHEAR_LIMITED, SLIP
from solver.contact import FrictionLaw, LoadState
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import march_scene
from solver.equilibrium.load_stepping import sliding_load, solve_full_slip
from solver.mesh.mesher import Sizing
from solver.scene.published import SLIPPERINESS, STICKINESS, scene

LAWS = {"no bound": FrictionLaw(0.44, np.inf), "bound": FrictionLaw(0.44, 0.005)}
CASES = [("no bound", 1), ("no bound", -1), ("bound", 1), ("bound", -1)]


@pytest.fixture(scope="module")
def finger():
    return LinearFinger.of(scene(STICKINESS[1]), Sizing(8, 1.5))


@pytest.fixture(scope="module")
def histories(finger):
    loadings = {1: Loading(1.5, "+x"), -1: Loading(1.5, "-x")}
    return {(law, direction): march_instants(finger, LAWS[law], loadings[direction]) for law, direction in CASES}


def march_instants(finger, law, loading):
    bound = None if np.isinf(law.tau_max) else law.tau_max
    return march_scene(replace(finger.scene, friction=Friction(law.mu, bound), loading=loading), finger).instants


def load_of(law):
    return LoadState(0.0, law.mu, law.tau_max)


def bone_force(finger, contact: EquilibriumState):
    inner = finger.body.forces(finger.displacement(contact))
    return inner[finger.geometry.mesh.held].sum(axis=0)


@pytest.mark.parametrize("case", CASES)
def test_at_every_step_the_bone_bears_what_the_surface_presses(finger, histories, case):
    for instant in histories[case][1:]:
        contact = instant.state
        bone, total = bone_force(finger, contact), contact.normal.sum()
        assert abs(bone[0] + contact.tangential.sum()) < 1e-11 * total
        assert abs(bone[1] + total) < 1e-11 * total


@pytest.mark.parametrize("case", CASES)
def test_at_every_step_nothing_lies_below_the_surface_pulls_or_drags_beyond_the_law(finger, histories, case):
    law, length = LAWS[case[0]], finger.body.condensed.fixed_length
    for instant in histories[case][1:]:
        contact = instant.state
        push = contact.normal.max()
        assert contact.skin_positions(finger.body.condensed)[:, 1].min() - instant.depth > -1e-9 * instant.depth
        assert contact.normal.min() >= -1e-10 * push
        assert (np.abs(contact.tangential) - law.limit(contact.normal, length)).max() < 1e-10 * push


@pytest.mark.parametrize("case", CASES)
def test_in_steady_sliding_the_drag_is_the_law_s(finger, histories, case):
    law, contact = LAWS[case[0]], histories[case][-1].state
    assert set(contact.state[contact.touching].tolist()) <= {SLIP, SHEAR_LIMITED}
    drag, force = -case[1] * contact.tangential.sum(), contact.normal.sum()
    if law.tau_max == np.inf:
        assert drag / force == pytest.approx(law.mu, rel=1e-12)
    else:
        length = finger.body.condensed.fixed_length[contact.touching].sum()
        assert drag <= min(law.mu * force, law.tau_max * length)
        assert (contact.state == SHEAR_LIMITED).any()
        assert (contact.state == SLIP).any()


@pytest.mark.parametrize("case", CASES)
def test_at_every_step_the_bone_s_work_is_stored_or_rubbed_away(histories, case):
    """Trapezoidal work of each step; the rest closes gaps within a step, and is computed by itself."""
    instants = histories[case]
    energy_before, scale = 0.0, None
    for before, after in pairwise(instants):
        old, new = before.state, after.state
        push, drag = ((old.normal + new.normal) / 2, (old.tangential + new.tangential) / 2)
        bone_work = push.sum() * (after.depth - before.depth) - drag.sum() * (after.travel - before.travel)
        slip = new.u - old.u - [before.travel - after.travel, after.depth - before.depth]  # over the surface
        energy = 0.5 * np.sum(new.reaction * new.u)
        friction_work, gap_work = -drag @ slip[:, 0], -push @ slip[:, 1]
        scale = max(energy, scale or 0.0)
        assert abs(bone_work - (energy - energy_before) - friction_work - gap_work) < 1e-12 * scale
        assert friction_work > -1e-12 * scale
        energy_before = energy


@pytest.mark.parametrize("case", CASES)
def test_in_steady_sliding_all_the_bone_s_work_is_the_drag_s(histories, case):
    """Dissipation rate = T V: over the last step nothing more is stored."""
    before, after = histories[case][-2:]
    distance = after.travel - before.travel
    friction_work = -after.state.tangential @ (after.state.u - before.state.u + distance)[:, 0]
    assert friction_work == pytest.approx(-after.state.tangential.sum() * distance, rel=1e-10)


def test_speed_only_rescales_time(finger):
    courses = (march_instants(finger, LAWS["bound"], Loading(1.5, "+x", speed)) for speed in (1.0, 40.0))
    for slow, fast in zip(*courses, strict=True):
        assert slow.travel == fast.travel
        assert np.array_equal(slow.state.normal, fast.state.normal)
        assert (slow.time - 1.0) == pytest.approx(40.0 * (fast.time - 1.0), rel=1e-9) or slow.time <= 1.0


def test_without_friction_either_way_is_the_static_answer(finger):
    forwards, backwards = (solve_full_slip(finger.newton, LoadState(1.5, 0.0, sense=sense)) for sense in (-1, 1))
    assert np.array_equal(forwards.normal, backwards.normal)
    static = march_instants(finger, FrictionLaw(0.0, np.inf), Loading(1.5, "none"))[-1].state
    assert np.abs(static.normal - forwards.normal).max() < 1e-13 * forwards.normal.max()


@pytest.mark.parametrize("factor", [1e-3, 7.0, 1e6])
def test_stiffer_everything_scales_forces_and_energy_and_moves_nothing(finger, factor):
    soft = Materials()
    materials = Materials(*(Material(factor * t.E, t.nu) for t in (soft.epidermis, soft.dermis, soft.fat, soft.bone)))
    stiff_scene = Scene(friction=Friction(0.0), loading=Loading(1.5), materials=materials)
    stiff_finger = LinearFinger.of(stiff_scene, Sizing(8, 1.5))
    load = load_of(LAWS["bound"])._replace(depth=1.5, sense=-1)
    state = solve_full_slip(finger.newton, load)
    stiff_state = solve_full_slip(stiff_finger.newton, load._replace(tau=factor * load.tau))
    assert np.array_equal(state.state, stiff_state.state)
    assert np.abs(stiff_state.normal / factor - state.normal).max() < 1e-11 * state.normal.max()
    u, stiff_u = finger.displacement(state), stiff_finger.displacement(stiff_state)
    assert np.abs(u - stiff_u).max() < 1e-11
    assert stiff_finger.sed_ending(stiff_u) == pytest.approx(factor * finger.sed_ending(u), rel=1e-10)


@pytest.mark.parametrize("surface", [STICKINESS[0], STICKINESS[4], SLIPPERINESS[4]])
def test_three_meshes_come_closer_and_closer_to_one_answer(surface):
    """Each mesh has elements half as long; the last two differ by less than a third of a percent."""
    published_scene = scene(surface)
    seds = []
    for fineness in (6, 12, 24):
        finger = LinearFinger.of(published_scene, Sizing(fineness, published_scene.loading.indentation))
        contact = solve_full_slip(finger.newton, sliding_load(published_scene))
        seds.append(finger.sed_ending(finger.displacement(contact)))
    first, last = abs(seds[1] - seds[0]), abs(seds[2] - seds[1])
    assert last < 0.003 * seds[2]
    assert last < 0.5 * first
