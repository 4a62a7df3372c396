"""What was planted in a simulated study beside what the study finds, which does not know of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import msgspec
import numpy as np

from sessions.statistics.pooling.findings import (
    CARRY_OVER,
    DRIFT,
    FINGERS,
    FRICTION,
    INDEX,
    LEVELS,
    NOISE,
    SED_TERM,
    SLOPES,
    WITHIN,
    DescriptorFindings,
    PlantedFlaw,
    PlantedFriction,
    Recovered,
)
from sessions.statistics.pooling.visit import Visit, scores_of
from sessions.statistics.scores import reversed_subjects
from sessions.statistics.variance_components import Spread


class _Score(msgspec.Struct):
    gain: float
    drift: float
    carry_over: float
    friction: dict[str, float] = {}


class _People(msgspec.Struct):
    gain_spread: float
    offset_spread: float
    judgement_noise: float
    moisture: float
    friction_weight: float = 0.0


class _Relation(msgspec.Struct):
    r: float
    slope: float


class _Stroke(msgspec.Struct):
    subject: str
    trial: int
    mu: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Spoilt:
    """What goes wrong in one subject's visit, by number of the trial; 0: nowhere."""

    lost: int = 0
    frozen: int = 0
    light: int = 0
    unanswered: int = 0
    aborted: int = 0
    reversed: bool = False
    expected: str  # what the analysis should say


class _Planted(msgspec.Struct):
    score: _Score
    people: _People
    strokes: list[_Stroke]
    calibration_sd: float = 0.0
    relation: dict[str, _Relation] = {}
    spoilt: dict[str, Spoilt] = {}
    seed: int | None = None


def checked_planted(planted: object) -> dict[str, Any]:
    """Return what was planted in a study, as its file holds it. Raises ValueError where it is nothing of the kind."""
    msgspec.convert(planted, _Planted)
    return cast("dict[str, Any]", planted)


def recovered(descriptors: Sequence[DescriptorFindings], planted: Mapping[str, Any]) -> tuple[Recovered, ...]:
    """Return the planted effects on the score, and spreads, beside what the study finds of them.

    `planted["score"]` holds the slopes of the scores on index, place and index before, and on µ by descriptor.
    """
    rows: list[Recovered] = []
    for one in descriptors:
        rows += [*_slopes(one, planted["score"]), *_with_sed(one, planted), *_spreads(one, planted)]
    return tuple(rows)


def _slopes(one: DescriptorFindings, score: Mapping[str, Any]) -> list[Recovered]:
    slopes = {
        INDEX: score["gain"],
        FRICTION: score.get("friction", {}).get(one.descriptor, 0.0),
        DRIFT: score["drift"],
        CARRY_OVER: score["carry_over"],
    }
    terms = () if isinstance(one.on_friction, str) else one.on_friction.terms
    return [
        Recovered(one.descriptor, t.name, slopes[t.name], t.estimate, t.low, t.high) for t in terms if t.name in slopes
    ]


def _spreads(one: DescriptorFindings, planted: Mapping[str, Any]) -> list[Recovered]:
    people = planted.get("people")
    if not people:
        return []
    rows: list[Recovered] = []
    if not isinstance(one.on_friction, str) and (differ := one.on_friction.spreads) is not None:
        by_index = (1.0 - people.get("friction_weight", 0.0)) * people["gain_spread"]
        rows += [
            _spread(one, name, sd, spread)
            for name, sd, spread in (
                (LEVELS, people["offset_spread"], differ.level),
                (SLOPES, by_index, differ.slope),
                (NOISE, people["judgement_noise"], differ.left),
            )
            if spread is not None
        ]
    if one.fingers is not None:
        # A transducer's gains, of drag and of press, differ between visits as fingers do.
        sd = math.hypot(people["moisture"], math.sqrt(2.0) * planted.get("calibration_sd", 0.0))
        rows.append(_spread(one, FINGERS, sd, one.fingers))
    return rows


def _spread(one: DescriptorFindings, name: str, planted: float, spread: Spread) -> Recovered:
    return Recovered(one.descriptor, name, planted, spread.sd, spread.low, spread.high)


def _with_sed(one: DescriptorFindings, planted: Mapping[str, Any]) -> list[Recovered]:
    """Return how scores go with SEDs among people at large on these surfaces, beside the intervals for such people."""
    relation = planted.get("relation", {}).get(one.descriptor)
    if relation is None or one.repeated is None or one.repeated.people is None:
        return []
    rows = [Recovered(one.descriptor, WITHIN, relation["r"], one.repeated.r, *one.repeated.people)]
    if not isinstance(one.on_response, str):
        term = one.on_response.term(SED_TERM)
        rows.append(Recovered(one.descriptor, SED_TERM, relation["slope"], term.estimate, term.low, term.high))
    return rows


_FLAWS = {"lost": "lost_readings", "frozen": "frozen_sensor", "light": "too_little_force"}


def found_flaws(
    visits: Sequence[Visit], failed: Mapping[str, str], spoilt: Mapping[str, Mapping[str, Any]]
) -> tuple[PlantedFlaw, ...]:
    """Return for each session that was spoilt whether what it brings, or that it brings nothing, says so."""
    named = {visit.session: visit for visit in visits}
    backwards = {subject for subject, _, _ in reversed_subjects([scores_of(visit, visit.rows) for visit in visits])}
    rows_found: list[PlantedFlaw] = []
    for session, faults in spoilt.items():
        visit = named.get(session)
        if visit is None:
            rows_found.append(PlantedFlaw(session, faults["expected"], session in failed))
            continue
        rows = {row.trial: row for row in visit.rows}
        if any(faults.get(name) and faults[name] not in rows for name in (*_FLAWS, "unanswered", "aborted")):
            rows_found.append(
                PlantedFlaw(session, faults["expected"], detected=False)
            )  # a trial that the session does not have
            continue
        seen = [flaw in rows[faults[name]].flaws for name, flaw in _FLAWS.items() if faults.get(name)]
        seen += [rows[faults["unanswered"]].score is None] if faults.get("unanswered") else []
        seen += [rows[faults["aborted"]].outcome == "open" and not visit.complete] if faults.get("aborted") else []
        seen += [visit.subject in backwards] if faults.get("reversed") else []
        rows_found.append(PlantedFlaw(session, faults["expected"], bool(seen) and all(seen)))
    return tuple(rows_found)


def found_friction(visits: Sequence[Visit], strokes: Sequence[Mapping[str, Any]]) -> PlantedFriction | None:
    """Return how the planted µ of the strokes was recovered; None where no stroke has both."""
    truth = {(stroke["subject"], stroke["trial"]): float(stroke["mu"]) for stroke in strokes}
    rows = [
        (row, truth[visit.subject, row.trial])
        for visit in visits
        for row in visit.rows
        if row.mu is not None and (visit.subject, row.trial) in truth
    ]
    if not rows:
        return None
    errors = [abs((row.mu or 0.0) / mu - 1.0) for row, mu in rows]
    holds = [row.mu_low <= mu <= row.mu_high for row, mu in rows if row.mu_low is not None and row.mu_high is not None]
    return PlantedFriction(len(rows), float(np.median(errors)), max(errors), len(holds), sum(holds))
