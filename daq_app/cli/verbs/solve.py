"""Run the solver once, on a scene file."""

import argparse
from dataclasses import replace
from math import floor, inf, isfinite, log10
from pathlib import Path
from typing import TYPE_CHECKING

from daq_app.console import DONE, FLAWED, STOPPED, Console, WrongValue, table
from daq_app.wording import number, quantity
from solver.quantities import NAMES, QUANTITIES, SED

if TYPE_CHECKING:
    from solver import Prediction, Receptor, Scene
    from solver.arrays import Array
    from solver.response.rates import CourseNumbers
    from solver.response.receptor_row import Row

EXAMPLE = "daq-app solve stickiness-100.toml --json"
UNFINISHED = "Stopped early: these are the results so far."
_UNITS = [("" if unit == "1" else unit, factor) for unit, factor in (response.shown_unit for response in QUANTITIES)]
# Numbers of a load path besides the quantities, and the units of both.
_COURSE = ("SED at the ending", "SED at the point", "normal force", "tangential force", "contact width")
COURSE_UNITS = [SED.shown_unit, SED.shown_unit, ("N/mm", 1.0), ("N/mm", 1.0), ("mm", 1.0), *_UNITS]
_EXACT = 1e-9  # relative error below which a number was an input, not a result
AUDITS = {
    "equilibrium_x": "forces along the surface are out of balance by",
    "equilibrium_y": "forces across the surface are out of balance by",
    "work_balance": "work of the contact forces and energy of the tissue differ by",
    "penetration": "the skin penetrates the surface by, of the indentation",
    "cone_violation": "friction exceeds its law by, of the largest force on a node",
    "normal_force_missed": "the normal force given is missed by, of it",
    "drag_missed": "the drag given is missed by, of what friction could carry",
    "course_work_balance": "of the bone's work on its way, neither stored nor lost to friction",
    "course_step_work": "of the bone's work on its way, left open by the size of the steps",
    "course_viscous_work": "of the bone's work on its way, dissipated by tissues that relax",
    "course_least_dissipation": "least work that friction took in a step, of the bone's work",
    "smallest_det_F": "smallest ratio of a volume to its original value",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE.toml", help="finger, materials, friction, loading, receptor")
    meaning = "also every quantity along a row of endings at this depth below the skin, such as SA-I or RA endings"
    parser.add_argument("--row", type=float, metavar="MM", help=meaning)


def run(options: argparse.Namespace, console: Console) -> int:
    """Solve the scene and print the results; after a stop by the user, those found so far."""
    from sessions.toml_file import load_toml
    from solver import Scene, SolveFailure, solve

    scene = load_toml(options.scene, Scene)
    deep = _row_receptor(scene, options.row)
    rough_predictions: list[Prediction] = []
    try:
        with console.working("solving") as progress:
            prediction = solve(scene, progress, rough=rough_predictions.append)
    except SolveFailure as failure:
        console.result(**failure.to_dict())
        raise
    except KeyboardInterrupt:
        if not rough_predictions:
            raise
        deep = None
        prediction = replace(rough_predictions[-1], warnings=(*rough_predictions[-1].warnings, UNFINISHED))
        _print(prediction, scene.title or options.scene.name, console)
        return STOPPED
    _print(prediction, scene.title or options.scene.name, console, deep)
    tolerance = scene.solve.tolerance
    return DONE if tolerance is None or prediction.error_estimate <= tolerance else FLAWED


def _row_receptor(scene: "Scene", depth: float | None) -> "Receptor | None":
    """Return the scene's ending at another depth [mm]. Raises WrongValue if it does not fit into the skin."""
    if depth is None:
        return None
    half, skin = scene.receptor.ending[0] / 2.0, scene.finger.epidermis + scene.finger.dermis
    if not half <= depth <= skin - half:
        raise WrongValue(f"--row {depth:g} is not allowed: {half:g} to {skin - half:g} mm, within the skin")
    return replace(scene.receptor, depth=depth)


def _print(prediction: "Prediction", title: str, console: Console, deep: "Receptor | None" = None) -> None:
    from solver.prediction import ROW
    from solver.response.rates import course_errors, course_numbers
    from solver.response.receptor_row import row_along

    row = None if deep is None else row_along(prediction, receptor=deep)
    history = prediction.history
    course = None if history is None else (course_numbers(history), course_errors(prediction))
    row_at = {} if row is None or deep is None else {"row_at": {"depth": deep.depth, **_row_in_json(row)}}
    plain = prediction.to_dict()
    console.result(**plain, **row_at, **({} if course is None else _course_in_json(*course)))
    console.say(title)
    best, corrected_error = number(prediction.sed_ending_corrected, 5, factor=1e3), _percent(plain["corrected_error"])
    corrected = ["corrected", best, "kPa", corrected_error]
    shift_error = "–" if plain["shift_error"] is None else f"{number(plain['shift_error'], 2)} mm"
    shift = ["sideways shift", number(prediction.shift, 4), "mm", shift_error]
    rows = [
        ["SED at the ending", number(prediction.sed_ending, 5, factor=1e3), "kPa", _percent(plain["error_estimate"])],
        *([corrected] if prediction.nested else []),
        ["SED at the point", number(prediction.sed_point, 5, factor=1e3), "kPa", _percent(plain["sed_point_error"])],
        ["normal force", number(prediction.normal_force, 5), "N/mm", _percent(plain["normal_force_error"])],
        ["tangential force", number(prediction.tangential_force, 5), "N/mm", _percent(plain["tangential_force_error"])],
        ["contact width", number(prediction.contact_width, 3), "mm", _percent(plain["contact_width_error"])],
        ["indentation", number(prediction.indentation, 4), "mm", _percent(plain["indentation_error"])],
        *([] if prediction.shift is None else [shift]),
        ["unknowns", str(prediction.dofs), "", ""],
        ["solving took", number(prediction.wall_s, factor=1e3), "ms", ""],
        ["setting up took", number(prediction.setup_s, factor=1e3), "ms", ""],
        ["estimating errors took", number(prediction.estimate_s, factor=1e3), "ms", ""],
    ]
    console.say(table(rows, header=["", "", "", "error, estimated"]))
    console.say("\nEvery quantity at the ending, averaged over it (--json explains each):")
    responses = [
        [response.label, _with_error(*prediction.responses[response.name], factor), unit]
        for response, (unit, factor) in zip(QUANTITIES, _UNITS, strict=True)
    ]
    console.say(table(responses, header=["", "", ""]).lstrip("\n"))
    if course is not None:
        _print_course(*course, console)
    if row is not None and deep is not None:
        console.say(f"\nAlong a row {deep.depth:g} mm deep (arc from first touch, positive to the tip; kPa, shares):")
        cells = [
            [_with_error(*pair, factor) for pair, (_, factor) in zip(zip(*pairs, strict=True), _UNITS, strict=True)]
            for pairs in zip(row.values.T, row.errors.T, strict=True)
        ]
        lines = [[number(arc, 4), *line] for arc, line in zip(ROW.tolist(), cells, strict=True)]
        console.say(table(lines, header=["arc [mm]", *(response.label for response in QUANTITIES)]).lstrip("\n"))
    effects = [[name, _percent(entry["estimate"])] for name, entry in prediction.model["left_out"].items()]
    values = prediction.audits
    audits = [[label, number(values[name] + 0.0, 2)] for name, label in AUDITS.items() if name in values]
    console.say(
        "\nEffects left out of the model, and how much each is estimated to change the SED (--json explains how):",
        table(effects, header=["", ""]).lstrip("\n"),
        "\nChecks of the solution (0 is perfect; a volume of 1 is unchanged):",
        table(audits, header=["", ""]).lstrip("\n"),
    )
    console.note(*(f"note: {warning}" for warning in prediction.warnings))


def _course_in_json(numbers: "CourseNumbers", errors: "CourseNumbers") -> dict[str, object]:
    from solver.response.rates import COURSE_NUMBERS, INSTANTS

    instants = zip(INSTANTS, _plain(numbers.value), _plain(errors.value), strict=True)
    rates = zip(NAMES, _plain(numbers.rate.T), _plain(errors.rate.T), strict=True)
    return {
        "instants": {
            instant: {
                name: {"value": value, "error": error}
                for name, value, error in zip((*COURSE_NUMBERS, *NAMES), values, value_errors, strict=True)
            }
            for instant, values, value_errors in instants
        },
        "rates": {
            name: {**dict(zip(INSTANTS, values, strict=True)), "errors": dict(zip(INSTANTS, value_errors, strict=True))}
            for name, values, value_errors in rates
        },
    }


def _print_course(numbers: "CourseNumbers", errors: "CourseNumbers", console: Console) -> None:
    labels = [*_COURSE, *(response.label for response in QUANTITIES)]
    instants_title = "At the ends of the press, of the break-away (full slip) and of the slide:"
    rates_title = "Mean rates in the press, the break-away and the slide:"
    sections = (
        (instants_title, numbers.value, errors.value, labels, ""),
        (rates_title, numbers.rate, errors.rate, labels[len(_COURSE) :], "/s"),
    )
    for title, values, section_errors, names, per_second in sections:
        columns = zip(names, values.T, section_errors.T, COURSE_UNITS[-len(names) :], strict=True)
        lines = [
            [name, *(_with_error(*pair, factor) for pair in zip(value, error, strict=True)), f"{unit}{per_second}"]
            for name, value, error, (unit, factor) in columns
        ]
        console.say(f"\n{title}")
        console.say(table(lines, header=["", "press", "break-away", "slide", ""]).lstrip("\n"))
    if not isfinite(errors.value[0, 0]):
        console.say("Their errors are unknown: the nested mesh has no such course, or its free cut folds.")


def _plain(table: "Array") -> list[list[float | None]]:
    """Return a table as lists, None for nan."""
    return [[value if isfinite(value) else None for value in line] for line in table.tolist()]


def _with_error(value: float, error: float, factor: float) -> str:
    """Return a number times `factor` with two digits of its error, or with four if that is round-off or unknown."""
    if not _EXACT * max(abs(value), 1.0 / factor) < error < inf:
        return f"{number(value, 4, factor=factor)} ± {number(error, 2, factor=factor)}" if isfinite(value) else "–"
    decimals = max(0, 1 - floor(log10(factor * error)))
    return f"{quantity(factor * value, decimals)} ± {quantity(factor * error, decimals)}"


def _row_in_json(row: "Row") -> dict[str, object]:
    """Return arc positions [mm], every quantity there and its errors, with None beyond the finger's end."""
    from solver.prediction import ROW

    values, errors = (dict(zip(NAMES, _plain(table), strict=True)) for table in row)
    return {"arc": ROW.tolist(), **values, "errors": errors}


def _percent(fraction: float | None) -> str:
    return "–" if fraction is None else f"{number(fraction, 2, factor=100)} %"
