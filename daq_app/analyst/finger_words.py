"""Texts of the displayed finger, and the comparison of two sessions."""

from collections import defaultdict
from statistics import fmean

from daq_app.analyst import state as m
from daq_app.analyst.frame import Frame
from daq_app.analyst.session_words import greatest_errors, sed_text
from daq_app.analyst.state import AnalystState, selected_row
from daq_app.wording import errors_text, tr, tr_noop
from sessions.report.contents import PredictionFinding, Report

ComparisonRows = tuple[tuple[str, tuple[tuple[float | None, float | None], ...]], ...]
_SCORE = "score [points, 0 to 100]"
MEAN_PANELS = tr_noop(("µ", "SED [kPa]", _SCORE))
PHASES = {
    "pressing": tr_noop("pressing down"), "sticking": tr_noop("sticking: dragged, nothing slips yet"),
    "slipping in part": tr_noop("slipping in part"), "sliding": tr_noop("sliding: every point slips"),
}  # fmt: skip


def compare_reports(first: Report, second: Report) -> ComparisonRows:
    """Return every stimulus of either session, by experiment in order, and both sessions' means in `MEAN_PANELS`.

    mu is the model's input; None if a session has no number.
    """
    tables = [_numbers(report) for report in (first, second)]
    names = [experiment.name for report in (first, second) for experiment in report.experiments]
    keys = sorted({*tables[0], *tables[1]}, key=lambda key: (names.index(key[0]) if key[0] in names else -1, *key))
    means = [[table.get(key, {}) for table in tables] for key in keys]
    rows = (tuple((pair[0].get(name), pair[1].get(name)) for name in MEAN_PANELS) for pair in means)
    return tuple((f"{experiment} {index}", row) for (experiment, index), row in zip(keys, rows, strict=True))


def _numbers(report: Report) -> dict[tuple[str, int], dict[str, float]]:
    samples: defaultdict[tuple[str, int], defaultdict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for prediction in report.predictions:
        if prediction.index is None:
            continue
        sed_kpa = None if prediction.sed is None else 1000.0 * prediction.sed
        for name, value in (("µ", prediction.mu), ("SED [kPa]", sed_kpa)):
            if value is not None:
                samples[prediction.experiment, prediction.index][name].append(value)
    for experiment in report.experiments:
        for score in experiment.scores:
            samples[experiment.name, score.index][_SCORE].append(score.mean)
    return {key: {name: fmean(sample) for name, sample in values.items()} for key, values in samples.items()}


def finger_text(state: AnalystState) -> str:
    """Return the text about the finger in full slip, or the reason why there is none."""
    if (row := selected_row(state)) is None:
        return ""
    prediction = row.prediction
    name = tr("stroke") if row.trial is None else tr("trial {trial}", trial=row.trial)
    if prediction is None:
        if row.stroke is None:
            return tr("No finger: {name} has no stroke.", name=name)
        if state.halted:
            return tr("The finger of {name} was not solved: the work was stopped. 'Go on' solves it.", name=name)
        return tr("The finger of {name} is being solved.", name=name)
    if prediction.sed is None:
        return tr("No settled finger. {why}", why=prediction.reasons.get("sed", tr("no reason is known")))
    sentences = [tr("Finger of {name}, settled", name=name), sed_text(state.report, prediction)]
    if (frame := state.fingers.get(row.key)) is not None:
        sentences.append(_contact_text(frame))
    return " · ".join(sentences)


def other_finger(state: AnalystState) -> tuple[Frame | None, str]:
    """Return the compared session's finger in full slip for the chosen stimulus, and the text about it.

    Repetitions are matched by their order. The text is "" if no session is compared.
    """
    comparison, row = state.comparison, selected_row(state)
    if comparison is None or state.report is None or row is None or row.prediction is None:
        return None, ""
    reports = (state.report, comparison.report)
    predictions, other_predictions = (_of_stimulus(report, row.prediction) for report in reports)
    repetition = [candidate.stroke for candidate in predictions].index(row.prediction.stroke)
    theirs_row = other_predictions[repetition] if repetition < len(other_predictions) else None
    finger = None if theirs_row is None else comparison.fingers.get((theirs_row.trial, theirs_row.stroke))
    if theirs_row is None or theirs_row.sed is None or finger is None:
        return None, tr("{session} has no answer to this stimulus.", session=comparison.report.session)
    sentence = sed_text(comparison.report, theirs_row)
    return finger, " · ".join((comparison.report.session, sentence, _contact_text(finger)))


def _of_stimulus(report: Report, reference: PredictionFinding) -> list[PredictionFinding]:
    key = reference.experiment, reference.index
    alike = [prediction for prediction in report.predictions if (prediction.experiment, prediction.index) == key]
    return sorted(alike, key=lambda prediction: prediction.stroke or 0)


def film_text(film: m.FingerHistory | None, index: int | None = None) -> str:
    """Return the text about one state of a history; without a state, why the history ends before full slip."""
    if film is None:
        return ""
    if index is None:
        if not film.reason:
            return ""
        last = film.film.instants[-1]
        return tr(
            "No settled state. The last good one, before tissue folds, is step {step}: at {time:.3f} s, "
            "{depth:.3g} mm deep after {slid:.3g} mm of sliding; ⊗ marks its most squeezed tissue. {why}",
            step=len(film.film.instants), time=last.time, depth=last.depth, slid=abs(last.travel), why=film.reason,
        )  # fmt: skip
    now = film.film.instants[index]
    return tr(
        "Step {at} of {count}, {time:.3f} s · {phase} · {depth:.2f} mm deep, {slid:.2f} mm slid · "
        "SED {sed:.3f} kPa at small strain{errors} · {contact}",
        at=index + 1, count=len(film.film.instants), time=now.time, phase=tr(PHASES[now.phase]), depth=now.depth,
        slid=abs(now.travel), sed=1000.0 * now.sed, contact=_contact_text(film.film.frames[index]),
        errors=errors_text(None),  # no errors are computed for the steps of a history
    )  # fmt: skip


def name_and_errors(report: Report) -> str:
    """Return the name of a session, and error bounds for all of its SEDs."""
    return " · ".join(filter(None, (report.session, greatest_errors(report))))


def _contact_text(frame: Frame) -> str:
    states = frame.contact.state
    touching = sum(state != "open" for state in states)
    slipping = sum(state in ("slip", "cap") for state in states)
    if not touching:
        return tr("nothing touches")
    return tr("touching points that slip: {slipping} of {touching}", slipping=slipping, touching=touching)
