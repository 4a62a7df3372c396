"""Forces, friction and speed in the course of the strokes, laid over each other, with their steady windows."""

# pyright: reportUnknownMemberType=false
# matplotlib does not type the keyword arguments it passes on.

import math
from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes

from sessions.report import StrokeFinding, Trace
from sessions.report.figures.labels import Label, label_right
from sessions.report.figures.style import GREY, PURPLE, SKY, VERMILLION, Panel, Sheet, shades, sheet, svg

MOST_LABELLED = 12  # more curves in one picture cannot be told apart by labels


class StrokeQuantity(NamedTuple):
    """What is drawn in the course of strokes."""

    name: str  # of its figure
    values: str  # its name in a trace, and in the title
    level: str  # a stroke's number over the steady window
    column: str  # with its unit
    axis: str
    word: str  # before a level
    colour: str


NORMAL = StrokeQuantity("normal-force", "normal", "normal_force", "N [N]", "normal force N [N]", "N", SKY)
TANGENTIAL = StrokeQuantity(
    "tangential-force", "tangential", "tangential_force", "T [N]", "tangential force T [N]", "T", VERMILLION
)
MU = StrokeQuantity("friction", "mu", "mu_dynamic", "mu [-]", "µ = T / N [–]", "µ", PURPLE)
SPEED = StrokeQuantity(
    "speed", "speed", "speed", "speed [mm/s]", "speed of the centre of pressure [mm/s]", "speed", GREY
)


def stroke_panel(
    of: StrokeQuantity, strokes: Sequence[StrokeFinding], experiment: str, *, simulated: bool
) -> Panel | None:
    """Return a quantity of one experiment's strokes from contact onset on; None where nothing can be drawn.

    Strokes whose speed was refused are left out of speeds.
    """
    if of is SPEED:
        strokes = [stroke for stroke in strokes if stroke.speed is not None]
    drawn = sheet(328, 290)
    (axes,) = drawn.axes
    axes.set_title(experiment)
    axes.set_ylabel(of.axis)
    rows = _draw(drawn, of, [(stroke, stroke.trace) for stroke in strokes if stroke.trace is not None])
    if not rows:
        return None
    if of is SPEED:
        fastest = max(stroke.speed for stroke in strokes if stroke.speed is not None and stroke.trace is not None)
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, -0.3 * fastest), min(high, 2.0 * fastest))
    name = f"{of.name}-{experiment}" if experiment else of.name
    title = f"{of.values} against time, {experiment or 'all strokes'}"
    header = ("stroke", "index", "time since contact [s]", of.column, "in steady window")
    return Panel(name, title, svg(drawn, name, title, simulated=simulated), header, rows)


Row = tuple[int, int | None, float, float, int]


def _draw(drawn: Sheet, of: StrokeQuantity, curves: Sequence[tuple[StrokeFinding, Trace]]) -> tuple[Row, ...]:
    """Draw curves thin, thick in their steady windows, labelled at their steady level; return what was drawn."""
    (axes,) = drawn.axes
    ordered = sorted(curves, key=lambda c: (c[0].index is None, c[0].index or 0, c[0].number))
    rows: list[Row] = []
    labels: list[Label] = []
    for (stroke, trace), shade in zip(ordered, shades(of.colour, max(len(ordered), 1)), strict=False):
        values: Sequence[float | None] = getattr(trace, of.values)
        inside = [in_window(stroke, t) for t in trace.time]
        y = [math.nan if v is None else v for v in values]
        level: float | None = getattr(stroke, of.level)
        text = _name(stroke) + (f", {of.word} {level:.3g} over the steady window" if level is not None else "")
        style = "solid" if level is not None else (0, (3, 2))
        axes.plot(trace.time, y, color=shade, linewidth=0.7, linestyle=style, gid=drawn.note(text))
        steady = [v if within else math.nan for v, within in zip(y, inside, strict=True)]
        axes.plot(trace.time, steady, color=shade, linewidth=2.2, solid_capstyle="butt")
        drawn_values = [
            (t, v, within) for t, v, within in zip(trace.time, values, inside, strict=True) if v is not None
        ]
        rows += [(stroke.number, stroke.index, t, v, int(within)) for t, v, within in drawn_values]
        if drawn_values:
            at = [(t, v) for t, v, within in drawn_values if within] or [(t, v) for t, v, _ in drawn_values]
            labels.append(Label(str(stroke.number if stroke.index is None else stroke.index), *at[-1]))
    axes.set_xlabel("time since contact onset [s]")
    axes.set_xlim(0.0, max((t for _, _, t, _, _ in rows), default=1.0))
    _settle(axes, [v for _, _, _, v, _ in rows])
    if len(labels) <= MOST_LABELLED:
        label_right(drawn, axes, labels, "index" if ordered and ordered[0][0].index is not None else "stroke")
    return tuple(rows)


def in_window(stroke: StrokeFinding, time: float) -> bool:
    """Say whether an instant [s since the trace's zero] lies in the steady window."""
    if stroke.steady is None or stroke.trace is None:
        return False
    return stroke.steady[0] <= stroke.trace.origin + time <= stroke.steady[1]


def _settle(axes: Axes, values: Sequence[float]) -> None:
    """Fix the limits at all that was drawn, from 0 on where nothing lies below."""
    if values:
        low, high = min(*values, 0.0), max(values)
        axes.set_ylim(low - (0.03 * (high - low) if low < 0 else 0.0), high + 0.06 * (high - low))


def _name(stroke: StrokeFinding) -> str:
    return f"stroke {stroke.number}" + (f", index {stroke.index}" if stroke.index is not None else "")
