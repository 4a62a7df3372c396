"""The live store, one SQLite file for each session: its tables, version and check sums.

`docs/session-format.md` describes the same for someone without this program; keep both in step.
"""

import zlib
from pathlib import Path
from typing import Any

import numpy as np

from drivers.readings import ReadingBlock
from sessions.recording.head import compact_json
from sessions.recording.log import LoggedEvent


class RecordingError(Exception):
    """A session folder cannot be written or read; the message says which, why, and what is safe."""


class DiskRefused(RecordingError):
    """The disk takes no more of a session; `reason` is the cause and its remedy, without what is safe."""

    def __init__(self, sentence: str, reason: str) -> None:
        """Store the full sentence and the reason alone."""
        super().__init__(sentence)
        self.reason = reason


class NotEmpty(RecordingError):
    """The folder for a new session is not empty; its content stays."""

    def __init__(self, folder: Path) -> None:
        """Name the folder."""
        super().__init__(f"{folder} is not empty; give a new folder, because nothing is overwritten")


FORMAT = "daq-app session"
FORMAT_VERSION = 3  # also PRAGMA user_version of the live file
APPLICATION_ID = 0x44415146  # "DAQF" in ASCII: PRAGMA application_id, at byte 68 of the file

LIVE_FILE = "session.sqlite"
SEALED_FILE = "session.h5"
DESCRIPTION_FILE = "session.json"
MANIFEST_FILE = "MANIFEST.json"


def check_format(form: Any) -> None:  # noqa: ANN401  any JSON value
    """Raise ValueError unless this program reads a format, as stated in heads and in `session.json`."""
    match form:
        case {"name": name, "version": int(version)} if name == FORMAT and version <= FORMAT_VERSION:
            return
        case _:
            readable = f"'{FORMAT}' up to version {FORMAT_VERSION}"
            raise ValueError(f"it holds {form or 'no format'}; this program reads {readable}")


TABLES = (
    """CREATE TABLE head (
        number INTEGER PRIMARY KEY, -- order of the rows; the first says SIMULATED or that nothing was
        name TEXT NOT NULL UNIQUE,  -- simulated, format, plan, transducer, provenance
        value TEXT NOT NULL,        -- a sentence or a JSON document
        crc32 INTEGER NOT NULL      -- of the value's UTF-8 bytes
    )""",
    """CREATE TABLE blocks (
        number INTEGER PRIMARY KEY,         -- from 1 without gaps
        readings INTEGER NOT NULL,          -- n, readings in this block
        sequence_first INTEGER NOT NULL, sequence_last INTEGER NOT NULL,       -- record numbers of the device
        counter_first INTEGER NOT NULL, counter_last INTEGER NOT NULL,         -- ticks of the device
        received_first_ns INTEGER NOT NULL, received_last_ns INTEGER NOT NULL, -- session clock, smallest and largest
        sequence BLOB NOT NULL,    -- n x int64, little-endian, as all blobs
        counter BLOB NOT NULL,     -- n x int64
        status BLOB NOT NULL,      -- n x int64
        time BLOB NOT NULL,        -- n x float64 [s]
        received_ns BLOB NOT NULL, -- n x int64 [ns]
        raw BLOB NOT NULL,         -- n x 6 float64, reading after reading
        crc32 INTEGER NOT NULL     -- of the six blobs, one after the other in this order
    )""",
    """CREATE TABLE events (
        number INTEGER PRIMARY KEY, -- from 1 without gaps
        time_ns INTEGER NOT NULL,   -- session clock
        kind TEXT NOT NULL,
        trial INTEGER,              -- number of the trial it belongs to
        readings INTEGER NOT NULL,  -- readings handed to the recording before it
        data TEXT NOT NULL,         -- JSON object
        crc32 INTEGER NOT NULL      -- of the UTF-8 text of the six values before it, joined by line feeds
    )""",
)

# Columns of a ReadingBlock in the order of the blobs, with the type of one number.
COLUMNS = {"sequence": "<i8", "counter": "<i8", "status": "<i8", "time": "<f8", "received_ns": "<i8", "raw": "<f8"}
BYTES_A_READING = 11 * 8  # five columns of one number, and the six of `raw`
SUMMARY = "readings, sequence_first, sequence_last, counter_first, counter_last, received_first_ns, received_last_ns"


def text_crc(text: str) -> int:
    """Return the CRC-32 of a text's UTF-8 bytes."""
    return zlib.crc32(text.encode())


def event_crc(event: LoggedEvent, data: str) -> int:
    """Return the CRC-32 of an event whose data is written as the JSON text `data`."""
    trial = "" if event.trial is None else str(event.trial)
    return text_crc("\n".join([str(event.number), str(event.time_ns), event.kind, trial, str(event.readings), data]))


def event_row(event: LoggedEvent) -> tuple[int, int, str, int | None, int, str, int]:
    """Return the row of an event. Raises ValueError for nan or an infinity in its data, which JSON lacks."""
    data = compact_json(event.data)
    return event.number, event.time_ns, event.kind, event.trial, event.readings, data, event_crc(event, data)


def blobs(block: ReadingBlock) -> tuple[bytes, ...]:
    """Return the six columns of a block as little-endian bytes, in the order of `COLUMNS`."""
    return tuple(np.ascontiguousarray(getattr(block, name), dtype).tobytes() for name, dtype in COLUMNS.items())


def blobs_crc(columns: tuple[bytes, ...]) -> int:
    """Return the CRC-32 over all columns, one after the other."""
    crc = 0
    for column in columns:
        crc = zlib.crc32(column, crc)
    return crc


def summary(block: ReadingBlock) -> tuple[int, ...]:
    """Return the columns `SUMMARY` of a block that holds a reading."""
    limits = [int(column[i]) for column in (block.sequence, block.counter) for i in (0, -1)]
    return len(block), *limits, int(block.received_ns.min()), int(block.received_ns.max())


def block_from_blobs(columns: tuple[bytes, ...]) -> ReadingBlock:
    """Return the readings of `columns`, in the order of `COLUMNS`. Raises ValueError when they differ in length."""
    arrays: dict[str, Any] = {
        name: np.frombuffer(column, dtype) for (name, dtype), column in zip(COLUMNS.items(), columns, strict=True)
    }
    return ReadingBlock(**{**arrays, "raw": arrays["raw"].reshape(-1, 6)})
