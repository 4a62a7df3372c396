"""Content of a report, ready for any export. Missing numbers have a reason."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.arrays import Array
from sessions.plan.plan import Choice
from sessions.prediction import Fields, History, Response, Skin
from sessions.prediction.stored import Ends, TrialNumbers
from sessions.recording.log import Outcome
from sessions.statistics.correlations import Relation
from sessions.statistics.multiverse import PathFinding
from sessions.statistics.psychometric import Psychometric
from sessions.statistics.rivals import Rival
from sessions.statistics.scores import MeanScore
from sessions.strokes import Stroke
from sessions.strokes.stroke import FIXED


@dataclass(frozen=True, slots=True)
class Fact:
    """One fact needed to judge or repeat the session."""

    name: str
    value: str
    remark: str = ""  # e.g. that nobody set it


@dataclass(frozen=True, slots=True)
class TextFile:
    """A file needed in addition to the session, whole in the report."""

    name: str
    text: str
    sha256: str  # of the text in UTF-8


@dataclass(frozen=True, slots=True)
class Experiment:
    """One block: stimuli of one descriptor, stroked one way."""

    name: str
    descriptor: str
    scale_ends: tuple[str, str]
    indices: tuple[int, ...]  # of its stimuli, rising
    scores: tuple[MeanScore, ...]
    answers: Mapping[str, tuple[float | None, ...]]  # of each subject, one for each index; None without an answer
    score_relation: Relation | None  # `response` [MPa or -] against mean score; None where one of the two is missing
    index_relation: Relation | None  # `response` against index
    own_relation: Relation | None = None  # `response` against the stroking subject's own scores, where several scored
    rivals: tuple[Rival, ...] = ()  # `response` first, then its rivals for the mean scores
    paths: tuple[PathFinding, ...] = ()  # correlations along many paths of the analysis, where requested
    psychometric: Psychometric | None = None  # of comparisons with a standard, where the block has one
    own_scores: Mapping[int, float] = field(default_factory=dict[int, float])  # of that subject, by index
    response: str = "sed"  # the quantity at the ending of these relations, one of `solver.quantities`
    # Numbers and choices: trial, judged index, answer; empty where `psychometric` uses them
    other_answers: tuple[tuple[int, str, str], ...] = ()
    falling: tuple[str, ...] = ()  # subjects whose scores of the descriptor fall as the index rises

    @property
    def score_name(self) -> str:
        """What a score over subjects is called: that of P01 where P01 alone scored."""
        return f"score of {next(iter(self.answers))}" if len(self.answers) == 1 else "mean score"


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """The course of one stroke at m instants. Ratio and speed are nan where undefined."""

    origin: float  # contact onset, or the recording's beginning where it begins in contact [s, device time]
    time: Array  # (m,) since `origin` [s]
    normal: Array  # (m,) [N]
    tangential: Array  # (m,) [N]
    mu: Array  # (m,) T/N [-]
    speed: Array  # (m,) of the centre of pressure, along the stroke [mm/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class StrokeFinding(Stroke):
    """A stroke in a report: `number` counts all strokes from 1, in order of time, and `reasons` are sentences."""

    within: int = 1  # its number within its trial, from 1; without trials within the recording
    experiment: str  # "" where the session has no plan
    index: int | None
    code: str
    trace: Trace | None
    bootstrap: dict[str, Ends]  # intervals by the number's name; see `Report.interval_kind`
    direction_agrees: float | None = None  # share of the bootstrap's repeats with that direction [-]


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictionFinding(TrialNumbers):
    """The prediction of a trial in a report: `stroke` is a number from 1."""

    experiment: str
    index: int | None
    code: str
    responses: Mapping[str, Response]  # every quantity at the ending by its name; empty without a prediction
    history: History | None
    peak_rate: float | None = None  # of an SA-II afferent, an illustration [imp/s]
    settled_rate: float | None = None  # at long times [imp/s]
    peak_rate_interval: Ends | None = None  # from the interval of the SED, with parameters as given
    settled_rate_interval: Ends | None = None  # of the settled rate, from the same interval
    row: Mapping[float, float] = field(default_factory=dict[float, float])  # SED [MPa] by place along the skin [mm]
    doubt: str = ""  # why no finger can be in the predicted state, as in `Alternative.doubt`
    opposite_doubt: str = ""  # the same for the opposite slide


@dataclass(frozen=True, slots=True)
class AnswerFinding:
    """The subject's answer in a trial."""

    trial: int
    experiment: str
    index: int | None  # None while the session is blinded
    code: str
    outcome: Outcome
    answer: float | Choice  # a score, a number on the subject's own scale, or which of two


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """The finger of one trial in its settled state."""

    experiment: str
    index: int
    finger: Fields
    skin: Skin


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """Friction and motion that a simulator set in one trial: for comparison only; no result uses them."""

    trial: int
    mu: float  # [-]
    tau_max: float  # [MPa]
    speed: float  # [mm/s]
    direction: int


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Forces over the whole recording, thinned to the least and the greatest of each stretch of time."""

    time: Array  # [s, device time]
    normal: Array  # [N]; nan where readings are missing
    tangential: Array  # [N]


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """The complete content; exports only lay it out."""

    title: str = ""
    session: str
    head: str = ""  # first line of every document on a simulated session; "" for a real one
    seal_differences: tuple[str, ...] = ()  # a sentence for each recording that differs from its seal
    sealed: str = ""  # whether predictions were sealed before scores
    people: tuple[Fact, ...] = ()
    apparatus: tuple[Fact, ...] = ()
    excluded: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()  # missing data, decisions on what counts, and doubts
    flaws: tuple[Fact, ...] = ()  # name, sentence, where
    experiments: tuple[Experiment, ...] = ()
    course: Course | None = None
    strokes: tuple[StrokeFinding, ...]
    predictions: tuple[PredictionFinding, ...]
    answers: tuple[AnswerFinding, ...] = ()  # of the subject, in the order of its trials
    fields: tuple[Field, ...] = ()
    ground_truth: tuple[GroundTruth, ...] = ()
    modelled: tuple[Fact, ...] = ()
    left_out: tuple[Fact, ...] = ()
    reproduction: tuple[Fact, ...] = ()  # everything needed to repeat the analysis ...
    commands: tuple[str, ...] = ()  # ... and what to type
    width: float | None  # of the finger [mm], by which forces per mm are multiplied
    width_origin: str = ""  # "set" or "assumed"
    other_signs: tuple[str, ...] = ()  # series with opposite slopes of the SED on this finger and the published one
    response: str = "sed"  # the quantity at the ending that is compared with scores, one of `solver.quantities`
    model: str = ""  # short description of the model
    area: str = FIXED.sentence  # law of the contact area for τ max
    interval_kind: str = ""  # description of the intervals in `StrokeFinding.bootstrap`
    interval_kinds: dict[str, str] = field(default_factory=dict[str, str])  # further descriptions, by a number's name
    scene: TextFile | None = None  # named in the commands, where another finger than the session's was used
    afferent: tuple[Fact, ...] = ()  # every parameter of the afferent, where its rates are shown
    afferent_quantity: str = "sed"  # its driving quantity, one of `solver.quantities`

    @property
    def simulated(self) -> bool:
        """Whether anything of the session was simulated."""
        return bool(self.head)

    @property
    def scored(self) -> bool:
        """Whether somebody gave a score between 0 and 100."""
        return any(experiment.scores for experiment in self.experiments)
