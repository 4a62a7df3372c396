"""Style of all pictures: palette (Okabe and Ito 2008), sizes, and SVG that is identical on every run and machine."""

# matplotlib does not type the keyword arguments it passes on.

import io
import re
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import partial
from html import escape
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from scipy.optimize import isotonic_regression

from drivers.arrays import Array
from sessions.report.wording import identifier

SKY = "#56B4E9"  # normal force
VERMILLION = "#D55E00"  # tangential force
PURPLE = "#CC79A7"  # mu
GREEN = "#009E73"  # model
INK = "#1a1a1a"
GREY = "#767676"
PALE = "#d9d9d9"

_TEXT = 8.5  # [pt]
_POINTS = 72.0  # per inch: the unit of SVG layout
DOTS = 220  # per inch of a picture in pixels
_PIXELS: ContextVar[tuple[str, dict[str, bytes]] | None] = ContextVar("pixels", default=None)  # see `in_pixels`
_SIMULATED: ContextVar[bool] = ContextVar("simulated", default=False)  # see `look`
_LOOK: dict[Any, Any] = {
    "font.family": "sans-serif",
    # Text stays text, so that it can be searched, copied and read aloud. The layout is for the first font, which is
    # wider than its substitutes: labels may come out shorter, never cut.
    "font.sans-serif": ["DejaVu Sans"],
    "svg.fonttype": "none",
    "text.parse_math": False,  # a name may hold dollar signs
    "text.hinting": "no_hinting",  # hinting would narrow the letters of the layout, not the reader's
    **dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), _TEXT),
    **dict.fromkeys(("xtick.labelsize", "ytick.labelsize"), _TEXT - 0.5),
    **dict.fromkeys(("axes.linewidth", "xtick.major.width", "ytick.major.width"), 0.6),
    **dict.fromkeys(("axes.edgecolor", "xtick.color", "ytick.color"), GREY),
    **dict.fromkeys(("axes.labelcolor", "text.color", "xtick.labelcolor", "ytick.labelcolor"), INK),
    **dict.fromkeys(("axes.spines.top", "axes.spines.right"), False),
    "axes.titlelocation": "left",
    "axes.titlepad": 5.0,
    "lines.solid_capstyle": "round",
    "axes.unicode_minus": True,
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
}
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # characters that XML forbids
_FONTS = "'DejaVu Sans', Verdana, 'Liberation Sans', Arial, Helvetica, sans-serif"

Cell = str | float | int | None


@dataclass(frozen=True, slots=True)
class Panel:
    """One picture and its numbers."""

    name: str  # of its files, without ending
    title: str  # read aloud, and shown on hovering
    svg: str
    header: tuple[str, ...]  # names with units
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True, slots=True)
class Plate:
    """One numbered figure of the report: its panels and the caption under them."""

    name: str  # its anchor on the page
    caption: str
    panels: tuple[Panel, ...]


def plate(name: str, caption: str, panels: Iterable[Panel | None]) -> Plate:
    """Return a figure of the panels that are not None."""
    return Plate(name, caption, tuple(panel for panel in panels if panel is not None))


@dataclass(frozen=True, slots=True)
class Sheet:
    """An empty picture with one or more axes, drawn on and then turned to SVG."""

    figure: Figure
    axes: tuple[Axes, ...]
    hover: dict[str, str] = field(default_factory=dict[str, str])  # artist's gid -> text on hovering
    after_layout: list[Callable[[], None]] = field(default_factory=list[Callable[[], None]])

    def note(self, text: str) -> str:
        """Return a gid for an artist that shows `text` on hovering."""
        gid = f"h{len(self.hover)}"
        self.hover[gid] = text
        return gid

    def panel(self, name: str, title: str, header: Sequence[str] = (), rows: Iterable[tuple[Cell, ...]] = ()) -> Panel:
        """Return the finished picture with its numbers, if it has any; call inside `look`."""
        return Panel(name, title, svg(self, name, title), tuple(header), tuple(rows))


@contextmanager
def look(*, simulated: bool = False) -> Generator[None]:
    """Set the style of the pictures drawn inside; they are marked if `simulated`."""
    token = _SIMULATED.set(simulated)
    try:
        with mpl.rc_context(_LOOK):
            yield
    finally:
        _SIMULATED.reset(token)


def sheet(
    width: float,
    height: float,
    heights: Sequence[float] = (1.0,),
    widths: Sequence[float] = (1.0,),
    *,
    share_x: bool = False,
) -> Sheet:
    """Return an empty picture of that size [CSS px, 96 an inch] with axes in rows and columns; call inside `look`."""
    figure = Figure(figsize=(width / 96, height / 96), dpi=_POINTS, layout="constrained")
    grid = figure.add_gridspec(len(heights), len(widths), height_ratios=heights, width_ratios=widths)
    return Sheet(figure, tuple(grid.subplots(sharex=share_x, squeeze=False).flat))


def shades(colour: str, n: int) -> tuple[str, ...]:
    """Return n shades of a colour from light to dark, distinct in grey too.

    >>> shades("#808080", 1)
    ('#808080',)
    """
    rgb = np.array(to_rgb(colour))
    parts = [0.3 - 1.0 * i / (n - 1) for i in range(n)] if n > 1 else [0.0]  # of the way to white, below 0 to black
    return tuple(to_hex((rgb + abs(part) * ((part > 0.0) - rgb)).tolist()) for part in parts)


@contextmanager
def in_pixels(note: str = "") -> Generator[dict[str, bytes]]:
    """Also draw every picture made inside in pixels, with a `note` under it: yields PNGs by the pictures' names."""
    images: dict[str, bytes] = {}
    token = _PIXELS.set((note, images))
    try:
        yield images
    finally:
        _PIXELS.reset(token)


def rows_of(*columns: Array) -> tuple[tuple[Cell, ...], ...]:
    """Return columns of numbers as the rows of a panel, None for nan."""
    cells = ([None if np.isnan(value) else value for value in column.tolist()] for column in columns)
    return tuple(zip(*cells, strict=True))


def svg(picture: Sheet, name: str, title: str) -> str:
    """Return the picture as an SVG document, inside `look`; the same picture gives the same bytes."""
    if _SIMULATED.get():
        picture.figure.suptitle("SIMULATED", x=0.995, ha="right", fontsize=6.5, color=GREY, fontweight="bold")
    note, images = _PIXELS.get() or ("", None)
    if note:
        picture.figure.supxlabel(note, x=0.01, ha="left", fontsize=6.5, color=GREY, wrap=True)
    engine = picture.figure.get_layout_engine()
    if engine is not None:
        engine.execute(picture.figure)
    for draw in picture.after_layout:
        draw()
    picture.figure.set_layout_engine(None)  # else it would be drawn again for the layout
    buffer = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": name}):
        picture.figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    if images is not None:
        pixels = io.BytesIO()
        picture.figure.savefig(pixels, format="png", dpi=DOTS, facecolor="white", metadata={"Software": None})
        images[name] = pixels.getvalue()
    return _finish_svg(buffer.getvalue(), name, title, picture.hover)


SVG_MARK = '<svg role="img" aria-label='  # start of the first element, in few pictures but ours


def _finish_svg(text: str, name: str, title: str, hover: Mapping[str, str]) -> str:
    """Return the SVG with titles for hovering, fallback fonts, and ids that are unique on a page."""
    text = text[text.index("<svg") :]
    name = identifier(name)
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    for gid, note in hover.items():
        text = text.replace(f'<g id="{gid}">', f'<g id="{gid}"><title>{escape(note)}</title>', 1)
    text = re.sub(r"'DejaVu Sans'(?:, [^;\"]*)?(?=[;\"])", _FONTS, text)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', text)
    text = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{name}-\1"', text)
    text = text.replace("<svg ", f'{SVG_MARK}"{escape(title)}" ', 1)
    declaration = '<?xml version="1.0" encoding="utf-8"?>\n'
    if _SIMULATED.get():
        declaration += "<!-- SIMULATED: this picture shows no measurement of a real device or person -->\n"
    return declaration + _NOT_XML.sub("\ufffd", text)


LABEL_X = 1.04  # where labels begin, in widths of the axes


Label = tuple[str, float, float]  # a text at the right of a picture, and the x and y of its point


def spread(targets: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Return positions at least `gap` apart, in the order of `targets` and near them, within low..high if they fit.

    >>> spread([1.0, 1.0, 5.0], gap=1.0, low=0.0, high=10.0)
    [0.5, 1.5, 5.0]
    """
    n = len(targets)
    if not n:
        return []
    order = np.argsort(targets, kind="stable")
    steps = gap * np.arange(n)
    # Less the steps, positions at least `gap` apart are a non-decreasing sequence.
    rising = isotonic_regression(np.asarray(targets)[order] - steps).x
    positions = np.empty(n)
    positions[order] = np.clip(rising, low, max(low, high - steps[-1])) + steps
    return positions.tolist()


def label_right(picture: Sheet, axes: Axes, labels: Sequence[Label], heading: str = "") -> None:
    """Write labels under a heading right of the axes, with lines to their points, once the axes have their heights."""
    if not labels:
        return
    write = partial(axes.text, transform=axes.get_yaxis_transform(), va="center", ha="left")
    targets = [y for _, _, y in labels]
    names = [write(LABEL_X, y, text, color=INK) for text, _, y in labels]
    top = write(LABEL_X, targets[0], heading, color=GREY)
    lines = [axes.plot([], [], color=GREY, linewidth=0.4, clip_on=False, zorder=1)[0] for _ in labels]

    def place() -> None:
        height = axes.get_window_extent().height / picture.figure.dpi * 72  # [pt]
        (low, high), (low_x, high_x) = axes.get_ylim(), axes.get_xlim()
        gap = 1.3 * _TEXT * (high - low) / height
        heights = spread(targets, gap, low, high - (gap if heading else 0.0))
        line_end = low_x + (LABEL_X - 0.01) * (high_x - low_x)
        for (_, x, target), name, line, y in zip(labels, names, lines, heights, strict=True):
            name.set_y(y)
            line.set_data([x, line_end], [target, y])
        top.set_y(max(heights) + gap)

    picture.after_layout.append(place)
