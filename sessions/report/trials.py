"""Results of each stroke and trial for a report: numbers, time courses, flaws, pictures of the finger."""

import itertools
import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import fields as fields_of
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from drivers.arrays import Array, Indices
from sessions.prediction import PredictionOptions, SessionPrediction, TrialPrediction
from sessions.prediction.afferent import AfferentSettings, Firing, parameters
from sessions.prediction.scenes import doubt_of
from sessions.prediction.stored import TrialNumbers
from sessions.recording.reader import Recording
from sessions.report.contents import (
    AnswerFinding,
    Course,
    Fact,
    Field,
    PredictionFinding,
    StrokeFinding,
    Trace,
)
from sessions.report.wording import plural
from sessions.statistics.scores import by_key
from sessions.strokes.analysis import Analysis
from sessions.strokes.bootstrap import NUMBERS
from sessions.strokes.forces import in_face_frame
from sessions.strokes.stroke import AreaLaw, Flaw, Stroke

MOST_INSTANTS = 600  # most instants of a stroke in a picture
_GAP = 5.0  # multiple of the usual time step [-]; a longer step may be a gap
STRETCHES = 700  # stretches of the whole recording, each drawn by its extremes


def strokes(recording: Recording, analysis: Analysis) -> tuple[StrokeFinding, ...]:
    """Return the strokes, numbered in order of time, with data of their trials."""
    trials = {trial.number: trial for trial in recording.plan.trials}
    findings: list[StrokeFinding] = []
    for position, stroke in enumerate(analysis.strokes):
        trial = None if stroke.trial is None else trials.get(stroke.trial)
        intervals = analysis.intervals[position]
        numbers: dict[str, Any] = {
            "number": position + 1,
            "experiment": "" if trial is None else trial.block,
            "index": None if trial is None else trial.stimulus.index,
            "code": "" if trial is None else trial.stimulus.code,
            "reasons": _reasons(stroke, position, analysis.flaws),
            "trace": _trace(stroke),
            "bootstrap": {name: ends for name in NUMBERS if (ends := getattr(intervals, name)) is not None},
            "direction_agrees": intervals.direction_agrees,
            "within": stroke.number,
            "curve": None,
        }
        findings.append(StrokeFinding(**_values(stroke, Stroke) | numbers))
    return tuple(findings)


def _values(record: Stroke | TrialNumbers, form: type[Stroke | TrialNumbers]) -> dict[str, Any]:
    """Return the values of a record's fields that are fields of `form`, by name."""
    return {column.name: getattr(record, column.name) for column in fields_of(form)}


def answers(recording: Recording) -> tuple[AnswerFinding, ...]:
    """Return the subject's answer in each trial, in order."""
    return tuple(
        AnswerFinding(t.number, t.block, t.stimulus.index, t.stimulus.code, record.outcome, record.answer)
        for record in recording.trials
        for t in [record.trial]
        if record.answer is not None
    )


def flaws(analysis: Analysis) -> tuple[Fact, ...]:
    """Return every flaw with its sentence, its grade and its place."""

    def location(flaw: Flaw) -> str:
        if flaw.stroke is not None:
            return f"stroke {flaw.stroke + 1}"
        return "whole recording" if flaw.trial is None else f"trial {flaw.trial}"

    return tuple(Fact(f.name.replace("_", " "), f.sentence, f"{location(f)}: {f.grade}") for f in analysis.flaws)


def course(recording: Recording) -> Course | None:
    """Return the forces over the whole recording, without zeroing and unfiltered; None without forces.

    Gaps longer than a stretch of the picture break its curves.
    """
    if recording.info is None:
        return None
    block = recording.readings()
    if not len(block):
        return None
    wrench = in_face_frame(recording.info.calibration.wrench(block.raw, np.zeros(6)), recording.plan.frame)
    steps = np.diff(block.time)
    shortest = max((block.time[-1] - block.time[0]) / STRETCHES, _GAP * np.median(steps)) if len(steps) else 0.0
    gaps = np.flatnonzero(steps > shortest)
    forces = -wrench[:, 2], np.hypot(wrench[:, 0], wrench[:, 1])
    positions = np.union1d(np.union1d(*map(_extremes, forces)), [gaps, gaps + 1])
    behind = np.searchsorted(positions, gaps) + 1
    normal, tangential = (np.insert(force[positions], behind, np.nan) for force in forces)
    return Course(np.insert(block.time[positions], behind, block.time[gaps]), normal, tangential)


def _reasons(stroke: Stroke, position: int, flaws: tuple[Flaw, ...]) -> dict[str, str]:
    """Return a sentence for every withheld number, by name."""
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
    """Return the course of a stroke from its onset on, thinned evenly to at most `MOST_INSTANTS` readings."""
    curve = stroke.curve
    if curve is None or not len(curve.time):
        return None
    begin = float(curve.time[0]) if stroke.onset is None else stroke.onset
    end = float(curve.time[-1]) if stroke.lift is None else stroke.lift
    inside = np.flatnonzero((curve.time >= begin) & (curve.time <= end))
    if not len(inside):
        return None
    sample = inside[:: max(1, -(-len(inside) // MOST_INSTANTS))]
    columns = (curve.time - begin, curve.normal, curve.tangential, curve.ratio, curve.speed)
    return Trace(begin, *(column[sample] for column in columns))


def _extremes(values: Array) -> Indices:
    """Return the sorted positions of the least and greatest value of each stretch, including both ends.

    >>> _extremes(np.array([1.0, 5.0, 2.0])).tolist()
    [0, 1, 2]
    """
    n = len(values)
    if n <= 2 * STRETCHES:
        return np.arange(n)
    edges = np.linspace(0, n, STRETCHES + 1).astype(np.int64)
    positions = {0, n - 1}
    for start, stop in itertools.pairwise(edges.tolist()):
        stretch = values[start:stop]
        if not np.isnan(stretch).all():
            positions |= {start + int(np.nanargmin(stretch)), start + int(np.nanargmax(stretch))}
    return np.array(sorted(positions))


_NUMBER = re.compile(r"\d+(\.\d+)?(e[-+]?\d+)?")
_FROM_ROW = {"tau_max": "mu", "error_estimate": "sed", "normal_per_mm": "normal_force", "wall_s": "sed"}


def predictions(
    prediction: SessionPrediction | None, firings: Sequence[Firing] = (), undone: Set[int] = frozenset()
) -> tuple[PredictionFinding, ...]:
    """Return a finding for each trial, or stroke without trials; `undone` trials were not reached."""
    if prediction is None:
        return ()
    rates = {firing.trial: firing for firing in firings}
    rows = (
        replace(row, reasons=dict.fromkeys(row.reasons, "The trial was not done.")) if row.trial in undone else row
        for row in prediction.trials
    )
    return tuple(finding_of(row, rates.get(row.trial)) for row in rows)


def afferent_facts(settings: AfferentSettings, reference: float | None) -> tuple[Fact, ...]:
    """Return every parameter of the afferent with its value, and basis."""
    facts = [
        Fact(
            parameter["name"].replace("_", " "),
            f"{1e3 * parameter['value']:.4g} kPa"
            if parameter["unit"] == "MPa"
            else f"{parameter['value']:g} {parameter['unit']}".removesuffix(" -"),
            f"{parameter['standing']}: {parameter['basis']}",
        )
        for parameter in parameters(settings, reference)
    ]
    return () if reference is None else tuple(facts)


def fields(prediction: SessionPrediction | None) -> tuple[Field, ...]:
    """Return the settled finger of each experiment's greatest index that has a prediction."""
    if prediction is None:
        return ()
    by_block = by_key(
        (row.block, (row.stimulus.known_index, row))
        for row in prediction.trials
        if row.prediction is not None and row.stimulus is not None and row.block is not None
    )
    greatest = {name: max(rows, key=itemgetter(0))[1] for name, rows in by_block.items()}
    return tuple(field for name, row in greatest.items() if (field := field_of(name, row)) is not None)


def model_in_short(options: PredictionOptions, area: AreaLaw) -> str:
    """Return a short description of the model of the SEDs.

    >>> model_in_short(PredictionOptions(), AreaLaw())
    'small strain, settled sliding, τ max computed, contact area fixed'
    """
    return f"{options.kinematics} strain, settled sliding, τ max {options.tau_reading}, contact area {area.law}"


def omissions(session: SessionPrediction | None) -> tuple[Fact, ...]:
    """Return the effects omitted by the model, the estimated change of the SED by each, and the method."""
    rows = () if session is None else session.trials
    solutions = [row.prediction for row in rows if row.prediction is not None]
    by_effect = by_key(effect for prediction in solutions for effect in prediction.model.get("left_out", {}).items())
    # Sentences that differ only in their numbers are grouped.
    sentences = (sentence for prediction in solutions for sentence in prediction.warnings)
    warnings = by_key((_NUMBER.sub("#", sentence), sentence) for sentence in sentences)
    return (
        *(Fact(name, _share(entries), entries[0]["how"]) for name, entries in by_effect.items()),
        *(
            Fact(
                "warning",
                max(variants, key=lambda sentence: [float(number.group()) for number in _NUMBER.finditer(sentence)]),
                f"the greatest numbers of {plural(len(variants), 'trial')} with this warning",
            )
            for variants in warnings.values()
        ),
    )


def finding_of(row: TrialPrediction, firing: Firing | None = None) -> PredictionFinding:
    """Return the finding of one trial, with the rates of an afferent where it was computed."""
    reasons = {name: row.reasons[origin] for name, origin in _FROM_ROW.items() if origin in row.reasons}
    numbers: dict[str, Any] = {
        "stroke": None if row.stroke is None else row.stroke + 1,
        "experiment": row.block or "",
        "index": None if row.stimulus is None else row.stimulus.index,
        "code": "" if row.stimulus is None else row.stimulus.code,
        "history": row.history,
        "reasons": {**reasons, **row.reasons},
        "responses": row.responses,
        "row": _row(row),
        "doubt": "" if row.prediction is None else doubt_of(row.prediction),
        "opposite_doubt": "" if row.opposite is None else doubt_of(row.opposite),
    }
    if firing is not None:
        numbers |= {"peak_rate": float(firing.rate.max()), "settled_rate": firing.settled_rate}
        numbers |= {"peak_rate_interval": firing.peak_interval, "settled_rate_interval": firing.settled_interval}
    return PredictionFinding(**_values(row, TrialNumbers) | numbers)


def _row(row: TrialPrediction) -> dict[float, float]:
    """Return the SED of every ending of the row that has one, by its arc position."""
    if row.prediction is None:
        return {}
    endings = row.prediction.row
    return {arc: sed for arc, sed in zip(endings.arc.tolist(), endings.sed.tolist(), strict=True) if np.isfinite(sed)}


def field_of(experiment: str, row: TrialPrediction) -> Field | None:
    """Return the settled finger of a trial; None without a prediction."""
    picture, stimulus = row.picture(), row.stimulus
    return None if picture is None or stimulus is None else Field(experiment, stimulus.known_index, *picture)


NO_ESTIMATE = "no estimate"  # of the change by an omitted effect


def _share(entries: Sequence[Mapping[str, Any]]) -> str:
    """Return the estimated change of the SED, over all trials."""
    percentages = [100 * entry["estimate"] for entry in entries if entry["estimate"] is not None]
    if not percentages:
        return NO_ESTIMATE
    limits = dict.fromkeys((_plain(min(percentages)), _plain(max(percentages))))
    return f"{' to '.join(limits)} % of the SED"


def _plain(value: float) -> str:
    """Return a percentage with two figures, never with an exponent.

    >>> _plain(158.38), _plain(0.126), _plain(8e-6)
    ('158', '0.13', 'below 0.01')
    """
    if value == 0.0 or value >= 10.0:
        return f"{value:.0f}"
    return "below 0.01" if value < 0.01 else f"{value:.2g}"
