"""Scores of a session or a study against the index, and a study's predictions against its scores."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

import numpy as np
from matplotlib.axes import Axes

from sessions.report.contents import Answers, Experiment
from sessions.report.figures.relation import PATHS_CAPTION, paths_panel
from sessions.report.figures.style import GREEN, GREY, INK, PALE, Panel, Plate, Sheet, look, sheet, svg
from sessions.report.tables.rivals import rival_words
from sessions.report.tables.study_models import study_model
from sessions.report.wording import ShownResponse, correlation, shown_response
from sessions.statistics.findings import DescriptorFindings, StudyFindings
from sessions.statistics.scores import MeanScore

_LONG, _HIGH = 22.0, 6.0  # of the words along the line and across it [points of either axis]
_AWAY = 3.0  # that no dot may come nearer [points]


def _free_place(experiment: Experiment) -> tuple[float, bool] | None:
    """Return where on the line of equal score and index its words may begin, and whether above it; None: nowhere.

    That is where dots and bars lie farthest from them.
    """
    dots = [
        (index - 3.0, score)
        for answers in experiment.answers
        for index, score in zip(experiment.indices, answers.scores, strict=True)
        if score is not None
    ]
    for mean in experiment.scores:
        low, high = (mean.mean if end is None else end for end in (mean.low, mean.high))
        dots += [(mean.index, y) for y in np.linspace(low, high, 9).tolist()]
    along = np.array([(x + y) / 2.0 for x, y in dots])
    across = np.array([y - x for x, y in dots])

    def room(start: float, *, above: bool) -> float:
        along_bar = np.maximum(np.maximum(start - along, along - start - _LONG), 0.0)
        low, high = (1.0, 2.0 * _HIGH) if above else (-2.0 * _HIGH, -1.0)  # y - x grows twice as fast as the way across
        over = np.maximum(np.maximum(low - across, across - high), 0.0) / 2.0
        return float(np.hypot(along_bar, over).min(initial=np.inf))

    places = [(start, above) for start in range(2, 70) for above in (True, False)]
    best = max(places, key=lambda place: room(float(place[0]), above=place[1]))
    return (float(best[0]), best[1]) if room(float(best[0]), above=best[1]) >= _AWAY else None


def score_panel(experiment: Experiment, *, simulated: bool) -> Panel:
    """Return mean score against index, with 95 % t intervals and every subject's answer beside them."""
    drawn = sheet(328, 280)
    (axes,) = drawn.axes
    _draw_identity(axes, _free_place(experiment))
    for answers in experiment.answers:
        own = [(i, score) for i, score in zip(experiment.indices, answers.scores, strict=True) if score is not None]
        places, scores = [index - 3.0 for index, _ in own], [score for _, score in own]
        axes.plot(places, scores, "o", markersize=2, color=GREY, alpha=0.55, markeredgewidth=0)
    for mean in experiment.scores:
        _draw_mean(drawn, axes, mean)
    axes.set_xlim(-9, 106)
    axes.set_ylim(min([-4.0, *(m.low - 2 for m in experiment.scores if m.low is not None)]), 109)
    axes.set_xticks(list(experiment.indices))
    axes.set_yticks([0, 20, 40, 60, 80, 100])
    axes.set_title(experiment.name)
    axes.set_xlabel(f"index of {experiment.descriptor} [–]")
    axes.set_ylabel(f"score of {experiment.descriptor} [0–100]")
    name, title = f"scores-{experiment.name}", f"Scores of {experiment.descriptor} against the stimuli's index"
    header = ("index", "subjects", "mean score", "standard deviation", "95 % interval low", "95 % interval high")
    header += tuple(f"score of {answers.subject}" for answers in experiment.answers)
    by_index = dict(
        zip(experiment.indices, zip(*(one.scores for one in experiment.answers), strict=True), strict=False)
    )
    rows = tuple((m.index, m.n, m.mean, m.sd, m.low, m.high, *by_index.get(m.index, ())) for m in experiment.scores)
    return Panel(name, title, svg(drawn, name, title, simulated=simulated), header, rows)


def _draw_identity(axes: Axes, place: tuple[float, bool] | None) -> None:
    """Draw the line on which score and index are equal, with its words where there is a place for them."""
    axes.plot([0, 100], [0, 100], color=PALE, linewidth=0.8, zorder=0)
    if place is None:
        return
    start, above = place
    off = 1.5 if above else -1.5
    axes.text(
        start - off,
        start + off,
        "score = index",
        color=GREY,
        rotation=45,
        rotation_mode="anchor",
        transform_rotates_text=True,
        va="bottom" if above else "top",
        fontsize=7.5,
    )


def _draw_mean(drawn: Sheet, axes: Axes, mean: MeanScore) -> None:
    text = f"index {mean.index}: mean {mean.mean:.1f}, {mean.n} subjects"
    if mean.low is not None and mean.high is not None:
        text += f", 95 % interval {mean.low:.1f} to {mean.high:.1f}"
        ends = [[mean.mean - mean.low], [mean.high - mean.mean]]
        axes.errorbar(mean.index, mean.mean, yerr=ends, color=INK, linewidth=1.1, capsize=3, capthick=0.8)
    axes.plot(mean.index, mean.mean, "o", markersize=5, color=INK, gid=drawn.note(text))


def study_plates(study: StudyFindings) -> tuple[Plate, ...]:
    """Return the figures a study has numbers for, in their order."""
    simulated, shown = bool(study.simulated), shown_response(study.response)
    with look():
        scores = tuple(score_panel(_experiment(one), simulated=simulated) for one in study.descriptors if one.scores)
        relations = tuple(_relation(one, shown, simulated=simulated) for one in study.descriptors if one.points)
    along = (paths_panel(one.descriptor, one.paths, simulated=simulated) for one in study.descriptors if one.paths)
    paths = tuple(panel for panel in along if panel is not None)
    caption = f"Score against the {shown.label} {RELATION} Model: {study_model(study)}."
    plates = (
        Plate("relation", caption, relations),
        Plate("scores", SCORES, scores),
        Plate("paths", PATHS_CAPTION, paths),
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
    name = one.descriptor
    return Experiment(name, name, "", 0, 0.0, ("", ""), one.indices, one.scores, answers, None, None)


def _relation(one: DescriptorFindings, shown: ShownResponse, *, simulated: bool) -> Panel:
    drawn = sheet(328, 280)
    (axes,) = drawn.axes
    each = len(one.points) <= MOST  # of more points only hovering names the subject
    for subject in dict.fromkeys(point[0] for point in one.points):
        own = sorted((shown.factor * value, score, index) for of, index, value, score in one.points if of == subject)
        axes.plot([x for x, _, _ in own], [y for _, y, _ in own], "-", color=GREY, alpha=0.35, linewidth=0.7)
        for x, y, index in own if each else ():
            words = f"subject {subject}, index {index}: {shown.label} {shown.text(x)}, score {y:.1f}"
            axes.plot(x, y, "o", color=GREY, markersize=2, gid=drawn.note(words))
        if not each:
            dots = [x for x, _, _ in own], [y for _, y, _ in own]
            axes.plot(*dots, "o", color=GREY, markersize=2, gid=drawn.note(f"subject {subject}"))
    means = {mean.index: mean for mean in one.scores}
    for surface in one.surfaces:
        response, mean = surface.response, means.get(surface.index)
        if response is not None and mean is not None:
            x, y = shown.factor * response.mean, mean.mean
            words = f"index {surface.index}: mean {shown.label} {shown.text(x)}, mean score {y:.1f}"
            axes.plot(x, y, "o", color=GREEN, markersize=5, zorder=3, gid=drawn.note(words))
            if response.low is not None and response.high is not None:
                ends = [shown.factor * response.low, shown.factor * response.high]
                axes.plot(ends, [y, y], color=GREEN, linewidth=0.9, zorder=2)
            if mean.low is not None and mean.high is not None:
                axes.plot([x, x], [mean.low, mean.high], color=GREEN, linewidth=0.9, zorder=2)
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
