"""What is made of a session at the command line: predictions, reports, decisions, settings that every verb keeps to."""

import csv
import hashlib
import html
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from examples import SCENE
from json_answer import answer
from page_numbers import estimates

from daq_app.batch.derived import stored_document
from daq_app.batch.pool import Shelf, content_of
from daq_app.cli.main import run
from sessions.prediction import PredictionOptions, finger_in
from sessions.recording import Recording
from sessions.recording.derived import gain_error_set
from sessions.report import findings
from sessions.statistics.visit import VisitOptions, visit_of
from sessions.strokes import AnalysisSettings, analyse
from sessions.strokes.analysis import bootstrap_settings, check_analysis
from sessions.toml_file import SettingsError

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def report_dir(two_trials, tmp_path_factory):
    """A session analysed and predicted otherwise than usual, and then reported; tests that change it take a copy."""
    room = tmp_path_factory.mktemp("reported")
    session = shutil.copytree(two_trials, room / "P01")
    (room / "mine.toml").write_text(f"{SCENE}\n[finger]\ntip_radius = 5.5\n[materials.fat]\nE = 0.03\nnu = 0.48\n")
    words = ["--beside", "none", "--indentation", "1.2", "--tau", "as-printed", "--scene", str(room / "mine.toml")]
    seed_option = ["--bootstrap-seed", "7"]
    assert run(["analyse", str(session), "--area", "hertz", "--calibration-error", "0.3", *seed_option]) == 0
    assert run(["predict", str(session), *words, "--afferent", "--afferent-set", "static_gain=30"]) == 0
    with patch("sessions.report.pages.plates", lambda _: ()):  # its numbers and words alone
        assert run(["report", str(session)]) == 0
    return session


def test_every_number_of_a_reported_session_has_a_unit_and_an_interval(report_dir):
    numbers = list(estimates((report_dir / "report.html").read_text(encoding="utf-8")))
    assert len(numbers) > 50
    assert [place for place, unit, _, _ in numbers if not unit] == []
    # One subject gave the scores, and with tau_max as printed no trial is solved under the measured force. A state that
    # no finger can be in has none either.
    notes = [(place, why) for place, _, interval, why in numbers if not interval and "turned inside out" not in why]
    without = {(place.split(",")[1].strip(), why.split(";")[0]) for place, why in notes}
    assert without == {
        ("mean score", "one subject alone has no interval"),
        ("depth to match", "no interval: computed on a coarse mesh"),
    }


def test_the_reading_of_tau_as_printed_is_asked_for_by_name_and_is_a_hundredth(report_dir):
    analysis, document = (json.loads((report_dir / f"{name}.json").read_text()) for name in ("analysis", "prediction"))
    assert document["options"]["tau_reading"] == "as-printed"
    for row, other in zip(document["trials"], analysis["friction"], strict=True):
        assert row["tau_max"] == pytest.approx(other["tau_max"] / 100)


def test_exports_carry_the_error_of_calibration_that_their_intervals_hold(report_dir, tmp_path):
    assert run(["export", str(report_dir), "--format", "csv", "--out", str(tmp_path / "csv")]) == 0
    with (tmp_path / "csv" / "strokes.csv").open(newline="") as file:  # a table that every format writes
        rows = list(csv.DictReader(file))
    assert {(row["gain_error"], row["gain_error_origin"]) for row in rows} == {("0.003", "set")}


def test_a_finger_alone_does_for_a_scene_and_what_is_not_taken_is_said(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[finger]\ntip_radius = 5.5\n")
    scene, remark = finger_in(file)
    assert (scene.finger.tip_radius, remark) == (5.5, "")
    file.write_text("[finger]\ntip_radius = 5.5\n[friction]\nmu = 0.3\n[solve]\ncourse = 'steady'\ntolerance = 0.01\n")
    scene, remark = finger_in(file)
    assert scene.solve.tolerance == 0.01
    assert remark.startswith(f"{file}: [friction], solve.course are not taken")
    file.write_text("title = 'mine'\n[finger]\ntip_radius = -1.0\n")
    with pytest.raises(SettingsError, match=r"line 3: finger\.tip_radius"):
        finger_in(file)


@pytest.mark.parametrize(
    "text", ["", "friction = 1", "title = 'mine'\n[finger]\n[friction]\nmu = 0.3\n[solve]\ncourse = 'steady'\n"]
)
def test_a_scene_file_that_tells_nothing_of_a_finger_is_refused_where_one_is_wanted(tmp_path, text):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(SettingsError, match=r"mine\.toml says nothing of a finger; give it \[finger\]"):
        finger_in(tmp_path / "mine.toml")


def test_predict_gives_a_row_a_trial_and_every_number_comes_out_again_in_another_process_to_the_last_bit(small, capsys):
    assert run(["predict", str(small), "--intervals", "--json"]) == 0
    document = answer(capsys)
    for row in document["trials"]:
        assert row["interval"]["method"] in ("derivatives", "sampling")
        assert row["interval"]["low"] < row["sed"] < row["interval"]["high"]
        assert row["sed"] > 0
        assert row["error_estimate"] > 0
        assert row["measured_normal"] > 0
        assert len(row["alternatives"]) == 4
    # Sets and the like come in another order under another seed of hashes.
    command = [sys.executable, "-m", "daq_app", "verify", str(small), "--json"]
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    other = subprocess.run(command, capture_output=True, env=environment, cwd=ROOT, check=False)
    assert json.loads(other.stdout)["checked"] == ["files", "analysis.json", "prediction.json"]
    assert json.loads(other.stdout)["problems"] == []
    assert other.returncode == 0


def test_a_report_is_one_page_that_says_simulated_listed_in_the_manifest_and_keeps_what_was_asked_before(
    report_dir, tmp_path, capsys
):
    session = shutil.copytree(report_dir, tmp_path / "P01")
    documents = {name: json.loads((session / f"{name}.json").read_text()) for name in ("analysis", "prediction")}
    assert documents["analysis"]["settings"]["area"]["law"] == documents["prediction"]["area"]["law"] == "hertz"
    assert documents["analysis"]["bootstrap"]["settings"]["gain_error"] == 0.003
    assert [row["indentation"] for row in documents["prediction"]["trials"]] == [1.2, 1.2]
    page = session / "report.html"
    text = page.read_text()
    assert "SIMULATED" in text
    capsys.readouterr()
    assert run(["report", str(session), "-o", str(session / "session.sqlite")]) == 1
    assert "holds something else" in capsys.readouterr().err.splitlines()[0]  # before anything is solved
    assert "<script" not in text
    assert "http://" not in text.replace("http://www.w3.org/", "")
    assert run(["verify", str(session)]) == 0
    assert "report.html" in (session / "MANIFEST.json").read_text()
    page.write_text("<p>another page</p>")
    capsys.readouterr()
    assert run(["verify", str(session), "--json"]) == 3
    assert any("report.html" in problem for problem in answer(capsys)["problems"])


def test_a_report_of_a_recording_that_was_changed_since_it_was_sealed_says_so(report_dir, tmp_path, capsys):
    session = shutil.copytree(report_dir, tmp_path / "P01")
    assert "not as it was sealed" not in (session / "report.html").read_text()
    copy = session / "session.h5"
    copy.chmod(0o644)
    copy.write_bytes(copy.read_bytes() + b"\0")
    capsys.readouterr()
    with patch("sessions.report.pages.plates", lambda _: ()):
        assert run(["report", str(session)]) == 3
    sentence = "The recording P01 is not as it was sealed (session.h5 is not what it was"
    assert sentence in capsys.readouterr().err
    assert sentence in (session / "report.html").read_text()


def test_commands_and_scene_at_the_end_of_a_report_give_its_numbers(report_dir, two_trials, tmp_path, monkeypatch):
    text = (report_dir / "report.html").read_text()
    scene, commands = (html.unescape(part) for part in re.findall(r"<pre>(.*?)</pre>", text, re.DOTALL))
    shutil.copytree(two_trials, tmp_path / "P01")
    (tmp_path / "P01-scene.toml").write_text(scene)
    assert hashlib.sha256(scene.encode()).hexdigest() in text
    monkeypatch.chdir(tmp_path)
    verify, analysis, prediction, report = commands.splitlines()
    assert (verify, report) == ("daq-app verify P01", "daq-app report P01 -o report.html")
    assert "--tau as-printed --indentation 1.2 --scene P01-scene.toml" in prediction
    for line in (analysis, prediction):
        assert run(shlex.split(line)[1:]) == 0
    then, now = (json.loads((folder / "prediction.json").read_bytes()) for folder in (report_dir, tmp_path / "P01"))
    assert [row["sed"] for row in now["trials"]] == [row["sed"] for row in then["trials"]]
    for name in ("area", "gain_error", "scene", "bootstrap_seed"):
        assert now[name] == then[name]
    assert now["afferent"]["settings"] == then["afferent"]["settings"]
    assert now["afferent"]["settings"]["static_gain"] == 30.0
    before, after = (json.loads((folder / "analysis.json").read_bytes()) for folder in (report_dir, tmp_path / "P01"))
    assert after["bootstrap"] == before["bootstrap"]
    assert after["bootstrap"]["settings"]["seed"] == now["bootstrap_seed"] == 7
    assert "seed 7" in text


def test_an_exported_prediction_tells_its_model_and_friction_the_interval_of_the_number_the_model_got(
    report_dir, tmp_path
):
    assert run(["export", str(report_dir), "--format", "csv", "--out", str(tmp_path / "out")]) == 0
    friction, predictions = (
        list(csv.DictReader((tmp_path / "out" / f"{name}.csv").read_text().splitlines()))
        for name in ("friction", "predictions")
    )
    document = json.loads((report_dir / "analysis.json").read_bytes())["bootstrap"]["strokes"]
    for row, stroke, number in zip(friction, document, ("mu_max", "mu_dynamic"), strict=True):
        assert [float(row["mu_interval_low"]), float(row["mu_interval_high"])] == stroke[number]
        assert row["mu_interval_by"] == f"95 % block bootstrap of {number}"
        assert float(row["mu_interval_low"]) < float(row["mu"]) < float(row["mu_interval_high"])
        assert [float(row[f"tau_max_interval_{end}_MPa"]) for end in ("low", "high")] == stroke["tau_max"]
    model = ("small", "as-printed", "hertz", "set", "assumed")
    columns = ("kinematics", "tau_reading", "area_law", "indentation_origin", "width_origin")
    assert [tuple(row[name] for name in columns) for row in predictions] == [model, model]
    assert all(row["scene_sha256"] in (report_dir / "report.html").read_text() for row in predictions)
    assert all(int(row["dofs"]) > 100 for row in predictions)


def test_an_analysis_of_an_older_program_keeps_the_settings_of_its_intervals(small):
    run(["analyse", str(small), "--json"])
    document = json.loads((small / "analysis.json").read_bytes())
    settings = document["bootstrap"]["settings"]
    now = bootstrap_settings(settings)
    del settings["tilt_presses"]
    settings["tilt_from_presses"] = False
    check_analysis(document)
    assert bootstrap_settings(settings) == now


def test_the_options_of_a_prediction_of_an_older_program_are_read_by_their_present_names(report_dir, tmp_path):
    folder = shutil.copytree(report_dir, tmp_path / "P01")
    now = json.loads((folder / "prediction.json").read_bytes())
    older = {name: dict(now[name]) for name in ("options", "options_origin")}
    for part in older.values():
        assert (part["beside"], part["beside_intervals"]) == (part.pop("variants"), part.pop("variant_intervals"))
    present = stored_document(folder, "prediction.json")
    (folder / "prediction.json").write_text(json.dumps({**now, **older}))
    document = stored_document(folder, "prediction.json")
    assert {name: document[name] for name in older} == {name: present[name] for name in older}
    assert "variants" in document["options"]
    assert "beside" not in document["options"]


def test_a_decision_is_recorded_listed_followed_by_every_verb_and_undone(small, capsys, tmp_path):
    run(["analyse", str(small), "--json"])
    before = answer(capsys)
    older = (small / "analysis.json").read_bytes()
    manifest = (small / "session.sqlite").read_bytes()
    start, stop = before["strokes"][0]["steady"]
    window = [str(start + 0.2), str(stop - 0.3)]
    decide = ["decide", str(small), "--by", "E02", "--why", "a ramp", "--json"]
    assert run([*decide, "--trial", "1", "--steady", *window]) == 0
    moved = answer(capsys)
    assert moved["decision"]["old"] == [start, stop]
    assert re.search(r"speed \S+ -> \S+ mm/s", moved["changes"][0])
    assert run([*decide, "--trial", "2", "--drop"]) == 0
    assert answer(capsys)["changes"] == ["stroke 1 of trial 2: no longer used by the model"]
    run(["analyse", str(small), "--json"])
    after = answer(capsys)
    assert after["strokes"][0]["steady"] == pytest.approx([start + 0.2, stop - 0.3], abs=0.006)
    assert [(row["trial"], row["stroke"]) for row in after["friction"]] == [(1, 0)]
    assert run(["verify", str(small), "--json"]) == 0
    assert "decisions.jsonl" in answer(capsys)["checked"]
    assert run(["export", str(small), "--format", "csv", "--out", str(tmp_path / "csv"), "--json"]) == 0
    capsys.readouterr()
    assert "a ramp" in (tmp_path / "csv" / "decisions.csv").read_text()
    (small / "analysis.json").write_bytes(older)
    assert run(["verify", str(small), "--json"]) == 3
    # It is made once more under its own decisions, and nothing else differs.
    checksum, older_result = answer(capsys)["problems"]
    assert "SHA-256 or size differs from MANIFEST.json" in checksum
    assert older_result == "analysis.json was made under other decisions than those in force: compute it again"
    for number in ("1", "2"):
        assert run([*decide, "--undo", number]) == 0
        capsys.readouterr()
    assert run(["decide", str(small), "--list", "--json"]) == 0
    assert [line["in_force"] for line in answer(capsys)["decisions"]] == [False] * 4
    run(["analyse", str(small), "--json"])
    assert answer(capsys)["strokes"] == before["strokes"]
    assert (small / "session.sqlite").read_bytes() == manifest


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["--trial", "1", "--drop", "--by", "E02"], 2, "give --by CODE and --why REASON"),
        (["--trial", "1", "--steady", "900", "901", "--by", "E02", "--why", "w"], 2, "too few readings"),
        (["--trial", "1", "--steady", "900", "901", "--by", "E02", "--why", "w"], 2, "The stroke lasts from "),
        (["--trial", "44", "--drop", "--by", "E02", "--why", "w"], 2, "there is no stroke 1 of trial 44"),
        (["--choose", "--by", "E02", "--why", "w"], 2, "give --trial N"),
        (["--trial", "1", "--steady", "5", "1", "--by", "E02", "--why", "w"], 2, "the earlier first"),
        (["--trial", "1", "--slide-onset", "900", "--by", "E02", "--why", "w"], 2, "lies outside of the contact"),
        (["--undo", "9", "--by", "E02", "--why", "w"], 2, "nothing to undo"),
        (["--trial", "1", "--drop", "--by", "Ada Lovelace", "--why", "w"], 2, "never a name"),
    ],
)
def test_a_decision_that_cannot_be_is_refused_in_one_sentence(two_trials, capsys, words, code, sentence):
    assert run(["decide", str(two_trials), *words]) == code
    assert sentence in capsys.readouterr().err
    assert not (two_trials / "decisions.jsonl").exists()


def test_a_decision_is_not_recorded_where_a_damaged_setting_would_keep_it_from_being_followed(small, capsys):
    (small / "calibration-error.json").write_text("torn")
    words = ["decide", str(small), "--trial", "1", "--drop", "--by", "E02"]
    assert run([*words, "--why", "pulled away"]) == 1
    assert "set it anew" in capsys.readouterr().err
    assert not (small / "decisions.jsonl").exists()
    assert run(["verify", str(small), "--json"]) == 3
    assert any("calibration-error.json is damaged" in problem for problem in answer(capsys)["problems"])


def test_a_law_of_the_contact_area_is_recorded_and_verify_goes_by_it(small, capsys):
    run(["analyse", str(small), "--json"])
    strokes = answer(capsys)["strokes"]
    assert run(["analyse", str(small), "--area", "hertz", "--area-force", "1", "--json"]) == 0
    document = answer(capsys)
    assert document["settings"]["area"] == {"law": "hertz", "exponent": pytest.approx(2 / 3), "force": 1.0}
    for stroke, fixed_stroke in zip(document["strokes"], strokes, strict=True):
        assert stroke["tau_max"] * stroke["contact_area"] <= fixed_stroke["tau_max"] * 100.0 * (1 + 1e-9)
        assert stroke["contact_area"] > 100.0  # every stroke of the simulated subject presses harder than 1 N
    assert run(["analyse", str(small)]) == 0
    printed = capsys.readouterr().out
    assert "tangential force over the contact area: grows as N^0.667 (Hertz" in printed
    assert "at 1 N, set;" in printed
    assert run(["verify", str(small)]) == 0


def test_a_calibration_error_that_was_set_is_taken_by_every_verb_until_another_is_set(small, capsys):
    run(["analyse", str(small), "--json"])
    usual = answer(capsys)["bootstrap"]
    assert usual["settings"]["gain_error_origin"] == "assumed"
    run(["analyse", str(small), "--calibration-error", "0.1", "--json"])
    bootstrap = answer(capsys)["bootstrap"]
    for stroke, usual_stroke in zip(bootstrap["strokes"], usual["strokes"], strict=True):
        # What is not known of the lean is in both.
        assert np.ptp(stroke["normal_force"]) < np.ptp(usual_stroke["normal_force"])
    (small / "analysis.json").write_text("torn")  # what was set is no part of what can be made anew
    assert run(["analyse", str(small), "--json"]) == 3
    assert answer(capsys)["bootstrap"] == bootstrap
    assert run(["predict", str(small), "--beside", "none", "--json"]) == 0
    assert answer(capsys)["gain_error"] == 0.001
    assert json.loads((small / "analysis.json").read_text())["bootstrap"] == bootstrap
    assert run(["verify", str(small)]) == 0
    recording = Recording.open(small)
    analysis = analyse(recording, AnalysisSettings(gain_error=gain_error_set(small)))
    assert "0.1 % of each axis, set" in findings(recording, analysis).interval_kind
    plain = PredictionOptions(course="steady")
    assert visit_of(recording, VisitOptions(plain), {}).calibration == "0.1 % of each axis, set"
    assert visit_of(recording, VisitOptions(plain, gain_error=0.003), {}).calibration == "0.3 % of each axis, set"


@pytest.mark.slow
def test_what_was_set_is_exported_without_an_analysis_and_a_damaged_setting_is_named_not_assumed(small, capsys):
    run(["analyse", str(small), "--calibration-error", "0.1"])
    (small / "analysis.json").unlink()
    assert run(["export", str(small), "--format", "csv", "--out", str(small.parent / "csv")]) == 0
    copy = json.loads((small.parent / "csv" / "analysis.json").read_text())
    assert copy["bootstrap"]["settings"]["gain_error"] == 0.001
    (small / "calibration-error.json").write_text("torn")
    for verb in ("analyse", "predict", "report"):
        capsys.readouterr()
        assert run([verb, str(small)]) == 1
        assert "set it anew" in capsys.readouterr().err
    assert run(["analyse", str(small), "--calibration-error", "0.1"]) == 0


def test_a_prediction_made_with_another_calibration_error_is_named(small, capsys):
    run(["predict", str(small), "--beside", "none"])
    capsys.readouterr()
    run(["analyse", str(small), "--calibration-error", "0.1"])
    assert "prediction.json was made with another calibration error" in capsys.readouterr().err


def test_a_study_computes_a_session_again_once_another_calibration_error_was_set(small, tmp_path):
    shelf = Shelf(tmp_path / "results", VisitOptions())
    before = shelf.key(small)
    run(["analyse", str(small)])
    assert shelf.key(small) == before  # nobody set one
    run(["analyse", str(small), "--calibration-error", "0.1"])
    assert shelf.key(small) != before
    content = content_of(small)
    assert json.loads(content["calibration-error.json"])["gain_error"] == 0.001


def test_a_study_computes_a_session_again_once_something_was_decided_about_it(small, tmp_path):
    shelf = Shelf(tmp_path / "results", VisitOptions())
    before = shelf.key(small)
    run(["decide", str(small), "--trial", "2", "--keep", "--by", "E02", "--why", "looked at"])
    assert shelf.key(small) != before
