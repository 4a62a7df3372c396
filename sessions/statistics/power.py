"""How many subjects and surfaces a study needs: the share of simulated studies whose own test finds what is planted."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.statistics.scores import SCALE
from sessions.statistics.within_subjects import repeated_correlation

Array = NDArray[np.float64]
ALPHA = 0.05  # of the study's confirmatory test, two-sided
FRICTION = (0.24, 0.67)  # least and greatest µ of the published surfaces


@dataclass(frozen=True, slots=True)
class Planted:
    """What is planted. Nobody measured the usual values: a pilot's mixed model gives a lab's own."""

    effect: float = 20.0  # of the mean score, from the least to the greatest µ [0–100]
    noise: float = 12.0  # standard deviation of a score about its subject's line [0–100]
    level_sd: float = 12.0  # between subjects, of the level [0–100]
    slope_sd: float = 0.5  # between subjects, of the effect, by the mean effect [-]
    friction_sd: float = 0.1  # of the µ of one stroke about the surface's, by it [-]


@dataclass(frozen=True, slots=True)
class Power:
    """What a design finds."""

    subjects: int
    surfaces: int
    detections: int  # studies of which the test finds the planted effect with its sign
    wrong: int  # studies of which it finds the other sign
    studies: int

    @property
    def share(self) -> float:
        """The power [-]."""
        return self.detections / self.studies

    @property
    def half(self) -> float:
        """Half of the 95 % interval of the power that comes of so many studies [-]."""
        return 1.96 * math.sqrt(max(self.share * (1.0 - self.share), 0.25 / self.studies) / self.studies)


def power(
    planted: Planted,
    subjects: Sequence[int],
    surfaces: Sequence[int],
    studies: int,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> list[Power]:
    """Return the power of every design of so many subjects and surfaces, one trial a surface.

    The test is that of a study's page: the correlation within subjects of the scores with what was measured of each
    subject's own strokes, with the jackknife's p over subjects. The surfaces' µ are evenly spaced over those of the
    paper, and all subjects meet the same ones. Scores end at 0 and 100.
    """
    designs = [(people, count) for people in subjects for count in surfaces]
    out: list[Power] = []
    for number, (people, count) in enumerate(designs):
        rng = np.random.default_rng([seed, people, count])
        verdicts = [_verdict(*_study(planted, people, count, rng)) for _ in range(studies)]
        sign = math.copysign(1.0, planted.effect)
        out.append(Power(people, count, verdicts.count(sign), verdicts.count(-sign), studies))
        progress((number + 1) / len(designs))
    return out


def _study(planted: Planted, people: int, count: int, rng: np.random.Generator) -> tuple[list[str], Array, Array]:
    """Return subject, µ as measured and score of each trial."""
    mu = np.linspace(*FRICTION, count)
    own = mu * np.exp(rng.normal(0.0, planted.friction_sd, (people, count)))
    slope = planted.effect * (1.0 + planted.slope_sd * rng.standard_normal((people, 1))) / (FRICTION[1] - FRICTION[0])
    level = sum(SCALE) / 2.0 + planted.level_sd * rng.standard_normal((people, 1))
    scores = level + slope * (own - np.mean(FRICTION)) + planted.noise * rng.standard_normal((people, count))
    names = [f"P{number}" for number in range(people) for _ in range(count)]
    return names, own.ravel(), np.clip(scores, *SCALE).ravel()


def _verdict(subjects: Sequence[str], mu: Array, scores: Array) -> float:
    """Return the sign that the test finds, 0 where it finds none."""
    repeated = repeated_correlation(subjects, mu.tolist(), scores.tolist())
    if repeated is None or repeated.people_p is None or repeated.people_p >= ALPHA:
        return 0.0
    return math.copysign(1.0, repeated.r)
