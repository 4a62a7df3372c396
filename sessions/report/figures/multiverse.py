"""The correlation along many paths of the analysis: all of them as a distribution, and what each choice does to it."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

from collections.abc import Sequence

import numpy as np

from sessions.report.figures.style import GREY, INK, PALE, Panel, look, sheet, svg
from sessions.report.wording import correlation
from sessions.statistics.multiverse import CHOICE_LABELS, CHOICES, PathFinding, by_choice, correlations

CAPTION = (
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
    rows = tuple(
        (
            *(str(getattr(one.path, choice)) for choice in CHOICES),
            int(one.usual),
            one.surfaces,
            one.trials,
            one.r,
            one.within,
            one.low,
            one.high,
        )
        for one in findings
    )
    return Panel(name, title, text, header, rows)


def _ends(values: Sequence[float]) -> tuple[float, float]:
    """Return round ends of an axis that holds all values and shows their differences, within -1 to 1.

    >>> _ends([0.93, 0.95])
    (0.9, 1.0)
    """
    low, high = np.floor(10.0 * min(values)) / 10.0, np.ceil(10.0 * max(values)) / 10.0
    return max(-1.0, float(low)), min(1.0, float(high if high > low else low + 0.1))
