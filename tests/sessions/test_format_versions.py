"""Every version of the format still opens: sessions that the code of that version wrote, kept as they were."""

import json
import shutil
from pathlib import Path

import h5py
import msgspec
import pytest
from recordings import record_session, rows

from daq_app.cli.main import run
from sessions.exchange.exported import import_session, read_export
from sessions.recording import Recording, writer
from sessions.recording.archive import problems, seal
from sessions.recording.manifest import digest_of
from sessions.recording.schema import FORMAT_VERSION
from sessions.strokes import analyse

ARCHIVE = Path(__file__).parents[1] / "data" / "sessions"
VERSIONS = range(1, FORMAT_VERSION + 1)


def copy_of(version, name, tmp_path):
    """A copy: a log beside a live file may be folded by whoever opens it with leave to write."""
    return shutil.copytree(ARCHIVE / f"version-{version}" / name, tmp_path / name)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_sealed_session_of_every_version_opens_and_is_whole(tmp_path, version):
    folder = copy_of(version, "sealed", tmp_path)
    assert problems(folder) == ()
    assert json.loads((folder / "session.json").read_text())["format"]["version"] == version
    recording = Recording.open(folder)
    assert recording.plan.subject == "G01"
    assert [record.outcome for record in recording.trials] == ["scored", "scored"]
    assert recording.flaws == ("2 readings never arrived",)
    assert run(["verify", str(folder)]) == 0


@pytest.mark.parametrize("version", VERSIONS)
def test_a_sealed_session_of_every_version_gives_its_ground_truth(tmp_path, version):
    strokes = analyse(Recording.open(copy_of(version, "sealed", tmp_path))).strokes
    assert len(strokes) == 2
    for stroke in strokes:
        assert stroke.mu_dynamic == pytest.approx(0.5, abs=0.002)  # 1 N of drag under 2 N
        assert stroke.speed == pytest.approx(20.0, rel=0.01)
        assert stroke.direction == 1


@pytest.mark.parametrize("version", VERSIONS)
def test_the_copy_of_every_version_is_imported_as_the_session_it_was_made_of(tmp_path, version):
    folder = copy_of(version, "sealed", tmp_path)
    result = import_session(read_export(folder / "session.h5"), tmp_path / "again")
    assert result.differences == ()
    before, after = Recording.open(folder), Recording.open(tmp_path / "again")
    assert digest_of(after.blocks(), after.events) == digest_of(before.blocks(), before.events)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_session_of_every_version_that_a_crash_left_opens_and_can_be_sealed(tmp_path, version):
    folder = copy_of(version, "live", tmp_path)
    recording = Recording.open(folder)
    assert [record.outcome for record in recording.trials] == ["scored", "open"]
    assert recording.losses == ("the session has no end: it was cut short, or is still running",)
    (stroke,) = analyse(recording).strokes
    assert stroke.mu_dynamic == pytest.approx(0.5, abs=0.002)
    readings = len(recording.readings())
    seal(folder)
    assert problems(folder) == recording.losses
    assert len(Recording.open(folder).readings()) == readings == rows(folder, "SELECT sum(readings) FROM blocks")[0][0]


def test_what_later_programs_add_to_a_plan_leaves_sealed_sessions_whole(tmp_path, monkeypatch):
    def older(plan):
        return {name: value for name, value in msgspec.to_builtins(plan).items() if name not in {"answering_hand"}}

    monkeypatch.setattr(writer, "to_builtins", older)
    folder = record_session(tmp_path / "s")
    seal(folder)
    monkeypatch.undo()
    assert "answering_hand" not in rows(folder, "SELECT value FROM head WHERE name = 'plan'")[0][0]
    assert Recording.open(folder).plan.answering_hand is None
    assert problems(folder) == ()
    with h5py.File(folder / "session.h5") as copy:
        assert b"answering_hand" not in copy["head/plan"][0]


def test_what_an_earlier_program_did_not_know_in_a_plan_is_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "to_builtins", lambda plan: {**msgspec.to_builtins(plan), "gloves": "none"})
    folder = record_session(tmp_path / "s")
    seal(folder)
    assert Recording.open(folder).plan.subject == "S01"
    assert problems(folder) == ()
