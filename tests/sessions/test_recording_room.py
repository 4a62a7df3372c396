import math
import shutil
from collections import namedtuple

import pytest
from recordings import PLAN, new_writer, readings

from sessions.recording import RecordingError
from sessions.recording.storage import DISK_MARGIN, check_room, need, release_reserve, take_reserve

Usage = namedtuple("Usage", "total used free")


def test_the_room_a_session_needs_is_its_rate_times_its_time_twice():
    # One trial of 90 s and one block's 300 s at 7000 Hz, six columns of which one holds six numbers: 11 x 8 bytes.
    assert need(PLAN, 7000.0).size == 2 * 390 * 7000 * 88 + DISK_MARGIN
    assert need(PLAN, None).size == DISK_MARGIN
    assert need(PLAN, math.nan).rate == 1000.0


def test_the_room_foreseen_for_a_reading_is_what_a_recording_takes(tmp_path):
    writer = new_writer(tmp_path / "s")
    for i in range(50):
        writer.readings(readings(7000 * i, 7000))
        writer.commit()
    writer.close()
    size = (tmp_path / "s" / "session.sqlite").stat().st_size
    assert size / (50 * 7000) == pytest.approx(88, rel=0.02)


def test_a_disk_with_too_little_room_is_refused_with_the_arithmetic(tmp_path, monkeypatch):
    required = need(PLAN, 7000.0)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(0, 0, required.size - 1))
    with pytest.raises(RecordingError, match=r"6 min at 7000 readings a second of 88 bytes, kept twice, .*: 548 MB"):
        check_room(tmp_path / "not" / "there" / "yet", required)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(0, 0, required.size))
    check_room(tmp_path / "not" / "there" / "yet", required)


def test_a_reserve_takes_real_room_and_gives_it_back(tmp_path):
    take_reserve(tmp_path, 3 * 2**20)
    assert (tmp_path / "session.reserve").stat().st_blocks * 512 >= 3 * 2**20
    release_reserve(tmp_path)
    release_reserve(tmp_path)
    assert list(tmp_path.iterdir()) == []
