"""A session as CSV: a file for each table, a README that describes every column, and the session's own description."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

from drivers.readings import ReadingBlock
from sessions.exchange import ExportSource, Progress
from sessions.exchange.csv_text import columns, plain, read_rows, rows, write_rows
from sessions.exchange.exported import ExportedSession, head_of, side_files
from sessions.exchange.session_tables import EACH_EVENT, Column, Table, event_columns, logged_event, tables
from sessions.file_access import json_object, read_within_limit, write_json
from sessions.recording import Recording
from sessions.recording.manifest import description
from sessions.recording.schema import DESCRIPTION_FILE, SEALED_FILE

_READINGS, EVENTS, README = "readings.csv", "events.csv", "README.md"
_SIMULATED = Column("SIMULATED", "", "yes: transducer or subject were simulated", ())  # a comment would hide the header


def write(source: ExportSource, folder: Path, progress: Progress) -> None:
    """Write the session into an empty folder."""
    recording = source.recording
    session_tables = [*tables(source), Table("events", EACH_EVENT, event_columns(recording.events))]
    mark = (_SIMULATED,) if recording.simulated_sentence else ()
    for table in session_tables:
        with (folder / f"{table.name}.csv").open("w", encoding="utf-8", newline="") as file:
            _write_rows(file, mark, [[column.heading for column in table.columns]], table.rows)
    contents = [(f"{table.name}.csv", table.meaning, (*mark, *table.columns)) for table in session_tables]
    if recording.info is not None:
        meaning = "a row for each reading, in the order recorded"
        contents.append((_READINGS, meaning, (*mark, *columns(recording.info.calibration))))
        _write_readings(recording, mark, folder / _READINGS, progress)
    write_json(folder / DESCRIPTION_FILE, description(recording))
    for name, document in (("analysis.json", source.analysis), ("prediction.json", source.prediction)):
        if document is not None:
            write_json(folder / name, {**recording.mark, **document})
    for name, content in side_files(recording.folder).items():
        (folder / name).write_bytes(content)
    (folder / README).write_text(_readme(recording, contents), encoding="utf-8")


def find(path: Path) -> Path | None:
    """Return the path for `read` where `path` is such a folder; None elsewhere."""
    return path if (path / DESCRIPTION_FILE).is_file() and not (path / SEALED_FILE).is_file() else None


def read(path: Path) -> ExportedSession:
    """Return the session written by `write` into the folder `path`. Raises OSError, ValueError."""
    head = head_of(json_object(read_within_limit(path / DESCRIPTION_FILE)))
    rows_read = csv.DictReader(io.StringIO(read_within_limit(path / EVENTS).decode(), newline=""))
    events = tuple(logged_event({name: plain(cell) for name, cell in row.items()}, "kind") for row in rows_read)
    return ExportedSession("csv", path, head, events, lambda: _read_readings(path / _READINGS), side_files(path))


def _write_rows(file: TextIO, mark: Sequence[Column], header: list[list[str]], rows: Iterable[Sequence[Any]]) -> None:
    """Write a header and rows; with a `mark` its column comes first."""
    write_rows(file, [[*(column.heading for column in mark), *names] for names in header])
    write_rows(file, ([*("yes" for _ in mark), *row] for row in rows))


def _write_readings(recording: Recording, mark: Sequence[Column], path: Path, progress: Progress) -> None:
    assert recording.info is not None
    calibration = recording.info.calibration
    total = recording.expected_readings or 1
    count = 0
    with path.open("w", encoding="utf-8", newline="") as file:
        _write_rows(file, mark, [[column.heading for column in columns(calibration)]], ())
        for block in recording.blocks():
            _write_rows(file, mark, [], rows(block, calibration))
            count += len(block)
            progress(min(count / total, 1.0))


def _read_readings(path: Path) -> Iterator[ReadingBlock]:
    if not path.is_file():  # a visit without forces
        return
    with path.open(encoding="utf-8", newline="") as file:
        yield from read_rows(file, next(file, "").strip().split(","), ",")


def _readme(recording: Recording, contents: Sequence[tuple[str, str, Sequence[Column]]]) -> str:
    lines = [
        *([recording.simulated_sentence, ""] if recording.simulated_sentence else []),
        f"# Session of {recording.plan.subject}, protocol {recording.plan.protocol}",
        "",
        "Comma-separated values, UTF-8, with decimal points; an empty cell is an unknown or withheld number. The name",
        "of a column ends with its unit, if any. `session.json` holds plan, transducer, calibration and where the",
        "recording came from; `daq-app import FOLDER` makes a session of this folder again.",
        "",
        "Clocks: `_ns` is nanoseconds on the session clock of the recording computer; seconds of strokes and readings",
        "are those of the transducer's own clock, 0 at its first reading.",
    ]
    for name, meaning, table_columns in contents:
        lines += ["", f"## {name}", "", f"{meaning[0].upper()}{meaning[1:]}.", "", "| column | unit | meaning |"]
        lines += ["| --- | --- | --- |", *(f"| `{c.heading}` | {c.unit or '–'} | {c.meaning} |" for c in table_columns)]
    return "\n".join([*lines, ""])
