"""Run the solver once, on a scene file."""

import argparse
from pathlib import Path

from daq_app.console import Console, number, table

EXAMPLE = "daq-app solve stickiness-100.toml --json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the scene file."""
    parser.add_argument("scene", type=Path, metavar="SCENE.toml", help="finger, materials, friction, loading, receptor")


def run(options: argparse.Namespace, console: Console) -> int:
    """Solve the scene and print what came out."""
    from sessions.toml_file import load_toml
    from solver.failures import SolveFailure
    from solver.scene import Scene
    from solver.solution import solve

    scene = load_toml(options.scene, Scene)
    try:
        found = solve(scene)
    except SolveFailure as failure:
        console.result(failure.to_dict())
        raise
    console.result(found.to_dict())
    console.say(scene.title or options.scene.name)
    rows = [
        ["SED at the ending", number(found.sed_ending * 1e3, 5), "kPa"],
        ["its relative error, estimated", number(found.error_estimate, 2), ""],
        ["SED at the point", number(found.sed_point * 1e3, 5), "kPa"],
        ["normal force", number(found.normal_force, 5), "N/mm"],
        ["tangential force", number(found.tangential_force, 5), "N/mm"],
        ["contact width", number(found.contact_width, 3), "mm"],
        ["indentation", number(found.indentation, 4), "mm"],
        *([] if found.shift is None else [["sideways shift", number(found.shift, 4), "mm"]]),
        ["unknowns", str(found.dofs), ""],
        ["solving took", number(found.wall_s * 1e3, 3), "ms"],
        ["setting up took", number(found.setup_s * 1e3, 3), "ms"],
    ]
    console.say(table(rows, head=["", "", ""]))
    for warning in found.warnings:
        console.note(f"note: {warning}")
    return 0
