"""The verb replay as scripts use it."""

import json
import shutil

import pytest
from examples import short_protocol

from daq_app.cli.main import run


@pytest.fixture(scope="module")
def session_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("replay") / "P07"
    protocol = folder.with_name("three.toml")
    protocol.write_text(short_protocol("three", "Three surfaces", [0, 100], [100]))
    words = ["run", str(protocol), "--device", "sim:?seed=7&rate=100", "--subject", "P07", "--headless"]
    assert run([*words, "--simulate-subject", "7", "--pace", "50", "--seed", "3", "--out", str(folder), "--json"]) == 0
    assert run(["analyse", str(folder), "--json"]) == 0
    return folder


def test_a_session_that_came_over_the_wire_replays_identical_with_exit_code_0(session_folder, capsys):
    assert run(["replay", str(session_folder), "--fast", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["differences"] == []
    assert document["compared"] == ["readings", "events", "analysis.json"]


def test_a_stored_number_that_comes_out_otherwise_is_named_with_exit_code_3(session_folder, tmp_path, capsys):
    session = shutil.copytree(session_folder, tmp_path / "P07")
    analysis = json.loads((session / "analysis.json").read_text())
    analysis["strokes"][2]["mu_dynamic"] += 1e-9
    (session / "analysis.json").write_text(json.dumps(analysis))
    assert run(["replay", str(session), "--fast", "--json"]) == 3
    difference, why = json.loads(capsys.readouterr().out)["differences"]
    assert difference.startswith("analysis.json.strokes[2].mu_dynamic was stored as")
    assert why.startswith("analysis.json was made by the same versions as now")


def test_an_analysis_that_names_a_damaged_decision_comes_out_the_same_again(session_folder, tmp_path, capsys):
    session = shutil.copytree(session_folder, tmp_path / "P07")
    (session / "decisions.jsonl").write_text("junk\n")
    run(["analyse", str(session), "--json"])
    capsys.readouterr()
    assert run(["verify", str(session), "--json"]) == 3
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert problems == ["line 1 of decisions.jsonl is left out: it holds no decision"]
    assert run(["replay", str(session), "--fast", "--json"]) == 0


def test_results_from_before_a_decision_are_compared_with_those_of_their_time(session_folder, tmp_path, capsys):
    session = shutil.copytree(session_folder, tmp_path / "P07")
    earlier = (session / "analysis.json").read_bytes()
    decision = ["--trial", "1", "--drop", "--by", "E02", "--why", "the finger rolled"]
    assert run(["decide", str(session), *decision, "--json"]) == 0
    (session / "analysis.json").write_bytes(earlier)
    capsys.readouterr()
    assert run(["replay", str(session), "--fast", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["differences"] == []
    assert document["notes"] == ["analysis.json was made under other decisions than those in force: compute it again"]


def test_a_replay_leaves_the_session_as_it_was(session_folder):
    before = {path.name: path.read_bytes() for path in session_folder.iterdir()}
    assert run(["replay", str(session_folder), "--speed", "500", "--json"]) == 0
    assert {path.name: path.read_bytes() for path in session_folder.iterdir()} == before


def test_a_recording_is_a_device_that_can_be_probed(session_folder, capsys):
    assert run(["devices", "probe", f"replay:{session_folder}", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["simulated"] is True
    assert document["serial"] == "SIM00007"
    assert document["health"]["received"] > 0  # how many of a stretch depends on how this machine kept pace with it


@pytest.mark.parametrize(
    ("words", "code"), [(["--speed", "0"], 2), (["--speed", "fast"], 2), (["--fast", "--speed", "2"], 2)]
)
def test_a_pace_that_cannot_be_is_exit_code_2(session_folder, words, code, capsys):
    assert run(["replay", str(session_folder), *words]) == code
    assert capsys.readouterr().err


def test_what_is_no_recording_is_exit_code_1(tmp_path, capsys):
    assert run(["replay", str(tmp_path), "--fast"]) == 1
    assert capsys.readouterr().err.count("\n") == 1
