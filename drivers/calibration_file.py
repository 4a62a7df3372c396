"""The maker's calibration file: from six gauge voltages to a wrench.

The file (`.cal`, XML) belongs to one transducer with analogue outputs. Its working matrix is
T(BasicTransform) x (Axis values / scale), as in the maker's DAQ F/T C library (ftconfig.c, version 1.0.2); newer files
(1.1) also print the product as UserAxis, to five decimals, which is checked here.
"""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from drivers.arrays import Array
from drivers.calibration import Calibration, wrench_transform
from drivers.notation import FORCE, TORQUE, number, parse_xml, unit
from drivers.transducer import SetupError

LONGEST = 64 * 1024  # a longer file is refused [bytes]; the maker's have about 3 kB
AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")

_ROUNDING = 0.5e-5  # the file's numbers have five decimals
_DISTANCE = {"mm": 1.0, "cm": 10.0, "m": 1e3, "in": 25.4, "ft": 304.8}  # millimetres in one
_ANGLE = {"degrees": math.pi / 180.0, "deg": math.pi / 180.0, "radians": 1.0, "rad": 1.0}


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationFile:
    """Content of a calibration file."""

    calibration: Calibration  # raw unit V; rated range from the file's `max`
    sha256: str  # of the file's bytes, in hexadecimal
    body: str  # of the transducer, e.g. "Nano43"
    part_number: str  # e.g. "SI-36-0.5"
    calibrated: str  # the day of calibration, as YYYY-MM-DD where the file's date is understood
    checked: bool  # the file prints its working matrix too, and both agree


def read_calibration_file(path: Path) -> CalibrationFile:
    """Read the calibration file at `path` (~: the user's home). Raises SetupError where it is invalid."""
    try:
        with path.expanduser().open("rb") as file:
            data = file.read(LONGEST + 1)
    except (OSError, ValueError, RuntimeError) as error:  # the last: an unknown home
        reason = (getattr(error, "strerror", None) or "not a file name").lower()
        raise SetupError(f"{path}: cannot be read ({reason}); check the name of the calibration file") from None
    return parse_calibration_file(data, path.name)


def parse_calibration_file(data: bytes, name: str) -> CalibrationFile:
    """Parse the bytes of a calibration file called `name`. Raises SetupError, a sentence, where they are invalid."""
    try:
        with np.errstate(all="ignore"):  # overflows are detected below
            return _parse(data, name)
    except _Unusable as why:
        raise SetupError(f"{name}: {why}; take the file as the maker delivered it for this serial number") from None


class _Unusable(Exception):
    """Why a file cannot be used; the message is the middle of a sentence."""


def _parse(data: bytes, name: str) -> CalibrationFile:
    sensor, body = _sensor_and_body(data)
    force = _unit(body, "ForceUnits", FORCE)
    torque = _unit(body, "TorqueUnits", TORQUE)
    units = np.repeat([force, torque], 3)  # N, N mm in one of the file's units
    axes = _by_name(body, "Axis")
    if len(axes) != 6:
        raise _Unusable(f"it has {len(axes)} of the six Axis elements {', '.join(AXES)}")
    scale = np.array([_above_zero(f"scale of {axis}", axes[axis].get("scale", "1")) for axis in AXES])
    rated = np.array([_above_zero(f"max of {axis}", axes[axis].get("max", "")) for axis in AXES]) * units
    transform = _transform(body)
    matrix = transform @ (_rows(axes) * (units / scale)[:, None])
    if not np.all(np.isfinite(matrix)) or np.linalg.matrix_rank(matrix) < 6:
        raise _Unusable("its six Axis rows do not make a matrix that separates forces and torques")
    user = _by_name(body, "UserAxis")
    if len(user) == 6:
        rounding = _ROUNDING * (units[:, None] + np.abs(transform) @ (units / scale)[:, None])
        _check(matrix, _rows(user) * units[:, None], rounding)
    serial, part_number, model = (
        _word(element, key) for element, key in ((sensor, "Serial"), (body, "PartNumber"), (sensor, "BodyStyle"))
    )
    if not serial:
        raise _Unusable("it names no Serial")
    day = _day(_word(body, "CalDate"))
    origin = " ".join(filter(None, (f"{name}:", model, part_number)))
    source = f"{origin}, calibrated {day}" if day else f"{origin}, day of calibration not stated"
    calibration = Calibration(serial, "V", matrix, rated, source)
    return CalibrationFile(calibration, hashlib.sha256(data).hexdigest(), model, part_number, day, len(user) == 6)


def _sensor_and_body(data: bytes) -> tuple[Element, Element]:
    """Return the sensor and calibration elements. Raises _Unusable for a file that needs computations not done here."""
    if len(data) > LONGEST:
        raise _Unusable(f"it is longer than {LONGEST} bytes, which no calibration file is")
    try:
        sensor = parse_xml(data)
    except ValueError as error:
        raise _Unusable(f"it {error}") from None
    bodies = sensor.findall("Calibration")
    if sensor.tag != "FTSensor" or len(bodies) != 1:
        raise _Unusable(f"its {sensor.tag[:20]} holds {len(bodies)} Calibration elements, not an FTSensor one")
    for element, key, readable in (
        (sensor, "Family", ("DAQ",)),
        (sensor, "NumGages", ("6",)),
        (sensor, "CalFileVersion", ("1.0", "1.1")),
        (bodies[0], "GainMultiplier", ("1",)),
    ):
        value = element.get(key, readable[0]).strip()
        if value not in readable:
            raise _Unusable(f"its {key} is {value[:20]!r}, and only {' or '.join(readable)} can be read")
    for element in sensor.iter():
        if element.tag in ("BiasSlope", "GainSlope", "Thermistor"):
            raise _Unusable(f"its {element.tag} asks for temperature compensation in software, which is not done here")
    return sensor, bodies[0]


def _by_name(body: Element, tag: str) -> dict[str, Element]:
    axes: dict[str, Element] = {}
    for element in body.findall(tag):
        axis = element.get("Name", "").strip()
        if axis not in AXES or axis in axes:
            raise _Unusable(f"its {tag} {axis[:20]!r} is double or no axis")
        axes[axis] = element
    return axes


def _rows(axes: Mapping[str, Element]) -> Array:
    """Return the six rows of numbers, shape (6, 6), in the order of AXES."""
    rows = [[number(text) for text in axes[axis].get("values", "").split()] for axis in AXES]
    for axis, row in zip(AXES, rows, strict=True):
        if len(row) != 6 or not all(math.isfinite(value) for value in row):
            raise _Unusable(f"axis {axis} has not six numbers as its values")
    return np.array(rows)


def _transform(body: Element) -> Array:
    """Return the matrix (6, 6) that moves a wrench [N, N mm] to the origin and axes that BasicTransform names."""
    transforms = body.findall("BasicTransform")
    if not transforms:
        return np.eye(6)
    if len(transforms) > 1:
        raise _Unusable("it has more than one BasicTransform")
    values = [number(transforms[0].get(key, "0")) for key in ("Dx", "Dy", "Dz", "Rx", "Ry", "Rz")]
    if not np.all(np.isfinite(values)):
        raise _Unusable("its BasicTransform is not six numbers")
    distance = _unit(body, "DistUnits", _DISTANCE)
    angle = _unit(body, "AngleUnits", _ANGLE, "degrees")
    return wrench_transform(np.array(values[:3]) * distance, np.array(values[3:]) * angle)


def _check(matrix: Array, working: Array, rounding: Array) -> None:
    """Raise where the file's own working matrix differs from the computed one by more than its rounding."""
    apart = np.abs(matrix - working) > 1.01 * rounding
    if np.any(apart):
        axis, gauge = (int(i) for i in np.argwhere(apart)[0])
        raise _Unusable(
            f"its UserAxis {AXES[axis]} says {working[axis, gauge]:.5f} for gauge {gauge} where its Axis rows give "
            f"{matrix[axis, gauge]:.5f}"
        )


def _unit(element: Element, key: str, units: Mapping[str, float], default: str = "") -> float:
    text = element.get(key, default)
    size = unit(text, units)
    if size is None:
        raise _Unusable(f"its {key} is {text[:20]!r}, and only {', '.join(units)} can be read")
    return size


def _above_zero(name: str, text: str) -> float:
    value = number(text.strip())
    if not (math.isfinite(value) and value > 0.0):
        raise _Unusable(f"the {name} is {text[:40]!r}, which must be a number above 0")
    return value


def _word(element: Element, key: str) -> str:
    """Return a short printable attribute, without blanks around it."""
    text = element.get(key, "").strip()
    if len(text) > 60 or not text.isprintable():
        raise _Unusable(f"its {key} is no name")
    return text


def _day(text: str) -> str:
    """Return a US date (month/day/year) as YYYY-MM-DD, or the text itself if it is not one.

    >>> _day("3/5/2014"), _day("spring 2014")
    ('2014-03-05', 'spring 2014')
    """
    try:
        return datetime.strptime(text, "%m/%d/%Y").date().isoformat()
    except ValueError:
        return text
