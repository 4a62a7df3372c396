"""Settled sliding under a given normal force: the depth is an unknown of the contact problem, found directly."""

import numpy as np

from solver.contact.active_set import OPEN, SLIP, Contact, ContactLost, Course, Touchable, forced
from solver.contact.law import FrictionLaw

GUESSES = (0.3, 0.6, 0.1, 0.9)  # first guesses of the depth, for which points touch, by the deepest


def sliding_under(body: Touchable, law: FrictionLaw, normal_force: float, direction: int, deepest: float) -> Contact:
    """Return the settled sliding state of a body pressed with `normal_force` [N/mm], moving along +x or -x.

    `deepest` [mm] is the scale of the first guesses. Raises ContactLost where no state was found.
    """
    course = Course(forced(body, normal_force), law)
    for part in GUESSES:
        guess = np.where(body.gap < part * deepest, SLIP, OPEN).astype(np.int8)
        try:
            found = course.sliding(0.0, direction, guess)
        except ContactLost:
            continue
        if depth_of(found) > 0.0:
            return found
    raise ContactLost("the touching points have no forces that amount to the normal force")


def depth_of(contact: Contact) -> float:
    """Return the depth [mm] that was found for a body of `contact.forced` and nothing else free."""
    return -float(contact.motion[0])
