"""The course in time at finite strain."""

from dataclasses import replace

import pytest

from solver._kernels import SLIP, STICK
from solver.accuracy.audits import course_audits
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState
from solver.equilibrium.load_stepping import march, solve_full_slip
from solver.verification.histories import press_and_slide
from tests.solver.finite_examples import finger
from tests.solver.oracle import finite as oracle


@pytest.mark.parametrize(
    ("depth", "mu", "tau", "direction"), [(1.5, 0.24, 0.00877, -1), (1.5, 0.62, 0.04707, -1), (2.0, 0.28, 0.008033, 1)]
)
def test_sliding_far_ends_in_the_state_that_is_solved_directly(depth, mu, tau, direction):
    newton, probes, _ = finger(5)
    *_, last = march(newton, press_and_slide(depth, mu, tau, direction, press=5, slides=15, distance=8.0))
    direct = solve_full_slip(newton, LoadState(depth, mu, tau, -direction))
    assert probes.average(last.u)[0] == pytest.approx(probes.average(direct.u)[0], rel=1e-10)


@pytest.fixture(scope="module")
def histories():
    """Courses of one finger in steps, and in steps half as long."""
    newton, _, _ = finger(4)
    courses = [press_and_slide(1.0, 0.4, 0.02, 1, press=8 * n, slides=16 * n, distance=2.0) for n in (1, 2)]
    return newton, [list(march(newton, course)) for course in courses]


def test_work_of_the_bone_is_stored_or_lost_to_friction_and_friction_only_takes(histories):
    newton, (_, fine) = histories
    body, last_state, work, friction_work = newton.condensed.body, fine[0], 0.0, 0.0
    for state in fine[1:]:
        push = (state.reaction + last_state.reaction) / 2.0
        work += push[:, 1].sum() * (state.load.depth - last_state.load.depth)
        work += push[:, 0].sum() * (state.load.travel - last_state.load.travel)
        before, after = (s.skin_positions(newton.condensed)[:, 0] - s.load.travel for s in (last_state, state))
        slip = after - before
        assert (state.reaction[:, 0] * slip).max() < 1e-12
        friction_work -= float(push[:, 0] @ slip)
        last_state = state
    energies = [oracle.energy(body, state.u) for state in (fine[0], fine[-1])]
    assert friction_work > 0.1 * work
    assert work == pytest.approx(energies[1] - energies[0] + friction_work, rel=3e-3)
    assert course_audits(newton, from_rest(newton, fine))["course_least_dissipation"] > -1e-14


def test_shorter_steps_leave_less_of_the_bones_work_over_and_simpsons_rule_next_to_nothing(histories):
    newton, courses = histories
    coarse, fine = (course_audits(newton, from_rest(newton, course)) for course in courses)
    assert fine["course_step_work"] < coarse["course_step_work"] / 2.0 < 0.005
    assert fine["course_work_balance"] < coarse["course_work_balance"] / 8.0 < 1e-4


def test_forces_reported_one_percent_too_large_are_out_of_balance_with_what_is_stored(histories):
    newton, (_, fine) = histories
    scaled = [replace(state, reaction=1.01 * state.reaction) for state in fine]
    audits = course_audits(newton, from_rest(newton, scaled))
    assert audits["course_step_work"] > 0.005
    assert audits["course_work_balance"] > 0.002


def test_points_stick_before_they_slip_and_turn_round_with_the_bone():
    newton, probes, _ = finger(5)
    forwards = press_and_slide(1.5, 0.44, 0.03009, -1, press=6, slides=20, distance=6.0)
    backwards = [load._replace(travel=6.0 - 0.5 * i) for i, load in enumerate([forwards[-1]] * 22, start=1)]
    states = list(march(newton, forwards + backwards))
    early, sliding, last = states[5], states[25], states[-1]
    assert (early.state == STICK).any()
    assert (sliding.state[sliding.touching] >= SLIP).all()
    assert (sliding.sense[sliding.touching] == 1).all()
    assert (last.sense[last.touching] == -1).all()
    opposite = solve_full_slip(newton, LoadState(1.5, 0.44, 0.03009, -1))
    assert probes.average(last.u)[0] == pytest.approx(probes.average(opposite.u)[0], rel=1e-9)


def from_rest(newton, states):
    return [EquilibriumState.undeformed(newton.condensed), *states]
