"""JSON that a damaged or foreign file may hold: an object of plain values, or a ValueError that says why not."""

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any, NoReturn, TypeVar, cast

import msgspec

T = TypeVar("T")


def json_object(text: str | bytes) -> dict[str, Any]:
    """Return the object in a JSON text. Raises ValueError for anything else, nan and nesting without end included."""
    value = json_value(text)
    if not isinstance(value, dict):
        raise ValueError("it holds no names")
    return cast("dict[str, Any]", value)


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


def converted(value: object, form: type[T]) -> T:
    """Return plain data as the type `form`. Raises ValueError that says where it is of another kind, and which."""
    try:
        return msgspec.convert(value, form)
    except msgspec.ValidationError as error:
        raise ValueError(str(error).replace("`$.", "`")) from error


def complete(document: Mapping[str, Any], form: type[T]) -> T:
    """Return a document that the program wrote itself, as the type `form`.

    A name may be missing only where nothing is known under it. Raises ValueError as `converted` does.
    """
    typed = converted(document, form)
    for name in _missing(document, msgspec.to_builtins(typed)):
        raise ValueError(f"Object missing required field `{name}`")
    return typed


def _missing(document: object, complete: object, where: str = "") -> Iterator[str]:
    """Yield the path of each name that `document` lacks and for which `complete` has a default other than None."""
    if isinstance(complete, list | tuple):
        for at, (part, item) in enumerate(zip(cast("list[Any]", document), cast("list[Any]", complete), strict=True)):
            yield from _missing(part, item, f"{where}[{at}]")
    elif isinstance(complete, dict):
        part = cast("Mapping[str, Any]", document)
        for name, item in cast("dict[str, Any]", complete).items():
            path = f"{where}.{name}" if where else name
            if name in part:
                yield from _missing(part[name], item, path)
            elif item is not None:
                yield path
