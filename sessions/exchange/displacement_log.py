"""The log of a stage, or of whatever else followed the bone, beside a recording."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sessions.exchange.csv_rows import ImportRefused, number_in, records, shown
from sessions.file_access import LARGEST_TABLE, read_limited, remedy

Array = NDArray[np.float64]

DISPLACEMENT = "displacement_mm"
CLOCKS = ("time_s", "received_ns", "sequence")  # as `readings.csv` of an export calls them


@dataclass(frozen=True, slots=True, eq=False)
class DisplacementLog:
    """Where a stage stood; n rows in order of time."""

    clock: str  # one of CLOCKS: what `at` counts
    at: Array  # (n,) [s], [ns] or readings, growing
    displacement: Array  # (n,) positive into the finger, from anywhere [mm]


def displacement_log(path: Path) -> DisplacementLog:
    """Return a stage's log from a CSV file with a header; columns that it does not need are left alone.

    Raises ImportRefused.
    """
    try:
        content = read_limited(path, LARGEST_TABLE)
    except OSError as error:
        raise ImportRefused(f"{path} cannot be read ({error.strerror}); {remedy(error)}, a CSV file") from error
    rows = records(path, content)
    _, header = next(rows, (0, [""]))
    names = [cell.strip() for cell in header]
    clock = next((name for name in CLOCKS if name in names), None)
    if clock is None or DISPLACEMENT not in names:
        raise ImportRefused(
            f"{path} needs a header with {DISPLACEMENT} and one of {', '.join(CLOCKS)}, as readings.csv of an export "
            f"calls them; it has {', '.join(map(shown, names)) or 'none'}"
        )
    places = (names.index(clock), names.index(DISPLACEMENT))
    values: list[tuple[float, float]] = []
    for line, cells in rows:
        pair = [number_in(cells[place]) if place < len(cells) else None for place in places]
        if pair[0] is None or pair[1] is None or not np.isfinite([pair[0], pair[1]]).all():
            raise ImportRefused(f"{path}, line {line}: {clock} or {DISPLACEMENT} is no number; mend or remove the row")
        if values and pair[0] <= values[-1][0]:
            raise ImportRefused(f"{path}, line {line}: {clock} does not grow; mend or remove the row")
        values.append((pair[0], pair[1]))
    if len(values) < 2:
        raise ImportRefused(f"{path} holds {len(values)} rows: give a log with at least 2")
    at, displacement = np.array(values).T
    return DisplacementLog(clock, at, displacement)
