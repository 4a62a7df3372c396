"""A session as one HDF5 file: the sealed copy, which describes itself, and the derived tables."""

# h5py brings no types; arrays get their types where they leave this file.

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import h5py
import numpy as np

from drivers.readings import ReadingBlock
from sessions.exchange import ExportSource, Progress
from sessions.exchange.exported import ExportedSession, Head, side_files
from sessions.exchange.session_tables import Column, tables
from sessions.file_access import LARGEST_DOCUMENT, json_value
from sessions.recording import LoggedEvent
from sessions.recording.derived import GAIN_ERROR
from sessions.recording.log import event_data
from sessions.recording.schema import COLUMNS, SEALED_FILE, check_format
from sessions.recording.sealed_copy import DataSet, read_texts, texts, write_copy
from sessions.strokes.decisions import DECISIONS

_PART = 65_536  # readings in one block
SIDE_FILES = {  # data set and meaning of each file with people's settings and decisions
    DECISIONS: ("derived/decisions", "decisions.jsonl, what people decided about strokes"),
    GAIN_ERROR: ("derived/calibration_error", "calibration-error.json, as somebody set it"),
}
IN_THE_COPY = "trials"  # the table already in the sealed copy


def write(source: ExportSource, folder: Path, progress: Progress) -> None:
    """Write the file into an empty folder."""
    further = (table for table in tables(source) if table.name != IN_THE_COPY)
    data_sets = [_data_set(table.name, column) for table in further for column in table.columns]
    for name, document in (("analysis", source.analysis), ("prediction", source.prediction)):
        if document is not None:
            text, meaning = json.dumps(document, allow_nan=False), f"{name}.json, made by the versions in made_by"
            data_sets.append(DataSet(f"derived/{name}", texts([text]), "", meaning))
    for name, content in side_files(source.recording.folder).items():
        data_set, meaning = SIDE_FILES[name]
        data_sets.append(DataSet(data_set, texts([content.decode(errors="replace")]), "", meaning))
    write_copy(source.recording, folder / SEALED_FILE, data_sets, progress)


def find(path: Path) -> Path | None:
    """Return the file for `read` where `path` is that file or its folder; None elsewhere."""
    if path.suffix in {".h5", ".hdf5"} and not path.is_dir():
        return path
    return path / SEALED_FILE if (path / SEALED_FILE).is_file() else None


def read(path: Path) -> ExportedSession:
    """Return the session in a file written by `write`, or in a sealed copy. Raises OSError, ValueError."""
    with h5py.File(path, "r") as file:
        form = _text(file.attrs.get("format", b""))
        check_format({"name": form, "version": int(file.attrs.get("format_version", 0))} if form else None)
        names = ("plan", "transducer", "provenance")
        head = Head(
            _text(file.attrs["SIMULATED"]) if "SIMULATED" in file.attrs else None,
            *(cast("Any", json_value(_text(_array(file, f"head/{name}")[0]))) for name in names),
            losses=tuple(map(_text, _array(file, "head/losses"))),
            digest=None,  # the file has its own check sums
        )
        columns = [_array(file, f"events/{name}").tolist() for name in ("number", "time_ns", "trial", "readings")]
        files = {
            name: _text(_array(file, data_set)[0]).encode()
            for name, (data_set, _) in SIDE_FILES.items()
            if data_set in file
        }
        kinds = map(_text, _array(file, "events/kind").tolist())
        events = tuple(
            LoggedEvent(number, time_ns, kind, trial or None, readings, event_data(kind, text.decode()))
            for number, time_ns, trial, readings, kind, text in zip(
                *columns, kinds, read_texts(file, "events/data"), strict=True
            )
        )
    return ExportedSession("hdf5", path, head, events, lambda: _blocks(path), files)


def _array(file: h5py.File, name: str) -> Any:  # noqa: ANN401  h5py brings no types
    """Return a data set as an array. Raises ValueError where it unpacks to more than an export writes."""
    if file[name].nbytes > LARGEST_DOCUMENT:
        raise ValueError(f"{name} unpacks to more than {LARGEST_DOCUMENT / 2**20:.0f} MB")
    return file[name][...]


def _blocks(path: Path) -> Iterator[ReadingBlock]:
    with h5py.File(path, "r") as file:
        count = len(file["readings/sequence"])
        for start in range(0, count, _PART):
            arrays: Any = {
                name: np.asarray(file[f"readings/{name}"][start : start + _PART], dtype)
                for name, dtype in COLUMNS.items()
            }
            yield ReadingBlock(**arrays)


def _data_set(table: str, column: Column) -> DataSet:
    """Return a column as a data set, with NaN or an empty text for missing values."""
    name, note = f"{table}/{column.name}", f"{column.meaning}; empty or NaN where unknown"
    values = column.complete_values
    if column.kind is str:
        return DataSet(name, texts(values), column.unit, note)
    return DataSet(name, np.array(values, "<f8" if column.kind is float else "<i8"), column.unit, note)


def _text(value: object) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
