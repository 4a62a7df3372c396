"""Errors that all readings of a session share: of the gains, of cross-talk between the forces, and of the face's lean.

Each repeat of the bootstrap draws them once for the whole session. To first order the true drag T' and the true normal
force N' of what was measured as T and N are T' = g T + a N and N' = h N + b T: g and h are the gains, a and b hold
cross-talk and lean.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pair = tuple[float, float]

_OF_SESSION = 2**32 - 1  # in the seed, where a stroke has its number


class SystematicDraws:
    """Errors of one session, (repeats,) of each; the same for each of its strokes."""

    def __init__(self, repeats: int, seed: int, accuracy: Pair, lean: Pair, lean_error: Pair, *, presses: int) -> None:
        """Draw gains and cross-talk, whose standard uncertainties are `accuracy` [-], and the face's lean [degrees].

        `lean` is that of the normal towards +x and +y which nobody levelled, `lean_error` its standard uncertainty.
        A press shows a sideways force by lean and by cross-talk, and tells their sum: a lean from `presses` is that.
        The mean of so few follows Student's law (JCGM 101:2008, 6.4.9).
        """
        draw = np.random.default_rng([seed, _OF_SESSION])
        gain, cross_talk = accuracy
        self.gain_t, self.gain_n, self.gain_torque = 1.0 + gain * draw.standard_normal((3, repeats))
        into_drag, into_normal = (cross_talk * draw.standard_normal((repeats, 2)) for _ in range(2))
        off = draw.standard_normal((repeats, 2))
        if presses:
            off /= np.sqrt(draw.chisquare(presses - 1, (repeats, 2)) / (presses - 1))
        leaning: Array = np.radians(np.array(lean) + np.array(lean_error) * off)
        if presses:
            leaning -= into_drag
        self._of_normal: Array = into_drag + leaning
        self._of_drag: Array = into_normal - leaning

    def shares(self, along: Array) -> tuple[Array, Array]:
        """Return a and b (repeats,) [-] for a drag that points along a unit vector (2,)."""
        return self._of_normal @ along, self._of_drag @ along

    def ratio(self, value: float | Array, along: Array) -> Array:
        """Return what T/N (repeats,) [-] truly was where it was measured as `value`."""
        of_normal, of_drag = self.shares(along)
        return (value * self.gain_t + of_normal) / (self.gain_n + of_drag * value)


def drag_direction(force: Array) -> Array:
    """Return the unit vector (2,) of the sum of forces (n, 2) [N]; along +x where there is none."""
    x, y = float(np.nansum(force[:, 0])), float(np.nansum(force[:, 1]))
    length = float(np.hypot(x, y))
    return np.array([x, y]) / length if length > 0.0 else np.array([1.0, 0.0])
