"""Import of a foreign CSV file as a session: columns from header or options, every reading, the original file."""

import hashlib
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivers.arrays import Array
from drivers.calibration import Calibration
from drivers.calibration_file import AXES
from drivers.clock import StillClock
from drivers.nidaq import HIGHEST_RATE, LOWEST_RATE
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.exchange.csv_text import COMMENT, ImportRefused, cell_text, content_of, mend_row, number_in, records
from sessions.file_access import write_whole
from sessions.plan.plan import NORMALS, Frame, Origin, SessionPlan
from sessions.plan.protocols.protocol import HEIGHTS
from sessions.plan.study import check_code
from sessions.recording.head import Setting, provenance
from sessions.recording.writer import SessionWriter
from sessions.strokes import ZERO_SETTING, ZERO_STATED
from sessions.toml_file import SettingsError, check_range

TIME = "t"
SKIPPED = "-"

FORCE_UNITS: Mapping[str, float] = {"N": 1.0, "mN": 1e-3, "kN": 1e3}  # to N
TORQUE_UNITS: Mapping[str, float] = {"Nmm": 1.0, "mNm": 1.0, "Ncm": 10.0, "Nm": 1e3}  # to N mm
TIME_UNITS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6}  # to s

_HEADING = re.compile(r"(t|time|[FTM][xyz])(?:$|[\s_]*[\[(]\s*(.+?)\s*[\])]$|[\s_]+(\S.*)$)", re.IGNORECASE)


class ColumnsUnknown(ValueError):
    """The columns cannot be identified; the message says what is missing and what to give."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Positions of the time and the six axes in a row, and their units."""

    names: tuple[str, ...]  # of all columns, from the file or the options
    time: int | None  # position of the time; None without one
    time_unit: str
    axes: tuple[int, ...]  # positions of Fx Fy Fz Tx Ty Tz
    units: tuple[str, str]  # of forces and of torques
    units_origin: Origin

    @property
    def extra(self) -> tuple[str, ...]:
        """Names of the columns that are neither time nor axis."""
        identified = {self.time, *self.axes}
        return tuple(name for position, name in enumerate(self.names) if position not in identified)

    @property
    def renamed(self) -> tuple[str, ...]:
        """What --axes reads otherwise than the header names it, such as "Fz_N as Fy"."""
        identified = zip((TIME, *AXES), (self.time, *self.axes), strict=True)
        headed = [(axis, self.names[position]) for axis, position in identified if position is not None]
        return tuple(f"{name} as {axis}" for axis, name in headed if _heading(name)[0] not in (axis, SKIPPED))


def columns(
    header: Sequence[str] | None, axes: Sequence[str] | None, units: tuple[str, str] | None, width: int
) -> Columns:
    """Return the columns of a file `width` columns wide.

    `header` is its first row, None where that holds numbers. `axes` names the columns from the first on ("-" for one
    that is neither), and `units` those of forces and torques, as stated by the user. Raises ColumnsUnknown.
    """
    headings = [_heading(cell) for cell in header or ()]
    if axes is not None and len(axes) > width:
        raise ColumnsUnknown(f"--axes names {len(axes)} columns, but the file has {width}")
    positions: dict[str, int] = {}
    for position, name in enumerate([axis for axis, _ in headings] if axes is None else axes):
        if name == SKIPPED:
            continue
        if name not in {TIME, *AXES}:
            raise ColumnsUnknown(f'--axes names "{name}", which is none of t, {", ".join(AXES)} or -')
        if name in positions:
            problem = f"two columns are headed {name}: give --axes, with - for the one to leave out"
            raise ColumnsUnknown(problem if axes is None else f"--axes names {name} twice")
        positions[name] = position
    missing_axes = [axis for axis in AXES if axis not in positions]
    if missing_axes:
        raise ColumnsUnknown(
            f"no column for {', '.join(missing_axes)} is named: give --axes, such as --axes t,Fx,Fy,Fz,Tx,Ty,Tz, "
            "with - for a column that is none of these"
        )
    header_units = {axis: headings[position][1] for axis, position in positions.items()} if headings else {}
    of_force, of_torque = units or (None, None)
    force = _common_unit("forces", {header_units.get(axis) for axis in AXES[:3]}, of_force, FORCE_UNITS)
    torque = _common_unit("torques", {header_units.get(axis) for axis in AXES[3:]}, of_torque, TORQUE_UNITS)
    time_unit = header_units.get(TIME) or "s"
    if time_unit not in TIME_UNITS:
        raise ColumnsUnknown(
            f'the time is in "{time_unit}", which is none of {", ".join(TIME_UNITS)}: convert the file'
        )
    stated_names = [*(axes or ()), *(f"column {i + 1}" for i in range(len(axes or ()), width))]
    return Columns(
        tuple(stated_names if header is None else header),
        positions.get(TIME),
        time_unit,
        tuple(positions[axis] for axis in AXES),
        (force, torque),
        "measured" if units is None and axes is None else "set",
    )


def _heading(cell: str) -> tuple[str, str | None]:
    """Return the axis of a heading, and its unit without blanks and dots, None without a unit.

    >>> _heading("Mz [N m]"), _heading("time"), _heading("remark")
    (('Tz', 'Nm'), ('t', None), ('-', None))
    """
    match = _HEADING.match(cell.strip())
    if match is None:
        return SKIPPED, None
    name, unit = match[1].lower(), match[2] or match[3]
    axis = TIME if name in {"t", "time"} else name.replace("m", "t")[0].upper() + name[1]
    return axis, re.sub(r"[\s·.*_]", "", unit)[:20] if unit else None


def _common_unit(quantity: str, header_units: set[str | None], option: str | None, factors: Mapping[str, float]) -> str:
    """Return the common unit of the forces, or of the torques."""
    names = header_units - {None}
    units = ", ".join(factors)
    if len(names) > 1 or (names and None in header_units and option is None):
        unit_names = " and ".join(f'"{name}"' if name else "no unit" for name in sorted(header_units, key=str))
        raise ColumnsUnknown(f"the header has {unit_names} for the {quantity}: convert the columns to one of {units}")
    (headed_unit,) = names or (None,)
    unit = headed_unit or option
    if unit is None:
        raise ColumnsUnknown(f"the unit of the {quantity} is not stated: give --units, such as --units N,Nmm")
    if unit not in factors:
        raise ColumnsUnknown(f'the {quantity} are in "{unit}", which is none of {units}')
    if option is not None and option != unit:
        difference = f"the header has the {quantity} in {unit}, but --units says {option}"
        raise ColumnsUnknown(f"{difference}: leave out one of the two")
    return unit


ORIGINAL_FILE = "original.csv"
RATE_TOLERANCE = 0.01  # relative difference allowed between a stated rate and the rate of the file's times [-]
UNEVEN = 0.05  # relative spread of time steps from which there is no single rate [-]
_FEWEST = 2
_LONGEST = 9e9  # of a recording [s]: a session's clock counts nanoseconds in 64 bits
FASTEST = 10.0 * HIGHEST_RATE  # readings a second [Hz]: ten times the fastest supported device
GREATEST = 1e18  # of a time, force or torque: a thousand times the microseconds since 1970, and no product overflows
_SIMULATED = "SIMULATED"  # at the head of files from a simulator


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """What the user states about the file; None where nothing was stated."""

    units: tuple[str, str] | None = None  # of forces and torques, such as ("N", "Nmm")
    axes: tuple[str, ...] | None = None  # the columns, from the first on: t Fx Fy Fz Tx Ty Tz or -
    normal: str | None = None  # axis along which pressing is positive, such as "-z"
    height: float | None = None  # of the stimulus's face above the transducer's origin [mm]
    rate: float | None = None  # readings a second [Hz]
    zeroed: bool = False  # zero in the file is the unloaded transducer
    subject: str = "unknown"  # a code, never a name

    def __post_init__(self) -> None:
        """Check the options that do not depend on the file. Raises SettingsError."""
        if self.normal is not None and self.normal not in NORMALS:
            raise SettingsError(f'--normal "{self.normal}" is not allowed: it must be one of {", ".join(NORMALS)}')
        check_range("--height", self.height, *HEIGHTS, "mm")
        check_code("--subject", self.subject)
        if self.rate is not None and not 0.0 < self.rate <= FASTEST:
            raise SettingsError(
                f"--rate {self.rate} is not allowed: above 0, and at most {FASTEST:.0f} readings a second"
            )


@dataclass(frozen=True, slots=True)
class ImportResult:
    """The imported session, and the assumptions made."""

    folder: Path
    readings: int
    rate: float  # readings a second [Hz]
    defaults: tuple[str, ...]  # values nobody stated, a sentence each
    extra: tuple[str, ...]  # columns kept only in the original file
    renamed: tuple[str, ...] = ()  # columns read as another axis than their heading names
    doubt: str | None = None  # about the rate


def import_csv(path: Path, folder: Path, options: ImportOptions | None = None) -> ImportResult:
    """Make a session folder from a CSV file; nothing is written before the whole file is parsed.

    Raises ImportRefused for the file, SettingsError for an option against it, RecordingError for an unwritable folder.
    """
    options = options or ImportOptions()
    content = content_of(path)
    layout, rows, lines = _table(path, content, options)
    time, rate, rate_origin = _times(path, layout, rows, lines, options)
    if rate > FASTEST:
        raise ImportRefused(
            f"{path}: its times hold {rate:.3g} readings a second, more than any device gives ({FASTEST:.0f}); name "
            f"the time's unit in the header ({', '.join(TIME_UNITS)})"
        )
    if time[-1] > _LONGEST:
        raise ImportRefused(
            f"{path}: its readings span {time[-1]:.3g} s, more than a session can ({_LONGEST:g} s); name the time's "
            f"unit in the header ({', '.join(TIME_UNITS)}), or give a higher --rate"
        )
    position = np.arange(len(time), dtype=np.int64)
    received = np.rint(time * 1e9).astype(np.int64)  # the file holds no other instant
    block = ReadingBlock(position, position, np.zeros(len(time), np.int64), time, received, rows[:, list(layout.axes)])
    clock = StillClock(int(block.received_ns[-1]))
    source = {
        "file": path.name,
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
        "kept_as": ORIGINAL_FILE,
        "columns": list(layout.names),
        "extra_columns": list(layout.extra),
        "renamed_columns": list(layout.renamed),
        "first_time_s": float(rows[0, layout.time]) * TIME_UNITS[layout.time_unit] if layout.time is not None else None,
    }
    frame = Frame().with_values(options.normal, options.height)
    writer = SessionWriter.create(
        folder,
        SessionPlan("import", options.subject, 0, "none", (), forces=True, frame=frame),
        _info(path, layout, rate, rate_origin, options, simulated=_says_simulated(content, layout.names)),
        {**provenance(clock, _settings(layout, frame, rate, rate_origin, options)), "imported": source},
        clock=clock,
    )
    write_whole(folder / ORIGINAL_FILE, content)
    writer.event("started", data={"settings": {}}, time_ns=0)
    writer.event("imported", data=source, time_ns=0)
    writer.readings(block)
    writer.event("ended", data={"reason": "the file ends", "cause": "finished", "readings": len(block)})
    writer.close()
    doubt = _doubt_of_rate(path, layout, rate)
    return ImportResult(folder, len(block), rate, _defaults(frame), layout.extra, layout.renamed, doubt)


def _table(path: Path, content: bytes, options: ImportOptions) -> tuple[Columns, Array, list[int]]:
    """Return the columns, the numbers (n, columns; nan in extra ones) and the line number of each row."""
    following = records(path, content)
    first_record = next(following, None)
    if first_record is None:
        raise ImportRefused(f"{path} is empty: give a CSV file with a row for each reading")
    line, cells = first_record
    header = None if all(number_in(cell) is not None for cell in cells) else [cell.strip() for cell in cells]
    try:
        layout = columns(header, options.axes, options.units, len(cells))
    except ColumnsUnknown as unknown:
        raise SettingsError(f"{path}, line {line}: {unknown}") from unknown
    body = following if header is not None else itertools.chain([first_record], following)
    identified = (*layout.axes, layout.time)
    column_names = {position: layout.names[position] for position in identified if position is not None}
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, record in body:
        rows.append(_row(path, number, record, len(cells), column_names))
        lines.append(number)
    if len(rows) < _FEWEST:
        raise ImportRefused(f"{path} holds fewer than {_FEWEST} readings: give the file of a whole recording")
    return layout, np.array(rows), lines


def _row(path: Path, line: int, cells: Sequence[str], width: int, column_names: dict[int, str]) -> list[float]:
    """Return a row's numbers; nan in unused columns."""
    if len(cells) != width:
        raise ImportRefused(
            f"{path}, line {line} has {len(cells)} columns and not {width}: complete the row, or remove it"
        )
    row = [math.nan] * width
    for position, name in column_names.items():
        value = number_in(cells[position])
        if value is None or not abs(value) <= GREATEST:
            cell = cell_text(cells[position])
            problem = f'{name} is "{cell}", which is no number that a device gives'
            raise ImportRefused(f"{path}, line {line}: {problem}; {mend_row(cell)}")
        row[position] = value
    return row


def _times(
    path: Path, layout: Columns, rows: Array, lines: list[int], options: ImportOptions
) -> tuple[Array, float, Origin]:
    """Return times (n,) [s] from 0 on, the rate [Hz], and its origin."""
    if layout.time is None:
        if options.rate is None:
            raise SettingsError(f"{path} has no column of times: give --rate, the readings a second")
        return np.arange(len(rows)) / options.rate, options.rate, "set"
    time = rows[:, layout.time] * TIME_UNITS[layout.time_unit]
    steps = np.diff(time)
    if (steps <= 0.0).any():
        row = int(np.argmax(steps <= 0.0)) + 1
        relation = "repeats" if steps[row - 1] == 0.0 else "lies before"
        raise ImportRefused(
            f"{path}, line {lines[row]}: the time {relation} that of the row before; correct or remove the row"
        )
    rate = 1.0 / float(np.median(steps))
    if options.rate is not None:
        if float(np.ptp(np.percentile(steps, [2, 98]))) * rate > UNEVEN:
            raise SettingsError(
                f"{path}: --rate {options.rate:g} is refused, as the file's time steps are uneven "
                f"({1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms); leave --rate out and its times are taken as "
                "they are"
            )
        if abs(options.rate / rate - 1.0) > RATE_TOLERANCE:
            raise SettingsError(
                f"{path}: --rate {options.rate:g} is refused, as the file's times, taken as {layout.time_unit}, hold "
                f"{rate:.6g} readings a second; leave --rate out, correct their unit in the header, or name the "
                "columns with --axes so that its times are not used"
            )
    return time - time[0], rate, "measured"


def _doubt_of_rate(path: Path, layout: Columns, rate: float) -> str | None:
    """Return a sentence about a rate that no supported device has; all others lie within the range of `nidaq://`."""
    if LOWEST_RATE * (1.0 - RATE_TOLERANCE) <= rate <= HIGHEST_RATE * (1.0 + RATE_TOLERANCE):
        return None
    limit = f"more than any supported device's {HIGHEST_RATE}"
    if rate < LOWEST_RATE:
        limit = f"fewer than any supported device's {LOWEST_RATE}"
    source, remedy = "--rate states", "give the right --rate"
    if layout.time is not None:
        source, remedy = f"its times, taken as {layout.time_unit}, hold", "correct their unit in the header"
    return f"{path}: {source} {rate:.6g} readings a second, {limit}: if that is wrong, {remedy} and import again"


def _says_simulated(content: bytes, names: Sequence[str]) -> bool:
    """Say whether a comment at the file's head, or a column name, marks it as simulated."""
    comments = [line for line in content[:4096].decode(errors="replace").splitlines() if line.startswith(COMMENT)]
    return any(_SIMULATED in text for text in (*comments, *names))


def _info(
    path: Path, layout: Columns, rate: float, rate_origin: Origin, options: ImportOptions, *, simulated: bool
) -> TransducerInfo:
    force, torque = layout.units
    calibration = Calibration(
        serial="unknown",
        raw_unit="N, N mm",
        matrix=np.diag(np.repeat([FORCE_UNITS[force], TORQUE_UNITS[torque]], 3)),
        rated=np.full(6, np.nan),
        source=f"none: the file holds a wrench, forces in {force} and torques in {torque}",
    )
    settings = {"rate": "from the file's times" if rate_origin == "measured" else "stated, the file has no times"}
    if options.zeroed:
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


def _settings(layout: Columns, frame: Frame, rate: float, rate_origin: Origin, options: ImportOptions) -> list[Setting]:
    return [
        Setting("force unit", layout.units[0], "", layout.units_origin),
        Setting("torque unit", layout.units[1], "", layout.units_origin),
        Setting("normal", frame.normal, "", frame.normal_origin),
        Setting("height", frame.height, "mm", frame.height_origin),
        Setting("rate", rate, "Hz", rate_origin),
        Setting("zero as recorded is true", options.zeroed, "", "set" if options.zeroed else "default"),
    ]


def _defaults(frame: Frame) -> tuple[str, ...]:
    normal = f"the normal force is taken along {frame.normal} (default; --normal states another)"
    height = f"the face's height is taken as {frame.height:g} mm (default; --height states another)"
    assumptions = ((frame.normal_origin, normal), (frame.height_origin, height))
    return tuple(sentence for origin, sentence in assumptions if origin == "default")
