"""What the analyst's window knows of a session folder, and what it shows of it. No Qt, no process."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from sessions.exports.figures.style import Panel, Plate
from sessions.report.contents import PredictionFinding, Report, StrokeFinding

Stage = Literal["opening", "analysed", "drawing", "predicted"]
FINGERS = "finger"  # name of the plate of fingers


@dataclass(frozen=True, slots=True)
class Step:
    """Work goes on."""

    part: float  # of all of it, 0 to 1
    words: str
    left: float | None = None  # about how long it will still take [s]; None: not known


@dataclass(frozen=True, slots=True)
class Found:
    """What is known of the session now: first its strokes, later the model's answers too."""

    stage: Stage
    report: Report
    plates: tuple[Plate, ...]
    pixels: Mapping[str, bytes] = field(default_factory=dict[str, bytes])  # PNG of each picture, by its name


@dataclass(frozen=True, slots=True)
class Written:
    """A report or an export is whole."""

    path: str


@dataclass(frozen=True, slots=True)
class Problem:
    """Something could not be done; what was known before stays."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Cancelled:
    """Somebody stopped the work; what was done before stays."""


@dataclass(frozen=True, slots=True)
class Write:
    """Asks for a file: "report", or one of `sessions.exports.FORMATS`."""

    what: str
    path: str


@dataclass(frozen=True, slots=True)
class Choose:
    """Somebody chose a trial, or a stroke of a recording without trials."""

    row: int


Message = Step | Found | Written | Problem | Cancelled | Write | Choose


@dataclass(frozen=True, slots=True)
class AnalystState:
    """Everything the window knows."""

    folder: Path
    stage: Stage = "opening"
    report: Report | None = None
    plates: tuple[Plate, ...] = ()
    pixels: Mapping[str, bytes] = field(default_factory=dict[str, bytes])
    step: Step | None = Step(0.0, "opening")  # None: nothing is being done
    told: str = ""  # how the last work ended
    row: int = 0  # that is chosen


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the list: a stroke, or a predicted trial without one."""

    words: str
    trial: int | None
    stroke: StrokeFinding | None
    prediction: PredictionFinding | None


@dataclass(frozen=True, slots=True)
class Point:
    """A stimulus in prediction against score."""

    experiment: str
    index: int
    score: float
    sed_kpa: float
    row: int | None  # that is chosen by it


def fold(state: AnalystState, message: Message) -> AnalystState:
    """Return the state after a message."""
    match message:
        case Step():
            return replace(state, step=message)
        case Found(stage, report, plates, pixels):
            going_on = None if stage == "predicted" else state.step
            return replace(state, stage=stage, report=report, plates=plates, pixels=pixels, step=going_on)
        case Written(path):
            return replace(state, step=None, told=f"Written: {path}")
        case Problem(sentence):
            return replace(state, step=None, told=sentence)
        case Cancelled():
            kept = "" if state.report is None else " What was done before is kept."
            return replace(state, step=None, told=f"Stopped.{kept}")
        case Write(what, path):
            return replace(state, step=Step(0.0, f"writing {what} to {path}"), told="")
        case Choose(row):
            return replace(state, row=max(0, min(row, len(rows(state)) - 1)))


def rows(state: AnalystState) -> tuple[Row, ...]:
    """Return the list: every stroke in order of time, then trials that have a prediction or a reason but no stroke."""
    report = state.report
    if report is None:
        return ()
    by_stroke = {p.stroke: p for p in report.predictions if p.stroke is not None}
    listed = [Row(_stroke_words(s), s.trial, s, by_stroke.get(s.number)) for s in report.strokes]
    without = [Row(_named(p) + "  no stroke", p.trial, None, p) for p in report.predictions if p.stroke is None]
    return (*listed, *without)


def chosen(state: AnalystState) -> Row | None:
    """Return the chosen line; None where there is none."""
    listed = rows(state)
    return listed[state.row] if listed else None


def numbers(state: AnalystState) -> tuple[tuple[str, str], ...]:
    """Return names and values of the chosen line, with the way from the number back to its readings last."""
    row = chosen(state)
    if row is None:
        return ()
    told: list[tuple[str, str]] = []
    if (stroke := row.stroke) is not None:
        why = stroke.reasons
        interval = "" if stroke.mu_interval is None else f"  [{stroke.mu_interval[0]:.3f}, {stroke.mu_interval[1]:.3f}]"
        told += [
            ("µ over the steady window", _value(stroke.mu_dynamic, "{:.3f}" + interval, why, "mu_dynamic")),
            ("µ at its greatest", _value(stroke.mu_max, "{:.3f}", why, "mu_max")),
            ("traction bound", _value(_kpa(stroke.tau_max), "{:.1f} kPa", why, "tau_max")),
            ("speed", _value(stroke.speed, "{:.1f} mm/s", why, "speed")),
            ("normal force", _value(stroke.normal_force, "{:.2f} N", why, "normal_force")),
            ("flaws", ", ".join(stroke.flaws) or "none"),
        ]
    if (said := row.prediction) is not None:
        error = "" if said.error_estimate is None else f" ± {100 * said.error_estimate:.1f} %"
        told += [
            ("SED, averaged over the ending", _value(_kpa(said.sed), "{:.3f} kPa" + error, said.reasons, "sed")),
            ("model: µ", _value(said.mu, "{:.3f} (" + said.mu_rule + ")", said.reasons, "mu")),
            ("model: indentation", _value(said.indentation, "{:.2f} mm", said.reasons, "indentation")),
            ("model: normal force", _value(said.normal_force, "{:.2f} N", said.reasons, "normal_force")),
        ]
    elif state.stage == "analysed":
        told.append(("SED", "not predicted yet" if state.step else "– not predicted"))
    return (*told, ("from", lineage(state)))


def lineage(state: AnalystState) -> str:
    """Return the way from the chosen numbers to the raw readings, in words."""
    row = chosen(state)
    if row is None:
        return ""
    parts = [state.folder.name]
    if row.trial is not None:
        parts.append(f"trial {row.trial}")
    if (stroke := row.stroke) is not None:
        parts.append(f"stroke {stroke.number}")
        if stroke.steady is not None:
            parts.append(f"steady window {stroke.steady[0]:.3f} to {stroke.steady[1]:.3f} s of the device's clock")
        if stroke.trace is not None and stroke.trace.every > 1:
            parts.append(f"one reading in {stroke.trace.every} drawn")
    return " → ".join(parts)


def finger_pictures(state: AnalystState) -> tuple[Panel, ...]:
    """Return the pictures of the chosen trial's finger; none where it was not predicted."""
    row, report = chosen(state), state.report
    if row is None or report is None or row.prediction is None or row.prediction.sed is None:
        return ()
    said = row.prediction
    at = next(
        (i for i, f in enumerate(report.fields) if (f.experiment, f.index) == (said.experiment, said.index)), None
    )
    plate = next((plate for plate in state.plates if plate.name == FINGERS), None)
    return () if at is None or plate is None else plate.panels[2 * at : 2 * at + 2]


def pictures(state: AnalystState) -> tuple[Panel, ...]:
    """Return the pictures of the whole session."""
    return tuple(panel for plate in state.plates if plate.name != FINGERS for panel in plate.panels)


def points(state: AnalystState) -> tuple[Point, ...]:
    """Return prediction against score, a point for each stimulus that has both."""
    report = state.report
    if report is None:
        return ()
    listed = rows(state)
    made: list[Point] = []
    for experiment in report.experiments:
        scores = {score.index: score.mean for score in experiment.scores}
        for number, row in enumerate(listed):
            said = row.prediction
            if said is None or said.sed is None or said.experiment != experiment.name or said.index not in scores:
                continue
            made.append(Point(experiment.name, said.index, scores[said.index], 1000.0 * said.sed, number))
    return tuple(made)


def progress_words(step: Step | None) -> str:
    """Return what is being done, and how long it will still take.

    >>> progress_words(Step(0.5, "predicting", 3.2))
    'predicting  50 %, about 4 s left'
    """
    if step is None:
        return ""
    left = "" if step.left is None else f", about {int(step.left) + 1} s left"
    return f"{step.words}  {100 * step.part:.0f} %{left}"


def _stroke_words(stroke: StrokeFinding) -> str:
    mu = "µ –" if stroke.mu_dynamic is None else f"µ {stroke.mu_dynamic:.2f}"
    mark = "  !" if stroke.flaws else ""
    return f"{_named(stroke)}  {mu}{mark}"


def _named(of: StrokeFinding | PredictionFinding) -> str:
    if of.trial is None:
        return f"stroke {of.number}" if isinstance(of, StrokeFinding) else "stroke –"
    return f"{of.trial}  {of.experiment} {of.code if of.index is None else of.index}"


def _kpa(mpa: float | None) -> float | None:
    return None if mpa is None else 1000.0 * mpa


def _value(value: float | None, form: str, reasons: dict[str, str], name: str) -> str:
    return form.format(value) if value is not None else f"–  {reasons.get(name, '')}".rstrip()
