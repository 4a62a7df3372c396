"""Predict the strain-energy density at the receptor for each trial of a session, with its error estimate.

It also prints the model's force times the finger's width, the measured force, the depth at which they would match, and
the same press slid the other way.
"""

import argparse
import math
from dataclasses import replace
from pathlib import Path

from daq_app.batch.derived import analyse_session, open_visit, predict_session, stored_options
from daq_app.cli.options import add_analysis, add_flag, add_number, add_shared, add_visit, area_law, numbers_by_key
from daq_app.console import DONE, FLAWED, Console, WrongValue, table
from daq_app.wording import no_strokes, number
from sessions.plan.protocols.protocol import DEEPEST_INDENTATION, INDENTATIONS
from sessions.prediction import BY_NAME, SED, PredictionOptions, SessionPrediction, TrialPrediction, finger_in
from sessions.prediction.afferent import AfferentSettings, firing_document, session_firing, settings_with
from sessions.prediction.sealed_predictions import SEAL, check_unsealed, seal_prediction
from sessions.prediction.stored import SedInterval
from sessions.prediction.surface_series import other_signs
from sessions.recording import Recording
from sessions.strokes import Analysis
from solver.prediction import percent

EXAMPLE = "daq-app predict recordings/P07 --tau as-printed"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_visit(parser)
    add_shared(
        parser,
        kinematics="small strain (the paper's), or finite strain, where some sticky surfaces have no settled sliding",
        tau="how to read the traction bound: force over area, or a hundredth of it, as the paper's tables are headed",
        quantity="to print (--json has all)",
        variants="also with tau_max as printed, at the measured force, and slid the other way: at small strain (about "
        "a second), or at finite strain too (about a minute: limits are computed where a surface has no settled "
        "slide); by default small, or as predicted before",
    )
    meaning = "scene file with another finger; friction and loading stay those of the trials"
    parser.add_argument("--scene", type=Path, metavar="FILE", help=meaning)
    span = (math.ulp(0.0), DEEPEST_INDENTATION)
    add_number(parser, "--indentation", float, span, "in place of each block's own", None, "MM", INDENTATIONS)
    meaning = "also the interval of each SED from the uncertainty of friction (more solves; as predicted before)"
    parser.add_argument("--intervals", action=argparse.BooleanOptionalAction, help=meaning)
    meaning = "also firing rates and spike times of an SA-II afferent responding to --quantity: an illustration"
    add_flag(parser, "--afferent", meaning)
    meaning = "a parameter of the afferent, such as static_gain=30; --afferent prints all of them"
    parser.add_argument("--afferent-set", action="append", default=[], metavar="NAME=VALUE", help=meaning)
    add_number(parser, "--afferent-seed", int, (0, math.inf), "seed of the spike times (0)", 0, "SEED")
    add_flag(parser, "--seal", "hash and keep the prediction, to prove that it is older than unblinding")
    add_analysis(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    afferent = _afferent(options)
    scene, remark = (None, "") if options.scene is None else finger_in(options.scene)
    console.note(remark or None)
    recording, _, unreadable = open_visit(options.session, options.subject, console)
    if options.seal:
        check_unsealed(recording)
    stored = stored_options(recording, "small")
    if options.intervals is not None:
        stored = replace(stored, intervals=options.intervals, variant_intervals=options.intervals)
    choices = PredictionOptions(
        options.tau,
        scene,
        options.indentation,
        kinematics=options.kinematics,
        intervals=stored.intervals,
        variant_intervals=stored.variant_intervals,
        variants=options.variants or stored.variants,
    )
    analysis = analyse_session(recording, console, area_law(options), gain_error=options.calibration_error)
    if options.indentation is None and not recording.plan.blocks and analysis.strokes:
        advice = "give the depth in mm with --indentation, such as --indentation 2"
        raise WrongValue(f"{recording.folder} has no plan that says how deep the model is pressed: {advice}")
    prediction = predict_session(recording, analysis, console, choices, afferent if options.afferent else None)
    seal = {"sealed_sha256": seal_prediction(recording, prediction.to_dict())} if options.seal else {}
    firing = {"afferent": firing_document(prediction, afferent)} if options.afferent else {}
    console.result(**prediction.to_dict(), **seal, **firing)
    console.note(*other_signs(prediction.finger))
    console.say(recording.simulated_sentence)
    if not console.as_json:
        _print(options, recording, analysis, prediction, afferent, console)
    for parameter in firing["afferent"]["parameters"] if firing else ():
        name, origin = parameter["name"].replace("_", " "), f"{parameter['standing']}; {parameter['basis']}"
        console.say(f"  {name} = {parameter['value']:g} {parameter['unit']} ({origin})")
    if seal:
        console.say(f"sealed: SHA-256 {seal['sealed_sha256']} in {recording.folder / SEAL}")
    return FLAWED if unreadable or any(row.sed is None for row in prediction.trials) else DONE


def _print(
    options: argparse.Namespace,
    recording: Recording,
    analysis: Analysis,
    prediction: SessionPrediction,
    afferent: AfferentSettings,
    console: Console,
) -> None:
    """Print the report's tables of the trials, and the numbers without a column there."""
    from daq_app.cli.report_tables import table_texts  # slow to load
    from sessions.report import Further, numbers_alone

    if not prediction.trials:
        console.say(f"nothing to predict: {no_strokes(recording.info)}")
        return
    further = Further()
    if options.afferent:
        further = Further(session_firing(prediction, afferent)[1], firing_settings=afferent)
    console.say(*table_texts(numbers_alone(recording, analysis, prediction, further), "predictions", "afferent"))
    trials = [(str(row.trial or (row.stroke or 0) + 1), row) for row in prediction.trials]
    quantity = BY_NAME[options.quantity]
    if quantity.name != SED.name:
        unit, factor = quantity.shown_unit
        cells = [[trial, *_response(row, quantity.name, factor)] for trial, row in trials]
        console.say("", table(cells, header=["trial", f"{quantity.label} [{unit}]", "error"]))
    if prediction.options.intervals:
        slopes = [(trial, row.interval or SedInterval(None, None, None)) for trial, row in trials]
        cells = [[trial, number(sed.by_mu, factor=1e4), number(sed.by_tau_max, factor=1e3)] for trial, sed in slopes]
        header = ["trial", "SED per 0.01 of mu [Pa]", "per kPa of tau_max [Pa]"]
        console.say("\nby the solver's tangent:", table(cells, header=header))


def _response(row: TrialPrediction, name: str, factor: float) -> tuple[str, str]:
    """Return the value of a quantity at the ending, times a factor, and its relative error, as texts."""
    if name not in row.responses:
        return "–", "–"
    value, error = row.responses[name]
    return number(value, 4, factor=factor), percent(error / abs(value)) if value else "–"


def _afferent(options: argparse.Namespace) -> AfferentSettings:
    """Return the afferent's parameters, with those set by options. Raises WrongValue."""
    changes = numbers_by_key(options.afferent_set, "--afferent-set", "static_gain=30")
    try:
        return settings_with(changes, options.afferent_seed, options.quantity)
    except ValueError as wrong:
        raise WrongValue(f"--afferent-set: {wrong}") from None
