"""Ten surfaces at small and at finite strain, from a kept session through every verb, the window and a study."""

import contextlib
import json
import shutil

import pytest

from daq_app.analyst import state as m
from daq_app.analyst.session_words import session_pictures
from daq_app.analyst.work import NothingToShow, Work
from daq_app.cli.main import run
from daq_app.console import Console
from daq_app.simulation.synthetic import synthetic_study
from sessions.exchange import FORMATS

KINEMATICS = ("small", "finite")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def session_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded") / "study"
    synthetic_study(folder, 1, Console(as_json=True), subjects=1)
    return folder / "S01"


@pytest.fixture(scope="module", params=KINEMATICS)
def prediction_folder(request, session_folder, tmp_path_factory):
    """Return a session's folder, with the prediction kept in it, and its document."""
    folder = tmp_path_factory.mktemp(request.param) / "S01"
    shutil.copytree(session_folder, folder)
    code = run(["predict", str(folder), "--kinematics", request.param])
    document = json.loads((folder / "prediction.json").read_text())
    assert code == (3 if any(row["sed"] is None for row in document["trials"]) else 0)
    return folder, document


def _answers_or_reasons(rows, count=10):
    assert len(rows) == count
    assert len({(row["stimulus"]["descriptor"], row["stimulus"]["index"]) for row in rows}) == count
    for row in rows:
        assert (row["sed"] is None) == bool(row["reasons"].get("sed"))


def test_every_surface_has_an_answer_or_its_reason(prediction_folder):
    _answers_or_reasons(prediction_folder[1]["trials"])


def test_the_report_shows_every_surface_of_the_kept_prediction(prediction_folder):
    folder, document = prediction_folder
    assert run(["report", str(folder)]) == 0
    page = (folder / "report.html").read_text()
    for row in document["trials"]:
        text = f"{1000.0 * row['sed']:.2f}" if row["sed"] is not None else row["reasons"]["sed"][:40]
        assert text in page


@pytest.mark.parametrize("format_", FORMATS)
def test_every_export_carries_the_kept_prediction(prediction_folder, format_, tmp_path):
    folder, _ = prediction_folder
    out = tmp_path / "out"
    assert run(["export", str(folder), "--format", format_, "--out", str(out)]) == 0
    assert any(out.rglob("*") if out.is_dir() else [out])


def test_the_window_shows_the_kept_prediction_and_draws_every_surface(prediction_folder):
    folder, document = prediction_folder
    strain, messages = document["options"]["kinematics"], []
    work = Work(folder, messages.append)
    work.go_on()
    report = next(r.report for r in messages if isinstance(r, m.ReportReady) and r.stage == "predicted")
    answers = [message for message in messages if isinstance(message, m.TrialAnswer)]
    assert len(answers) == 10
    assert report.model.startswith(f"{strain} strain")
    assert [p.sed for p in report.predictions] == pytest.approx([row["sed"] for row in document["trials"]])
    for name, _ in session_pictures(report):
        work.do(m.Draw(name))
    for message in answers:
        assert (message.finger is not None) == (message.finding.sed is not None)
        work.do(m.Draw(f"finger {message.finding.stroke}"))
        with contextlib.nullcontext() if strain == "small" else pytest.raises(NothingToShow):
            work.do(m.ShowHistory((message.finding.trial, message.finding.stroke)))
    assert not [message for message in messages if isinstance(message, m.Problem)]


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_a_study_has_a_row_for_every_surface(session_folder, kinematics, tmp_path):
    shutil.copytree(session_folder, tmp_path / "S01")
    run(["study", str(tmp_path), "--workers", "1", "--kinematics", kinematics, "--json"])
    (visit,) = json.loads((tmp_path / "pooled" / "study.json").read_bytes())["visits"]
    assert len(visit["rows"]) == 10
    for row in visit["rows"]:
        assert row["sed"] is not None or row["why"]
