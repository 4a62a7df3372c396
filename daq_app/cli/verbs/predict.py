"""Predict the strain-energy density at the receptor for each trial of a session, with its error estimate.

Beside it stand the model's force times the finger's width, the measured force, the depth at which they would match, and
the same press slid the other way.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from daq_app.batch.derived import analysed, predicted, visit
from daq_app.cli.area_option import add_area, area_law
from daq_app.cli.calibration_option import add_calibration, calibration_error
from daq_app.cli.model_option import add_kinematics, add_tau
from daq_app.console import Console, WrongValue, number, span, table
from sessions.prediction import (
    QUANTITIES,
    SED,
    PredictionOptions,
    Quantity,
    SessionPrediction,
    TrialPrediction,
    finger_in,
)
from sessions.prediction.afferent import AfferentSettings, firing_document, settings_with
from sessions.prediction.sealed_predictions import SEAL, seal_prediction
from sessions.prediction.sed_interval import SedInterval
from sessions.prediction.series_slopes import other_signs
from sessions.prediction.variants import Alternative

EXAMPLE = "daq-app predict recordings/P07 --tau as-printed"
BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}

INTERVALS = ["trial", "SED [kPa]", "per 0.01 of mu [Pa]", "per kPa of tau_max [Pa]", "slid the other way [kPa]"]
MARKED = "by the solver's tangent, or where marked * by solving draws"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the session and what may be asked of the model."""
    parser.add_argument("session", type=Path, metavar="SESSION|STUDY")
    parser.add_argument("--subject", metavar="CODE", help="of a study: whose visit with forces")
    add_kinematics(
        parser, "small strain (the paper's), or finite strain, where some sticky surfaces have no settled sliding"
    )
    add_tau(
        parser, "reading of the traction bound: force over area, or a hundredth of it, as the paper's tables are headed"
    )
    parser.add_argument(
        "--scene",
        type=Path,
        metavar="FILE",
        help="scene file with another finger; friction and loading are the trials'",
    )
    parser.add_argument("--indentation", type=float, metavar="MM", help="instead of each block's own")
    parser.add_argument(
        "--quantity",
        choices=list(BY_NAME),
        default=SED.name,
        metavar="NAME",
        help=f"of the ending, to print in place of the SED: {', '.join(BY_NAME)}; --json has all",
    )
    parser.add_argument(
        "--beside",
        choices=["none", "small", "both"],
        default="small",
        help="also with tau_max as printed, at the measured force, and slid the other way: at small strain (about a "
        "second), or at finite strain too (about a minute: limits are looked for where a surface has no settled slide)",
    )
    parser.add_argument(
        "--intervals", action="store_true", help="also what the uncertainty of friction makes of each SED (more solves)"
    )
    parser.add_argument(
        "--afferent",
        action="store_true",
        help="also firing rates and spike times of an SA-II afferent that answers to that quantity: an illustration",
    )
    parser.add_argument(
        "--afferent-set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter of the afferent, such as static_gain=30; --afferent prints all of them",
    )
    parser.add_argument("--afferent-seed", type=int, default=0, metavar="SEED", help="of the spike times (0)")
    parser.add_argument(
        "--seal",
        action="store_true",
        help="hash and keep the prediction, so that it is shown to be older than unblinding",
    )
    add_area(parser)
    add_calibration(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Predict, keep the result in the session's folder and print it."""
    if options.afferent_seed < 0:
        raise WrongValue(f"--afferent-seed {options.afferent_seed} is not allowed: a whole number from 0 on")
    afferent = _afferent(options)
    scene, ignored = (None, "") if options.scene is None else finger_in(options.scene)
    if ignored:
        console.note(ignored)
    asked = PredictionOptions(
        tau_reading=options.tau,
        scene=scene,
        indentation=options.indentation,
        kinematics=options.kinematics,
        beside=options.beside,
        intervals=options.intervals,
        beside_intervals=options.intervals,
    )
    recording = visit(options.session, options.subject)
    analysis = analysed(recording, console, area_law(options), gain_error=calibration_error(options))
    prediction = predicted(recording, analysis, console, asked, afferent if options.afferent else None)
    seal = {"sealed_sha256": seal_prediction(recording, prediction.to_dict())} if options.seal else {}
    firing = {"afferent": firing_document(prediction, afferent)} if options.afferent else {}
    console.result({**prediction.to_dict(), **seal, **firing})
    if recording.simulated_sentence:
        console.say(recording.simulated_sentence)
    quantity = BY_NAME[options.quantity]
    unit = "kPa" if quantity.unit == "MPa" else quantity.unit
    head = ["trial", "surface", "mu", "tau_max [kPa]", f"{quantity.label} [{unit}]", "error"]
    rows = [
        [
            str(row.trial or (row.stroke or 0) + 1),
            "–" if row.stimulus is None else row.stimulus.called,
            number(row.mu),
            number(None if row.tau_max is None else row.tau_max * 1e3),
            *_response(row, quantity),
            number(row.normal_force),
            number(row.measured_normal),
            number(row.matching_depth),
        ]
        for row in prediction.trials
    ]
    console.say(
        table(rows, head=[*head, "model N [N]", "measured [N]", "match [mm]"])
        if rows
        else "nothing to predict: no forces were recorded"
    )
    _print_beside(prediction, console)
    if asked.intervals:
        _print_intervals(prediction, console)
        _print_beside_intervals(prediction, console)
    if firing:
        _print_firing(firing["afferent"], console)
    if seal:
        console.say(f"sealed: SHA-256 {seal['sealed_sha256']} in {recording.folder / SEAL}")
    without: defaultdict[tuple[str, str], list[str]] = defaultdict(list)
    for row in prediction.trials:
        for reason in dict.fromkeys(row.reasons.values()):
            missing = ", ".join(name for name, why in row.reasons.items() if why == reason)
            without[missing.replace("_", " "), reason].append(_called(row))
    for (missing, reason), trials in without.items():
        console.say(f"{', '.join(trials)}: no {missing}: {reason}")
    return 3 if any(row.sed is None for row in prediction.trials) else 0


def _response(row: TrialPrediction, quantity: Quantity) -> tuple[str, str]:
    """Return the value of a quantity at the ending, stresses in kPa, and its relative error."""
    if quantity.name not in row.responses:
        return "–", "–"
    value, error = row.responses[quantity.name]
    factor = 1e3 if quantity.unit == "MPa" else 1.0
    return number(factor * value, 4), f"{100 * error / abs(value):.2g} %" if value else "–"


def _print_beside(prediction: SessionPrediction, console: Console) -> None:
    """Print what another finger changes of signs, the SED of each trial in every variant, and why it has none."""
    for sentence in other_signs(prediction.finger):
        console.note(sentence)
    rows = [row for row in prediction.trials if row.alternatives]
    if not rows:
        return
    console.say("\nthe same trials side by side, SED [kPa] with model N [N], or the depth [mm] found under a force:")
    head = ["trial", *(f"({n})" for n, _ in enumerate(rows[0].alternatives, 1))]
    console.say(table([[_called(row), *map(_cell, row.alternatives)] for row in rows], head=head))
    for number_of, one in enumerate(rows[0].alternatives, 1):
        console.say(f"  ({number_of}) {one.variant.sentence}")
    missing: defaultdict[tuple[str, str], list[str]] = defaultdict(list)
    for row in rows:
        for one in row.alternatives:
            if one.sed is None:
                missing[one.variant.sentence, one.reason].append(_called(row))
    for (variant, reason), trials in missing.items():
        console.say(f"{', '.join(trials)}: none for {variant}: {reason}")
    doubt = next((one.doubt for row in rows for one in row.alternatives if one.doubt), "")
    if doubt:
        console.say(f"!: {doubt} (the first of those marked)")


def _called(row: TrialPrediction) -> str:
    return str(row.trial or (row.stroke or 0) + 1)


def _cell(one: Alternative) -> str:
    if one.sed is None:
        return "–"
    beside = one.indentation if one.variant.driven == "force" else one.normal_force
    return f"{number(one.sed * 1e3, 4)} ({number(beside)}){'!' if one.doubt else ''}"


def _print_beside_intervals(prediction: SessionPrediction, console: Console) -> None:
    """Print the interval of each SED in every variant, marked * where it is by solving draws."""
    rows = [row for row in prediction.trials if row.alternatives]
    if not rows:
        return
    console.say(f"\nof the same trials side by side [kPa], {MARKED}:")
    head = ["trial", *(f"({n})" for n, _ in enumerate(rows[0].alternatives, 1))]
    cells = [[_called(row), *(_ends(one.interval) for one in row.alternatives)] for row in rows]
    console.say(table(cells, head=head))
    missing = (
        (f"{_called(row)} ({n})", one.interval)
        for row in rows
        for n, one in enumerate(row.alternatives, 1)
        if one.sed is not None
    )
    _say_missing(missing, console)


def _print_intervals(prediction: SessionPrediction, console: Console) -> None:
    """Print the interval of each SED, marked * where it is by solving draws, and once why others have none."""
    console.say(
        "\n95 % interval of SED from the uncertainty of friction alone, not the model's own error, " + MARKED + ":"
    )
    console.say(table([_row(row) for row in prediction.trials], head=INTERVALS))
    missing = [(_called(row), row.interval) for row in prediction.trials if row.sed is not None]
    back = [
        (f"{_called(row)} the other way", row.opposite_interval)
        for row in prediction.trials
        if row.opposite_sed is not None
    ]
    _say_missing([*missing, *back], console)


def _say_missing(told: Iterable[tuple[str, SedInterval | None]], console: Console) -> None:
    """Say once for each reason which SEDs have no interval: those without an SED have told theirs elsewhere."""
    which: defaultdict[str, list[str]] = defaultdict(list)
    for name, one in told:
        if one is not None and one.low is None:
            which[one.reason].append(name)
    for reason, names in which.items():
        console.say(f"{', '.join(names)}: no interval: {reason}")


def _row(row: TrialPrediction) -> list[str]:
    one = row.interval or SedInterval(None, None, None)
    return [
        _called(row),
        _ends(one),
        number(None if one.by_mu is None else 1e4 * one.by_mu),
        number(None if one.by_tau_max is None else 1e3 * one.by_tau_max),
        _ends(row.opposite_interval),
    ]


def _ends(one: SedInterval | None) -> str:
    if one is None or one.low is None or one.high is None:
        return "none"
    star = "*" if one.method == "sampling" else ""
    return f"{span(1e3 * one.low, 1e3 * one.high, 4)}{star}"


def _afferent(options: argparse.Namespace) -> AfferentSettings:
    """Return the parameters of the afferent with those that were set. Raises WrongValue."""
    changes: dict[str, float] = {}
    for given in options.afferent_set:
        name, _, value = given.partition("=")
        try:
            changes[name.strip()] = float(value)
        except ValueError:
            raise WrongValue(f"--afferent-set {given} is not allowed: NAME=VALUE, such as static_gain=30") from None
    try:
        return settings_with(changes, options.afferent_seed, options.quantity)
    except ValueError as wrong:
        raise WrongValue(f"--afferent-set: {wrong}") from None


def _print_firing(firing: dict[str, Any], console: Console) -> None:
    head = ["trial", "peak rate [imp/s]", "settled rate [imp/s]", "spikes [number]", "in [s]"]
    rows = [
        [
            str(one["trial"] or "–"),
            number(one["peak_rate"]),
            number(one["settled_rate"]),
            str(len(one["spikes"])),
            number(one["time"][-1] - one["time"][0]),
        ]
        for one in firing["trials"]
    ]
    console.say(f"\nSA-II afferent, {firing['about']}:")
    console.say(table(rows, head=head))
    for one in firing["parameters"]:
        console.say(
            f"  {one['name'].replace('_', ' ')} = {one['value']:g} {one['unit']} ({one['standing']}; {one['basis']})"
        )
