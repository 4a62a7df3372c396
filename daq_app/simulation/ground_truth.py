"""How scores go with the model's SEDs among simulated people at large: the truth of a synthetic study's headline.

The people of one study are ten of very many, and its intervals are for the others too, on the same ten surfaces. So
very many more of them judge these here, each with a finger of its own, in orders of their own.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from daq_app.simulation.synthetic import PROTOCOL
from daq_app.simulation.wiring import planted_surface
from sessions.plan.plan import Block
from sessions.plan.protocols import plan, protocol
from sessions.prediction import PredictionOptions
from sessions.prediction.scenes import seds_at
from sessions.strokes.stroke import FIXED, AreaLaw
from simulators.stroke import Surface
from simulators.subject import SimulatedSubject, SubjectSettings

Load = tuple[float, float, float, int, float]  # mu [-], tau_max [MPa], depth [mm], direction, speed [mm/s]
SedsAt = Callable[[Sequence[Load]], Sequence[float | None]]

DRAWN = 2000  # people
_FIRST = 1_000_000  # seed: nobody of a study's
_FINGERS = np.linspace(-4.0, 4.0, 9)  # solved: friction of the finger, in its standard deviations between people


@dataclass(frozen=True, slots=True)
class PlantedRelation:
    """How single scores go with SEDs within people at large."""

    r: float  # the noise of judgement in it
    slope: float  # drift and carry-over beside it [points per kPa]


def planted_relations(
    people: Mapping[str, float], options: PredictionOptions, area: AreaLaw
) -> dict[str, dict[str, float]]:
    """Return the relation for each descriptor with the SEDs of the published finger, which simulated people have.

    None where a law of the area tells another tau_max than the planted one, and none at finite strain, where most
    sticky surfaces have no settled slide.
    """
    if options.kinematics == "finite" or area != FIXED:
        return {}
    planted = relations(SubjectSettings(**people), lambda loads: seds_at(loads, options))
    return {descriptor: asdict(relation) for descriptor, relation in planted.items()}


def relations(people: SubjectSettings, seds: SedsAt) -> Mapping[str, PlantedRelation]:
    """Return the relation for each descriptor; none where a surface has no settled slide."""
    by_descriptor: dict[str, PlantedRelation] = {}
    for block in plan(protocol(PROTOCOL), "S00", 0).blocks:
        surfaces = [planted_surface(trial) for trial in block.trials]
        at = _seds_of_fingers(surfaces, block, people.moisture, seds)
        if at is not None:
            by_descriptor[surfaces[0].descriptor] = _relation(people, surfaces, at)
    return by_descriptor


def _seds_of_fingers(
    surfaces: Sequence[Surface], block: Block, moisture: float, seds: SedsAt
) -> Callable[[float], Sequence[float]] | None:
    """Return what gives the SED [kPa] of each surface under a finger whose friction is so many times the usual."""
    times = np.exp(moisture * _FINGERS) if moisture else np.ones(1)
    loads = [
        (s.mu * m, s.tau_max * m, block.indentation, s.direction, s.speed) for m in times.tolist() for s in surfaces
    ]
    solved = [sed for sed in seds(loads) if sed is not None]
    if len(solved) < len(loads):
        return None
    table = 1e3 * np.array(solved).reshape(len(times), len(surfaces))
    if not moisture:
        return lambda _: table[0].tolist()
    spline = CubicSpline(np.log(times), table)
    return lambda m: np.asarray(spline(math.log(m))).tolist()


def _relation(
    people: SubjectSettings, surfaces: Sequence[Surface], seds: Callable[[float], Sequence[float]]
) -> PlantedRelation:
    products = np.zeros((4, 4))  # of SED, place, index before, and score, each without the person's own mean
    draw, indices = np.random.default_rng(0), [surface.index for surface in surfaces]
    for seed in range(_FIRST, _FIRST + DRAWN):
        person, order = SimulatedSubject(seed, people), [int(one) for one in draw.permutation(len(surfaces))]
        perceived = [person.perceived(surface) for surface in surfaces]
        own = seds(perceived[0].mu / surfaces[0].mu)
        before: list[int | None] = [None, *(indices[one] for one in order[:-1])]
        rows = np.array(
            [
                (own[one], place, 0 if last is None else last - 50, person.meant(perceived[one], place, last))
                for place, (one, last) in enumerate(zip(order, before, strict=True))
            ]
        )
        rows -= rows.mean(axis=0)
        products += rows.T @ rows
    noise = people.judgement_noise**2 * DRAWN * (len(surfaces) - 1)
    r = products[0, 3] / math.sqrt(products[0, 0] * (products[3, 3] + noise))
    slope = np.linalg.solve(products[:3, :3], products[:3, 3])[0]
    return PlantedRelation(float(r), float(slope))
