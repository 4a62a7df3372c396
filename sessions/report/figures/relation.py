"""Prediction against score: every stimulus, the line, and how small the range of the predictions is."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

import math
from collections.abc import Sequence

from sessions.report import Experiment, PredictionFinding
from sessions.report.figures.style import GREEN, GREY, Panel, Sheet, sheet, svg
from sessions.report.tables.rivals import rival_words
from sessions.report.wording import correlation, spread_share
from sessions.statistics.scores import MeanScore, Relation


def relation_panel(
    experiment: Experiment, predictions: Sequence[PredictionFinding], *, simulated: bool
) -> Panel | None:
    """Return SED against mean score with both errors, the least-squares line, r, its interval and n."""
    means = {mean.index: mean for mean in experiment.scores}
    points = [(means[p.index], p, 1e3 * p.sed) for p in predictions if p.sed is not None and p.index in means]
    if len(points) < 2:
        return None
    figure_sheet = _two_columns()
    axes, beside = figure_sheet.axes
    related = experiment.score_relation
    rising = related is not None and (related.slope or 0.0) > 0.0
    for mean, prediction, sed in points:
        expected = sed if related is None else _on_line(related, mean.mean)
        _point(figure_sheet, mean, prediction, sed, above=sed >= expected, rising=rising)
    if related is not None:
        ends = [min(m.mean for m, _, _ in points), max(m.mean for m, _, _ in points)]
        axes.plot(ends, [_on_line(related, x) for x in ends], color=GREEN, linewidth=1.0, zorder=1)
    seds = [sed for _, _, sed in points]
    low, high = min(seds), max(seds)
    room = 0.18 * (high - low or high)
    axes.set_ylim(low - room, high + room)
    axes.set_xlim(-6, 106)
    axes.set_xticks([0, 20, 40, 60, 80, 100])
    axes.set_xlabel(f"mean score of {experiment.descriptor} [0–100]")
    axes.set_ylabel("predicted SED [kPa]")
    title = f"{relation_words(experiment)}\nrange of SED: {high - low:.3f} kPa ({spread_share(low, high)})"
    axes.set_title(f"{title}\n{rival_words(experiment.rivals)}".strip())
    beside.plot([0.0] * len(seds), seds, "_", color=GREEN, markersize=12, markeredgewidth=1.2)
    beside.set_ylim(0.0, 1.15 * high)
    beside.set_xlim(-1, 1)
    beside.set_xticks([])
    beside.spines["bottom"].set_visible(False)
    beside.set_xlabel("from 0")
    name, title = f"relation-{experiment.name}", f"Predicted SED against score of {experiment.descriptor}"
    header = (
        "index",
        "mean score",
        "95 % interval low",
        "95 % interval high",
        "SED [MPa]",
        "error estimate of SED [-]",
    )
    rows = tuple((m.index, m.mean, m.low, m.high, p.sed, p.error_estimate) for m, p, _ in points)
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
    (axes,) = drawn.axes
    axes.remove()
    grid = drawn.figure.add_gridspec(1, 2, width_ratios=(1.0, 0.18))
    return Sheet(
        drawn.figure, (drawn.figure.add_subplot(grid[0, 0]), drawn.figure.add_subplot(grid[0, 1])), drawn.hover
    )


def _on_line(related: Relation, score: float) -> float:
    """Return the SED of the least-squares line at a score [kPa]; nan where there is no line."""
    if related.slope is None or related.intercept is None:
        return math.nan
    return 1e3 * (related.intercept + related.slope * score)


def _point(
    drawn: Sheet, mean: MeanScore, prediction: PredictionFinding, sed: float, *, above: bool, rising: bool
) -> None:
    """Draw one stimulus with both errors, its index on the side away from the line."""
    axes = drawn.axes[0]
    text = f"index {mean.index}: score {mean.mean:.1f}, SED {sed:.3f} kPa"
    if mean.low is not None and mean.high is not None:
        axes.plot([mean.low, mean.high], [sed, sed], color=GREY, linewidth=0.8, zorder=2)
    if prediction.error_estimate is not None:
        error = sed * prediction.error_estimate
        axes.plot([mean.mean] * 2, [sed - error, sed + error], color=GREY, linewidth=0.8, zorder=2)
    axes.plot(mean.mean, sed, "o", color=GREEN, markersize=5, zorder=3, gid=drawn.note(text))
    right = above != rising  # away from the line
    axes.annotate(
        str(mean.index),
        (mean.mean, sed),
        xytext=(5 if right else -5, 4 if above else -4),
        textcoords="offset points",
        ha="left" if right else "right",
        va="bottom" if above else "top",
        zorder=4,
    )
