"""What is said of the finger that is shown, with which colours, and of two sessions side by side."""

from collections import defaultdict

from daq_app.analyst import state as m
from daq_app.analyst.frame import FieldChoice, Finger, Frame, Range, automatic_range
from daq_app.analyst.session_words import greatest_errors, sed_words
from daq_app.analyst.state import AnalystState, selected_row
from daq_app.wording import errors_words, tr, tr_noop
from sessions.report.contents import PredictionFinding, Report

ComparisonRows = tuple[tuple[str, tuple[tuple[float | None, float | None], ...]], ...]
MEAN_PANELS = tr_noop(("µ", "SED [kPa]", "score"))
PHASES = {
    "pressing": tr_noop("pressing down"), "sticking": tr_noop("sticking: dragged, nothing slips yet"),
    "slipping in part": tr_noop("slipping in part"), "sliding": tr_noop("sliding: every point slips"),
}  # fmt: skip


def compare_reports(first: Report, second: Report) -> ComparisonRows:
    """Return every stimulus of either session, experiments in their order, and both sessions' means in `MEAN_PANELS`.

    mu is the one that the model got; None where a session has no number.
    """
    tables = [_numbers(report) for report in (first, second)]
    names = [experiment.name for report in (first, second) for experiment in report.experiments]
    keys = sorted({*tables[0], *tables[1]}, key=lambda key: (names.index(key[0]) if key[0] in names else -1, *key))
    one, other = ([table.get(key, {}) for key in keys] for table in tables)
    rows = (tuple((a.get(name), b.get(name)) for name in MEAN_PANELS) for a, b in zip(one, other, strict=True))
    return tuple((f"{experiment} {index}", row) for (experiment, index), row in zip(keys, rows, strict=True))


def _numbers(report: Report) -> dict[tuple[str, int], dict[str, float]]:
    samples: defaultdict[tuple[str, int], defaultdict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for one in report.predictions:
        if one.index is None:
            continue
        for name, value in (("µ", one.mu), ("SED [kPa]", None if one.sed is None else 1000.0 * one.sed)):
            if value is not None:
                samples[one.experiment, one.index][name].append(value)
    for experiment in report.experiments:
        for score in experiment.scores:
            samples[experiment.name, score.index]["score"].append(score.mean)
    return {key: {name: sum(v) / len(v) for name, v in values.items()} for key, values in samples.items()}


def common_range(state: AnalystState | None, field: FieldChoice) -> Range:
    """Return where the colours of all trials of a session, and of one compared with it, begin and end."""
    finger_maps = [] if state is None else [state.fingers]
    if state is not None and state.other is not None:
        finger_maps.append(state.other.fingers)
    return automatic_range(field, (finger.frame for fingers in finger_maps for finger in fingers.values()))


def visible_film(state: AnalystState) -> m.FingerHistory | None:
    """Return the history that was asked for, where it is that of the chosen trial."""
    row = selected_row(state)
    return state.film if row is not None and state.film is not None and state.film.key == row.key else None


def was_tried(prediction: PredictionFinding) -> bool:
    """Say whether a trial was given to the solver: all that it needs is known."""
    return None not in (prediction.mu, prediction.tau_max, prediction.indentation, prediction.direction)


def finger_words(state: AnalystState | None) -> str:
    """Return what is said of the settled finger, or why there is none."""
    row = None if state is None else selected_row(state)
    if state is None or row is None:
        return ""
    prediction = row.prediction
    name = tr("stroke") if row.trial is None else tr("trial {trial}", trial=row.trial)
    if prediction is None:
        if state.halted:
            return tr("The finger of {name} was not solved: the work was stopped. 'Go on' solves it.", name=name)
        return tr("The finger of {name} is being solved.", name=name)
    if prediction.sed is None:
        return tr("No settled finger. {why}", why=prediction.reasons.get("sed", tr("no reason is known")))
    parts = [tr("Finger of {name}, settled", name=name), sed_words(state.report, prediction)]
    if (finger := state.fingers.get(row.key)) is not None:
        parts.append(_contact_words(finger.frame))
    return " · ".join(parts)


def other_finger(state: AnalystState | None) -> tuple[Finger | None, str]:
    """Return the other session's settled finger of the stimulus that is chosen, and what is said of it.

    Of repetitions it is the one that came as early among its own; "" is said where no session is compared.
    """
    other, row = (None, None) if state is None else (state.other, selected_row(state))
    if state is None or other is None or state.report is None or row is None or row.prediction is None:
        return None, ""
    predictions, other_predictions = (_of_stimulus(report, row.prediction) for report in (state.report, other.report))
    place = [one.stroke for one in predictions].index(row.prediction.stroke)
    theirs_row = other_predictions[place] if place < len(other_predictions) else None
    finger = None if theirs_row is None else other.fingers.get((theirs_row.trial, theirs_row.stroke))
    if theirs_row is None or theirs_row.sed is None or finger is None:
        return None, tr("{session} has no answer to this stimulus.", session=other.report.session)
    return finger, " · ".join((other.report.session, sed_words(other.report, theirs_row), _contact_words(finger.frame)))


def _of_stimulus(report: Report, of: PredictionFinding) -> list[PredictionFinding]:
    alike = [p for p in report.predictions if (p.experiment, p.index) == (of.experiment, of.index)]
    return sorted(alike, key=lambda p: p.stroke or 0)


def film_words(film: m.FingerHistory | None, at: int | None = None) -> str:
    """Return what is said of one state of a history; without one, why the history ends before it settles."""
    if film is None:
        return ""
    if at is None:
        if not film.why:
            return ""
        last = film.film.instants[-1]
        return tr(
            "No settled state. The last good one, before tissue folds, is step {step}: at {time:.3f} s, "
            "{depth:.3g} mm deep after {slid:.3g} mm of sliding; ⊗ marks its most squeezed tissue. {why}",
            step=len(film.film.instants), time=last.time, depth=last.depth, slid=abs(last.travel), why=film.why,
        )  # fmt: skip
    now = film.film.instants[at]
    return tr(
        "Step {at} of {count}, {time:.3f} s · {phase} · {depth:.2f} mm deep, {slid:.2f} mm slid · "
        "SED {sed:.3f} kPa at small strain{errors} · {contact}",
        at=at + 1, count=len(film.film.instants), time=now.time, phase=tr(PHASES[now.phase]), depth=now.depth,
        slid=abs(now.travel), sed=1000.0 * now.sed, contact=_contact_words(film.film.frames[at]),
        errors=errors_words(None),  # a course is not solved again for each of its steps
    )  # fmt: skip


def name_and_errors(report: Report) -> str:
    """Return the name of a session, and the errors that hold for all of its SEDs."""
    return " · ".join(filter(None, (report.session, greatest_errors(report))))


def _contact_words(frame: Frame) -> str:
    states = frame.contact.state
    touching = sum(state != "open" for state in states)
    slipping = sum(state in ("slip", "cap") for state in states)
    if not touching:
        return tr("nothing touches")
    return tr("touching points that slip: {slipping} of {touching}", slipping=slipping, touching=touching)
