"""Means over subjects with their t intervals, and magnitude estimates brought to one modulus."""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sessions.statistics.pooling.visit import TrialRow, Visit
from sessions.statistics.scores import mean_interval
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
    by_index: dict[int, Average] = {}
    for index in sorted({index for row in table.values() for index in row}):
        mean = average([row[index] for row in table.values() if index in row])
        if mean is not None:
            by_index[index] = mean
    return by_index


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
