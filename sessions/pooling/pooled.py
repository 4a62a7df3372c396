"""What the visits of a study say together: means, agreement, and how predictions go with scores. Plain data."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from sessions.analysis.mixed import MixedModel, mixed_model
from sessions.analysis.scores import (
    MeanScore,
    Relation,
    Score,
    ScoreTable,
    mean_scores,
    relation,
    reversed_subjects,
    score_matrix,
)
from sessions.analysis.spread import Spread, spreads
from sessions.analysis.within import (
    Agreement,
    Difference,
    RepeatedCorrelation,
    WithinMean,
    agreement,
    differences,
    holm,
    repeated_correlation,
    standardised,
    within_means,
)
from sessions.paths import PathFinding, PathTrial, path_findings
from sessions.pooling.averages import Average, Estimates, average, averages, by_subject, estimates
from sessions.pooling.exclusions import Exclusion, decided
from sessions.pooling.visit import TrialRow, Visit, VisitOptions

SED = "SED [kPa]"
INDEX = "index − 50"
DRIFT = "trials before in the block"
CARRY_OVER = "index stroked before − 50"
LEVELS = "spread of subjects' levels"
SLOPES = "spread of subjects' slopes on the index"
NOISE = "noise of single scores"
FINGERS = "spread of log µ between fingers and transducers"
UNITS = {
    INDEX: "points per index",
    SED: "points per kPa",
    DRIFT: "points per trial",
    CARRY_OVER: "points per index",
    LEVELS: "points",
    SLOPES: "points per index",
    NOISE: "points",
    FINGERS: "1",
}  # of effects on the score, and of the spreads


@dataclass(frozen=True, slots=True)
class Normalised:
    """What is told of scores when each subject's use of the scale is taken away: own mean 0, own spread 1."""

    means: Mapping[int, Average]  # by index
    mean_relation: Relation | None
    repeated: RepeatedCorrelation | None


@dataclass(frozen=True, slots=True)
class SurfaceMean:
    """Means over subjects of one surface; None where there is no subject's number."""

    index: int
    subjects: int  # whose stroke gave an SED
    mu: Average | None
    sed: Average | None  # [MPa]
    normal_force: Average | None  # measured [N]
    model_normal_force: Average | None  # of the model, pressed to its depth [N]
    matching_depth: Average | None  # at which the model would press as hard as the subject did [mm]


@dataclass(frozen=True, slots=True)
class DescriptorFindings:
    """All that a study says of one descriptor."""

    descriptor: str
    indices: tuple[int, ...]
    scores: tuple[MeanScore, ...]
    within: tuple[WithinMean, ...]
    agreement: Agreement | None
    surfaces: tuple[SurfaceMean, ...]
    answers: Mapping[str, tuple[float | None, ...]]  # subject -> score of each index
    points: tuple[tuple[str, int, float, float], ...]  # subject, index, SED [MPa], score: all of its own strokes
    mean_relation: Relation | None  # mean SED [MPa] against mean score
    repeated: RepeatedCorrelation | None  # of a subject's scores with the SEDs of its own strokes
    repeated_holm: float | None  # its p, allowing for as many descriptors as have one
    without_subject: tuple[tuple[str, float], ...]  # subject left out, r within the others
    normalised: Normalised
    differences: tuple[Difference, ...]
    estimates: Estimates | None
    on_sed: MixedModel | str  # score on SED [kPa], drift and carry-over; or why there is no model
    on_index: MixedModel | str  # score on the maker's index, drift and carry-over
    fingers: Spread | None  # how fingers differ: of the logarithm of mu between subjects, surfaces taken away [-]
    paths: tuple[PathFinding, ...]  # () where they were not asked for


@dataclass(frozen=True, slots=True)
class Recovered:
    """One planted effect beside what the study found."""

    descriptor: str
    effect: str
    planted: float
    found: float
    low: float
    high: float

    @property
    def covered(self) -> bool:
        """Say whether the interval holds what was planted."""
        return self.low <= self.planted <= self.high


@dataclass(frozen=True, slots=True)
class PlantedFriction:
    """How friction of all strokes was recovered."""

    strokes: int  # with a planted and a found mu
    median_error: float  # of mu, relative [-]
    worst_error: float
    intervals: int  # of mu that are given
    covered: int  # of them hold what was planted


@dataclass(frozen=True, slots=True)
class PlantedFlaw:
    """What was spoilt in one session, and whether the study says so."""

    session: str
    expected: str  # for people
    found: bool


@dataclass(frozen=True, slots=True)
class StudyFindings:
    """The result of a study."""

    simulated: str
    options: VisitOptions
    visits: tuple[Visit, ...]  # all that were read, those left out too
    failed: tuple[tuple[str, str], ...]  # folder, why it could not be read
    copies: tuple[tuple[str, str], ...]  # session that counts nothing, and the one whose recording it holds again
    excluded: tuple[Exclusion, ...]
    reversed: tuple[tuple[str, str, float], ...]  # subject, descriptor, r of score with index: still counted
    descriptors: tuple[DescriptorFindings, ...]
    effects: tuple[Recovered, ...]  # planted, where the study is synthetic
    friction: PlantedFriction | None
    flaws: tuple[PlantedFlaw, ...] = ()  # planted, where the study is synthetic

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {**({"simulated": self.simulated} if self.simulated else {}), **asdict(self)}


def pooled(
    visits: Sequence[Visit],
    failed: Sequence[tuple[str, str]] = (),
    exclusions: tuple[Exclusion, ...] = (),
    planted: Mapping[str, Any] | None = None,
    options: VisitOptions | None = None,
) -> StudyFindings:
    """Return what the visits say together; they count in the order of their names, whoever read them first.

    `options` is what was asked of each visit. `planted` is what a synthetic study tells of itself: handed in, used for
    nothing but the comparison.
    """
    ordered = tuple(sorted(visits, key=lambda visit: visit.session))
    copies = _copies(ordered)
    counted = [visit for visit in ordered if visit.session not in copies]
    kept = [(v, row) for v in counted for row in v.rows if decided(exclusions, v.subject, row.descriptor) is None]
    tables = [_table(visit, [row for v, row in kept if v is visit]) for visit in counted]
    asked = options or VisitOptions()
    found = tuple(
        _descriptor(name, asked, tables, [(v, row) for v, row in kept if row.descriptor == name])
        for name in dict.fromkeys(row.descriptor for _, row in kept)
    )
    found = _with_holm(found)
    return StudyFindings(
        simulated=_simulated(ordered),
        options=asked,
        visits=ordered,
        failed=tuple(sorted(failed)),
        copies=tuple(copies.items()),
        excluded=exclusions,
        reversed=reversed_subjects(tables),
        descriptors=found,
        effects=() if planted is None else _recovered(found, planted),
        friction=None if planted is None else _friction(ordered, planted["strokes"]),
        flaws=() if planted is None else _flaws(ordered, dict(failed), planted.get("spoilt", {})),
    )


def _copies(visits: Sequence[Visit]) -> dict[str, str]:
    """Return the sessions that hold the recording of an earlier one once more, each with that one's name."""
    first: dict[str, str] = {}
    for visit in visits:
        if visit.sha256:
            first.setdefault(visit.sha256, visit.session)
    return {v.session: first[v.sha256] for v in visits if v.sha256 and first[v.sha256] != v.session}


def _with_holm(found: Sequence[DescriptorFindings]) -> tuple[DescriptorFindings, ...]:
    tested = [one.descriptor for one in found if one.repeated is not None]
    adjusted = dict(zip(tested, holm([one.repeated.p for one in found if one.repeated is not None]), strict=True))
    return tuple(replace(one, repeated_holm=adjusted.get(one.descriptor)) for one in found)


def _simulated(visits: Sequence[Visit]) -> str:
    made_up = sum(bool(visit.simulated) for visit in visits)
    if not made_up:
        return ""
    return f"SIMULATED: {made_up} of the {len(visits)} sessions of this study are simulated"


def _table(visit: Visit, rows: Sequence[TrialRow]) -> ScoreTable:
    scores = tuple(Score(visit.subject, row.descriptor, row.index, row.score) for row in rows if row.score is not None)
    return ScoreTable(visit.session, visit.subject, bool(visit.simulated), scores)


def _descriptor(
    name: str, options: VisitOptions, tables: Sequence[ScoreTable], trials: Sequence[tuple[Visit, TrialRow]]
) -> DescriptorFindings:
    indices = tuple(sorted({row.index for _, row in trials}))
    means = tuple(mean for mean in mean_scores(tables) if mean.descriptor == name)
    matrix = score_matrix(tables, name)
    surfaces = tuple(_surface(index, [(v, r) for v, r in trials if r.index == index]) for index in indices)
    level = standardised(matrix)
    points = [(v.subject, r, r.sed, r.score) for v, r in trials if r.sed is not None and r.score is not None]
    scored = [(v.subject, r, r.score) for v, r in trials if r.score is not None]
    score_of = {mean.index: mean.mean for mean in means}
    return DescriptorFindings(
        descriptor=name,
        indices=indices,
        scores=means,
        within=within_means(matrix),
        agreement=agreement(matrix),
        surfaces=surfaces,
        answers={subject: tuple(row.get(index) for index in indices) for subject, row in matrix.items()},
        points=tuple((subject, row.index, sed, score) for subject, row, sed, score in points),
        mean_relation=_related([(p[0], p[1].index, p[2], p[3]) for p in points]),
        repeated=repeated_correlation([p[0] for p in points], [p[2] for p in points], [p[3] for p in points]),
        repeated_holm=None,
        without_subject=_without_subject([(p[0], p[2], p[3]) for p in points]),
        normalised=_normalised(level, [(p[0], p[1].index, p[2]) for p in points]),
        differences=differences(matrix),
        estimates=estimates(trials),
        on_sed=_model([p[0] for p in points], [p[1] for p in points], [p[3] for p in points], SED),
        on_index=_model([p[0] for p in scored], [p[1] for p in scored], [p[2] for p in scored], INDEX),
        fingers=_fingers([(v.subject, row.index, row.mu) for v, row in trials if row.mu is not None]),
        paths=path_findings(
            [PathTrial(v.subject, row.index, row.score, row.rule, row.paths) for v, row in trials],
            score_of,
            options.prediction.kinematics,
            options.area,
            within=True,
        ),
    )


def _model(subjects: Sequence[str], rows: Sequence[TrialRow], scores: Sequence[float], what: str) -> MixedModel | str:
    """Return the mixed model of scores on SED or index, with drift and carry-over, or why there is none."""
    if len(set(subjects)) < 3:
        what = "scores and strokes of their own" if what == SED else "scores"
        return f"it takes three subjects with {what}, and there {_are(len(set(subjects)))}"
    x = [1e3 * (row.sed or 0.0) if what == SED else row.index - 50.0 for row in rows]
    order = {
        DRIFT: [float(row.place) for row in rows],
        CARRY_OVER: [0.0 if row.before is None else row.before - 50.0 for row in rows],
    }
    varied = {name: values for name, values in order.items() if np.ptp(values) > 0.0}
    return mixed_model(subjects, scores, {what: x, **varied}, slopes_differ=True)


def _are(n: int) -> str:
    return "is 1" if n == 1 else f"are {n or 'none'}"


def _fingers(trials: Sequence[tuple[str, int, float]]) -> Spread | None:
    """Return how far subjects' friction differs from one another, of trials' subject, index and mu."""
    indices = sorted({index for _, index, _ in trials})
    surfaces = [[float(index == one) for _, index, _ in trials] for one in indices[1:]]
    found = spreads([subject for subject, _, _ in trials], [math.log(mu) for _, _, mu in trials], surfaces)
    return None if found is None else found.level


def _surface(index: int, trials: Sequence[tuple[Visit, TrialRow]]) -> SurfaceMean:
    """Return means over subjects, each subject's own repeats averaged first."""

    def over_subjects(name: str) -> Average | None:
        return average(by_subject([(v.subject, getattr(row, name)) for v, row in trials]))

    names = ("mu", "sed", "normal_force", "model_normal_force", "matching_depth")
    mu, sed, normal, model, depth = map(over_subjects, names)
    return SurfaceMean(index, 0 if sed is None else sed.n, mu, sed, normal, model, depth)


def _related(points: Sequence[tuple[str, int, float, float]]) -> Relation | None:
    """Return how mean scores go with mean SEDs, of points that have both: subject, index, SED and score."""
    if not points:
        return None
    indices = sorted({index for _, index, _, _ in points})
    each = [[(subject, sed, score) for subject, i, sed, score in points if i == index] for index in indices]
    seds = [float(np.mean(by_subject([(subject, sed) for subject, sed, _ in own]))) for own in each]
    scores = [float(np.mean(by_subject([(subject, score) for subject, _, score in own]))) for own in each]
    return relation(seds, scores, indices)


def _without_subject(points: Sequence[tuple[str, float, float]]) -> tuple[tuple[str, float], ...]:
    """Return the correlation within subjects when each subject in turn is left out."""
    told: list[tuple[str, float]] = []
    for subject in dict.fromkeys(point[0] for point in points):
        others = [point for point in points if point[0] != subject]
        found = repeated_correlation(*zip(*others, strict=True)) if others else None
        if found is not None:
            told.append((subject, found.r))
    return tuple(told)


def _normalised(table: Mapping[str, Mapping[int, float]], points: Sequence[tuple[str, int, float]]) -> Normalised:
    """Return what scores say that were standardised; `points` are subject, index and SED [MPa] of its own stroke."""
    means = averages(table)
    both = [(subject, i, sed, table[subject][i]) for subject, i, sed in points if i in table.get(subject, {})]
    within = repeated_correlation([p[0] for p in both], [p[2] for p in both], [p[3] for p in both])
    return Normalised(means, _related(both), within)


def _recovered(found: Sequence[DescriptorFindings], planted: Mapping[str, Any]) -> tuple[Recovered, ...]:
    """Return the planted effects beside what the mixed model on the index, and the spread of friction, find."""
    score, people = planted["score"], planted.get("people", {})
    effects = {INDEX: score["gain"], DRIFT: score["drift"], CARRY_OVER: score["carry_over"]}
    told: list[Recovered] = []
    for one in found:
        model = one.on_index
        for term in () if isinstance(model, str) else model.terms:
            if term.name in effects:
                told.append(
                    Recovered(one.descriptor, term.name, effects[term.name], term.estimate, term.low, term.high)
                )
        differ = None if isinstance(model, str) else model.spreads
        if people and differ is not None:
            pairs = (
                (LEVELS, people["offset_spread"], differ.level),
                (SLOPES, people["gain_spread"], differ.slope),
                (NOISE, people["judgement_noise"], differ.left),
            )
            told += [_spread(one, name, sd, spread) for name, sd, spread in pairs if spread is not None]
        if people and one.fingers is not None:
            # A transducer's gains, of drag and of press, differ between visits as fingers do.
            sd = math.hypot(people["moisture"], math.sqrt(2.0) * planted.get("calibration_sd", 0.0))
            told.append(_spread(one, FINGERS, sd, one.fingers))
    return tuple(told)


def _spread(one: DescriptorFindings, name: str, planted: float, found: Spread) -> Recovered:
    return Recovered(one.descriptor, name, planted, found.sd, found.low, found.high)


_FLAWS = {"lost": "lost_readings", "frozen": "frozen_sensor", "light": "too_little_force"}


def _flaws(
    visits: Sequence[Visit], failed: Mapping[str, str], spoilt: Mapping[str, Mapping[str, Any]]
) -> tuple[PlantedFlaw, ...]:
    """Return for each session that was spoilt whether what it brings, or that it brings nothing, says so."""
    named = {visit.session: visit for visit in visits}
    backwards = {subject for subject, _, _ in reversed_subjects([_table(visit, visit.rows) for visit in visits])}
    found: list[PlantedFlaw] = []
    for session, told in spoilt.items():
        visit = named.get(session)
        if visit is None:
            found.append(PlantedFlaw(session, told["expected"], session in failed))
            continue
        rows = {row.trial: row for row in visit.rows}
        seen = [flaw in rows[told[name]].flaws for name, flaw in _FLAWS.items() if told.get(name)]
        seen += [rows[told["unanswered"]].score is None] if told.get("unanswered") else []
        seen += [rows[told["aborted"]].outcome == "open" and not visit.complete] if told.get("aborted") else []
        seen += [visit.subject in backwards] if told.get("reversed") else []
        found.append(PlantedFlaw(session, told["expected"], bool(seen) and all(seen)))
    return tuple(found)


def _friction(visits: Sequence[Visit], strokes: Sequence[Mapping[str, Any]]) -> PlantedFriction | None:
    truth = {(stroke["subject"], stroke["trial"]): float(stroke["mu"]) for stroke in strokes}
    found = [
        (row, truth[visit.subject, row.trial])
        for visit in visits
        for row in visit.rows
        if row.mu is not None and (visit.subject, row.trial) in truth
    ]
    if not found:
        return None
    errors = [abs((row.mu or 0.0) / mu - 1.0) for row, mu in found]
    held = [row.mu_low <= mu <= row.mu_high for row, mu in found if row.mu_low is not None and row.mu_high is not None]
    return PlantedFriction(len(found), float(np.median(errors)), max(errors), len(held), sum(held))
