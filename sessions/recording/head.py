"""What stands at the head of a recording: is it simulated, the plan, the transducer, where it came from; as JSON."""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime
from typing import Annotated, Any, TypeAlias

import msgspec
import numpy as np

from drivers.calibration import Calibration
from drivers.transducer import StatusBit, StatusTable, TransducerInfo, bit
from sessions.json_document import converted
from sessions.plan.plan import SessionPlan

_Row: TypeAlias = tuple[float, float, float, float, float, float]
_Word: TypeAlias = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]  # a status word as `ReadingBlock` holds it


class _Calibration(msgspec.Struct):
    """A calibration as the head holds it."""

    serial: str
    raw_unit: str
    matrix: tuple[_Row, _Row, _Row, _Row, _Row, _Row]
    rated: Annotated[tuple[float | None, ...], msgspec.Meta(min_length=6, max_length=6)]
    source: str
    sha256: str
    tool: tuple[float, ...] = ()


class _Info(msgspec.Struct):
    """A transducer as the head holds it."""

    uri: str
    driver: str
    model: str
    serial: str
    simulated: bool
    rate: float | None
    counter_rate: float | None
    calibration: _Calibration
    settings: dict[str, str]
    harmless: _Word = 0
    summary: _Word = 0
    status_bits: list[StatusBit] | None = None


class _Clock(msgspec.Struct):
    factor: Annotated[float, msgspec.Meta(ge=0.0)]  # 0: the clock moves when it is waited on
    now_ns: _Word


class _Setting(msgspec.Struct):
    value: Any


class _Provenance(msgspec.Struct):
    """The parts of a provenance that the program itself uses."""

    created_utc: datetime
    software: dict[str, str]
    clock: _Clock
    machine: dict[str, Any] = {}
    settings: dict[str, _Setting] = {}
    restored_from: list[Any] = []


def check_provenance(data: object) -> None:
    """Raise ValueError where a provenance is of another shape than this program writes."""
    converted(data, _Provenance)


def simulated_sentence(info: TransducerInfo | None, subject_simulated: bool) -> str | None:
    """Return the line that heads every file of a recording in which something was simulated, else None."""
    parts = [
        name
        for name, simulated in (("transducer", info is not None and info.simulated), ("subject", subject_simulated))
        if simulated
    ]
    if not parts:
        return None
    return f"SIMULATED: the {' and the '.join(parts)} of this recording {'are' if len(parts) > 1 else 'is'} simulated"


def json_text(value: object) -> str:
    """Return `value` as compact JSON in which every float survives to the last bit.

    Raises ValueError for nan and infinities: JSON has none.
    """
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


_IDENTITY = ("uri", "driver", "model", "serial", "simulated")


def plan_to_dict(plan: SessionPlan) -> dict[str, Any]:
    """Return the plan as plain data."""
    return msgspec.to_builtins(plan)


def plan_from_dict(data: Mapping[str, Any]) -> SessionPlan:
    """Return the plan that `plan_to_dict` gave `data` for. Raises ValueError for another shape."""
    return converted(data, SessionPlan)


def identity(info: TransducerInfo) -> dict[str, Any]:
    """Return what tells a transducer from others, and its rate [Hz]; null where that is unknown."""
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
            "serial": calibration.serial,
            "raw_unit": calibration.raw_unit,
            "matrix": calibration.matrix.tolist(),
            "rated": [_none_for_nan(value) for value in calibration.rated.tolist()],
            "source": calibration.source,
            "tool": list(calibration.tool),
            "sha256": calibration_hash(calibration),
        },
    }


def info_from_dict(data: Mapping[str, Any]) -> TransducerInfo:
    """Return the transducer that `info_to_dict` gave `data` for.

    Raises ValueError for another shape, and when the matrix is not the one its hash was taken of.
    """
    info = converted(data, _Info)
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
    """Return what the bits of a status mean; early recordings only say which are harmless."""
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
