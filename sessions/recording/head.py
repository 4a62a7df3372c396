"""The head of a recording as JSON: what was simulated, plan, transducer and provenance."""

import hashlib
import json
import math
import os
import platform
import re
import sqlite3
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

import msgspec
import numpy as np

from drivers.calibration import Calibration
from drivers.clock import Clock
from drivers.transducer import StatusBit, StatusTable, TransducerInfo, bit
from sessions.file_access import as_type, json_object, read_within_limit, write_whole
from sessions.plan.plan import Origin
from sessions.recording.log import Int64, SixNumbers

_LIBRARIES = ("numpy", "scipy", "numba", "h5py", "msgspec", "matplotlib", "pyserial", "pyusb")
OPTIONAL = ("nidaqmx", "distributed")  # named where they are installed


@dataclass(frozen=True, slots=True)
class Setting:
    """A value that shaped the recording, and whether anybody chose it."""

    name: str
    value: int | float | str | bool | None
    unit: str  # "" for none
    origin: Origin


def provenance(clock: Clock, settings: Iterable[Setting] = ()) -> dict[str, Any]:
    """Return the present state of program, machine and clock, and the settings given."""
    return {
        "created_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "software": software_versions(),
        "machine": machine(),
        "clock": {
            "kind": _clock_kind(clock),
            "factor": clock.factor,
            "now_ns": clock.now_ns(),  # the session clock when created_utc was read
        },
        "settings": {
            setting.name: {"value": setting.value, "unit": setting.unit, "origin": setting.origin}
            for setting in settings
        },
    }


def without_home(address: str) -> str:
    """Return a device's address with ~ in place of the user's home, whose name is private.

    >>> without_home(f"nidaq://Dev1?cal={Path.home() / 'FT12345.cal'}").replace(os.sep, "/")
    'nidaq://Dev1?cal=~/FT12345.cal'
    """
    home = str(Path.home())
    for spelling in (home, quote(home, safe=""), quote(home)) if len(home) > 1 else ():
        # The name must end there: /home/anna is not below /home/ann.
        address = re.sub(rf"{re.escape(spelling)}(?![\w.-])", "~", address)
    return address


def _clock_kind(clock: Clock) -> str:
    if clock.factor == 1.0:
        return "the machine's monotonic clock"
    return "told: faster than the machine's clock" if clock.factor else "told: moves when it is waited on"


def machine() -> dict[str, Any]:
    """Return the kind of this machine, never its name or user."""
    return {
        "system": platform.system(),
        "release": platform.release(),
        "processor": platform.machine(),
        "cores": os.cpu_count(),
    }


def software_versions() -> dict[str, str]:
    """Return the version of this program, of Python, and of every library a number may depend on.

    `blas` and `simd` too: the last bits of a sum depend on the library and the processor's vector width.
    """
    versions = {"daq-app": installed_version("daq-app") or "not installed", "python": platform.python_version()}
    libraries = {name: installed_version(name) for name in (*_LIBRARIES, *OPTIONAL)}
    arithmetic: Any = np.show_config(mode="dicts")
    blas = arithmetic.get("Build Dependencies", {}).get("blas", {})
    simd = arithmetic.get("SIMD Extensions", {})
    return {
        **versions,
        "sqlite": sqlite3.sqlite_version,
        **{name: version for name, version in libraries.items() if version is not None},
        "blas": f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip(),
        "simd": " ".join(map(str, [*simd.get("baseline", []), *simd.get("found", [])])) or "unknown",
    }


@cache  # the metadata of one library take milliseconds to parse, and a loaded library does not change
def installed_version(name: str) -> str | None:
    """Return the version of an installed package; None without it."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


CERTIFICATE_FILE = "daq-app-selftest.json"
SELFTEST_FORMAT = {"name": "daq-app selftest", "version": 1}


def write_certificate(folder: Path, certificate: dict[str, Any]) -> Path:
    """Write the certificate where sessions recorded below `folder` find it, and return its path."""
    path = folder / CERTIFICATE_FILE
    write_whole(path, json.dumps(certificate, indent=1, allow_nan=False).encode() + b"\n")
    return path


def certificate_for(folder: Path) -> dict[str, Any] | None:
    """Return the certificate in the nearest folder above `folder` on the same disk; None where there is none.

    `same_program` is added: whether the versions of this program and its libraries are those tested.
    """
    folders = folder.absolute().parents
    disk = next((parent.stat().st_dev for parent in folders if parent.exists()), None)
    for parent in folders:
        path = parent / CERTIFICATE_FILE
        try:
            certificate = json_object(read_within_limit(path))
            if certificate["format"] != SELFTEST_FORMAT or path.stat().st_dev != disk:
                continue
            return {**certificate, "same_program": certificate["software"] == software_versions()}
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return None


class _Calibration(msgspec.Struct):
    """A calibration in the head."""

    serial: str
    raw_unit: str
    matrix: Annotated[tuple[SixNumbers, ...], msgspec.Meta(min_length=6, max_length=6)]
    rated: Annotated[tuple[float | None, ...], msgspec.Meta(min_length=6, max_length=6)]
    source: str
    sha256: str
    tool: tuple[float, ...] = ()


class _Info(msgspec.Struct):
    """A transducer in the head."""

    uri: str
    driver: str
    model: str
    serial: str
    simulated: bool
    rate: float | None
    counter_rate: float | None
    calibration: _Calibration
    settings: dict[str, str]
    harmless: Int64 = 0
    summary: Int64 = 0
    status_bits: list[StatusBit] | None = None


class _Clock(msgspec.Struct):
    factor: Annotated[float, msgspec.Meta(ge=0.0)]  # 0: the clock moves only when a wait ends
    now_ns: Int64


class _Setting(msgspec.Struct):
    value: Any


class Provenance(msgspec.Struct):
    """The parts of a provenance that the program itself uses."""

    created_utc: datetime
    software: dict[str, str]
    clock: _Clock
    machine: dict[str, Any] = {}
    settings: dict[str, _Setting] = {}
    restored_from: list[Any] = []


def simulated_sentence(info: TransducerInfo | None, subject_simulated: bool) -> str | None:
    """Return the first line of every file of a recording in which something was simulated, else None."""
    simulated = {"transducer": info is not None and info.simulated, "subject": subject_simulated}
    names = [name for name, flag in simulated.items() if flag]
    if not names:
        return None
    return f"SIMULATED: the {' and the '.join(names)} of this recording {'are' if len(names) > 1 else 'is'} simulated"


def compact_json(value: object) -> str:
    """Return `value` as compact JSON, every float exact. Raises ValueError for nan and infinities, which JSON lacks."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


_IDENTITY = ("uri", "driver", "model", "serial", "simulated")


def identity(info: TransducerInfo) -> dict[str, Any]:
    """Return the identity of a transducer and its rate [Hz]; null where that is unknown."""
    return {name: getattr(info, name) for name in _IDENTITY} | {"rate": _none_for_nan(info.rate)}


def info_to_dict(info: TransducerInfo) -> dict[str, Any]:
    """Return the transducer as plain data; null where a number is unknown (nan)."""
    calibration = info.calibration
    return {
        **identity(info),
        "counter_rate": _none_for_nan(info.counter_rate),
        "settings": dict(info.settings),
        "harmless": info.status.harmless,
        "summary": info.status.summary,
        "status_bits": [asdict(entry) for entry in info.status.bits],
        "calibration": {
            **asdict(calibration),
            "matrix": calibration.matrix.tolist(),
            "rated": [_none_for_nan(value) for value in calibration.rated.tolist()],
            "sha256": calibration_hash(calibration),
        },
    }


def info_from_dict(data: Mapping[str, Any]) -> TransducerInfo:
    """Return the transducer in `data` of `info_to_dict`. Raises ValueError for another shape or matrix hash."""
    info = as_type(data, _Info)
    stored = info.calibration
    if len(stored.tool) not in (0, 6):
        raise ValueError("the tool transform is no list of six numbers")
    calibration = Calibration(
        serial=stored.serial,
        raw_unit=stored.raw_unit,
        matrix=np.array(stored.matrix, np.float64),
        rated=np.array([_number(value) for value in stored.rated]),
        source=stored.source,
        tool=stored.tool,
    )
    if calibration_hash(calibration) != stored.sha256:
        raise ValueError("the calibration matrix is not the one its SHA-256 was taken of")
    return TransducerInfo(
        **{name: getattr(info, name) for name in _IDENTITY},
        rate=_number(info.rate),
        counter_rate=_number(info.counter_rate),
        calibration=calibration,
        settings=info.settings,
        status=_status_table(info),
    )


def _status_table(info: _Info) -> StatusTable:
    """Return the meaning of the status bits; early recordings only record which are harmless."""
    if info.status_bits is not None:
        return StatusTable(tuple(info.status_bits), info.summary)
    harmless = range(info.harmless.bit_length())
    return StatusTable(tuple(bit(n, f"bit {n}", "note") for n in harmless if info.harmless >> n & 1), info.summary)


def calibration_hash(calibration: Calibration) -> str:
    """Return the SHA-256 of the calibration matrix: 36 little-endian float64, row after row."""
    return hashlib.sha256(np.ascontiguousarray(calibration.matrix, "<f8").tobytes()).hexdigest()


def _none_for_nan(value: float) -> float | None:
    return None if math.isnan(value) else value


def _number(value: float | None) -> float:
    """Return nan for None."""
    return math.nan if value is None else value
