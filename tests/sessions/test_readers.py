"""The short readers of docs/readers tell what lies in the file, each in its own language."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from recordings import change, read_plainly, rows
from simulated_session import Session

from sessions.exchange import ExportSource, export
from sessions.recording import Recording
from sessions.recording.archive import seal
from sessions.strokes import analyse

READERS = Path(__file__).parents[2] / "docs" / "readers"


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("readers") / "s"
    Session(folder, lost=(700, 701)).run()
    seal(folder)
    return folder


def stdout(command, **options):
    process = subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8", **options)
    assert process.returncode == 0, process.stderr
    return process.stdout


def check(text, folder):
    """Compare with the file as sqlite3 and struct read it; the stand-in has 1e-6 N and 1e-3 N mm a count."""
    readings = read_plainly(folder)
    assert text.startswith("SIMULATED: the transducer and the subject")
    assert f"{len(readings)} readings {rows(folder, 'SELECT count(*) FROM events')[0][0]} events" in text
    readings_text = re.findall(r"reading (\d+) at (\S+) s: (.*)", text)
    assert len(readings_text) == 3
    for (sequence, time, wrench), reading in zip(readings_text, readings, strict=False):
        assert int(sequence) == reading[0]
        assert float(time) == pytest.approx(reading[3], abs=1e-6)
        expected = [raw * scale for raw, scale in zip(reading[5:], [1e-6] * 3 + [1e-3] * 3, strict=True)]
        assert list(map(float, wrench.split())) == pytest.approx(expected, rel=1e-8)
    scores = [(record.trial.number, record.score) for record in Recording.open(folder).trials]
    assert [(int(n), float(s)) for n, s in re.findall(r"trial (\d+) score (\S+)", text)] == scores
    assert len(scores) == 10


def test_python_alone_reads_the_live_file(session):
    check(stdout([sys.executable, "-I", READERS / "read_session.py", session]), session)


def test_python_alone_reads_a_folder_of_any_name(session, tmp_path):
    folder = shutil.copytree(session, tmp_path / "P07 #2, 50%?")
    check(stdout([sys.executable, "-I", READERS / "read_session.py", folder]), session)


def test_python_alone_refuses_a_folder_without_a_recording_in_one_sentence(tmp_path):
    words = [sys.executable, "-I", READERS / "read_session.py", tmp_path]
    result = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == f"{tmp_path} has no session.sqlite; give the folder of a session\n"


def test_python_alone_names_what_is_damaged(session, tmp_path):
    folder = shutil.copytree(session, tmp_path / "s")
    change(folder, "UPDATE blocks SET raw = zeroblob(length(raw)) WHERE number = 2")
    change(folder, "UPDATE events SET data = '{}' WHERE number = 1")
    text = stdout([sys.executable, "-I", READERS / "read_session.py", folder])
    assert "block 2 is damaged and left out" in text
    assert "event 1 is damaged and left out" in text


@pytest.mark.skipif(shutil.which("octave") is None, reason="GNU Octave is not installed")
def test_octave_reads_the_sealed_copy(session):
    words = ["octave", "--no-gui", "--quiet", "--no-init-file", "--eval", f"read_session('{session}/session.h5')"]
    check(stdout(words, cwd=READERS), session)


@pytest.mark.skipif(shutil.which("Rscript") is None, reason="R is not installed")
def test_r_alone_reads_the_csv_export(session, tmp_path):
    recording = Recording.open(session)
    analysis = {"made_by": {}, **analyse(recording).to_dict()}
    folder = export(ExportSource(recording, analysis, None), "csv", tmp_path / "csv")
    check(stdout(["Rscript", "--vanilla", READERS / "read_session.R", folder]), session)
