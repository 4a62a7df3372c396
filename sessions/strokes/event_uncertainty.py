"""How uncertain the instants of a stroke are: what its onset, its break-away and its slide's onset may have been.

Of the onset the detector's own rule is repeated: a force that climbs as steeply crosses its threshold somewhere between
two readings, and noise drawn anew moves the reading that detects it. Of the break-away the readings' deviations
from the fit are kept in place and turned by a random factor a block (a wild bootstrap: Wu 1986, Ann. Statist. 14:1261),
since noise of T/N is greatest where N is least, and N climbs too. Of the slide's onset it is the share of the steady
speed, at which it is detected, that decides.
"""

import numpy as np

from drivers.arrays import Array
from sessions.strokes.contacts import onset_threshold
from sessions.strokes.settings import BootstrapSettings
from sessions.strokes.stick import ClimbReadings, thin


def onset_draws(
    columns: tuple[Array, Array],
    onset: float,
    noise: float,
    zero: Array,
    settings: BootstrapSettings,
    draw: np.random.Generator,
) -> Array | None:
    """Return where the force may have left its noise (repeats,) [s]; None where it had left it before the onset.

    That is at three standard deviations of it (`DetectorSettings.leave_noise`). `columns` are time [s] and unfiltered
    N [N] (n,) from before the contact on, `noise` that of N and `zero` how wrong its zero may be (repeats,) [N].
    """
    time, force = columns
    fewest, detector = settings.onset_fewest, settings.detector
    index = int(np.searchsorted(time, onset))
    if index == 0 or len(time) < index + fewest or force[index - 1] > onset_threshold(noise, detector):
        return None
    rise = force[index:] < 2.0 * max(detector.leave_noise * noise, float(force[index]))
    rise_slice = slice(index - 1, index + max(fewest, int(np.argmin(rise)) + 1))
    step = float(np.median(np.diff(time[rise_slice])))
    # Skin stiffens as it is pressed: a force that bends upwards was less steep where it left the noise.
    bend, slope, _ = np.polyfit(time[rise_slice] - (onset - step / 2.0), force[rise_slice], 2).tolist()
    chord = float(np.polyfit(time[rise_slice], force[rise_slice], 1)[0])
    slope = max(slope if bend > 0.0 else chord, settings.onset_steep * chord)
    if slope <= 0.0:
        return None
    reach = min(settings.onset_reach * noise / slope, settings.onset_most * step / 2.0)
    offsets = np.arange(-reach, reach + step, step)
    # Readings of each repeat, counted from the crossing: the first lies anywhere within a step.
    times = offsets + step * draw.uniform(size=(len(zero), 1))  # (repeats, k)
    in_noise = slope * times + noise * draw.standard_normal(times.shape) <= 0.0
    last_in_noise = np.where(in_noise.any(axis=1), times.shape[1] - 1 - np.argmax(in_noise[:, ::-1], axis=1), -1)
    crossing = times[:, 0] + (last_in_noise + 1) * step  # the reading after the last within the noise
    return onset - crossing + zero / slope


def break_away_draws(
    columns: tuple[Array, Array, Array],
    shortest: float,
    zero: tuple[Array, Array],
    settings: BootstrapSettings,
    draw: np.random.Generator,
    *,
    peaked: bool,
) -> Array | None:
    """Return where T/N may have stopped climbing (repeats,) [s]; None where there are too few readings.

    `columns` are time [s], T/N [-] and N [N] (n,) from the contact to the end of the steady window; the fit ends at one
    of some instants from there back to `shortest` [s]. `zero` is how wrong the zero of T and of N may be (repeats,)
    [N]. `peaked` where a static peak was found. A repeat's deviations move the break-away as the fit, to first order.
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
        # Two or three numbers were fitted to the climb's few blocks: residuals are small, and their size is uncertain.
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


def slide_onset_draws(
    time: Array, speed: Array, least_speed: Array, noise: Array, draw: np.random.Generator
) -> Array | None:
    """Return from when the centre of pressure may have slid (repeats,) [s]; None where its speed is not known.

    `speed` (n,) [mm/s] at `time` (n,) [s], from the contact's onset on, reaches to the steady window; `least_speed` is
    that at which the slide has begun, `noise` how wrong that of the centre of pressure may be (repeats,) [mm/s]. Where
    it was as fast as that when its speed was first known, it may have begun to slide at any instant before.
    """
    slow = np.flatnonzero(~np.isfinite(speed))
    start = int(slow[-1]) + 1 if len(slow) else 0
    if len(speed) - start < 2:
        return None
    least = np.minimum.accumulate(speed[start:][::-1])[::-1]  # the least speed from each instant on
    onsets = np.interp(least_speed - noise, least, time[start:])
    return np.where(least_speed - noise < least[0], draw.uniform(time[0], time[start], len(least_speed)), onsets)
