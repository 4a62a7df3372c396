import errno
import hashlib
import json
import shutil
import sqlite3
import tracemalloc
import zlib
from contextlib import closing
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest
import recordings
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import PLAN, change, new_writer, readings, record_session, rows

from sessions.recording import LoggedEvent, Recording, RecordingError
from sessions.recording.log import trial_records
from sessions.recording.recovery import log_tail
from sessions.recording.schema import FORMAT, FORMAT_VERSION


def hashes(folder):
    return {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.iterdir()
        if not path.name.endswith("-shm")  # an index of the log that any reader makes anew
    }


@pytest.fixture
def crashed_folder(tmp_path):
    return recordings.record_crash(tmp_path / "crashed", commits=5)


UNENDED = "the session has no end: it was cut short, or is still running"


def test_a_folder_that_nobody_may_look_into_is_named_with_what_mends_it(tmp_path, monkeypatch):
    def refuse(path):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "is_file", refuse)
    with pytest.raises(RecordingError, match=r"session\.sqlite cannot be read .*permit reading"):
        Recording.open(tmp_path)


# ---- whole recordings


def test_a_trials_readings_are_those_received_during_its_take(tmp_path):
    recording = Recording.open(record_session(tmp_path / "s", blocks=4))  # the take lasts from 50 to 400, not included
    assert recording.readings(1).sequence.tolist() == list(range(300))
    assert recording.readings().sequence.tolist() == list(range(400))
    assert recording.readings_between(101, 301).sequence.tolist() == list(range(100, 300))
    assert recording.readings_between(300, None).sequence.tolist() == list(range(200, 400))


def test_a_trial_the_plan_does_not_have_is_refused(tmp_path):
    with pytest.raises(KeyError, match="has no trial 9"):
        Recording.open(record_session(tmp_path / "s")).readings(9)


def test_a_folder_without_a_recording_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"holds no recording: there is no session\.sqlite"):
        Recording.open(tmp_path)


@pytest.mark.parametrize("content", [b"", b"no database at all", b"SQLite format 3\0" + bytes(4096)])
def test_a_file_that_is_no_recording_is_refused_with_a_sentence(tmp_path, content):
    (tmp_path / "session.sqlite").write_bytes(content)
    with pytest.raises(RecordingError, match=r"session\.sqlite cannot be read"):
        Recording.open(tmp_path)


def test_a_recording_of_a_later_format_is_refused_by_name(tmp_path):
    folder = record_session(tmp_path / "s")
    later = json.dumps({"name": FORMAT, "version": FORMAT_VERSION + 1})
    change(folder, "UPDATE head SET value=?, crc32=? WHERE name='format'", (later, zlib.crc32(later.encode())))
    with pytest.raises(RecordingError, match=f"up to version {FORMAT_VERSION}: use a later program"):
        Recording.open(folder)


def test_opening_and_reading_change_no_byte(tmp_path, crashed_folder):
    for folder in (record_session(tmp_path / "s"), crashed_folder):
        before = hashes(folder)
        recording = Recording.open(folder)
        recording.readings()
        assert recording.losses is not None
        assert hashes(folder) == before


# ---- damage is named, and costs only what it hit


def test_a_damaged_block_is_left_out_and_named(tmp_path):
    folder = record_session(tmp_path / "s")
    change(folder, "UPDATE blocks SET raw = zeroblob(4800) WHERE number = 2")
    recording = Recording.open(folder)
    assert recording.readings().sequence.tolist() == [*range(100), *range(200, 300)]
    assert recording.losses == (
        "block 2 of the readings is damaged and left out (its bytes do not give the CRC-32 stored with them)",
    )


def test_a_missing_block_is_named(tmp_path):
    folder = record_session(tmp_path / "s")
    change(folder, "DELETE FROM blocks WHERE number = 2")
    assert Recording.open(folder).losses == ("blocks 2 to 2 of the readings are missing",)


@pytest.mark.parametrize("column", ["sequence_last", "counter_first", "received_first_ns", "received_last_ns"])
def test_a_row_that_tells_of_other_readings_than_it_holds_is_named(tmp_path, column):
    folder = record_session(tmp_path / "s")
    change(folder, f"UPDATE blocks SET {column} = 7 WHERE number = 3")
    assert "not those that its row describes" in Recording.open(folder).losses[0]


def test_a_changed_and_a_missing_event_are_named_and_the_others_read(tmp_path):
    folder = record_session(tmp_path / "s")
    change(folder, "UPDATE events SET data = '{\"score\":99.0}' WHERE kind = 'scored'")
    change(folder, "DELETE FROM events WHERE number = 1")
    recording = Recording.open(folder)
    assert recording.losses == ("events 1 to 1 are missing", "event 3 is damaged and left out (CRC-32 differs)")
    assert recording.trials[0].score is None


def damage_definition(folder, before, after):
    with closing(sqlite3.connect(folder / "session.sqlite")) as connection:
        connection.execute("PRAGMA writable_schema=1")
        connection.execute("UPDATE sqlite_master SET sql = replace(sql, ?, ?)", (before, after))
        connection.commit()


def test_all_is_read_of_tables_whose_definition_no_longer_says_what_numbers_them(tmp_path):
    folder = record_session(tmp_path / "s")
    events = Recording.open(folder).events
    damage_definition(folder, "number INTEGER", "number INTEGES")
    recording = Recording.open(folder)
    assert (recording.events, recording.losses) == (events, ())
    assert recording.readings().sequence.tolist() == list(range(300))


def test_a_take_whose_readings_a_damaged_definition_hides_is_named(tmp_path):
    folder = record_session(tmp_path / "s")
    damage_definition(folder, "received_last_ns", "received_lasu_ns")
    recording = Recording.open(folder)
    assert len(recording.readings(1)) == 0
    assert [sentence.split(" and ")[0] for sentence in recording.losses] == [
        f"block {number} of the readings is damaged" for number in (1, 2, 3)
    ]


@pytest.mark.parametrize("name", ["simulated", "format", "plan", "transducer", "provenance"])
def test_a_head_that_lacks_a_row_is_refused(tmp_path, name):
    folder = record_session(tmp_path / "s")
    change(folder, "UPDATE head SET name = 'damaged' WHERE name = ?", (name,))
    with pytest.raises(RecordingError, match=r"its head is damaged|it holds no format|damaged in its head"):
        Recording.open(folder)


def test_a_changed_plan_is_refused(tmp_path):
    folder = record_session(tmp_path / "s")
    change(folder, "UPDATE head SET value = replace(value, 'S01', 'S02') WHERE name = 'plan'")
    with pytest.raises(RecordingError, match=r"plan in its head is damaged"):
        Recording.open(folder)


def test_a_file_cut_short_gives_what_can_be_read_or_a_sentence(tmp_path):
    whole = (record_session(tmp_path / "s", blocks=40) / "session.sqlite").read_bytes()
    for part in (0.2, 0.5, 0.8, 0.95):
        folder = tmp_path / f"cut-{part}"
        folder.mkdir()
        (folder / "session.sqlite").write_bytes(whole[: int(len(whole) * part)])
        try:
            recording = Recording.open(folder)
        except RecordingError as error:
            assert "cannot be read" in str(error)  # noqa: PT017  either outcome is right
            continue
        sequence = recording.readings().sequence.tolist()
        assert set(sequence) <= set(range(4000))
        assert recording.losses


# ---- after a crash


def test_a_log_left_by_a_crash_is_read_and_the_missing_end_named(crashed_folder):
    recording = Recording.open(crashed_folder)
    assert recording.readings().sequence.tolist() == list(range(500))
    assert recording.losses == (UNENDED,)


def test_a_log_whose_tail_was_cut_gives_its_whole_commits_and_names_the_rest(crashed_folder):
    log = crashed_folder / "session.sqlite-wal"
    whole = log.read_bytes()
    lengths = set()
    for size in range(0, len(whole) - 32, 509):
        log.write_bytes(whole[: len(whole) - size])
        tail = log_tail(BytesIO(log.read_bytes()))
        try:
            recording = Recording.open(crashed_folder)
        except RecordingError:
            assert tail.commits == 0  # not even the tables were committed
            continue
        sequence = recording.readings().sequence.tolist()
        assert sequence == list(range(100 * (tail.commits - 1)))  # the first commit holds the tables
        is_named = any("hold no whole commit" in loss for loss in recording.losses)
        assert is_named == (tail.torn_bytes > 0)
        lengths.add(len(sequence))
    assert lengths == {0, 100, 200, 300, 400, 500}


@pytest.fixture(scope="module")
def written_folder(tmp_path_factory):
    """A folder with file and log of a recording with 3 commits of 100 readings, its writer not yet closed."""
    folder, copy = tmp_path_factory.mktemp("written") / "s", tmp_path_factory.mktemp("kept")
    writer = new_writer(folder)
    for i in range(3):
        writer.readings(readings(100 * i, 100))
        writer.commit()
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("*-shm"), dirs_exist_ok=True)
    yield copy
    writer.close()


@given(place=st.floats(0, 0.999), bit=st.integers(0, 7))
@settings(max_examples=60, deadline=None)
def test_a_flipped_bit_in_the_log_is_never_taken_for_a_reading(written_folder, tmp_path_factory, place, bit):
    folder = tmp_path_factory.mktemp("flipped")
    for path in written_folder.iterdir():
        content = bytearray(path.read_bytes())
        if path.name.endswith("-wal"):
            content[int(place * len(content))] ^= 1 << bit
        (folder / path.name).write_bytes(content)
    try:
        recording = Recording.open(folder)
    except RecordingError:
        return
    sequence = recording.readings().sequence.tolist()
    assert sequence == list(range(len(sequence)))
    assert len(sequence) == 300 or any("hold no whole commit" in loss for loss in recording.losses)


def test_a_damaged_salt_makes_no_frame_one_of_an_earlier_run(written_folder):
    log = bytearray((written_folder / "session.sqlite-wal").read_bytes())
    page = int.from_bytes(log[8:12], "big")
    frames = range(32, len(log), 24 + page)
    assert log_tail(BytesIO(bytes(log))).torn_bytes == 0
    for frame in frames:
        for salt in (8, 15):
            log[frame + salt] ^= 4
            tail = log_tail(BytesIO(bytes(log)))
            log[frame + salt] ^= 4
            assert tail.commits < 4  # the tables, and three of readings
            assert tail.torn_bytes > 0


def test_frames_left_over_from_an_earlier_run_of_the_log_are_no_loss(tmp_path):
    writer = new_writer(tmp_path / "s")
    for i in range(30):
        writer.readings(readings(100 * i, 100))
        writer.commit()
    writer._connection.execute("PRAGMA wal_checkpoint(RESTART)")  # the next commit begins the log anew, at its head
    writer.readings(readings(3000, 100))
    writer.commit()
    tail = log_tail(BytesIO((tmp_path / "s" / "session.sqlite-wal").read_bytes()))
    assert (tail.commits, tail.torn_bytes) == (1, 0)
    assert Recording.open(tmp_path / "s").losses == (UNENDED,)
    writer.close()


def test_a_log_shorter_than_its_head_holds_nothing():
    assert (log_tail(BytesIO(b"")).commits, log_tail(BytesIO(b"")).torn_bytes) == (0, 0)
    assert log_tail(BytesIO(bytes(31))).torn_bytes == 31
    assert log_tail(BytesIO(bytes(5000))).torn_bytes == 5000


def test_a_change_that_a_crash_cut_short_is_undone_in_a_copy_and_the_file_stays_as_it_is(tmp_path):
    folder = record_session(tmp_path / "s", blocks=20)
    copy = tmp_path / "torn"
    copy.mkdir()
    with closing(sqlite3.connect(folder / "session.sqlite", isolation_level=None)) as connection:
        connection.execute("PRAGMA cache_size=1")  # changes go to the file before the commit
        connection.execute("BEGIN")
        connection.execute("UPDATE blocks SET raw = zeroblob(4800)")
        for path in folder.iterdir():
            shutil.copy(path, copy)
    assert (copy / "session.sqlite-journal").exists()
    before = hashes(copy)
    recording = Recording.open(copy)
    assert recording.readings().raw.tolist() == readings(0, 2000).raw.tolist()
    assert hashes(copy) == before


# ---- what the log says of a trial


def logged_events(*lines):
    return [LoggedEvent(i, 10 * i, kind, trial, 0, data) for i, (kind, trial, data) in enumerate(lines, 1)]


def test_a_take_that_was_kept_and_then_discarded_keeps_its_own_end():
    (record,) = trial_records(
        PLAN,
        logged_events(
            ("take_started", 1, {"take": 1}),
            ("scored", 1, {"score": 5.0}),
            ("take_kept", 1, {"take": 1}),
            ("take_discarded", 1, {"take": 1, "reason": "wrong hand"}),
            ("take_started", 1, {"take": 2}),
        ),
    )
    assert (record.outcome, record.score, record.take) == ("open", None, None)
    assert [(take.start_ns, take.stop_ns, take.discard_reason) for take in record.other_takes] == [
        (10, 30, "wrong hand"),
        (50, None, None),
    ]


def test_a_take_that_is_restored_counts_with_its_own_end_and_the_answer_that_came_after():
    (record,) = trial_records(
        PLAN,
        logged_events(
            ("take_started", 1, {"take": 1}),
            ("contact_onset", 1, {}),
            ("take_discarded", 1, {"take": 1, "reason": "by mistake"}),
            ("take_started", 1, {"take": 2}),
            ("take_discarded", 1, {"take": 2, "reason": "the redo was undone"}),
            ("take_restored", 1, {"take": 1}),
            ("scored", 1, {"score": 5.0}),
            ("take_kept", 1, {"take": 1}),
        ),
    )
    assert (record.outcome, record.score) == ("scored", 5.0)
    assert (record.take.number, record.take.start_ns, record.take.stop_ns, record.take.strokes) == (1, 10, 30, 1)
    assert [(take.number, take.discard_reason) for take in record.other_takes] == [(2, "the redo was undone")]


def test_a_recording_without_a_plan_of_trials_has_none():
    assert trial_records(replace(PLAN, blocks=()), logged_events(("started", None, {}))) == ()


@pytest.mark.parametrize(
    ("kind", "data"),
    [
        ("take_kept", "[]"),
        ("take_started", '{"take": [1]}'),
        ("take_discarded", '{"take": 1}'),
        ("scored", '{"score": "much"}'),
        ("scored", '{"score": 5, "positions": 7}'),
        ("zeroed", '{"mean": null}'),
        ("losses", '{"lost": "many"}'),
        ("not_restored", "{}"),
        ("note", '"a text"'),
        ("note", "NaN"),
        ("note", "[" * 5000),
        ("resumed", '{"last_ns": %s}' % (10**30)),
    ],
)
def test_an_event_of_odd_shape_with_a_right_check_sum_is_named_and_the_rest_is_read(tmp_path, kind, data):
    folder = record_session(tmp_path / "s")
    crc = zlib.crc32(f"3\n90\n{kind}\n1\n0\n{data}".encode())
    before = Recording.open(folder).events
    change(
        folder,
        "UPDATE events SET time_ns=90, kind=?, trial=1, readings=0, data=?, crc32=? WHERE number=3",
        (kind, data, crc),
    )
    recording = Recording.open(folder)
    assert recording.losses[0].startswith("event 3 is damaged and left out (")
    assert recording.events == tuple(event for event in before if event.number != 3)
    assert len(recording.readings()) == 300
    assert rows(folder, "SELECT data FROM events WHERE number=3") == [(data,)]


@pytest.mark.parametrize(("name", "mode"), [("session.sqlite-wal", "wb"), ("session.sqlite", "r+b")])
def test_a_file_with_twenty_gigabytes_of_nothing_is_read_in_little_memory(tmp_path, name, mode):
    folder = record_session(tmp_path / "s")
    with (folder / name).open(mode) as file:
        file.truncate(20 * 2**30)
    tracemalloc.start()
    try:
        recording = Recording.open(folder)
        assert len(recording.readings()) == 300
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()
    is_named = "the last 21474836480 bytes of the write-ahead log hold no whole commit" in "".join(recording.losses)
    assert is_named == name.endswith("wal")
