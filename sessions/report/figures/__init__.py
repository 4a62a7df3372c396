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
from sessions.report.figures.style import Panel, Plate, look
from sessions.report.wording import shown_response

__all__ = ["Panel", "Plate", "picture", "plates"]

Panels = Iterable[Panel | None]


def plates(report: Report) -> tuple[Plate, ...]:
    """Return the figures that a report has numbers for, in their order."""
    with look():
        drawn = tuple(_plate(report, name) for name in _PANELS)
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
    with look():
        return next(iter(_plate(report, plate).panels), None)


def _plate(report: Report, name: str) -> Plate:
    model = f" Model: {report.model}." if report.model and name in _OF_THE_MODEL else ""
    caption = _CAPTIONS[name].format(response=shown_response(report.response).label)
    return Plate(name, caption + model, tuple(panel for panel in _PANELS[name](report) if panel is not None))


def _course(report: Report) -> Panels:
    return () if report.course is None else (course_panel(report.course, report.strokes, simulated=report.simulated),)


def _scores(report: Report) -> Panels:
    return (score_panel(e, simulated=report.simulated) for e in report.experiments if e.scores)


def _of_strokes(*quantities: StrokeQuantity) -> Callable[[Report], Panels]:
    """Return what draws a panel for each quantity of the strokes of each experiment; those of none come last."""

    def panels(report: Report) -> Panels:
        names = [experiment.name for experiment in report.experiments]
        groups = [(name, [s for s in report.strokes if s.experiment == name]) for name in names]
        groups.append(("", [s for s in report.strokes if s.experiment not in names]))
        for name, strokes in groups:
            for one in quantities if strokes else ():
                yield stroke_panel(one, strokes, name, simulated=report.simulated)

    return panels


def _fingers(report: Report) -> Panels:
    levels = common_levels(report.fields) if report.fields else ()
    for field in report.fields:
        yield from finger_panels(field, levels, simulated=report.simulated)


def _responses(report: Report) -> Panels:
    for name in dict.fromkeys(p.experiment for p in report.predictions):
        own = [p for p in report.predictions if p.experiment == name]
        yield response_panel(own, name, simulated=report.simulated)


def _relations(report: Report) -> Panels:
    for one in report.experiments:
        own = [p for p in report.predictions if p.experiment == one.name]
        yield relation_panel(one, own, simulated=report.simulated)


def _paths(report: Report) -> Panels:
    label = shown_response(report.response).label
    return (paths_panel(e.name, e.paths, label, simulated=report.simulated) for e in report.experiments if e.paths)


_PANELS: Mapping[str, Callable[[Report], Panels]] = {
    "course": _course,
    "scores": _scores,
    "friction": _of_strokes(MU),
    "speed": _of_strokes(SPEED),
    "forces": _of_strokes(NORMAL, TANGENTIAL),
    "finger": _fingers,
    "response": _responses,
    "relation": _relations,
    "paths": _paths,
}
_OF_THE_MODEL = {"finger", "response", "relation"}
_CAPTIONS: Mapping[str, str] = {
    "course": (
        "Normal and tangential force over the whole recording, unfiltered; each stretch is drawn by its least and its"
        " greatest value. Curves break where readings are missing. Grey: the strokes that were found, with their"
        " numbers; discarded takes are not searched."
    ),
    "scores": SCORES_CAPTION,
    "friction": (
        "Ratio of tangential to normal force from contact onset on. Thick: the steady window, over which the dynamic "
        "coefficient is averaged. Dashed: a stroke of which no coefficient is given, the tables say why. The ratio is "
        "left out where the normal force is too small to divide by."
    ),
    "speed": (
        "Speed of the centre of pressure along the stroke from contact onset on. Thick: the steady window. It moves "
        "by rolling and by skin shear as well as by sliding, most of all at onset; the tables give its mean slope "
        "over the steady window. Strokes whose speed was refused are left out."
    ),
    "forces": (
        "Normal force N and tangential force T of the strokes of each series, laid over each other from contact onset "
        "on, zero taken off and filtered as for the analysis. Thick: the steady window. Dashed: a stroke without a "
        "steady window."
    ),
    "finger": (
        "Strain-energy density (SED) in the deformed finger in its settled state, sliding; lengths are true. Thin "
        "lines: borders of skin and layers; outlined: the ending. Close view: tractions as arrows; which skin slips. "
        "One scale of colours, which ends below the peaks."
    ),
    "response": (
        "Predicted response: SED averaged over the ending while the finger is pressed down for 1 s and then slides. "
        "Above the whole course, below the sliding alone on its own scale, which does not begin at 0. Dashed: "
        "settled, not computed further."
    ),
    "relation": (
        "Predicted {response} against mean score, with the stimulus's index. Circles: scores of whoever made the "
        "strokes. Across: 95 % t interval. Upright: thick, error of the mesh; thin, 95 % interval of friction. "
        "Line: least squares. r: Pearson's, Fisher's z interval. Range: greatest less least, and its share of their "
        "middle."
    ),
    "paths": PATHS_CAPTION,
}
