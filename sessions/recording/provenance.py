"""Where a recording came from: software, machine, clock, settings, and the self-test of its disk. Nothing personal."""

import json
import os
import platform
import sqlite3
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from drivers.clock import Clock
from sessions.atomic_file import write_whole
from sessions.file_access import read_limited
from sessions.json_document import json_object
from sessions.plan.plan import Origin

LIBRARIES = ("numpy", "scipy", "numba", "h5py", "msgspec", "matplotlib", "pyserial", "pyusb")
OPTIONAL = ("nidaqmx", "distributed")  # named where they are installed


@dataclass(frozen=True, slots=True)
class Setting:
    """A value that shaped the recording, and whether anybody chose it."""

    name: str
    value: float | str | bool | None
    unit: str  # "" for none
    origin: Origin


def provenance(clock: Clock, settings: Iterable[Setting] = ()) -> dict[str, Any]:
    """Return what is known of program, machine and clock at this moment, and the settings given."""
    return {
        "created_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "software": software_versions(),
        "machine": machine(),
        "clock": {
            "kind": _kind(clock),
            "factor": clock.factor,
            "now_ns": clock.now_ns(),  # the session clock when created_utc was read
        },
        "settings": {
            setting.name: {"value": setting.value, "unit": setting.unit, "origin": setting.origin}
            for setting in settings
        },
    }


def without_home(address: str) -> str:
    """Return a device's address with ~ in place of the user's home, whose name is nobody's business.

    >>> without_home(f"nidaq://Dev1?cal={Path.home() / 'FT12345.cal'}").replace(os.sep, "/")
    'nidaq://Dev1?cal=~/FT12345.cal'
    """
    home = str(Path.home())
    for spelling in (home, quote(home, safe=""), quote(home)):
        if len(spelling) > 1:
            address = address.replace(spelling, "~")
    return address


def _kind(clock: Clock) -> str:
    if clock.factor == 1.0:
        return "the machine's monotonic clock"
    return "told: faster than the machine's clock" if clock.factor else "told: moves when it is waited on"


def machine() -> dict[str, Any]:
    """Return the kind of machine this is, never its name or user."""
    return {
        "system": platform.system(),
        "release": platform.release(),
        "processor": platform.machine(),
        "cores": os.cpu_count(),
    }


def software_versions() -> dict[str, str]:
    """Return the version of this program, of Python, and of every library a number may depend on.

    `blas` and `simd` too: the last bits of a number depend on who adds, and on what the processor adds at once.
    """
    versions = {"daq-app": _version("daq-app") or "not installed", "python": platform.python_version()}
    libraries = {name: _version(name) for name in (*LIBRARIES, *OPTIONAL)}
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


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


CERTIFICATE_FILE = "daq-app-selftest.json"
FORMAT = {"name": "daq-app selftest", "version": 1}


def write_certificate(folder: Path, certificate: dict[str, Any]) -> Path:
    """Write the certificate where sessions recorded below `folder` find it, and return its path."""
    path = folder / CERTIFICATE_FILE
    write_whole(path, json.dumps(certificate, indent=1, allow_nan=False).encode() + b"\n")
    return path


def certificate_for(folder: Path) -> dict[str, Any] | None:
    """Return the certificate in the nearest folder above `folder` on the same disk; None where there is none.

    `same_program` is added: whether this program and its libraries are those that were tested.
    """
    places = folder.absolute().parents
    disk = next((place.stat().st_dev for place in places if place.exists()), None)
    for place in places:
        path = place / CERTIFICATE_FILE
        try:
            certificate = json_object(read_limited(path))
            if certificate["format"] != FORMAT or path.stat().st_dev != disk:
                continue
            return {**certificate, "same_program": certificate["software"] == software_versions()}
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return None
