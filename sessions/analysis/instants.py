"""How uncertain the instants of a stroke are: what its break-away and its slide's onset may have been.

Of the break-away the readings' deviations from the fit are kept in place and turned by a random factor a block (a wild
bootstrap: Wu 1986, Ann. Statist. 14:1261), since noise of T/N is greatest where N is least, and N climbs too. Of the
slide's onset it is the share of the steady speed, at which it is told, that decides.
"""

import numpy as np
from numpy.typing import NDArray

from sessions.analysis.stick import climb

Array = NDArray[np.float64]

_ENDS = 5  # of the fit, from that of the steady window inwards
_NEAREST, _FARTHEST, _CANDIDATES = 1e-4, 0.4, 50  # how far off the break-away may lie [s]; how many places a side


def break_away_draws(
    columns: tuple[Array, Array, Array],
    shortest: float,
    block: float,
    zero: tuple[Array, Array],
    draw: np.random.Generator,
) -> Array | None:
    """Return where T/N may have stopped climbing (repeats,) [s]; None where too few readings tell.

    `columns` are time [s], T/N [-] and N [N] (n,) from the contact to the end of the steady window; the fit ends at one
    of some instants from there back to `shortest` [s]. `zero` is how wrong the zero of T and of N may be (repeats,)
    [N]; `block` [s] is how long neighbours are alike.
    """
    time, ratio, normal = (column[np.isfinite(columns[1])] for column in columns)
    found: list[Array] = []
    parts = np.array_split(np.arange(len(zero[0])), _ENDS)
    last = float(columns[0][-1])
    for number, part in enumerate(parts):
        stop = last + (shortest - last) * number / (_ENDS - 1)
        held = time <= stop
        t, y = time[held], ratio[held]
        fit = climb(t, y)
        if fit is None or fit.slope <= 0.0:
            return None
        off = np.geomspace(_NEAREST, _FARTHEST, _CANDIDATES)
        places = fit.meets + np.concatenate([-off[::-1], [0.0], off])
        places = places[(places > t[1]) & (places < t[-2])]
        short = np.maximum(places[:, None] - t, 0.0)
        off_mean = short - short.mean(axis=1)[:, None]
        unit = -off_mean / np.sqrt((off_mean**2).sum(axis=1))[:, None]  # (k, n): the better T/N goes with it the better
        edges = np.flatnonzero(np.diff(np.floor((t - t[0]) / block), prepend=-1.0))
        blocks = np.add.reduceat(unit * (y - fit.at(t)), edges, axis=1)  # (k, blocks)
        moved = np.column_stack([unit @ (1.0 / normal[held]), -(unit @ (y / normal[held]))])  # by the zero of T, of N
        climbing = float(np.searchsorted(t[edges], fit.meets))
        # Two numbers were fitted to the climb's few blocks: what is left is less, and tells little of its own size.
        free = max(climbing - 2.0, 1.0)
        few = np.sqrt(climbing / draw.chisquare(free, len(part)))
        factors = few[:, None] * draw.standard_normal((len(part), len(edges)))
        wrong = np.column_stack([each[part] for each in zero])
        fits = unit @ fit.at(t) + factors @ blocks.T + wrong @ moved.T  # (repeats, k)
        found.append(places[np.argmax(fits, axis=1)])
    return np.concatenate(found)


def slide_onset_draws(time: Array, speed: Array, told: Array, noise: Array) -> Array | None:
    """Return from when the centre of pressure may have slid (repeats,) [s]; None where its speed is not known.

    `speed` (n,) [mm/s] at `time` (n,) [s] reaches to the steady window; `told` is the speed at which the slide has
    begun, `noise` how wrong that of the centre of pressure may be (repeats,) [mm/s].
    """
    slow = np.flatnonzero(~np.isfinite(speed))
    first = int(slow[-1]) + 1 if len(slow) else 0
    if len(speed) - first < 2:
        return None
    kept = np.minimum.accumulate(speed[first:][::-1])[::-1]  # the least speed from each instant on
    return np.interp(told - noise, kept, time[first:])
