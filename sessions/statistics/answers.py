"""Means over subjects, and what trials answer otherwise than on a line: choices of two, and magnitude estimates."""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sessions.statistics.psychometric import Comparison, Psychometric, comparison, function_of
from sessions.statistics.scales import (
    Choice,
    Exponent,
    Judgement,
    PairedScale,
    of_comparisons,
    of_judgements,
    stevens_exponent,
)
from sessions.statistics.scores import IntervalEstimate, mean_interval
from sessions.statistics.visit import TrialRow, Visit
from sessions.statistics.within_subjects import RepeatedCorrelation, equal_moduli, repeated_correlation


@dataclass(frozen=True, slots=True)
class Average:
    """A mean over subjects."""

    n: int  # subjects, each one's own repeats averaged first
    mean: float
    sd: float | None  # between subjects; None of one alone, and so with the next two
    low: float | None  # 95 % t interval
    high: float | None


@dataclass(frozen=True, slots=True)
class Estimates:
    """Magnitude estimates, each subject with a scale of its own."""

    geometric: Mapping[int, Average]  # by index: of the logarithms, as they were given
    equal_moduli: Mapping[int, Average]  # likewise, brought to one modulus
    repeated: RepeatedCorrelation | None  # of a subject's log estimates with the responses to its own strokes
    left_out: tuple[str, ...]  # subjects who gave an estimate that is not above 0


def average(values: Sequence[float]) -> Average | None:
    """Return the mean of subjects' values with its 95 % t interval; None of none."""
    if not values:
        return None
    n, mean = len(values), float(np.mean(values))
    if n < 2:
        return Average(n, mean, None, None, None)
    return Average(n, mean, *mean_interval(values))


def averages(table: Mapping[str, Mapping[int, float]]) -> dict[int, Average]:
    """Return the mean over subjects of each index, from subject -> index -> number."""
    indices = sorted({index for row in table.values() for index in row})
    means = ((index, average([row[index] for row in table.values() if index in row])) for index in indices)
    return {index: mean for index, mean in means if mean is not None}


def estimates(trials: Sequence[tuple[Visit, TrialRow]], quantity: str) -> Estimates | None:
    """Return what magnitude estimates say, beside that quantity of the model; None where nobody gave any."""
    rows = [
        (v.subject, row.index, row.estimate, row.response(quantity)) for v, row in trials if row.estimate is not None
    ]
    if not rows:
        return None
    no_logarithm = {subject for subject, _, value, _ in rows if value <= 0.0}
    logs: defaultdict[str, defaultdict[int, list[float]]] = defaultdict(lambda: defaultdict(list))
    pairs: list[tuple[str, float, float]] = []
    for subject, index, value, response in rows:
        if subject not in no_logarithm:
            logs[subject][index].append(math.log(value))
            pairs += [] if response is None else [(subject, response, math.log(value))]
    table = {
        subject: {index: math.exp(float(np.mean(values))) for index, values in row.items()}
        for subject, row in sorted(logs.items())
    }
    return Estimates(
        averages(_logs(table)),
        averages(_logs(equal_moduli(table))),
        repeated_correlation(*zip(*pairs, strict=True)) if pairs else None,
        tuple(sorted(no_logarithm)),
    )


def _logs(table: Mapping[str, Mapping[int, float]]) -> dict[str, dict[int, float]]:
    return {subject: {index: math.log(value) for index, value in row.items()} for subject, row in table.items()}


def by_subject(values: Sequence[tuple[str, float | None]]) -> list[float]:
    """Return the mean of each subject's own numbers, in the order first met."""
    own: defaultdict[str, list[float]] = defaultdict(list)
    for subject, value in values:
        if value is not None:
            own[subject].append(value)
    return [float(np.mean(all_of)) for all_of in own.values()]


def choices(trials: Sequence[tuple[Visit, TrialRow]]) -> list[Choice]:
    """Return every choice between the surface of a trial and the one stroked just before it, without a standard.

    Pairs with a standard have a psychometric function; by them alone most scales would have no bound.
    """
    return [
        Choice(visit.subject, row.before, row.index, row.choice == "first")
        for visit, row in trials
        if row.choice is not None and row.before is not None and row.standard is None
    ]


@dataclass(frozen=True, slots=True)
class ConstantStimuli:
    """What comparisons with a standard say."""

    functions: Mapping[str, Psychometric]  # of each subject
    pse: Average | None  # of its logarithm, over subjects who have one
    jnd: Average | None  # of its logarithm, over subjects whose JND is above 0


def constant_stimuli(trials: Sequence[tuple[Visit, TrialRow]]) -> ConstantStimuli | None:
    """Return the psychometric function of each subject who compared with a standard; None where nobody did."""
    answers: defaultdict[str, list[Comparison]] = defaultdict(list)
    friction: defaultdict[tuple[str, int], list[float]] = defaultdict(list)
    for visit, row in trials:
        if row.standard is not None and row.mu is not None and row.mu > 0.0:
            friction[visit.session, row.index].append(row.mu)
        if row.standard is not None and row.choice is not None and row.before is not None:
            pair = row.before, row.index
            answers[visit.subject].append(comparison(visit.session, row.standard, pair, row.choice))
    if not answers:
        return None
    functions = {subject: function_of(choices, friction) for subject, choices in sorted(answers.items())}
    pse = [one.pse.value for one in functions.values() if one.pse is not None]
    jnd = [math.log(one.jnd.value) for one in functions.values() if one.jnd is not None and one.jnd.value]
    return ConstantStimuli(functions, average(pse), average(jnd))


def latent_scales(
    trials: Sequence[tuple[Visit, TrialRow]], scales: Sequence[PairedScale], compared: ConstantStimuli | None
) -> Mapping[Judgement, Mapping[int, IntervalEstimate]]:
    """Return the latent values of each surface by every kind of judgement that has some."""
    scores = [(v.subject, row.index, row.score) for v, row in trials if row.score is not None]
    logs = [(v.subject, row.index, math.log(row.estimate)) for v, row in trials if row.estimate and row.estimate > 0.0]
    mu: defaultdict[int, list[float]] = defaultdict(list)
    for _, row in trials:
        if row.standard is not None and row.mu:
            mu[row.index].append(math.log(row.mu))
    jnd = None if compared is None else compared.jnd
    by_judgement: dict[Judgement, Mapping[int, IntervalEstimate]] = {
        "scores": of_judgements(scores),
        "estimates": of_judgements(logs),
    }
    for scale in scales:
        if scale.model == "Thurstone V":
            by_judgement["choices"] = scale.values
    if jnd is not None and jnd.low is not None and jnd.high is not None:
        middle = {index: math.exp(float(np.mean(logs))) for index, logs in sorted(mu.items())}
        by_judgement["comparisons"] = of_comparisons(middle, (jnd.mean, jnd.low, jnd.high))
    return {judgement: values for judgement, values in by_judgement.items() if values}


def exponent(trials: Sequence[tuple[Visit, TrialRow]]) -> Exponent | None:
    """Return Stevens' exponent of magnitude estimates by the µ of the same strokes; None where nobody gave any."""
    if all(row.estimate is None for _, row in trials):
        return None
    complete = [
        (visit.subject, row.index, row.estimate, row.mu)
        for visit, row in trials
        if row.estimate is not None and row.estimate > 0.0 and row.mu is not None and row.mu > 0.0
    ]
    if not complete:
        return Exponent(0, 0, None, reason="no trial has both an estimate above 0 and a µ of its own stroke")
    subjects, surfaces, answers, mu = zip(*complete, strict=True)
    return stevens_exponent(subjects, surfaces, answers, mu)
