"""Show what affects the predicted response: Sobol indices over a design, or the sign of its slope over many fingers.

With a scene: which of its numbers affect its SED. Without --design, geometry, stiffness, depth, angle and friction
vary around the scene's own values, by ranges that are assumed, not measured; they are printed with the result. A
design is a TOML file: "finger.tip_radius" = [5.0, 6.5] and so on.

Without a scene: whether a response at the receptor rises or falls over the published surfaces, and on which fingers it
keeps that sign: single changes, a map over the receptor's place and the tip radius, and fingers drawn at random.
"""

import argparse
import errno
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from daq_app.batch import sensitivity, sign_map
from daq_app.batch.sign_map import Answer
from daq_app.cli.options import add_seed, add_shared
from daq_app.console import DONE, Console, WrongValue, table
from daq_app.wording import number
from drivers.arrays import Array
from sessions.file_access import remedy
from sessions.prediction import QUANTITIES
from sessions.prediction.surface_series import SERIES
from sessions.recording import RecordingError
from sessions.report.wording import correlation
from sessions.strokes.stroke import digits
from sessions.toml_file import load_toml, tables_in, text_of
from solver import Scene

EXAMPLE = "daq-app sensitivity scene.toml --samples 64"
_NAMES = [quantity.name for quantity in QUANTITIES]
_SAMPLES, OF_FINGERS = 32, 64  # defaults
# Options that do not apply to a single scene, and their defaults.
_OF_FINGERS = {"quantity": "sed", "kinematics": "small", "keep": None, "workers": None, "scheduler": None}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, nargs="?", metavar="SCENE.toml", help="leave out for many fingers")
    parser.add_argument("--design", type=Path, metavar="FILE", help="which numbers to vary, and their ranges")
    fingers = f"{len(sign_map.DESIGN) + 2} N fingers ({OF_FINGERS})"
    meaning = f"N, a power of two: N (numbers + 2) solves ({_SAMPLES}), or {fingers}"
    parser.add_argument("--samples", type=int, metavar="N", help=meaning)
    add_seed(parser, "seed of the samples (0)", largest=math.inf)
    meaning = "file of answers for many fingers, written as they come; a later run continues it"
    parser.add_argument("--keep", type=Path, metavar="FILE", help=meaning)
    meaning = "strain of all fingers, except in the one change that uses the other"
    add_shared(parser, "workers", "scheduler", quantity="whose signs are shown", kinematics=meaning)


def run(options: argparse.Namespace, console: Console) -> int:
    usual = OF_FINGERS if options.scene is None else _SAMPLES
    samples: int = usual if options.samples is None else options.samples
    if not 2 <= samples <= 4096 or samples & (samples - 1):
        raise WrongValue(f"--samples {samples} is not allowed: a power of two from 2 to 4096")
    if options.scene is None:
        if options.design is not None:
            raise WrongValue("--design needs a scene: daq-app sensitivity SCENE.toml --design FILE")
        return _signs(options, samples, console)
    if option := next((name for name, usual_one in _OF_FINGERS.items() if getattr(options, name) != usual_one), None):
        raise WrongValue(f"--{option} is for many fingers, and a scene is one: leave out --{option} or the scene")
    scene = load_toml(options.scene, Scene)
    if options.design is None:
        design, origin = sensitivity.usual_design(scene), "default: nobody set it"
    else:
        file_name = str(options.design)
        ranges = tables_in(text_of(options.design), file_name)
        design, origin = sensitivity.check_design(ranges, scene, file_name), "set"
    progress = console.counter("scenes", samples * (len(design) + 2))
    indices, seds = sensitivity.sensitivity(scene, design, samples, options.seed, progress)
    low, high = float(seds.min()), float(seds.max())
    doubtful = sensitivity.doubts(indices, samples)
    constant = sensitivity.constant_numbers(scene, design)
    console.result(
        samples=samples,
        seed=options.seed,
        design_origin=origin,
        sed_range=[low, high],
        indices=[asdict(index) for index in indices],
        doubts=doubtful,
        not_varied=constant,
    )
    console.say(
        f"SED from {number(low, 4, factor=1e3)} to {number(high, 4, factor=1e3)} kPa over {len(seds)} scenes; "
        f"design {origin}",
        _index_table(indices),
        "Shares of the variance of the SED, Sobol indices with half of their 95 % bootstrap intervals.",
        f"Not varied, so without an index: {', '.join(constant)}." if constant else None,
        *doubtful,
    )
    return DONE


def _signs(options: argparse.Namespace, samples: int, console: Console) -> int:
    """Solve all fingers and print the signs of one quantity's slope, and the shares of all quantities."""
    column_index = _NAMES.index(options.quantity)
    label = QUANTITIES[column_index].label
    changes = sign_map.single_changes(options.kinematics)
    map_trials = sign_map.map_trials(options.kinematics)
    points = sensitivity.saltelli_points(sign_map.DESIGN, samples, options.seed)
    trials = [*changes.values(), *map_trials.values(), *sign_map.sample_fingers(points, options.kinematics)]
    try:
        progress = console.counter("fingers", len(trials))
        answers = sign_map.answers_of(trials, progress, options.keep, options.workers, options.scheduler)
    except OSError as error:
        if options.keep is None:
            raise
        failure = WrongValue if error.errno in (errno.EEXIST, errno.EISDIR) else RecordingError
        raise failure(f"--keep {options.keep} cannot be used ({error.strerror}); {remedy(error, new=True)}") from error
    single = dict(zip(changes, answers, strict=False))
    radii = dict(zip(map_trials, answers[len(changes) :], strict=False))
    random = answers[len(changes) + len(map_trials) :]
    published = single["as published"]
    assert not isinstance(published, str)  # this finger always has an answer
    signs = sign_map.same_signs(random, published)
    shares = {name: sign_map.share(column) for name, column in zip(_NAMES, signs.T, strict=True)}
    indices = {name: sign_map.slope_indices(random, name, column_index, options.seed) for name in SERIES}
    without_answer = int(np.isnan(signs[:, column_index]).sum())
    console.result(
        quantity=options.quantity,
        kinematics=options.kinematics,
        quantities=_NAMES,
        changes=single,
        map={"places": sign_map.PLACES, "radii": {f"{radius:g}": answer for radius, answer in radii.items()}},
        design=sign_map.DESIGN,
        samples=samples,
        seed=options.seed,
        fingers=len(random),
        without_answer=without_answer,
        shares=shares,
        indices={name: [asdict(index) for index in sobol] for name, (sobol, _) in indices.items()},
    )
    _print_changes(single, column_index, console)
    _print_map(radii, column_index, console)
    _print_shares(shares, len(random), without_answer, console)
    if parameter := next((sobol[0].name for sobol, _ in indices.values() if sobol), None):
        _print_thirds(parameter, points, signs[:, column_index], label, console)
    for name, (sobol, count) in indices.items():
        console.say(f"\nWhat affects the change of the {label} over {name} (Sobol indices, {count} fingers):")
        if sobol:
            console.say(_index_table(sobol), *sensitivity.doubts(sobol, samples))
        else:
            console.say("too few complete blocks of the design have an answer: use more --samples")
    return DONE


def _print_shares(
    shares: Mapping[str, tuple[float, float, float] | None], fingers: int, without_answer: int, console: Console
) -> None:
    console.say(
        f"\n{fingers} fingers drawn at random from assumed ranges (below), "
        f"{without_answer} of them without a settled state on three surfaces of each series. "
        "Share of the others that keep both published signs:"
    )
    rows = [
        [quantity.label, f"{100 * share[0]:.0f} %", f"{100 * share[1]:.0f} to {100 * share[2]:.0f} %"]
        for quantity, share in zip(QUANTITIES, shares.values(), strict=True)
        if share is not None
    ]
    console.say(table(rows, header=["quantity", "share", "95 % interval"]))


def _print_changes(single: dict[str, Answer | str], column: int, console: Console) -> None:
    label = QUANTITIES[column].label
    console.say(
        f"{label}: correlation r with the makers' index over the published surfaces, and change from "
        "the least to the greatest mu by the mean"
    )
    rows = [
        [name, *(text for series in SERIES for text in _cells(answer, series, column))]
        for name, answer in single.items()
    ]
    header = ["the published finger, but", *(text for series in SERIES for text in (f"r {series}", "change"))]
    console.say(table(rows, header=header))


def _cells(answer: Answer | str, series: str, column: int) -> tuple[str, str]:
    if isinstance(answer, str):
        return "–", "–"
    with_index, change = (statistic[0][column] for statistic in answer[series])
    if with_index is None or change is None:
        return "no slide", "–"
    return correlation(with_index), f"{digits(100 * change, 0, '+')} %"


def _print_map(radii: dict[float, Answer | str], column: int, console: Console) -> None:
    console.say(
        f"\nSigns of r of the {QUANTITIES[column].label} with stickiness and with slipperiness, over the receptor's "
        "place along the skin [mm, positive to the tip] and the tip radius [mm]:"
    )
    rows = [
        [f"{radius:g}", *(_mark(answer, position, column) for position in range(len(sign_map.PLACES)))]
        for radius, answer in radii.items()
    ]
    console.say(table(rows, header=["", *(digits(position, 2) for position in sign_map.PLACES)]))


def _mark(answer: Answer | str, position: int, column: int) -> str:
    if isinstance(answer, str):
        return "··"
    numbers = [answer[series][0][position][column] for series in SERIES]
    return "".join("·" if r is None else "+" if r > 0.0 else "\N{MINUS SIGN}" for r in numbers)


def _print_thirds(name: str, points: Array, signs: Array, label: str, console: Console) -> None:
    """Print the share of fingers that keep the signs in each third of the most influential number."""
    thirds = sign_map.shares_by_thirds(signs, points[:, list(sign_map.DESIGN).index(name)])
    texts = (f"{100 * part:.0f} % at {number(low)} to {number(high)}" for low, high, part in thirds if part is not None)
    console.say(f"The {label} keeps both signs, by {name}: {', '.join(texts)}.")


def _index_table(indices: Sequence[sensitivity.Index]) -> str:
    rows: list[list[str]] = []
    for index in indices:
        pairs = (index.first, index.first_error), (index.total, index.total_error)
        shares = (f"{digits(share, 2)} ± {error:.2f}" for share, error in pairs)
        rows.append([index.name, f"{number(index.low)} to {number(index.high)}", *shares])
    return table(rows, header=["number", "varied", "alone", "with others"])
