"""The break-away, the end of the stick phase: the change point at which T/N stops climbing.

When a finger is pushed along a surface that holds it, T/N rests, climbs until the contact slips, and then stays, or
falls to a level if static friction is greater. Rest, climb and level are fitted by least squares (two-phase regression:
Hinkley 1969, Biometrika 56:495). A climb is straight unless the readings show a bend, as where the contact's edge slips
before its middle: by a power of the remaining time, 3/2 for a sphere dragged steadily (Mindlin and Deresiewicz 1953, J.
Appl. Mech. 20:327).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.arrays import Array, Mask
from sessions.strokes.settings import AnalysisSettings, BootstrapSettings, ClimbSettings
from sessions.strokes.sliding import block_means


class Climb(NamedTuple):
    """A rest, a climb and a level, with or without a peak above the level."""

    begins: float  # instant at which the climb leaves the rest [s]
    meets: float  # instant at which it stops [s]
    bend: float  # 1 is straight [-]
    fall: float  # time in which the peak falls to 1/e; 0 without a peak [s]
    rest: float  # [-]
    rise: float  # from rest to level [-]
    peak: float  # above the level [-]

    def ratio(self, time: Array) -> Array:
        """Return T/N (n,) [-] as fitted at `time` (n,) [s]."""
        return self.rest + _progress_and_peak(self, time) @ np.array([self.rise, self.peak])

    def slopes(self, time: Array) -> Array:
        """Return the derivatives of T/N by the seven numbers (n, 7) at `time` (n,) [s], 0 for unused ones."""
        duration = self.meets - self.begins
        remaining = np.clip((self.meets - time) / duration, 0.0, 1.0)
        inside = (remaining > 0.0) & (remaining < 1.0)
        remaining_slope, bend_slope = np.zeros_like(time), np.zeros_like(time)
        remaining_slope[inside] = -self.bend * remaining[inside] ** (self.bend - 1.0) / duration
        bend_slope[inside] = -(remaining[inside] ** self.bend) * np.log(remaining[inside])
        progress, peak_left = _progress_and_peak(self, time).T
        share = self.rise + self.peak * _peak_decay(self, time)
        columns = np.zeros((len(time), 7))
        columns[:, 0], columns[:, 1] = share * remaining_slope * remaining, share * remaining_slope * (1.0 - remaining)
        columns[:, 2] = share * bend_slope
        if self.fall > 0.0:
            late = np.maximum(time - self.meets, 0.0)
            columns[:, 1] += self.peak * peak_left / self.fall * (late > 0.0)
            columns[:, 3] = self.peak * peak_left * late / self.fall**2
        columns[:, 4], columns[:, 5], columns[:, 6] = 1.0, progress, peak_left
        return columns


def break_away(time: Array, ratio: Array, settings: AnalysisSettings, *, peaked: bool = False) -> float | None:
    """Return the instant [s] at which T/N (n,) [-] stops climbing; None without a climb before.

    `time` (n,) [s] covers contact to end of the steady window; nan of the ratio is left out. `peaked` is true with a
    static peak. The climb must explain most of the variance about a constant, and rise by `stick_rise` of its level.
    """
    finite = np.isfinite(ratio)
    limit = settings.climb.climb_most
    readings = ClimbReadings(thin(time[finite], limit), thin(ratio[finite], limit), settings.climb)
    climb = readings.fit(settings.filter.block, peaked=peaked)
    if climb is None or climb.rise + climb.peak < settings.ratio.stick_rise * (climb.rest + climb.rise):
        return None
    fits = readings.mean_square(climb) <= settings.ratio.stick_left * float(readings.ratio.var())
    return climb.meets if fits and climb.rest + climb.rise > 0.0 else None


def thin(column: Array, limit: int) -> Array:
    """Return readings, or for more than `limit` of them the means of equally many neighbours each."""
    edges = np.arange(0, len(column), -(-len(column) // limit))
    return np.add.reduceat(column, edges) / np.diff(np.append(edges, len(column))) if len(column) else column


@dataclass(frozen=True, slots=True, eq=False)
class ClimbReadings:
    """Readings to which a climb is fitted; n of them."""

    time: Array  # (n,) [s]
    ratio: Array  # (n,) T/N [-]
    settings: ClimbSettings

    def fit(self, block: float, *, peaked: bool) -> Climb | None:
        """Return the fitted climb; None for too few readings.

        It is straight unless a bent one fits much better; readings correlate over `block` [s]. `peaked` ones fall.
        """
        if len(self.time) < 2 * self.settings.climb_fewest + 1:
            return None
        interval = self._straight()
        falls = self.settings.climb_falls if peaked else (0.0,)
        straight = min((self.refine(self._guess(interval, 1.0, fall)) for fall in falls), key=self.mean_square)
        guesses = [self._guess(interval, bend, straight.fall) for bend in self.settings.climb_bends]
        bent = min((self.refine(guess, bends=True) for guess in guesses), key=self.mean_square)
        dof = max((float(self.time[-1]) - float(self.time[0])) / block - 5.0, 1.0)
        least, gain = self.mean_square(bent), self.mean_square(straight) - self.mean_square(bent)
        return bent if gain * dof > self.settings.climb_bends_surely * least else straight

    def refine(self, climb: Climb, *, bends: bool = False) -> Climb:
        """Return the least-squares climb, from an initial one (Levenberg 1944, Marquardt 1963)."""
        slopes, residual, damping = climb.slopes(self.time), self.ratio - climb.ratio(self.time), 1e-3
        for _ in range(self.settings.climb_steps):
            free = self.free_numbers(climb, slopes, residual, bends=bends)
            columns = slopes[:, free]
            normal, gradient = columns.T @ columns, columns.T @ residual
            numbers = np.array(climb)
            numbers[free] += np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), gradient, rcond=None)[0]
            candidate = self._feasible_climb(numbers)
            candidate_residual = self.ratio - candidate.ratio(self.time)
            gain = float(residual @ residual - candidate_residual @ candidate_residual)
            if gain > 0.0:
                climb, residual, damping = candidate, candidate_residual, damping / 10.0
                slopes = climb.slopes(self.time)
                if gain < self.settings.climb_still * float(residual @ residual):
                    break
            elif (damping := damping * 10.0) > 1e9:
                break
        return climb

    def free_numbers(self, climb: Climb, slopes: Array, residual: Array, *, bends: bool) -> list[int]:
        """Return the positions of the free parameters of a climb, given its residual (n,).

        A climb that begins at the first reading can only begin later.
        """
        begins_freely = climb.begins > self.time[0] or float(slopes[:, 0] @ residual) > 0.0
        is_free = (begins_freely, True, bends, climb.fall > 0.0, True, True, climb.fall > 0.0)
        return [position for position, free in enumerate(is_free) if free]

    def mean_square(self, climb: Climb) -> float:
        """Return the mean square of a climb's residuals of T/N [-]."""
        return float(((self.ratio - climb.ratio(self.time)) ** 2).mean())

    def _straight(self) -> tuple[float, float]:
        """Return the instants between which a straight climb fits best, among all pairs of a grid."""
        fewest, count, t, y = self.settings.climb_fewest, self.settings.climb_candidates, self.time, self.ratio
        grid = np.linspace(float(t[0]), float(t[-fewest - 1]), count)
        begins, meets = (grid[index] for index in np.triu_indices(count, 1))
        is_late = meets >= t[fewest]
        begins, meets = begins[is_late], meets[is_late]
        progress = 1.0 - np.clip((meets[:, None] - t) / (meets - begins)[:, None], 0.0, 1.0)
        progress -= progress.mean(axis=1)[:, None]
        explained = np.maximum(progress @ (y - y.mean()), 0.0) ** 2 / (progress**2).sum(axis=1)
        best = int(np.argmax(explained))
        return float(begins[best]), float(meets[best])

    def _guess(self, interval: tuple[float, float], bend: float, fall: float) -> Climb:
        """Return a climb with a bend and a fall between two instants, with fitted heights."""
        latest = float(self.time[-self.settings.climb_fewest - 1])
        begins, meets = interval
        meets = min(meets + (bend - 1.0) * (meets - begins), latest)
        template = Climb(begins, meets, bend, fall, 0.0, 1.0, 0.0)
        columns = template.slopes(self.time)[:, [4, 5, 6] if fall > 0.0 else [4, 5]]
        heights = np.linalg.lstsq(columns, self.ratio, rcond=None)[0].tolist()
        return Climb(*template[:4], *heights, *([] if fall > 0.0 else [0.0]))

    def _feasible_climb(self, numbers: Array) -> Climb:
        """Return the climb of seven numbers, clipped to the limits of the fit."""
        begins, meets, bend, fall, rest, rise, peak = numbers.tolist()
        fewest, t = self.settings.climb_fewest, self.time
        meets = _clip(meets, float(t[fewest]), float(t[-fewest - 1]))
        begins = _clip(begins, float(t[0]), meets - self.settings.climb_shortest)
        fall = _clip(fall, *self.settings.climb_fall_limits) if fall != 0.0 else 0.0
        bend = _clip(bend, *self.settings.climb_bend_limits)
        return Climb(begins, meets, bend, fall, rest, max(rise, 0.0), max(peak, 0.0))


def _clip(number: float, low: float, high: float) -> float:
    return min(max(number, low), high)  # twenty times as fast as NumPy's clip of one number


def _progress_and_peak(fit: Climb, t: Array) -> Array:
    """Return the progress of the climb and the remaining peak (n, 2) [-]."""
    progress = 1.0 - np.clip((fit.meets - t) / (fit.meets - fit.begins), 0.0, 1.0) ** fit.bend
    return np.column_stack([progress, progress * _peak_decay(fit, t)])


def _peak_decay(fit: Climb, t: Array) -> Array:
    """Return the decay of the peak (n,) [-]: 1 up to the peak."""
    return np.exp(-np.maximum(t - fit.meets, 0.0) / fit.fall) if fit.fall > 0.0 else np.zeros_like(t)


def break_away_draws(
    columns: tuple[Array, Array, Array],
    shortest: float,
    zero: tuple[Array, Array],
    settings: BootstrapSettings,
    draw: np.random.Generator,
    *,
    peaked: bool,
) -> Array | None:
    """Return draws of the break-away (repeats,) [s]; None for too few readings.

    Residuals are kept in place and multiplied by a random factor for each block (a wild bootstrap: Wu 1986, Ann.
    Statist. 14:1261), since noise of T/N is greatest where N is least, and N climbs too. `columns` are time [s], T/N
    [-] and N [N] (n,) from the contact to the end of the steady window; the fit ends at one of some instants from there
    back to `shortest` [s]. `zero` is the error of the zero of T and of N (repeats,) [N]. `peaked` is true with a static
    peak. Residuals move the break-away to first order, as in the fit.
    """
    last_instant = float(columns[0][-1])
    finite = np.isfinite(columns[1])
    time, ratio, normal = (column[finite] for column in columns)

    def readings(until: float) -> tuple[ClimbReadings, Array]:
        t, y, n = (thin(column[time <= until], settings.climb.climb_most) for column in (time, ratio, normal))
        return ClimbReadings(t, y, settings.climb), n

    climb = readings(last_instant)[0].fit(settings.block, peaked=peaked)
    if climb is None:
        return None
    bends = climb.bend != 1.0
    draws: list[Array] = []
    for number, repeats in enumerate(np.array_split(np.arange(len(zero[0])), settings.climb_ends)):
        series, n = readings(last_instant + (shortest - last_instant) * number / (settings.climb_ends - 1))
        t, y = series.time, series.ratio
        fit = series.refine(climb, bends=bends)
        if fit.rise <= 0.0:
            return None
        edges = np.flatnonzero(np.diff(np.floor((t - t[0]) / settings.block), prepend=-1.0))
        blocks = float(np.searchsorted(t[edges], fit.meets) - np.searchsorted(t[edges], fit.begins))
        # Two or three parameters are fitted to the climb's few blocks: residuals are small and their size uncertain.
        dof = max(blocks - 2.0 - bends, 1.0)
        scale = np.sqrt(max(blocks, 1.0) / draw.chisquare(dof, len(repeats)))[:, None]
        factors = scale * draw.standard_normal((len(repeats), len(edges)))
        slopes, residual = fit.slopes(t), y - fit.ratio(t)
        numbers = series.free_numbers(fit, slopes, residual, bends=bends)
        moves = np.linalg.pinv(slopes[:, numbers])[numbers.index(1)]  # (n,) [s] by T/N
        block_moves = np.add.reduceat(moves * residual, edges)
        zero_t, zero_n = (errors[repeats] for errors in zero)
        draws.append(fit.meets + factors @ block_moves + zero_t * (moves @ (1.0 / n)) - zero_n * (moves @ (y / n)))
    return np.concatenate(draws)


class StickSlip(NamedTuple):
    """Stick-slip of a contact."""

    frequency: float  # of the slips [Hz]
    crest_gap: float  # climb of T/N between readings: they may miss a crest by it [-]


def stick_slip(time: Array, ratio: Array, noise: float, settings: AnalysisSettings) -> StickSlip | None:
    """Return the stick-slip in unfiltered T/N (n,) [-] at `time` (n,) [s]; None without one.

    `noise` is the standard deviation of T/N [-].
    """
    limits = settings.ratio
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    lag = max(1, round(limits.slip_within / step)) if step > 0.0 else len(time)
    if len(time) <= lag + 1:
        return None
    change = ratio[lag:] - ratio[:-lag]
    threshold = max(limits.slip_share * float(np.nanmedian(ratio)), limits.slip_noise * np.sqrt(2.0) * noise)
    drops = _beginnings(change < -threshold)
    # A slow climb grows by up to a third of a drop in the same time, so half a drop is sudden.
    depth = -float(np.median(np.fmin.reduceat(change, drops))) if len(drops) else 0.0
    climbs = _beginnings(change > max(threshold, 0.5 * depth))
    if len(drops) < limits.slips_fewest or len(climbs) > limits.slips_upwards * len(drops):
        return None
    steps = np.diff(ratio)
    climb = float(np.nanmedian(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    return StickSlip(float((len(drops) - 1) / (time[drops[-1]] - time[drops[0]])), climb)


def _beginnings(mask: Mask) -> NDArray[np.intp]:
    return np.flatnonzero(mask & ~np.concatenate([[False], mask[:-1]]))


def power_of_normal_force(normal: Array, ratio: Array, rate: float, settings: AnalysisSettings) -> float:
    """Return the most negative power of N (n,) [N] in T/N (n,) [-] that readings allow, down to `law_steepest`.

    Block means are fitted, with two standard errors of tolerance. Never above 0.
    """
    steepest = settings.ratio.law_steepest
    valid = np.isfinite(ratio) & (ratio > 0.0) & (normal > 0.0)
    blocks = block_means(np.log(np.column_stack([normal[valid], ratio[valid]])), rate, settings)
    if len(blocks) < settings.ratio.law_fewest:
        return steepest
    x, y = (column - column.mean() for column in blocks.T)
    spread = float(x @ x)
    if spread <= 0.0:
        return steepest
    slope = float(x @ y) / spread
    error = float(np.sqrt(((y - slope * x) ** 2).sum() / (len(blocks) - 2) / spread))
    return min(0.0, float(np.clip(steepest, slope - 2.0 * error, slope + 2.0 * error)))
