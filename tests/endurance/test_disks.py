"""Disks that fail at any write, and one that is really full: `make test-long`."""

import subprocess
import sys
from pathlib import Path

import pytest
from failing_session import RESERVE, OnADisk, failing_from, failing_once
from faulty_disk import IOERR_FSYNC, IOERR_WRITE, library

from sessions.recording import Recording
from sessions.recording.archive import problems, seal

pytestmark = pytest.mark.slow

WRITES = 500
FULL = """
import sys, shutil
from pathlib import Path
sys.path[:0] = ["tests/sessions"]
from failing_session import PLAN, RESERVE
from stand_ins import INFO, Hands, StandIn, ResumableClock
from sessions.recording import SessionWriter, provenance
from sessions.run.runner import run_session
clock = ResumableClock()
folder = Path(sys.argv[1]) / "s"
writer = SessionWriter.create(folder, PLAN, INFO, provenance(clock), clock=clock, reserve=RESERVE)
device = StandIn(clock)
end = run_session(PLAN, writer, Hands(clock, device), device)
print(end.cause, end.readings, end.reason)
shutil.copytree(folder, sys.argv[2])
"""


@pytest.mark.skipif(library() is None, reason="Python's SQLite is built in: no layer fits under it")
def test_any_of_the_first_500_writes_may_fail_once_or_for_good_and_nothing_acknowledged_is_lost(tmp_path):
    ends = {"never begun": 0, "its end written": 0, "no end": 0, "complete": 0}
    for number in range(1, WRITES + 1):
        code = (IOERR_WRITE, IOERR_FSYNC)[number % 2]
        for name, fail in (("once", failing_once(number, code)), ("for good", failing_from(number))):
            session = OnADisk(tmp_path / f"{name} {number}", fail)
            assert session.calls >= number
            recording = session.check()
            if recording is None or not recording.events:
                ends["never begun"] += 1
            elif recording.end is None:
                assert name == "for good"
                ends["no end"] += 1
            else:
                ends["complete" if recording.end["complete"] else "its end written"] += 1
    print(f"\neach of the first {WRITES} writes failed once, and for good: {ends}; nothing acknowledged lost")


@pytest.mark.skipif(sys.platform != "linux", reason="mounts a small disk of its own, in a name space of its own")
def test_a_disk_that_is_really_full_ends_the_session_with_all_that_was_measured(tmp_path):
    disk, copy = tmp_path / "disk", tmp_path / "kept"
    disk.mkdir()
    size = RESERVE + 700_000
    mount = f'mount -t tmpfs -o size={size} tmpfs "$1" && exec "$0" -c "$3" "$1" "$2"'
    words = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount]
    process = subprocess.run(
        [*words, sys.executable, str(disk), str(copy), FULL],
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    if "unshare" in process.stderr or "mount:" in process.stderr:
        pytest.skip(f"this computer lets nobody mount a disk of their own ({process.stderr.strip()})")
    assert process.returncode == 0, process.stderr
    cause, readings, reason = process.stdout.split(maxsplit=2)
    assert cause == "disk"
    assert "database or disk is full" in reason
    recording = Recording.open(copy)
    assert recording.readings().sequence.tolist() == list(range(int(readings)))
    assert recording.end["reason"] == reason.strip()
    seal(copy)
    assert problems(copy) == ()
    print(f"\na disk of {size / 1e6:.1f} MB was full after {readings} readings: all of them kept, the end written")
