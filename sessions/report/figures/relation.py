"""Predicted response against mean score, its correlation along many paths, and two sessions compared."""

import math
from collections.abc import Sequence
from dataclasses import astuple, replace
from operator import attrgetter

import numpy as np

from sessions.report.contents import Experiment, Numbers, PredictionFinding
from sessions.report.figures.style import GREEN, GREY, INK, PALE, PURPLE, VERMILLION, Panel, Sheet, look, sheet, svg
from sessions.report.tables.rivals import rival_words
from sessions.report.wording import ShownResponse, correlation, shown_response, spread_share
from sessions.statistics.correlations import Relation
from sessions.statistics.multiverse import CHOICE_LABELS, CHOICES, PathFinding, by_choice, correlations
from sessions.statistics.scores import MeanScore

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.


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
    relative = [n[1] / abs(n[0]) if len(n) > 1 and n[0] else None for _, n in points]
    rows = tuple(
        (m.index, m.mean, m.low, m.high, experiment.own_scores.get(m.index), numbers[0], error)
        for (m, numbers), error in zip(points, relative, strict=True)
    )
    return Panel(name, title, svg(figure_sheet, name, title, simulated=simulated), header, rows)


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
    drawn.axes[0].remove()
    grid = drawn.figure.add_gridspec(1, 2, width_ratios=(1.0, 0.18))
    return replace(drawn, axes=tuple(drawn.figure.add_subplot(grid[0, column]) for column in (0, 1)))


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


PATHS_CAPTION = (
    "Correlation of the predicted response with scores along every path of the analysis. Above: how many paths come "
    "to which correlation; dashed: the usual path. Below: what each choice does, all others varied: line from the "
    "least to the greatest, mark at the median, filled diamond at the usual choice. Medians that lie apart say that a "
    "choice matters."
)
_BINS = 24


def paths_panel(descriptor: str, findings: Sequence[PathFinding], *, simulated: bool) -> Panel | None:
    """Return the distribution of the correlation over all paths; None where no path has one."""
    values = correlations(findings)
    numbers = [value for value in values if value is not None]
    if not numbers:
        return None
    choices = by_choice(findings)
    usual = next((r for one, r in zip(findings, values, strict=True) if one.usual and r is not None), None)
    with look():
        drawn = sheet(328, 190 + 13 * len(choices), (1.0, 0.115 * len(choices)))
        above, below = drawn.axes
        low, high = _ends(numbers)
        counts, edges = np.histogram(numbers, _BINS, (low, high))
        above.bar(edges[:-1], counts, np.diff(edges), align="edge", color=PALE, edgecolor=GREY, linewidth=0.6)
        above.set_ylabel("paths [number]")
        above.set_title(f"{descriptor}: {len(numbers)} paths")
        for y, (choice, name, of, is_usual) in enumerate(choices):
            if of is None:
                below.text(low, y, "none", fontsize=7, va="center", color=GREY)
            else:
                words = f"{CHOICE_LABELS[choice]} {name}: median r {correlation(of.median)} of {of.correlated} paths"
                below.plot([of.least, of.greatest], [y, y], color=GREY, linewidth=1.1)
                below.plot(of.median, y, "|", color=INK, markersize=9, markeredgewidth=1.4, gid=drawn.note(words))
            if is_usual:
                below.plot(low - 0.02 * (high - low), y, "D", color=INK, markersize=2.6, clip_on=False)
        below.set_yticks(range(len(choices)), [name for _, name, _, _ in choices], fontsize=7)
        below.set_ylim(len(choices) - 0.4, -0.6)
        for before in range(1, len(choices)):
            if choices[before][0] != choices[before - 1][0]:
                below.axhline(before - 0.5, color=PALE, linewidth=0.6)
        below.set_xlabel("correlation of SED with score [–]")
        for axes in drawn.axes:
            axes.set_xlim(low - 0.04 * (high - low), high)
            if usual is not None:
                axes.axvline(usual, color=INK, linewidth=0.9, linestyle=(0, (3, 2)), zorder=0)
        name, title = f"paths-{descriptor}", f"Correlation of {descriptor} along many paths of the analysis"
        text = svg(drawn, name, title, simulated=simulated)
    header = (*CHOICES, "usual", "surfaces", "trials", "r of means", "r within subjects", "low", "high")
    numbers_of = attrgetter("surfaces", "trials", "r", "within", "low", "high")
    rows = tuple((*map(str, astuple(one.path)), int(one.usual), *numbers_of(one)) for one in findings)
    return Panel(name, title, text, header, rows)


def _ends(values: Sequence[float]) -> tuple[float, float]:
    """Return round ends of an axis that holds all values and shows their differences, within -1 to 1.

    >>> _ends([0.93, 0.95])
    (0.9, 1.0)
    """
    low, high = np.floor(10.0 * min(values)) / 10.0, np.ceil(10.0 * max(values)) / 10.0
    return max(-1.0, float(low)), min(1.0, float(high if high > low else low + 0.1))


# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.


COLOURS = (PURPLE, GREEN, VERMILLION)
Value = float | None


def compared_panel(
    names: Sequence[str],
    sessions: tuple[str, str],
    rows: Sequence[tuple[str, Sequence[tuple[Value, Value]]]],
    *,
    simulated: bool,
) -> Panel | None:
    """Return the picture of `rows`: a stimulus and its values of both sessions for each of `names`.

    None where no stimulus has both.
    """
    if not any(None not in pair for _, pairs in rows for pair in pairs):
        return None
    drawn = sheet(560, 150 * len(names) + 60, tuple(1.0 for _ in names), share_x=True)
    for at, (name, axes) in enumerate(zip(names, drawn.axes, strict=True)):
        for place, (stimulus, pairs) in enumerate(rows):
            first, second = pairs[at]
            if first is not None and second is not None:
                axes.plot([place, place], [first, second], color=GREY, linewidth=1.0)
            for value, filled, session in ((first, False, sessions[0]), (second, True, sessions[1])):
                if value is not None:
                    face = COLOURS[at % len(COLOURS)] if filled else "white"
                    axes.plot(
                        [place],
                        [value],
                        "s" if filled else "o",
                        markersize=5.0,
                        markerfacecolor=face,
                        markeredgecolor=INK,
                        markeredgewidth=0.7,
                        gid=drawn.note(f"{stimulus}, {session}: {name} {value:.4g}"),
                    )
        axes.set_ylabel(name)
        axes.tick_params(labelbottom=axes is drawn.axes[-1])
    drawn.axes[0].set_title(f"circle: {sessions[0]}; filled square: {sessions[1]}")
    last = drawn.axes[-1]
    last.set_xticks(range(len(rows)), [stimulus for stimulus, _ in rows], rotation=60, ha="right")
    last.set_xlim(-0.6, len(rows) - 0.4)
    title = f"{sessions[0]} and {sessions[1]} compared"
    header = ("stimulus", *(f"{name} {part}" for name in names for part in (*sessions, "difference")))
    table = tuple(
        (stimulus, *(cell for a, b in pairs for cell in (a, b, None if a is None or b is None else b - a)))
        for stimulus, pairs in rows
    )
    return Panel("compared", title, svg(drawn, "compared", title, simulated=simulated), header, table)
