"""How much room a session takes on the disk, and a reserve that lets its end be written when there is none left."""

import os
import shutil
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from sessions.file_access import open_new
from sessions.plan.plan import SessionPlan
from sessions.recording.schema import BYTES_A_READING, RecordingError

RATE_UNKNOWN = 1000.0  # readings a second assumed of a device that does not tell [Hz]
TRIAL_TIME = 90.0  # mounting, zero, stroke and score, with a redo now and then [s]
BLOCK_TIME = 300.0  # instruction, questions, a rest [s]
COPIES = 2  # the live file and its sealed copy
MARGIN = 64 * 2**20  # write-ahead log, events, reports [bytes]
RESERVE_FILE = "session.reserve"
RESERVE = 16 * 2**20  # enough for the last seconds of readings, the end, and folding the log [bytes]


@dataclass(frozen=True, slots=True)
class Need:
    """What a session is expected to take."""

    duration: float  # [s]
    rate: float  # [Hz]; 0 without a transducer
    size: int  # [bytes]

    @property
    def sentence(self) -> str:
        """Return the arithmetic."""
        return (
            f"{self.duration / 60:.0f} min at {self.rate:g} readings a second of {BYTES_A_READING} bytes, "
            f"kept twice, and {MARGIN / 1e6:.0f} MB beside: {self.size / 1e6:.0f} MB"
        )


def need(plan: SessionPlan, rate: float | None) -> Need:
    """Return what a session is expected to take, `rate` [Hz] being nan where unknown, None without a transducer."""
    duration = len(plan.trials) * TRIAL_TIME + len(plan.blocks) * BLOCK_TIME
    rows_a_second = 0.0 if rate is None else rate if isfinite(rate) else RATE_UNKNOWN
    return Need(duration, rows_a_second, round(COPIES * duration * rows_a_second * BYTES_A_READING) + MARGIN)


def check_room(folder: Path, need: Need) -> None:
    """Raise RecordingError where the disk `folder` is to lie on has less room than wanted."""
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    free = shutil.disk_usage(there).free
    if free < need.size:
        raise RecordingError(
            f"{folder} has {free / 1e6:.0f} MB of room, and the session may need {need.sentence}; "
            "free space on the disk, or record on another"
        )


class Reserve:
    """Room taken in advance, given back when the disk is full so that the end can be written."""

    def __init__(self, folder: Path, size: int = RESERVE) -> None:
        """Take it. Raises OSError where there is no such room, a quota's limit included."""
        self._path = folder / RESERVE_FILE
        with open_new(self._path) as file:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)
            else:
                file.write(bytes(size))
            os.fsync(file.fileno())

    def release(self) -> None:
        """Give it back. Harmless when repeated."""
        release_reserve(self._path.parent)


def release_reserve(folder: Path) -> None:
    """Give back a reserve that was taken in `folder`, also by a process that was killed."""
    with suppress(OSError):
        (folder / RESERVE_FILE).unlink(missing_ok=True)
