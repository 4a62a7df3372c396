"""JSON that a damaged or foreign file may hold: an object of plain values, or a ValueError that says why not."""

import json
import math
from typing import Any, NoReturn, cast


def json_object(text: str | bytes) -> dict[str, Any]:
    """Return the object in a JSON text. Raises ValueError for anything else, nan and nesting without end included."""
    found = json_value(text)
    if not isinstance(found, dict):
        raise ValueError("it holds no names")
    return cast("dict[str, Any]", found)


def json_value(text: str | bytes) -> object:
    """Return the value in a JSON text. Raises ValueError for what is no JSON, nan and nesting without end included."""
    try:
        return json.loads(text, parse_constant=_no_number, parse_float=_finite)
    except RecursionError as error:
        raise ValueError("lists or objects are nested too deep") from error


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number that this program stores")


def _finite(text: str) -> float:
    number = float(text)
    return number if math.isfinite(number) else _no_number(text)
