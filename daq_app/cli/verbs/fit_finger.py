"""Fit the stiffness of each layer of a subject's own finger to presses whose displacement a stage logged.

The session holds presses without a slide; the log holds the displacement of the bone or the stage, positive into the
finger. Its header has displacement_mm and one of time_s, received_ns or sequence (as in readings.csv of an export), and
may have contact_width_mm. Nothing in the session is changed. 'predict --scene' and 'solve' accept the scene written by
--scene.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from daq_app.batch.derived import open_visit, stored_settings
from daq_app.cli.options import add_calibration, add_flag, add_number, add_seed, add_visit
from daq_app.console import DONE, FLAWED, Console, WrongValue, table
from daq_app.wording import number, span
from sessions.exchange.csv_text import displacement_log
from sessions.file_access import check_replaceable, write_whole
from sessions.plan.plan import SessionPlan
from sessions.prediction import PredictionOptions, finger_in, with_own_finger
from sessions.prediction.finger_fit import FingerFit, Interval, fit
from sessions.prediction.options import template
from sessions.prediction.press_curves import PressCurves, press_curves
from sessions.prediction.press_model import LAYERS, Check, FitError, check, press_model
from sessions.prediction.relaxation_fit import RelaxationFit, relaxing_fit
from sessions.recording import Recording
from sessions.strokes import AnalysisSettings
from sessions.toml_file import toml_text
from solver import Scene

EXAMPLE = "daq-app fit-finger recordings/P07 --displacement stage.csv --scene P07-finger.toml"
SCENE_HEAD = "# A finger found by 'daq-app fit-finger'"  # first line of the scene file
_MU, FACTOR = 0.5, 2.0  # defaults of --mu and --prior
DEEPER = 1.1  # greatest depth of the model by the stage's, as contact may begin before the detected onset [-]
FALL = 0.05  # relative fall of the force in a hold above which relaxation is reported [-]
AGREE = 0.02  # relative difference of the solver's forces from the fitted ones above which there is a flaw [-]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_visit(parser)
    parser.add_argument("--displacement", type=Path, required=True, metavar="FILE.csv", help="log of the stage")
    meaning = "scene file with the finger's dimensions (else the session's own)"
    parser.add_argument("--finger", type=Path, metavar="FILE", help=meaning)
    add_number(parser, "--shift", float, (-1e9, 1e9), "time to add to the log's times (0)", 0.0, "S")
    meaning = f"friction of the surface pressed ({_MU:g}, assumed; from 0.3 on the force hardly changes)"
    add_number(parser, "--mu", float, (0.0, 5.0), meaning, _MU, "MU")
    meaning = f"one standard deviation of each stiffness about the published one, as a factor ({FACTOR:g}, assumed)"
    add_number(parser, "--prior", float, (1.1, 4.0), meaning, FACTOR, "FACTOR")
    add_flag(parser, "--relaxation", "also fit how the finger relaxes while the stage holds; --scene includes it")
    add_seed(parser, "seed of the posterior's draws (0)", largest=2**32)
    parser.add_argument("--scene", type=Path, metavar="OUT.toml", help="write the fitted finger as a scene file")
    add_calibration(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    if options.scene is not None and not options.scene.parent.is_dir():
        raise WrongValue(f"--scene {options.scene} is not allowed: there is no folder {options.scene.parent}")
    if options.scene is not None:
        check_replaceable(options.scene, SCENE_HEAD)
    recording, _, unreadable = open_visit(options.session, options.subject, console)
    settings = stored_settings(recording)
    if options.calibration_error is not None:
        settings = replace(settings, gain_error=options.calibration_error)
    curves = _curves(options, recording, settings)
    flaws = [*curves.left_out, *([] if options.relaxation else _relaxation_flaws(curves))]
    console.note(*flaws)
    outcome = _fit(options, recording.plan, curves, settings.gain_uncertainty, console)
    simulated = recording.simulated_sentence
    if options.scene is not None:
        mark = f"# {simulated}\n" if simulated else ""
        write_whole(options.scene, f"{mark}{SCENE_HEAD}\n{toml_text(outcome.scene)}".encode())
    assumed = {"mu": options.mu, "prior_factor": options.prior, "calibration_error": settings.gain_uncertainty}
    shares = dict(zip(LAYERS, outcome.check.shares.tolist(), strict=True))
    console.result(
        **({"simulated": "SIMULATED"} if simulated else {}),
        **outcome.fit.to_dict(),
        **({} if outcome.relaxation is None else {"relaxation": outcome.relaxation.to_dict()}),
        presses=curves.names,
        flaws=flaws,
        check={"deviation": outcome.check.deviation, "shares": shares},
        assumed=assumed | {"width": outcome.scene.finger.width, "seed": options.seed},
    )
    console.say(simulated)
    _print(outcome, options, console)
    return FLAWED if unreadable or flaws or outcome.check.deviation > AGREE else DONE


class _Outcome(NamedTuple):
    fit: FingerFit
    check: Check
    relaxation: RelaxationFit | None

    @property
    def scene(self) -> Scene:
        """Return the scene with the estimated finger."""
        return self.fit.scene if self.relaxation is None else self.relaxation.relaxing(self.fit.scene)


def _curves(options: argparse.Namespace, recording: Recording, settings: AnalysisSettings) -> PressCurves:
    """Return the presses that the log covers. Raises FitError if there are none, and ImportRefused."""
    log = displacement_log(options.displacement)
    if options.shift and log.clock == "sequence":
        raise WrongValue("--shift applies to times, and the log counts readings: leave it out")
    shift = options.shift * (1e9 if log.clock == "received_ns" else 1.0)
    curves = press_curves(recording, replace(log, instants=log.instants + shift), settings)
    if not curves.presses:
        reason = f" {curves.left_out[0]}" if curves.left_out else ""
        raise FitError(
            f"{recording.folder} holds no press that {options.displacement} covers.{reason} Press straight down, "
            "hold for half a second without a slide, and log on the session's clock."
        )
    return curves


def _relaxation_flaws(curves: PressCurves) -> list[str]:
    """Return a flaw for relaxation in a hold, which distorts the curve of force over depth."""
    fall = max((hold.fall for hold in curves.holds if hold is not None), default=0.0)
    flaw = (
        f"The force falls by {100.0 * fall:.0f} % while the stage holds: the finger relaxes, which distorts the force "
        "on the way down too, and layers are off by more than their intervals; use --relaxation."
    )
    return [flaw] if fall > FALL else []


def _fit(
    options: argparse.Namespace, plan: SessionPlan, curves: PressCurves, gain_error: float, console: Console
) -> _Outcome:
    """Return the fit to the presses, and the solver's check of the fitted finger. Raises FitError."""
    holds = [(press, hold) for press, hold in zip(curves.presses, curves.holds, strict=True) if hold is not None]
    if options.relaxation and not holds:
        raise FitError("No press is held: hold the stage still for half a second or more, or leave --relaxation out.")
    scene, _ = (None, "") if options.finger is None else finger_in(options.finger)
    finger = template(with_own_finger(PredictionOptions(scene=scene), plan))
    progress = console.reporter("solving presses")
    deepest = max(float(press.displacement.max() - press.touch) for press in curves.presses)  # [mm]
    model = press_model(finger, float(np.log(options.prior)), DEEPER * deepest, options.mu, progress)
    if options.relaxation:
        presses, hold_curves = [press for press, _ in holds], [hold for _, hold in holds]
        finger_fit, rate = relaxing_fit(model, presses, hold_curves, gain_error, options.seed)
    else:
        finger_fit, rate = fit(model, curves.presses, gain_error, options.seed), None
    solver_check = check(model, np.array([layer.stiffness.value for layer in finger_fit.layers]), finger_fit.deepest)
    return _Outcome(finger_fit, solver_check, rate)


def _print(outcome: _Outcome, options: argparse.Namespace, console: Console) -> None:
    finger_fit, solver_check = outcome.fit, outcome.check
    rows: list[list[str]] = []
    for layer, share in zip(finger_fit.layers, solver_check.shares, strict=True):
        intervals = map(_interval_text, (layer.stiffness, layer.profile, layer.prior))
        rows.append([layer.name, number(layer.stiffness.value, factor=1e3), *intervals, f"{100 * share:.0f} %"])
    console.say(table(rows, header=["E [kPa]", "fit", "95 % interval", "by likelihood alone", "prior", "share of N"]))
    overall, (low, high) = finger_fit.overall, (finger_fit.overall.low or 0.0, finger_fit.overall.high or 0.0)
    console.say(
        f"overall stiffness: {number(overall.value)} of the published finger's, 95 % interval {span(low, high)}, from "
        f"{finger_fit.points} points of {len(finger_fit.touch)} presses up to {number(finger_fit.deepest)} mm"
        + (f", and {finger_fit.widths} lengths of contact" if finger_fit.widths else "")
    )
    console.say(*(layer.sentence for layer in finger_fit.layers))
    if outcome.relaxation is not None:
        share, time = outcome.relaxation.part, outcome.relaxation.time
        console.say(
            f"relaxation: part {share.value:.2f} (95 % {_interval_text(share, 1.0)}), time {number(time.value)} s "
            f"(95 % {_interval_text(time, 1.0)}); the stiffness above is the instantaneous one"
        )
        console.say(outcome.relaxation.sentence)
    console.say(
        f"Assumed: friction {options.mu:g}, width {finger_fit.scene.finger.width:g} mm, a prior of a factor "
        f"{options.prior:g}. The stiffness is by the width: a finger twice as wide is half as stiff."
    )
    agree = "agree with" if solver_check.deviation <= AGREE else "DIFFER from"
    percent = number(solver_check.deviation, 1, factor=100)
    console.say(f"The solver's own forces {agree} those fitted: by {percent} % at most.")
    if options.scene is not None:
        console.say(f"finger: {options.scene}, for 'daq-app predict SESSION --scene {options.scene}'")


def _interval_text(interval: Interval, unit: float = 1e-3) -> str:
    """Return an interval as text in a unit, by default MPa shown in kPa."""
    low, high = ("open" if limit is None else number(limit / unit) for limit in (interval.low, interval.high))
    return f"{low} to {high}"
