"""The log of a stage, or of whatever else followed the bone, beside a recording."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sessions.exchange.csv_text import ImportRefused, cell_text, content_of, number_in, records
from sessions.prediction.press_curves import DisplacementLog

DISPLACEMENT = "displacement_mm"
WIDTH = "contact_width_mm"
CLOCKS = ("time_s", "received_ns", "sequence")  # as `readings.csv` of an export calls them


def displacement_log(path: Path) -> DisplacementLog:
    """Return a stage's log from a CSV file with a header; columns that it does not need are left alone.

    Raises ImportRefused.
    """
    rows = records(path, content_of(path))
    _, header = next(rows, (0, [""]))
    names = [cell.strip() for cell in header]
    clock = next((name for name in CLOCKS if name in names), None)
    if clock is None or DISPLACEMENT not in names:
        raise ImportRefused(
            f"{path} needs a header with {DISPLACEMENT} and one of {', '.join(CLOCKS)}, as readings.csv of an export "
            f"calls them; it has {', '.join(map(cell_text, names)) or 'none'}"
        )
    places = [names.index(name) for name in (clock, DISPLACEMENT)]
    of_width = names.index(WIDTH) if WIDTH in names else None
    values: list[tuple[float, float, float]] = []
    for line, cells in rows:
        at, displacement = (_number(cells, place) for place in places)
        if not np.isfinite([at, displacement]).all():
            raise ImportRefused(f"{path}, line {line}: {clock} or {DISPLACEMENT} is no number; mend or remove the row")
        if values and at <= values[-1][0]:
            raise ImportRefused(f"{path}, line {line}: {clock} does not grow; mend or remove the row")
        width = np.nan if of_width is None else _number(cells, of_width)
        if width <= 0.0:
            raise ImportRefused(f"{path}, line {line}: {WIDTH} is not above 0; leave the cell empty without a contact")
        values.append((at, displacement, width))
    if len(values) < 2:
        raise ImportRefused(f"{path} holds {len(values)} rows: give a log with at least 2")
    return DisplacementLog(clock, *np.array(values).T)


def _number(cells: Sequence[str], place: int) -> float:
    value = number_in(cells[place]) if place < len(cells) else None
    return np.nan if value is None else value
