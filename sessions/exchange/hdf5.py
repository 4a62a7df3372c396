"""A session as one HDF5 file: the sealed copy, which tells of itself, and the tables made from it."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false, reportIndexIssue=false
# pyright: reportArgumentType=false
# h5py brings no types; every array is given its type where it leaves this file.

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from drivers.readings import ReadingBlock
from sessions.exchange import ExportSource, Progress
from sessions.exchange.exported import ExportedSession, Head
from sessions.exchange.session_tables import Column, tables
from sessions.file_access import LARGEST_DOCUMENT
from sessions.json_document import json_value
from sessions.recording import LoggedEvent
from sessions.recording.calibration_uncertainty import gain_error_content
from sessions.recording.event_shapes import event_data
from sessions.recording.schema import COLUMNS, FORMAT, FORMAT_VERSION, SEALED_FILE
from sessions.recording.sealed_copy import DataSet, texts, write_copy
from sessions.recording.text_column import read_texts
from sessions.strokes.decisions import content_of

PART = 65_536  # readings at once
DECIDED, UNCERTAIN = "derived/decisions", "derived/calibration_error"
IN_THE_COPY = "trials"  # the table that the sealed copy holds itself


def write(source: ExportSource, folder: Path, progress: Progress) -> None:
    """Write the file into an empty folder."""
    more = [_data_set(table.name, c) for table in tables(source) if table.name != IN_THE_COPY for c in table.columns]
    for name, document in (("analysis", source.analysis), ("prediction", source.prediction)):
        if document is not None:
            text = json.dumps(document, allow_nan=False)
            more.append(DataSet(f"derived/{name}", texts([text]), "", f"{name}.json, made by the versions in made_by"))
    decided = content_of(source.recording.folder).decode(errors="replace")
    if decided:
        more.append(DataSet(DECIDED, texts([decided]), "", "decisions.jsonl, what people decided about strokes"))
    uncertain = gain_error_content(source.recording.folder).decode(errors="replace")
    if uncertain:
        more.append(DataSet(UNCERTAIN, texts([uncertain]), "", "calibration-error.json, as somebody set it"))
    write_copy(source.recording, folder / SEALED_FILE, more, progress)


def read(path: Path) -> ExportedSession:
    """Return the session that a file written by `write`, or a sealed copy, holds. Raises OSError, ValueError."""
    with h5py.File(path, "r") as file:
        made = _text(file.attrs.get("format", b"")), int(file.attrs.get("format_version", 0))
        if made[0] != FORMAT or made[1] > FORMAT_VERSION:
            raise ValueError(f"it holds {made[0] or 'no format'} {made[1]}; this reads '{FORMAT}' to {FORMAT_VERSION}")
        head = Head(
            _text(file.attrs["SIMULATED"]) if "SIMULATED" in file.attrs else None,
            *(json_value(_text(_held(file, f"head/{name}")[0])) for name in ("plan", "transducer", "provenance")),
            losses=tuple(map(_text, _held(file, "head/losses"))),
            digest=None,  # the file's own check sums guard it
        )
        columns = [_held(file, f"events/{name}").tolist() for name in ("number", "time_ns", "trial", "readings")]
        beside = [_text(_held(file, name)[0]).encode() if name in file else b"" for name in (DECIDED, UNCERTAIN)]
        kinds = map(_text, _held(file, "events/kind").tolist())
        events = tuple(
            LoggedEvent(number, time_ns, kind, trial or None, readings, event_data(kind, text.decode()))
            for number, time_ns, trial, readings, kind, text in zip(
                *columns, kinds, read_texts(file, "events/data"), strict=True
            )
        )
    return ExportedSession("hdf5", path, head, events, lambda: _blocks(path), *beside)


def _held(file: h5py.File, name: str) -> Any:  # noqa: ANN401  h5py brings no types
    """Return a data set as an array. Raises ValueError where it unpacks to more than an export writes."""
    if file[name].nbytes > LARGEST_DOCUMENT:
        raise ValueError(f"{name} unpacks to more than {LARGEST_DOCUMENT / 2**20:.0f} MB")
    return file[name][...]


def _blocks(path: Path) -> Iterator[ReadingBlock]:
    with h5py.File(path, "r") as file:
        count = len(file["readings/sequence"])
        for start in range(0, count, PART):
            arrays: Any = {
                name: np.asarray(file[f"readings/{name}"][start : start + PART], kind) for name, kind in COLUMNS.items()
            }
            yield ReadingBlock(**arrays)


def _data_set(table: str, column: Column) -> DataSet:
    """Return a column as a data set: NaN, or an empty text, where there is nothing."""
    values = column.values
    name, note = f"{table}/{column.name}", f"{column.meaning}; empty or NaN where unknown"
    if any(isinstance(value, str) for value in values):
        return DataSet(name, texts(["" if value is None else str(value) for value in values]), column.unit, note)
    if any(value is None or isinstance(value, float) for value in values):
        numbers = [math.nan if value is None else float(value) for value in values]
        return DataSet(name, np.array(numbers, "<f8"), column.unit, note)
    return DataSet(name, np.array(values, "<i8"), column.unit, note)


def _text(value: object) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
