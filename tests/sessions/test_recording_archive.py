import hashlib
import itertools
import json
import math
import shutil
import sqlite3
import stat
import tracemalloc
from contextlib import closing
from dataclasses import replace

import h5py
import numpy as np
import pytest
from recordings import PLAN, change, new_writer, readings, record_crash, record_session, with_a_long_answer
from stand_ins import CALIBRATION, INFO

from sessions.recording import Recording, RecordingError
from sessions.recording.archive import problems, seal
from sessions.recording.manifest import SEALED, list_in_manifest, seal_differences
from sessions.recording.sealed_copy import read_texts, write_texts

REAL = replace(INFO, simulated=False)


@pytest.fixture(scope="module")
def sealed_original(tmp_path_factory):
    folder = record_session(tmp_path_factory.mktemp("sealed") / "s", blocks=5, subject_simulated=True)
    seal(folder)
    return folder


@pytest.fixture
def sealed_dir(sealed_original, tmp_path):
    """Return a copy of the sealed session, to be spoilt."""
    return shutil.copytree(sealed_original, tmp_path / "s")


def writable(path):
    path.chmod(0o644)
    return path


# ---- what sealing makes


def never_sealed(folder):
    """What is said of a session that has ended, with the command that seals it."""
    return f"the session was never sealed: there is no MANIFEST.json; 'daq-app resume {folder} --end' seals it"


def test_a_sealed_session_has_no_problems_and_its_files_are_read_only(sealed_dir):
    assert problems(sealed_dir) == ()
    assert sorted(path.name for path in sealed_dir.iterdir()) == [
        "MANIFEST.json",
        "session.h5",
        "session.json",
        "session.sqlite",
    ]
    for name in ("session.h5", "session.json", "session.sqlite"):
        assert not (sealed_dir / name).stat().st_mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH)


def test_the_copy_can_be_opened_by_hdf5_1_8(sealed_dir):
    content = (sealed_dir / "session.h5").read_bytes()
    assert content[:8] == b"\x89HDF\r\n\x1a\n"
    assert content[8] == 2  # superblock version; 1.8 reads up to 2
    # Fixed and extensible arrays of chunks came with 1.10; before that chunks were found by a B-tree of version 1.
    assert b"TREE" in content
    assert not any(signature in content for signature in (b"FAHD", b"EAHD"))


def test_the_copy_holds_every_reading_with_units_and_check_sums(sealed_dir):
    live = Recording.open(sealed_dir).readings()
    with h5py.File(sealed_dir / "session.h5") as copy:
        for name in ("sequence", "counter", "status", "time", "received_ns", "raw"):
            column = copy["readings"][name]
            assert column[...].tobytes() == getattr(live, name).tobytes()
            assert column.fletcher32
            assert "note" in column.attrs
        assert copy["readings/time"].attrs["unit"] == b"s"
        assert copy["readings/received_ns"].attrs["unit"] == b"ns"
        assert copy["calibration/matrix"][...].tolist() == CALIBRATION.matrix.tolist()
        assert copy["calibration/raw_unit"][...].tolist() == [b"counts"]


def test_the_copy_holds_events_trials_and_the_plan(sealed_dir):
    recording = Recording.open(sealed_dir)
    with h5py.File(sealed_dir / "session.h5") as copy:
        assert copy["events/kind"][...].tolist() == [event.kind.encode() for event in recording.events]
        ends = copy["events/data_end"][...].tolist()
        data = [copy["events/data"][a:b].tobytes() for a, b in itertools.pairwise([0, *ends])]
        assert [json.loads(text) for text in data] == [event.data for event in recording.events]
        assert copy["events/data"].fletcher32
        assert copy["events/data_end"].fletcher32
        assert copy["trials/score"][...].tolist() == [42.5]
        assert copy["trials/index"][...].tolist() == [20]
        plan = json.loads(copy["head/plan"][0])
        assert plan["blocks"][0]["scale_ends"][1] == "äußerst"
        assert plan["frame"] == {
            "normal": "-z",
            "normal_origin": "set",
            "height": 12.5,
            "height_origin": "measured",
        }


def test_a_score_that_was_not_given_is_not_a_number_in_the_copy(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.event("take_started", 1, {"take": 1})
    writer.event("scored", 1, {"score": None})
    writer.event("take_kept", 1, {"take": 1})
    writer.event("ended", data={"reason": "every trial is done"})
    writer.close()
    seal(tmp_path / "s")
    with h5py.File(tmp_path / "s" / "session.h5") as copy:
        assert math.isnan(copy["trials/score"][0])
        assert copy["trials/outcome"][0] == b"not answered"
    assert json.loads((tmp_path / "s" / "session.json").read_bytes())["trials"][0]["score"] is None
    assert problems(tmp_path / "s") == ()


def test_the_manifest_lists_the_sha_256_of_each_file(sealed_dir):
    files = json.loads((sealed_dir / "MANIFEST.json").read_bytes())["files"]
    assert set(files) == {"session.h5", "session.json", "session.sqlite"}
    for name, entry in files.items():
        assert entry["sha256"] == hashlib.sha256((sealed_dir / name).read_bytes()).hexdigest()
        assert entry["bytes"] == (sealed_dir / name).stat().st_size


def test_the_description_tells_plan_device_trials_and_end(sealed_dir):
    document = json.loads((sealed_dir / "session.json").read_bytes())
    assert document["plan"]["subject"] == "S01"
    assert document["transducer"]["calibration"]["matrix"] == CALIBRATION.matrix.tolist()
    matrix = np.array(document["transducer"]["calibration"]["matrix"], "<f8").tobytes()
    assert document["transducer"]["calibration"]["sha256"] == hashlib.sha256(matrix).hexdigest()
    assert document["readings"] == 500
    assert document["trials"][0]["score"] == 42.5
    assert document["ended"] == {"reason": "every trial is done"}
    assert document["losses"] == []


def test_what_was_simulated_says_so_at_the_head_of_every_file(sealed_dir):
    for name in ("session.json", "MANIFEST.json"):
        assert (sealed_dir / name).read_text().startswith('{\n "SIMULATED": "SIMULATED: the transducer and the subject')
    with h5py.File(sealed_dir / "session.h5") as copy:
        assert copy.attrs["SIMULATED"].startswith(b"SIMULATED: the transducer and the subject")


def test_what_was_real_says_nothing_of_the_kind(tmp_path):
    folder = record_session(tmp_path / "s", info=REAL)
    seal(folder)
    for name in ("session.json", "MANIFEST.json"):
        assert "SIMULATED" not in (folder / name).read_text()
    with h5py.File(folder / "session.h5") as copy:
        assert "SIMULATED" not in copy.attrs


def test_a_visit_for_scores_only_is_sealed_without_readings_or_calibration(tmp_path):
    folder = record_session(tmp_path / "s", info=None, blocks=0, plan=replace(PLAN, forces=False))
    seal(folder)
    assert problems(folder) == ()
    with h5py.File(folder / "session.h5") as copy:
        assert copy["readings/raw"].shape == (0, 6)
        assert "calibration" not in copy


def test_a_recording_without_trials_is_sealed(tmp_path):
    writer = new_writer(tmp_path / "s", plan=replace(PLAN, blocks=()))
    writer.readings(readings(0, 10))
    writer.close()
    seal(tmp_path / "s")
    with h5py.File(tmp_path / "s" / "session.h5") as copy:
        assert copy["trials/number"].shape == (0,)
    assert problems(tmp_path / "s") == ("the session has no end: it was cut short, or is still running",)


def test_one_long_answer_takes_room_and_memory_once_not_once_for_each_event(tmp_path):
    with_a_long_answer(tmp_path / "s", 20_000)
    tracemalloc.start()
    seal(tmp_path / "s")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert problems(tmp_path / "s") == ()
    file_size = (tmp_path / "s" / "session.sqlite").stat().st_size  # [bytes]
    assert file_size > 3e5
    assert (tmp_path / "s" / "session.h5").stat().st_size < 1.5 * file_size
    assert peak < 60 * file_size  # the answer as Python holds it in two recordings; 120 times is padding


@pytest.mark.parametrize("texts", [(), ("",), ("", "a" * 32_768, "", "b"), ("c" * 100_000, "{}"), ("12",) * 40_000])
def test_texts_of_any_length_come_back_as_they_were(tmp_path, texts):
    with h5py.File(tmp_path / "texts.h5", "w") as file:
        write_texts(file, "any", texts)
    with h5py.File(tmp_path / "texts.h5") as file:
        assert tuple(text.decode() for text in read_texts(file, "any")) == texts


# ---- what is refused


def test_a_session_is_sealed_once(sealed_dir):
    with pytest.raises(RecordingError, match="is sealed already"):
        seal(sealed_dir)


def test_a_session_that_is_still_written_is_not_sealed(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.event("started")
    with pytest.raises(RecordingError, match="end the program that still writes"):
        seal(tmp_path / "s")
    writer.event("ended")
    writer.close()
    seal(tmp_path / "s")
    assert problems(tmp_path / "s") == ()


def test_a_session_whose_commit_is_half_written_when_somebody_seals_it_goes_on_unaltered(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.event("started")
    log = tmp_path / "s" / "session.sqlite-wal"
    page = int.from_bytes(log.read_bytes()[8:12], "big")
    with log.open("ab") as file:
        file.write(log.read_bytes()[32 : 32 + 24] + bytes(page // 2))  # half a frame of this run
    assert any("hold no whole commit" in sentence for sentence in Recording.open(tmp_path / "s").losses)
    with pytest.raises(RecordingError, match="end the program that still writes"):
        seal(tmp_path / "s")
    writer.event("ended")
    writer.close()
    assert [event.kind for event in Recording.open(tmp_path / "s").events] == ["started", "ended"]


def test_a_copy_that_came_out_different_is_never_called_sealed(tmp_path, monkeypatch):
    folder = record_session(tmp_path / "s")
    from sessions.recording import archive

    def wrong_copy(recording, path):
        write_copy(recording, path)
        with h5py.File(path, "r+") as copy:
            copy["readings/raw"][7, 2] += 1.0

    write_copy = archive.write_copy
    monkeypatch.setattr(archive, "write_copy", wrong_copy)
    with pytest.raises(RecordingError, match=r"could not be sealed: raw of the readings 0 to 99 .* differs"):
        seal(folder)
    assert problems(folder) == (never_sealed(folder),)
    monkeypatch.undo()
    seal(folder)
    assert problems(folder) == ()


def test_a_disk_that_is_full_while_sealing_leaves_the_live_file_whole(tmp_path, monkeypatch):
    folder = record_session(tmp_path / "s")
    before = (folder / "session.sqlite").read_bytes()
    from sessions.recording import archive

    def full(_, path):
        path.write_bytes(b"half a file")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(archive, "write_copy", full)
    with pytest.raises(
        RecordingError,
        match=r"No space left on device.*free space on the disk, and seal it again with 'daq-app resume --end'",
    ):
        seal(folder)
    assert [path.name for path in folder.iterdir()] == ["session.sqlite"]
    assert (folder / "session.sqlite").read_bytes() == before


@pytest.mark.parametrize("step", ["write_copy", "put_in_place", "differences", "write_whole", "list_in_manifest"])
def test_sealing_that_was_cut_short_at_any_step_is_begun_anew(tmp_path, monkeypatch, step):
    from sessions.recording import archive

    folder = record_session(tmp_path / "s")

    class Killed(BaseException):
        """Stands for the end of the process."""

    def kill(*_):
        raise Killed

    monkeypatch.setattr(archive, step, kill)
    with pytest.raises(Killed):
        seal(folder)
    assert problems(folder) == (never_sealed(folder),)
    monkeypatch.undo()
    seal(folder)
    assert problems(folder) == ()


# ---- what checking finds


@pytest.mark.parametrize("name", ["session.h5", "session.json", "session.sqlite"])
def test_one_changed_byte_in_any_file_is_named(sealed_dir, name):
    path = writable(sealed_dir / name)
    content = bytearray(path.read_bytes())
    place = content.rfind(b"42.5") if b"42.5" in content else len(content) // 2
    content[place] ^= 1
    recording = Recording.open(sealed_dir)
    assert seal_differences(recording) == ()
    path.write_bytes(content)
    assert any(problem.startswith(f"{name} is not what it was") for problem in problems(sealed_dir))
    (sentence,) = seal_differences(recording)
    assert f"not as it was sealed ({name} is not what it was" in sentence


@pytest.mark.parametrize("name", ["session.json", "session.h5"])
def test_a_missing_file_is_named_once(sealed_dir, name):
    (sealed_dir / name).unlink()
    assert problems(sealed_dir) == (f"{name} is listed in MANIFEST.json and missing",)


def test_a_reading_changed_in_the_copy_is_named_even_when_the_manifest_was_changed_to_match(sealed_dir):
    with h5py.File(writable(sealed_dir / "session.h5"), "r+") as copy:
        copy["readings/raw"][250, 3] = 0.0
    list_in_manifest(sealed_dir, ("session.h5",))
    assert problems(sealed_dir) == ("raw of the readings 200 to 299 in session.h5 differs from the live file",)


def test_a_score_changed_in_the_copy_is_named_even_when_the_manifest_was_changed_to_match(sealed_dir):
    with h5py.File(writable(sealed_dir / "session.h5"), "r+") as copy:
        copy["trials/score"][0] = 99.0
    list_in_manifest(sealed_dir, ("session.h5",))
    assert problems(sealed_dir) == ("trials/score of session.h5 differs from the live file",)


def test_an_event_changed_in_the_copy_is_named_even_when_the_manifest_was_changed_to_match(sealed_dir):
    with h5py.File(writable(sealed_dir / "session.h5"), "r+") as copy:
        text = copy["events/data"][...].tobytes()
        copy["events/data"][text.index(b"42.5")] = ord("9")
    list_in_manifest(sealed_dir, ("session.h5",))
    assert problems(sealed_dir) == ("events/data of session.h5 differs from the live file",)


def test_a_reading_changed_in_the_live_file_is_named_by_its_block_too(sealed_dir):
    change(sealed_dir, "UPDATE blocks SET raw = zeroblob(4800) WHERE number = 4")
    sentences = problems(sealed_dir)
    assert any(problem.startswith("session.sqlite is not what it was") for problem in sentences)
    assert any(problem.startswith("block 4 of the readings is damaged") for problem in sentences)


def test_a_copy_whose_bytes_rotted_is_named_by_its_own_check_sum(sealed_dir):
    path = writable(sealed_dir / "session.h5")
    content = bytearray(path.read_bytes())
    place = content.index(np.float64(6 * 321).tobytes())  # a torque of reading 321
    content[place + 6] ^= 1
    path.write_bytes(content)
    list_in_manifest(sealed_dir, ("session.h5",))
    assert any(problem.startswith("session.h5 cannot be read") for problem in problems(sealed_dir))


def test_a_session_that_was_never_sealed_is_named(tmp_path):
    assert problems(record_session(tmp_path / "s")) == (never_sealed(tmp_path / "s"),)


def test_a_manifest_that_cannot_be_read_is_named(sealed_dir):
    (sealed_dir / "MANIFEST.json").write_text('{"files": [1]}')
    (problem,) = problems(sealed_dir)
    assert "MANIFEST.json cannot be read" in problem


# ---- sealing what a crash left


def test_a_session_cut_short_by_a_crash_is_sealed_with_all_that_was_safe_and_its_loss_stays_named(tmp_path):
    folder = record_crash(tmp_path / "crashed", commits=3)
    log = folder / "session.sqlite-wal"
    log.write_bytes(log.read_bytes()[:-100])
    seal(folder)
    recording = Recording.open(folder)
    assert recording.readings().sequence.tolist() == list(range(200))
    losses = json.loads((folder / "session.json").read_bytes())["losses"]
    assert "hold no whole commit" in losses[0]
    assert losses[1].startswith("the session has no end")
    assert problems(folder) == tuple(losses)
    assert {path.name for path in folder.iterdir()} == {*SEALED, "MANIFEST.json"}


def test_a_torn_log_behind_a_damaged_event_is_sealed_with_both_named(tmp_path):
    folder = record_crash(tmp_path / "crashed", commits=3)
    log = folder / "session.sqlite-wal"
    note = "INSERT INTO events VALUES (1, 0, 'note', NULL, 0, '{}', 7)"  # a check sum of nothing
    with closing(sqlite3.connect(folder / "session.sqlite", isolation_level=None)) as connection:
        connection.execute(note)
        log_bytes = log.read_bytes()
        torn_folder = shutil.copytree(folder, tmp_path / "torn", ignore=shutil.ignore_patterns("*-shm"))
    page = int.from_bytes(log_bytes[8:12], "big")
    (torn_folder / log.name).write_bytes(log_bytes + log_bytes[32 : 32 + 24] + bytes(page // 2))
    seal(torn_folder)
    recording = Recording.open(torn_folder)
    assert [(event.number, event.kind) for event in recording.events] == [(2, "log_torn")]
    assert recording.losses[0] == "event 1 is damaged and left out (CRC-32 differs)"
    assert "hold no whole commit" in recording.losses[1]
