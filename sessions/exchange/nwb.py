"""A session as one file of Neurodata Without Borders: readings, wrench, trials, events and results.

Needs the optional library pynwb. Raw numbers and forces are acquired time series on the session clock; trials,
answers, strokes, friction and predictions are tables.
"""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sessions.exchange import ExportError, ExportSource, Progress
from sessions.exchange.session_tables import Column, Table, event_columns, tables
from sessions.file_access import leaves
from sessions.recording import Recording
from sessions.recording.head import compact_json
from sessions.recording.manifest import description
from sessions.recording.sealed_copy import new_hdf5
from sessions.strokes.trial_analysis import RAW_WRENCH

if TYPE_CHECKING:
    from pynwb import NWBFile

FILE = "session.nwb"
_INSTALL_ADVICE = "NWB needs the library pynwb, which is not installed: run 'pip install daq-app[nwb]' and export again"
_READING_FIELDS = (
    ("sequence", "n/a", "Record number given by the device; missing numbers are readings that never arrived."),
    ("counter", "ticks", "The device's own clock."),
    ("status", "n/a", "Status word as the device sent it; 0 is healthy."),
    ("time", "seconds", "The device's own clock, 0 at the first reading."),
    ("received_ns", "nanoseconds", "Session clock when the reading arrived."),
)


def write(source: ExportSource, folder: Path, progress: Progress) -> None:
    """Write the file into an empty folder. Raises ExportError where pynwb is missing."""
    try:
        import pynwb
        from pynwb.file import Subject
    except ImportError as error:
        raise ExportError(_INSTALL_ADVICE) from error
    recording = source.recording
    plan = recording.plan
    mark = f"{recording.simulated_sentence}. " if recording.simulated_sentence else ""
    document = description(recording)
    bootstrap: Mapping[str, Any] = (source.analysis.get("bootstrap") or {}).get("settings") or {}
    first_ns = recording.events[0].time_ns if recording.events else 0
    file = pynwb.NWBFile(
        session_description=f"{mark}A subject strokes surfaces over a six-axis force transducer and judges them.",
        identifier=hashlib.sha256(compact_json(document["sha256"]).encode()).hexdigest(),
        session_start_time=_utc(recording, first_ns),
        experiment_description=f"{mark}Protocol {plan.protocol}, stimulus order {plan.order_rule}, seed {plan.seed}.",
        session_id=plan.subject,
        keywords=["friction", "touch", "psychophysics", *(["SIMULATED"] if mark else [])],
        source_script=f"daq-app {source.analysis['made_by'].get('daq-app', '')}",
        source_script_file_name="daq-app export",
        notes=compact_json(  # all data without another place in the file
            {
                **document,
                "log": [asdict(event) for event in recording.events],
                # The uncertainty of each axis' gain, included in the intervals, and its origin.
                "calibration_error": {name: bootstrap.get(name) for name in ("gain_error", "gain_error_origin")},
            }
        ),
        subject=Subject(
            subject_id=plan.subject,
            species="Homo sapiens",
            sex="U",
            age="P0D/",  # from 0 days on: age is not recorded
            description=f"{mark}A code; nothing personal is recorded, age and sex among it.",
        ),
    )
    if recording.info is not None:
        _add_readings(file, recording, first_ns, mark)
    _add_trials(file, recording, first_ns)
    events = _events(recording, first_ns)
    if events.rows:
        file.add_acquisition(_dynamic(events, mark))
    numbers = [_dynamic(table, mark) for table in tables(source) if table.rows]
    if numbers:
        module = file.create_processing_module("behavior", f"{mark}What was answered, and what was made of it.")
        for table in numbers:
            module.add(table)
    progress(0.5)
    with new_hdf5(folder / FILE) as hdf5, pynwb.NWBHDF5IO(file=hdf5, mode="w") as io:
        io.write(file)
    progress(1.0)


def _add_readings(file: "NWBFile", recording: Recording, first_ns: int, mark: str) -> None:
    """Add raw values and wrench on the device's clock, aligned with the session clock at the first reading."""
    from pynwb import TimeSeries

    info = recording.info
    block = recording.readings()
    if info is None or not len(block):
        return
    file.create_device(
        name="transducer",
        description=f"{mark}{info.model} ({info.driver}), serial {info.serial}, {info.rate:g} readings a second",
    )
    calibration = info.calibration
    with np.errstate(invalid="ignore", over="ignore"):  # any value of the device is written
        wrench = calibration.wrench(block.raw, np.zeros(6))
    start = (int(block.received_ns[0]) - first_ns) * 1e-9
    clock: dict[str, Any] = {"timestamps": block.time - block.time[0] + start}
    steps = set(np.diff(block.time).round(9).tolist())
    if len(steps) == 1 and steps != {0.0}:  # no gaps and even steps
        rate = (len(block) - 1) / float(block.time[-1] - block.time[0])  # the device may state a wrong rate, or none
        clock = {"starting_time": start, "rate": info.rate if math.isclose(rate, info.rate, rel_tol=1e-5) else rate}
    unit = "see comments" if calibration.raw_unit == RAW_WRENCH else calibration.raw_unit
    raw = TimeSeries(
        name="raw",
        data=block.raw,
        unit=unit,
        **clock,
        description=f"{mark}The six raw numbers as the device sent them.",
        comments=f"Unit: {calibration.raw_unit}. wrench = matrix (raw - bias), matrix in the notes of this file.",
    )
    file.add_acquisition(raw)
    timing = clock if "rate" in clock else {"timestamps": raw}
    for name, axes, unit in (("forces", slice(0, 3), "newtons"), ("torques", slice(3, 6), "N mm")):
        meaning = f"{mark}{name.capitalize()} of the finger on the stimulus (x y z), nothing subtracted."
        file.add_acquisition(TimeSeries(name=name, data=wrench[:, axes], unit=unit, description=meaning, **timing))
    for name, unit, meaning in _READING_FIELDS:
        data = getattr(block, name)
        file.add_acquisition(TimeSeries(name=name, data=data, unit=unit, description=f"{mark}{meaning}", **timing))


def _add_trials(file: "NWBFile", recording: Recording, first_ns: int) -> None:
    """Add the span of each trial's valid take; the table "trials" has all trials."""
    records = [record for record in recording.trials if record.take is not None and record.take.stop_ns is not None]
    if not records:
        return
    for name, meaning in (
        ("number", "of the trial"),
        ("descriptor", "what was judged"),
        ("index", "the maker's number of the stimulus; -1: sealed"),
        ("outcome", "scored or not answered"),
        ("score", "the subject's answer, 0 to 100; NaN: none"),
    ):
        file.add_trial_column(name, meaning)
    for record in records:
        start, stop = record.start_ns or 0, record.stop_ns or 0
        file.add_trial(
            start_time=(start - first_ns) * 1e-9,
            stop_time=(stop - first_ns) * 1e-9,
            number=record.trial.number,
            descriptor=record.trial.stimulus.descriptor,
            index=-1 if record.trial.stimulus.index is None else record.trial.stimulus.index,
            outcome=record.outcome,
            score=math.nan if record.score is None else record.score,
        )


def _events(recording: Recording, first_ns: int) -> Table:
    events = recording.events
    texts = tuple("; ".join(f"{name}: {value}" for name, value in leaves(event.data)) for event in events)
    _, time, kind, _, readings, _ = event_columns(events)
    seconds = Column("timestamp", "", "s from the start", tuple((e.time_ns - first_ns) * 1e-9 for e in events))
    trial = Column("trial", "", "number of the trial; 0 for none", tuple(e.trial or 0 for e in events))
    data = Column("data", "", "what else is known, for people; exact in the notes", texts)
    return Table("events", "Everything that happened, in order.", (seconds, time, kind, trial, readings, data))


def _dynamic(table: Table, mark: str) -> object:
    """Return a table for NWB, with NaN or an empty text for missing values."""
    from hdmf.common import DynamicTable, VectorData

    # Texts are objects: in a NumPy array of a list each text takes the space of the longest.
    columns = [
        VectorData(
            name=column.heading,
            description=column.meaning,
            data=np.array(column.complete_values, object) if column.kind is str else column.complete_values,
        )
        for column in table.columns
        if any(value not in (None, "") for value in column.values)
    ]
    return DynamicTable(name=table.name, description=f"{mark}{table.meaning}", columns=columns)


def _utc(recording: Recording, instant_ns: int) -> datetime:
    """Return the date of an instant of the session clock; a SimulatedClock counts as real time."""
    creation = datetime.fromisoformat(str(recording.provenance["created_utc"]))
    clock = recording.provenance.get("clock")
    if clock is None:  # the session clock's offset to the date was not recorded, only the date of its start
        return creation
    return creation + timedelta(seconds=(instant_ns - int(clock["now_ns"])) * 1e-9 / (float(clock["factor"]) or 1.0))
