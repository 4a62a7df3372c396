"""Direct labels beside curves, kept from lying over each other."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from scipy.optimize import isotonic_regression

from sessions.report.figures.style import GREY, INK, TEXT, Sheet

AT = 1.04  # where labels begin, in widths of the axes


@dataclass(frozen=True, slots=True)
class Label:
    """What to write at the right of a picture, and the point it belongs to."""

    text: str
    x: float
    y: float


def spread(wanted: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Return places at least `gap` apart, in the order of `wanted` and near them, inside low..high where they fit.

    >>> spread([1.0, 1.0, 5.0], gap=1.0, low=0.0, high=10.0)
    [0.5, 1.5, 5.0]
    """
    n = len(wanted)
    if not n:
        return []
    order = np.argsort(wanted, kind="stable")
    steps = gap * np.arange(n)
    # Without the steps, labels at least `gap` apart are numbers that do not fall.
    rising = isotonic_regression(np.asarray(wanted)[order] - steps).x
    places = np.empty(n)
    places[order] = np.clip(rising, low, max(low, high - steps[-1])) + steps
    return [float(place) for place in places]


def label_right(drawn: Sheet, axes: Axes, labels: Sequence[Label], head: str = "") -> None:
    """Write labels right of the axes, each with a thin line to its point; `head` stands over the column of labels.

    They find their heights when the axes have theirs.
    """
    if not labels:
        return
    write = partial(axes.text, transform=axes.get_yaxis_transform(), va="center", ha="left")
    names = [write(AT, label.y, label.text, color=INK) for label in labels]
    top = write(AT, labels[0].y, head, color=GREY)
    lines = [axes.plot([], [], color=GREY, linewidth=0.4, clip_on=False, zorder=1)[0] for _ in labels]

    def place() -> None:
        height = axes.get_window_extent().height / drawn.figure.dpi * 72  # [pt]
        (low, high), (left, right) = axes.get_ylim(), axes.get_xlim()
        gap = 1.3 * TEXT * (high - low) / height
        places = spread([label.y for label in labels], gap, low, high - (gap if head else 0.0))
        end = left + (AT - 0.01) * (right - left)
        for label, name, line, y in zip(labels, names, lines, places, strict=True):
            name.set_y(y)
            line.set_data([label.x, end], [label.y, y])
        top.set_y(max(places) + gap)

    drawn.then.append(place)
