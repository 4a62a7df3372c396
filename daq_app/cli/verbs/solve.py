"""Run the solver once, on a scene file."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from daq_app.console import DONE, FLAWED, STOPPED, Console, WrongValue, number, table
from solver.quantities import QUANTITIES, Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from solver import Prediction, Receptor, Scene
    from solver.response.rates import Rates

EXAMPLE = "daq-app solve stickiness-100.toml --json"
UNFINISHED = "Stopped before all that was asked for was done: this is what had been found by then."
AUDITS = {
    "equilibrium_x": "forces along the surface are out of balance by",
    "equilibrium_y": "forces across the surface are out of balance by",
    "work_balance": "work of the contact forces and energy of the tissue differ by",
    "penetration": "the skin lies too low by, of the indentation",
    "cone_violation": "friction exceeds its law by, of the largest force on a node",
    "normal_force_missed": "the normal force given is missed by, of it",
    "drag_missed": "the drag given is missed by, of what friction could carry",
    "course_work_balance": "of the bone's work on its way, neither stored nor lost to friction",
    "course_step_work": "of the bone's work on its way, left open by the size of the steps",
    "course_viscous_work": "of the bone's work on its way, taken by tissues that relax",
    "course_least_dissipation": "least work that friction took in a step, of the bone's work",
    "smallest_det_F": "smallest ratio of a volume to what it was",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the scene file."""
    parser.add_argument("scene", type=Path, metavar="SCENE.toml", help="finger, materials, friction, loading, receptor")
    parser.add_argument(
        "--row",
        type=float,
        metavar="MM",
        help="also every quantity along a row of endings so deep below the skin, as SA-I or RA endings lie; without "
        "error estimates",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Solve the scene and print what came out; stopped by the user, what was found by then."""
    from sessions.toml_file import load_toml
    from solver import Scene, SolveFailure, solve

    scene = load_toml(options.scene, Scene)
    deep = _row_receptor(scene, options.row)
    before: list[Prediction] = []
    try:
        with console.working("solving") as told:
            found = solve(scene, told, rough=before.append)
    except SolveFailure as failure:
        console.result(failure.to_dict())
        raise
    except KeyboardInterrupt:
        if not before:
            raise
        deep = None
        found = replace(before[-1], warnings=(*before[-1].warnings, UNFINISHED))
        _print(found, scene.title or options.scene.name, console)
        return STOPPED
    _print(found, scene.title or options.scene.name, console, deep)
    asked = scene.solve.tolerance
    return DONE if asked is None or found.error_estimate <= asked else FLAWED


def _row_receptor(scene: "Scene", depth: float | None) -> "Receptor | None":
    """Return an ending like the scene's at another depth [mm]. Raises WrongValue where the skin has no room for it."""
    if depth is None:
        return None
    half, skin = scene.receptor.ending[0] / 2.0, scene.finger.epidermis + scene.finger.dermis
    if not half <= depth <= skin - half:
        raise WrongValue(f"--row {depth:g} is not allowed: {half:g} to {skin - half:g} mm, within the skin")
    return replace(scene.receptor, depth=depth)


def _print(found: "Prediction", title: str, console: Console, deep: "Receptor | None" = None) -> None:
    row = {} if deep is None else _row(found, deep)
    changes = _rates(found)
    told = {name: {part: _none(rate) for part, rate in one._asdict().items()} for name, one in changes.items()}
    further = {"rates": told, "row_at": {"depth": deep.depth, **row} if deep is not None else None}
    console.result({**found.to_dict(), **{name: value for name, value in further.items() if value}})
    console.say(title)
    rows = [
        ["SED at the ending", number(found.sed_ending, 5, factor=1e3), "kPa", _percent(found.error_estimate)],
        *([["corrected", number(found.sed_ending_corrected, 5, factor=1e3), "kPa", ""]] if found.nested else []),
        ["SED at the point", number(found.sed_point, 5, factor=1e3), "kPa", _percent(found.sed_point_error)],
        ["normal force", number(found.normal_force, 5), "N/mm", _percent(found.normal_force_error)],
        ["tangential force", number(found.tangential_force, 5), "N/mm", _percent(found.tangential_force_error)],
        ["contact width", number(found.contact_width, 3), "mm", _percent(found.contact_width_error)],
        ["indentation", number(found.indentation, 4), "mm", _percent(found.indentation_error)],
        *(
            []
            if found.shift is None
            else [["sideways shift", number(found.shift, 4), "mm", _length(found.shift_error)]]
        ),
        ["unknowns", str(found.dofs), "", ""],
        ["solving took", number(found.wall_s, factor=1e3), "ms", ""],
        ["setting up took", number(found.setup_s, factor=1e3), "ms", ""],
        ["estimating errors took", number(found.estimate_s, factor=1e3), "ms", ""],
    ]
    console.say(table(rows, head=["", "", "", "error, estimated"]))
    console.say("\nEvery quantity at the ending, averaged over it (--json says what each is):")
    responses = [_response(one, *found.responses[one.name]) for one in QUANTITIES]
    console.say(table(responses, head=["", "", "", "error, estimated"]).lstrip("\n"))
    if changes:
        console.say("\nMean rates at the ending in the press, from break-away to full slip, and in the slide:")
        mean = [[one.label, *map(_rate, changes[one.name]), _unit(one)] for one in QUANTITIES]
        console.say(table(mean, head=["", "press", "break-away", "slide", ""]).lstrip("\n"))
    if deep is not None:
        console.say(
            f"\nAlong a row {deep.depth:g} mm deep (arc from first touch, positive to the tip; MPa and shares):"
        )
        head = ["arc [mm]", *(one.name for one in QUANTITIES)]
        columns = zip(*row.values(), strict=True)
        console.say(table([[number(cell, 4) for cell in cells] for cells in columns], head=head).lstrip("\n"))
    left = [[name, _percent(entry["estimate"])] for name, entry in found.model["left_out"].items()]
    console.say(
        "\nLeft out of the model, and what of the SED that is estimated to have changed (--json says how it was found):"
    )
    console.say(table(left, head=["", ""]).lstrip("\n"))
    console.say("\nChecks of the state found (0 is perfect; a volume of 1 is one that did not change):")
    shown = [[told, number(found.audits[name] + 0.0, 2)] for name, told in AUDITS.items() if name in found.audits]
    console.say(table(shown, head=["", ""]).lstrip("\n"))
    console.note(*(f"note: {warning}" for warning in found.warnings))


def _rates(found: "Prediction") -> "Mapping[str, Rates]":
    """Return the rates of every quantity; none where no course was asked for."""
    from solver.response.rates import rates

    return {} if found.history is None else rates(found.history)


def _none(value: float) -> float | None:
    return value if value == value else None


def _rate(value: float) -> str:
    return number(_none(value), 4)


def _unit(quantity: Quantity) -> str:
    return "MPa/s" if quantity.unit == "MPa" else "1/s"


def _row(found: "Prediction", receptor: "Receptor") -> dict[str, list[float | None]]:
    """Return arc positions [mm] and every quantity there, None where the finger ends."""
    from solver.prediction import ROW
    from solver.response.receptor_row import responses_along

    columns = zip(QUANTITIES, responses_along([found], receptor=receptor)[0].tolist(), strict=True)
    told = {one.name: [value if value == value else None for value in values] for one, values in columns}
    return {"arc": ROW.tolist(), **told}


def _response(quantity: Quantity, value: float, error: float) -> list[str]:
    factor, unit = (1e3, "kPa") if quantity.unit == "MPa" else (1.0, "")
    return [quantity.label, number(value, 4, factor=factor), unit, number(error, 2, factor=factor)]


def _length(error: float | None) -> str:
    return "–" if error is None else f"{number(error, 2)} mm"


def _percent(part: float | None) -> str:
    return "–" if part is None else f"{number(part, 2, factor=100)} %"
