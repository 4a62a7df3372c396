"""Capability of a study's design: the power of its test, and how often it identifies the quantity scores follow.

Power is the share of simulated studies whose test detects the assumed effect. For the identification, scores are a
linear function of one quantity with random levels and noise. The rivals are all quantities of the report that a stroke
has; the one with the greatest Akaike weight is preferred. Twins of the true quantity correlate with it over all strokes
with |r| of at least 0.99. T is left out: with one area it equals the bound.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from drivers.arrays import Array
from sessions.statistics.mixed_model import akaike_weights, crossed_aic
from sessions.statistics.scores import SCORE_SCALE
from sessions.statistics.within_subjects import repeated_correlation

ALPHA = 0.05  # of the study's confirmatory test, two-sided
_MIDDLE = sum(SCORE_SCALE) / 2.0
MU_RANGE = (0.24, 0.67)  # least and greatest µ of the published surfaces


@dataclass(frozen=True, slots=True)
class AssumedEffects:
    """Effect and spreads of simulated scores. We chose the defaults; a pilot's mixed model gives measured ones."""

    effect: float = 20.0  # of the mean score, from the least to the greatest µ or other quantity [0–100]
    noise: float = 12.0  # standard deviation of a score about its subject's line [0–100]
    level_sd: float = 12.0  # between subjects, of the level [0–100]
    slope_sd: float = 0.5  # between subjects, of the effect, relative to the mean effect [-]
    friction_sd: float = 0.1  # of the µ of one stroke, relative to the surface's µ [-]


@dataclass(frozen=True, slots=True)
class Power:
    """Power of one design."""

    subjects: int
    surfaces: int
    detections: int  # studies whose test detects the effect with its sign
    wrong: int  # studies whose test detects the opposite sign
    studies: int

    @property
    def share(self) -> float:
        """The power [-]."""
        return self.detections / self.studies


def power(
    effects: AssumedEffects,
    subjects: Sequence[int],
    surfaces: Sequence[int],
    studies: int,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> list[Power]:
    """Return the power of each combination of subjects and surfaces, with one trial for each surface.

    The test is the one on a study's page: the correlation of scores with measured µ within subjects, with the
    jackknife's p over subjects. The surfaces' µ are evenly spaced over the published range, and all subjects meet the
    same surfaces. Scores are clipped to 0 and 100.
    """
    designs = [(people, count) for people in subjects for count in surfaces]
    powers: list[Power] = []
    for number, (people, count) in enumerate(designs):
        rng = np.random.default_rng([seed, people, count])
        verdicts = [_verdict(*_study(effects, people, count, rng)) for _ in range(studies)]
        sign = math.copysign(1.0, effects.effect)
        powers.append(Power(people, count, verdicts.count(sign), verdicts.count(-sign), studies))
        progress((number + 1) / len(designs))
    return powers


def _study(
    effects: AssumedEffects, people: int, count: int, rng: np.random.Generator
) -> tuple[list[str], Array, Array]:
    """Return subject, measured µ and score of each trial."""
    stroke_mu = np.linspace(*MU_RANGE, count) * np.exp(rng.normal(0.0, effects.friction_sd, (people, count)))
    slope = effects.effect * (1.0 + effects.slope_sd * rng.standard_normal((people, 1))) / (MU_RANGE[1] - MU_RANGE[0])
    level = _MIDDLE + effects.level_sd * rng.standard_normal((people, 1))
    scores = level + slope * (stroke_mu - np.mean(MU_RANGE)) + effects.noise * rng.standard_normal((people, count))
    names = [f"P{number}" for number in range(people) for _ in range(count)]
    return names, stroke_mu.ravel(), np.clip(scores, *SCORE_SCALE).ravel()


def _verdict(subjects: Sequence[str], mu: Array, scores: Array) -> float:
    """Return the sign of a significant effect, 0 without one."""
    repeated = repeated_correlation(subjects, mu.tolist(), scores.tolist())
    if repeated is None or repeated.people_p is None or repeated.people_p >= ALPHA:
        return 0.0
    return math.copysign(1.0, repeated.r)


TWIN = 0.99  # correlation over all strokes


class Recovery(msgspec.Struct, frozen=True):
    """How often studies of one design prefer the true quantity."""

    people: int
    surfaces: int
    depths: tuple[float, ...]  # [mm]
    quantity: str = msgspec.field(name="planted")  # that scores follow
    twins: tuple[str, ...]
    preferred: float  # share of studies that prefer the true quantity [-]
    family: float  # share that prefer it or a twin [-]
    studies: int


def recovery(
    strokes: Mapping[str, Array],
    people: int,
    depths: tuple[float, ...],
    quantity: str,
    effects: AssumedEffects,
    studies: int,
    draw: np.random.Generator,
) -> Recovery:
    """Return how often studies of `people` drawn from `strokes` prefer the quantity that scores follow."""
    surfaces = strokes[quantity].shape[1] // len(depths)
    weights = [study_weights(strokes, people, surfaces, quantity, effects, draw) for _ in range(studies)]
    twin_names, preferred = twins(strokes, quantity), [max(study, key=study.__getitem__) for study in weights]
    shares = preferred.count(quantity) / studies, sum(name in twin_names for name in preferred) / studies
    return Recovery(people, surfaces, depths, quantity, tuple(sorted(twin_names - {quantity})), *shares, studies)


def study_weights(
    strokes: Mapping[str, Array],
    people: int,
    surfaces: int,
    quantity: str,
    effects: AssumedEffects,
    draw: np.random.Generator,
    own_share: float = 1.0,
) -> dict[str, float]:
    """Return the Akaike weight of each rival in one synthetic study of `people` drawn from `strokes` (people, trials).

    Trials are ordered by depth, then by surface. Scores follow the usual value of each trial, its mean over `strokes`,
    and `own_share` of the stroke's difference from that.
    """
    sample = draw.choice(len(strokes[quantity]), people, replace=False)
    values = {name: population[sample] for name, population in strokes.items()}
    usable = np.isfinite(np.stack(list(values.values()))).all(axis=0)
    finite: Array = strokes[quantity][np.isfinite(strokes[quantity])]
    level, noise = draw.standard_normal((people, 1)), draw.standard_normal(usable.shape)
    # The effect spans the range of a uniform quantity, whose standard deviation is the range over √12.
    slope = effects.effect / math.sqrt(12.0) * np.ones((people, 1))
    if effects.slope_sd:
        slope *= 1.0 + effects.slope_sd * draw.standard_normal((people, 1))
    usual = np.nanmean(strokes[quantity], axis=0)
    perceived = usual + own_share * (values[quantity] - usual)
    scores: Array = slope * (perceived - finite.mean()) / finite.std()
    scores += _MIDDLE + effects.level_sd * level + effects.noise * noise
    subjects, trials = np.nonzero(usable)
    groups = list(map(str, subjects)), (trials % surfaces).tolist(), list(map(str, trials))
    criteria = {name: crossed_aic(*groups, scores[usable].tolist(), x[usable].tolist()) for name, x in values.items()}
    comparable = {name: value for name, value in criteria.items() if value is not None}
    return dict(zip(comparable, akaike_weights(list(comparable.values())), strict=True))


def twins(strokes: Mapping[str, Array], quantity: str) -> set[str]:
    """Return the quantity and those that correlate with it over all strokes with |r| of at least `TWIN`."""
    finite = np.isfinite(np.stack(list(strokes.values()))).all(axis=0)
    y = strokes[quantity][finite]
    return {name for name, x in strokes.items() if abs(np.corrcoef(x[finite], y)[0, 1]) >= TWIN} | {quantity}
