"""What `study --power` prints: how many subjects and surfaces a study needs, by simulation."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import asdict, fields

import numpy as np

from daq_app.cli.options import add_number, add_seed, numbers_by_key, within
from daq_app.console import DONE, Console, WrongValue, table
from sessions.prediction import BY_NAME
from sessions.prediction.planted_strokes import StudyDesign, planted_strokes
from sessions.statistics.power import TWIN, Judgement, Planted, Recovery, power, recovery

SUBJECTS, SURFACES = (3, 5, 10, 15, 20, 30), (3, 5, 8, 12)  # of the designs whose power is simulated
# Likewise of those that tell quantities apart, or do not: one such study takes a thousand times as long.
RIVAL_SUBJECTS, RIVAL_SURFACES, RIVAL_STUDIES = (12, 24), (5, 8), 40


def add_power(parser: argparse.ArgumentParser) -> None:
    """Declare --power and what goes with it."""
    parser.add_argument(
        "--power",
        nargs="*",
        metavar="NAME=VALUE",
        help="how many subjects and surfaces a study needs, by simulation; what is planted may be set: "
        f"{', '.join(f'{one.name}={one.default:g}' for one in fields(Planted))}",
    )
    parser.add_argument(
        "--depths",
        nargs="+",
        type=within("--depths", float, 0.5, 3.0),
        metavar="MM",
        help="with --power: how often a study whose subjects press each surface to these depths tells --quantity from "
        "its rivals; some minutes",
    )
    add_number(parser, "--studies", int, (20, 100_000), "with --power: simulated per design (400)", 400, "N")
    add_seed(parser, "with --power: of the simulated studies (0)")


def print_power(options: argparse.Namespace, console: Console) -> int:
    """Print the power of designs of so many subjects and surfaces."""
    if options.folder is not None or options.synthetic is not None:
        raise WrongValue("--power simulates its own studies: leave FOLDER and --synthetic out")
    planted = _set(options.power)
    powers = power(
        planted,
        SUBJECTS,
        SURFACES,
        options.studies,
        options.seed,
        lambda part: console.progress(part, f"{part:.0%} of the designs"),
    )
    recoveries = _recovery(options, planted, console)
    designs = [{**asdict(one), "power": one.share} for one in powers]
    console.result({"planted": asdict(planted), "designs": designs, "recovery": [asdict(one) for one in recoveries]})
    rows = [
        [str(people), *(f"{100 * one.share:.0f} ± {100 * one.half:.0f} %" for one in powers if one.subjects == people)]
        for people in SUBJECTS
    ]
    values = ", ".join(f"{one.name} = {getattr(planted, one.name):g}" for one in fields(planted))
    console.say(f"Planted: {values}. The usual values are assumed, not measured.")
    console.say(table(rows, head=["subjects", *(f"{count} surfaces" for count in SURFACES)]))
    console.say(
        "Share of simulated studies whose correlation within subjects has p < 0.05 for other people on the same "
        f"surfaces, of {options.studies} each. They speak of these surfaces, not of others."
    )
    if recoveries:
        _say_recovery(recoveries, options, console)
    else:
        console.say("--depths 1.25 1.75 2.25 simulates how often such a study tells which quantity its scores follow.")
    return DONE


def _recovery(options: argparse.Namespace, planted: Planted, console: Console) -> list[Recovery]:
    """Return how often studies at the depths asked for tell the quantity from its rivals; [] where none are."""
    if not options.depths:
        return []
    depths = tuple(options.depths)
    # Values spread evenly over a range have a standard deviation of the range by the root of 12.
    judgement = Judgement(planted.effect / math.sqrt(12.0), planted.noise, planted.level_sd, planted.slope_sd)
    recoveries: list[Recovery] = []
    count = len(RIVAL_SURFACES) * len(RIVAL_SUBJECTS)
    for surfaces in RIVAL_SURFACES:
        console.progress(len(recoveries) / count, f"strokes on {surfaces} surfaces")
        draw = np.random.default_rng([options.seed, surfaces])
        strokes = planted_strokes(StudyDesign.even(surfaces, depths), max(RIVAL_SUBJECTS), draw)
        for people in RIVAL_SUBJECTS:
            recoveries.append(recovery(strokes, people, depths, options.quantity, judgement, RIVAL_STUDIES, draw))
            console.progress(len(recoveries) / count, f"{people} subjects, {surfaces} surfaces")
    return recoveries


def _say_recovery(recoveries: Sequence[Recovery], options: argparse.Namespace, console: Console) -> None:
    label = BY_NAME[options.quantity].label
    depths = ", ".join(f"{depth:g}" for depth in options.depths)
    console.say(f"Scores that follow {label} with that effect over its range, surfaces pressed to {depths} mm:")
    rows = [
        [
            f"{one.people} × {one.surfaces} × {len(one.depths)}",
            f"{100 * one.preferred:.0f} %",
            f"{100 * one.family:.0f} %",
        ]
        for one in recoveries
    ]
    console.say(table(rows, head=["subjects × surfaces × depths", "preferred", "it or a twin"]))
    twins = ", ".join(recoveries[-1].twins) or "none"
    console.say(
        f"Share of {RIVAL_STUDIES} simulated studies in which it has the greatest Akaike weight of all rivals. Its "
        f"twins in the last row, by r of at least {TWIN:g}: {twins}. The finger is the published one, so real studies "
        "tell less."
    )


def _set(texts: Sequence[str]) -> Planted:
    """Return what is planted, with the values that were set. Raises WrongValue."""
    names = [field.name for field in fields(Planted)]
    changes = numbers_by_key(texts, "--power", "effect=20")
    for name, value in changes.items():
        if name not in names:
            raise WrongValue(f"--power {name}={value:g} is not allowed: one of {', '.join(names)}")
        least = -100.0 if name == "effect" else 0.0
        if not least <= value <= 100.0:
            raise WrongValue(f"--power {name}={value:g} is not allowed: {least:g} to 100")
    return Planted(**changes)
