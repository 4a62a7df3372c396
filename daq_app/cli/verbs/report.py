"""Write a session's report as one self-contained page: scores, strokes, predictions, and how they agree.

Scores of further visits (other subjects, or this one without a transducer) are joined with --scores.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from daq_app.batch.derived import analyse_session, open_visit, predict_session, stored_afferent, stored_options
from daq_app.cli.options import add_analysis, add_flag, add_shared, add_visit, area_law
from daq_app.console import DONE, FLAWED, Console, WrongValue
from sessions.plan.plan import Blinded
from sessions.prediction import BY_NAME
from sessions.prediction.afferent import AfferentSettings, session_firing, usual_settings
from sessions.recording import Recording
from sessions.recording.derived import reveal, store_page
from sessions.recording.manifest import seal_differences
from sessions.report import Further
from sessions.report.trials import afferent_facts
from sessions.statistics.multiverse import trial_paths
from sessions.statistics.scores import score_table

_PAGE = "report.html"
EXAMPLE = "daq-app report recordings/P07 -o P07.html --scores recordings/P01 recordings/P02"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_visit(parser, "; all scores of the study are included")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE.html", help="the page (SESSION/report.html)")
    parser.add_argument("--scores", type=Path, nargs="+", default=[], metavar="SESSION", help="further visits")
    add_shared(
        parser,
        paths="also with every other reasonable choice of the analysis; with 'finite' at finite strain too (a minute)",
        variants="also variants, as for 'daq-app predict': both readings of tau_max, by depth and by force, in both "
        "directions; with 'both' at finite strain too (about a minute); by default small, or as predicted before",
        quantity="to compare with scores and rivals",
    )
    meaning = "also firing rates of an SA-II afferent that responds to --quantity: an illustration (also if"
    add_flag(parser, "--afferent", f"{meaning} stored before)")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="also write every picture as SVG, its data as CSV")
    add_analysis(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    # Imported here: drawing is slow to load, and errors of the session should come first.
    recording, other_sessions, unreadable = open_visit(options.session, options.subject, console)
    score_only = [reveal(Recording.open(folder)) for folder in options.scores]
    score_only += [visit for visit in other_sessions if any(record.score is not None for record in visit.trials)]
    folders = [visit.folder.resolve() for visit in (recording, *score_only)]
    if twice := next((folder for index, folder in enumerate(folders) if folder in folders[:index]), None):
        raise WrongValue(f"--scores {twice} is not allowed: its scores are in the report already")
    for visit in (recording, *score_only):
        if visit.plan.blinded:
            raise Blinded(f"{visit.folder} is blinded: a report shows scores by index; 'daq-app unblind' opens the key")
    for visit in score_only[: len(options.scores)]:
        _check_scores(visit, recording)
    from sessions.report import pages

    if options.out is not None:
        pages.check_place(options.out)
    else:
        pages.make_place(recording.folder)
    if options.figures is not None:
        pages.make_place(options.figures)
    differences = seal_differences(recording, *score_only)
    console.note(*differences)
    analysis = analyse_session(recording, console, area_law(options), gain_error=options.calibration_error)
    afferent = stored_afferent(recording)
    if options.afferent and (afferent is None or afferent.quantity != options.quantity):
        afferent = usual_settings(options.quantity)
    # Earlier options are kept, so that no stored number is lost, and the page's own are added.
    choices = replace(stored_options(recording, options.variants or "small"), intervals=True, course="history")
    prediction = predict_session(recording, analysis, console, choices, afferent)
    from sessions.report import findings

    reference, firing = (None, ()) if afferent is None else session_firing(prediction, afferent)
    facts = afferent_facts(afferent or AfferentSettings(), reference)
    paths = None
    if options.paths != "none" and recording.plan.forces:
        finite, quantity = options.paths == "finite", BY_NAME[options.quantity]
        progress = console.reporter("many paths of the analysis", until=0.9)
        paths = trial_paths(recording, prediction, progress, finite=finite, quantity=quantity)
    further = Further(firing, facts, afferent, options.quantity, paths, differences, unreadable)
    report = findings(recording, analysis, prediction, [score_table(visit) for visit in score_only], further=further)
    console.progress(0.9, "drawing")
    drawings = pages.plates(report)
    pictures = pages.write_figures(report, options.figures, drawings) if options.figures else ()
    if options.out is None:  # in the session's folder it is a derived file, listed in the manifest
        page = store_page(recording.folder, _PAGE, pages.page(report, drawings))
    else:
        page = options.out
        pages.write_report(report, page, drawings)
    console.result(page=str(page), pictures=[str(path) for path in pictures], flaws=len(report.flaws))
    console.say(f"{page}{' (SIMULATED)' if report.simulated else ''}")
    return FLAWED if analysis.flawed or unreadable or differences else DONE


def _check_scores(visit: Recording, recording: Recording) -> None:
    """Raise WrongValue if a visit named by --scores adds nothing to a report."""
    stimuli = {(trial.stimulus.descriptor, trial.stimulus.index) for trial in recording.plan.trials}
    table = score_table(visit)
    if not table.other_answers and stimuli.isdisjoint((score.descriptor, score.index) for score in table.scores):
        stimulus_text = "a stimulus of this session" if table.scores else "any stimulus"
        raise WrongValue(f"--scores {visit.folder} is not allowed: it holds no score of {stimulus_text}; leave it out")
