"""The figures of a report: every picture with its caption and its numbers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from sessions.report.contents import Report, StrokeFinding
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
from sessions.report.figures.relation import PATHS_CAPTION, paths_panel, relation_panel
from sessions.report.figures.scores import score_panel
from sessions.report.figures.style import Panel, Plate, look
from sessions.report.wording import shown_response

__all__ = ["Panel", "Plate", "picture", "plates"]


def plates(report: Report) -> tuple[Plate, ...]:
    """Return the figures that a report has numbers for, in their order."""
    with look():
        drawn = tuple(draw(report) for draw in _PLATES.values())
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
        return next(iter(_PLATES[plate](report).panels), None)


def _course(report: Report) -> Plate:
    caption = (
        "Normal and tangential force over the whole recording, unfiltered; each stretch is drawn by its least and its"
        " greatest value. Grey: the strokes that were found, with their numbers; discarded takes are not searched."
    )
    panels = () if report.course is None else (course_panel(report.course, report.strokes, simulated=report.simulated),)
    return Plate("course", caption, panels)


def _scores(report: Report) -> Plate:
    caption = (
        "Scores against the index its maker gave each stimulus. Large dots: mean over subjects; bars: 95 % interval "
        "of the mean, mean ± t(0.975, n − 1) s / √n with n subjects. Small dots, moved left: each subject's own score"
        " (the mean of its repeats). Grey line: score equal to index."
    )
    panels = tuple(score_panel(e, simulated=report.simulated) for e in report.experiments if e.scores)
    return Plate("scores", caption, panels)


_CAPTIONS = {
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
}


def _of_strokes(name: str, *quantities: StrokeQuantity) -> Callable[[Report], Plate]:
    """Return what draws the plate of that name: a panel for each quantity of the strokes of each experiment."""
    return lambda report: Plate(name, _CAPTIONS[name], _stroke_panels(report, quantities))


def _stroke_panels(report: Report, quantities: Sequence[StrokeQuantity]) -> tuple[Panel, ...]:
    panels = [
        stroke_panel(one, strokes, experiment, simulated=report.simulated)
        for experiment, strokes in _grouped(report)
        for one in quantities
    ]
    return tuple(each for each in panels if each is not None)


def _fingers(report: Report) -> Plate:
    caption = (
        "Strain-energy density (SED) in the deformed finger in its settled state, sliding; lengths are true. Thin "
        "lines: borders of skin and layers; outlined: the ending. Close view: tractions as arrows; which skin slips. "
        f"One scale of colours, which ends below the peaks.{_model(report)}"
    )
    levels = common_levels(report.fields) if report.fields else ()
    pairs = [finger_panels(field, levels, simulated=report.simulated) for field in report.fields]
    return Plate("finger", caption, tuple(panel for pair in pairs for panel in pair))


def _responses(report: Report) -> Plate:
    caption = (
        "Predicted response: SED averaged over the ending while the finger is pressed down for 1 s and then slides. "
        "Above the whole course, below the sliding alone on its own scale, which does not begin at 0. Dashed: "
        f"settled, not computed further.{_model(report)}"
    )
    panels = [
        response_panel([p for p in report.predictions if p.experiment == name], name, simulated=report.simulated)
        for name in dict.fromkeys(p.experiment for p in report.predictions)
    ]
    return Plate("response", caption, tuple(panel for panel in panels if panel is not None))


def _relations(report: Report) -> Plate:
    label = shown_response(report.response).label
    caption = (
        f"Predicted {label} against mean score, with the stimulus's index. Circles: scores of whoever made the "
        f"strokes. Across: 95 % t interval. Upright: error of the mesh. Line: least squares. r: Pearson's, Fisher's z "
        f"interval. Range: greatest less least, and its share of their middle.{_model(report)}"
    )
    panels = [
        relation_panel(e, [p for p in report.predictions if p.experiment == e.name], simulated=report.simulated)
        for e in report.experiments
    ]
    return Plate("relation", caption, tuple(panel for panel in panels if panel is not None))


def _paths(report: Report) -> Plate:
    panels = [paths_panel(e.name, e.paths, simulated=report.simulated) for e in report.experiments if e.paths]
    return Plate("paths", PATHS_CAPTION, tuple(panel for panel in panels if panel is not None))


def _model(report: Report) -> str:
    return f" Model: {report.model}." if report.model else ""


def _grouped(report: Report) -> list[tuple[str, Sequence[StrokeFinding]]]:
    """Return the strokes by experiment, in the order of the experiments; those of none come last."""
    names = [experiment.name for experiment in report.experiments]
    groups = [(name, [s for s in report.strokes if s.experiment == name]) for name in names]
    rest = [s for s in report.strokes if s.experiment not in names]
    return [group for group in [*groups, ("", rest)] if group[1]]


_PLATES: Mapping[str, Callable[[Report], Plate]] = {
    "course": _course,
    "scores": _scores,
    "friction": _of_strokes("friction", MU),
    "speed": _of_strokes("speed", SPEED),
    "forces": _of_strokes("forces", NORMAL, TANGENTIAL),
    "finger": _fingers,
    "response": _responses,
    "relation": _relations,
    "paths": _paths,
}
