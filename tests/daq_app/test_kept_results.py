"""What somebody set is kept, or named where it is lost; nothing of somebody else's is written over."""

import json
import shutil
from unittest.mock import Mock

import pytest
from json_answer import answer
from report_session import record

from daq_app.cli.main import run
from sessions.recording import RecordingError
from sessions.recording.archive import seal


@pytest.fixture(scope="module")
def two_trials(tmp_path_factory):
    """A sealed session of two trials; tests that change it take a copy."""
    folder, _ = record(tmp_path_factory.mktemp("two") / "P01", per_block=1)
    seal(folder)
    return folder


@pytest.fixture
def small(two_trials, tmp_path):
    return shutil.copytree(two_trials, tmp_path / "P01")


@pytest.mark.parametrize("verb", ["analyse", "predict"])
def test_a_damaged_analysis_is_made_anew_and_the_loss_of_what_was_set_in_it_is_named(small, capsys, verb):
    assert run(["analyse", str(small), "--area", "hertz", "--bootstrap-seed", "7"]) == 0
    (small / "analysis.json").write_text("{")
    capsys.readouterr()
    assert run([verb, str(small)]) == 3
    error = capsys.readouterr().err
    assert "analysis.json is damaged" in error
    assert "the law of the contact area and seed of the intervals are the usual ones now" in error
    assert json.loads((small / "analysis.json").read_bytes())["settings"]["area"]["law"] == "fixed"
    assert run([verb, str(small)]) == 0


def test_a_damaged_prediction_is_made_anew_and_the_loss_of_what_was_set_in_it_is_named(small, capsys):
    (small / "prediction.json").write_text("{")
    assert run(["predict", str(small)]) == 3
    error = capsys.readouterr().err
    assert "prediction.json is damaged" in error
    assert "the options and afferent of the prediction are the usual ones now" in error


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
    assert ("not kept: the disk is full" in errors, "intervals" in errors) == (True, False)  # the file still holds them
    run(["predict", str(small), *words])
    assert "intervals of the SED (--intervals)" in capsys.readouterr().err
    document = json.loads((small / "prediction.json").read_text())["afferent"]
    assert (document["settings"], document["reference_sed"]) == (afferent["settings"], afferent["reference_sed"])
    assert [trial["rate"] for trial in document["trials"]] == [trial["rate"] for trial in afferent["trials"]]


def test_an_analysis_of_odd_parts_is_refused_in_a_sentence_and_made_anew_where_that_is_asked_for(small, capsys):
    (small / "analysis.json").write_text('{"strokes": [], "friction": [], "flaws": [], "bootstrap": 7}')
    assert run(["export", str(small), "--format", "csv", "--out", str(small.parent / "out")]) == 1
    assert run(["decide", str(small), "--trial", "1", "--drop", "--by", "E02", "--why", "pulled away"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if "analysis.json is damaged" in line and "daq-app analyse" in line] == lines
    assert run(["analyse", str(small)]) == 3
    assert run(["export", str(small), "--format", "csv", "--out", str(small.parent / "out")]) == 0
