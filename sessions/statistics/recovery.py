"""How often a study tells which quantity its scores follow: scores made of a planted one, by the report's own weights.

Scores are a line in the planted quantity with levels of people and noise. The rivals are all quantities of the report
that a stroke has. One is preferred where it has the greatest Akaike weight. Twins of the planted quantity go with it
over all strokes with r of at least 0.99 in size. T is left out: with one area it is the bound itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sessions.statistics.crossed_model import akaike_weights, crossed_deviance
from sessions.statistics.reml import Array

TWIN = 0.99  # correlation over all strokes
_MIDDLE = 50.0  # of the scale of scores [points]


@dataclass(frozen=True, slots=True)
class Judgement:
    """How scores follow the planted quantity."""

    rise: float  # for each standard deviation of the planted quantity [points]
    noise: float  # standard deviation of one score [points]
    level_sd: float  # between people [points]
    slope_sd: float = 0.0  # between people, by the rise [-]


@dataclass(frozen=True, slots=True)
class Recovery:
    """What the studies of one design prefer."""

    people: int
    surfaces: int
    depths: tuple[float, ...]  # [mm]
    planted: str
    twins: tuple[str, ...]
    preferred: float  # share of studies that prefer the planted quantity [-]
    family: float  # share that prefer it or a twin [-]
    studies: int


def recovery(
    strokes: Mapping[str, Array],
    people: int,
    depths: tuple[float, ...],
    planted: str,
    judgement: Judgement,
    studies: int,
    draw: np.random.Generator,
) -> Recovery:
    """Return how often studies of so many of the people in `strokes` prefer the planted quantity."""
    surfaces = strokes[planted].shape[1] // len(depths)
    weights = [study_weights(strokes, people, surfaces, planted, judgement, draw) for _ in range(studies)]
    alike, first = twins(strokes, planted), preferred(weights)
    shares = first.count(planted) / studies, sum(name in alike for name in first) / studies
    return Recovery(people, surfaces, depths, planted, tuple(sorted(alike - {planted})), *shares, studies)


def study_weights(
    strokes: Mapping[str, Array],
    people: int,
    surfaces: int,
    planted: str,
    judgement: Judgement,
    draw: np.random.Generator,
) -> dict[str, float]:
    """Return the Akaike weight of each rival in one synthetic study of `people` drawn from `strokes` (people, trials).

    Trials go surface by surface within depths.
    """
    own = draw.choice(len(strokes[planted]), people, replace=False)
    values = {name: all_of[own] for name, all_of in strokes.items()}
    usable = np.isfinite(np.stack(list(values.values()))).all(axis=0)
    known: Array = strokes[planted][np.isfinite(strokes[planted])]
    level, noise = draw.standard_normal((people, 1)), draw.standard_normal(usable.shape)
    slope = judgement.rise * np.ones((people, 1))
    if judgement.slope_sd:
        slope *= 1.0 + judgement.slope_sd * draw.standard_normal((people, 1))
    scores: Array = slope * (values[planted] - known.mean()) / known.std()
    scores += _MIDDLE + judgement.level_sd * level + judgement.noise * noise
    subjects, trials = np.nonzero(usable)
    at = (trials % surfaces).tolist()
    deviances = {
        name: crossed_deviance(list(map(str, subjects)), at, scores[usable].tolist(), x[usable].tolist())
        for name, x in values.items()
    }
    known_deviances = {name: value for name, value in deviances.items() if value is not None}
    return dict(zip(known_deviances, akaike_weights(list(known_deviances.values())), strict=True))


def preferred(weights: Sequence[Mapping[str, float]]) -> list[str]:
    """Return the rival of the greatest weight in each study."""
    return [max(one, key=one.__getitem__) for one in weights]


def twins(strokes: Mapping[str, Array], planted: str) -> set[str]:
    """Return the planted quantity and those that go with it over all strokes."""
    known = np.isfinite(np.stack(list(strokes.values()))).all(axis=0)
    size = {name: abs(float(np.corrcoef(x[known], strokes[planted][known])[0, 1])) for name, x in strokes.items()}
    return {name for name, r in size.items() if r >= TWIN} | {planted}
