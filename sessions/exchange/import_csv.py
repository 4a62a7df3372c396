"""A foreign recording becomes a session: every reading as the file holds it, and the file itself beside them."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.calibration import Calibration
from drivers.clock import StillClock
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.atomic_file import write_whole
from sessions.exchange.csv_columns import TIME_UNITS, Columns, ColumnsUnknown, columns
from sessions.exchange.csv_text import COMMENT, ImportRefused, cell_text, content_of, number_in, records
from sessions.plan.plan import Frame, Origin, SessionPlan
from sessions.recording.provenance import Setting, provenance
from sessions.recording.writer import SessionWriter
from sessions.strokes import ZERO_SETTING, ZERO_STATED
from sessions.toml_file import SettingsError

Array = NDArray[np.float64]

ORIGINAL_FILE = "original.csv"
RATE_TOLERANCE = 0.01  # a stated rate may differ so much from the one the file's times hold [-]
UNEVEN = 0.05  # time steps that spread more than this hold no one rate [-]
NORMALS = ("+x", "-x", "+y", "-y", "+z", "-z")
_FEWEST = 2
_SIMULATED = "SIMULATED"  # at the head of whatever came from a simulator


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """What the user states about the file; None where nothing was stated."""

    units: tuple[str, str] | None = None  # of forces and torques, such as ("N", "Nmm")
    axes: tuple[str, ...] | None = None  # what the columns are, from the first on: t Fx Fy Fz Tx Ty Tz or -
    normal: str | None = None  # axis along which pressing is positive, such as "-z"
    height: float | None = None  # of the stimulus's face above the transducer's origin [mm]
    rate: float | None = None  # readings a second [Hz]
    zeroed: bool = False  # the file's zeros are those of the unloaded transducer
    subject: str = "unknown"  # a code, never a name

    def __post_init__(self) -> None:
        """Check what can be checked without the file. Raises SettingsError."""
        if self.normal is not None and self.normal not in NORMALS:
            raise SettingsError(f'--normal "{self.normal}" is not allowed: it must be one of {", ".join(NORMALS)}')
        if self.height is not None and not math.isfinite(self.height):
            raise SettingsError(f"--height {self.height} is not allowed: it must be a number of millimetres")
        if self.rate is not None and not (math.isfinite(self.rate) and self.rate > 0.0):
            raise SettingsError(f"--rate {self.rate} is not allowed: it must be a number of readings a second above 0")


@dataclass(frozen=True, slots=True)
class Imported:
    """What an import made."""

    folder: Path
    readings: int
    rate: float  # readings a second [Hz]
    defaults: tuple[str, ...]  # values nobody stated, a sentence each
    extra: tuple[str, ...]  # columns kept in the original file alone


def import_csv(path: Path, folder: Path, options: ImportOptions | None = None) -> Imported:
    """Make a session folder of a CSV file; nothing is written before all of the file was understood.

    Raises ImportRefused for a file that cannot be taken, SettingsError for an option that is wrong or contradicts the
    file, RecordingError for a folder that cannot be written.
    """
    stated = options or ImportOptions()
    content = content_of(path)
    layout, rows, lines = _table(path, content, stated)
    time, rate, rate_origin = _times(path, layout, rows, lines, stated)
    raw = rows[:, list(layout.axes)]
    block = _block(time, raw)
    digest = hashlib.sha256(content).hexdigest()
    clock = StillClock(int(block.received_ns[-1]))
    source = {
        "file": path.name,
        "bytes": len(content),
        "sha256": digest,
        "kept_as": ORIGINAL_FILE,
        "columns": list(layout.names),
        "extra_columns": list(layout.extra),
        "first_time_s": float(rows[0, layout.time]) * TIME_UNITS[layout.time_unit] if layout.time is not None else None,
    }
    frame = Frame(
        stated.normal or Frame().normal,
        _origin(stated.normal),
        stated.height if stated.height is not None else Frame().height,
        _origin(stated.height),
    )
    writer = SessionWriter.create(
        folder,
        SessionPlan("import", stated.subject, 0, "none", (), forces=True, frame=frame),
        _info(path, layout, rate, rate_origin, stated, simulated=_says_simulated(content, layout.names)),
        {**provenance(clock, _settings(layout, frame, rate, rate_origin, stated)), "imported": source},
        clock=clock,
    )
    write_whole(folder / ORIGINAL_FILE, content)
    writer.event("started", data={"settings": {}}, time_ns=0)
    writer.event("imported", data=source, time_ns=0)
    writer.readings(block)
    writer.event("ended", data={"reason": "the file ends", "cause": "finished", "readings": len(block)})
    writer.close()
    return Imported(folder, len(block), rate, _defaults(frame), layout.extra)


def _table(path: Path, content: bytes, stated: ImportOptions) -> tuple[Columns, Array, list[int]]:
    """Return the columns, the numbers (n, columns; nan in extra ones) and the line each row stands on."""
    rest = records(path, content)
    first = next(rest, None)
    if first is None:
        raise ImportRefused(f"{path} is empty: give a CSV file with a row for each reading")
    line, cells = first
    header = None if all(number_in(cell) is not None for cell in cells) else [cell.strip() for cell in cells]
    try:
        layout = columns(header, stated.axes, stated.units, len(cells))
    except ColumnsUnknown as unknown:
        raise SettingsError(f"{path}, line {line}: {unknown}") from unknown
    body = rest if header is not None else _with(first, rest)
    used = {position: layout.names[position] for position in (*layout.axes, layout.time) if position is not None}
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, record in body:
        rows.append(_row(path, number, record, len(cells), used))
        lines.append(number)
    if len(rows) < _FEWEST:
        raise ImportRefused(f"{path} holds {len(rows)} readings: give a file with at least {_FEWEST}")
    return layout, np.array(rows), lines


def _with(first: tuple[int, list[str]], rest: Iterator[tuple[int, list[str]]]) -> Iterator[tuple[int, list[str]]]:
    yield first
    yield from rest


def _row(path: Path, line: int, cells: Sequence[str], width: int, used: dict[int, str]) -> list[float]:
    """Return a row's numbers; nan in columns that are not used."""
    if len(cells) != width:
        raise ImportRefused(
            f"{path}, line {line} has {len(cells)} columns and not {width}: complete the row, or remove it"
        )
    row = [math.nan] * width
    for position, name in used.items():
        value = number_in(cells[position])
        if value is None or not math.isfinite(value):
            cell = cell_text(cells[position])
            raise ImportRefused(f'{path}, line {line}: {name} is "{cell}", which is no number; mend or remove the row')
        row[position] = value
    return row


def _times(
    path: Path, layout: Columns, rows: Array, lines: list[int], stated: ImportOptions
) -> tuple[Array, float, Origin]:
    """Return times (n,) [s] from 0 on, the rate [Hz], and where that is from."""
    if layout.time is None:
        if stated.rate is None:
            raise SettingsError(f"{path} has no column of times: give --rate, the readings a second")
        return np.arange(len(rows)) / stated.rate, stated.rate, "set"
    time = rows[:, layout.time] * TIME_UNITS[layout.time_unit]
    steps = np.diff(time)
    if (steps <= 0.0).any():
        wrong = int(np.argmax(steps <= 0.0)) + 1
        how = "repeats" if steps[wrong - 1] == 0.0 else "lies before"
        raise ImportRefused(
            f"{path}, line {lines[wrong]}: the time {how} that of the row before; mend or remove the row"
        )
    rate = 1.0 / float(np.median(steps))
    if stated.rate is not None:
        if float(np.ptp(np.percentile(steps, [2, 98]))) * rate > UNEVEN:
            raise SettingsError(
                f"{path}: --rate {stated.rate:g} is refused, for the file's time steps are uneven "
                f"({1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms); leave --rate out and its times are taken as "
                "they are"
            )
        if abs(stated.rate / rate - 1.0) > RATE_TOLERANCE:
            raise SettingsError(
                f"{path}: --rate {stated.rate:g} is refused, for the file's times hold {rate:.4g} readings a second; "
                "leave --rate out, or name the columns with --axes so that its times are not used"
            )
    return time - time[0], rate, "measured"


def _says_simulated(content: bytes, names: Sequence[str]) -> bool:
    """Say whether a comment at the file's head, or a column, says that it came from a simulator."""
    head = [line for line in content[:4096].decode(errors="replace").splitlines() if line.startswith(COMMENT)]
    return any(_SIMULATED in layout for layout in (*head, *names))


def _block(time: Array, raw: Array) -> ReadingBlock:
    position = np.arange(len(time), dtype=np.int64)
    received = np.rint(time * 1e9).astype(np.int64)  # the file tells no other instant
    return ReadingBlock(position, position, np.zeros(len(time), np.int64), time, received, raw)


def _info(
    path: Path, layout: Columns, rate: float, rate_origin: Origin, stated: ImportOptions, *, simulated: bool
) -> TransducerInfo:
    calibration = Calibration(
        serial="unknown",
        raw_unit="N, N mm",
        matrix=np.diag(layout.scales),
        rated=np.full(6, np.nan),
        source=f"none: the file holds a wrench, forces in {layout.units[0]} and torques in {layout.units[1]}",
    )
    settings = {"rate": "from the file's times" if rate_origin == "measured" else "stated, the file has no times"}
    if stated.zeroed:
        settings[ZERO_SETTING] = ZERO_STATED
    return TransducerInfo(
        uri=f"import:{path.name}",
        driver="import",
        model="unknown (imported file)",
        serial="unknown",
        simulated=simulated,
        rate=rate,
        counter_rate=math.nan,
        calibration=calibration,
        settings=settings,
    )


def _settings(layout: Columns, frame: Frame, rate: float, rate_origin: Origin, stated: ImportOptions) -> list[Setting]:
    units: Origin = "measured" if layout.units_from == "header" else "set"
    return [
        Setting("force unit", layout.units[0], "", units),
        Setting("torque unit", layout.units[1], "", units),
        Setting("normal", frame.normal, "", frame.normal_origin),
        Setting("height", frame.height, "mm", frame.height_origin),
        Setting("rate", rate, "Hz", rate_origin),
        Setting("zero as recorded is true", stated.zeroed, "", "set" if stated.zeroed else "default"),
    ]


def _origin(stated: object) -> Origin:
    return "default" if stated is None else "set"


def _defaults(frame: Frame) -> tuple[str, ...]:
    sentences: list[str] = []
    if frame.normal_origin == "default":
        sentences.append(f"the normal force is taken along {frame.normal} (default; --normal states another)")
    if frame.height_origin == "default":
        sentences.append(f"the face's height is taken as {frame.height:g} mm (default; --height states another)")
    return tuple(sentences)
