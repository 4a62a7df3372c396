"""The one search for contact states: a primal-dual active set on the condensed skin of a linearised body.

Alart and Curnier 1991, Comput. Meth. Appl. Mech. Eng. 92, 353; Hüeber and Wohlmuth 2005, ibid. 194, 3147. States that
contradict the solution change all at once; where that goes round in circles, the worst one changes alone.
"""

import numpy as np

from solver._kernels.compiling import OPEN, SHEAR_LIMITED, SLIP, STICK, compile_loop, subroutine
from solver._kernels.contact_system import (
    COLUMNS,
    STEEP,
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

SLACK = 1e-12  # a contradiction smaller than this, relative to the largest of its kind, is round-off
DEPTH_GIVEN, PUSH_GIVEN, DRAG_GIVEN = 0, 1, 2  # what drives the body: its depth, its normal force, its drag too
UNSETTLED, SINGULAR = 0, -1  # what `solve_active_set` returns in place of the number of systems it solved


@subroutine
def contradictions(
    states: ContactStates, above: Array, slip: Array, length: Array, load: LoadArguments, changes: StateChanges
) -> int:
    """Fill the `changes` of state and sense that a solution calls for; return how many nodes contradict it.

    `above` (k,) are heights over the surface, `slip` (k,) is how far each node went along +x relative to the surface
    since the last step, `length` (k,) as in `bounded_length`. Where the load has a sense every touching node slips, the
    friction force pointing there; else nodes stick, slip and turn round.
    """
    state, sense, reaction = states
    wanted, turned, badness = changes
    changed = 0
    force = height = 0.0
    for i in range(state.shape[0]):
        force = max(force, abs(reaction[i, 1]))
        height = max(height, abs(above[i]))
    slack = Slack(SLACK * force, SLACK * height, force / height if height > 0.0 else 0.0)
    for i in range(state.shape[0]):
        now, way, bad = state[i], sense[i], 0.0
        if now == OPEN:
            if above[i] < -slack.height:
                now, bad = touching_state(load), -above[i] * slack.by_height
                way = load.sense if load.sense != 0 else way
        elif reaction[i, 1] < -slack.force:
            now, bad = OPEN, -reaction[i, 1]
        else:
            bound = load.tau * max(length[i], 0.0)
            now, way, bad = friction_state(now, way, reaction[i], slip[i], bound, load, slack)
        if now != state[i] or (now >= SLIP and way != sense[i]):
            changed += 1
        else:
            bad = -1.0
        wanted[i], turned[i], badness[i] = now, way, bad
    return changed


@subroutine
def touching_state(load: LoadArguments) -> int:
    """Return the state in which a node is first thought to touch.

    Where friction is steep, slip is a bad guess: the node's own drag may lift it off by more than it is pressed.
    """
    if load.sense != 0:
        return SHEAR_LIMITED if load.mu > STEEP and load.tau < np.inf else SLIP
    return STICK if load.mu > 0.0 and load.tau > 0.0 else SLIP


@subroutine
def friction_state(
    was: int, sense: int, reaction: Array, slip: float, bound: float, load: LoadArguments, slack: Slack
) -> tuple[int, int, float]:
    """Return state and sense of a node that is pressed, and how badly it contradicts those it has [N/mm]."""
    coulomb = load.mu * max(reaction[1], 0.0)
    most = min(coulomb, bound)
    slips = SLIP
    if bound < coulomb - slack.force or (was == SHEAR_LIMITED and bound <= coulomb + slack.force):
        slips = SHEAR_LIMITED
    now, way, bad = slips, sense, reaction[1]
    if load.sense != 0:
        way = load.sense
    elif was == STICK:
        now, bad = STICK, 0.0
        if abs(reaction[0]) > most + slack.force:
            way = 1 if reaction[0] > 0.0 else -1
            now, bad = SHEAR_LIMITED if bound < coulomb else SLIP, abs(reaction[0]) - most
    elif slip * sense > slack.height and most > 0.0:
        now, bad = STICK, slip * sense * slack.by_height
    return now, way, bad


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
    """Solve the skin's system of contact, changing `states` up to `rounds` times until none contradicts the solution.

    Exact for the linearised body where the rounds suffice. With a `compliance`, forces are unknown, fewer than steps.
    Filled: reactions of `states`, and `steps` of `system`, but only that to equilibrium where forces are unknown.
    Returns the number of systems solved, UNSETTLED or SINGULAR.
    """
    size, steps, motion = states.state.shape[0], system.steps, system.motion
    sums, loads = np.zeros((2, 2 * size)), np.zeros(2)  # how the force of the surface follows steps, or forces
    answer, untouched = steps, loads
    by_forces = compliance.shape[0] > 0
    if by_forces:
        answer, untouched = np.zeros((compliance.shape[0], COLUMNS)), np.zeros(compliance.shape[0])
        release(body.force, compliance, sums, untouched)
    else:
        sum_stiffness(body, control.kind, sums, loads)
    changes = StateChanges(np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size))
    entered = np.zeros(size, np.int32)  # how often each node came to touch
    seen, known = np.empty((control.rounds + 1, 2, size), np.int32), 0
    ahead, above, slip = np.empty(size), np.empty(size), np.empty(size)
    one_by_one, may_hold = False, load.mu > 0.0 and load.tau > 0.0
    for turn in range(control.rounds + 1):
        bounded_length(position.x, skin, states.state, load.mu, system.length)
        if by_forces:
            count = assemble_force_system(compliance, skin, states, load, position, untouched, system, answer)
        else:
            count = assemble_contact_system(body, skin, states, load, position, system)
        if not solve(system.matrix, system.right, count):
            return SINGULAR
        take_answer(system, count, by_forces, states, load.mu, answer)
        stuck, dragged = count_in(states.state, STICK) > 0, control.kind == DRAG_GIVEN
        if dragged and not stuck and may_hold and turn < control.rounds:
            hold(states.state)  # free along x, the body needs a node that holds it: all are asked again, one by one
            may_hold, one_by_one = False, True
            continue
        regular = balance(states.state, sums, loads, answer, control, stuck, motion)
        if by_forces:
            regular &= follow(compliance, answer, untouched, steps, states.reaction)
        else:
            regular &= resist(body, steps, states.reaction)
        if not regular or turn == control.rounds:
            return UNSETTLED if regular else SINGULAR
        look_ahead(position, steps, motion, dragged and not stuck, ahead, above, slip)
        bounded_length(ahead, skin, states.state, load.mu, system.length)
        if contradictions(states, above, slip, system.length, load, changes) == 0:
            return turn + 1
        change_states(states, changes, slip, entered, one_by_one)
        met = met_before(states, seen, known)
        one_by_one, known = one_by_one or met, 1 if met else known + 1
    return UNSETTLED


@subroutine
def sum_stiffness(body: CondensedArrays, kind: int, sums: Array, loads: Array) -> None:
    """Fill how the surface's force along x and y follows steps, `sums` (2, 2 k) beside `loads` (2,), where asked."""
    if kind != DEPTH_GIVEN:
        for i in range(body.force.shape[0]):
            loads[i % 2] += body.force[i]
            for c in range(body.force.shape[0]):
                sums[i % 2, c] += body.stiffness[i, c]


@subroutine
def release(force: Array, compliance: Array, sums: Array, untouched: Array) -> None:
    """Fill how the surface's force follows forces, `sums` (2, 2 k), and the step `untouched` (2 k + m,) without it."""
    for i in range(force.shape[0]):
        sums[i % 2, i] = 1.0
        for c in range(untouched.shape[0]):
            untouched[c] -= force[i] * compliance[i, c]


@subroutine
def take_answer(
    system: ContactSystem, count: int, by_forces: bool, states: ContactStates, mu: float, answer: Array
) -> None:
    """Fill the `answer` with what was unknown, and with the drag of what slips where those are forces."""
    for r in range(count):
        for c in range(COLUMNS):
            answer[system.free[r], c] = system.right[r, c]
    for i in range(states.state.shape[0]):
        if by_forces and states.state[i] == SLIP:
            for c in range(COLUMNS):
                answer[2 * i, c] = states.sense[i] * mu * answer[2 * i + 1, c]


@subroutine
def look_ahead(
    position: SkinPosition, steps: Array, motion: Array, loose: bool, ahead: Array, above: Array, slip: Array
) -> None:
    """Fill where the skin's nodes will be along the surface and over it, and how far each slips (k,).

    Nothing slips where the body is `loose`, as along a surface that does not hold it.
    """
    for i in range(ahead.shape[0]):
        ahead[i] = position.x[i] + steps[2 * i, 0]
        above[i] = position.above[i] + steps[2 * i + 1, 0] - motion[0]
        slip[i] = 0.0 if loose else ahead[i] - position.anchor[i] - motion[1]


@compile_loop
def count_in(state: Narrow, which: int) -> int:
    """Return how many nodes are in a state of contact."""
    count = 0
    for i in range(state.shape[0]):
        count += state[i] == which
    return count


@compile_loop
def hold(state: Narrow) -> None:
    """Let every node that touches stick."""
    for i in range(state.shape[0]):
        if state[i] != OPEN:
            state[i] = STICK


@subroutine
def resist(body: CondensedArrays, steps: Array, reaction: Array) -> bool:
    """Fill the `reaction` (k, 2) of the surface to `steps` (2 k, 4); False where a number is not finite."""
    whole = 0.0
    for i in range(steps.shape[0]):
        total = body.force[i]
        for c in range(steps.shape[0]):
            total += body.stiffness[i, c] * steps[c, 0]
        reaction[i // 2, i % 2] = total
        whole += total
    return np.isfinite(whole)


@subroutine
def follow(compliance: Array, answer: Array, untouched: Array, steps: Array, reaction: Array) -> bool:
    """Fill the `reaction` (k, 2) of the surface and the step to equilibrium; False where a number is not finite."""
    size, whole = steps.shape[0], 0.0
    for i in range(size):
        reaction[i // 2, i % 2] = answer[i, 0]
        steps[i, 0] = untouched[i]
        whole += answer[i, 0]
    for i in range(answer.shape[0]):
        if answer[i, 0] != 0.0:
            for c in range(size):
                steps[c, 0] += answer[i, 0] * compliance[i, c]
    return np.isfinite(whole)


@subroutine
def change_states(states: ContactStates, changes: StateChanges, slip: Array, entered: Narrow, one_by_one: bool) -> None:
    """Change all states that contradict the solution, or the worst one alone.

    A node that comes to touch again and again slips every other time; `entered` (k,) counts that.
    """
    state, sense, _ = states
    wanted, turned, badness = changes
    worst = 0
    for i in range(state.shape[0]):
        if badness[i] > badness[worst]:
            worst = i
    for i in range(state.shape[0]):
        if one_by_one and i != worst:
            continue
        if state[i] == OPEN and (wanted[i] == SHEAR_LIMITED or wanted[i] == STICK):
            entered[i] += 1
            if entered[i] % 2 == 0:
                if wanted[i] == STICK:
                    turned[i] = -1 if slip[i] > 0.0 else 1
                wanted[i] = SLIP
        state[i], sense[i] = wanted[i], turned[i]


@subroutine
def met_before(states: ContactStates, seen: Narrow, known: int) -> bool:
    """Return whether the states are among the first `known` of those `seen` (n, 2, k), and add them to these.

    Where they are, they become the only ones.
    """
    state, sense, _ = states
    met = False
    for n in range(known):
        same = True
        for i in range(state.shape[0]):
            same &= seen[n, 0, i] == state[i] and seen[n, 1, i] == sense[i]
        met |= same
    place = 0 if met else known
    for i in range(state.shape[0]):
        seen[place, 0, i], seen[place, 1, i] = state[i], sense[i]
    return met


@subroutine
def balance(
    state: Narrow, sums: Array, loads: Array, answer: Array, control: ContactControl, stuck: bool, motion: Array
) -> bool:
    """Add to the first of `answer` (2 k, 4) the change of depth, and of travel where `stuck`, that meets given forces.

    `sums` (2, 2 k) is how the surface's force along x and y follows the answer, beside `loads` (2,). Fills `motion`
    (2,) with both changes, at most its stride. False where nothing touches, or nothing meets them.
    """
    motion[0] = motion[1] = 0.0
    if control.kind == DEPTH_GIVEN or count_in(state, OPEN) == state.shape[0]:
        return control.kind == DEPTH_GIVEN
    drag, push = np.zeros(COLUMNS), np.zeros(COLUMNS)
    for c in range(sums.shape[1]):
        for s in range(COLUMNS):
            drag[s] += sums[0, c] * answer[c, s]
            push[s] += sums[1, c] * answer[c, s]
    less, lack = control.drag - loads[0] - drag[0], control.push - loads[1] - push[0]
    deeper = along = 0.0
    if stuck and control.kind == DRAG_GIVEN:
        det = push[1] * drag[3] - push[3] * drag[1]
        if det == 0.0:
            return False
        deeper = (lack * drag[3] - less * push[3]) / det
        along = (push[1] * less - drag[1] * lack) / det
    elif push[1] != 0.0:
        deeper = lack / push[1]
    most = max(abs(deeper), abs(along))
    if not np.isfinite(most):
        return False
    if most > control.stride:
        deeper, along = deeper * control.stride / most, along * control.stride / most
    for c in range(answer.shape[0]):
        answer[c, 0] += deeper * answer[c, 1] + along * answer[c, 3]
    motion[0], motion[1] = deeper, along
    return True


@compile_loop
def meet(states: ContactStates, position: SkinPosition, load: LoadArguments, skin: Skin, length: Array) -> int:
    """Change `states` where the forces on the skin, or its position, contradict them; return how many were changed.

    The anchors are positions that nodes have slid from. Filled: `length` (k,), of skin on which a bound acts.
    """
    bounded_length(position.x, skin, states.state, load.mu, length)
    size, slip = length.shape[0], np.empty(length.shape[0])
    for i in range(size):
        slip[i] = position.x[i] - position.anchor[i]
    changes = StateChanges(np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size))
    changed = contradictions(states, position.above, slip, length, load, changes)
    for i in range(size):
        states.state[i], states.sense[i] = changes.state[i], changes.sense[i]
    return changed
