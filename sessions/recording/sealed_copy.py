"""The HDF5 copy of a recording: what it holds, how it is written, and whether it equals the live file.

`docs/session-format.md` describes each data set and unit for someone without this program; keep both in step.
"""

# h5py brings no types; every array is given its type where it leaves this file.

import io
import json
import math
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from drivers.arrays import Indices
from sessions.recording.head import calibration_hash
from sessions.recording.log import OUTCOMES
from sessions.recording.reader import Recording
from sessions.recording.schema import COLUMNS, FORMAT, FORMAT_VERSION, SEALED_FILE

CHUNK_BYTES = 32_768  # as in a chunk of the readings' columns
EVENT_DATA = "events/data"  # a data set of texts, whose lengths may differ a thousandfold
ENDS_SUFFIX = "_end"  # of the name of the data set that holds where each text ends


class _Disk(io.RawIOBase):
    """Receives HDF5's writes and stores the first failure: raised immediately, it would leave an open file."""

    def __init__(self, path: Path) -> None:
        self.failure: OSError | None = None
        self._file = path.open("x+b", buffering=0)

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        return self._file.seek(offset, whence)

    def readinto(self, buffer: Any, /) -> int | None:  # noqa: ANN401  any buffer
        return self._file.readinto(buffer)

    def write(self, data: Any, /) -> int:  # noqa: ANN401
        remaining = memoryview(data).cast("B")
        count = len(remaining)
        try:
            while self.failure is None and remaining:
                remaining = remaining[self._file.write(remaining) :]
        except OSError as error:
            self.failure = error
        return count  # as if all were written

    def truncate(self, size: int | None = None, /) -> int:
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return size or 0

    def close(self) -> None:
        self._file.close()
        super().close()


@contextmanager
def new_hdf5(path: Path, **options: Any) -> Generator[h5py.File]:  # noqa: ANN401  what h5py.File takes
    """Lend a new HDF5 file. Raises OSError after closing it if a write failed."""
    with _Disk(path) as disk:
        try:
            with h5py.File(disk, "w", **options) as file:
                yield file
        except Exception:  # of any type, when HDF5 reads data that were not written
            if disk.failure is None:
                raise
        if disk.failure is not None:
            raise disk.failure


def write_texts(file: h5py.File, name: str, column: Iterable[str]) -> tuple[h5py.Dataset, h5py.Dataset]:
    """Write a column of ASCII texts, and return its two data sets: uint8 bytes, int64 ends."""
    data_set = file.create_dataset(name, (0,), np.uint8, maxshape=(None,), chunks=(CHUNK_BYTES,), fletcher32=True)
    buffer, ends, position = bytearray(), list[int](), 0
    for text in column:
        buffer += text.encode("ascii")
        position += len(text)
        ends.append(position)
        if len(buffer) >= CHUNK_BYTES:
            _append(data_set, buffer)
    _append(data_set, buffer)
    storage = {"chunks": (len(ends),), "fletcher32": True} if ends else {}
    return data_set, file.create_dataset(name + ENDS_SUFFIX, data=np.array(ends, "<i8"), **storage)


def read_texts(file: h5py.File, name: str) -> Iterator[bytes]:
    """Yield the texts of a column, also those of fixed length in files of version 1. Raises OSError, KeyError."""
    column: Any = file[name]
    if column.dtype.kind == "S":
        rows = max(CHUNK_BYTES // column.dtype.itemsize, 1)
        for start in range(0, len(column), rows):
            yield from column[start : start + rows].tolist()
        return
    text_begin = 0
    for text_end in file[name + ENDS_SUFFIX][...].tolist():
        yield column[text_begin:text_end].tobytes()
        text_begin = text_end


def _append(data_set: h5py.Dataset, buffer: bytearray) -> None:
    length = len(data_set)
    data_set.resize(length + len(buffer), axis=0)
    if buffer:
        data_set[length:] = np.frombuffer(bytes(buffer), np.uint8)
        buffer.clear()


# Superblock 2 and nothing beyond HDF5 1.8: older MATLAB cannot read later files.
LIBVER = ("v108", "v108")
CHUNK = 4096  # readings a chunk
READING_NOTES = {
    "sequence": ("", "record number given by the device; missing numbers are lost readings"),
    "counter": ("ticks of the device", "the device's own clock"),
    "status": ("", "status word as the device sent it; 0 is healthy"),
    "time": ("s", "device clock, 0 at the first reading"),
    "received_ns": ("ns", "session clock when the reading arrived"),
    "raw": ("see raw_unit of /calibration", "wrench [N, N mm] = matrix (raw - bias), matrix in /calibration"),
}


@dataclass(frozen=True, slots=True, eq=False)
class DataSet:
    """One data set of the copy, other than the readings."""

    name: str
    values: NDArray[Any]  # numbers, or UTF-8 text as fixed-length bytes
    unit: str
    note: str


def write_copy(
    recording: Recording,
    path: Path,
    further: Iterable[DataSet] = (),
    progress: Callable[[float], None] = lambda _: None,
) -> None:
    """Write the copy of a recording, and the data sets `further`, to a new file at `path`. Raises OSError."""
    with new_hdf5(path, libver=LIBVER) as file:
        if recording.simulated_sentence:
            file.attrs["SIMULATED"] = _attribute(recording.simulated_sentence)
        file.attrs["format"] = _attribute(FORMAT)
        file.attrs["format_version"] = FORMAT_VERSION  # of the copy: the live file may be of an earlier one
        file.attrs["description"] = _attribute("every table, data set, unit and byte: docs/session-format.md")
        readings: dict[str, h5py.Dataset] = {}
        for name, dtype in COLUMNS.items():
            width = (6,) if name == "raw" else ()
            readings[name] = file.create_dataset(
                f"readings/{name}", (0, *width), dtype, maxshape=(None, *width), chunks=(CHUNK, *width), fletcher32=True
            )
            _describe(readings[name], *READING_NOTES[name])
        for block in recording.blocks_with_progress(progress):
            for name, column in readings.items():
                values = getattr(block, name)
                column.resize(len(column) + len(values), axis=0)
                column[-len(values) :] = values
        for entry in (*data_sets(recording), *further):
            dtype = entry.values.dtype
            if dtype.kind == "S":
                # Some readers (GNU Octave) know no UTF-8; most texts need none.
                plain = all(text.isascii() for text in entry.values.tolist())
                dtype = h5py.string_dtype("ascii" if plain else "utf-8", dtype.itemsize)
            # An empty data set has no chunks to protect.
            storage = {"chunks": entry.values.shape, "fletcher32": True} if entry.values.size else {}
            data_set = file.create_dataset(entry.name, data=entry.values.astype(dtype), **storage)
            _describe(data_set, entry.unit, entry.note)
        data_set, ends = write_texts(file, EVENT_DATA, _event_texts(recording))
        _describe(data_set, "", "what else is known, as JSON")
        _describe(ends, "bytes", f"where each text of {EVENT_DATA} ends; it begins where the one before ends")


def differences(recording: Recording) -> Iterator[str]:
    """Yield a sentence for each way in which the copy differs from the live file; a missing copy is the manifest's."""
    if not (recording.folder / SEALED_FILE).is_file():
        return
    try:
        with h5py.File(recording.folder / SEALED_FILE, "r") as file:
            yield from _different_readings(recording, file)
            older = int(file.attrs.get("format_version", 0)) < FORMAT_VERSION
            for entry in data_sets(recording):
                if older and entry.name not in file:
                    continue  # only later versions hold it
                values, stored = entry.values, np.asarray(file[entry.name])
                if stored.shape != values.shape or stored.astype(values.dtype).tobytes() != values.tobytes():
                    yield f"{entry.name} of {SEALED_FILE} differs from the live file"
            pairs = zip_longest(read_texts(file, EVENT_DATA), _event_texts(recording))
            if any(stored is None or text is None or stored != text.encode() for stored, text in pairs):
                yield f"{EVENT_DATA} of {SEALED_FILE} differs from the live file"
            if file.attrs.get("SIMULATED") != _attribute(recording.simulated_sentence):
                yield f"{SEALED_FILE} does not say of itself what the live file says: {recording.simulated_sentence}"
    except (OSError, KeyError, RuntimeError) as error:
        yield f"{SEALED_FILE} cannot be read ({error})"


def data_sets(recording: Recording) -> tuple[DataSet, ...]:
    """Return all data sets of the copy except readings and data of events."""
    return (*_head(recording), *_calibration(recording), *_events(recording), *_trials(recording))


def _head(recording: Recording) -> Iterator[DataSet]:
    yield DataSet("head/simulated", texts([recording.simulated_sentence or "no"]), "", "what was simulated, or no")
    yield DataSet("head/plan", texts([_plain_json(recording.head["plan"])]), "", "JSON")
    yield DataSet("head/transducer", texts([_plain_json(recording.head["transducer"])]), "", "JSON")
    yield DataSet("head/provenance", texts([_plain_json(dict(recording.provenance))]), "", "JSON")
    yield DataSet("head/losses", texts(recording.losses), "", "what storage lost, a sentence each")
    yield DataSet("head/flaws", texts(recording.flaws), "", "what went wrong while recording, a sentence each")


def _calibration(recording: Recording) -> Iterator[DataSet]:
    if recording.info is None:
        return
    calibration = recording.info.calibration
    unit = f"N (rows 1 to 3) and N mm (rows 4 to 6) for {calibration.raw_unit}"
    yield DataSet("calibration/matrix", calibration.matrix.astype("<f8"), unit, "wrench = matrix (raw - bias)")
    yield DataSet("calibration/rated", calibration.rated.astype("<f8"), "N and N mm", "rated range; NaN where unknown")
    yield DataSet("calibration/raw_unit", texts([calibration.raw_unit]), "", "unit of /readings/raw")
    yield DataSet("calibration/serial", texts([calibration.serial]), "", "serial number the matrix is true for")
    yield DataSet("calibration/sha256", texts([calibration_hash(calibration)]), "", "of the matrix's 36 float64")


def _events(recording: Recording) -> Iterator[DataSet]:
    events = recording.events
    yield DataSet("events/number", _int64([e.number for e in events]), "", "from 1")
    yield DataSet("events/time_ns", _int64([e.time_ns for e in events]), "ns", "session clock")
    yield DataSet("events/kind", texts([e.kind for e in events]), "", "what happened")
    yield DataSet("events/trial", _int64([e.trial or 0 for e in events]), "", "number of the trial; 0 for none")
    yield DataSet("events/readings", _int64([e.readings for e in events]), "", "readings recorded before it")


def _event_texts(recording: Recording) -> Iterator[str]:
    """Yield the data of each event as JSON: together they may exceed the memory."""
    return (_plain_json(event.data) for event in recording.events)


def _trials(recording: Recording) -> Iterator[DataSet]:
    records = recording.trials
    trials = [record.trial for record in records]
    indices = [-1 if t.stimulus.index is None else t.stimulus.index for t in trials]
    scores = np.array([math.nan if r.score is None else r.score for r in records], "<f8")
    numbers = np.array([math.nan if r.number is None else r.number for r in records], "<f8")
    choices = [{None: 0, "first": 1, "second": 2}[r.choice] for r in records]
    for name, values, unit, note in (
        ("number", [t.number for t in trials], "", "from 1, in the planned order"),
        ("block", texts([t.block for t in trials]), "", "name of the block"),
        ("descriptor", texts([t.stimulus.descriptor for t in trials]), "", "what was judged"),
        ("index", indices, "", "the maker's number of the stimulus, 0 to 100; -1 where it was sealed"),
        ("code", texts([t.stimulus.code for t in trials]), "", "label on the stimulus"),
        ("direction", [t.direction for t in trials], "", "+1 proximal to distal, -1 back"),
        ("repetition", [t.repetition for t in trials], "", "from 1"),
        ("phase", texts([t.phase for t in trials]), "", "main; or practice, pre-evaluation"),
        ("outcome", texts([r.outcome for r in records]), "", OUTCOMES),
        ("score", scores, "", "0 to 100; NaN unless the outcome is scored"),
        ("free_number", numbers, "", "on the subject's own scale; NaN unless the outcome is numbered"),
        ("choice", choices, "", "1 or 2 of the two compared; 0 unless the outcome is chosen"),
        ("compared_with", [t.compared_with or 0 for t in trials], "", "number of the first of two; 0 for none"),
        ("take", [r.take.number if r.take else 0 for r in records], "", "that counts; 0 for none"),
        ("start_ns", [r.start_ns or 0 for r in records], "ns", "of that take, session clock"),
        ("stop_ns", [r.stop_ns or 0 for r in records], "ns", "of that take, session clock"),
    ):
        yield DataSet(f"trials/{name}", _int64(values) if isinstance(values, list) else values, unit, note)


def _different_readings(recording: Recording, file: h5py.File) -> Iterator[str]:
    start = 0
    for block in recording.blocks():
        stop = start + len(block)
        for name in COLUMNS:
            # Bytes are compared, not numbers: NaN never equals itself.
            if np.asarray(file["readings"][name][start:stop]).tobytes() != getattr(block, name).tobytes():
                yield f"{name} of the readings {start} to {stop - 1} in {SEALED_FILE} differs from the live file"
        start = stop
    for name in COLUMNS:
        length = int(file["readings"][name].shape[0])
        if length != start:
            yield f"{SEALED_FILE} holds {length} of {name}, the live file {start}"


def _describe(data_set: h5py.Dataset, unit: str, note: str) -> None:
    data_set.attrs["unit"], data_set.attrs["note"] = _attribute(unit), _attribute(note)


def _int64(values: Sequence[int]) -> Indices:
    return np.array(values, "<i8")


def _plain_json(value: object) -> str:
    """Return JSON in ASCII; other characters are escaped."""
    return json.dumps(value, allow_nan=False, separators=(",", ":"))


def texts(values: Sequence[str]) -> NDArray[np.bytes_]:
    """Return texts as UTF-8, all with the length of the longest one."""
    return np.array([value.encode() for value in values], "S") if values else np.empty(0, "S1")


def _attribute(text: str | None) -> np.bytes_ | None:
    """Return a text for an HDF5 attribute: bytes of fixed length."""
    return None if text is None else np.bytes_(text.encode())
