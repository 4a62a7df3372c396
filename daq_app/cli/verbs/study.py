"""Pool many sessions: analyse and predict each, and write group statistics, a page, and a table of all trials.

Results are stored in OUT/results by the content they depend on: nothing is computed twice, and Ctrl-C loses no finished
result. A session that cannot be read is named and left out. FOLDER/exclusions.toml excludes subjects ([[exclude]]
subject, why, who, and descriptor for one alone).
With --power no session is needed: simulated studies show how many subjects and surfaces a study needs.
With --synthetic a study of ten simulated subjects is made first, and its ground truth is compared with the estimates.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from daq_app.batch.pool import Shelf, visits
from daq_app.cli.options import (
    LARGEST_STUDY_SEED,
    add_analysis,
    add_number,
    add_seed,
    add_shared,
    area_law,
    number_in_range,
    numbers_by_key,
)
from daq_app.console import DONE, FLAWED, Console, WrongValue, table
from daq_app.wording import number, span
from sessions.file_access import json_text, json_value, read_within_limit
from sessions.prediction import BY_NAME, SED, PredictionOptions
from sessions.prediction.surface_series import StudyDesign, simulated_strokes
from sessions.recording import RecordingError
from sessions.recording.derived import session_folders
from sessions.statistics.correlations import share_interval
from sessions.statistics.findings import GROUND_TRUTH_FILE, UNITS, StudyFindings, check_ground_truth
from sessions.statistics.pooled import pool_visits
from sessions.statistics.power import TWIN, AssumedEffects, Recovery, power, recovery
from sessions.statistics.visit import VisitOptions, exclusions_in
from sessions.strokes.stroke import FIXED

_SUBJECTS, SURFACES = (3, 5, 10, 15, 20, 30), (3, 5, 8, 12)  # of the designs whose power is simulated
# Of the designs that should distinguish quantities: one such study takes a thousand times as long.
RIVAL_SUBJECTS, RIVAL_SURFACES, RIVAL_STUDIES = (12, 24), (5, 8), 40
# Of the assumptions; a point is one of the 100 of the score.
_UNITS = {
    **dict.fromkeys(("effect", "noise", "level_sd"), "points"),
    "slope_sd": "of the effect",
    "friction_sd": "of µ",
}


def add_power(parser: argparse.ArgumentParser) -> None:
    """Declare --power and the options that belong to it."""
    defaults = ", ".join(f"{field.name}={field.default:g}" for field in fields(AssumedEffects))
    meaning = f"how many subjects and surfaces a study needs, by simulation; its assumptions can be set: {defaults}"
    parser.add_argument("--power", nargs="*", metavar="NAME=VALUE", help=meaning)
    meaning = "with --power: how often a study whose subjects press each surface to these depths separates --quantity"
    meaning += " from its rivals; some minutes"
    parse = number_in_range("--depths", float, 0.5, 3.0)
    parser.add_argument("--depths", nargs="+", type=parse, metavar="MM", help=meaning)
    add_number(parser, "--studies", int, (20, 100_000), "with --power: simulated studies per design (400)", 400, "N")
    add_seed(parser, "with --power: seed of the simulated studies (0)")


def print_power(options: argparse.Namespace, console: Console) -> int:
    """Print the power of designs with several numbers of subjects and surfaces."""
    if options.folder is not None or options.synthetic is not None:
        raise WrongValue("--power simulates its own studies: leave FOLDER and --synthetic out")
    effects = _assumed_effects(options.power)
    powers = power(
        effects, _SUBJECTS, SURFACES, options.studies, options.seed, lambda share: console.progress(share, "designs")
    )
    recoveries = _recovery(options, effects, console)
    designs = [{**asdict(row), "power": row.share} for row in powers]
    console.result(planted=asdict(effects), designs=designs, recovery=msgspec.to_builtins(recoveries))
    rows = [
        [str(count), *(_share_text(row.share, row.studies) for row in powers if row.subjects == count)]
        for count in _SUBJECTS
    ]
    values = ", ".join(f"{name} = {value:g} {_UNITS[name]}" for name, value in asdict(effects).items())
    console.say(
        f"Assumed: {values}. We chose the default values; nobody measured them.",
        table(rows, header=["subjects", *(f"{count} surfaces" for count in SURFACES)]),
        "Share of simulated studies whose correlation of scores with µ within subjects has p < 0.05 for other people "
        f"on the same surfaces, of {options.studies} each. They hold for these surfaces, not for others.",
    )
    if recoveries:
        _print_recovery(recoveries, options, console)
    else:
        console.say("--depths 1.25 1.75 2.25 simulates how often such a study finds the quantity that scores follow.")
    return DONE


def _recovery(options: argparse.Namespace, effects: AssumedEffects, console: Console) -> list[Recovery]:
    """Return how often studies at the given depths distinguish the quantity from its rivals; [] without depths."""
    if not options.depths:
        return []
    depths = tuple(options.depths)
    recoveries: list[Recovery] = []
    count = len(RIVAL_SURFACES) * len(RIVAL_SUBJECTS)
    for surfaces in RIVAL_SURFACES:
        console.progress(len(recoveries) / count, f"strokes on {surfaces} surfaces")
        draw = np.random.default_rng([options.seed, surfaces])
        strokes = simulated_strokes(StudyDesign.even(surfaces, depths), max(RIVAL_SUBJECTS), draw)
        for people in RIVAL_SUBJECTS:
            recoveries.append(recovery(strokes, people, depths, options.quantity, effects, RIVAL_STUDIES, draw))
            console.progress(len(recoveries) / count, f"{people} subjects, {surfaces} surfaces")
    return recoveries


def _print_recovery(recoveries: Sequence[Recovery], options: argparse.Namespace, console: Console) -> None:
    label = BY_NAME[options.quantity].label
    depths = ", ".join(f"{depth:g}" for depth in options.depths)
    console.say(f"Scores that follow {label} with that effect over its range, surfaces pressed to {depths} mm:")
    rows: list[list[str]] = []
    for design in recoveries:
        preferred, family = (_share_text(share, design.studies) for share in (design.preferred, design.family))
        rows.append([f"{design.people} × {design.surfaces} × {len(design.depths)}", preferred, family])
    console.say(table(rows, header=["subjects × surfaces × depths", "preferred", "it or a twin"]))
    twins = ", ".join(recoveries[-1].twins) or "none"
    console.say(
        f"Share of {RIVAL_STUDIES} simulated studies in which it has the greatest Akaike weight of all rivals. Its "
        f"twins in the last row, by r of at least {TWIN:g}: {twins}. The finger is the published one, so real studies "
        "distinguish less."
    )


def _share_text(share: float, studies: int) -> str:
    """Return a share of simulated studies with its 95 % interval.

    >>> _share_text(1.0, 400)
    '100 % (99 to 100)'
    """
    low, high = share_interval(share, studies)
    return f"{100 * share:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _assumed_effects(texts: Sequence[str]) -> AssumedEffects:
    """Return the assumptions of a power simulation, with the values set by options. Raises WrongValue."""
    names = [field.name for field in fields(AssumedEffects)]
    changes = numbers_by_key(texts, "--power", "effect=20")
    for name, value in changes.items():
        if name not in names:
            raise WrongValue(f"--power {name}={value:g} is not allowed: one of {', '.join(names)}")
        least = -100.0 if name == "effect" else 0.0
        if not least <= value <= 100.0:
            raise WrongValue(f"--power {name}={value:g} is not allowed: {least:g} to 100")
    return AssumedEffects(**changes)


EXAMPLE = "daq-app study recordings --out results"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, nargs="?", metavar="FOLDER", help="contains a folder for each session")
    meaning = "make a study of ten simulated subjects instead"
    add_number(parser, "--synthetic", int, (0, LARGEST_STUDY_SEED), meaning, metavar="SEED")
    meaning = "page, table and results (FOLDER/pooled); with --synthetic the study too"
    parser.add_argument("--out", type=Path, metavar="DIR", help=meaning)
    add_shared(
        parser,
        "workers",
        "scheduler",
        kinematics="as for 'daq-app predict'; finite strain takes ten times as long",
        paths="also with every other reasonable choice of the analysis: a second or two more per session; with "
        "'finite' at finite strain too, up to a minute more",
        tau="as for 'daq-app predict'",
        quantity="to compare with scores and rivals",
    )
    meaning = "the interval of each SED from the uncertainty of friction (on at small strain; off at finite strain, as"
    parser.add_argument("--intervals", action=argparse.BooleanOptionalAction, help=f"{meaning} it takes longer)")
    add_power(parser)
    add_analysis(parser, "fixed for all sessions, not as last analysed")


def run(options: argparse.Namespace, console: Console) -> int:
    """Pool the study, write page, table and numbers, and print a summary; or print the power of designs."""
    if options.power is not None:
        return print_power(options, console)
    if options.depths is not None:
        raise WrongValue("--depths applies to simulated studies: give --power too")
    if (options.folder is None) == (options.synthetic is None):
        raise WrongValue("give a FOLDER of sessions, or --synthetic SEED, and not both")
    if options.synthetic is None:
        return _pool(options, options.folder, options.out or options.folder / "pooled", console)
    # Simulators are loaded only on request.
    from daq_app.simulation.synthetic import recordings_in, synthetic_study

    folder = options.out or Path("synthetic-results") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S")
    with recordings_in(folder):
        synthetic_study(folder, options.synthetic, console)
        return _pool(options, folder, folder / "pooled", console)


def _pool(options: argparse.Namespace, folder: Path, output: Path, console: Console) -> int:
    sessions = session_folders(folder)
    if not sessions:
        raise RecordingError(f"{folder} holds no session: give the folder that holds a folder for each of them")
    intervals = options.kinematics == "small" if options.intervals is None else options.intervals
    model = PredictionOptions(options.tau, kinematics=options.kinematics, intervals=intervals)
    along = options.quantity if options.paths != "none" else SED.name
    visit_options = VisitOptions(model, area_law(options) or FIXED, options.paths, options.calibration_error, along)
    # Errors in these files are reported before hours of work.
    exclusions, truth = exclusions_in(folder), _load_ground_truth(folder)
    files = _files(output, visit_options)
    shelf = Shelf(output / "results", visit_options)
    results, failures = visits(
        sessions, visit_options, shelf, console, scheduler=options.scheduler, workers=options.workers
    )
    if truth is not None and options.quantity == SED.name:
        from daq_app.simulation.synthetic import population_relations  # slow to load, and rarely needed

        truth["relation"] = population_relations(truth["people"], visit_options.prediction, visit_options.area)
    study = pool_visits(results, failures, exclusions, truth, visit_options, BY_NAME[options.quantity])
    console.progress(0.97, "writing the page")
    _write(study, folder.resolve().name, files)
    places = {content: str(path) for content, path in files.items()}
    console.result(**places, study=study.to_dict() | {"visits": [visit.session for visit in study.visits]})
    _print(study, files, console)
    flawed = any(visit.losses or any(row.flaws for row in visit.rows) for visit in study.visits)
    return FLAWED if failures or flawed or study.misfits or not study.descriptors else DONE


def _load_ground_truth(folder: Path) -> dict[str, Any] | None:
    """Return the ground truth of a synthetic study, None for any other. Raises RecordingError if it is damaged."""
    path = folder / GROUND_TRUTH_FILE
    if not path.is_file():
        return None
    try:
        return check_ground_truth(json_value(read_within_limit(path)))
    except ValueError as damaged:
        raise RecordingError(f"{path} is damaged; delete it to pool the study without its ground truth") from damaged


def _files(output: Path, options: VisitOptions) -> dict[str, Path]:
    """Return the output files by content. Raises ReportError, and NotOurs if one would replace a foreign file."""
    from sessions.report import pages  # drawing is slow to load

    names = {"page": "study.html", "table": pages.TRIALS, "columns": pages.TRIAL_COLUMNS, "numbers": "study.json"}
    names |= {"rivals": "rivals.csv", "rival_columns": "rivals-columns.csv"}
    names |= {} if options.paths == "none" else {"paths": "paths.csv", "path_columns": "paths-columns.csv"}
    files = {content: output / name for content, name in names.items()}
    pages.check_place(*files.values())
    return files


def _write(study: StudyFindings, name: str, files: Mapping[str, Path]) -> None:
    from sessions.report import pages

    texts = {
        "page": pages.study_page(study, name),
        "table": pages.trials_csv(study),
        "columns": pages.columns_csv(study),
        "numbers": json_text(study.to_dict()),
        "rivals": pages.rivals_csv(study),
        "rival_columns": pages.rival_columns_csv(study),
        "paths": pages.paths_csv(study),
        "path_columns": pages.path_columns_csv(study),
    }
    for content, path in files.items():
        pages.swap_in(path, texts[content])


def _print(study: StudyFindings, files: Mapping[str, Path], console: Console) -> None:
    from sessions.report.study_prose import distinctions, exclusion_sentences, remarks, summary

    console.say(
        study.simulated or None, *summary(study), *distinctions(study), *exclusion_sentences(study), *remarks(study)
    )
    for effect in study.effects:
        inside = "inside" if effect.covered else "OUTSIDE"
        console.say(
            f"{effect.descriptor}, {effect.effect} [{UNITS[effect.effect]}]: true {number(effect.true_value)}, "
            f"estimated {number(effect.estimate)} ({span(effect.low, effect.high)}): {inside}"
        )
    width = max(map(len, files))
    console.say(*(f"{name:{width}}  {path}" for name, path in files.items()))
