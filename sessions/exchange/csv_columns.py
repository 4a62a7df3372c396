"""Which column of a foreign CSV file is which axis, and in what unit: from its header or as stated, never guessed."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
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
    """Where the time and the six axes stand in a row, and what a unit of each is worth."""

    names: tuple[str, ...]  # of all columns, as the file or the options call them
    time: int | None  # position of the time; None where there is none
    time_unit: str
    axes: tuple[int, ...]  # positions of Fx Fy Fz Tx Ty Tz
    units: tuple[str, str]  # of forces and of torques
    units_from: str  # "header" or "set"

    @property
    def scales(self) -> tuple[float, ...]:
        """What one unit of each axis is in N or N mm."""
        force, torque = self.units
        return (FORCE_UNITS[force],) * 3 + (TORQUE_UNITS[torque],) * 3

    @property
    def extra(self) -> tuple[str, ...]:
        """Names of the columns that are neither time nor axis."""
        used = {self.time, *self.axes}
        return tuple(name for position, name in enumerate(self.names) if position not in used)


def columns(
    header: Sequence[str] | None, axes: Sequence[str] | None, units: tuple[str, str] | None, width: int
) -> Columns:
    """Return the columns of a file `width` columns wide.

    `header` is its first row, None where that holds numbers already. `axes` names the columns from the first on ("-"
    for one that is neither), and `units` those of forces and torques, as stated. Raises ColumnsUnknown.
    """
    places = dict(_stated(axes, width)) if axes is not None else dict(_headed(header))
    missing = [axis for axis in AXES if axis not in places]
    if missing:
        raise ColumnsUnknown(
            f"no column for {', '.join(missing)} is named: give --axes, such as --axes t,Fx,Fy,Fz,Tx,Ty,Tz, "
            "with - for a column that is none of these"
        )
    headed = {axis: _unit(header[places[axis]]) for axis in places} if header is not None else {}
    force = _agreed("forces", {headed.get(axis) for axis in AXES[:3]}, units[0] if units else None, FORCE_UNITS)
    torque = _agreed("torques", {headed.get(axis) for axis in AXES[3:]}, units[1] if units else None, TORQUE_UNITS)
    time_unit = headed.get(TIME) or "s"
    if time_unit not in TIME_UNITS:
        raise ColumnsUnknown(
            f'the time is in "{time_unit}", which is none of {", ".join(TIME_UNITS)}: convert the file'
        )
    names = tuple(header) if header is not None else _numbered(axes or (), width)
    stated = units is not None or axes is not None
    return Columns(
        names,
        places.get(TIME),
        time_unit,
        tuple(places[axis] for axis in AXES),
        (force, torque),
        "set" if stated else "header",
    )


def _headed(header: Sequence[str] | None) -> list[tuple[str, int]]:
    """Return axis and position of every column whose heading names one."""
    places: list[tuple[str, int]] = []
    for position, heading in enumerate(header or ()):
        match = _HEADING.match(heading.strip())
        if match is None:
            continue
        name = match[1].lower()
        axis = TIME if name in {"t", "time"} else name.replace("m", "t")[0].upper() + name[1]
        if axis in {already for already, _ in places}:
            raise ColumnsUnknown(f"two columns are headed {axis}: give --axes, with - for the one to leave out")
        places.append((axis, position))
    return places


def _stated(axes: Sequence[str], width: int) -> list[tuple[str, int]]:
    if len(axes) > width:
        raise ColumnsUnknown(f"--axes names {len(axes)} columns, but the file has {width}")
    places = [(name, position) for position, name in enumerate(axes) if name != SKIPPED]
    for name, _ in places:
        if name not in {TIME, *AXES}:
            raise ColumnsUnknown(f'--axes names "{name}", which is none of t, {", ".join(AXES)} or -')
        if [other for other, _ in places].count(name) > 1:
            raise ColumnsUnknown(f"--axes names {name} twice")
    return places


def _unit(heading: str) -> str | None:
    """Return the unit a heading names, without blanks and dots, or None."""
    match = _HEADING.match(heading.strip())
    unit = match and (match[2] or match[3])
    return re.sub(r"[\s·.*_]", "", unit)[:20] if unit else None


def _agreed(what: str, headed: set[str | None], stated: str | None, factors: Mapping[str, float]) -> str:
    """Return the one unit in which the forces, or the torques, are."""
    names = headed - {None}
    units = ", ".join(factors)
    if len(names) > 1 or (names and None in headed and stated is None):
        raise ColumnsUnknown(f"the header does not name one unit for all {what}: make the file's columns agree")
    (headed_unit,) = names or (None,)
    unit = headed_unit or stated
    if unit is None:
        raise ColumnsUnknown(f"nothing says in which unit the {what} are: give --units, such as --units N,Nmm")
    if unit not in factors:
        raise ColumnsUnknown(f'the {what} are in "{unit}", which is none of {units}')
    if stated is not None and stated != unit:
        raise ColumnsUnknown(f"the header has the {what} in {unit}, but --units says {stated}: give one of the two up")
    return unit


def _numbered(axes: Sequence[str], width: int) -> tuple[str, ...]:
    return tuple(axes[i] if i < len(axes) else f"column {i + 1}" for i in range(width))
