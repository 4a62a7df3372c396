"""A session as CSV: a file for each table, a README that describes every column, and the session's own description."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

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
    mark = (_SIMULATED,) if recording.simulated else ()
    contents: list[tuple[str, str, Sequence[Column]]] = []

    def add(name: str, meaning: str, table_columns: Sequence[Column], table_rows: Iterable[Sequence[Any]]) -> None:
        columns_here = (*mark, *table_columns)
        with (folder / name).open("w", encoding="utf-8", newline="") as file:
            write_rows(file, [[column.heading for column in columns_here]])
            write_rows(file, ([*("yes" for _ in mark), *row] for row in table_rows))
        contents.append((name, meaning, columns_here))

    for table in (*tables(source), Table("events", EACH_EVENT, event_columns(recording.events))):
        add(f"{table.name}.csv", table.meaning, table.columns, table.rows)
    if recording.info is not None:
        calibration = recording.info.calibration
        blocks = recording.blocks_with_progress(progress)
        reading_rows = chain.from_iterable(rows(block, calibration) for block in blocks)
        add(_READINGS, "a row for each reading, in the order recorded", columns(calibration), reading_rows)
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
