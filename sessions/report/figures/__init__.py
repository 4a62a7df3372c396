"""The figures of a report: every picture with its caption and its numbers."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from sessions.report.contents import Report
from sessions.report.figures.courses import (
    MU,
    NORMAL,
    SPEED,
    TANGENTIAL,
    StrokeQuantity,
    course_panel,
    response_panel,
    stroke_panel,
)
from sessions.report.figures.finger import common_levels, finger_panels
from sessions.report.figures.relation import PATHS_CAPTION, SCORES_CAPTION, paths_panel, relation_panel, score_panel
from sessions.report.figures.style import Panel, Plate, look, plate
from sessions.report.wording import shown_response
from sessions.statistics.scores import by_key

__all__ = ["Panel", "Plate", "picture", "plates"]

Panels = Iterable[Panel | None]


def plates(report: Report) -> tuple[Plate, ...]:
    """Return the figures that a report has numbers for, in their order."""
    with look(simulated=report.simulated):
        drawn = tuple(_plate(report, name) for name in _PLATES)
    return tuple(plate for plate in drawn if plate.panels)


def picture(report: Report, plate: str, experiment: str | None = None) -> Panel | None:
    """Return the first panel of a plate, of one experiment where it is named; None where it has no numbers."""
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
    panels, caption = _PLATES[name]
    model = f" Model: {report.model}." if report.model and name in _OF_THE_MODEL else ""
    return plate(name, caption.format(response=shown_response(report.response).label) + model, panels(report))


def _course(report: Report) -> Panels:
    return () if report.course is None else (course_panel(report.course, report.strokes),)


def _scores(report: Report) -> Panels:
    return map(score_panel, report.experiments)


def _of_strokes(*quantities: StrokeQuantity) -> Callable[[Report], Panels]:
    """Return what draws a panel for each quantity of the strokes of each experiment; those of none come last."""

    def panels(report: Report) -> Panels:
        names = [experiment.name for experiment in report.experiments]
        groups = [(name, [s for s in report.strokes if s.experiment == name]) for name in names]
        groups.append(("", [s for s in report.strokes if s.experiment not in names]))
        return (stroke_panel(one, strokes, name) for name, strokes in groups if strokes for one in quantities)

    return panels


def _fingers(report: Report) -> Panels:
    levels = common_levels(report.fields) if report.fields else ()
    return (panel for field in report.fields for panel in finger_panels(field, levels))


def _responses(report: Report) -> Panels:
    by_experiment = by_key((p.experiment, p) for p in report.predictions)
    return (response_panel(own, name) for name, own in by_experiment.items())


def _relations(report: Report) -> Panels:
    by_experiment = by_key((p.experiment, p) for p in report.predictions)
    return (relation_panel(one, by_experiment.get(one.name, ())) for one in report.experiments)


def _paths(report: Report) -> Panels:
    return (paths_panel(e.name, e.paths, shown_response(report.response).label) for e in report.experiments)


_OF_THE_MODEL = {"finger", "response", "relation"}
_PLATES: Mapping[str, tuple[Callable[[Report], Panels], str]] = {  # what draws each figure, and its caption
    "course": (
        _course,
        "Normal and tangential force over the whole recording, unfiltered; each stretch is drawn by its least and its"
        " greatest value. Curves break where readings are missing. Grey: the strokes that were found, with their"
        " numbers; discarded takes are not searched.",
    ),
    "scores": (_scores, SCORES_CAPTION),
    "friction": (
        _of_strokes(MU),
        "Ratio of tangential to normal force from contact onset on. Thick: the steady window, over which the dynamic "
        "coefficient is averaged. Dashed: a stroke of which no coefficient is given, the tables say why. The ratio is "
        "left out where the normal force is too small to divide by.",
    ),
    "speed": (
        _of_strokes(SPEED),
        "Speed of the centre of pressure along the stroke from contact onset on. Thick: the steady window. It moves "
        "by rolling and by skin shear as well as by sliding, most of all at onset; the tables give its mean slope "
        "over the steady window. Strokes whose speed was refused are left out.",
    ),
    "forces": (
        _of_strokes(NORMAL, TANGENTIAL),
        "Normal force N and tangential force T of the strokes of each series, laid over each other from contact onset "
        "on, zero taken off and filtered as for the analysis. Thick: the steady window. Dashed: a stroke without a "
        "steady window.",
    ),
    "finger": (
        _fingers,
        "Strain-energy density (SED) in the deformed finger in its settled state, sliding; lengths are true. Thin "
        "lines: borders of skin and layers; outlined: the ending. Close view: tractions as arrows; which skin slips. "
        "One scale of colours, which ends below the peaks.",
    ),
    "response": (
        _responses,
        "Predicted response: SED averaged over the ending while the finger is pressed down for 1 s and then slides. "
        "Above the whole course, below the sliding alone on its own scale, which does not begin at 0. Dashed: "
        "settled, not computed further.",
    ),
    "relation": (
        _relations,
        "Predicted {response} against mean score, with the stimulus's index. Circles: scores of whoever made the "
        "strokes. Across: 95 % t interval. Upright: thick, error of the mesh; thin, 95 % interval of friction. "
        "Line: least squares. r: Pearson's, Fisher's z interval. Range: greatest less least, and its share of their "
        "middle.",
    ),
    "paths": (_paths, PATHS_CAPTION),
}
