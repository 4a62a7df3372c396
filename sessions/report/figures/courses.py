"""Time courses: forces of a recording, forces, friction and speed of its strokes, predicted responses."""

# matplotlib does not type the keyword arguments it passes on.

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from drivers.arrays import Array
from sessions.report.contents import Course, PredictionFinding, StrokeFinding, Trace
from sessions.report.figures.style import (
    GREEN,
    GREY,
    INK,
    PALE,
    PURPLE,
    SKY,
    VERMILLION,
    Label,
    Panel,
    Sheet,
    label_right,
    rows_of,
    shades,
    sheet,
)


def course_panel(course: Course, strokes: tuple[StrokeFinding, ...]) -> Panel:
    """Return both forces against time; strokes are grey bands with their number."""
    picture = sheet(672, 270, (1.0, 1.0), share_x=True)
    upper, lower = picture.axes
    begin, end = (float(course.time[0]), float(course.time[-1])) if len(course.time) else (0.0, 1.0)
    for axes, values, colour, name in (
        (upper, course.normal, SKY, "normal force"),
        (lower, course.tangential, VERMILLION, "tangential force"),
    ):
        for stroke in strokes:
            onset, lift = _ends(stroke, begin, end)
            text = f"stroke {stroke.number}: {onset:.3f} s to {lift:.3f} s"
            axes.axvspan(onset, lift, color=PALE, alpha=0.6, linewidth=0, gid=picture.note(text))
        axes.plot(course.time, values, color=colour, linewidth=0.8)
        axes.axhline(0.0, color=GREY, linewidth=0.4)
        axes.set(ylabel=f"{name}\n[N]", xlim=(begin, end if end > begin else begin + 1.0))
        axes.margins(y=0.08)
    upper.tick_params(labelbottom=False)
    lower.set_xlabel("time on the device's clock [s]")
    for stroke, middle in _strokes_with_room(strokes, begin, end):
        _mark(upper, str(stroke.number), (middle, 1.0), (0, 2), ha="center", va="bottom", color=INK, fontsize=7.5)
    header = ("time [s]", "normal force [N]", "tangential force [N]")
    rows = rows_of(course.time, course.normal, course.tangential)
    return picture.panel("course", "Normal and tangential force over the whole recording", header, rows)


def _mark(axes: Axes, text: str, position: tuple[float, float], off: tuple[float, float], **look: Any) -> None:  # noqa: ANN401 - matplotlib's
    """Write text at an instant and a share of the axes' height, with offset `off` in points."""
    axes.annotate(text, position, off, ("data", "axes fraction"), "offset points", **look)


def _strokes_with_room(
    strokes: tuple[StrokeFinding, ...], begin: float, end: float
) -> list[tuple[StrokeFinding, float]]:
    """Return the strokes with room for their number in the figure, each with its middle [s]."""
    room = 0.025 * (end - begin)
    with_room: list[tuple[StrokeFinding, float]] = []
    for stroke in strokes:
        middle = sum(_ends(stroke, begin, end)) / 2
        if not with_room or middle - with_room[-1][1] >= room:
            with_room.append((stroke, middle))
    return with_room


def _ends(stroke: StrokeFinding, begin: float, end: float) -> tuple[float, float]:
    return begin if stroke.onset is None else stroke.onset, end if stroke.lift is None else stroke.lift


MOST_LABELLED = 12  # more curves in one picture cannot be distinguished by labels


class StrokeQuantity(NamedTuple):
    """A quantity drawn over the time of strokes."""

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
MU_COURSE = StrokeQuantity("friction", "mu", "mu_dynamic", "mu [-]", "µ = T / N [–]", "µ", PURPLE)
SPEED_COURSE = StrokeQuantity(
    "speed", "speed", "speed", "speed [mm/s]", "speed of the centre of pressure [mm/s]", "speed", GREY
)


def stroke_panel(quantity: StrokeQuantity, strokes: Sequence[StrokeFinding], experiment: str) -> Panel | None:
    """Return a quantity of an experiment's strokes since contact, None without curves; refused speeds are left out."""
    if quantity is SPEED_COURSE:
        strokes = [stroke for stroke in strokes if stroke.speed is not None]
    picture = sheet(328, 290)
    (axes,) = picture.axes
    axes.set(title=experiment, ylabel=quantity.axis)
    rows = _draw(picture, quantity, [(stroke, stroke.trace) for stroke in strokes if stroke.trace is not None])
    if not rows:
        return None
    if quantity is SPEED_COURSE:
        fastest = max(stroke.speed for stroke in strokes if stroke.speed is not None and stroke.trace is not None)
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, -0.3 * fastest), min(high, 2.0 * fastest))
    name = f"{quantity.name}-{experiment}" if experiment else quantity.name
    title = f"{quantity.values} against time, {experiment or 'all strokes'}"
    header = ("stroke", "index", "time since contact [s]", quantity.column, "in steady window")
    return picture.panel(name, title, header, rows)


Row = tuple[int, int | None, float, float, int]


def _draw(picture: Sheet, quantity: StrokeQuantity, curves: Sequence[tuple[StrokeFinding, Trace]]) -> tuple[Row, ...]:
    """Draw curves thin, thick in their steady windows, labelled at their steady level; return the rows drawn."""
    (axes,) = picture.axes
    in_order = sorted(curves, key=lambda c: (c[0].index is None, c[0].index or 0, c[0].number))
    rows: list[Row] = []
    labels: list[Label] = []
    for (stroke, trace), shade in zip(in_order, shades(quantity.colour, max(len(in_order), 1)), strict=False):
        values: Array = getattr(trace, quantity.values)
        begin, end = stroke.steady or (math.inf, -math.inf)
        inside = (begin <= trace.origin + trace.time) & (trace.origin + trace.time <= end)
        level: float | None = getattr(stroke, quantity.level)
        text = f"stroke {stroke.number}" + ("" if stroke.index is None else f", index {stroke.index}")
        text += f", {quantity.word} {level:.3g} over the steady window" if level is not None else ""
        style = "solid" if level is not None else (0, (3, 2))
        axes.plot(trace.time, values, color=shade, linewidth=0.7, linestyle=style, gid=picture.note(text))
        axes.plot(trace.time, np.where(inside, values, np.nan), color=shade, linewidth=2.2, solid_capstyle="butt")
        valid = ~np.isnan(values)
        points = zip(*(column[valid].tolist() for column in (trace.time, values, inside)), strict=True)
        rows += [(stroke.number, stroke.index, t, v, int(within)) for t, v, within in points]
        if valid.any():
            last_valid = np.flatnonzero(valid & inside if (valid & inside).any() else valid)[-1]
            label = str(stroke.number if stroke.index is None else stroke.index)
            labels.append((label, float(trace.time[last_valid]), float(values[last_valid])))
    axes.set(xlabel="time since contact onset [s]", xlim=(0.0, max((t for _, _, t, _, _ in rows), default=1.0)))
    if rows:  # from 0 where no value is negative
        heights = [row[3] for row in rows]
        low, high = min(0.0, *heights), max(heights)
        axes.set_ylim(low - (0.03 * (high - low) if low < 0 else 0.0), high + 0.06 * (high - low))
    if len(labels) <= MOST_LABELLED:
        label_right(picture, axes, labels, "index" if in_order and in_order[0][0].index is not None else "stroke")
    return tuple(rows)


PRESS_DURATION = 1.0  # the model presses for 1 s, then slides [s]


def response_panel(predictions: Sequence[PredictionFinding], name: str) -> Panel | None:
    """Return SED against time: the whole course above, sliding alone below on its own scale."""
    courses = sorted(
        ((p, p.history) for p in predictions if p.history is not None),
        key=lambda c: (c[0].index is None, c[0].index or 0, c[0].stroke or 0),
    )
    if not courses:
        return None
    picture = sheet(328, 420, (1.0, 1.25))
    complete, sliding = picture.axes
    labels: list[Label] = []
    rows: list[tuple[int | None, int | None, float, float]] = []
    sliding_values: list[float] = []
    label_kind = "stroke" if courses[0][0].index is None else "index"
    last_time = max(float(history.time[-1]) for _, history in courses)
    for (prediction, history), shade in zip(courses, shades(GREEN, len(courses)), strict=True):
        kilopascal = 1e3 * history.sed_ending
        label = str(prediction.stroke if prediction.index is None else prediction.index)
        text = f"{label_kind} {label}: {kilopascal[-1]:.3f} kPa in the end"
        for axes in picture.axes:
            axes.plot(history.time, kilopascal, color=shade, linewidth=1.2, gid=picture.note(text))
            if history.time[-1] < last_time:  # settled: constant
                plateau = [history.time[-1], last_time], [kilopascal[-1]] * 2
                axes.plot(*plateau, color=shade, linewidth=0.8, linestyle=(0, (2, 2)))
        labels.append((label, last_time, float(kilopascal[-1])))
        course = zip(history.time.tolist(), history.sed_ending.tolist(), strict=True)
        rows += [(prediction.trial, prediction.index, *instant) for instant in course]
        sliding_values += kilopascal[history.time >= PRESS_DURATION].tolist()
    complete.axvline(PRESS_DURATION, color=GREY, linewidth=0.5, linestyle=(0, (2, 3)))
    complete.set_ylim(0.0, 1.25 * max(row[3] for row in rows) * 1e3)
    for text, offset, alignment in (("pressing", -4, "right"), ("sliding", 4, "left")):
        _mark(complete, text, (PRESS_DURATION, 0.98), (offset, 0), ha=alignment, va="top", color=GREY)
    complete.set_title(name)
    sliding.set_xlim(PRESS_DURATION, last_time)
    low, high = min(sliding_values), max(sliding_values)
    margin = 0.06 * (high - low or high)
    sliding.set(ylim=(low - margin, high + margin), ylabel="SED while sliding [kPa]", xlabel="time [s]")
    complete.set(xlim=(0.0, last_time), ylabel="SED [kPa]")
    label_right(picture, sliding, labels, label_kind)
    title = f"Predicted response in time, {name or 'all strokes'}"
    name = f"response-{name}" if name else "response"
    return picture.panel(name, title, ("trial", "index", "time [s]", "SED [MPa]"), rows)
