"""What stands at the head of a recording: is it simulated, the plan, the transducer, where it came from; as JSON."""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import msgspec
import numpy as np

from drivers.calibration import Calibration
from drivers.status import StatusBit, StatusTable, bit
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan


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


def plan_to_dict(plan: SessionPlan) -> dict[str, Any]:
    """Return the plan as plain data."""
    return msgspec.to_builtins(plan)


def plan_from_dict(data: Mapping[str, Any]) -> SessionPlan:
    """Return the plan that `plan_to_dict` gave `data` for."""
    return msgspec.convert(data, SessionPlan)


def info_to_dict(info: TransducerInfo) -> dict[str, Any]:
    """Return the transducer as plain data; null where a number is unknown (nan)."""
    calibration = info.calibration
    return {
        "uri": info.uri,
        "driver": info.driver,
        "model": info.model,
        "serial": info.serial,
        "simulated": info.simulated,
        "rate": _known(info.rate),
        "counter_rate": _known(info.counter_rate),
        "settings": dict(info.settings),
        "harmless": info.status.harmless,
        "summary": info.status.summary,
        "status_bits": [asdict(entry) for entry in info.status.bits],
        "calibration": {
            "serial": calibration.serial,
            "raw_unit": calibration.raw_unit,
            "matrix": calibration.matrix.tolist(),
            "rated": [_known(value) for value in calibration.rated.tolist()],
            "source": calibration.source,
            "tool": list(calibration.tool),
            "sha256": calibration_hash(calibration),
        },
    }


def info_from_dict(data: Mapping[str, Any]) -> TransducerInfo:
    """Return the transducer that `info_to_dict` gave `data` for.

    Raises ValueError when the matrix is not the one its hash was taken of.
    """
    told = data["calibration"]
    calibration = Calibration(
        serial=told["serial"],
        raw_unit=told["raw_unit"],
        matrix=np.array(told["matrix"], np.float64),
        rated=np.array([_number(value) for value in told["rated"]]),
        source=told["source"],
        tool=tuple(told.get("tool", ())),
    )
    if calibration_hash(calibration) != told["sha256"]:
        raise ValueError("the calibration matrix is not the one its SHA-256 was taken of")
    return TransducerInfo(
        uri=data["uri"],
        driver=data["driver"],
        model=data["model"],
        serial=data["serial"],
        simulated=data["simulated"],
        rate=_number(data["rate"]),
        counter_rate=_number(data["counter_rate"]),
        calibration=calibration,
        settings=dict(data["settings"]),
        status=_status_table(data),
    )


def _status_table(data: Mapping[str, Any]) -> StatusTable:
    """Return what the bits of a status mean; early recordings only tell which are harmless."""
    told = data.get("status_bits")
    if told is None:
        harmless = int(data.get("harmless", 0))
        bits = tuple(bit(n, f"bit {n}", "note") for n in range(harmless.bit_length()) if harmless >> n & 1)
    else:
        bits = tuple(msgspec.convert(entry, StatusBit) for entry in told)
    return StatusTable(bits, int(data.get("summary", 0)))


def calibration_hash(calibration: Calibration) -> str:
    """Return the SHA-256 of the calibration matrix: 36 little-endian float64, row after row."""
    return hashlib.sha256(np.ascontiguousarray(calibration.matrix, "<f8").tobytes()).hexdigest()


def _known(value: float) -> float | None:
    """Return None for nan."""
    return None if math.isnan(value) else value


def _number(value: float | None) -> float:
    """Return nan for None."""
    return math.nan if value is None else value
