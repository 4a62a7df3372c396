"""What the analysis found, as findings: strokes with their courses, flaws, forces over the whole recording."""

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sessions.recording.reader import Recording
from sessions.report.contents import Course, Fact, StrokeFinding, Trace, same_fields
from sessions.strokes.analysis import Analysis
from sessions.strokes.bootstrap import NUMBERS
from sessions.strokes.flaws import Flaw
from sessions.strokes.forces import in_face_frame
from sessions.strokes.stroke import Stroke

Array = NDArray[np.float64]

MOST_INSTANTS = 600  # of a stroke's course that a picture can show
STRETCHES = 700  # of the whole recording, each drawn by its least and its greatest value


def strokes(recording: Recording, analysis: Analysis) -> tuple[StrokeFinding, ...]:
    """Return the strokes, numbered in order of time, with what their trials ask for."""
    planned = {trial.number: trial for trial in recording.plan.trials}
    findings: list[StrokeFinding] = []
    for position, stroke in enumerate(analysis.strokes):
        trial = None if stroke.trial is None else planned.get(stroke.trial)
        intervals = analysis.intervals[position]
        numbers: dict[str, Any] = {
            "number": position + 1,
            "experiment": "" if trial is None else trial.block,
            "index": None if trial is None else trial.stimulus.index,
            "code": "" if trial is None else trial.stimulus.code,
            "mu_interval": stroke.mu_dynamic_interval,
            "reasons": _reasons(stroke, position, analysis.flaws),
            "trace": _trace(stroke),
            "bootstrap": {name: ends for name in NUMBERS if (ends := getattr(intervals, name)) is not None},
            "direction_agrees": intervals.direction_agrees,
            "within": stroke.number,
            "decided": dict(stroke.decided),
        }
        findings.append(StrokeFinding(**{**same_fields(stroke, StrokeFinding), **numbers}))
    return tuple(findings)


def flaws(analysis: Analysis) -> tuple[Fact, ...]:
    """Return every flaw with its sentence, its grade and where it lies."""
    return tuple(
        Fact(flaw.name.replace("_", " "), flaw.sentence, f"{_place(flaw)}: {flaw.grade}") for flaw in analysis.flaws
    )


def course(recording: Recording) -> Course | None:
    """Return the forces over the whole recording, no zero taken off and unfiltered; None where there are none."""
    if recording.info is None:
        return None
    block = recording.readings()
    if not len(block):
        return None
    wrench = in_face_frame(recording.info.calibration.wrench(block.raw, np.zeros(6)), recording.plan.frame)
    kept = _extremes(-wrench[:, 2])
    return Course(
        _numbers(block.time[kept]), _numbers(-wrench[kept, 2]), _numbers(np.hypot(wrench[kept, 0], wrench[kept, 1]))
    )


def _reasons(stroke: Stroke, position: int, flaws: tuple[Flaw, ...]) -> dict[str, str]:
    """Return a sentence for every number withheld, by its name."""
    sentences = {str(flaw.name): flaw.sentence for flaw in flaws if flaw.stroke == position}
    reasons = {number: sentences.get(name, name.replace("_", " ")) for number, name in stroke.reasons.items()}
    usual = {
        "trial": "the recording has no trials",
        "index": "the recording has no plan that names its stimuli",
        "onset": "the recording begins in contact",
        "mu_static": "no static peak stands out above what follows it",
    }
    return {**usual, **reasons}


def _trace(stroke: Stroke) -> Trace | None:
    """Return the course of a stroke from its onset on, thinned evenly where it has too many readings to draw."""
    curve = stroke.curve
    if curve is None or not len(curve.time):
        return None
    begin = float(curve.time[0]) if stroke.onset is None else stroke.onset
    end = float(curve.time[-1]) if stroke.lift is None else stroke.lift
    inside = np.flatnonzero((curve.time >= begin) & (curve.time <= end))
    every = max(1, -(-len(inside) // MOST_INSTANTS))
    kept = inside[::every]
    return Trace(
        origin=begin,
        time=_numbers(curve.time[kept] - begin),
        normal=_numbers(curve.normal[kept]),
        tangential=_numbers(curve.tangential[kept]),
        mu=_known(curve.ratio[kept]),
        speed=_known(curve.speed[kept]),
        every=every,
    )


def _extremes(values: Array) -> NDArray[np.int64]:
    """Return positions of the least and the greatest value of each stretch of time, rising, both ends among them.

    >>> _extremes(np.array([1.0, 5.0, 2.0])).tolist()
    [0, 1, 2]
    """
    n = len(values)
    if n <= 2 * STRETCHES:
        return np.arange(n)
    edges = np.linspace(0, n, STRETCHES + 1).astype(np.int64)
    kept = {0, n - 1}
    for start, stop in itertools.pairwise(edges.tolist()):
        piece = values[start:stop]
        if not np.isnan(piece).all():
            kept |= {start + int(np.nanargmin(piece)), start + int(np.nanargmax(piece))}
    return np.array(sorted(kept))


def _place(flaw: Flaw) -> str:
    if flaw.stroke is not None:
        return f"stroke {flaw.stroke + 1}"
    return "whole recording" if flaw.trial is None else f"trial {flaw.trial}"


def _numbers(values: Array) -> tuple[float, ...]:
    return tuple(values.tolist())


def _known(values: Array) -> tuple[float | None, ...]:
    """Return None for nan: JSON has none, and no number is meant."""
    return tuple(None if np.isnan(value) else float(value) for value in values)
