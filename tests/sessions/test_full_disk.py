"""A disk that fails under a running session, at any of its writes: what was acknowledged stays, and the end is told."""

import itertools

import pytest
from failing_session import OnADisk, Quota, failing_from, failing_once
from faulty_disk import IOERR_FSYNC, IOERR_WRITE, library

from sessions.recording.archive import problems, seal

pytestmark = pytest.mark.skipif(library() is None, reason="Python's SQLite is built in: no layer fits under it")


@pytest.mark.parametrize(("number", "code"), list(itertools.product([3, 60, 140, 260], [IOERR_WRITE, IOERR_FSYNC])))
def test_one_failed_write_loses_nothing_acknowledged_and_ends_the_session_so_that_it_can_go_on(tmp_path, number, code):
    session = OnADisk(tmp_path / "s", failing_once(number, code))
    recording = session.check()
    if session.end is not None and not session.end.complete:
        assert recording.end["cause"] == "disk"
        assert "check the disk and its cable, and resume" in recording.end["reason"]


@pytest.mark.parametrize("number", [3, 60, 140, 260])
def test_a_disk_that_takes_nothing_more_gives_one_sentence_and_keeps_what_was_acknowledged(tmp_path, number):
    session = OnADisk(tmp_path / "s", failing_from(number))
    session.check()
    assert session.end is None
    assert "free space on the disk" in session.error
    assert not (tmp_path / "s" / "session.reserve").exists()


def test_at_a_quota_the_session_ends_from_its_reserve_with_all_that_was_measured(tmp_path):
    folder = tmp_path / "s"
    session = OnADisk(folder, Quota(folder, 500_000))
    assert (session.error, session.end.cause) == (None, "disk")
    recording = session.check()
    assert recording.end["readings"] == len(recording.readings()) == session.end.readings > 1000
    *_, take_end, end = (event.kind for event in recording.events)
    assert (take_end in ("take_kept", "take_discarded"), end) == (True, "ended")
    assert sorted(path.name for path in folder.iterdir()) == ["session.sqlite"]
    seal(folder)
    assert problems(folder) == ()
