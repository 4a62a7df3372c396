"""White noise that is a function of a seed and an instant, so that whoever asks again is told the same."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def white_noise(seed: int, times: Array, channels: int = 6) -> Array:
    """Return noise (n, channels) of mean 0 and standard deviation 1 at `times` (n,) [s].

    Instants in the same microsecond share their noise. The hash is SplitMix64 (Steele, Lea, Flood, 2014), keyed by
    the seed and counted by instant and channel; the normal deviate is the inverse of the distribution at that point.
    """
    from scipy.special import ndtri  # slow to load, and a bench that is no simulated one has no need of it

    instants = np.rint(times * 1e6).astype(np.int64).astype(np.uint64)
    key = np.random.SeedSequence(seed).generate_state(1, np.uint64)  # an array: scalars would warn on wrapping
    counted = instants[:, None] * np.uint64(channels) + np.arange(channels, dtype=np.uint64)
    mixed = key + counted * np.array([0x9E3779B97F4A7C15], np.uint64)
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.array([0xBF58476D1CE4E5B9], np.uint64)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.array([0x94D049BB133111EB], np.uint64)
    mixed ^= mixed >> np.uint64(31)
    uniform = ((mixed >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53
    return np.asarray(ndtri(uniform), np.float64)
