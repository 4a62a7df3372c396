"""Scores of several subjects: means with their intervals, and means per surface."""

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
from scipy.special import chdtri

from drivers.arrays import Array, Indices
from sessions.recording import Recording, TrialRecord
from sessions.statistics.correlations import TAILS, pearson, t_quantile

SCORE_SCALE = (0.0, 100.0)  # ends of the scale, which limit answers
_ALIKE = 1e-12  # relative to the greatest value: a smaller spread is round-off
Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


def by_key(pairs: Iterable[tuple[Key, Value]]) -> dict[Key, list[Value]]:
    """Return the values of each key, keys in order of first occurrence.

    >>> by_key([("a", 1), ("b", 2), ("a", 3)])
    {'a': [1, 3], 'b': [2]}
    """
    values: dict[Key, list[Value]] = {}
    for key, value in pairs:
        values.setdefault(key, []).append(value)
    return values


def bounds(low: float | None, high: float | None) -> tuple[float, float] | None:
    """Return the ends of an interval as a pair; None where one of them is missing."""
    return None if low is None or high is None else (low, high)


@dataclass(frozen=True, slots=True)
class IntervalEstimate:
    """A value with its 95 % interval; an end is None where the data give no bound, or with too few subjects."""

    value: float  # the estimate
    low: float | None  # 95 % interval
    high: float | None  # its upper end

    @property
    def ends(self) -> tuple[float, float] | None:
        """The ends of the interval; None where one of them is missing."""
        return bounds(self.low, self.high)


@dataclass(frozen=True, slots=True)
class Average:
    """A mean over subjects."""

    n: int  # subjects, each one's repeats averaged first
    mean: float  # of the subjects
    sd: float | None  # between subjects; None for a single subject
    low: float | None  # 95 % t interval; None for a single subject, or identical values
    high: float | None  # its upper end


@dataclass(frozen=True, slots=True)
class Score:
    """One answer."""

    subject: str  # a code, never a name
    descriptor: str  # e.g. "stickiness"
    index: int  # the stimulus's number on the descriptor
    score: float  # 0 to 100
    block: str = ""  # name of the block in which it was given


@dataclass(frozen=True, slots=True)
class ScoreTable:
    """The answers of one session."""

    session: str  # identifies this session, e.g. its folder's name
    subject: str
    simulated: bool
    scores: tuple[Score, ...]  # answered trials only
    other_answers: str = ""  # a sentence on answers other than on the line, which cannot be compared with scores


@dataclass(frozen=True, slots=True)
class MeanScore:
    """Mean answer of n subjects to one stimulus. A bound is None where `reason` says why."""

    descriptor: str
    index: int  # of the stimulus
    n: int  # subjects, not trials
    mean: float  # of the scores [points]
    sd: float | None  # standard deviation between subjects [points]
    low: float | None  # 95 % t interval of the mean, clipped to the scale, which holds the population's mean [points]
    high: float | None  # its upper end [points]
    reason: str | None


def score_table(recording: Recording) -> ScoreTable:
    """Return a session's scores on the line, of main trials alone. Raises Blinded while the stimuli's key is sealed."""
    subject = recording.plan.subject
    scores = tuple(
        Score(subject, stimulus.descriptor, stimulus.known_index, record.score, record.trial.block)
        for record in recording.trials
        for stimulus in [record.trial.stimulus]
        if record.score is not None and record.trial.phase == "main"
    )
    return ScoreTable(str(recording.folder.resolve()), subject, recording.simulated, scores, _other_answers(recording))


def _other_answers(recording: Recording) -> str:
    """Return a sentence on the answers of a session other than scores on the line; empty without such answers."""
    numbers = sum(record.number is not None for record in recording.trials)
    choices = sum(record.choice is not None for record in recording.trials)
    if not numbers and not choices:
        return ""
    plural = "" if numbers + choices == 1 else "s"
    answers = f"{numbers} number{plural} on a scale of the subject's own"
    if not numbers:
        answers = f"{choices} choice{plural} of one of two"
    return (
        f"The answers of {recording.plan.subject} in {recording.folder.name} are {answers}: they are kept, and no mean "
        "or correlation of scores between 0 and 100 includes them."
    )


def distinct_sessions(tables: Iterable[ScoreTable]) -> tuple[ScoreTable, ...]:
    """Return each session once, in order of first occurrence."""
    return tuple(copies[0] for copies in by_key((table.session, table) for table in tables).values())


def block_scores(tables: Iterable[ScoreTable], block: str, descriptor: str) -> tuple[ScoreTable, ...]:
    """Return tables with the scores of one block alone; of a session without it, all its scores on the descriptor."""

    def of_block(scores: Sequence[Score]) -> tuple[Score, ...]:
        on_descriptor = [score for score in scores if score.descriptor == descriptor]
        return tuple(score for score in on_descriptor if score.block == block) or tuple(on_descriptor)

    return tuple(replace(table, scores=of_block(table.scores)) for table in tables)


def subject_scores(tables: Iterable[ScoreTable]) -> tuple[Score, ...]:
    """Return one score for each subject and stimulus: the mean of the subject's repeats over all its sessions.

    Trials are not subjects; pooling them would make intervals too narrow.
    """
    answers = by_key(
        ((table.subject, score.descriptor, score.index), score.score) for table in tables for score in table.scores
    )
    return tuple(Score(*key, score=float(np.mean(values))) for key, values in answers.items())


def mean_scores(tables: Iterable[ScoreTable]) -> tuple[MeanScore, ...]:
    """Return the mean over subjects of every stimulus, by descriptor (in order of first occurrence) and index.

    Intervals are mean ± t(0.975, n - 1) s / sqrt(n), n the number of subjects, clipped to the scale.
    """
    by_descriptor = by_key((score.descriptor, (score.index, score.score)) for score in subject_scores(tables))
    return tuple(
        _mean(descriptor, index, values)
        for descriptor, scores in by_descriptor.items()
        for index, values in sorted(by_key(scores).items())
    )


def reversed_subjects(tables: Iterable[ScoreTable]) -> tuple[tuple[str, str, float], ...]:
    """Return (subject, descriptor, r) where scores fall as the index rises; these scores are not reversed."""
    points = by_key(((score.subject, score.descriptor), (score.index, score.score)) for score in subject_scores(tables))
    correlations = ((key, pearson(*zip(*pairs, strict=True))) for key, pairs in points.items())
    return tuple((*key, r) for key, r in correlations if r is not None and r < 0)


def score_matrix(tables: Iterable[ScoreTable], descriptor: str) -> Mapping[str, Mapping[int, float]]:
    """Return subject -> index -> score of one descriptor, subjects sorted."""
    scores = [score for score in subject_scores(tables) if score.descriptor == descriptor]
    rows = by_key((score.subject, (score.index, score.score)) for score in scores)
    return {subject: dict(row) for subject, row in sorted(rows.items())}


def average(values: Sequence[float]) -> Average | None:
    """Return the mean of subjects' values with its 95 % t interval; None without values."""
    if not values:
        return None
    n, mean = len(values), float(np.mean(values))
    if n < 2:
        return Average(n, mean, None, None, None)
    sd = float(np.std(values, ddof=1))
    if sd <= _ALIKE * float(np.max(np.abs(values))):
        return Average(n, mean, 0.0, None, None)
    half = t_quantile(n - 1) * sd / math.sqrt(n)
    return Average(n, mean, sd, mean - half, mean + half)


def sd_interval(sd: float, n: int) -> tuple[float, float]:
    """Return the 95 % interval of the standard deviation of n normal values, by chi squared.

    >>> tuple(round(end, 3) for end in sd_interval(1.0, 10))
    (0.688, 1.826)
    """
    low, high = (sd * math.sqrt((n - 1) / float(chdtri(n - 1, upper))) for upper in TAILS)
    return low, high


def _mean(descriptor: str, index: int, values: Sequence[float]) -> MeanScore:
    mean = average(values)
    assert mean is not None
    low, high = (None if bound is None else float(np.clip(bound, *SCORE_SCALE)) for bound in (mean.low, mean.high))
    return MeanScore(descriptor, index, mean.n, mean.mean, mean.sd, low, high, no_interval(mean))


def no_interval(mean: Average) -> str | None:
    """Return why a mean has no interval; None if it has one."""
    if mean.low is not None:
        return None
    return "one subject alone has no interval" if mean.n == 1 else "no interval: all subjects have the same value"


def indicator_columns(groups: Sequence[str] | Sequence[int] | Array | Indices) -> Array:
    """Return a column for each group, in order, that marks its members (n, k)."""
    codes = np.unique(np.asarray(groups), return_inverse=True)[1]
    return np.eye(int(codes.max()) + 1)[codes]


def surface_means(points: Sequence[tuple[str, int, float]]) -> dict[int, float] | None:
    """Return the mean of each surface from `points` of subject, index and number; repeats are averaged first.

    Subjects differ in level, and where some missed a surface the plain mean of the others would depend on who they are.
    Levels of subjects and effects of surfaces are therefore fitted together by least squares (means adjusted for
    unbalanced blocks: Yates 1934, J. Am. Stat. Assoc. 29:51), and a surface's mean is over all subjects. With complete
    data it is the plain mean. None without points, and where surfaces have no common subjects that connect them.

    >>> means = surface_means([("a", 0, 1.0), ("a", 50, 2.0), ("b", 0, 11.0)])
    >>> {index: round(mean, 9) for index, mean in means.items()}
    {0: 6.0, 50: 7.0}
    """
    repeats = by_key(((subject, index), value) for subject, index, value in points)
    if not repeats:
        return None
    subjects, indices = sorted({subject for subject, _ in repeats}), sorted({index for _, index in repeats})
    values = np.array([float(np.mean(numbers)) for numbers in repeats.values()])
    if len(repeats) == len(subjects) * len(indices):
        return {index: float(values[[surface == index for _, surface in repeats]].mean()) for index in indices}
    design = np.hstack([indicator_columns(labels) for labels in zip(*repeats, strict=True)])
    if np.linalg.matrix_rank(design) < len(subjects) + len(indices) - 1:
        return None
    coefficients = np.linalg.lstsq(design, values, rcond=None)[0]
    level = float(coefficients[: len(subjects)].mean())
    return {index: level + float(effect) for index, effect in zip(indices, coefficients[len(subjects) :], strict=True)}


def grades_of(records: Iterable[TrialRecord]) -> dict[str, str]:
    """Return a sentence for each pre-evaluated descriptor.

    The grading holds where answers rise with the maker's number throughout. Raises Blinded while the number is sealed.
    """
    judgements = by_key(
        (record.trial.stimulus.descriptor, (record.trial.stimulus.known_index, answer))
        for record in records
        if record.trial.phase == "pre-evaluation"
        for answer in [record.number if record.score is None else record.score]
        if answer is not None
    )
    return {descriptor: _sentence(dict(answers)) for descriptor, answers in judgements.items()}


def _sentence(answers: dict[int, float]) -> str:
    """Say whether answers rise with the index.

    >>> _sentence({0: 3.0, 55: 62.0, 75: 58.0})
    'the grading does not hold: 75 was judged no higher than 55 (0: 3, 55: 62, 75: 58)'
    """
    answer_list = ", ".join(f"{index}: {answer:g}" for index, answer in sorted(answers.items()))
    if len(answers) < 2:
        return f"too few answers to see a grading ({answer_list})"
    pairs = pairwise(sorted(answers))
    faults = [f"{high} was judged no higher than {low}" for low, high in pairs if answers[high] <= answers[low]]
    return f"{'the grading does not hold: ' + ', '.join(faults) if faults else 'the grading holds'} ({answer_list})"
