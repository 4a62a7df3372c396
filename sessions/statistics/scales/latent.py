"""Scores, estimates, choices and comparisons with a standard on one scale, in Thurstone's unit.

In his case V a difference z of two surfaces is judged right in Φ(z) of choices (1927, Psychol. Rev. 34, 273): the unit
is the standard deviation of the difference of two judgements. A score, or the logarithm of an estimate, is such a
judgement. With levels of the subjects taken away, single ones scatter by s, and the unit is √2 s. A comparison with a
standard has its unit in the just noticeable difference: from there to the standard it is 0.674.
"""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from sessions.statistics.scales.paired import LEAST_SUBJECTS
from sessions.statistics.scales.psychometric import QUARTILE
from sessions.statistics.scores import CONFIDENCE, IntervalEstimate

Array = NDArray[np.float64]
Judgement = Literal["scores", "estimates", "choices", "comparisons"]
JUDGEMENTS: tuple[Judgement, ...] = ("scores", "estimates", "choices", "comparisons")
RESAMPLES = 1000


def of_judgements(points: Sequence[tuple[str, int, float]], seed: int = 0) -> Mapping[int, IntervalEstimate]:
    """Return the latent value of each surface, with mean 0, from subject, index and score or log estimate.

    Intervals are expanded percentiles of a bootstrap over subjects (Hesterberg 2015, Am. Stat. 69, 371): of few
    subjects plain ones are too narrow, as a normal quantile is in place of t's. Subjects who missed a surface that
    another judged do not count. Nothing of fewer than three others, of fewer than two surfaces, and where nothing is
    left to tell a unit from.
    """
    own: defaultdict[str, defaultdict[int, list[float]]] = defaultdict(lambda: defaultdict(list))
    for subject, index, value in points:
        own[subject][index].append(value)
    indices = sorted({index for _, index, _ in points})
    whole = [[row[index] for index in indices] for row in own.values() if len(row) == len(indices)]
    if len(whole) < LEAST_SUBJECTS or len(indices) < 2:
        return {}
    cells = np.array([[np.mean(cell) for cell in row] for row in whole])
    answered = _Answered(
        cells - cells.mean(axis=1, keepdims=True),
        np.array([[float(len(cell)) for cell in row] for row in whole]),
        np.array([sum(float(np.var(cell)) * len(cell) for cell in row) for row in whole]),
    )
    here = answered.values(np.arange(len(whole))[None])[0]
    if not np.isfinite(here).all():
        return {}
    drawn = np.random.default_rng(seed).integers(0, len(whole), (RESAMPLES, len(whole)))
    n = len(whole)
    tail = float(special.ndtr(math.sqrt(n / (n - 1)) * special.stdtrit(n - 1, (1.0 - CONFIDENCE) / 2.0)))
    ends = np.nanquantile(answered.values(drawn), [tail, 1.0 - tail], axis=0).T.tolist()
    return {i: IntervalEstimate(value, *two) for i, value, two in zip(indices, here.tolist(), ends, strict=True)}


def of_comparisons(mu: Mapping[int, float], log_jnd: tuple[float, float, float]) -> Mapping[int, IntervalEstimate]:
    """Return the latent value of each surface, with mean 0, from its µ and the logarithm of the JND and of its ends.

    The JND is a difference of log µ. The interval is the JND's: µ is taken as exact.
    """
    logs = {index: math.log(value) for index, value in mu.items()}
    middle = sum(logs.values()) / max(len(logs), 1)
    value, *ends = (QUARTILE / math.exp(one) for one in log_jnd)
    out: dict[int, IntervalEstimate] = {}
    for index, log_mu in logs.items():
        low, high = sorted((log_mu - middle) * end for end in ends)
        out[index] = IntervalEstimate((log_mu - middle) * value, low, high)
    return out


class _Answered(NamedTuple):
    """The answers of s subjects to k surfaces."""

    cells: Array  # (s, k) means of repeats, each subject's own mean taken away
    counts: Array  # (s, k) repeats
    within: Array  # (s,) sum of squares of repeats about their means

    def values(self, who: NDArray[np.int64]) -> Array:
        """Return means over the subjects `who` (b, s) by √2 s: (b, k); nan where nothing scatters about them."""
        cells, counts = self.cells[who], self.counts[who]
        means = cells.mean(axis=1)
        left = (counts * (cells - means[:, None]) ** 2).sum(axis=(1, 2)) + self.within[who].sum(axis=1)
        freedom = counts.sum(axis=(1, 2)) - cells.shape[1] - cells.shape[2] + 1
        unit = np.sqrt(2.0 * left / freedom)[:, None]
        scattered = unit > 1e-9 * np.abs(means).max(axis=1)[:, None]
        return np.where(scattered, means, np.nan) / np.where(scattered, unit, 1.0)
