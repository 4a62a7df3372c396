"""A session whose file is removed, renamed or replaced while it is recorded ends aloud, and loses nothing."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from recordings import PLAN, new_writer, readings
from simulated_session import Session, resume
from stand_ins import ResumableClock

from sessions.recording import Recording, RecordingError, SessionWriter, provenance
from sessions.recording.archive import problems, seal
from sessions.run.steps import AskStroke


def remove(folder):
    shutil.rmtree(folder)


def rename(folder):
    folder.rename(folder.with_name("elsewhere"))


def remove_with_all_around(folder):
    shutil.rmtree(folder.parent)


def unlink_the_log(folder):
    (folder / "session.sqlite-wal").unlink()


def unlink_the_file(folder):
    (folder / "session.sqlite").unlink()


def replace_the_file(folder):
    copy = shutil.copy(folder / "session.sqlite", folder.parent / "older.sqlite")
    Path(copy).replace(folder / "session.sqlite")


def replace_the_folder(folder):
    folder.rename(folder.with_name("elsewhere"))
    shutil.copytree(folder.with_name("elsewhere"), folder)


MISHAPS = (
    remove,
    rename,
    remove_with_all_around,
    unlink_the_log,
    unlink_the_file,
    replace_the_file,
    replace_the_folder,
)


@pytest.mark.parametrize("mishap", MISHAPS)
def test_a_session_whose_file_is_taken_away_ends_at_once_and_is_whole_in_the_folder_its_end_names(tmp_path, mishap):
    folder = tmp_path / "recordings" / "s"
    safe = []

    def mishap_at_stroke(_):
        if len(strokes) == 2:
            mishap(folder)
        strokes.append(1)

    strokes = []
    session = Session(folder, instead={AskStroke: mishap_at_stroke})
    session.writer.safe = safe.extend
    recording = session.run()
    end = session.end
    rescue_folder = folder.with_name("s-rescued")
    assert end.cause == "disk"
    assert "session.sqlite was removed, renamed or replaced; all that was measured is safe in" in end.reason
    assert str(rescue_folder) in end.reason
    assert recording.folder == rescue_folder
    assert recording.end["reason"] == end.reason
    assert list(recording.events) == safe
    assert recording.readings().sequence.tolist() == list(range(end.readings))
    assert recording.losses == ()


def test_a_rescued_session_is_resumed_at_the_same_trial_and_sealed(tmp_path):
    def mishap_at_stroke(_):
        shutil.rmtree(tmp_path / "s", ignore_errors=True)

    session = Session(tmp_path / "s", instead={AskStroke: mishap_at_stroke})
    session.run()
    end, recording = resume(tmp_path / "s-rescued")
    assert end.complete
    assert {record.outcome for record in recording.trials} == {"scored"}
    seal(tmp_path / "s-rescued")
    assert problems(tmp_path / "s-rescued") == ()


@pytest.mark.parametrize("mishap", MISHAPS)
def test_what_waited_in_memory_is_rescued_with_what_was_committed(tmp_path, mishap):
    folder = tmp_path / "recordings" / "s"
    writer = new_writer(folder)
    writer.readings(readings(0, 100))
    writer.event("started")
    writer.readings(readings(100, 50))
    mishap(folder)
    writer.close()
    assert "s-rescued" in writer.must_end
    recording = Recording.open(folder.with_name("s-rescued"))
    assert recording.readings().sequence.tolist() == list(range(150))
    assert [event.kind for event in recording.events] == ["started"]
    assert [path.name for path in folder.with_name("s-rescued").iterdir()] == ["session.sqlite"]


def test_a_second_mishap_is_survived_like_the_first(tmp_path):
    writer = new_writer(tmp_path / "s")
    for number, folder in enumerate(("s", "s-rescued", "s-rescued-rescued")):
        writer.event("note", data={"text": folder})
        assert writer.folder.name == folder
        shutil.rmtree(writer.folder)
        writer.readings(readings(10 * number, 10))
        writer.commit()
    writer.close()
    assert len(Recording.open(writer.folder).readings()) == 30


def test_a_resumed_session_is_looked_after_too(tmp_path):
    clock = ResumableClock()
    writer = new_writer(tmp_path / "s", clock=clock)
    writer.readings(readings(0, 10))
    writer.close()
    writer = SessionWriter.open(tmp_path / "s", clock)
    writer.event("resumed", data={})
    assert writer.must_end is None
    shutil.rmtree(tmp_path / "s")
    writer.event("note")
    assert "s-rescued" in writer.must_end
    writer.close()
    assert len(Recording.open(tmp_path / "s-rescued").readings()) == 10


def test_what_a_disk_took_no_more_of_is_rescued_elsewhere_when_its_folder_is_gone(tmp_path, monkeypatch):
    import sqlite3

    writer = new_writer(tmp_path / "s")
    writer.readings(readings(0, 10))
    write_waiting = writer._write_waiting

    def fails():
        monkeypatch.setattr(writer, "_write_waiting", write_waiting)
        raise sqlite3.OperationalError("disk I/O error")

    monkeypatch.setattr(writer, "_write_waiting", fails)
    shutil.rmtree(tmp_path / "s")
    writer.commit()
    assert "s-rescued" in writer.must_end
    writer.close()
    assert len(Recording.open(tmp_path / "s-rescued").readings()) == 10


def test_a_session_beside_which_nothing_can_be_written_is_rescued_in_the_users_home(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    writer = new_writer(tmp_path / "disk" / "s")
    writer.event("started")
    shutil.rmtree(tmp_path / "disk")
    (tmp_path / "disk").write_text("no folder any more")
    writer.event("note")
    assert writer.folder == tmp_path / "home" / "s-rescued"
    writer.close()
    assert [event.kind for event in Recording.open(writer.folder).events] == ["started", "note"]


def test_a_session_that_can_be_written_nowhere_is_never_called_safe(tmp_path, monkeypatch):
    from sessions.recording import recovery

    safe = []
    writer = new_writer(tmp_path / "s")
    writer.safe = safe.extend
    writer.event("started")
    full = OSError(28, "No space left on device")
    monkeypatch.setattr(recovery, "sync_folder", lambda _: (_ for _ in ()).throw(full))
    shutil.rmtree(tmp_path / "s")
    with pytest.raises(RecordingError, match=r"could be written nowhere else .*No space left.*look for the folder"):
        writer.event("note")
    assert [event.kind for event in safe] == ["started"]
    assert writer.acknowledged.events == 1
    with pytest.raises(RecordingError, match="removed, renamed or replaced"):
        writer.event("note")
    writer.close()


def test_a_visit_that_only_scores_is_rescued_too(tmp_path):
    clock = ResumableClock()
    plan = replace(PLAN, forces=False)
    writer = SessionWriter.create(tmp_path / "s", plan, None, provenance(clock), clock=clock)
    shutil.rmtree(tmp_path / "s")
    writer.event("scored", 1, {"score": 12.0})
    writer.close()
    assert Recording.open(tmp_path / "s-rescued").events[0].data == {"score": 12.0}
