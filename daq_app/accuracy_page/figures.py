"""The figures of the accuracy page."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle
from typing import Literal, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

from sessions.report.figures import style
from solver.verification.costs import Cost
from solver.verification.estimates import GOALS, Estimate, GuaranteedCost
from solver.verification.growth import FEWEST, Growth, exponent
from solver.verification.measuring import RunResults
from solver.verification.orders import Order
from solver.verification.speed import Speed
from solver.verification.truth import JUDGED, Truth

_COLOURS = {"small": style.GREEN, "finite": style.VERMILLION}
_MARKS = {"small": "o", "finite": "s"}
_WIDE, SQUARE = (900, 320), (328, 300)  # [CSS px]
_PARTS = (
    style.GREEN, style.VERMILLION, style.SKY, style.PURPLE, "#E69F00", "#0072B2", "#F0E442", style.GREY, style.PALE,
    "#8C564B", style.INK,
)  # of a solve  # fmt: skip
R = TypeVar("R", Speed, GuaranteedCost, Estimate, Growth)


def _by_strain(rows: Sequence[R]) -> dict[str, list[R]]:
    strains = dict.fromkeys(row.kinematics for row in rows)
    return {strain: [row for row in rows if row.kinematics == strain] for strain in strains}


def _strain_legend(axes: Axes, strains: Iterable[str], location: Literal["upper right", "lower right"]) -> None:
    for strain in strains:
        axes.plot([], [], _MARKS[strain], color=_COLOURS[strain], markersize=4, label=f"{strain} strain")
    axes.legend(frameon=False, loc=location)


def _speed_panel(rows: Sequence[Speed], doubt: Mapping[str, float], time: str, title: str) -> style.Panel | None:
    sheet = style.sheet(*SQUARE)
    axes = sheet.axes[0]
    for kinematics, group in _by_strain(rows).items():
        spans = ((row.judged_error, getattr(row, time), row.dofs) for row in group)
        points = [
            (error, 1e3 * span, error < 3.0 * doubt[kinematics], f"{kinematics} strain: {dofs} unknowns, ", "")
            for error, span, dofs in spans
            if error is not None and span is not None
        ]
        if points:
            _curve(sheet, kinematics, points)
            colour, position = _COLOURS[kinematics], (100 * points[-1][0], points[-1][1])
            axes.annotate(f"{kinematics} strain", position, xytext=(4, 5), textcoords="offset points", color=colour)
    if not axes.lines:
        return None
    _logarithmic(axes)
    axes.set(xlabel="true error of the SED [%]", ylabel="time [ms]", title=title)
    return sheet.panel(f"speed-{time.removesuffix('_s')}", f"Time against true error, {title}")


def _curve(sheet: style.Sheet, kinematics: str, points: Sequence[tuple[float, float, bool, str, str]]) -> None:
    """Draw times [ms] against errors [-], with a hollow or filled mark at each point and a caption of its numbers."""
    axes, colour = sheet.axes[0], _COLOURS[kinematics]
    axes.plot([100 * error for error, *_ in points], [span for _, span, *_ in points], color=colour, linewidth=0.8)
    for error, span, hollow, prefix, suffix in points:
        gid = sheet.note(f"{prefix}{100 * error:.2g} %, {span:.3g} ms{suffix}")
        face = "white" if hollow else colour
        axes.plot(100 * error, span, _MARKS[kinematics], color=colour, markerfacecolor=face, markersize=4.5, gid=gid)


def _guaranteed_panel(rows: Sequence[GuaranteedCost]) -> style.Panel:
    sheet = style.sheet(*SQUARE)
    axes = sheet.axes[0]
    by_strain = _by_strain(rows)
    for kinematics, group in by_strain.items():
        for error_of, error_label in (("worst_estimate", "guaranteed"), ("worst_error", "true")):
            points = [
                (error, 1e3 * cost.took_s / cost.surfaces, error_label == "true",
                 f"{cost.surfaces} surfaces, {cost.dofs} unknowns: {error_label} ", " each")
                for cost in group
                if (error := getattr(cost, error_of))
            ]  # fmt: skip
            _curve(sheet, kinematics, points)
    _logarithmic(axes)
    _strain_legend(axes, by_strain, "upper right")
    title = "surfaces solved to a tolerance"
    axes.set(xlabel="guaranteed, and true, error of the SED [%]", ylabel="time for a surface [ms]", title=title)
    return sheet.panel("speed-guaranteed", f"Time against guaranteed error, {title}")


def _order_panel(rows: Sequence[Order], *, timed: bool) -> style.Panel:
    sheet = style.sheet(*_WIDE)
    axes = sheet.axes[0]
    colours = {"displacement": style.SKY, "stress": style.PURPLE, "energy": style.GREY, "force": style.VERMILLION}
    for row in rows:
        x, y = (row.errors, row.took_s) if timed else (row.sizes, row.errors)
        note = f"{row.problem}, {row.quantity}: order {row.order:.2f}"
        dashes = "--" if row.kinematics == "finite" else "-"
        axes.plot(
            x, y, dashes, marker=_mark(row.problem), color=colours.get(row.quantity, style.GREEN), markersize=3.5,
            linewidth=0.9, gid=sheet.note(note),
        )  # fmt: skip
    for quantity in dict.fromkeys(row.quantity for row in rows):
        axes.plot([], [], "-", color=colours.get(quantity, style.GREEN), label=quantity)
    for problem_name in dict.fromkeys(row.problem.split(",")[0] for row in rows):
        axes.plot([], [], " ", marker=_mark(problem_name), color=style.GREY, markersize=3.5, label=problem_name)
    if any(row.kinematics == "finite" for row in rows):
        axes.plot([], [], "--", color=style.GREY, label="finite strain")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    _logarithmic(axes)
    if timed:
        axes.set(xlabel="error [–]", ylabel="time of a solve [s]")
        return sheet.panel("benchmarks", "Time against true error on published problems")
    axes.set(xlabel="element size, by the unit of each problem [–]", ylabel="error [–]")
    return sheet.panel("orders", "Error against element size")


def _mark(problem: str) -> str:
    marks = {"thick cylinder": "o", "Cook's membrane": "s", "finger": "D", "half-plane under a round body": "^"}
    return marks.get(problem.split(",")[0], "x")


def _estimate_panel(rows: Sequence[Estimate]) -> style.Panel:
    sheet = style.sheet(*SQUARE)
    axes = sheet.axes[0]
    for row in rows:
        face = _COLOURS[row.kinematics] if row.above is not None else "none"
        note = f"{row.case}, {row.kinematics}: estimate {100 * row.estimate:.2g} %, true {100 * row.error:.2g} %"
        axes.plot(
            100 * max(row.error, 1e-7), 100 * row.estimate, _MARKS[row.kinematics], color=_COLOURS[row.kinematics],
            markerfacecolor=face, markersize=4, markeredgewidth=0.7, gid=sheet.note(note),
        )  # fmt: skip
    _logarithmic(axes)
    low, high = axes.get_xlim()
    line = np.geomspace(low, max(high, axes.get_ylim()[1]), 50)
    axes.plot(line, line, color=style.GREY, linewidth=0.8)
    axes.plot(line, 10 * np.maximum(line, 0.02), "--", color=style.GREY, linewidth=0.8)
    axes.set_xlim(low, high)
    _strain_legend(axes, _by_strain(rows), "lower right")
    number = rows[0].number
    axes.set(xlabel="true error [%]", ylabel="estimated error [%]", title=number)
    return sheet.panel(f"estimate-{number.split()[0].lower()}", f"Estimated against true error of the {number}")


def _cost_panel(rows: Sequence[Cost]) -> style.Panel:
    sheet = style.sheet(_WIDE[0], max(190, 60 + 45 * len(rows)))
    axes = sheet.axes[0]
    parts = dict.fromkeys(name for row in rows for name in row.parts)
    colours = dict(zip(parts, cycle(_PARTS), strict=False))
    for number, row in enumerate(rows):
        left = 0.0
        for name in parts:
            span = 1e3 * row.parts.get(name, 0.0) * row.took_s
            axes.barh(number, span, left=left, color=colours[name], height=0.6)
            left += span
    axes.set_yticks(range(len(rows)))
    axes.set_yticklabels([f"{row.kinematics} strain, {100 * row.tolerance:g} %\n{row.dofs} unknowns" for row in rows])
    axes.invert_yaxis()
    for name in parts:
        axes.barh(0, 0, color=colours[name], label=name)
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.05))
    axes.set_xlabel("time [ms]")
    return sheet.panel("costs", "Where the time of a solve goes")


def _growth_panel(rows: Sequence[Growth]) -> style.Panel:
    sheet = style.sheet(*SQUARE)
    axes = sheet.axes[0]
    for kinematics, group in _by_strain(rows).items():
        power = exponent(group)
        label = f"{kinematics} strain" + ("" if power is None else f": power {power:.2f}")
        axes.plot(
            [row.dofs for row in group], [1e3 * row.floor_s for row in group], label=label,
            color=_COLOURS[kinematics], marker=_MARKS[kinematics], markersize=4, linewidth=0.9,
        )  # fmt: skip
    largest = max(rows, key=lambda row: row.dofs)
    dof_range = np.array([min(row.dofs for row in rows), largest.dofs])
    axes.plot(dof_range, 1e3 * largest.floor_s * (dof_range / largest.dofs) ** 1.5, color=style.GREY, linewidth=0.7)
    _logarithmic(axes)
    axes.legend(frameon=False, loc="upper left")
    axes.set(xlabel="unknowns", ylabel="time [ms]")
    return sheet.panel("growth", "Growth of the time with the unknowns")


CAPTIONS = {
    "speed":
        f"Time against true error: largest error of the SED on {len(JUDGED)} surfaces (slipperiness 0 to 100, "
        "stickiness 0), median time of a solve, mesh and estimate not included. One point a mesh; hollow where the "
        "error is below three times the uncertainty of the reference. Last, surfaces solved together to a tolerance, "
        "every mesh and estimate included: filled by the largest estimate, hollow by the largest true error.",
    "benchmarks":
        "Time against true error on problems with a known answer, mesh included: thick cylinder, Cook's membrane, "
        "half-plane under a round body, and the finger at its ending. The table of orders names every point.",
    "estimates":
        "Estimated against true error, of every answer at a requested tolerance. Above the line the estimate is "
        "safe; below the dashed line (ten times the larger of true error and 0.02 %) it is near. Hollow: the reference "
        "is not accurate enough to decide.",
    "orders":
        "Errors of sequences of meshes against the size of their elements; the slope is the order of convergence, "
        "which the table gives. Where contact is involved, the root mean square over meshes of nearly one size.",
    "costs": "Time of the parts of one solve through the public interface, mesh and error estimate included.",
    "growth":
        "Time of one assembly, factorisation and solve against the number of unknowns; the exponent is that of the "
        f"meshes from {FEWEST:,} unknowns on. Grey: the power 1.5.",
}  # fmt: skip


def plates(results: RunResults) -> dict[str, style.Plate]:
    """Return the figures that have data, by name."""
    speeds, guaranteed, orders = results.of(Speed), results.of(GuaranteedCost), results.of(Order)
    costs, growth = results.of(Cost), results.of(Growth)
    truths = [truth for truth in results.of(Truth) if truth.case in JUDGED and truth.doubt]
    doubt = {strain: max((t.doubt[0] for t in truths if t.kinematics == strain), default=0.0) for strain in _COLOURS}
    estimates = [[row for row in results.of(Estimate) if row.number == number] for number in GOALS]
    with style.look():
        panels: dict[str, list[style.Panel | None]] = {
            "speed": [
                _speed_panel(speeds, doubt, "first_s", "one surface from undeformed"),
                _speed_panel(speeds, doubt, "next_s", "each further surface"),
                _guaranteed_panel(guaranteed) if guaranteed else None,
            ],
            "benchmarks": [_order_panel(orders, timed=True) if orders else None],
            "estimates": [_estimate_panel(rows) for rows in estimates if rows],
            "orders": [_order_panel(orders, timed=False) if orders else None],
            "costs": [_cost_panel(costs) if costs else None],
            "growth": [_growth_panel(growth) if growth else None],
        }
    every = (style.plate(name, CAPTIONS[name], figure_panels) for name, figure_panels in panels.items())
    return {plate.name: plate for plate in every if plate.panels}


def _logarithmic(axes: Axes) -> None:
    """Make both axes logarithmic, between powers of ten, so that labels are few and short."""
    axes.set(xscale="log", yscale="log")
    axes.set(xlim=_decades(axes.get_xlim()), ylim=_decades(axes.get_ylim()))
    for axis in (axes.xaxis, axes.yaxis):  # powers of ten as plain numbers: easier to read, and drawn twice as fast
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())


def _decades(limits: tuple[float, float]) -> tuple[float, float]:
    """Return the powers of ten around a range, with 12 % tolerance at each end; the two always differ."""
    low, high = np.floor(np.log10(limits[0]) + 0.05), np.ceil(np.log10(limits[1]) - 0.05)
    return float(10.0**low), float(10.0 ** max(high, low + 1.0))
