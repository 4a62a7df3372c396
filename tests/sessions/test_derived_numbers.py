"""Numbers and pages made from a recording: stored beside it, listed, made anew, and never in its place."""

import json
import math
import os
import sqlite3
import threading
from dataclasses import replace

import numpy as np
import pytest
from recordings import record_session
from stand_ins import INFO

from sessions.recording import Recording, RecordingError, manifest
from sessions.recording.archive import problems, seal
from sessions.recording.derived import load_derived, store_derived, store_page

REAL = replace(INFO, simulated=False)


@pytest.fixture
def sealed_dir(tmp_path):
    folder = record_session(tmp_path / "s", blocks=5, subject_simulated=True)
    seal(folder)
    return folder


def test_derived_numbers_come_back_with_the_versions_that_made_them(sealed_dir):
    path = store_derived(sealed_dir, "analysis.json", {"strokes": [{"mu": 0.1 + 0.2, "speed": None}]})
    assert path == sealed_dir / "analysis.json"
    document = load_derived(sealed_dir, "analysis.json")
    assert document["strokes"] == [{"mu": 0.1 + 0.2, "speed": None}]
    assert document["made_by"]["numpy"] == np.__version__
    assert path.read_text().startswith('{\n "SIMULATED": ')
    assert problems(sealed_dir) == ()


def test_derived_numbers_are_listed_so_that_a_change_is_named(sealed_dir):
    path = store_derived(sealed_dir, "analysis.json", {"mu": 0.5})
    path.write_text(path.read_text().replace("0.5", "0.6"))
    assert problems(sealed_dir)[0].startswith("analysis.json is not what it was")


@pytest.mark.skipif(os.name != "posix", reason="folders are locked on POSIX alone")
def test_numbers_that_two_programs_store_at_once_are_both_listed(sealed_dir, monkeypatch):
    (sealed_dir / "prediction.json").write_text("{}")
    another = threading.Thread(target=manifest.list_in_manifest, args=(sealed_dir, ("prediction.json",)))

    def interrupt(path):
        monkeypatch.undo()
        another.start()
        another.join(1.0)  # by then it would be done, and its line be written over
        return manifest.file_sha256(path)

    monkeypatch.setattr(manifest, "file_sha256", interrupt)
    store_derived(sealed_dir, "analysis.json", {"a": 1})
    another.join()
    assert {"analysis.json", "prediction.json"} <= set(json.loads((sealed_dir / "MANIFEST.json").read_bytes())["files"])
    assert problems(sealed_dir) == ()


def test_derived_numbers_made_anew_replace_the_old_ones_as_a_whole(sealed_dir, monkeypatch):
    store_derived(sealed_dir, "analysis.json", {"mu": 0.5})
    store_derived(sealed_dir, "analysis.json", {"mu": 0.7})
    assert load_derived(sealed_dir, "analysis.json")["mu"] == 0.7
    assert problems(sealed_dir) == ()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sessions.file_access.os.fsync", full)
    with pytest.raises(RecordingError, match="No space left on device"):
        store_derived(sealed_dir, "analysis.json", {"mu": 0.9})
    assert load_derived(sealed_dir, "analysis.json")["mu"] == 0.7
    assert problems(sealed_dir) == ()


def test_derived_numbers_are_stored_beside_a_session_that_is_not_sealed_yet(tmp_path):
    folder = record_session(tmp_path / "s", info=REAL)
    store_derived(folder, "analysis.json", {"mu": 0.5})
    assert "SIMULATED" not in (folder / "analysis.json").read_text()
    assert load_derived(folder, "prediction.json") is None


def test_a_page_is_stored_and_listed(sealed_dir):
    store_page(sealed_dir, "report.html", "<p>SIMULATED</p>")
    assert "report.html" in json.loads((sealed_dir / "MANIFEST.json").read_bytes())["files"]
    assert problems(sealed_dir) == ()


def test_a_number_that_is_none_is_refused(sealed_dir):
    with pytest.raises(ValueError, match="JSON"):
        store_derived(sealed_dir, "analysis.json", {"mu": math.nan})
    assert not (sealed_dir / "analysis.json").exists()


@pytest.mark.parametrize("name", ["session.json", "MANIFEST.json", "../analysis.json", "a/b.json", ".hidden", ""])
def test_what_was_recorded_and_what_lies_elsewhere_is_never_written_over(sealed_dir, name):
    with pytest.raises(ValueError, match="is no name for a file made from a recording"):
        store_derived(sealed_dir, name, {})


def test_a_damaged_derived_file_is_named(sealed_dir):
    (sealed_dir / "analysis.json").write_text("{")
    with pytest.raises(RecordingError, match=r"analysis\.json is damaged .*make it anew"):
        load_derived(sealed_dir, "analysis.json")


def test_a_sealed_session_is_opened_without_side_files(sealed_dir):
    Recording.open(sealed_dir).readings()
    assert not list(sealed_dir.glob("session.sqlite-*"))
    with sqlite3.connect(f"file:{sealed_dir / 'session.sqlite'}?mode=ro", uri=True) as connection:
        assert connection.execute("SELECT count(*) FROM blocks").fetchone() == (5,)
    connection.close()
