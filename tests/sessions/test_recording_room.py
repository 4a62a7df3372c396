import math
import shutil
from collections import namedtuple

import pytest
from recordings import PLAN, new_writer, readings

from sessions.recording import RecordingError
from sessions.recording.storage import DISK_MARGIN, check_room, release_reserve, take_reserve

Usage = namedtuple("Usage", "total used free")


@pytest.mark.parametrize(("rate", "foreseen"), [(7000.0, 7000), (None, 0), (math.nan, 1000)])
def test_the_room_a_session_needs_is_its_rate_times_its_time_twice(tmp_path, monkeypatch, rate, foreseen):
    # One trial of 90 s and one block's 300 s, six columns of which one holds six numbers: 11 x 8 bytes.
    size = 2 * 390 * foreseen * 88 + DISK_MARGIN
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(0, 0, size))
    check_room(tmp_path, PLAN, rate)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(0, 0, size - 1))
    with pytest.raises(RecordingError, match=f"at {foreseen} readings a second"):
        check_room(tmp_path, PLAN, rate)


def test_the_room_foreseen_for_a_reading_is_what_a_recording_takes(tmp_path):
    writer = new_writer(tmp_path / "s")
    for i in range(50):
        writer.readings(readings(7000 * i, 7000))
        writer.commit()
    writer.close()
    size = (tmp_path / "s" / "session.sqlite").stat().st_size
    assert size / (50 * 7000) == pytest.approx(88, rel=0.02)


def test_a_disk_with_too_little_room_is_refused_with_the_arithmetic(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(0, 0, 2**29))
    with pytest.raises(RecordingError, match=r"6 min at 7000 readings a second of 88 bytes, kept twice, .*: 548 MB"):
        check_room(tmp_path / "not" / "there" / "yet", PLAN, 7000.0)


def test_a_reserve_takes_real_room_and_gives_it_back(tmp_path):
    take_reserve(tmp_path, 3 * 2**20)
    assert (tmp_path / "session.reserve").stat().st_blocks * 512 >= 3 * 2**20
    release_reserve(tmp_path)
    release_reserve(tmp_path)
    assert list(tmp_path.iterdir()) == []
