"""Predict the strain-energy density at the receptor for each trial of a session, with its error estimate.

Beside it stand the model's force times the finger's width, the measured force, the depth at which they would match, and
the same press slid the other way.
"""

import argparse
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from daq_app.batch.derived import analyse_session, open_visit, predict_session
from daq_app.cli.options import (
    add_analysis,
    add_flag,
    add_kinematics,
    add_number,
    add_quantity,
    add_tau,
    add_variants,
    add_visit,
    area_law,
    calibration_error,
    numbers_by_key,
)
from daq_app.console import DONE, FLAWED, Console, WrongValue, table
from daq_app.wording import number, span
from sessions.prediction import (
    BY_NAME,
    PredictionOptions,
    SessionPrediction,
    TrialPrediction,
    finger_in,
)
from sessions.prediction.afferent import AfferentSettings, firing_document, settings_with
from sessions.prediction.sealed_predictions import SEAL, seal_prediction
from sessions.prediction.stored import Alternative, SedInterval
from sessions.prediction.surface_series import other_signs
from solver.prediction import percent

EXAMPLE = "daq-app predict recordings/P07 --tau as-printed"

INTERVALS = ["trial", "SED [kPa]", "per 0.01 of mu [Pa]", "per kPa of tau_max [Pa]", "slid the other way [kPa]"]
MARKED = "by the solver's tangent, or where marked * by solving draws"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_visit(parser)
    add_kinematics(
        parser, "small strain (the paper's), or finite strain, where some sticky surfaces have no settled sliding"
    )
    add_tau(
        parser, "reading of the traction bound: force over area, or a hundredth of it, as the paper's tables are headed"
    )
    meaning = "scene file with another finger; friction and loading are the trials'"
    parser.add_argument("--scene", type=Path, metavar="FILE", help=meaning)
    parser.add_argument("--indentation", type=float, metavar="MM", help="instead of each block's own")
    add_quantity(parser, "to print (--json has all)")
    add_variants(
        parser,
        "also with tau_max as printed, at the measured force, and slid the other way: at small strain (about a "
        "second), or at finite strain too (about a minute: limits are looked for where a surface has no settled slide)",
        "small",
    )
    add_flag(parser, "--intervals", "also what the uncertainty of friction makes of each SED (more solves)")
    meaning = "also firing rates and spike times of an SA-II afferent that answers to that quantity: an illustration"
    add_flag(parser, "--afferent", meaning)
    meaning = "a parameter of the afferent, such as static_gain=30; --afferent prints all of them"
    parser.add_argument("--afferent-set", action="append", default=[], metavar="NAME=VALUE", help=meaning)
    add_number(parser, "--afferent-seed", int, (0, math.inf), "of the spike times (0)", 0, "SEED")
    add_flag(parser, "--seal", "hash and keep the prediction, so that it is shown to be older than unblinding")
    add_analysis(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    afferent = _afferent(options)
    scene, ignored = (None, "") if options.scene is None else finger_in(options.scene)
    console.note(ignored or None)
    stated = {name: getattr(options, name) for name in ("indentation", "kinematics", "variants", "intervals")}
    choices = PredictionOptions(options.tau, scene=scene, variant_intervals=options.intervals, **stated)
    recording, _, unreadable = open_visit(options.session, options.subject, console)
    analysis = analyse_session(recording, console, area_law(options), gain_error=calibration_error(options))
    prediction = predict_session(recording, analysis, console, choices, afferent if options.afferent else None)
    seal = {"sealed_sha256": seal_prediction(recording, prediction.to_dict())} if options.seal else {}
    firing = {"afferent": firing_document(prediction, afferent)} if options.afferent else {}
    console.result({**prediction.to_dict(), **seal, **firing})
    console.say(recording.simulated_sentence)
    quantity = BY_NAME[options.quantity]
    unit, factor = quantity.shown_unit
    head = ["trial", "surface", "mu", "tau_max [kPa]", f"{quantity.label} [{unit}]", "error"]
    rows = [
        [
            _trial_label(row),
            "–" if row.stimulus is None else row.stimulus.display_name,
            number(row.mu),
            number(row.tau_max, factor=1e3),
            *_response(row, quantity.name, factor),
            number(row.normal_force),
            number(row.measured_normal),
            number(row.matching_depth),
        ]
        for row in prediction.trials
    ]
    console.say(
        table(rows, head=[*head, "model N [N]", "measured [N]", "match [mm]"])
        if rows
        else f"nothing to predict: no {'forces were recorded' if recording.info is None else 'stroke was found'}"
    )
    _print_variants(prediction, console)
    if choices.intervals:
        _print_intervals(prediction, console)
        _print_variant_intervals(prediction, console)
    if firing:
        _print_firing(firing["afferent"], console)
    if seal:
        console.say(f"sealed: SHA-256 {seal['sealed_sha256']} in {recording.folder / SEAL}")
    _print_once(console, ((_trial_label(row), words) for row in prediction.trials for words in _reasons(row)))
    return FLAWED if unreadable or any(row.sed is None for row in prediction.trials) else DONE


def _reasons(row: TrialPrediction) -> Iterator[str]:
    """Yield what has no value, and why, once for each reason."""
    for reason in dict.fromkeys(row.reasons.values()):
        missing = ", ".join(name for name, why in row.reasons.items() if why == reason)
        yield f"no {missing.replace('_', ' ')}: {reason}"


def _print_once(console: Console, sentences: Iterable[tuple[str, str]]) -> None:
    """Print each sentence once, after the names of all that it holds for; each pair is a name and a sentence."""
    by_sentence: defaultdict[str, list[str]] = defaultdict(list)
    for name, sentence in sentences:
        by_sentence[sentence].append(name)
    console.say(*(f"{', '.join(names)}: {sentence}" for sentence, names in by_sentence.items()))


def _response(row: TrialPrediction, name: str, factor: float) -> tuple[str, str]:
    """Return the value of a quantity at the ending, times a factor, and its relative error."""
    if name not in row.responses:
        return "–", "–"
    value, error = row.responses[name]
    return number(value, 4, factor=factor), percent(error / abs(value)) if value else "–"


def _print_variants(prediction: SessionPrediction, console: Console) -> None:
    """Print what another finger changes of signs, the SED of each trial in every variant, and why it has none."""
    console.note(*other_signs(prediction.finger))
    rows = [row for row in prediction.trials if row.alternatives]
    if not rows:
        return
    console.say("\nthe same trials side by side, SED [kPa] with model N [N], or the depth [mm] found under a force:")
    variants = {f"({place})": one.variant.sentence for place, one in enumerate(rows[0].alternatives, 1)}
    console.say(table([[_trial_label(row), *map(_cell, row.alternatives)] for row in rows], head=["trial", *variants]))
    console.say(*(f"  {mark} {sentence}" for mark, sentence in variants.items()))
    pairs = [(_trial_label(row), one) for row in rows for one in row.alternatives]
    _print_once(
        console, ((trial, f"none for {one.variant.sentence}: {one.reason}") for trial, one in pairs if one.sed is None)
    )
    doubt = next((one.doubt for _, one in pairs if one.doubt), "")
    console.say(f"!: {doubt} (the first of those marked)" if doubt else None)


def _trial_label(row: TrialPrediction) -> str:
    return str(row.trial or (row.stroke or 0) + 1)


def _cell(one: Alternative) -> str:
    if one.sed is None:
        return "–"
    companion = one.indentation if one.variant.driven == "force" else one.normal_force
    return f"{number(one.sed, 4, factor=1e3)} ({number(companion)}){'!' if one.doubt else ''}"


def _print_variant_intervals(prediction: SessionPrediction, console: Console) -> None:
    """Print the interval of each SED in every variant, marked * where it is by solving draws."""
    rows = [row for row in prediction.trials if row.alternatives]
    if not rows:
        return
    console.say(f"\nof the same trials side by side [kPa], {MARKED}:")
    head = ["trial", *(f"({n})" for n, _ in enumerate(rows[0].alternatives, 1))]
    cells = [[_trial_label(row), *(_ends(one.interval) for one in row.alternatives)] for row in rows]
    console.say(table(cells, head=head))
    alternatives = ((_trial_label(row), n, one) for row in rows for n, one in enumerate(row.alternatives, 1))
    _print_missing(((f"{trial} ({n})", one.interval) for trial, n, one in alternatives if one.sed is not None), console)


def _print_intervals(prediction: SessionPrediction, console: Console) -> None:
    """Print the interval of each SED, marked * where it is by solving draws, and once why others have none."""
    console.say(
        "\n95 % interval of SED from the uncertainty of friction alone, not the model's own error, " + MARKED + ":"
    )
    console.say(table([_row(row) for row in prediction.trials], head=INTERVALS))
    forth = [(_trial_label(row), row.sed, row.interval) for row in prediction.trials]
    back = [
        (f"{_trial_label(row)} the other way", row.opposite_sed, row.opposite_interval) for row in prediction.trials
    ]
    _print_missing([(name, interval) for name, sed, interval in (*forth, *back) if sed is not None], console)


def _print_missing(intervals: Iterable[tuple[str, SedInterval | None]], console: Console) -> None:
    """Print why SEDs have no interval: those without an SED have their reason elsewhere."""
    _print_once(
        console,
        ((name, f"no interval: {one.reason}") for name, one in intervals if one is not None and one.low is None),
    )


def _row(row: TrialPrediction) -> list[str]:
    one = row.interval or SedInterval(None, None, None)
    return [
        _trial_label(row),
        _ends(one),
        number(one.by_mu, factor=1e4),
        number(one.by_tau_max, factor=1e3),
        _ends(row.opposite_interval),
    ]


def _ends(one: SedInterval | None) -> str:
    if one is None or one.low is None or one.high is None:
        return "none"
    star = "*" if one.method == "sampling" else ""
    return f"{span(1e3 * one.low, 1e3 * one.high, 4)}{star}"


def _afferent(options: argparse.Namespace) -> AfferentSettings:
    """Return the parameters of the afferent with those that were set. Raises WrongValue."""
    changes = numbers_by_key(options.afferent_set, "--afferent-set", "static_gain=30")
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
    console.say(f"\nSA-II afferent, {firing['about']}:", table(rows, head=head))
    console.say(
        *(
            f"  {one['name'].replace('_', ' ')} = {one['value']:g} {one['unit']} ({one['standing']}; {one['basis']})"
            for one in firing["parameters"]
        )
    )
