"""Pool many sessions: each analysed and predicted, group statistics, a page, and a table of all trials.

Results are kept by the content they were made of, in OUT/results: what was computed once is not computed again, and
Ctrl-C loses nothing that was done. A session that cannot be read is named and left out. Subjects are left out by
decisions in FOLDER/exclusions.toml ([[exclude]] subject, why, who, and descriptor for one alone).
With --power no session is needed: simulated studies say how many subjects and surfaces one needs.
With --synthetic a study of ten simulated subjects is made first, and what was planted is held against what is found.
"""

import argparse
import json
from datetime import datetime
from pathlib import Path
from typing import Any

from daq_app.batch.pool import Shelf, visits
from daq_app.cli.options import (
    LARGEST_SEED,
    add_kinematics,
    add_number,
    add_paths,
    add_quantity,
    add_tau,
    add_workers,
)
from daq_app.cli.session_options import add_analysis, area_law, calibration_error
from daq_app.cli.study_power import add_power, print_power
from daq_app.console import DONE, FLAWED, Console, WrongValue
from sessions.file_access import json_text, read_limited
from sessions.prediction import BY_NAME, SED, PredictionOptions
from sessions.recording import RecordingError
from sessions.recording.schema import LIVE_FILE
from sessions.statistics.pooling.findings import UNITS, StudyFindings
from sessions.statistics.pooling.ground_truth import checked_planted
from sessions.statistics.pooling.pooled import pooled
from sessions.statistics.pooling.visit import VisitOptions, exclusions_in
from sessions.strokes.friction import FIXED

EXAMPLE = "daq-app study recordings --out results"
PLANTED = "planted.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, nargs="?", metavar="FOLDER", help="holds a folder for each session")
    meaning = "make a study of ten simulated subjects instead"
    add_number(parser, "--synthetic", int, (0, LARGEST_SEED), meaning, metavar="SEED")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="page, table and results (FOLDER/pooled); with --synthetic the study too",
    )
    add_workers(parser)
    add_kinematics(parser, "as for 'daq-app predict'; finite strain takes ten times as long")
    add_paths(
        parser,
        "also along every other reasonable choice of the analysis: a second or two more a session; with 'finite' at "
        "finite strain too, up to a minute more",
        "none",
    )
    add_tau(parser, "as for 'daq-app predict'")
    add_quantity(parser, "to hold against scores and rivals")
    parser.add_argument(
        "--intervals",
        action=argparse.BooleanOptionalAction,
        help="what the uncertainty of friction makes of each SED (usual at small strain, not at finite strain, where "
        "it takes longer)",
    )
    add_power(parser)
    add_analysis(parser, "fixed for all sessions, however each was analysed before")


def run(options: argparse.Namespace, console: Console) -> int:
    """Pool the study, write page, table and numbers, and print what it says in short; or print the power of designs."""
    if options.power is not None:
        return print_power(options, console)
    folder, out = _places(options, console)
    sessions = sorted(path.parent for path in folder.glob(f"*/{LIVE_FILE}"))
    if not sessions:
        raise RecordingError(f"{folder} holds no session: give the folder that holds a folder for each of them")
    intervals = options.kinematics == "small" if options.intervals is None else options.intervals
    model = PredictionOptions(options.tau, course="steady", kinematics=options.kinematics, intervals=intervals)
    along = options.quantity if options.paths != "none" else SED.name
    visit_options = VisitOptions(model, area_law(options) or FIXED, options.paths, calibration_error(options), along)
    exclusions, truth = exclusions_in(folder), _planted(folder)  # what is wrong with them is said before hours of work
    shelf = Shelf(out / "results", visit_options)
    done, failed = visits(sessions, visit_options, shelf, console, scheduler=options.scheduler, workers=options.workers)
    if truth is not None and options.quantity == SED.name:
        from daq_app.simulation.ground_truth import (
            planted_relations,  # simulators are loaded only where they are asked for
        )

        truth["relation"] = planted_relations(truth["people"], visit_options.prediction, visit_options.area)
    study = pooled(done, failed, exclusions, truth, visit_options, BY_NAME[options.quantity])
    console.progress(0.97, "writing the page")
    files = _write(study, folder.resolve().name, out)
    console.result({**files, "study": study.to_dict() | {"visits": [visit.session for visit in study.visits]}})
    _print(study, files, console)
    flawed = any(row.flaws for visit in study.visits for row in visit.rows) or any(v.losses for v in study.visits)
    return FLAWED if failed or flawed else DONE


def _planted(folder: Path) -> dict[str, Any] | None:
    """Return what was planted in a synthetic study, None in any other. Raises RecordingError where that is damaged."""
    path = folder / PLANTED
    if not path.is_file():
        return None
    try:
        settings = checked_planted(json.loads(read_limited(path)))
    except ValueError as damaged:
        raise RecordingError(f"{path} is damaged; delete it to pool the study without what was planted") from damaged
    return settings


def _places(options: argparse.Namespace, console: Console) -> tuple[Path, Path]:
    """Return where the sessions lie and where the result goes; makes the synthetic study where one is asked for."""
    if (options.folder is None) == (options.synthetic is None):
        raise WrongValue("give a FOLDER of sessions, or --synthetic SEED, and not both")
    if options.synthetic is None:
        return options.folder, options.out or options.folder / "pooled"
    from daq_app.simulation.synthetic import synthetic_study  # simulators are loaded only where they are asked for

    folder = options.out or Path("synthetic-results") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    synthetic_study(folder, options.synthetic, console)
    return folder, folder / "pooled"


def _write(study: StudyFindings, name: str, out: Path) -> dict[str, str]:
    """Write page, table and numbers and return where they are."""
    # Imported here: drawing is slow to load.
    from sessions.report.html import study_page, swap_in
    from sessions.report.study_csv import COLUMNS, TRIALS, columns_csv, paths_csv, rivals_csv, trials_csv

    files = {"page": out / "study.html", "table": out / TRIALS, "columns": out / COLUMNS, "numbers": out / "study.json"}
    swap_in(files["page"], study_page(study, name))
    swap_in(files["table"], trials_csv(study))
    swap_in(files["columns"], columns_csv(study))
    swap_in(files["numbers"], json_text(study.to_dict()))
    files["rivals"] = out / "rivals.csv"
    swap_in(files["rivals"], rivals_csv(study))
    if study.options.paths != "none":
        files["paths"] = out / "paths.csv"
        swap_in(files["paths"], paths_csv(study))
    return {what: str(path) for what, path in files.items()}


def _print(study: StudyFindings, files: dict[str, str], console: Console) -> None:
    from sessions.report.study_prose import excluded, remarks, summary, told_apart

    console.say(study.simulated or None, *summary(study), *told_apart(study), *excluded(study), *remarks(study))
    for one in study.effects:
        inside = "inside" if one.covered else "OUTSIDE"
        console.say(
            f"planted {one.descriptor}, {one.effect} [{UNITS[one.effect]}]: {one.planted:.3g}, "
            f"found {one.estimate:.3g} ({one.low:.3g} to {one.high:.3g}): {inside}"
        )
    console.say(*(f"{what:8}  {path}" for what, path in files.items()))
