"""Scores against the index, predicted responses against scores and along many paths, and two sessions compared."""

# matplotlib does not type the keyword arguments it passes on.

import math
from collections.abc import Sequence
from dataclasses import astuple
from operator import attrgetter
from typing import Any

import numpy as np

from sessions.prediction.stored import Ends
from sessions.report.contents import Experiment, PredictionFinding
from sessions.report.figures.style import (
    GREEN,
    GREY,
    INK,
    PALE,
    PURPLE,
    VERMILLION,
    Panel,
    Plate,
    Sheet,
    look,
    plate,
    sheet,
)
from sessions.report.tables.rivals import rival_title
from sessions.report.tables.study_models import study_model
from sessions.report.wording import ShownResponse, caption, correlation, plural, shown_response, spread_share
from sessions.statistics.correlations import Relation
from sessions.statistics.findings import DescriptorFindings, StudyFindings
from sessions.statistics.multiverse import CHOICE_LABELS, PathFinding, by_choice, correlations
from sessions.statistics.scores import MeanScore, by_key

_TICKS = [0, 20, 40, 60, 80, 100]  # of a scale of scores


def score_panel(findings: Experiment | DescriptorFindings) -> Panel | None:
    """Return mean score against index, with 95 % t intervals and all subjects' answers; None without scores."""
    if not findings.scores:
        return None
    name = findings.name if isinstance(findings, Experiment) else findings.descriptor
    picture = sheet(328, 280)
    (axes,) = picture.axes
    axes.plot([0, 100], [0, 100], color=PALE, linewidth=0.8, zorder=0)
    positions = [index - 3.0 for index in findings.indices]
    for scores in findings.answers.values():
        subject_scores = [math.nan if score is None else score for score in scores]
        axes.plot(positions, subject_scores, "o", ms=2, color=GREY, alpha=0.55, mew=0)
    for mean in findings.scores:
        text = f"index {mean.index}: mean {mean.mean:.1f}, {plural(mean.n, 'subject')}"
        if mean.low is not None and mean.high is not None:
            text += f", 95 % interval {mean.low:.1f} to {mean.high:.1f}"
            errors = [[mean.mean - mean.low], [mean.high - mean.mean]]
            axes.errorbar(mean.index, mean.mean, yerr=errors, color=INK, linewidth=1.1, capsize=3, capthick=0.8)
        axes.plot(mean.index, mean.mean, "o", markersize=5, color=INK, gid=picture.note(text))
    low = min([-4.0, *(m.low - 2 for m in findings.scores if m.low is not None)])
    axes.set(xlim=(-9, 106), ylim=(low, 109), xticks=findings.indices, yticks=_TICKS, title=name)
    axes.set(xlabel=f"index of {findings.descriptor} [–]", ylabel=f"score of {findings.descriptor} [0–100]")
    title = f"Scores of {findings.descriptor} against the stimuli's index"
    moments = ("mean score", "standard deviation", "95 % interval low", "95 % interval high")
    header = ("index", "subjects", *_in_points(*moments, *(f"score of {subject}" for subject in findings.answers)))
    by_index = dict(zip(findings.indices, zip(*findings.answers.values(), strict=True), strict=False))
    rows = tuple((m.index, m.n, m.mean, m.sd, m.low, m.high, *by_index.get(m.index, ())) for m in findings.scores)
    return picture.panel(f"scores-{name}", title, header, rows)


def _in_points(*names: str) -> tuple[str, ...]:
    """Return the headings of columns of scores, with their unit."""
    return tuple(f"{name} [points, 0 to 100]" for name in names)


def study_plates(study: StudyFindings) -> tuple[Plate, ...]:
    """Return the figures of a study that have numbers, in order."""
    quantity = shown_response(study.response)
    caption_text = caption("figure-study-relation", label=quantity.label, model=study_model(study))
    relations = (_relation(findings, quantity) for findings in study.descriptors if findings.points)
    paths = (paths_panel(findings.descriptor, findings.paths, quantity.label) for findings in study.descriptors)
    with look(simulated=bool(study.simulated)):
        plates = (
            plate("relation", caption_text, relations),
            plate("scores", caption("figure-scores"), map(score_panel, study.descriptors)),
            plate("paths", caption("figure-paths"), paths),
        )
    return tuple(plate for plate in plates if plate.panels)


_MOST_HOVERING = 400  # most points with their own values on hovering


def _relation(findings: DescriptorFindings, quantity: ShownResponse) -> Panel:
    picture = sheet(328, 280)
    (axes,) = picture.axes
    separate = len(findings.points) <= _MOST_HOVERING  # with more points hovering shows only the subject
    by_line = by_key(
        ((subject, block), (quantity.factor * value, y, index))
        for (subject, index, value, y), block in zip(findings.points, findings.point_blocks, strict=True)
    )
    for (subject, _), points in by_line.items():
        dots = [x for x, _, _ in sorted(points)], [y for _, y, _ in sorted(points)]
        axes.plot(*dots, "-", color=GREY, alpha=0.35, linewidth=0.7)
        for x, y, index in sorted(points) if separate else ():
            text = f"subject {subject}, index {index}: {quantity.label} {quantity.text(x)}, score {y:.1f}"
            axes.plot(x, y, "o", color=GREY, markersize=2, gid=picture.note(text))
        if not separate:
            axes.plot(*dots, "o", color=GREY, markersize=2, gid=picture.note(f"subject {subject}"))
    means = {mean.index: mean for mean in findings.scores}
    for surface in findings.surfaces:
        response, mean = surface.response, means.get(surface.index)
        if response is not None and mean is not None:
            x, y = quantity.factor * response.mean, mean.mean
            text = f"index {surface.index}: mean {quantity.label} {quantity.text(x)}, mean score {y:.1f}"
            axes.plot(x, y, "o", color=GREEN, markersize=5, zorder=3, gid=picture.note(text))
            if response.low is not None and response.high is not None:
                limits = [quantity.factor * response.low, quantity.factor * response.high]
                axes.plot(limits, [y, y], color=GREEN, linewidth=0.9, zorder=2)
            if mean.low is not None and mean.high is not None:
                axes.plot([x, x], [mean.low, mean.high], color=GREEN, linewidth=0.9, zorder=2)
            axes.annotate(str(surface.index), (x, y), xytext=(5, 4), textcoords="offset points", zorder=4)
    axes.set(ylim=(-4, 109), yticks=_TICKS)
    axes.set(xlabel=f"predicted {quantity.label} [{quantity.unit}]", ylabel=f"score of {findings.descriptor} [0–100]")
    single = findings.single_subject
    level = f"over the trials of {single}" if single else "within subjects"
    within = "" if findings.repeated is None else f": {level} r = {correlation(findings.repeated.r)}"
    axes.set_title(f"{findings.descriptor}{within}\n{rival_title(findings.rivals)}".strip())
    title = f"Score of {findings.descriptor} against predicted {quantity.label}"
    header = ("subject", "index", f"{quantity.label} [{quantity.kept_unit}]", *_in_points("score"))
    return picture.panel(f"study-relation-{findings.descriptor}", title, header, findings.points)


def relation_panel(experiment: Experiment, predictions: Sequence[PredictionFinding]) -> Panel | None:
    """Return an experiment's response against mean score with both errors, the fitted line, r, its interval and n."""
    means = {mean.index: mean for mean in experiment.scores}
    quantity = shown_response(experiment.response)
    numbers_of = [(p, quantity.numbers(p)) for p in predictions]
    points = [(means[p.index], n, quantity.interval(p)) for p, n in numbers_of if n is not None and p.index in means]
    if len(points) < 2:
        return None
    picture = sheet(328, 300, widths=(1.0, 0.18))
    axes, from_zero = picture.axes
    relation = experiment.score_relation
    rising = relation is not None and (relation.slope or 0.0) > 0.0
    values = [quantity.factor * numbers[0] for _, numbers, _ in points]
    for point, value in zip(points, values, strict=True):
        mean = point[0]
        above = relation is None or value >= quantity.factor * _on_line(relation, mean.mean)
        _draw_point(picture, point, quantity, above=above, rising=rising)
        own_score = experiment.own_scores.get(mean.index)
        if own_score is not None:
            text = f"index {mean.index}: own score {own_score:.1f}, {quantity.label} {quantity.text(value)}"
            axes.plot(own_score, value, "o", color=GREEN, mfc="none", ms=4, gid=picture.note(text))
    if relation is not None:
        limits = [min(m.mean for m, *_ in points), max(m.mean for m, *_ in points)]
        heights = [quantity.factor * _on_line(relation, x) for x in limits]
        axes.plot(limits, heights, color=GREEN, linewidth=1.0, zorder=1)
    low, high = min(values), max(values)
    room = 0.18 * (high - low or abs(high))
    limits = [quantity.factor * limit for *_, friction in points for limit in friction or ()]
    lowest, highest = min([low - 0.75 * room, *limits]) - room / 4, max([high + 0.75 * room, *limits]) + room / 4
    axes.set(xlim=(-11, 106), ylim=(lowest, highest), xticks=_TICKS)
    score = "mean score" if any(m.n > 1 for m, *_ in points) else "score"
    axes.set_xlabel(f"{score} of {experiment.name} [0–100]")
    axes.set_ylabel(f"predicted {quantity.label} [{quantity.unit}]")
    title = f"range of {quantity.label}: {quantity.text(high - low)} ({spread_share(low, high)})"
    axes.set_title(f"{relation_title(experiment)}\n{title}\n{rival_title(experiment.rivals)}".strip())
    from_zero.plot([0.0] * len(values), values, "_", color=GREEN, markersize=12, markeredgewidth=1.2)
    from_zero.set(xlim=(-1, 1), ylim=(min(0.0, 1.15 * low), max(0.0, 1.15 * high)), xticks=[])
    from_zero.set_xlabel(f"from 0\n[{quantity.unit}]")
    from_zero.spines["bottom"].set_visible(False)
    name, title = f"relation-{experiment.name}", f"Predicted {quantity.label} against score of {experiment.name}"
    header = ("index", *_in_points("mean score", "95 % interval low", "95 % interval high", "own score"))
    header += (f"{quantity.label} [{quantity.kept_unit}]", f"error estimate of {quantity.label} [-]")
    interval = f"95 % interval of {quantity.label} by friction"
    header += (f"{interval}, low [{quantity.kept_unit}]", f"{interval}, high [{quantity.kept_unit}]")
    relative = [None if error is None or not value else error / abs(value) for _, (value, error), _ in points]
    rows = (
        (m.index, m.mean, m.low, m.high, experiment.own_scores.get(m.index), n[0], error, *(friction or (None, None)))
        for (m, n, friction), error in zip(points, relative, strict=True)
    )
    return picture.panel(name, title, header, rows)


def relation_title(experiment: Experiment) -> str:
    """Return a short text: r with its interval and n, or the reason for its absence."""
    relation = experiment.score_relation
    if relation is None or relation.pearson is None:
        return "no r: " + (relation.reason if relation is not None and relation.reason else "no scores")
    text = f"r = {correlation(relation.pearson)}"
    if relation.low is not None and relation.high is not None:
        text += f" ({correlation(relation.low)} to {correlation(relation.high)})"
    return text + f", n = {relation.n}"


def _on_line(relation: Relation, score: float) -> float:
    """Return the response of the least-squares line at a score; nan without a line."""
    if relation.slope is None or relation.intercept is None:
        return math.nan
    return relation.intercept + relation.slope * score


Point = tuple[MeanScore, tuple[float, float | None], Ends | None]  # score, number and its error, interval by friction


def _draw_point(picture: Sheet, point: Point, quantity: ShownResponse, *, above: bool, rising: bool) -> None:
    """Draw one stimulus with its errors and its index on the side away from the line."""
    axes, (mean, (number, error), friction) = picture.axes[0], point
    value = quantity.factor * number
    text = f"index {mean.index}: score {mean.mean:.1f}, {quantity.label} {quantity.text(value)}"
    if mean.low is not None and mean.high is not None:
        axes.plot([mean.low, mean.high], [value, value], color=GREY, linewidth=0.8, zorder=2)
    mesh = [] if error is None else [(number - error, number + error, 2.4)]
    for low, high, width in [*mesh, *([] if friction is None else [(*friction, 0.8)])]:
        limits = [quantity.factor * low, quantity.factor * high]
        axes.plot([mean.mean] * 2, limits, color=GREY, linewidth=width, zorder=2)
    axes.plot(mean.mean, value, "o", color=GREEN, markersize=5, zorder=3, gid=picture.note(text))
    on_right = above != rising  # away from the line
    offset = (5 if on_right else -5, 4 if above else -4)
    sides: dict[str, Any] = {"ha": "left" if on_right else "right", "va": "bottom" if above else "top"}
    axes.annotate(str(mean.index), (mean.mean, value), xytext=offset, textcoords="offset points", zorder=4, **sides)


_BINS = 24


def paths_panel(descriptor: str, findings: Sequence[PathFinding], label: str) -> Panel | None:
    """Return the distribution of the correlation of the quantity `label` over all paths; None without any."""
    values = correlations(findings)
    numbers = [value for value in values if value is not None]
    if not numbers:
        return None
    choices = by_choice(findings)
    usual = next((r for finding, r in zip(findings, values, strict=True) if finding.usual and r is not None), None)
    picture = sheet(328, 190 + 13 * len(choices), (1.0, 0.115 * len(choices)))
    above, below = picture.axes
    low, high = _ends(numbers)
    counts, edges = np.histogram(numbers, _BINS, (low, high))
    above.bar(edges[:-1], counts, np.diff(edges), align="edge", color=PALE, edgecolor=GREY, linewidth=0.6)
    above.set_ylabel("paths [number]")
    above.set_title(f"{descriptor}: {len(numbers)} paths")
    for y, (choice, name, spread, is_usual) in enumerate(choices):
        if spread is None:
            below.text(low, y, "none", fontsize=7, va="center", color=GREY)
        else:
            text = f"{CHOICE_LABELS[choice]} {name}: median r {correlation(spread.median)} of {spread.correlated} paths"
            below.plot([spread.least, spread.greatest], [y, y], color=GREY, linewidth=1.1)
            below.plot(spread.median, y, "|", color=INK, markersize=9, markeredgewidth=1.4, gid=picture.note(text))
        if is_usual:
            below.plot(low - 0.02 * (high - low), y, "D", color=INK, markersize=2.6, clip_on=False)
    below.set_yticks(range(len(choices)), [name for _, name, _, _ in choices], fontsize=7)
    below.set_ylim(len(choices) - 0.4, -0.6)
    for row in range(1, len(choices)):
        if choices[row][0] != choices[row - 1][0]:
            below.axhline(row - 0.5, color=PALE, linewidth=0.6)
    below.set_xlabel(f"correlation of {label} with score [–]")
    for axes in picture.axes:
        axes.set_xlim(low - 0.04 * (high - low), high)
        if usual is not None:
            axes.axvline(usual, color=INK, linewidth=0.9, linestyle=(0, (3, 2)), zorder=0)
    header = (*CHOICE_LABELS, "usual", "surfaces", "trials", "r of means", "r within subjects", "low", "high")
    numbers_of = attrgetter("surfaces", "trials", "r", "within", "low", "high")
    rows = ((*map(str, astuple(finding.path)), int(finding.usual), *numbers_of(finding)) for finding in findings)
    title = f"Correlation of {descriptor} along many paths of the analysis"
    return picture.panel(f"paths-{descriptor}", title, header, rows)


def _ends(values: Sequence[float]) -> tuple[float, float]:
    """Return round ends of an axis that contains all values and shows their differences, within -1 to 1.

    >>> _ends([0.93, 0.95])
    (0.9, 1.0)
    >>> _ends([1.0])
    (0.9, 1.0)
    """
    low, high = min(0.9, np.floor(10.0 * min(values)) / 10.0), np.ceil(10.0 * max(values)) / 10.0
    return max(-1.0, float(low)), min(1.0, float(high if high > low else low + 0.1))


_COLOURS = (PURPLE, GREEN, VERMILLION)
Number = float | None


def comparison_panel(
    names: Sequence[str], sessions: tuple[str, str], rows: Sequence[tuple[str, Sequence[tuple[Number, Number]]]]
) -> Panel | None:
    """Return the picture of `rows`: stimuli with both sessions' values of each of `names`; None without a pair."""
    if not any(None not in pair for _, pairs in rows for pair in pairs):
        return None
    picture = sheet(560, 150 * len(names) + 60, tuple(1.0 for _ in names), share_x=True)
    for row, (name, axes) in enumerate(zip(names, picture.axes, strict=True)):
        markers = ("o", "white"), ("s", _COLOURS[row % len(_COLOURS)])
        for column, (stimulus, pairs) in enumerate(rows):
            if len(ends := [value for value in pairs[row] if value is not None]) == len(sessions):
                axes.plot([column, column], ends, color=GREY, linewidth=1.0)
            for value, session, (marker, face) in zip(pairs[row], sessions, markers, strict=True):
                if value is not None:
                    note = picture.note(f"{stimulus}, {session}: {name} {value:.4g}")
                    axes.plot([column], [value], marker, ms=5.0, mfc=face, mec=INK, mew=0.7, gid=note)
        axes.set_ylabel(name)
        axes.tick_params(labelbottom=axes is picture.axes[-1])
    picture.axes[0].set_title(f"circle: {sessions[0]}; filled square: {sessions[1]}")
    lowest = picture.axes[-1]
    lowest.set_xticks(range(len(rows)), [stimulus for stimulus, _ in rows], rotation=60, ha="right")
    lowest.set_xlim(-0.6, len(rows) - 0.4)
    header = ("stimulus", *(f"{name} {suffix}" for name in names for suffix in (*sessions, "difference")))
    table = (
        (stimulus, *(cell for a, b in pairs for cell in (a, b, None if a is None or b is None else b - a)))
        for stimulus, pairs in rows
    )
    return picture.panel("compared", f"{sessions[0]} and {sessions[1]} compared", header, table)
