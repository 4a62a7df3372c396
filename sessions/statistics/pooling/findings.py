"""What a study finds, as plain data, and the names of the effects it tells."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from sessions.prediction import SED
from sessions.statistics.mixed_model import MixedModel
from sessions.statistics.multiverse import PathFinding
from sessions.statistics.pooling.answers import Average, ConstantStimuli, Estimates
from sessions.statistics.pooling.visit import Exclusion, Visit, VisitOptions
from sessions.statistics.rivals import Rival
from sessions.statistics.scales.latent import Judgement
from sessions.statistics.scales.paired import Consistence, PairedScale
from sessions.statistics.scales.stevens import Exponent
from sessions.statistics.scores import IntervalEstimate, MeanScore, Relation
from sessions.statistics.variance_components import Spread
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
class Normalised:
    """Statistics of scores when each subject's use of the scale is taken away: own mean 0, own spread 1."""

    means: Mapping[int, Average]  # by index
    mean_relation: Relation | None
    repeated: RepeatedCorrelation | None


@dataclass(frozen=True, slots=True)
class SurfaceMean:
    """Means over subjects of one surface; None where there is no subject's number."""

    index: int
    subjects: int  # whose stroke gave a response
    mu: Average | None
    response: Average | None  # the quantity of the model that is held against scores [MPa or -]
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
    points: tuple[tuple[str, int, float, float], ...]  # subject, index, response, score: all of its own strokes
    mean_relation: Relation | None  # mean response against mean score
    repeated: RepeatedCorrelation | None  # of a subject's scores with the responses to its own strokes
    repeated_holm: float | None  # its p, allowing for as many descriptors as have one
    rivals: tuple[Rival, ...]  # within subjects: the response, and what else follows a subject's scores
    rivals_of_means: tuple[Rival, ...]  # likewise of the means over subjects
    without_subject: tuple[tuple[str, float], ...]  # subject left out, r within the others
    normalised: Normalised
    differences: tuple[Difference, ...]
    estimates: Estimates | None
    exponent: Exponent | None  # of magnitude estimates by the µ that the model got; None where nobody gave any
    scales: tuple[PairedScale, ...]  # of choices between two, by both models; () where nobody chose
    consistence: Mapping[str, Consistence]  # of each subject who chose in every pair
    on_response: (
        MixedModel | str
    )  # score on the response as people read it [kPa or 1], drift and carry-over; or why there is no model
    on_index: MixedModel | str  # score on the maker's index, drift and carry-over
    on_friction: MixedModel | str  # score on the index and on the µ of each subject's own stroke, drift and carry-over
    fingers: Spread | None  # how fingers differ: of the logarithm of mu between subjects, surfaces taken away [-]
    paths: tuple[PathFinding, ...]  # () where they were not asked for
    constant_stimuli: ConstantStimuli | None = None  # None where nobody compared with a standard
    latent: Mapping[Judgement, Mapping[int, IntervalEstimate]] = field(
        default_factory=dict[Judgement, Mapping[int, IntervalEstimate]]
    )


@dataclass(frozen=True, slots=True)
class Recovered:
    """One planted effect beside what the study found."""

    descriptor: str
    effect: str
    planted: float
    estimate: float
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
    detected: bool


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
    synthetic: int | None = None  # the seed, where it is
    response: str = SED.name  # the quantity of the model that is held against scores

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        document: dict[str, Any] = {**({"simulated": self.simulated} if self.simulated else {}), **asdict(self)}
        # Names until 2026-11-26, which stay for one release
        for effect in document["effects"]:
            effect["found"] = effect["estimate"]
        for flaw in document["flaws"]:
            flaw["found"] = flaw["detected"]
        for exponent in filter(None, (one["exponent"] for one in document["descriptors"])):
            exponent["both"] = exponent["deming"]
        return document
