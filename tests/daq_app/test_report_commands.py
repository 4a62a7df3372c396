"""The commands at the end of a report, read by the verbs they are typed for."""

import shlex
from pathlib import Path
from types import SimpleNamespace

import pytest

from daq_app.cli.main import parser_of, verb_module
from daq_app.cli.options import area_law, numbers_by_key
from sessions.prediction import PredictionOptions
from sessions.prediction.afferent import settings_with
from sessions.report.facts import session_commands
from sessions.statistics.multiverse import PATHS
from sessions.strokes import AnalysisSettings
from sessions.strokes.stroke import AreaLaw

SMALL = sum(path.kinematics == "small" for path in PATHS)
LAW = AreaLaw("power", 0.5, 3.0)


def read(line):
    """Return the options that a verb reads from a command."""
    program, name, *arguments = shlex.split(line)
    assert program == "daq-app"
    return parser_of(name, verb_module(name)).parse_args(arguments)


def commands(**further):
    recording = SimpleNamespace(folder=Path("recordings/P 01"))
    analysis = SimpleNamespace(settings=AnalysisSettings(area=LAW, gain_error=0.003, bootstrap_seed=7))
    return [read(line) for line in session_commands(recording, analysis, **further)]


def test_the_commands_of_a_report_name_the_session_and_how_it_was_analysed():
    verify, analyse, report = commands()
    assert {verify.session, analyse.session, report.session} == {Path("P 01")}
    assert (area_law(analyse), analyse.calibration_error, analyse.bootstrap_seed) == (LAW, 0.003, 7)
    assert (report.out, report.paths, report.scores, report.quantity) == (Path("report.html"), "none", [], "sed")


def test_the_commands_of_a_report_predict_with_its_options_and_its_afferent():
    options = PredictionOptions("as-printed", kinematics="finite", variants="both", indentation=1.25)
    afferent = settings_with({"static_gain": 30.0}, 9, "shear_along_skin")
    *_, predict, _ = commands(prediction=SimpleNamespace(options=options), afferent=afferent)
    names = ("kinematics", "variants", "indentation")
    assert [getattr(predict, name) for name in names] == [getattr(options, name) for name in names]
    assert (predict.tau, predict.scene, area_law(predict)) == ("as-printed", None, LAW)
    changes = numbers_by_key(predict.afferent_set, "", "")
    assert predict.afferent
    assert settings_with(changes, predict.afferent_seed, predict.quantity) == afferent


@pytest.mark.parametrize(("count", "strain"), [(SMALL, "small"), (len(PATHS), "finite")])
def test_the_commands_of_a_report_ask_for_its_paths_its_scores_and_its_quantity(count, strain):
    further = {"scores": ("P 02", "P03"), "response": "shear_along_skin"}
    *_, report = commands(paths={1: (None,) * count}, **further)
    assert (report.paths, report.quantity) == (strain, "shear_along_skin")
    assert report.scores == [Path("P 02"), Path("P03")]
