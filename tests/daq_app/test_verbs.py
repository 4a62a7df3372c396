"""Verbs that record, check and carry a session, as met at a command line: what they print, files, exit codes."""

import errno
import hashlib
import json
import os
import re
import shutil
import signal
import sqlite3
import stat
import zlib
from contextlib import closing
from dataclasses import fields, replace

import numpy as np
import pytest
from examples import short_protocol
from json_answer import answer
from recordings import PLAN, TRIAL, new_writer, record_session

from daq_app.cli.main import run
from daq_app.cli.verbs import demo
from daq_app.console import Console
from daq_app.simulation import synthetic
from sessions.plan.plan import Stimulus
from sessions.recording import Recording, archive
from sessions.recording.schema import COLUMNS
from sessions.strokes import forces
from sessions.strokes.settings import FilterSettings

ROUGH = replace(TRIAL, stimulus=Stimulus("roughness", 20, "R1"))


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory):
    """One simulated session of three trials; tests that change it take a copy."""
    folder = tmp_path_factory.mktemp("recorded") / "P07"
    protocol = folder.with_name("three.toml")
    protocol.write_text(short_protocol("three", "Three surfaces", [0, 100], [100]))
    words = ["run", str(protocol), "--device", "sim:?seed=7&rate=100", "--subject", "P07", "--headless"]
    assert run([*words, "--simulate-subject", "7", "--pace", "20", "--seed", "3", "--out", str(folder), "--json"]) == 0
    return folder


@pytest.fixture
def session(session_folder, tmp_path):
    return shutil.copytree(session_folder, tmp_path / "P07")


def test_a_simulated_session_analyses_without_a_flaw_and_says_simulated(session, capsys):
    assert run(["analyse", str(session), "--json"]) == 0
    document = answer(capsys)
    assert {flaw["name"] for flaw in document["flaws"]} <= {"tilt_assumed"}
    assert [stroke["trial"] for stroke in document["strokes"]] == [1, 2, 3]
    required = {"trial", "onset", "lift", "steady", "mu_static", "mu_dynamic", "tau_max", "speed", "direction", "flaws"}
    assert all(required <= set(stroke) for stroke in document["strokes"])
    assert "SIMULATED" in json.dumps(document)


def test_every_file_of_a_simulated_session_says_simulated(session, capsys):
    run(["predict", str(session), "--beside", "none"])
    capsys.readouterr()
    for name in ("session.json", "analysis.json", "prediction.json", "MANIFEST.json"):
        assert "SIMULATED" in (session / name).read_text()[:200], name


def test_verify_names_a_changed_byte_of_the_recording_with_exit_code_3(session, capsys):
    live = session / "session.sqlite"
    live.chmod(stat.S_IRUSR | stat.S_IWUSR)
    content = bytearray(live.read_bytes())
    content[len(content) // 2] ^= 1
    live.write_bytes(content)
    assert run(["verify", str(session), "--json"]) == 3
    assert any("session.sqlite" in problem for problem in answer(capsys)["problems"])


def test_verify_names_a_derived_number_that_comes_out_otherwise(session, capsys):
    run(["analyse", str(session)])
    document = json.loads((session / "analysis.json").read_text())
    document["strokes"][1]["mu_dynamic"] += 1e-9
    (session / "analysis.json").write_text(json.dumps(document))
    capsys.readouterr()
    assert run(["verify", str(session), "--json"]) == 3
    *_, difference, remedy = answer(capsys)["problems"]
    assert "strokes[1].mu_dynamic" in difference
    assert remedy.endswith("'daq-app analyse' computes it again")
    assert run(["analyse", str(session)]) == run(["verify", str(session)]) == 0


def test_verify_names_every_number_that_a_changed_constant_of_the_analysis_changes(session, capsys, monkeypatch):
    run(["analyse", str(session)])
    names = [field.name for field in fields(FilterSettings)]
    defaults = list(FilterSettings.__init__.__defaults__)
    place = names.index("smoothing") - len(names)
    assert defaults[place] == 0.1
    defaults[place] = 0.2
    monkeypatch.setattr(FilterSettings.__init__, "__defaults__", tuple(defaults))
    capsys.readouterr()
    assert run(["verify", str(session), "--json"]) == 3
    problems = answer(capsys)["problems"]
    assert "analysis.json.settings.filter.smoothing was stored as 0.1 and comes out as 0.2 (+100 %)" in problems
    assert any("mu_max was stored as" in problem for problem in problems)
    assert any("analysis.json was made by the same versions as now" in problem for problem in problems)


def test_verify_names_what_a_changed_constant_inside_the_analysis_changes(session, capsys, monkeypatch):
    run(["analyse", str(session)])
    monkeypatch.setattr(forces, "_TWO_PASSES", 1.0)
    capsys.readouterr()
    assert run(["verify", str(session), "--json"]) == 3
    assert any("friction[0].mu was stored as" in problem for problem in answer(capsys)["problems"])


@pytest.mark.parametrize("name", ["MANIFEST.json", "analysis.json", "session.h5", "session.json", "session.sqlite"])
def test_verify_names_the_file_in_which_one_byte_is_changed(session, capsys, name):
    if name == "analysis.json":
        run(["analyse", str(session)])
    path = session / name
    content = path.read_bytes()
    for part in (0.0, 0.3, 0.83):
        changed_bytes = bytearray(content)
        changed_bytes[int(part * len(content))] ^= 4
        path.chmod(stat.S_IRUSR | stat.S_IWUSR)
        path.write_bytes(changed_bytes)
        capsys.readouterr()
        code = run(["verify", str(session), "--json"])
        output = capsys.readouterr()
        assert code == 3 or (code == 1 and name == "session.sqlite")
        assert name in (output.out if code == 3 else output.err)


@pytest.mark.parametrize("column", ["raw", "time", "received_ns", "status"])
def test_verify_names_a_changed_reading_whose_check_sums_were_made_to_fit(session, capsys, column):
    live = session / "session.sqlite"
    live.chmod(stat.S_IRUSR | stat.S_IWUSR)
    with closing(sqlite3.connect(live)) as file:
        names = list(COLUMNS)
        blobs = list(file.execute(f"SELECT {', '.join(names)} FROM blocks WHERE number = 3").fetchone())
        changed_bytes = bytearray(blobs[names.index(column)])
        changed_bytes[2] ^= 1
        blobs[names.index(column)] = bytes(changed_bytes)
        crc = zlib.crc32(b"".join(blobs))
        file.execute(f"UPDATE blocks SET {column} = ?, crc32 = ? WHERE number = 3", (bytes(changed_bytes), crc))
        file.commit()
    manifest = json.loads((session / "MANIFEST.json").read_text())
    manifest["files"]["session.sqlite"]["sha256"] = hashlib.sha256(live.read_bytes()).hexdigest()
    (session / "MANIFEST.json").write_text(json.dumps(manifest))
    assert run(["verify", str(session), "--json"]) == 3
    problems = answer(capsys)["problems"]
    assert any(problem.startswith(f"{column} of the readings") and "session.h5" in problem for problem in problems)
    assert f"sha256.columns.{column} of session.json differs from the live file" in problems


@pytest.mark.parametrize("content", ["{", "[]", '{"options": {"course": 7}}', '{"options": []}', "nothing"])
def test_verify_names_a_document_beside_the_recording_that_cannot_be_read(session, capsys, content):
    (session / "prediction.json").write_text(content)
    assert run(["verify", str(session), "--json"]) == 3
    assert any("prediction.json" in problem for problem in answer(capsys)["problems"])


def test_a_session_goes_out_and_comes_back_by_the_command_line(session, tmp_path, capsys):
    run(["predict", str(session), "--beside", "none"])
    capsys.readouterr()
    out = tmp_path / "out"
    assert run(["export", str(session), "--format", "csv", "--out", str(out), "--json"]) == 0
    assert str(out / "predictions.csv") in answer(capsys)["files"]
    assert run(["import", str(out), "--out", str(tmp_path / "again"), "--json"]) == 0
    assert answer(capsys)["differences"] == []
    assert run(["verify", str(tmp_path / "again")]) == 0
    folder = tmp_path / "P07.h5"  # named as the file in it might be
    assert run(["export", str(session), "--format", "hdf5", "--out", str(folder)]) == 0
    assert run(["import", str(folder), "--out", str(tmp_path / "P07 again")]) == 0
    assert run(["import", str(out), "--units", "N,Nmm", "--out", str(tmp_path / "third")]) == 2
    assert run(["export", str(session), "--format", "csv", "--out", str(out)]) == 1
    assert run(["export", str(session), "--format", "xls"]) == 2


def test_verify_of_what_is_no_recording_is_exit_code_1(tmp_path, capsys):
    (tmp_path / "session.sqlite").write_bytes(b"not a database at all" * 100)
    assert run(["verify", str(tmp_path)]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_session_is_never_written_over(session_folder, capsys):
    before = {path.name: path.read_bytes() for path in session_folder.iterdir()}
    words = ["run", "sensotact-friction", "--scores-only", "--subject", "P08", "--simulate-subject", "1"]
    assert run([*words, "--out", str(session_folder)]) == 1
    assert "not empty" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in session_folder.iterdir()} == before


def test_a_folder_whose_name_no_disk_takes_is_a_sentence_and_no_bug_of_the_recorder(tmp_path, capsys):
    words = ["run", "sensotact-friction", "--scores-only", "--subject", "P08", "--simulate-subject", "1"]
    assert run([*words, "--out", str(tmp_path / ("n" * 300))]) == 1
    output = capsys.readouterr().err
    assert "check its name" in output
    assert "unexpected" not in output


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (["--device", "sim:", "--subject", "Anna Schmidt"], 2, "Anna Schmidt"),
        (["--device", "sim:?speed=3", "--subject", "P1", "--simulate-subject", "1"], 2, "speed"),
        (["--device", "teapot://x", "--subject", "P1"], 2, "teapot"),
        (["--device", "net-ft://127.0.0.1?http=9", "--subject", "P1"], 1, "127.0.0.1"),
        (["--device", "net-ft://127.0.0.1", "--subject", "P1", "--simulate-subject", "1"], 2, "simulate"),
        (["--device", "sim:", "--subject", "P1", "--height", "nan"], 2, "--height nan is not allowed: -500 to 500"),
        (["--device", "sim:", "--subject", "P1", "--height", "501"], 2, "--height 501"),
        (["--device", "sim:", "--subject", "P1", "--contact-area", "0"], 2, "--contact-area 0"),
        (["--device", "sim:", "--subject", "P1", "--simulate-subject", "-1"], 2, "--simulate-subject -1"),
    ],
)
def test_a_session_that_cannot_begin_says_why_and_leaves_no_folder(arguments, code, sentence, tmp_path, capsys):
    folder = tmp_path / "none"
    assert run(["run", "sensotact-friction", *arguments, "--out", str(folder)]) == code
    output = capsys.readouterr().err
    assert sentence in output.splitlines()[-1]
    assert not folder.exists()


def damage_plan(live):
    with closing(sqlite3.connect(live)) as connection, connection:
        connection.execute("UPDATE head SET value = '{}' WHERE name = 'plan'")


@pytest.mark.parametrize("damage", [lambda live: live.unlink(), lambda live: os.truncate(live, 5000), damage_plan])
def test_a_live_file_that_is_gone_or_torn_is_made_again_of_the_sealed_copy_as_the_sentence_says(
    session, tmp_path, capsys, damage
):
    readings = Recording.open(session).readings()
    (session / "session.sqlite").chmod(0o644)
    damage(session / "session.sqlite")
    assert run(["analyse", str(session)]) == 1
    command = re.search(r"'daq-app (import [^']*session[.]h5)'", capsys.readouterr().err)
    assert run([*command.group(1).split(), "--out", str(tmp_path / "again")]) == 0
    again = Recording.open(tmp_path / "again").readings()
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(again, name), getattr(readings, name))


def test_an_import_that_cannot_be_sealed_leaves_no_folder(session, tmp_path, capsys, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(archive, "write_copy", full)
    csv = tmp_path / "strokes.csv"
    csv.write_text("t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm\n0,1,2,3,4,5,6\n0.1,1,2,3,4,5,6\n")
    for source in (session / "session.h5", csv):
        assert run(["import", str(source), "--out", str(tmp_path / "again")]) == 1
        output = capsys.readouterr().err
        assert "free space on the disk, and import again: nothing is left of it" in output
        assert "resume" not in output
        assert not (tmp_path / "again").exists()


@pytest.mark.skipif(os.name != "posix", reason="limits the size of files")
def test_an_import_that_fills_the_disk_says_that_nothing_is_left_of_it(session, tmp_path, capsys):
    import resource

    csv = tmp_path / "strokes.csv"
    rows = [f"{0.1 * at:.1f},1,2,3,4,5,6" for at in range(2000)]
    csv.write_text("\n".join(["t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm", *rows]))
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    for source in (session / "session.h5", csv):
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, before[1]))  # a live file takes more
        try:
            code = run(["import", str(source), "--out", str(tmp_path / "again")])
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sentence = capsys.readouterr().err
        assert code == 1
        assert f"{tmp_path / 'again'} cannot be written (" in sentence
        assert "import again: nothing is left of it" in sentence
        assert "safe" not in sentence
        assert not (tmp_path / "again").exists()


def test_an_export_that_lacks_a_file_is_refused_by_the_files_name(session, tmp_path, capsys):
    assert run(["export", str(session), "--format", "csv", "--out", str(tmp_path / "csv")]) == 0
    (tmp_path / "csv" / "events.csv").unlink()
    assert run(["import", str(tmp_path / "csv"), "--out", str(tmp_path / "again")]) == 1
    assert "(events.csv: no such file or directory); export the session anew" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "making"),
    [(["demo"], (demo, "simulated_study")), (["study", "--synthetic", "1"], (synthetic, "synthetic_study"))],
)
def test_a_verb_that_is_stopped_after_it_recorded_says_where_that_is(tmp_path, capsys, monkeypatch, words, making):
    def stop(*_):
        raise KeyboardInterrupt

    def study(out, *_):
        record_session(out / "S01")
        stop()

    monkeypatch.setattr(*making, study)
    assert run([*words, "--out", str(tmp_path / "kept"), "--json"]) == 3
    assert answer(capsys)["error"]["message"] == f"stopped; what was recorded is in {tmp_path / 'kept'}"
    monkeypatch.setattr(*making, stop)
    assert run([*words, "--out", str(tmp_path / "none")]) == 130


@pytest.mark.skipif(os.name != "posix", reason="signals reach a process otherwise on this system")
def test_a_stop_within_a_simulated_visit_ends_the_study_there(tmp_path, monkeypatch):
    monkeypatch.setattr(Console, "progress", lambda *_: os.kill(os.getpid(), signal.SIGINT))
    assert run(["study", "--synthetic", "1", "--out", str(tmp_path)]) == 3
    assert [folder.name for folder in tmp_path.iterdir()] == ["S01"]
    assert Recording.open(tmp_path / "S01").end["cause"] == "stopped"


def test_a_report_takes_no_scores_twice(session, tmp_path, capsys):
    words = ["report", str(session), "-o", str(tmp_path / "page.html"), "--scores", str(session)]
    assert run(words) == 2
    assert "in the report already" in capsys.readouterr().err


def test_a_report_takes_no_visit_that_adds_no_score(session, tmp_path, capsys):
    folder = tmp_path / "P08"
    writer = new_writer(folder)
    writer.event("skip", 1)
    writer.event("ended", data={"reason": "done"})
    writer.close()
    foreign = record_session(tmp_path / "P09", plan=replace(PLAN, blocks=(replace(PLAN.blocks[0], trials=(ROUGH,)),)))
    for visit, why in ((folder, "no score of any stimulus"), (foreign, "no score of a stimulus of this session")):
        assert run(["report", str(session), "-o", str(tmp_path / "page.html"), "--scores", str(visit)]) == 2
        sentence = capsys.readouterr().err
        assert str(visit) in sentence
        assert why in sentence


@pytest.mark.parametrize("words", [["-o", "taken/page.html"], ["--figures", "taken"]])
def test_a_report_that_has_no_place_is_refused_before_it_is_made(session, tmp_path, capsys, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("a file")
    assert run(["report", str(session), *words]) == 1
    assert "taken cannot be written into" in capsys.readouterr().err
    assert not (session / "prediction.json").exists()


@pytest.mark.skipif(os.name != "posix", reason="folders have no such permission")
def test_a_report_beside_a_recording_that_is_locked_is_refused_before_it_is_made(session, capsys, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: path != session or mode != os.W_OK)  # root may write anywhere
    assert run(["report", str(session)]) == 1
    assert "P07 cannot be written into (Permission denied)" in capsys.readouterr().err
    assert not (session / "prediction.json").exists()


def test_a_demonstration_is_written_over_nothing(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    assert run(["demo", "--out", str(tmp_path)]) == 1
    assert "is not empty" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("verb", ["analyse", "predict", "report", "study"])
def test_a_calibration_error_that_is_none_is_refused_with_exit_code_2(session_folder, capsys, verb):
    assert (
        run([verb, str(session_folder if verb != "study" else session_folder.parent), "--calibration-error", "-1"]) == 2
    )
    assert "--calibration-error" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--area", "round"], ["--area", "1.5"], ["--area-force", "2"]])
def test_a_law_of_the_area_that_is_none_is_refused_with_exit_code_2(session_folder, capsys, words):
    assert run(["analyse", str(session_folder), *words]) == 2
    assert "--area" in capsys.readouterr().err
