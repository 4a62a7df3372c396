"""What the model predicts, as findings: a row a trial, courses, pictures of the finger, what was left out."""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sessions.prediction import PredictionOptions, SessionPrediction, TrialPrediction
from sessions.prediction.afferent import AfferentSettings, Firing, parameters
from sessions.prediction.solving import doubt_of
from sessions.prediction.stored import model_facts
from sessions.report.contents import Fact, Field, History, PredictionFinding, same_fields
from sessions.strokes.friction import AreaLaw

_NUMBER = re.compile(r"\d+(\.\d+)?(e[-+]?\d+)?")
_FROM_ROW = {"tau_max": "mu", "error_estimate": "sed", "normal_per_mm": "normal_force", "wall_s": "sed"}


def predictions(
    prediction: SessionPrediction | None, firing: Sequence[Firing] = (), undone: Set[int] = frozenset()
) -> tuple[PredictionFinding, ...]:
    """Return a finding for each trial, or for each stroke of a recording without trials.

    `undone` are the numbers of trials that the session did not come to.
    """
    if prediction is None:
        return ()
    rates = {one.trial: one for one in firing}
    rows = (
        replace(row, reasons=dict.fromkeys(row.reasons, "The trial was not done.")) if row.trial in undone else row
        for row in prediction.trials
    )
    return tuple(_with_more(finding_of(row), row, rates.get(row.trial)) for row in rows)


def afferent_facts(settings: AfferentSettings, reference: float | None) -> tuple[Fact, ...]:
    """Return every parameter of the afferent with its value, and what it rests on."""
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
    chosen: dict[str, TrialPrediction] = {}
    for row in prediction.trials:
        if row.prediction is not None and row.stimulus is not None and row.block is not None:
            before = chosen.get(row.block)
            if before is None or before.stimulus is None or before.stimulus.known_index < row.stimulus.known_index:
                chosen[row.block] = row
    drawn = [field_of(name, row) for name, row in chosen.items()]
    return tuple(field for field in drawn if field is not None)


def model_in_short(options: PredictionOptions, area: AreaLaw) -> str:
    """Return in a few words which model SEDs are of.

    >>> model_in_short(PredictionOptions(), AreaLaw())
    'small strain, settled sliding, τ max computed, contact area fixed'
    """
    return f"{options.kinematics} strain, settled sliding, τ max {options.tau_reading}, contact area {area.law}"


def modelled(prediction: SessionPrediction | None) -> tuple[Fact, ...]:
    """Return what the model holds, with the greatest residual of each audit over all trials."""
    return tuple(Fact(*fact) for fact in model_facts(prediction))


def left_out(stored: SessionPrediction | None) -> tuple[Fact, ...]:
    """Return what was left out, how much that may have changed the SED, and how this was estimated."""
    solved = [] if stored is None else [row.prediction for row in stored.trials if row.prediction is not None]
    by_effect: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for prediction in solved:
        for name, entry in prediction.model.get("left_out", {}).items():
            by_effect[name].append(entry)
    facts = [Fact(name, _share(entries), entries[0]["how"]) for name, entries in by_effect.items()]
    warned: dict[str, list[str]] = defaultdict(list)  # sentences that differ in their numbers only stand together
    for prediction in solved:
        for sentence in prediction.warnings:
            warned[_NUMBER.sub("#", sentence)].append(sentence)
    return (
        *facts,
        *(Fact("warning", same[0], f"the first of {len(same)} trials with this warning") for same in warned.values()),
    )


def finding_of(row: TrialPrediction) -> PredictionFinding:
    """Return the finding of one trial."""
    history = row.history
    reasons = dict(row.reasons)
    for name, other in _FROM_ROW.items():
        if other in reasons:
            reasons.setdefault(name, reasons[other])
    numbers: dict[str, Any] = {
        "stroke": None if row.stroke is None else row.stroke + 1,
        "experiment": row.block or "",
        "index": None if row.stimulus is None else row.stimulus.index,
        "code": "" if row.stimulus is None else row.stimulus.code,
        "history": None if history is None else History(_numbers(history.time), _numbers(history.sed_ending)),
        "reasons": reasons,
        "responses": row.responses,
        "row": _row(row),
        "doubt": "" if row.prediction is None else doubt_of(row.prediction),
        "opposite_doubt": "" if row.opposite is None else doubt_of(row.opposite),
    }
    return PredictionFinding(**{**same_fields(row, PredictionFinding), **numbers})


def _row(row: TrialPrediction) -> tuple[tuple[float, float], ...]:
    """Return arc position and SED of every ending of the row that has one."""
    if row.prediction is None:
        return ()
    pairs = zip(row.prediction.row.arc.tolist(), row.prediction.row.sed.tolist(), strict=True)
    return tuple((arc, sed) for arc, sed in pairs if np.isfinite(sed))


def _with_more(finding: PredictionFinding, row: TrialPrediction, firing: Firing | None) -> PredictionFinding:
    """Return the finding with the intervals of its SED, and with an afferent's rates."""
    interval = row.interval
    if interval is not None and interval.low is not None and interval.high is not None:
        finding = replace(finding, sed_interval=(interval.low, interval.high), interval_by=interval.method or "")
    elif interval is not None:
        finding = replace(finding, reasons={**finding.reasons, "sed_interval": interval.reason})
    if interval is not None:
        forces = interval.normal_force, interval.tangential_force
        finding = replace(finding, normal_force_interval=forces[0], tangential_force_interval=forces[1])
    if firing is not None:
        finding = replace(
            finding,
            peak_rate=float(firing.rate.max()),
            settled_rate=firing.settled_rate,
            peak_rate_interval=firing.peak_interval,
            settled_rate_interval=firing.settled_interval,
        )
    return finding


def field_of(experiment: str, row: TrialPrediction) -> Field | None:
    """Return the settled finger of a trial; None where there is no prediction."""
    picture = row.picture()
    if picture is None or row.stimulus is None:
        return None
    drawn, skin = picture
    return Field(
        experiment=experiment,
        index=row.stimulus.known_index,
        nodes=_pairs(drawn.nodes),
        triangles=tuple((int(a), int(b), int(c)) for a, b, c in drawn.triangles),
        sed=_numbers(drawn.sed),
        outlines={name: _pairs(line) for name, line in drawn.outlines.items()},
        patch=_pairs(drawn.patch),
        contact=_pairs(np.column_stack([skin.x, skin.gap])),
        pressure=_numbers(skin.pressure),
        traction=_numbers(skin.traction),
        state=skin.state,
    )


def _share(entries: Sequence[Mapping[str, Any]]) -> str:
    """Return the estimated change of the SED, over all trials."""
    known = [100 * entry["estimate"] for entry in entries if entry["estimate"] is not None]
    if not known:
        return "no estimate"
    low, high = min(known), max(known)
    ends = dict.fromkeys((_plain(low), _plain(high)))
    return f"{' to '.join(ends)} % of the SED"


def _plain(value: float) -> str:
    """Return a share in two figures without powers of ten, however small.

    >>> _plain(158.38), _plain(0.126), _plain(8e-6)
    ('158', '0.13', 'below 0.01')
    """
    if value == 0.0 or value >= 10.0:
        return f"{value:.0f}"
    return "below 0.01" if value < 0.01 else f"{value:.2g}"


def _numbers(values: NDArray[np.float64]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _pairs(points: NDArray[np.float64]) -> tuple[tuple[float, float], ...]:
    return tuple((float(x), float(y)) for x, y in points)
