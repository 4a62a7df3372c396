"""Prediction against score: every stimulus, the line, and how small the range of the predictions is."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

import math
from collections.abc import Sequence

from sessions.report.contents import Experiment, Numbers, PredictionFinding
from sessions.report.figures.style import GREEN, GREY, Panel, Sheet, sheet, svg
from sessions.report.tables.rivals import rival_words
from sessions.report.wording import ShownResponse, correlation, shown_response, spread_share
from sessions.statistics.scores import MeanScore, Relation


def relation_panel(
    experiment: Experiment, predictions: Sequence[PredictionFinding], *, simulated: bool
) -> Panel | None:
    """Return the experiment's response against mean score with both errors, their line, r, its interval and n."""
    means = {mean.index: mean for mean in experiment.scores}
    shown = shown_response(experiment.response)
    pairs = [(p, shown.of(p)) for p in predictions]
    points = [(means[p.index], numbers) for p, numbers in pairs if numbers is not None and p.index in means]
    if len(points) < 2:
        return None
    figure_sheet = _two_columns()
    axes, from_zero = figure_sheet.axes
    related = experiment.score_relation
    rising = related is not None and (related.slope or 0.0) > 0.0
    for mean, numbers in points:
        expected = shown.factor * (numbers[0] if related is None else _on_line(related, mean.mean))
        _point(figure_sheet, mean, numbers, shown, above=shown.factor * numbers[0] >= expected, rising=rising)
        own = experiment.own_scores.get(mean.index)
        if own is not None:
            text = f"index {mean.index}: own score {own:.1f}, {shown.label} {shown.text(shown.factor * numbers[0])}"
            axes.plot(own, shown.factor * numbers[0], "o", color=GREEN, mfc="none", ms=4, gid=figure_sheet.note(text))
    if related is not None:
        ends = [min(m.mean for m, _ in points), max(m.mean for m, _ in points)]
        axes.plot(ends, [shown.factor * _on_line(related, x) for x in ends], color=GREEN, linewidth=1.0, zorder=1)
    values = [shown.factor * numbers[0] for _, numbers in points]
    low, high = min(values), max(values)
    room = 0.18 * (high - low or abs(high))
    axes.set_ylim(low - room, high + room)
    axes.set_xlim(-6, 106)
    axes.set_xticks([0, 20, 40, 60, 80, 100])
    axes.set_xlabel(f"mean score of {experiment.descriptor} [0–100]")
    axes.set_ylabel(f"predicted {shown.label} [{shown.unit}]")
    title = (
        f"{relation_words(experiment)}\nrange of {shown.label}: {shown.text(high - low)} ({spread_share(low, high)})"
    )
    axes.set_title(f"{title}\n{rival_words(experiment.rivals)}".strip())
    from_zero.plot([0.0] * len(values), values, "_", color=GREEN, markersize=12, markeredgewidth=1.2)
    from_zero.set_ylim(min(0.0, 1.15 * low), max(0.0, 1.15 * high))
    from_zero.set_xlim(-1, 1)
    from_zero.set_xticks([])
    from_zero.spines["bottom"].set_visible(False)
    from_zero.set_xlabel("from 0")
    name, title = f"relation-{experiment.name}", f"Predicted {shown.label} against score of {experiment.descriptor}"
    header = (
        "index",
        "mean score",
        "95 % interval low",
        "95 % interval high",
        "own score",
        f"{shown.label} [{shown.kept_unit}]",
        f"error estimate of {shown.label} [-]",
    )
    rows = tuple(
        (m.index, m.mean, m.low, m.high, experiment.own_scores.get(m.index), numbers[0], _relative(numbers))
        for m, numbers in points
    )
    return Panel(name, title, svg(figure_sheet, name, title, simulated=simulated), header, rows)


def _relative(numbers: Numbers) -> float | None:
    """Return the error of a response by its size; None where there is none."""
    return numbers[1] / abs(numbers[0]) if len(numbers) > 1 and numbers[0] else None


def relation_words(experiment: Experiment) -> str:
    """Return r with its interval and n, or why there is none, in few words."""
    related = experiment.score_relation
    if related is None or related.pearson is None:
        return "no r: " + (related.reason if related is not None and related.reason else "no scores")
    words = f"r = {correlation(related.pearson)}"
    if related.low is not None and related.high is not None:
        words += f" ({correlation(related.low)} to {correlation(related.high)})"
    return words + f", n = {related.n}"


def _two_columns() -> Sheet:
    drawn = sheet(328, 300)
    (axes,) = drawn.axes
    axes.remove()
    grid = drawn.figure.add_gridspec(1, 2, width_ratios=(1.0, 0.18))
    return Sheet(
        drawn.figure, (drawn.figure.add_subplot(grid[0, 0]), drawn.figure.add_subplot(grid[0, 1])), drawn.hover
    )


def _on_line(related: Relation, score: float) -> float:
    """Return the response of the least-squares line at a score; nan where there is no line."""
    if related.slope is None or related.intercept is None:
        return math.nan
    return related.intercept + related.slope * score


def _point(drawn: Sheet, mean: MeanScore, numbers: Numbers, shown: ShownResponse, *, above: bool, rising: bool) -> None:
    """Draw one stimulus with both errors, its index on the side away from the line."""
    axes = drawn.axes[0]
    value = shown.factor * numbers[0]
    text = f"index {mean.index}: score {mean.mean:.1f}, {shown.label} {shown.text(value)}"
    if mean.low is not None and mean.high is not None:
        axes.plot([mean.low, mean.high], [value, value], color=GREY, linewidth=0.8, zorder=2)
    for error in (shown.factor * one for one in numbers[1:]):
        axes.plot([mean.mean] * 2, [value - error, value + error], color=GREY, linewidth=0.8, zorder=2)
    axes.plot(mean.mean, value, "o", color=GREEN, markersize=5, zorder=3, gid=drawn.note(text))
    right = above != rising  # away from the line
    axes.annotate(
        str(mean.index),
        (mean.mean, value),
        xytext=(5 if right else -5, 4 if above else -4),
        textcoords="offset points",
        ha="left" if right else "right",
        va="bottom" if above else "top",
        zorder=4,
    )
