"""Tell which of a scene's numbers moves the predicted SED: Sobol indices over a design.

Without --design geometry, stiffness, depth, angle and friction are varied around the scene's own values by ranges that
nobody measured; they are printed with the result. A design is a TOML file: "finger.tip_radius" = [4.0, 6.5] and so on.
"""

import argparse
from pathlib import Path

from daq_app.batch.sensitivity import checked, doubts, left_as_it_is, sensitivity, usual_design
from daq_app.console import Console, WrongValue, number, table
from sessions.toml_file import load_toml, tables_in, text_of
from solver import Scene

EXAMPLE = "daq-app sensitivity scene.toml --samples 64"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scene, design, samples and seed."""
    parser.add_argument("scene", type=Path, metavar="SCENE.toml")
    parser.add_argument("--design", type=Path, metavar="FILE", help="which numbers are varied, and how far")
    parser.add_argument(
        "--samples", type=int, default=32, metavar="N", help="a power of two; N (numbers + 2) solves (32)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the samples (0)")


def run(options: argparse.Namespace, console: Console) -> int:
    """Solve the design and print the indices."""
    samples: int = options.samples
    if not 2 <= samples <= 4096 or samples & (samples - 1):
        raise WrongValue(f"--samples {samples} is not allowed: a power of two from 2 to 4096")
    scene = load_toml(options.scene, Scene)
    if options.design is None:
        design, origin = usual_design(scene), "default: nobody set it"
    else:
        where = str(options.design)
        design, origin = checked(tables_in(text_of(options.design), where), scene, where), "set"
    count = samples * (len(design) + 2)

    def shown(part: float) -> None:
        console.progress(part, f"{round(part * count)} of {count} scenes")

    indices, seds = sensitivity(scene, design, samples, options.seed, shown)
    low, high = float(seds.min()), float(seds.max())
    rows = [
        [
            one.name,
            f"{number(one.low)} to {number(one.high)}",
            f"{one.first:.2f} ± {one.first_error:.2f}",
            f"{one.total:.2f} ± {one.total_error:.2f}",
        ]
        for one in indices
    ]
    doubted = doubts(indices, samples)
    told = {"samples": samples, "seed": options.seed, "design_origin": origin, "sed_range": [low, high]}
    left = left_as_it_is(scene, design)
    console.result({**told, "indices": [one.to_dict() for one in indices], "doubts": doubted, "not_varied": left})
    console.say(
        f"SED from {number(1e3 * low, 4)} to {number(1e3 * high, 4)} kPa over {len(seds)} scenes; design {origin}"
    )
    console.say(table(rows, head=["number", "varied", "alone", "with others"]))
    console.say("Shares of the variance of the SED, Sobol indices with half of their 95 % bootstrap intervals.")
    if left:
        console.say(f"Not varied, so nothing is said of them: {', '.join(left)}.")
    for sentence in doubted:
        console.say(sentence)
    return 0
