"""Where the stick phase ends, the break-away: the change point at which T/N stops climbing.

Pushed against a surface that holds it, a finger's T/N rests, climbs until the contact slips, and then stays, or falls
to where it stays if static friction is the greater. Rest, climb and level are fitted by least squares (two-phase
regression: Hinkley 1969, Biometrika 56:495). A climb is straight unless the readings say that it bends, as it does
where the contact's edge slips before its middle: by a power of the time that is left, 3/2 for a sphere dragged steadily
(Mindlin and Deresiewicz 1953, J. Appl. Mech. 20:327).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.settings import AnalysisSettings

Array = NDArray[np.float64]

_BENDS = (1.0, 2.0)  # from which the power of a climb is sought [-] ...
_FALLS = (0.05, 0.15)  # ... and in which a static peak falls to 1/e [s]
_LIMITS = ((0.5, 4.0), (0.005, 1.0))  # of both
_FEWEST = 5  # readings of the climb, and of the level
_FEW = 400  # at most so many means stand for the readings
_CANDIDATES = 41  # instants at which rest or level may meet the climb
_SHORTEST = 1e-3  # a climb takes so long [s]
_STEPS = 60  # of Levenberg's and Marquardt's method at most
_STILL = 1e-10  # of the squares: a fit that gains no more has settled
_SURELY = 6.6  # ratio of variances (F) from which a climb is not straight: once in a hundred by chance


class Climb(NamedTuple):
    """A rest, a climb and a level, and what of a peak stands above the level."""

    begins: float  # instant at which the climb leaves the rest [s]
    meets: float  # instant at which it stops [s]
    bend: float  # 1 is straight [-]
    fall: float  # in which what is above the level falls to 1/e; 0 where there is no peak [s]
    rest: float  # [-]
    rise: float  # from rest to level [-]
    peak: float  # above the level [-]

    def at(self, time: Array) -> Array:
        """Return T/N (n,) [-] as fitted at `time` (n,) [s]."""
        return self.rest + _parts(self, time) @ np.array([self.rise, self.peak])

    def slopes(self, time: Array) -> Array:
        """Return how T/N changes with each of the seven numbers (n, 7) at `time` (n,) [s], 0 if it has none."""
        lasts = self.meets - self.begins
        left = np.clip((self.meets - time) / lasts, 0.0, 1.0)
        inside = (left > 0.0) & (left < 1.0)
        by_left = np.zeros_like(time)
        by_left[inside] = -self.bend * left[inside] ** (self.bend - 1.0) / lasts
        by_bend = np.zeros_like(time)
        by_bend[inside] = -(left[inside] ** self.bend) * np.log(left[inside])
        done, above = _parts(self, time).T
        share = np.full_like(time, self.rise) if self.fall == 0.0 else self.rise + self.peak * _peak_decay(self, time)
        columns = np.zeros((len(time), 7))
        columns[:, 0], columns[:, 1] = share * by_left * left, share * by_left * (1.0 - left)
        columns[:, 2] = share * by_bend
        if self.fall > 0.0:
            late = np.maximum(time - self.meets, 0.0)
            columns[:, 1] += self.peak * above / self.fall * (late > 0.0)
            columns[:, 3] = self.peak * above * late / self.fall**2
        columns[:, 4], columns[:, 5], columns[:, 6] = 1.0, done, above
        return columns


def break_away(time: Array, ratio: Array, settings: AnalysisSettings, *, peaked: bool = False) -> float | None:
    """Return the instant [s] at which T/N (n,) [-] stops climbing; None where it does not climb first.

    `time` (n,) [s] reaches from the contact to the end of the steady window; nan of the ratio is left out. `peaked`
    where a static peak was found. A climb counts where it explains most of what a level alone leaves, and rises by a
    share of the level (`stick_rise`).
    """
    held = np.isfinite(ratio)
    t, y = thin(time[held]), thin(ratio[held])
    fit = fit_climb(t, y, settings.filter.block, peaked=peaked)
    if fit is None:
        return None
    climbing = fit.rise + fit.peak >= settings.ratio.stick_rise * (fit.rest + fit.rise) > 0.0
    return fit.meets if climbing and _mean_square(fit, t, y) <= settings.ratio.stick_left * float(y.var()) else None


def fit_climb(t: Array, y: Array, block: float, *, peaked: bool) -> Climb | None:
    """Return the climb that T/N `y` (n,) [-] at `t` (n,) [s] has had; None of too few readings.

    A straight one, unless it surely leaves more than one that bends; readings are alike over `block` [s]. `peaked` lets
    what is above the level fall.
    """
    if len(t) < 2 * _FEWEST + 1:
        return None
    falls = _FALLS if peaked else (0.0,)
    at = _straight_climb(t, y)
    straight = min(
        (refine(_guess(at, t, y, 1.0, fall), t, y) for fall in falls), key=lambda one: _mean_square(one, t, y)
    )
    starts = [_guess(at, t, y, bend, straight.fall) for bend in _BENDS]
    bent = min((refine(one, t, y, bends=True) for one in starts), key=lambda one: _mean_square(one, t, y))
    free = max((float(t[-1]) - float(t[0])) / block - 5.0, 1.0)
    surely = (_mean_square(straight, t, y) - _mean_square(bent, t, y)) * free > _SURELY * _mean_square(bent, t, y)
    return bent if surely else straight


def refine(fit: Climb, t: Array, y: Array, *, bends: bool = False) -> Climb:
    """Return the fit that leaves least of `y` (n,) at `t` (n,) near a first one (Levenberg 1944, Marquardt 1963)."""
    least, damping = _mean_square(fit, t, y), 1e-3
    for _ in range(_STEPS):
        free = free_numbers(fit, t, bends=bends)
        slopes = fit.slopes(t)[:, free]
        normal, right = slopes.T @ slopes, slopes.T @ (y - fit.at(t))
        moved = np.array(fit)
        moved[free] += np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), right, rcond=None)[0]
        new = _bounded(moved, t)
        left = _mean_square(new, t, y)
        if left < least:
            gained, fit, least, damping = least - left, new, left, damping / 10.0
            if gained < _STILL * left:
                break
        elif (damping := damping * 10.0) > 1e9:
            break
    return fit


def free_numbers(fit: Climb, t: Array, *, bends: bool) -> list[int]:
    """Return which of the seven numbers of a climb readings at `t` (n,) [s] tell."""
    free = [1, 4, 5]
    free += [0] if fit.begins > t[0] else []
    free += [2] if bends else []
    return sorted(free + ([3, 6] if fit.fall > 0.0 else []))


def thin(column: Array) -> Array:
    """Return readings, or where there are many of them, means of as many neighbours each."""
    edges = np.arange(0, len(column), -(-len(column) // _FEW))
    return np.add.reduceat(column, edges) / np.diff(np.append(edges, len(column))) if len(column) else column


def _straight_climb(t: Array, y: Array) -> tuple[float, float]:
    """Return the instants between which a straight climb fits best, among all pairs of some."""
    at = np.linspace(float(t[0]), float(t[-_FEWEST - 1]), _CANDIDATES)
    begins, meets = (at[index] for index in np.triu_indices(_CANDIDATES, 1))
    late = meets >= t[_FEWEST]
    begins, meets = begins[late], meets[late]
    done = 1.0 - np.clip((meets[:, None] - t) / (meets - begins)[:, None], 0.0, 1.0)
    done -= done.mean(axis=1)[:, None]
    explained = np.maximum(done @ (y - y.mean()), 0.0) ** 2 / (done**2).sum(axis=1)
    best = int(np.argmax(explained))
    return float(begins[best]), float(meets[best])


def _guess(at: tuple[float, float], t: Array, y: Array, bend: float, fall: float) -> Climb:
    """Return a climb of a kind between two instants, its heights fitted."""
    begins, meets = at[0], min(at[1] + (bend - 1.0) * (at[1] - at[0]), float(t[-_FEWEST - 1]))
    kind = Climb(begins, meets, bend, fall, 0.0, 1.0, 0.0)
    columns = kind.slopes(t)[:, [4, 5, 6] if fall > 0.0 else [4, 5]]
    heights = np.linalg.lstsq(columns, y, rcond=None)[0].tolist()
    return Climb(*kind[:4], *heights, *([] if fall > 0.0 else [0.0]))


def _bounded(numbers: Array, t: Array) -> Climb:
    """Return the climb of seven numbers, brought to where it can be fitted."""
    begins, meets, bend, fall, rest, rise, peak = numbers.tolist()
    meets = float(np.clip(meets, t[_FEWEST], t[-_FEWEST - 1]))
    begins = float(np.clip(begins, t[0], meets - _SHORTEST))
    (low, high), (shortest, longest) = _LIMITS
    fall = float(np.clip(fall, shortest, longest)) if fall != 0.0 else 0.0
    return Climb(begins, meets, float(np.clip(bend, low, high)), fall, rest, max(rise, 0.0), max(peak, 0.0))


def _mean_square(fit: Climb, t: Array, y: Array) -> float:
    return float(((y - fit.at(t)) ** 2).mean())


def _parts(fit: Climb, t: Array) -> Array:
    """Return how much of the climb is done, and of the peak there (n, 2) [-]."""
    done = 1.0 - np.clip((fit.meets - t) / (fit.meets - fit.begins), 0.0, 1.0) ** fit.bend
    return np.column_stack([done, done * _peak_decay(fit, t)])


def _peak_decay(fit: Climb, t: Array) -> Array:
    """Return what is left of the peak (n,) [-]: 1 up to it."""
    return np.exp(-np.maximum(t - fit.meets, 0.0) / fit.fall) if fit.fall > 0.0 else np.zeros_like(t)
