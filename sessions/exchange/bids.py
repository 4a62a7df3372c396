"""A session as a data set of the Brain Imaging Data Structure: behaviour, events, forces and derived tables.

Behavioural experiments (`beh`) follow BIDS 1.10. It has no data type for forces and torques yet, so the readings are a
continuous recording (`physio`), one file for each stretch without a break. A reading that never arrived is a row of
n/a, so that row and sampling rate agree. The last column says whether data are simulated.
"""

import gzip
import io
import math
import re
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby, pairwise, repeat
from operator import itemgetter
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from drivers.readings import ReadingBlock
from sessions.exchange import ExportSource, Progress
from sessions.exchange.csv_text import NOT_AVAILABLE, columns, read_rows, rows, write_rows
from sessions.exchange.exported import ExportedSession, head_of, side_files
from sessions.exchange.session_tables import EACH_EVENT, Column, Table, event_columns, logged_event, tables
from sessions.file_access import gzip_lines, json_object, read_within_limit, write_json
from sessions.recording import Recording
from sessions.recording.manifest import description

_VERSION = "1.10.0"
BREAK = 1.0  # a longer silence of the transducer begins a new file [s]
PIPELINE = "daq-app"
DERIVED = (  # tables derived from a recording, in their order
    "answers", "positions", "strokes", "friction", "flaws", "decisions", "predictions", "responses", "alternatives",
)  # fmt: skip
SOURCE = "sourcedata"  # BIDS allows any content here
_BIDS_COLUMNS = frozenset({"onset", "duration"})  # described by BIDS itself
_MARK = Column("simulated", "", "1: transducer or subject were simulated", ())


def write(source: ExportSource, folder: Path, progress: Progress) -> None:
    """Write the data set into an empty folder."""
    recording = source.recording
    derivatives = folder / "derivatives" / PIPELINE
    subject = f"sub-{_label(recording.plan.subject)}"
    task = {"TaskName": _label(recording.plan.protocol), "TaskDescription": f"protocol {recording.plan.protocol}"}
    stem = f"{subject}_task-{task['TaskName']}"
    for place, kind, software in (
        (folder, "raw", recording.provenance["software"]),
        (derivatives, "derivative", source.analysis["made_by"]),
    ):
        (place / subject / "beh").mkdir(parents=True)
        write_json(place / "dataset_description.json", _dataset(recording, kind, software))
        (place / "README.md").write_text(_readme(recording), encoding="utf-8")
    _write_table(folder / "participants", _participants(recording, subject), recording)
    beh = folder / subject / "beh"
    by_name = {table.name: table for table in tables(source)}
    instructions = task | {"Instructions": " / ".join(block.instruction for block in recording.plan.blocks)}
    _write_table(beh / f"{stem}_beh", by_name["trials"], recording, instructions)
    session = {"DaqAppSession": description(recording)}  # all that is needed to restore the session
    _write_table(beh / f"{stem}_events", _events(recording), recording, instructions | session)
    if recording.info is not None:
        _write_readings(recording, beh / stem, task["TaskName"], progress)
    for name, content in side_files(recording.folder).items():
        (folder / SOURCE).mkdir(exist_ok=True)
        (folder / SOURCE / name).write_bytes(content)
    for name in DERIVED:
        if name in by_name:
            derived = derivatives / subject / "beh" / f"{stem}_desc-{name}_beh"
            _write_table(derived, by_name[name], recording, task)


def find(path: Path) -> Path | None:
    """Return the path for `read` where `path` is a data set; None elsewhere."""
    return path if (path / "dataset_description.json").is_file() else None


def read(path: Path) -> ExportedSession:
    """Return the session in a data set of one subject written by `write`. Raises OSError, ValueError."""
    event_files = sorted(path.glob("sub-*/beh/*_events.tsv"))
    if len(event_files) != 1:
        raise ValueError(f"it holds the events of {len(event_files)} sessions, and one is needed")
    (event_file,) = event_files
    head = head_of(json_object(read_within_limit(event_file.with_suffix(".json")))["DaqAppSession"])
    # Not `splitlines`, which would end a line at a line separator in a typed text.
    text = io.StringIO(read_within_limit(event_file).decode(), newline=None)
    header, *lines = (line.removesuffix("\n").split("\t") for line in text)
    rows_read = (
        {name: "" if cell == NOT_AVAILABLE else cell for name, cell in zip(header, line, strict=True)} for line in lines
    )
    events = tuple(logged_event(row, "trial_type") for row in rows_read)
    files = sorted(event_file.parent.glob("*_physio.tsv.gz"), key=lambda file: float(_sidecar(file)["StartTime"]))
    return ExportedSession("bids", path, head, events, lambda: _blocks(files), side_files(path / SOURCE))


def _label(text: str) -> str:
    """Return a text as a BIDS label: letters and digits only.

    >>> _label("sensotact-friction")
    'sensotactfriction'
    """
    return re.sub(r"[^0-9A-Za-z]", "", text) or "unknown"


def _dataset(recording: Recording, dataset_type: str, software: Mapping[str, str]) -> dict[str, Any]:
    generator = {
        "Name": PIPELINE,
        "Version": software.get("daq-app", "unknown"),
        "Description": "; ".join(f"{name} {version}" for name, version in software.items()),
    }
    subject = "Recording" if dataset_type == "raw" else "Strokes, friction and predictions"
    name = f"{subject} of {recording.plan.subject}, protocol {recording.plan.protocol}"
    return {
        **recording.mark,
        "Name": f"SIMULATED: {name}" if recording.simulated else name,
        "BIDSVersion": _VERSION,
        "DatasetType": dataset_type,
        "GeneratedBy": [generator],
        **({"SourceDatasets": [{"URL": "../.."}]} if dataset_type == "derivative" else {}),
    }


def _participants(recording: Recording, subject: str) -> Table:
    plan = recording.plan
    simulated = "subject" in (recording.simulated_sentence or "")
    columns = (
        Column("participant_id", "", "BIDS label of the participant", (subject,)),
        Column("code", "", "code of the participant, never a name", (plan.subject,)),
        Column("stroking_hand", "", "hand that stroked; n/a: nobody stated it", (plan.stroking_hand,)),
        Column("answering_hand", "", "hand that answered; n/a: nobody stated it", (plan.answering_hand,)),
        Column("species", "", "binomial name, or simulation", ("simulation" if simulated else "homo sapiens",)),
    )
    return Table("participants", "a row for each participant", columns)


def _events(recording: Recording) -> Table:
    events = recording.events
    first_ns = events[0].time_ns if events else 0
    number, time, kind, trial, readings, data = event_columns(events)
    onset = Column("onset", "", "s from the first event", tuple((e.time_ns - first_ns) * 1e-9 for e in events))
    duration = Column("duration", "", "s; n/a: an event is an instant, or its end is an event", (None,) * len(events))
    kind = Column("trial_type", "", "what happened, see Levels of the program's manual", kind.values)
    return Table("events", EACH_EVENT, (onset, duration, kind, trial, number, time, readings, data))


# ---- readings


def _write_readings(recording: Recording, begin: Path, task: str, progress: Progress) -> None:
    """Write the readings, one file for each stretch; the names of all files start with the path `begin`."""
    assert recording.info is not None
    calibration = recording.info.calibration
    table_columns = [*columns(calibration), *([_MARK] if recording.simulated else [])]
    mark = (1,) if recording.simulated else ()
    first_ns = recording.events[0].time_ns if recording.events else 0
    rate = recording.info.rate
    several = any(stretch > 1 for stretch, _ in _stretches(recording.blocks(), rate))
    stretches = _stretches(recording.blocks_with_progress(progress), rate)
    for stretch, blocks in groupby(stretches, itemgetter(0)):
        stem = f"{begin.name}{f'_recording-{stretch}' if several else ''}_physio"
        last_number: int | None = None
        with _open_gzip(begin.with_name(f"{stem}.tsv.gz")) as file:
            for _, block in blocks:
                if last_number is None:
                    sidecar = {
                        **recording.mark,
                        "SamplingFrequency": _sampling_frequency(rate, block),
                        "StartTime": (int(block.received_ns[0]) - first_ns) * 1e-9,
                        "PhysioType": "generic",
                        "TaskName": task,
                        "Columns": [column.heading for column in table_columns],
                        "Manufacturer": recording.info.driver,
                        "ManufacturersModelName": recording.info.model,
                        "DeviceSerialNumber": recording.info.serial,
                        **{column.heading: _describe(column) for column in table_columns},
                    }
                    write_json(begin.with_name(f"{stem}.json"), sidecar)
                complete_rows = _rows_with_gaps(block, last_number, rows(block, calibration), len(table_columns), mark)
                write_rows(file, complete_rows, "\t")
                last_number = int(block.sequence[-1])


def _sampling_frequency(rate: float, block: ReadingBlock) -> float | None:
    """Return the rate that the device states [Hz], else that of the readings; None for a single reading."""
    if math.isfinite(rate):
        return rate
    span = float(block.time[-1] - block.time[0])
    return (len(block) - 1) / span if span > 0.0 else None


def _stretches(blocks: Iterable[ReadingBlock], rate: float) -> Iterator[tuple[int, ReadingBlock]]:
    """Yield the readings in order, each block with the number of its unbroken stretch, from 1; `rate` in Hz or nan."""
    last_time: float | None = None
    last_number: int | None = None
    stretch = 0
    largest_gap = BREAK * rate if math.isfinite(rate) else math.inf
    for block in filter(len, blocks):
        steps = np.diff(block.time, prepend=np.nan if last_time is None else last_time)
        gaps = np.diff(block.sequence, prepend=block.sequence[0] if last_number is None else last_number) - 1
        breaks = [int(i) for i in np.flatnonzero(~(np.abs(steps) <= BREAK) | (gaps > largest_gap))]
        cuts = [0, *(i for i in breaks if i), len(block)]
        for start, stop in pairwise(cuts):
            stretch += start in breaks
            yield stretch, block.between(start, stop)
        last_time, last_number = float(block.time[-1]), int(block.sequence[-1])


def _rows_with_gaps(
    block: ReadingBlock, last_number: int | None, cells: Iterable[tuple[Any, ...]], width: int, mark: tuple[int, ...]
) -> Iterator[tuple[Any, ...]]:
    """Yield the rows, and a row of n/a for each missing reading; NaN and infinity become n/a too."""
    finite = bool(np.isfinite(block.raw).all())
    missing = (NOT_AVAILABLE,) * (width - len(mark)) + mark
    for row in cells:
        yield from repeat(missing, 0 if last_number is None else row[0] - last_number - 1)
        yield (row if finite else tuple(cell if math.isfinite(cell) else NOT_AVAILABLE for cell in row)) + mark
        last_number = row[0]


@contextmanager
def _open_gzip(path: Path) -> Generator[TextIO]:
    """Open a gzip text without name and time, so that the same session gives the same bytes."""
    with (
        path.open("wb") as raw,
        gzip.GzipFile("", "wb", compresslevel=6, fileobj=raw, mtime=0) as file,
        io.TextIOWrapper(file, encoding="utf-8", newline="") as text,
    ):
        yield text


def _sidecar(file: Path) -> dict[str, Any]:
    return json_object(read_within_limit(file.with_name(file.name.replace(".tsv.gz", ".json"))))


def _blocks(files: Iterable[Path]) -> Iterator[ReadingBlock]:
    for file in files:
        yield from read_rows(gzip_lines(file), _sidecar(file)["Columns"], "\t")


# ---- files


def _write_table(stem: Path, table: Table, recording: Recording, extra: Mapping[str, Any] | None = None) -> None:
    if recording.simulated:
        table = replace(table, columns=(*table.columns, replace(_MARK, values=(1,) * len(table.rows))))
    with stem.with_name(f"{stem.name}.tsv").open("w", encoding="utf-8", newline="") as file:
        for row in ([column.heading for column in table.columns], *table.rows):
            # A BIDS table has no quotes, so cells must not contain tabs and line ends.
            texts = ("" if cell is None else re.sub(r"[\t\r\n]+", " ", str(cell)) for cell in row)
            file.write("\t".join(text or NOT_AVAILABLE for text in texts) + "\n")
    headings = {column.heading: _describe(column) for column in table.columns if column.heading not in _BIDS_COLUMNS}
    sidecar = {**recording.mark, "Description": table.meaning, **(extra or {}), **headings}
    write_json(stem.with_name(f"{stem.name}.json"), sidecar)


def _describe(column: Column) -> dict[str, str]:
    return {"Description": column.meaning, **({"Units": column.unit} if column.unit else {})}


def _readme(recording: Recording) -> str:
    lines = [
        *([recording.simulated_sentence, ""] if recording.simulated_sentence else []),
        f"# Session of {recording.plan.subject}, protocol {recording.plan.protocol}",
        "",
        "A subject strokes surfaces over a six-axis force transducer and judges each of them.",
        "",
        "- `*_beh.tsv`: a row for each trial, with the score",
        "- `*_events.tsv`: everything that happened; its JSON holds the whole description of the session",
        "- `*_physio.tsv.gz`: the transducer's readings, raw and as a wrench, nothing subtracted; a row of n/a",
        "  replaces a reading that never arrived; a silence of more than a second begins a new file. `time_s` is the",
        "  device's own clock, and counts where it differs from the sampling frequency",
        f"- `derivatives/{PIPELINE}`: strokes, friction, flaws and predictions made from them",
        "",
        "`daq-app import FOLDER` makes a session of this data set again.",
    ]
    return "\n".join([*lines, ""])
