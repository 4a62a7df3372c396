import getpass
import math
import platform
import sqlite3
import tempfile
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from recordings import PLAN, new_writer, read_plainly, readings, record_session, rows
from stand_ins import CALIBRATION, INFO, ResumableClock

from drivers.readings import ReadingBlock
from sessions.recording import Recording, RecordingError, Setting, provenance
from sessions.recording import writer as writer_module
from sessions.recording.head import without_home

REAL = replace(INFO, simulated=False)


# ---- what is written comes back


@st.composite
def any_block(draw):
    n = draw(st.integers(0, 5))
    whole = arrays(np.int64, n, elements=st.integers(-(2**63), 2**63 - 1))
    real = st.floats(allow_nan=True, allow_infinity=True, width=64)
    return ReadingBlock(
        draw(whole), draw(whole), draw(whole), draw(arrays(np.float64, n, elements=real)), draw(whole),
        draw(arrays(np.float64, (n, 6), elements=real)),
    )  # fmt: skip


def bits(block):
    return [getattr(block, name).tobytes() for name in ("sequence", "counter", "status", "time", "received_ns", "raw")]


@given(blocks=st.lists(any_block(), max_size=5), commits=st.sets(st.integers(0, 5)))
@settings(max_examples=25, deadline=None)
def test_readings_come_back_to_the_last_bit_however_they_were_cut(blocks, commits):
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / "s"
        writer = new_writer(folder)
        for i, block in enumerate(blocks):
            writer.readings(block)
            if i in commits:
                writer.commit()
        writer.close()
        assert bits(Recording.open(folder).readings()) == bits(ReadingBlock.concatenate(blocks))


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inside: st.lists(inside, max_size=3) | st.dictionaries(st.text(), inside, max_size=3),
    max_leaves=5,
)


@given(
    events=st.lists(
        st.tuples(st.text(min_size=1), st.none() | st.integers(1, 99), st.dictionaries(st.text(), JSON, max_size=3)),
        max_size=4,
    )
)
@settings(max_examples=25, deadline=None)
def test_events_come_back_as_they_were_reported(events):
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / "s"
        writer = new_writer(folder)
        written_events = tuple(writer.event(kind, trial, data) for kind, trial, data in events)
        writer.close()
        recording = Recording.open(folder)
    assert recording.events == written_events
    assert [(event.kind, event.trial, event.data) for event in recording.events] == events


def test_the_head_comes_back_with_origins_settings_and_umlauts(tmp_path):
    recording = Recording.open(record_session(tmp_path / "s"))
    assert recording.plan == PLAN
    assert recording.info.settings == INFO.settings
    assert recording.info.calibration.matrix.tolist() == CALIBRATION.matrix.tolist()
    assert replace(recording.info, calibration=CALIBRATION) == INFO


def test_a_rate_or_range_that_nobody_knows_is_null_in_the_file_and_nan_when_read(tmp_path):
    unknown = replace(REAL, rate=math.nan, calibration=replace(CALIBRATION, rated=np.full(6, math.nan)))
    folder = record_session(tmp_path / "s", info=unknown)
    assert '"rate":null' in rows(folder, "SELECT value FROM head WHERE name='transducer'")[0][0]
    assert math.isnan(Recording.open(folder).info.rate)
    assert np.isnan(Recording.open(folder).info.calibration.rated).all()


def test_provenance_holds_versions_clock_and_marked_settings_and_no_name_of_person_or_computer():
    head = provenance(
        ResumableClock(), [Setting("height", 20.0, "mm", "measured"), Setting("filter", "none", "", "default")]
    )
    assert head["settings"] == {
        "height": {"value": 20.0, "unit": "mm", "origin": "measured"},
        "filter": {"value": "none", "unit": "", "origin": "default"},
    }
    assert {"daq-app", "python", "numpy", "scipy", "h5py", "sqlite"} <= set(head["software"])
    assert head["clock"]["factor"] == 1.0
    assert platform.node() not in head["machine"].values()
    assert getpass.getuser() not in head["machine"].values()


def test_the_users_home_is_no_part_of_an_address_and_another_folder_that_begins_alike_stays(monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: Path("/home/ann"))
    assert without_home("nidaq://Dev1?cal=/home/ann/a.cal") == "nidaq://Dev1?cal=~/a.cal"
    assert without_home("nidaq://Dev1?cal=%2Fhome%2Fann%2Fa.cal") == "nidaq://Dev1?cal=~%2Fa.cal"
    assert without_home("nidaq://Dev1?cal=/home/anna/a.cal") == "nidaq://Dev1?cal=/home/anna/a.cal"
    monkeypatch.setattr(Path, "home", lambda: Path("/"))  # of a service
    assert without_home("nidaq://Dev1?cal=%2F") == "nidaq://Dev1?cal=%2F"


# ---- the bytes are those the format page tells


def test_someone_without_this_program_reads_every_number(tmp_path):
    folder = record_session(tmp_path / "s", blocks=2)
    expected = [
        (i, i * 35 + 2**33, i % 3, i / 200.0, 100 * (i // 100 + 1), i, 2 * i, 3 * i, 4 * i, 5 * i, 6 * i)
        for i in range(200)
    ]
    assert read_plainly(folder) == expected


def test_every_check_sum_is_the_one_the_format_page_tells(tmp_path):
    folder = record_session(tmp_path / "s")
    for *columns, crc in rows(folder, "SELECT sequence, counter, status, time, received_ns, raw, crc32 FROM blocks"):
        assert zlib.crc32(b"".join(columns)) == crc
    for number, time_ns, kind, trial, before, data, crc in rows(folder, "SELECT * FROM events"):
        text = f"{number}\n{time_ns}\n{kind}\n{'' if trial is None else trial}\n{before}\n{data}"
        assert zlib.crc32(text.encode()) == crc
    for value, crc in rows(folder, "SELECT value, crc32 FROM head"):
        assert zlib.crc32(value.encode()) == crc


def test_a_block_tells_the_range_of_its_numbers(tmp_path):
    folder = record_session(tmp_path / "s")
    ranges = rows(
        folder,
        "SELECT number, readings, sequence_first, sequence_last, counter_first, counter_last, "
        "received_first_ns, received_last_ns FROM blocks",
    )
    assert ranges[1] == (2, 100, 100, 199, 100 * 35 + 2**33, 199 * 35 + 2**33, 200, 200)


def test_the_file_names_its_format_and_version(tmp_path):
    folder = record_session(tmp_path / "s")
    assert rows(folder, "PRAGMA user_version") == [(3,)]
    assert (folder / "session.sqlite").read_bytes()[68:72] == b"DAQF"


def test_an_ended_recording_is_one_plain_file(tmp_path):
    folder = record_session(tmp_path / "s")
    assert [path.name for path in folder.iterdir()] == ["session.sqlite"]
    assert rows(folder, "PRAGMA journal_mode") == [("delete",)]


def test_what_was_simulated_is_said_in_the_first_row_and_nothing_is_said_of_what_was_not(tmp_path):
    def head(name, **options):
        return rows(record_session(tmp_path / name, **options), "SELECT value FROM head ORDER BY number LIMIT 1")[0][0]

    assert head("both", subject_simulated=True).startswith("SIMULATED: the transducer and the subject ")
    assert head("device").startswith("SIMULATED: the transducer of ")
    assert head("subject", info=None, subject_simulated=True).startswith("SIMULATED: the subject of ")
    assert head("neither", info=REAL) == "no"
    assert not Recording.open(tmp_path / "neither").simulated
    assert Recording.open(tmp_path / "device").simulated


# ---- when it is safe


def test_the_store_writes_ahead_and_waits_for_the_disk(tmp_path):
    writer = new_writer(tmp_path / "s")
    assert writer._connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    assert writer._connection.execute("PRAGMA synchronous").fetchone() == (2,)  # FULL
    writer.close()


def test_the_names_of_new_folders_are_safe_before_anything_is_recorded_in_them(tmp_path, monkeypatch):
    places = []
    monkeypatch.setattr(writer_module, "sync_folder", places.append)
    new_writer(tmp_path / "study" / "visit" / "s").close()
    assert set(places) == {
        tmp_path,
        tmp_path / "study",
        tmp_path / "study" / "visit",
        tmp_path / "study" / "visit" / "s",
    }


def test_readings_are_committed_once_a_second_of_the_session_clock(tmp_path):
    clock = ResumableClock()
    writer = new_writer(tmp_path / "s", clock=clock)
    safe = []
    for i in range(500):  # 5 s at 100 blocks a second
        clock.sleep(0.01)
        writer.readings(readings(i, 1))
        safe.append(writer.acknowledged.readings)
    assert sorted(set(safe)) == [0, 100, 200, 300, 400, 500]
    assert max(i + 1 - count for i, count in enumerate(safe)) <= 101
    writer.close()


def test_an_event_is_safe_at_once_together_with_the_readings_before_it(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.readings(readings(0, 7))
    assert writer.acknowledged.readings == 0
    event = writer.event("scored", 1, {"score": 10.0})
    assert (writer.acknowledged.readings, writer.acknowledged.events) == (7, 1)
    # Another connection, as another program would have it, sees them while the writer is open.
    recording = Recording.open(tmp_path / "s")
    assert recording.events == (event,)
    assert len(recording.readings()) == 7
    assert recording.losses == ("the session has no end: it was cut short, or is still running",)
    writer.close()


def test_very_many_readings_at_once_are_cut_into_blocks(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.readings(readings(0, 150_000))
    writer.close()
    assert rows(tmp_path / "s", "SELECT readings FROM blocks") == [(65536,), (65536,), (18928,)]
    assert Recording.open(tmp_path / "s").readings().sequence.tolist() == list(range(150_000))


# ---- what is refused


def test_nothing_is_ever_written_over(tmp_path):
    folder = record_session(tmp_path / "s")
    before = (folder / "session.sqlite").read_bytes()
    with pytest.raises(RecordingError, match="is not empty"):
        new_writer(folder)
    assert (folder / "session.sqlite").read_bytes() == before
    (tmp_path / "file").write_text("a file")
    with pytest.raises(RecordingError, match="cannot hold a recording"):
        new_writer(tmp_path / "file")


def test_an_event_that_json_or_utf_8_cannot_hold_is_refused_before_it_spoils_anything(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.readings(readings(0, 10))
    for data, why in (({"score": math.nan}, "JSON"), ({"text": "\udcff"}, "surrogates")):
        with pytest.raises(ValueError, match=why):
            writer.event("note", data=data)
    writer.event("scored", 1, {"score": None})
    writer.close()
    recording = Recording.open(tmp_path / "s")
    assert ([event.number for event in recording.events], len(recording.readings())) == ([1], 10)


def test_a_closed_recording_takes_no_more_and_closing_again_does_no_harm(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.close()
    writer.close()
    with pytest.raises(RecordingError, match="it was closed"):
        writer.event("late")


def test_a_failing_write_is_reported_with_what_is_safe_and_nothing_safe_is_lost(tmp_path):
    writer = new_writer(tmp_path / "s")
    writer.readings(readings(0, 10))
    writer.event("started")

    class Failing:
        """A connection whose writes fail."""

        def execute(self, statement, *_):
            if statement.startswith("INSERT"):
                full = sqlite3.OperationalError("database or disk is full")
                full.sqlite_errorcode = sqlite3.SQLITE_FULL
                raise full

        def close(self):
            pass

    whole, writer._connection = writer._connection, Failing()
    writer.readings(readings(10, 10))
    with pytest.raises(RecordingError, match="the first 10 readings and 1 events are safe; free space"):
        writer.commit()
    with pytest.raises(RecordingError, match="are safe"):
        writer.readings(readings(20, 1))
    writer.close()
    whole.close()
    assert Recording.open(tmp_path / "s").readings().sequence.tolist() == list(range(10))
