"""Direct labels beside curves, kept from lying over each other."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from scipy.optimize import isotonic_regression

from sessions.exports.figures.style import GREY, INK, TEXT


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


def label_right(axes: Axes, labels: Sequence[Label], head: str = "") -> None:
    """Write labels right of the axes, each with a thin line to its point; `head` stands over the column of labels.

    Limits of the axes must be set before.
    """
    figure = axes.get_figure(root=True)
    if figure is None or not labels:
        return
    figure.draw_without_rendering()  # settles the layout, so that heights are known
    height = axes.get_window_extent().height / figure.dpi * 72  # [pt]
    low, high = axes.get_ylim()
    gap = 1.3 * TEXT * (high - low) / height
    places = spread([label.y for label in labels], gap, low, high - (gap if head else 0.0))
    for label, place in zip(labels, places, strict=True):
        axes.annotate(
            label.text,
            xy=(label.x, label.y),
            xytext=(1.04, place),
            textcoords=("axes fraction", "data"),
            va="center",
            ha="left",
            annotation_clip=False,
            color=INK,
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.4, "shrinkA": 1.0, "shrinkB": 0.0},
        )
    if head:
        top = max(places) + gap
        axes.annotate(head, xy=(1.04, top), xycoords=("axes fraction", "data"), va="center", ha="left", color=GREY)
