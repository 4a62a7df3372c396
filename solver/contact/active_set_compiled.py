"""Contact of a reduced body found by compiled loops: the states that `active_set` finds from the same guesses."""

from dataclasses import replace

import numpy as np

from solver._kernels import rubbing
from solver.contact.active_set import AMBIGUOUS, CONTRADICTORY, Array, Contact, ContactLost, States, Touchable
from solver.contact.law import FrictionLaw


def slid(body: Touchable, law: FrictionLaw, depth: float, sense: float, rounds: int, first: float) -> Contact | None:
    """Return the settled slide of a driven body, friction forces pointing along `sense`; None after `rounds` systems.

    Skin that would lie deeper than `first` times the `depth` [mm] in the surface is first thought to touch.
    """
    count = len(body.gap)
    found = _blank(body, np.zeros(count, np.int8), np.full(count, sense))
    systems = rubbing.slide(
        body.gap, body.length, body.normal_by_normal, body.normal_by_tangential, body.tangential_by_tangential,
        body.normal_free, body.tangential_free, law.mu, law.tau_max, depth, sense, rounds, first, found.state,
        found.normal, found.tangential, found.shift, found.gap,
    )  # fmt: skip
    return None if systems == rubbing.LOST else replace(found, iterations=systems)


def consistent(
    body: Touchable,
    law: FrictionLaw,
    drive: tuple[float, float],
    resultants: Array,
    anchor: Array,
    guess: tuple[States, Array],
    entering: int | None,
    patience: int,
) -> Contact:
    """Return the state reached from a `guess` of states and senses. Raises ContactLost where that is none.

    `drive` is depth and travel [mm], `resultants` (r,) those along the free motions; points stick at `anchor` (k,).
    `entering` is what a point is first thought to do when it comes to touch; where it is None all that touches slips.
    """
    found = _blank(body, guess[0].copy(), guess[1].copy())
    motions = np.ascontiguousarray(body.motions)  # loops are compiled for one order of numbers in memory
    free = entering is not None
    systems = rubbing.solve_active_set(
        body.gap, body.length, body.normal_by_normal, body.normal_by_tangential, body.tangential_by_tangential,
        body.normal_free, body.tangential_free, motions, resultants, law.mu, law.tau_max, *drive, anchor, free,
        entering if free else rubbing.SLIP, patience, found.state, found.sense, found.normal, found.tangential,
        found.shift, found.gap, found.motion,
    )  # fmt: skip
    if systems == rubbing.AMBIGUOUS:
        raise ContactLost(AMBIGUOUS)
    if systems == rubbing.LOST:
        raise ContactLost(CONTRADICTORY.format(patience))
    return replace(found, iterations=systems)


def _blank(body: Touchable, state: States, sense: Array) -> Contact:
    """Return a contact for the loops to fill."""
    count, free = len(state), len(body.resultants)
    normal, tangential, shift, gap = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    return Contact(state, sense, normal, tangential, shift, gap, np.zeros(free), 0)
