"""What somebody set is kept, or named where it is lost; nothing of somebody else's is written over."""

import json
from unittest.mock import Mock

import pytest
from json_answer import answer
from report_example import short

from daq_app.analyst.work import Work
from daq_app.cli.main import run
from sessions.file_access import NotOurs
from sessions.recording import RecordingError
from sessions.report import pages
from sessions.report.figures import plates


@pytest.mark.parametrize("verb", ["analyse", "predict"])
def test_a_damaged_analysis_is_made_anew_and_the_loss_of_what_was_set_in_it_is_named(small, capsys, verb):
    assert run(["analyse", str(small), "--area", "hertz", "--bootstrap-seed", "7"]) == 0
    (small / "analysis.json").write_text("{")
    capsys.readouterr()
    assert run([verb, str(small)]) == 3
    error = capsys.readouterr().err
    assert "analysis.json is damaged" in error
    assert "the law of the contact area and seed of the intervals are now the default ones" in error
    assert json.loads((small / "analysis.json").read_bytes())["settings"]["area"]["law"] == "fixed"
    assert run([verb, str(small)]) == 0


def test_the_window_and_a_fit_name_a_damaged_analysis_and_do_not_take_default_settings(small, tmp_path, capsys):
    (small / "analysis.json").write_text("{")
    log = tmp_path / "stage.csv"
    log.write_text("time_s,displacement_mm\n0,0\n1,1\n")
    assert run(["fit-finger", str(small), "--displacement", str(log)]) == 1
    assert "analysis.json is damaged" in capsys.readouterr().err
    with pytest.raises(RecordingError, match="'daq-app analyse' computes it again"):
        Work(small, lambda _: None)


def test_the_window_shows_strokes_beside_a_damaged_prediction_and_predicts_with_no_options_of_its_own(small):
    (small / "prediction.json").write_text("{")
    replies = []
    work = Work(small, replies.append)
    assert replies[-1].report.strokes
    with pytest.raises(RecordingError, match="'daq-app predict' computes it again"):
        work.go_on()
    assert work.unfinished


def test_a_damaged_prediction_is_made_anew_and_the_loss_of_what_was_set_in_it_is_named(small, capsys):
    (small / "prediction.json").write_text("{")
    assert run(["predict", str(small)]) == 3
    error = capsys.readouterr().err
    assert "prediction.json is damaged" in error
    assert "the options and afferent of the prediction are now the default ones" in error


def test_a_prediction_is_not_made_anew_where_a_sealed_one_forbids_the_seal(small, capsys):
    assert run(["predict", str(small), "--seal"]) == 0
    documents = {name: (small / name).read_bytes() for name in ("analysis.json", "prediction.json")}
    assert run(["predict", str(small), "--seal", "--area", "hertz", "--indentation", "1"]) == 1
    assert "none is sealed over it" in capsys.readouterr().err
    assert {name: (small / name).read_bytes() for name in documents} == documents


def test_intervals_and_variants_that_were_predicted_before_are_predicted_again_until_somebody_says_otherwise(small):
    def options():
        stored = json.loads((small / "prediction.json").read_bytes())["options"]
        return [stored[name] for name in ("intervals", "variant_intervals", "variants")]

    assert run(["predict", str(small)]) == 0
    assert options() == [False, False, "small"]
    assert run(["predict", str(small), "--intervals"]) == 0
    assert run(["predict", str(small), "--tau", "as-printed"]) == 0
    assert options() == [True, True, "small"]
    assert run(["predict", str(small), "--no-intervals", "--variants", "none"]) == 0
    assert options() == [False, False, "none"]


def test_the_afferent_stays_with_the_prediction_and_what_is_not_asked_for_again_is_named(small, capsys, monkeypatch):
    options = ["--afferent", "--afferent-set", "static_gain=30", "--intervals", "--beside", "none"]
    assert run(["predict", str(small), *options, "--json"]) == 0
    afferent = json.loads((small / "prediction.json").read_text())["afferent"]
    assert answer(capsys)["afferent"] == afferent
    assert run(["verify", str(small)]) == 0
    with monkeypatch.context() as full_disk:
        full_disk.setattr("daq_app.batch.derived.store_derived", Mock(side_effect=RecordingError("the disk is full")))
        words = ["--no-intervals", "--beside", "none"]
        assert run(["predict", str(small), *words]) == 3  # done, with a loss that is named
    errors = capsys.readouterr().err
    assert ("not saved: the disk is full" in errors, "intervals" in errors) == (True, False)  # the file holds them
    run(["predict", str(small), *words])
    assert "intervals of the SED (--intervals)" in capsys.readouterr().err
    document = json.loads((small / "prediction.json").read_text())["afferent"]
    assert (document["settings"], document["reference_sed"]) == (afferent["settings"], afferent["reference_sed"])
    assert [trial["rate"] for trial in document["trials"]] == [trial["rate"] for trial in afferent["trials"]]


@pytest.mark.parametrize("name", ["study.html", "trials.csv", "study.json", "rivals.csv"])
def test_a_study_writes_over_no_file_of_somebody_else(small, tmp_path, capsys, name):
    out = tmp_path / "results"
    out.mkdir()
    (out / name).write_text("mine\n")
    assert run(["study", str(small.parent), "--out", str(out)]) == 1
    assert f"{out / name} holds something else" in capsys.readouterr().err
    assert [(file.name, file.read_text()) for file in out.iterdir()] == [(name, "mine\n")]  # before hours of work


@pytest.mark.usefixtures("in_this_process")
def test_a_study_replaces_its_own_files_and_no_other(small, tmp_path):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "notes.txt").write_text("mine\n")
    for _ in range(2):
        assert run(["study", str(small.parent), "--out", str(tmp_path / "results")]) == 0
    assert (tmp_path / "results" / "notes.txt").read_text() == "mine\n"


def test_pictures_of_a_report_are_written_over_no_file_of_somebody_else(tmp_path):
    report = short()
    drawings = plates(report)
    for name in ("course.svg", "course.csv"):
        (tmp_path / name).write_text("<svg >mine</svg>\n")
        with pytest.raises(NotOurs, match=f"{name} holds something else"):
            pages.write_figures(report, tmp_path, drawings)
        assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [(name, "<svg >mine</svg>\n")]
        (tmp_path / name).unlink()
    assert pages.write_figures(report, tmp_path, drawings) == pages.write_figures(report, tmp_path, drawings)


@pytest.mark.parametrize("name", ["accuracy.html", "accuracy.json", "figures"])
def test_the_accuracy_page_is_written_over_no_file_of_somebody_else(tmp_path, capsys, name):
    (tmp_path / name).write_text("mine\n")
    assert run(["accuracy", "--quick", "--out", str(tmp_path)]) == 1
    assert f"{tmp_path / name} holds something else" in capsys.readouterr().err
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [(name, "mine\n")]


def test_an_analysis_of_odd_parts_is_refused_in_a_sentence_and_made_anew_where_that_is_asked_for(small, capsys):
    (small / "analysis.json").write_text('{"strokes": [], "friction": [], "flaws": [], "bootstrap": 7}')
    assert run(["export", str(small), "--format", "csv", "--out", str(small.parent / "out")]) == 1
    assert run(["decide", str(small), "--trial", "1", "--drop", "--by", "E02", "--why", "pulled away"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if "analysis.json is damaged" in line and "daq-app analyse" in line] == lines
    assert run(["analyse", str(small)]) == 3
    assert run(["export", str(small), "--format", "csv", "--out", str(small.parent / "out")]) == 0
