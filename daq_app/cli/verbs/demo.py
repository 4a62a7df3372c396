"""Run the paper's study end to end on the simulated transducer and simulated subjects.

Ten subjects score ten surfaces. One of them repeats the strokes on a simulated force/torque box, which sends its
records over UDP on this computer to the driver of the real box. Everything is recorded, analysed, predicted and
reported.
"""

import argparse
import time
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from daq_app.batch.derived import analyse_session, predict_session
from daq_app.cli.options import add_flag, add_seed
from daq_app.console import DONE, FLAWED, Console, table
from daq_app.simulation.synthetic import Study, StudyCutShort, recordings_in, simulated_study
from daq_app.wording import number
from drivers.clock import LONGEST_STEP, clock_at
from sessions.prediction import PredictionOptions, SessionPrediction
from sessions.recording import Recording
from sessions.statistics.scores import mean_scores
from sessions.strokes import Analysis

EXAMPLE = "daq-app demo --seed 7"
_PACE = 20.0  # simulated seconds per real second


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, metavar="DIR", help="a new folder (demo-results/TIME)")
    add_seed(parser, "seed of the surfaces' noise, the subjects and the orders (1)", 1)
    add_flag(parser, "--real-time", f"run in real time; otherwise time runs {_PACE:g} times as fast")


def run(options: argparse.Namespace, console: Console) -> int:
    results = options.out or Path("demo-results") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    with recordings_in(results):
        return _demonstrate(options, results, console)


def _demonstrate(options: argparse.Namespace, results: Path, console: Console) -> int:
    start = time.monotonic()
    clock = clock_at(1.0 if options.real_time else _PACE, LONGEST_STEP)
    console.say(f"SIMULATED study, seed {options.seed}; time runs {clock.factor:g} times as fast as real")
    try:
        study = simulated_study(results, options.seed, clock, console)
    except StudyCutShort as cut:
        console.note(f"daq-app: {cut}")
        return FLAWED
    recording = Recording.open(study.forces)
    analysis = analyse_session(recording, console)
    prediction = predict_session(recording, analysis, console, PredictionOptions(intervals=True, variants="small"))
    # Imported here: drawing is slow to load, and the session is already on the disk.
    from sessions.report import findings
    from sessions.report.pages import plates, write_figures, write_report
    from sessions.statistics.scores import score_table

    console.progress(0.9, "writing the report")
    scores = [score_table(Recording.open(folder)) for folder in study.scores]
    report = findings(recording, analysis, prediction, scores, study.ground_truth)
    page, pictures = results / "report.html", results / "pictures"
    drawings = plates(report)
    write_report(report, page, drawings)
    write_figures(report, pictures, drawings)

    means = {(score.descriptor, score.index): score.mean for score in mean_scores(scores)}
    rows = _rows(study, analysis, prediction, means)
    flaws, seconds = [flaw.sentence for flaw in analysis.flaws], time.monotonic() - start
    places = {"report": str(page), "pictures": str(pictures), "session": str(study.forces)}
    console.result(
        simulated=True, rows=rows, **places, readings=study.readings, lost=study.lost, flaws=flaws, seconds=seconds
    )
    console.say(
        "",
        _table(rows),
        "",
        f"{study.readings} readings, {study.lost} lost; {seconds:.1f} s in all",
        *(f"flaw: {sentence}" for sentence in flaws),
        *(f"{name:8}  {places[name]}" for name in ("session", "report", "pictures")),
    )
    return FLAWED if analysis.flawed or study.lost else DONE


def _rows(
    study: Study, analysis: Analysis, prediction: SessionPrediction, means: Mapping[tuple[str, int], float | None]
) -> list[dict[str, Any]]:
    """Return a row for each trial: ground truth, estimates, prediction and score."""
    truths = {truth.trial: truth for truth in study.ground_truth}
    speeds = {friction.trial: friction.speed for friction in analysis.friction}
    rows: list[dict[str, Any]] = []
    for row in prediction.trials:
        if (stimulus := row.stimulus) is not None and row.trial is not None:
            truth = {f"planted_{name}": getattr(truths[row.trial], name) for name in ("mu", "tau_max", "speed")}
            estimates = {"mu": row.mu, "tau_max": row.tau_max, "speed": speeds.get(row.trial)}
            answer = {"sed": row.sed, "error_estimate": row.error_estimate}
            score = {"mean_score": means.get((stimulus.descriptor, stimulus.known_index))}
            labels = {"descriptor": stimulus.descriptor, "index": stimulus.index}
            rows.append(labels | truth | estimates | answer | score)
    return sorted(rows, key=lambda row: (row["descriptor"] != "stickiness", row["index"]))


def _table(rows: list[dict[str, Any]]) -> str:
    columns = (  # heading, key of a row, digits, and the heading's unit by the row's
        ("true mu", "planted_mu", 3, 1.0), ("estimated", "mu", 3, 1.0),
        ("true tau [kPa]", "planted_tau_max", 3, 1e3), ("estimated", "tau_max", 3, 1e3),
        ("true V [mm/s]", "planted_speed", 3, 1.0), ("estimated", "speed", 3, 1.0),
        ("SED [kPa]", "sed", 4, 1e3), ("mean score", "mean_score", 3, 1.0),
    )  # fmt: skip
    cells = [
        [f"{row['descriptor']} {row['index']}", *(number(row[key], n, factor=unit) for _, key, n, unit in columns)]
        for row in rows
    ]
    return table(cells, header=["SIMULATED", *(heading for heading, *_ in columns)])
