"""The deformed finger at true scale: strain-energy density in it, layers, receptor, tractions of the contact."""

# matplotlib does not type the keyword arguments it passes on.

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.tri import Triangulation, TriContourSet

from sessions.report.contents import Field
from sessions.report.figures.style import GREY, INK, PALE, Panel, Sheet, rows_of, sheet

# Perceptually uniform, darker for greater values, also in grey; the black end is reserved for lines.
_COLOURS = ListedColormap(colormaps["magma_r"](np.linspace(0.0, 0.8, 256)))
LONGEST_ARROW = 1.5  # of the tractions in the picture [mm]
_ARROWS = 22  # at most
NO_SED = "No node of this finger has a finite SED."
HALF_WIDTH = 4.6  # of the close view [mm]
_ARROW: dict[str, Any] = {
    **{"angles": "xy", "scale_units": "xy", "scale": 1.0, "units": "xy"},
    **{"width": 0.045, "headwidth": 4.0, "headlength": 5.0, "headaxislength": 4.5},
}
_STYLE = {"slip": "solid", "cap": (0, (4, 1.2)), "stick": (0, (1, 1))}
_STATE_LABELS = {"slip": "slips", "cap": "slips at the bound", "stick": "sticks"}


def finger_panels(field: Field, levels: tuple[float, ...]) -> tuple[Panel, Panel]:
    """Return the whole finger and a close view of its contact; `levels` [kPa] are the borders of the colours."""
    whole, close = sheet(328, 330), sheet(328, 330)
    colours = _tissue(whole.axes[0], field, levels)
    _tissue(close.axes[0], field, levels)
    x, y = field.finger.nodes.T
    whole.axes[0].set(xlim=(x.min() - 0.5, x.max() + 0.5), ylim=(-1.2, y.max() + 0.5))
    if colours is not None:
        bar = whole.figure.colorbar(
            colours, ax=whole.axes[0], location="bottom", spacing="proportional", aspect=28, pad=0.02, label="SED [kPa]"
        )
        bar.set_ticks(levels[:: -(-len(levels) // 6)])
    _name_layers(whole.axes[0], field)
    _tractions(close, field)
    inside = tuple(field.finger.patch.mean(axis=0).tolist())
    close.axes[0].annotate("ending", inside, xytext=(0, 7), textcoords="offset points", ha="center", va="bottom")
    middle = _middle(field)
    close.axes[0].set(xlim=(middle - HALF_WIDTH, middle + HALF_WIDTH), ylim=(-3.1, 4.4))
    for picture in (whole, close):
        picture.axes[0].set(xlabel="along the surface, proximal to distal [mm]", ylabel="above the surface [mm]")
        picture.axes[0].set_title(f"{field.experiment}, index {field.index}")
    stem = f"finger-{field.experiment}-{field.index}"
    subject = f"index {field.index} of {field.experiment}"
    skin, header = field.skin, ("x [mm]", "y [mm]", "SED [MPa]")
    contact_rows = zip(rows_of(skin.x, skin.gap, skin.pressure, skin.traction), skin.state, strict=True)
    of_contact = ("x [mm]", "y [mm]", "pressure [MPa]", "traction along +x [MPa]", "state")
    rows = ((*row, state) for row, state in contact_rows)
    return (
        whole.panel(stem, f"Strain-energy density in the finger, {subject}", header, rows_of(x, y, field.finger.sed)),
        close.panel(f"{stem}-contact", f"Contact and receptor, {subject}", of_contact, rows),
    )


def common_levels(fields: Sequence[Field]) -> tuple[float, ...]:
    """Return the borders of the colours for all fields together [kPa]: few nodes, at bone and contact, are above.

    They rise from 0 in steps of 1, 2 or 5 times a power of ten. Nodes without an SED (nan) are ignored; if no node has
    an SED above 0, the colours end at 1 kPa.
    """
    values = np.concatenate([field.finger.sed for field in fields]) * 1e3
    values = values[np.isfinite(values)]
    high = float(np.quantile(values, 0.97)) if len(values) else 0.0
    if high <= 0.0:
        high = 1.0
    step = _nice(high / 8)
    return tuple(round(step * n, 9) for n in range(int(np.ceil(high / step)) + 1))


def _tissue(axes: Axes, field: Field, levels: tuple[float, ...]) -> TriContourSet | None:
    """Fill the finger by its SED, outline layers, bone and ending, and draw the surface below it.

    Return the filling; None, with a text in the picture, where no triangle has an SED at all corners.
    """
    contours = _draw_contours(axes, field, levels)
    for name, line in field.finger.outlines.items():
        if name == "bone":
            axes.fill(line[:, 0], line[:, 1], facecolor="#f2f2f2", edgecolor=INK, linewidth=0.4)
        else:
            axes.plot(line[:, 0], line[:, 1], color=INK, linewidth=0.8 if name == "skin" else 0.4)
    patch = np.vstack([field.finger.patch, field.finger.patch[:1]])
    axes.plot(patch[:, 0], patch[:, 1], color="white", linewidth=2.2)
    axes.plot(patch[:, 0], patch[:, 1], color=INK, linewidth=1.0)
    axes.axhline(0.0, color=INK, linewidth=1.0)
    axes.axhspan(-50.0, 0.0, color=PALE, alpha=0.45, linewidth=0, zorder=0)
    axes.set_aspect("equal", anchor="N")
    if contours is None:
        axes.text(0.5, 0.98, NO_SED, transform=axes.transAxes, ha="center", va="top")
    return contours


def _draw_contours(axes: Axes, field: Field, levels: tuple[float, ...]) -> TriContourSet | None:
    """Fill the triangles whose corners all have a finite SED; return None without any."""
    nodes, sed, corners = field.finger.nodes, field.finger.sed * 1e3, field.finger.triangles
    without_sed = ~np.isfinite(sed[corners]).all(axis=1)
    if without_sed.all():
        return None
    values = np.where(np.isfinite(sed), sed, 0.0)  # a node without an SED is in no drawn triangle
    mesh = Triangulation(nodes[:, 0], nodes[:, 1], corners, mask=without_sed)
    contours = axes.tricontourf(mesh, values, levels=levels, cmap=_COLOURS, extend="max")
    contours.set_edgecolor("face")  # else hairlines of the background show between levels
    contours.set_linewidth(0.3)
    return contours


def _name_layers(axes: Axes, field: Field) -> None:
    """Write the layers' names next to the finger's back with lines into the layers, and the bone's name on it."""
    outlines = field.finger.outlines
    if "bone" in outlines:
        x, y = outlines["bone"].mean(axis=0).tolist()
        axes.text(x, y, "bone", ha="center", va="center", clip_on=True)
    lines = [outlines[name] for name in ("skin", "epidermis", "dermis", "bone") if name in outlines]
    if len(lines) < 4 or len({len(line) for line in lines}) > 1:
        return  # the outlines have no corresponding points across the layers
    line = {"arrowstyle": "-", "color": INK, "linewidth": 0.4, "shrinkA": 1.0, "shrinkB": 0.0, "relpos": (0.0, 0.5)}
    for row, (name, outer, inner) in enumerate(zip(("epidermis", "dermis", "fat"), lines[:-1], lines[1:], strict=True)):
        index = int((0.88 - 0.04 * row) * len(outer))
        middle, text = tuple((outer[index] + inner[index]) / 2), (0.75, 0.95 - 0.1 * row)
        axes.annotate(name, middle, text, textcoords="axes fraction", ha="left", va="center", arrowprops=line)


def _middle(field: Field) -> float:
    contact_x = field.skin.x[[state != "open" for state in field.skin.state]]
    return float(contact_x.min() + contact_x.max()) / 2 if len(contact_x) else 0.0


def _tractions(picture: Sheet, field: Field) -> None:
    """Draw the surface's tractions on the skin as arrows that end at the skin, and the contact states."""
    axes, skin = picture.axes[0], field.skin
    contact_nodes = [i for i, state in enumerate(skin.state) if state != "open"]
    if not contact_nodes:
        axes.text(0.5, 0.02, "no contact", transform=axes.transAxes, ha="center", va="bottom")
        return
    _states(axes, field)
    strongest = float(np.hypot(skin.pressure[contact_nodes], skin.traction[contact_nodes]).max())
    if strongest == 0.0:  # contact without load
        return
    scale = LONGEST_ARROW / strongest
    for i in contact_nodes[:: max(1, -(-len(contact_nodes) // _ARROWS))]:
        vector = (scale * skin.traction[i], scale * skin.pressure[i])
        text = f"pressure {1e3 * skin.pressure[i]:.1f} kPa, traction {1e3 * skin.traction[i]:.1f} kPa"
        start = (skin.x[i] - vector[0], -0.08 - vector[1])
        axes.quiver(*start, *vector, color=INK, gid=picture.note(text), **_ARROW)
    unit = _nice(strongest)
    bar_x = _middle(field) - HALF_WIDTH + 0.3
    axes.plot([bar_x, bar_x], [-2.8, -2.8 + unit * scale], color=INK, linewidth=1.0, solid_capstyle="butt")
    axes.text(bar_x + 0.2, -2.8 + unit * scale / 2, f"{1e3 * unit:g} kPa", ha="left", va="center", fontsize=7.5)


def _states(axes: Axes, field: Field) -> None:
    """Draw a line under the surface for each stretch that slips or sticks, with its name where there is room."""
    states = field.skin.state
    for state, run in itertools.groupby(range(len(states)), key=lambda i: states[i]):
        if state == "open":
            continue
        x, label = field.skin.x[list(run)].tolist(), _STATE_LABELS[state]
        level = -LONGEST_ARROW - 0.35
        axes.plot([x[0], x[-1]], [level, level], color=GREY, linewidth=1.6, linestyle=_STYLE[state])
        if x[-1] - x[0] > 0.16 * len(label):
            axes.text((x[0] + x[-1]) / 2, level - 0.12, label, ha="center", va="top", fontsize=7.5)


def _nice(value: float) -> float:
    """Return the greatest of 1, 2 or 5 times a power of ten that does not exceed `value`.

    >>> _nice(0.073)
    0.05
    """
    step = 10.0 ** np.floor(np.log10(value))
    return float(max(m * step for m in (1, 2, 5) if m * step <= value * (1 + 1e-9)))
