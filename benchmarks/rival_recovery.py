"""How often a study tells which quantity its scores follow: scores made of a planted one, by the report's own weights.

Friction, bound and normal force vary from stroke to stroke, responses come from the model at that friction, and scores
are a line in the planted quantity with levels of people and noise. The rivals are all quantities of the report that
such a stroke has. One is preferred where it has the greatest Akaike weight, and decided where that is at least 0.95.
Twins of the planted quantity go with it over all strokes with r of at least 0.99 in size. T is left out: with one area
it is the bound itself.

Run from the repository's root: python -m benchmarks.rival_recovery [STUDIES [SEED [DESIGN ...]]]; 200 of each planted
quantity by default. Prints a table for the documentation.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sessions.prediction import QUANTITIES
from sessions.statistics.crossed_model import akaike_weights, crossed_deviance
from solver import Friction
from solver.response.receptor_row import rough_responses
from solver.scene.published import STICKINESS, scene

Array = NDArray[np.float64]

MODEL = tuple(one.name for one in QUANTITIES)
PLANTED = ("mu", "tau_max", "sed", "shear_along_skin", "stretch_along_skin", "pressure")
TWIN = 0.99  # correlation over all strokes
DECIDED = 0.95  # Akaike weight, as a posterior probability under equal priors
PERSON, STROKE = 0.08, 0.05  # standard deviation of ln mu between people, and from stroke to stroke [-]
PRESS = 0.2  # standard deviation of ln N from stroke to stroke [-]
LEVEL, NOISE = 3.0, 4.0  # standard deviation of people's levels and of judgement [points]
RISE = 25.0  # of scores for each standard deviation of the planted quantity [points]
AREA = 100.0  # of the contact [mm2]


@dataclass(frozen=True)
class Design:
    """People and surfaces of a study."""

    name: str
    people: int
    mu: tuple[float, ...]  # of each surface
    force: tuple[float, ...]  # usual normal force in each trial of a person, surface by surface within depths [N]
    speed: tuple[float, ...]  # likewise [mm/s]
    depths: tuple[float, ...] = (2.0,)  # each surface is stroked at each of them [mm]


PAPER = Design(
    "10 × 5",
    10,
    tuple(one.mu for one in STICKINESS),
    tuple(1e-2 * one.printed_bound * AREA / one.mu for one in STICKINESS),
    tuple(one.speed for one in STICKINESS),
)
# Forces in an order of their own, so that the bound does not follow friction.
WIDE = Design(
    "20 × 12",
    20,
    tuple(np.linspace(0.2, 0.7, 12).round(3).tolist()),
    (2.0, 4.5, 3.0, 6.5, 2.5, 5.0, 3.5, 6.0, 2.2, 4.0, 5.5, 3.2),
    (20.0, 16.0, 24.0, 18.0, 22.0, 15.0, 25.0, 19.0, 17.0, 23.0, 21.0, 16.5),
)
# The same surfaces at three depths: depth moves the parts of the strain by other shares than friction does.
CROSSED = Design(
    "24 × 8 × 3",
    24,
    tuple(np.linspace(0.1, 0.7, 8).round(3).tolist()),
    tuple(np.repeat((1.6, 2.8, 4.2), 8).tolist()),
    WIDE.speed * 2,
    (1.25, 1.75, 2.25),
)
DESIGNS = (PAPER, WIDE, CROSSED)
POOL = 60  # people whose strokes the model is asked of; each study draws its own from them


def strokes(design: Design, draw: np.random.Generator) -> Mapping[str, Array]:
    """Return every quantity of strokes of the pool (people, surfaces within depths)."""
    shape = (POOL, len(design.mu) * len(design.depths))
    moist = PERSON * draw.standard_normal((POOL, 1)) + STROKE * draw.standard_normal(shape)
    mu = np.tile(design.mu, len(design.depths)) * np.exp(moist)
    normal = np.array(design.force) * np.exp(PRESS * draw.standard_normal(shape))
    tau = mu * normal / AREA
    base = scene(STICKINESS[0])
    settled = replace(base.solve, course="steady")
    pressed = [replace(base.loading, indentation=d) for d in np.tile(np.repeat(design.depths, len(design.mu)), POOL)]
    scenes = [
        replace(base, friction=Friction(m, t), loading=loading, solve=settled)
        for m, t, loading in zip(mu.flat, tau.flat, pressed, strict=True)
    ]
    responses = rough_responses(scenes)[:, :, 0].reshape(*shape, len(MODEL))
    speed = np.array(design.speed) * np.exp(STROKE * draw.standard_normal(shape))
    own = {"mu": mu, "tau_max": tau, "N": normal, "speed": speed}
    return own | {name: responses[:, :, at] for at, name in enumerate(MODEL)}


def study_weights(
    design: Design, pool: Mapping[str, Array], planted: str, draw: np.random.Generator
) -> dict[str, float]:
    """Return the Akaike weight of each rival in one synthetic study."""
    own = draw.choice(POOL, design.people, replace=False)
    values = {name: all_of[own] for name, all_of in pool.items()}
    usable = np.isfinite(np.stack(list(values.values()))).all(axis=0)
    felt: Array = pool[planted][np.isfinite(pool[planted])]
    level, noise = draw.standard_normal((design.people, 1)), draw.standard_normal(usable.shape)
    scores: Array = 50.0 + RISE * (values[planted] - felt.mean()) / felt.std() + LEVEL * level + NOISE * noise
    people, trials = np.nonzero(usable)
    surfaces = trials % len(design.mu)
    found = {
        name: crossed_deviance(list(map(str, people)), surfaces.tolist(), scores[usable].tolist(), x[usable].tolist())
        for name, x in values.items()
    }
    told = {name: value for name, value in found.items() if value is not None}
    return dict(zip(told, akaike_weights(list(told.values())), strict=True))


def twins(pool: Mapping[str, Array], planted: str) -> set[str]:
    """Return the planted quantity and those that go with it over all strokes."""
    known = np.isfinite(np.stack(list(pool.values()))).all(axis=0)
    size = {name: abs(float(np.corrcoef(x[known], pool[planted][known])[0, 1])) for name, x in pool.items()}
    return {name for name, r in size.items() if r >= TWIN} | {planted}


def row(design: Design, planted: str, alike: set[str], weights: Sequence[Mapping[str, float]]) -> str:
    """Return a row of the table: how often what was planted, a twin of it, and a wrong one is preferred or decided."""
    first = [max(one, key=one.__getitem__) for one in weights]
    sure = [name for name, one in zip(first, weights, strict=True) if one[name] >= DECIDED]
    wrong = [name for name in first if name not in alike]
    most = f"`{max(sorted(set(wrong)), key=wrong.count)}`" if wrong else "–"
    counts = [
        first.count(planted),
        sum(name in alike for name in first),
        sum(name in MODEL and (planted not in MODEL or name not in alike) for name in first),
        sure.count(planted),
        sum(name not in alike for name in sure),
    ]
    told = " | ".join(f"{100 * count / len(weights):.1f} %" for count in counts)
    return f"| {design.name} | `{planted}` | {len(alike) - 1} | {told} | {most} |"


def main() -> None:
    """Print the table."""
    count, seed = (int(sys.argv[1]) if len(sys.argv) > 1 else 200), (int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    head = "study | planted | twins | preferred | it or a twin | a wrong one of the model | decided | decided wrongly"
    print(f"| {head} | wrong most often |")
    print("| --- " * (head.count("|") + 2) + "|")
    only = sys.argv[3:]
    for number, design in enumerate(DESIGNS):
        if only and str(number) not in only:
            continue
        pool = strokes(design, np.random.default_rng([seed, number]))
        for planted in PLANTED:
            draw = np.random.default_rng([seed, number, PLANTED.index(planted)])
            weights = [study_weights(design, pool, planted, draw) for _ in range(count)]
            print(row(design, planted, twins(pool, planted), weights), flush=True)


if __name__ == "__main__":
    main()
