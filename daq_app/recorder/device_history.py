"""The history of a transducer: zeros, noise and overloads of a serial number, kept for its lifetime.

Each serial number has one append-only text file on this computer, with a JSON object per line. Simulated transducers
have none.
"""

import json
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np
import platformdirs

from drivers.transducer import TransducerInfo

Kind = Literal["zero", "overload"]


@dataclass(frozen=True, slots=True)
class Life:
    """A serial number's history in short."""

    zeros: int  # measured so far
    since: str  # day of the first one, YYYY-MM-DD; "" if there is none
    drift: tuple[float, ...]  # (6,) from the first zero to the last [N, N mm]
    noise: tuple[float, ...]  # (6,) median standard deviation at rest [N, N mm]
    overloads: int
    last_overload: str  # its day; "" if there is none


def remember_zero(info: TransducerInfo, mean: Sequence[float], spread: Sequence[float]) -> None:
    """Store a zero and its noise [raw units] as wrenches, by the current calibration."""
    matrix = info.calibration.in_own_frame(info.calibration.matrix.T).T  # independent of the present tool
    noise = np.sqrt(matrix**2 @ np.square(spread))  # gauges are assumed independent
    _add(info, "zero", {"wrench": (matrix @ np.array(mean)).tolist(), "noise": noise.tolist()})


def remember_overload(info: TransducerInfo, greatest: Sequence[float]) -> None:
    """Store an overload: the greatest loads (7,) [-], six axes and combined."""
    _add(info, "overload", {"greatest": list(greatest)})


def life_of(serial: str) -> Life | None:
    """Return the history of a serial number, without torn lines; None if it has none."""
    lines = _lines(serial)
    if not lines:
        return None
    zeros = [line for line in lines if line["kind"] == "zero"]
    overloads = [line for line in lines if line["kind"] == "overload"]
    wrenches = np.array([zero["wrench"] for zero in zeros]).reshape(-1, 6)
    noises = np.array([zero["noise"] for zero in zeros]).reshape(-1, 6)
    return Life(
        zeros=len(zeros),
        since=zeros[0]["time"][:10] if zeros else "",
        drift=tuple((wrenches[-1] - wrenches[0]).tolist()) if zeros else (),
        noise=tuple(np.median(noises, axis=0).tolist()) if zeros else (),
        overloads=len(overloads),
        last_overload=overloads[-1]["time"][:10] if overloads else "",
    )


def _add(info: TransducerInfo, kind: Kind, data: dict[str, Any]) -> None:
    if info.simulated or not info.serial:
        return
    path = _file(info.serial)
    line = json.dumps({"time": datetime.now(UTC).isoformat(timespec="seconds"), "kind": kind, **data})
    with suppress(OSError):  # a full disk must not end a session over this
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(f"\n{line}\n")  # the leading newline ends a line that a full disk cut short


def _lines(serial: str) -> list[dict[str, Any]]:
    try:
        text = _file(serial).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    return [line for line in map(_parse, text.splitlines()) if line is not None]


def _parse(text: str) -> dict[str, Any] | None:
    """Return one line of the history, None if it was cut short or has another form."""
    try:
        line = json.loads(text)
        numbers = line["wrench"] + line["noise"] if line["kind"] == "zero" else line["greatest"]
        sound = len(numbers) == (12 if line["kind"] == "zero" else 7) and np.all(np.isfinite(numbers))
    except (ValueError, TypeError, KeyError):
        return None
    return line if sound and isinstance(line.get("time"), str) else None


def _file(serial: str) -> Path:
    name = re.sub(r"[^A-Za-z0-9_-]", "_", serial)[:40]
    return Path(platformdirs.user_data_dir("daq-app", appauthor=False)) / "transducers" / f"{name}.jsonl"
