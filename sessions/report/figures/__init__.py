"""The figures of a report: every picture with its caption and its numbers."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from sessions.report.contents import PredictionFinding, Report
from sessions.report.figures.courses import (
    MU_COURSE,
    NORMAL,
    SPEED_COURSE,
    TANGENTIAL,
    StrokeQuantity,
    course_panel,
    response_panel,
    stroke_panel,
)
from sessions.report.figures.finger import common_levels, finger_panels
from sessions.report.figures.relation import paths_panel, relation_panel, score_panel
from sessions.report.figures.style import Panel, Plate, look, plate
from sessions.report.wording import caption, shown_response
from sessions.statistics.scores import by_key

__all__ = ["Panel", "Plate", "picture", "plates"]

Panels = Iterable[Panel | None]


def plates(report: Report) -> tuple[Plate, ...]:
    """Return the figures of a report that have numbers, in order."""
    with look(simulated=report.simulated):
        return tuple(plate for plate in [_plate(report, name) for name in _PANELS] if plate.panels)


def picture(report: Report, plate: str, experiment: str | None = None) -> Panel | None:
    """Return the first panel of a plate, of one experiment if named; None without numbers."""
    if experiment is not None:
        report = replace(
            report,
            experiments=tuple(e for e in report.experiments if e.name == experiment),
            strokes=tuple(s for s in report.strokes if s.experiment == experiment),
            predictions=tuple(p for p in report.predictions if p.experiment == experiment),
        )
    with look(simulated=report.simulated):
        return next(iter(_plate(report, plate).panels), None)


def _plate(report: Report, name: str) -> Plate:
    model = f" Model: {report.model}." if report.model and name in _OF_THE_MODEL else ""
    scored = [experiment for experiment in report.experiments if experiment.scores]
    scores = " or ".join(dict.fromkeys(f"the {experiment.score_name}" for experiment in scored)) or "the score"
    own = "Circles: scores of whoever made the strokes. " if any(e.own_scores for e in scored) else ""
    caption_text = caption(f"figure-{name}", label=shown_response(report.response).label, scores=scores, own=own)
    return plate(name, caption_text + model, _PANELS[name](report))


def _of_strokes(*quantities: StrokeQuantity) -> Callable[[Report], Panels]:
    """Return a function that draws a panel for each quantity and experiment; strokes without one come last."""

    def panels(report: Report) -> Panels:
        names = [experiment.name for experiment in report.experiments]
        groups = [(name, [s for s in report.strokes if s.experiment == name]) for name in names]
        groups.append(("", [s for s in report.strokes if s.experiment not in names]))
        return (stroke_panel(quantity, strokes, name) for name, strokes in groups if strokes for quantity in quantities)

    return panels


def _fingers(report: Report) -> Panels:
    levels = common_levels(report.fields) if report.fields else ()
    return (panel for field in report.fields for panel in finger_panels(field, levels))


def _predictions_of(report: Report) -> Mapping[str, Sequence[PredictionFinding]]:
    return by_key((p.experiment, p) for p in report.predictions)


_OF_THE_MODEL = {"finger", "response", "relation"}
_PANELS: Mapping[str, Callable[[Report], Panels]] = {
    "course": lambda report: () if report.course is None else (course_panel(report.course, report.strokes),),
    "scores": lambda report: map(score_panel, report.experiments),
    "friction": _of_strokes(MU_COURSE),
    "speed": _of_strokes(SPEED_COURSE),
    "forces": _of_strokes(NORMAL, TANGENTIAL),
    "finger": _fingers,
    "response": lambda report: (response_panel(group, name) for name, group in _predictions_of(report).items()),
    "relation": lambda report: (relation_panel(e, _predictions_of(report).get(e.name, ())) for e in report.experiments),
    "paths": lambda report: (
        paths_panel(e.name, e.paths, shown_response(report.response).label) for e in report.experiments
    ),
}
