"""Findings of a study as plain data, and recovery of the ground truth of a simulated study."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, cast

import msgspec
import numpy as np

from sessions.prediction import SED
from sessions.statistics.correlations import Relation
from sessions.statistics.mixed_model import MixedModel, Spread, Term
from sessions.statistics.multiverse import PathFinding
from sessions.statistics.psychometric import Psychometric
from sessions.statistics.rivals import Rival
from sessions.statistics.scales import Consistence, Exponent, Judgement, PairedScale
from sessions.statistics.scores import Average, IntervalEstimate, MeanScore, reversed_subjects
from sessions.statistics.visit import Exclusion, Visit, VisitOptions, exclusion_of, scores_of
from sessions.statistics.within_subjects import Agreement, Difference, RepeatedCorrelation, WithinMean

SED_TERM = "SED [kPa]"
INDEX = "index − 50"
FRICTION = "µ"
DRIFT = "trials before in the block"
CARRY_OVER = "index stroked before − 50"
LEVELS = "spread of subjects' levels"
SLOPES = "spread of subjects' slopes on the index"
NOISE = "noise of single scores"
FINGERS = "spread of log µ between fingers and transducers"
GROUND_TRUTH_FILE = "planted.json"
WITHIN = "r of score and SED within subjects"
UNITS = {
    INDEX: "points per index",
    FRICTION: "points per unit of µ",
    SED_TERM: "points per kPa",
    DRIFT: "points per trial",
    CARRY_OVER: "points per index",
    LEVELS: "points",
    SLOPES: "points per index",
    NOISE: "points",
    FINGERS: "1",
    WITHIN: "1",
}  # of effects on the score, and of the spreads


@dataclass(frozen=True, slots=True)
class Estimates:
    """Magnitude estimates, each subject on its own scale."""

    geometric: Mapping[int, Average]  # by index: of the logarithms
    equal_moduli: Mapping[int, Average]  # the same, scaled to one modulus
    repeated: RepeatedCorrelation | None  # of a subject's log estimates with the responses to its own strokes
    left_out: tuple[str, ...]  # subjects who gave an estimate that is not above 0


@dataclass(frozen=True, slots=True)
class ConstantStimuli:
    """Results of comparisons with a standard."""

    functions: Mapping[str, Psychometric]  # of each subject
    pse: Average | None  # of its logarithm, over subjects who have one
    jnd: Average | None  # of its logarithm, over subjects whose JND is above 0


@dataclass(frozen=True, slots=True)
class NormalisedScores:
    """Statistics of scores that are standardised within each subject, to mean 0 and standard deviation 1."""

    means: Mapping[int, Average]  # by index
    mean_relation: Relation | None
    repeated: RepeatedCorrelation | None


@dataclass(frozen=True, slots=True)
class SurfaceMean:
    """Means over subjects of one surface; None without a number of any subject."""

    index: int  # of the surface
    subjects: int  # whose stroke gave a response
    mu: Average | None  # coefficient of friction that the model used
    response: Average | None  # the model's quantity that is compared with scores [MPa or -]
    normal_force: Average | None  # measured [N]
    model_normal_force: Average | None  # of the model, pressed to its depth [N]
    matching_depth: Average | None  # at which the model would press as hard as the subject did [mm]


@dataclass(frozen=True, slots=True)
class DescriptorFindings:
    """Findings of a study about one descriptor."""

    descriptor: str
    indices: tuple[int, ...]  # of the stimuli
    scores: tuple[MeanScore, ...]
    within: tuple[WithinMean, ...]
    agreement: Agreement | None
    surfaces: tuple[SurfaceMean, ...]
    answers: Mapping[str, tuple[float | None, ...]]  # subject -> score of each index [points]
    points: tuple[tuple[str, int, float, float], ...]  # subject, index, response to its own stroke [MPa or -], score
    point_blocks: tuple[str, ...]  # name of the block of each of `points`
    mean_relation: Relation | None  # mean response against mean score
    repeated: RepeatedCorrelation | None  # of a subject's scores with the responses to its own strokes
    repeated_possible: RepeatedCorrelation | None  # the same without trials in a state that no finger can be in
    repeated_in_blocks: RepeatedCorrelation | None  # the same within each block; None where no subject has several
    repeated_holm: float | None  # p of `repeated`, adjusted for the number of descriptors
    rivals: tuple[Rival, ...]  # within subjects: the response and its rivals
    rivals_of_means: tuple[Rival, ...]  # the same for means over subjects
    without_subject: tuple[tuple[str, float], ...]  # subject left out, r within the other subjects
    normalised: NormalisedScores
    differences: tuple[Difference, ...]  # between the scores of two surfaces
    estimates: Estimates | None
    exponent: Exponent | None  # of magnitude estimates on the µ of the model; None without estimates
    scales: tuple[PairedScale, ...]  # of choices between two, by both models; () without choices
    consistence: Mapping[str, Consistence]  # of each subject who compared every pair
    # Score on the response in its shown unit [kPa or 1], drift and carry-over; or why there is no model
    on_response: MixedModel | str
    on_index: MixedModel | str  # score on the maker's index, drift and carry-over
    on_friction: MixedModel | str  # score on the index and on the µ of each subject's own stroke, drift and carry-over
    fingers: Spread | None  # spread of the logarithm of mu between subjects, without surface effects [-]
    paths: tuple[PathFinding, ...]  # () where not requested
    doubtful: int = 0  # trials with a score and a response, in a state that no finger can be in
    constant_stimuli: ConstantStimuli | None = None  # None without such comparisons
    # By kind of judgement and index, with mean 0, in standard deviations of the difference of two judgements
    latent: Mapping[Judgement, Mapping[int, IntervalEstimate]] = field(
        default_factory=dict[Judgement, Mapping[int, IntervalEstimate]]
    )

    @property
    def single_subject(self) -> str:
        """The code of the only subject with a score and a response of the same trial; "" with several, or with none."""
        subjects = {subject for subject, *_ in self.points}
        return subjects.pop() if len(subjects) == 1 else ""


class EffectRecovery(msgspec.Struct, frozen=True):
    """The true value of an effect and the study's estimate of it."""

    descriptor: str
    effect: str
    true_value: float = msgspec.field(name="planted")  # of the effect, in the unit that `UNITS` states
    estimate: float  # in the same unit
    low: float  # 95 % interval
    high: float  # its upper end

    @property
    def covered(self) -> bool:
        """Say whether the interval holds the true value."""
        return self.low <= self.true_value <= self.high


@dataclass(frozen=True, slots=True)
class FrictionRecovery:
    """Recovery of the mu of all strokes."""

    strokes: int  # with a true and an estimated mu
    median_error: float  # of mu, relative [-]
    worst_error: float  # of mu, relative [-]
    intervals: int  # number of intervals of mu
    covered: int  # number of these that contain the true mu


@dataclass(frozen=True, slots=True)
class FlawDetection:
    """The faults of one simulated session, and whether the study detects them."""

    session: str
    expected: str  # for people
    detected: bool


@dataclass(frozen=True, slots=True)
class StudyFindings:
    """The result of a study."""

    simulated: str
    options: VisitOptions
    visits: tuple[Visit, ...]  # all that were read, including excluded ones
    failed: tuple[tuple[str, str], ...]  # folder, why it could not be read
    copies: tuple[tuple[str, str], ...]  # session not counted, and the one of which it is a copy
    excluded: tuple[Exclusion, ...]
    reversed: tuple[tuple[str, str, float], ...]  # subject, descriptor, r of score with index: still counted
    descriptors: tuple[DescriptorFindings, ...]
    effects: tuple[EffectRecovery, ...]  # where the study is synthetic
    friction: FrictionRecovery | None
    flaws: tuple[FlawDetection, ...] = ()  # where the study is synthetic
    synthetic: int | None = None  # the seed of a synthetic study
    response: str = SED.name  # the model's quantity that is compared with scores
    blinded: tuple[str, ...] = ()  # sessions that are not counted until their key is opened

    @property
    def misfits(self) -> tuple[Exclusion, ...]:
        """Return the decisions that leave out no trial of a session that was read."""
        present = {(visit.subject, row.descriptor) for visit in self.visits for row in visit.rows}
        return tuple(
            exclusion
            for exclusion in self.excluded
            if not any(exclusion_of((exclusion,), *trial) is not None for trial in present)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the findings as plain data."""
        document: dict[str, Any] = {**({"simulated": self.simulated} if self.simulated else {}), **asdict(self)}
        # The names `found` and `both`, used until 2026-11-26, stay for one release
        document["effects"] = [msgspec.to_builtins(effect) | {"found": effect.estimate} for effect in self.effects]
        for flaw in document["flaws"]:
            flaw["found"] = flaw["detected"]
        for exponent in filter(None, (findings["exponent"] for findings in document["descriptors"])):
            exponent["both"] = exponent["deming"]
        return document


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
class VisitFaults:
    """Faults of one subject's visit, by number of the trial; 0: in none."""

    lost: int = 0
    frozen: int = 0
    light: int = 0
    unanswered: int = 0
    aborted: int = 0
    reversed: bool = False
    expected: str  # what the analysis should report


class _GroundTruth(msgspec.Struct):
    score: _Score
    people: _People
    strokes: list[_Stroke]
    calibration_sd: float = 0.0
    relation: dict[str, _Relation] = {}
    faults: dict[str, VisitFaults] = msgspec.field(default={}, name="spoilt")
    seed: int | None = None


def check_ground_truth(document: object) -> dict[str, Any]:
    """Return a study's ground truth as in its file. Raises ValueError where it has another form."""
    msgspec.convert(document, _GroundTruth)
    return cast("dict[str, Any]", document)


def effect_recoveries(
    descriptors: Sequence[DescriptorFindings], ground_truth: Mapping[str, Any]
) -> tuple[EffectRecovery, ...]:
    """Return the true effects on the score, and spreads, with their estimates.

    `ground_truth["score"]` holds the slopes of scores on index, place and preceding index, and on µ by descriptor.
    """
    return tuple(
        EffectRecovery(findings.descriptor, name, truth[name], *interval)
        for findings in descriptors
        for truth in [_true_values(findings.descriptor, ground_truth)]
        for name, interval in _estimates(findings).items()
        if name in truth
    )


def _true_values(descriptor: str, ground_truth: Mapping[str, Any]) -> dict[str, float]:
    """Return the true values of one descriptor, by the names in `UNITS`."""
    score, people = ground_truth["score"], ground_truth.get("people")
    values = {name: score[key] for name, key in ((INDEX, "gain"), (DRIFT, "drift"), (CARRY_OVER, "carry_over"))}
    values[FRICTION] = score.get("friction", {}).get(descriptor, 0.0)
    if relation := ground_truth.get("relation", {}).get(descriptor):
        values |= {WITHIN: relation["r"], SED_TERM: relation["slope"]}
    if people:
        values[LEVELS], values[NOISE] = people["offset_spread"], people["judgement_noise"]
        values[SLOPES] = (1.0 - people.get("friction_weight", 0.0)) * people["gain_spread"]
        # Gains of transducers differ between visits like fingers, for drag and for press.
        values[FINGERS] = math.hypot(people["moisture"], math.sqrt(2.0) * ground_truth.get("calibration_sd", 0.0))
    return values


def _estimates(findings: DescriptorFindings) -> dict[str, tuple[float, float, float]]:
    """Return the estimate and interval ends of each effect that has a true value, by its name in `UNITS`.

    Relations of scores to SEDs have the intervals for other people on the same surfaces.
    """
    terms: list[Term] = []
    spreads: dict[str, Spread | None] = {}
    if not isinstance(findings.on_friction, str):
        terms += findings.on_friction.terms
        if (components := findings.on_friction.spreads) is not None:
            spreads = {LEVELS: components.level, SLOPES: components.slope, NOISE: components.left}
    if findings.repeated is not None and findings.repeated.people is not None:
        terms.append(Term(WITHIN, findings.repeated.r, *findings.repeated.people, math.nan))
        terms += () if isinstance(findings.on_response, str) else findings.on_response.terms[1:2]
    spreads[FINGERS] = findings.fingers
    values = {name: (spread.sd, spread.low, spread.high) for name, spread in spreads.items() if spread is not None}
    return {term.name: (term.estimate, term.low, term.high) for term in terms} | values


_FLAWS = {"lost": "lost_readings", "frozen": "frozen_sensor", "light": "too_little_force"}


def flaw_detections(
    visits: Sequence[Visit], failed: Mapping[str, str], faults_by_session: Mapping[str, Mapping[str, Any]]
) -> tuple[FlawDetection, ...]:
    """Return, for each session with faults, whether its results or its failure to be read show them."""
    by_session = {visit.session: visit for visit in visits}
    backwards = {subject for subject, _, _ in reversed_subjects([scores_of(visit, visit.rows) for visit in visits])}

    def is_detected(session: str, faults: Mapping[str, Any]) -> bool:
        visit = by_session.get(session)
        if visit is None:
            return session in failed
        rows = {row.trial: row for row in visit.rows}
        if any(faults.get(name) and faults[name] not in rows for name in (*_FLAWS, "unanswered", "aborted")):
            return False  # a trial that the session does not have
        checks = [flaw in rows[faults[name]].flaws for name, flaw in _FLAWS.items() if faults.get(name)]
        checks += [rows[faults["unanswered"]].score is None] if faults.get("unanswered") else []
        checks += [rows[faults["aborted"]].outcome == "open" and not visit.complete] if faults.get("aborted") else []
        checks += [visit.subject in backwards] if faults.get("reversed") else []
        return bool(checks) and all(checks)

    return tuple(
        FlawDetection(session, faults["expected"], is_detected(session, faults))
        for session, faults in faults_by_session.items()
    )


def friction_recovery(visits: Sequence[Visit], strokes: Sequence[Mapping[str, Any]]) -> FrictionRecovery | None:
    """Return how well the µ of the strokes was estimated; None where no stroke has a true and an estimated µ."""
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
    return FrictionRecovery(len(rows), float(np.median(errors)), max(errors), len(holds), sum(holds))
