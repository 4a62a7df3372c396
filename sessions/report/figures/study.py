"""Figures of a study: scores of every surface, and predictions of each subject's own strokes against its scores."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

from sessions.report import Answers, Experiment
from sessions.report.figures.multiverse import CAPTION, paths_panel
from sessions.report.figures.scores import score_panel
from sessions.report.figures.style import GREEN, GREY, Panel, Plate, look, sheet, svg
from sessions.report.predictions import model_in_short
from sessions.report.responses import ShownResponse, shown_response
from sessions.report.tables.rivals import rival_words
from sessions.report.wording import correlation
from sessions.statistics.pooling.findings import DescriptorFindings, StudyFindings


def study_plates(study: StudyFindings) -> tuple[Plate, ...]:
    """Return the figures a study has numbers for, in their order."""
    simulated, shown = bool(study.simulated), shown_response(study.response)
    with look():
        scores = tuple(score_panel(_experiment(one), simulated=simulated) for one in study.descriptors if one.scores)
        relations = tuple(_relation(one, shown, simulated=simulated) for one in study.descriptors if one.points)
    along = (paths_panel(one.descriptor, one.paths, simulated=simulated) for one in study.descriptors if one.paths)
    paths = tuple(panel for panel in along if panel is not None)
    plates = (
        Plate(
            "relation",
            f"Score against the {shown.label} {RELATION} Model: "
            f"{model_in_short(study.options.prediction, study.options.area)}.",
            relations,
        ),
        Plate("scores", SCORES, scores),
        Plate("paths", CAPTION, paths),
    )
    return tuple(plate for plate in plates if plate.panels)


SCORES = (
    "Scores against the index its maker gave each surface. Large dots: mean over subjects; bars: 95 % interval of the "
    "mean, mean ± t(0.975, n − 1) s / √n with n subjects. Small dots, moved left: each subject's own score. Grey line: "
    "score equal to index."
)
RELATION = (
    "predicted from the same subject's own stroke. Small dots and thin lines: each subject; "
    "large dots: means over subjects with the surface's index, bars their 95 % t intervals."
)


MOST = 400  # points that tell their values each on their own


def _experiment(one: DescriptorFindings) -> Experiment:
    """Return the scores of a descriptor as a session's figure takes them."""
    answers = tuple(Answers(subject, scores) for subject, scores in one.answers.items())
    return Experiment(
        one.descriptor, one.descriptor, "", 0, 0.0, ("", ""), one.indices, one.scores, answers, None, None
    )


def _relation(one: DescriptorFindings, shown: ShownResponse, *, simulated: bool) -> Panel:
    drawn = sheet(328, 280)
    (axes,) = drawn.axes
    each = len(one.points) <= MOST  # of more points hovering tells the subject alone
    for subject in dict.fromkeys(point[0] for point in one.points):
        own = sorted((shown.factor * value, score, index) for of, index, value, score in one.points if of == subject)
        axes.plot([x for x, _, _ in own], [y for _, y, _ in own], "-", color=GREY, alpha=0.35, linewidth=0.7)
        for x, y, index in own if each else ():
            words = f"subject {subject}, index {index}: {shown.label} {shown.text(x)}, score {y:.1f}"
            axes.plot(x, y, "o", color=GREY, markersize=2, gid=drawn.note(words))
        if not each:
            dots = [x for x, _, _ in own], [y for _, y, _ in own]
            axes.plot(*dots, "o", color=GREY, markersize=2, gid=drawn.note(f"subject {subject}"))
    means = {mean.index: mean.mean for mean in one.scores}
    bars = {mean.index: (mean.low, mean.high) for mean in one.scores}
    for surface in one.surfaces:
        response = surface.response
        if response is not None and surface.index in means:
            x, y = shown.factor * response.mean, means[surface.index]
            words = f"index {surface.index}: mean {shown.label} {shown.text(x)}, mean score {y:.1f}"
            axes.plot(x, y, "o", color=GREEN, markersize=5, zorder=3, gid=drawn.note(words))
            low, high = bars[surface.index]
            if response.low is not None and response.high is not None:
                ends = [shown.factor * response.low, shown.factor * response.high]
                axes.plot(ends, [y, y], color=GREEN, linewidth=0.9, zorder=2)
            if low is not None and high is not None:
                axes.plot([x, x], [low, high], color=GREEN, linewidth=0.9, zorder=2)
            axes.annotate(str(surface.index), (x, y), xytext=(5, 4), textcoords="offset points", zorder=4)
    axes.set_ylim(-4, 109)
    axes.set_yticks([0, 20, 40, 60, 80, 100])
    axes.set_xlabel(f"predicted {shown.label} [{shown.unit}]")
    axes.set_ylabel(f"score of {one.descriptor} [0–100]")
    within = "" if one.repeated is None else f": within subjects r = {correlation(one.repeated.r)}"
    axes.set_title(f"{one.descriptor}{within}\n{rival_words(one.rivals)}".strip())
    name, title = f"study-relation-{one.descriptor}", f"Score of {one.descriptor} against predicted {shown.label}"
    header = ("subject", "index", f"{shown.label} [{shown.kept_unit}]", "score")
    return Panel(name, title, svg(drawn, name, title, simulated=simulated), header, one.points)
