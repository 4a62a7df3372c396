"""Search for the contact states: a primal-dual active set on the condensed skin of a linearised body.

Alart and Curnier 1991, Comput. Meth. Appl. Mech. Eng. 92, 353; Hüeber and Wohlmuth 2005, ibid. 194, 3147. All states
that contradict the solution change together. Once a set of states has recurred, only the worst one changes in a round.
"""

import numpy as np

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK, compile_loop, subroutine
from solver._kernels.contact_system import (
    RIGHT_SIDES,
    SHEAR_LIMITED_MU,
    assemble_contact_system,
    assemble_force_system,
    bounded_length,
    solve,
)
from solver.arrays import (
    Array,
    CondensedArrays,
    ContactControl,
    ContactStates,
    ContactSystem,
    LoadArguments,
    Narrow,
    Skin,
    SkinPosition,
    Slack,
    StateChanges,
)

SLACK = 1e-12  # a contradiction smaller than this, relative to the largest force or height, is round-off
DEPTH_CONTROL, PUSH_CONTROL, DRAG_CONTROL = 0, 1, 2  # prescribed: the depth; the normal force; normal force and drag
UNSETTLED, SINGULAR = 0, -1  # results of `solve_active_set` other than the number of solved systems


@subroutine
def contradictions(
    states: ContactStates, above: Array, slip: Array, length: Array, load: LoadArguments, changes: StateChanges
) -> int:
    """Fill `changes` with the states and senses that a solution requires; return the number of contradicting nodes.

    `above` (k,) are heights over the surface. `slip` (k,) are displacements along +x relative to the surface since the
    last step, and `length` (k,) comes from `bounded_length`. Where the load has a sense, every touching node slips with
    the friction force in that sense; otherwise nodes stick, slip and reverse.
    """
    state, sense, reaction = states
    next_state, next_sense, violations = changes
    count = 0
    force = height = 0.0
    for i in range(state.shape[0]):
        force = max(force, abs(reaction[i, 1]))
        height = max(height, abs(above[i]))
    slack = Slack(SLACK * force, SLACK * height, force / height if height > 0.0 else 0.0)
    for i in range(state.shape[0]):
        new_state, new_sense, violation = state[i], sense[i], 0.0
        if new_state == OPEN:
            if above[i] < -slack.height:
                new_state, violation = touching_state(load), -above[i] * slack.by_height
                new_sense = load.sense if load.sense != 0 else new_sense
        elif reaction[i, 1] < -slack.force:
            new_state, violation = OPEN, -reaction[i, 1]
        else:
            bound = load.tau * max(length[i], 0.0)
            new_state, new_sense, violation = friction_state(
                new_state, new_sense, reaction[i], slip[i], bound, load, slack
            )
        if new_state != state[i] or (new_state >= SLIP and new_sense != sense[i]):
            count += 1
        else:
            violation = -1.0
        next_state[i], next_sense[i], violations[i] = new_state, new_sense, violation
    return count


@subroutine
def touching_state(load: LoadArguments) -> int:
    """Return the first guess of the state of a node that comes into contact.

    With steep friction, slip is a bad guess: the node's drag may lift it off by more than it is pressed.
    """
    if load.sense != 0:
        return SHEAR_LIMITED if load.mu > SHEAR_LIMITED_MU and load.tau < np.inf else SLIP
    return STICK if load.mu > 0.0 and load.tau > 0.0 else SLIP


@subroutine
def friction_state(
    state: int, sense: int, reaction: Array, slip: float, bound: float, load: LoadArguments, slack: Slack
) -> tuple[int, int, float]:
    """Return the state and sense of a pressed node, and its violation of the current ones [N/mm]."""
    coulomb = load.mu * max(reaction[1], 0.0)
    most = min(coulomb, bound)
    slips = SLIP
    if bound < coulomb - slack.force or (state == SHEAR_LIMITED and bound <= coulomb + slack.force):
        slips = SHEAR_LIMITED
    new_state, new_sense, violation = slips, sense, reaction[1]
    if load.sense != 0:
        new_sense = load.sense
    elif state == STICK:
        new_state, violation = STICK, 0.0
        if abs(reaction[0]) > most + slack.force:
            new_sense = 1 if reaction[0] > 0.0 else -1
            new_state, violation = SHEAR_LIMITED if bound < coulomb else SLIP, abs(reaction[0]) - most
    elif slip * sense > slack.height and most > 0.0:
        new_state, violation = STICK, slip * sense * slack.by_height
    return new_state, new_sense, violation


@compile_loop
def solve_active_set(
    body: CondensedArrays,
    compliance: Array,
    skin: Skin,
    states: ContactStates,
    load: LoadArguments,
    position: SkinPosition,
    control: ContactControl,
    system: ContactSystem,
) -> int:
    """Solve the skin's system of contact, changing `states` until none contradicts the solution.

    States change at most `max_rounds` times. The result is exact for the linearised body if the rounds suffice. With a
    `compliance`, the unknowns are forces, of which there are fewer. Fills the reactions of `states`, and `steps` of
    `system`; with a compliance only the step to equilibrium. Returns the count of systems, UNSETTLED or SINGULAR.
    """
    size, steps, motion = states.state.shape[0], system.steps, system.motion
    sums, loads = np.zeros((2, 2 * size)), np.zeros(2)  # resultant: factors of steps or forces, constant part
    answer, unloaded_step = steps, loads
    by_forces = compliance.shape[0] > 0
    if by_forces:
        answer, unloaded_step = np.zeros((compliance.shape[0], RIGHT_SIDES)), np.zeros(compliance.shape[0])
        unload(body.force, compliance, sums, unloaded_step)
    else:
        sum_stiffness(body, control.kind, sums, loads)
    changes = StateChanges(np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size))
    entries = np.zeros(size, np.int32)  # how often each node came into contact
    history = np.empty((control.max_rounds + 1, 2, size), np.int32)
    ahead, above, slip = np.empty(size), np.empty(size), np.empty(size)
    may_hold = load.mu > 0.0 and load.tau > 0.0
    one_by_one, records = size < 0, min(size, 0)  # False and 0; numba compiles subroutines again for literals
    for round_number in range(control.max_rounds + 1):
        bounded_length(position.x, skin, system.length)
        if by_forces:
            count = assemble_force_system(compliance, skin, states, load, position, unloaded_step, system, answer)
        else:
            count = assemble_contact_system(body, skin, states, load, position, system)
        if not solve(system.matrix, system.right, count):
            return SINGULAR
        scatter_answer(system, count, by_forces, states, load.mu, answer)
        sticks, by_drag = count_in(states.state, STICK) > 0, control.kind == DRAG_CONTROL
        if by_drag and not sticks and may_hold and round_number < control.max_rounds:
            hold(states.state)  # the body is free along x without sticking nodes: all stick, then change one by one
            may_hold, one_by_one = False, True
            continue
        regular = control_forces(states.state, sums, loads, answer, control, sticks, motion)
        if by_forces:
            regular &= recover_steps(compliance, answer, unloaded_step, steps, states.reaction)
        else:
            regular &= recover_reaction(body, steps, states.reaction)
        if not regular or round_number == control.max_rounds:
            return UNSETTLED if regular else SINGULAR
        look_ahead(position, steps, motion, by_drag and not sticks, ahead, above, slip)
        bounded_length(ahead, skin, system.length)
        if contradictions(states, above, slip, system.length, load, changes) == 0:
            return round_number + 1
        change_states(states, changes, slip, entries, one_by_one)
        cycle = record_states(states, history, records)
        one_by_one, records = one_by_one or cycle, 1 if cycle else records + 1
    return UNSETTLED


@subroutine
def sum_stiffness(body: CondensedArrays, kind: int, sums: Array, loads: Array) -> None:
    """Fill the derivatives of the resultant with respect to steps, `sums` (2, 2 k), and its constant part `loads` (2,).

    Nothing is filled where the depth is prescribed.
    """
    if kind != DEPTH_CONTROL:
        for i in range(body.force.shape[0]):
            loads[i % 2] += body.force[i]
            for c in range(body.force.shape[0]):
                sums[i % 2, c] += body.stiffness[i, c]


@subroutine
def unload(force: Array, compliance: Array, sums: Array, unloaded_step: Array) -> None:
    """Fill the derivatives of the resultant with respect to forces, `sums` (2, 2 k), and `unloaded_step` (2 k + m,)."""
    for i in range(force.shape[0]):
        sums[i % 2, i] = 1.0
        for c in range(unloaded_step.shape[0]):
            unloaded_step[c] -= force[i] * compliance[i, c]


@subroutine
def scatter_answer(
    system: ContactSystem, count: int, by_forces: bool, states: ContactStates, mu: float, answer: Array
) -> None:
    """Fill `answer` with the unknowns; where these are forces, also with the friction forces of slipping nodes."""
    for r in range(count):
        for c in range(RIGHT_SIDES):
            answer[system.free[r], c] = system.right[r, c]
    for i in range(states.state.shape[0]):
        if by_forces and states.state[i] == SLIP:
            for c in range(RIGHT_SIDES):
                answer[2 * i, c] = states.sense[i] * mu * answer[2 * i + 1, c]


@subroutine
def look_ahead(
    position: SkinPosition, steps: Array, motion: Array, loose: bool, ahead: Array, above: Array, slip: Array
) -> None:
    """Fill the next positions of the skin's nodes along and over the surface, and their slip (k,).

    The slip is zero where the body is `loose`: the surface does not hold it along x.
    """
    for i in range(ahead.shape[0]):
        ahead[i] = position.x[i] + steps[2 * i, 0]
        above[i] = position.above[i] + steps[2 * i + 1, 0] - motion[0]
        slip[i] = 0.0 if loose else ahead[i] - position.anchor[i] - motion[1]


@subroutine
def count_in(state: Narrow, which: int) -> int:
    """Return the number of nodes in the contact state `which`."""
    count = 0
    for i in range(state.shape[0]):
        count += state[i] == which
    return count


@subroutine
def hold(state: Narrow) -> None:
    """Set all touching nodes to STICK."""
    for i in range(state.shape[0]):
        if state[i] != OPEN:
            state[i] = STICK


@subroutine
def recover_reaction(body: CondensedArrays, steps: Array, reaction: Array) -> bool:
    """Fill the surface's `reaction` (k, 2) to `steps` (2 k, 4); return False where a number is not finite."""
    resultant = 0.0
    for i in range(steps.shape[0]):
        total = body.force[i]
        for c in range(steps.shape[0]):
            total += body.stiffness[i, c] * steps[c, 0]
        reaction[i // 2, i % 2] = total
        resultant += total
    return np.isfinite(resultant)


@subroutine
def recover_steps(compliance: Array, answer: Array, unloaded_step: Array, steps: Array, reaction: Array) -> bool:
    """Fill the surface's `reaction` (k, 2) and the step to equilibrium; return False where a number is not finite."""
    size, resultant = steps.shape[0], 0.0
    for i in range(size):
        reaction[i // 2, i % 2] = answer[i, 0]
        steps[i, 0] = unloaded_step[i]
        resultant += answer[i, 0]
    for i in range(answer.shape[0]):
        if answer[i, 0] != 0.0:
            for c in range(size):
                steps[c, 0] += answer[i, 0] * compliance[i, c]
    return np.isfinite(resultant)


@subroutine
def change_states(states: ContactStates, changes: StateChanges, slip: Array, entries: Narrow, one_by_one: bool) -> None:
    """Change all states that contradict the solution, or only the worst one.

    `entries` (k,) counts how often a node comes into contact; every second time it begins in slip.
    """
    state, sense, _ = states
    next_state, next_sense, violations = changes
    worst = 0
    for i in range(state.shape[0]):
        if violations[i] > violations[worst]:
            worst = i
    for i in range(state.shape[0]):
        if one_by_one and i != worst:
            continue
        if state[i] == OPEN and (next_state[i] == SHEAR_LIMITED or next_state[i] == STICK):
            entries[i] += 1
            if entries[i] % 2 == 0:
                if next_state[i] == STICK:
                    next_sense[i] = -1 if slip[i] > 0.0 else 1
                next_state[i] = SLIP
        state[i], sense[i] = next_state[i], next_sense[i]


@subroutine
def record_states(states: ContactStates, history: Narrow, count: int) -> bool:
    """Return whether the states are among the first `count` of the `history` (n, 2, k), and add them to it.

    If so, the history restarts with these states.
    """
    state, sense, _ = states
    cycle = False
    for n in range(count):
        same = True
        for i in range(state.shape[0]):
            same &= history[n, 0, i] == state[i] and history[n, 1, i] == sense[i]
        cycle |= same
    place = 0 if cycle else count
    for i in range(state.shape[0]):
        history[place, 0, i], history[place, 1, i] = state[i], sense[i]
    return cycle


@subroutine
def control_forces(
    state: Narrow, sums: Array, loads: Array, answer: Array, control: ContactControl, sticks: bool, motion: Array
) -> bool:
    """Add the changes of depth, and of travel if a node `sticks`, that balance the prescribed forces.

    They change the first column of `answer` (2 k, 4). The surface's resultant along x and y is `loads` (2,) plus `sums`
    (2, 2 k) times the answer. Fills `motion` (2,) with both changes, at most `max_increment`. Returns False where
    nothing touches, or no change balances the forces.
    """
    motion[0] = motion[1] = 0.0
    if control.kind == DEPTH_CONTROL or count_in(state, OPEN) == state.shape[0]:
        return control.kind == DEPTH_CONTROL
    drag, push = np.zeros(RIGHT_SIDES), np.zeros(RIGHT_SIDES)
    for c in range(sums.shape[1]):
        for s in range(RIGHT_SIDES):
            drag[s] += sums[0, c] * answer[c, s]
            push[s] += sums[1, c] * answer[c, s]
    drag_residual, push_residual = control.drag - loads[0] - drag[0], control.push - loads[1] - push[0]
    depth_change = travel_change = 0.0
    if sticks and control.kind == DRAG_CONTROL:
        det = push[1] * drag[3] - push[3] * drag[1]
        if det == 0.0:
            return False
        depth_change = (push_residual * drag[3] - drag_residual * push[3]) / det
        travel_change = (push[1] * drag_residual - drag[1] * push_residual) / det
    elif push[1] != 0.0:
        depth_change = push_residual / push[1]
    most = max(abs(depth_change), abs(travel_change))
    if not np.isfinite(most):
        return False
    if most > control.max_increment:
        depth_change, travel_change = (
            depth_change * control.max_increment / most,
            travel_change * control.max_increment / most,
        )
    for c in range(answer.shape[0]):
        answer[c, 0] += depth_change * answer[c, 1] + travel_change * answer[c, 3]
    motion[0], motion[1] = depth_change, travel_change
    return True


@compile_loop
def update_contact_states(
    states: ContactStates, position: SkinPosition, load: LoadArguments, skin: Skin, length: Array
) -> int:
    """Update `states` that contradict the forces on the skin or its position; return the number of changes.

    The anchors are the positions from which nodes have slipped. Fills `length` (k,), on which the traction bound acts.
    """
    bounded_length(position.x, skin, length)
    size, slip = length.shape[0], np.empty(length.shape[0])
    for i in range(size):
        slip[i] = position.x[i] - position.anchor[i]
    changes = StateChanges(np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size))
    count = contradictions(states, position.above, slip, length, load, changes)
    for i in range(size):
        states.state[i], states.sense[i] = changes.state[i], changes.sense[i]
    return count
