"""TOML to frozen dataclasses and back; a wrong value gives one sentence with what is allowed."""

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from datetime import date, time
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec
from msgspec import inspect

from sessions.file_access import LARGEST_TEXT, name_failure, read_within_limit

T = TypeVar("T")
_type_info = cache(inspect.type_info)  # as slow as reading a protocol


class SettingsError(ValueError):
    """A value in a file given by the user is wrong; the message names file, key, value and what is allowed."""


class NotAllowed(SettingsError):
    """A value out of range; raised by a dataclass that checks its fields on creation."""

    def __init__(self, key: str, value: object, allowed: str) -> None:
        """Name the `key` as the file does, the `value` found, and what is `allowed`."""
        super().__init__(f"{key} = {value!r} is not allowed: {allowed}")
        self.key = key
        self.value = value
        self.allowed = allowed


def check(condition: bool, key: str, value: object, allowed: str) -> None:
    """Raise NotAllowed for a value that does not meet a condition; `allowed` says what does."""
    if not condition:
        raise NotAllowed(key, value, allowed)


def check_range(key: str, value: float | None, low: float, high: float, unit: str = "") -> None:
    """Raise NotAllowed for a value outside of [low, high]; None passes."""
    if value is not None and not low <= value <= high:
        raise NotAllowed(key, value, f"it must lie between {low} and {high} {unit}".rstrip())


def check_text(key: str, text: str) -> None:
    """Raise NotAllowed for a blank text."""
    if not text.strip():
        raise NotAllowed(key, text, "it must not be empty")


def check_scale_ends(ends: tuple[str, str] | None) -> None:
    """Raise NotAllowed where an end of a line has no name; `ends` is None where there is no line."""
    if ends is not None and not all(end.strip() for end in ends):
        raise NotAllowed("scale_ends", list(ends), "both ends of the scale must be named")


def load_toml(path: Path, cls: type[T]) -> T:
    """Return the dataclass that a TOML file describes. Raises OSError, and SettingsError for anything wrong in it."""
    return from_toml(text_of(path), cls, str(path))


def text_of(path: Path) -> str:
    """Return the text of a TOML file, which may be a pipe. Raises as `load_toml` does."""
    if path.is_dir() or not path.exists():
        problem = "this is a folder" if path.is_dir() else "there is no such file"
        raise FileNotFoundError(f"{path}: {problem}; give the path of a TOML file")
    with name_failure(OSError, f"{path} cannot be read"):
        content = read_within_limit(path, LARGEST_TEXT)
    try:
        return content.decode("utf-8-sig")  # some editors begin a file with a mark
    except UnicodeDecodeError as error:
        raise SettingsError(f"{path}: byte {error.start} is no UTF-8 text; save the file as UTF-8") from error


def from_toml(text: str, cls: type[T], where: str, instead: Mapping[str, Any] | None = None) -> T:
    """Return the dataclass that a TOML text describes; `where` names it in messages. Raises SettingsError.

    Tables and values in `instead` replace those of the text, or add to them.
    """
    try:
        return from_table({**tables_in(text, where), **(instead or {})}, cls, where)
    except _Wrong as wrong:
        line = _line_number(text, wrong.key)
        raise SettingsError(f"{where}{f', line {line}' if line else ''}: {wrong.sentence}") from wrong


_COMMA = re.compile(r"^[^#\"'\n]*=[ \t]*([+-]?\d+,\d+)[ \t]*(?:#.*)?$", re.MULTILINE)  # before a fraction


def tables_in(text: str, where: str) -> dict[str, Any]:
    """Return the tables of a TOML text; `where` names it in messages. Raises SettingsError."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        number = _COMMA.search(text)
        comma = f"; use a decimal point in {number[1]}" if number else ""
        raise SettingsError(f"{where}: this is not TOML: {error}; correct it there{comma}") from error
    except RecursionError as error:
        raise SettingsError(f"{where}: lists or tables are nested too deep; write it with fewer brackets") from error
    except ValueError as error:  # Python's limit, 4300 by default
        raise SettingsError(f"{where}: a whole number has thousands of digits; shorten it") from error


def from_table(table: Mapping[str, Any], cls: type[T], where: str) -> T:
    """Return the dataclass that a table describes; `where` names its source in messages.

    Unknown keys are refused, a whole number is taken for one with a fraction, true and false are no numbers, nan and
    infinity are refused. Raises SettingsError.
    """
    places = {key: (value, form) for key, value, form in _places(table, _type_info(cls), "")}
    for key, (value, form) in places.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise _Wrong(where, key, f"{key} = {value} is not allowed: it must be a finite number")
        member = _member_with_places(form)
        if isinstance(value, Mapping) and isinstance(member, inspect.DataclassType | inspect.StructType):
            keys = [field.encode_name for field in member.fields]
            for name in cast("Mapping[str, Any]", value):
                if name not in keys:
                    full = _join_key(key, name)
                    raise _Wrong(where, full, f"{full} is not known; allowed here: {', '.join(keys)}")
    try:
        return msgspec.convert(table, cls)
    except msgspec.ValidationError as error:
        raise _Wrong(where, *_sentence(error, places)) from error


def _places(value: Any, form: inspect.Type | None, key: str) -> Iterator[tuple[str, Any, inspect.Type | None]]:  # noqa: ANN401  any TOML value
    """Yield the key, the value and the type of a place in a table and of all places inside it."""
    yield key, value, form
    if isinstance(value, list):
        for index, item in enumerate(cast("list[Any]", value)):
            yield from _places(item, _inside(form, index), f"{key}[{index}]")
    if isinstance(value, Mapping):
        for name, item in cast("Mapping[str, Any]", value).items():
            yield from _places(item, _inside(form, name), _join_key(key, name))


def _member_with_places(form: inspect.Type | None) -> inspect.Type | None:
    """Return the member of a union that holds other values, or the type itself where it is no union."""
    kinds = (inspect.DataclassType, inspect.StructType, inspect.ListType, inspect.VarTupleType, inspect.TupleType)
    types = form.types if isinstance(form, inspect.UnionType) else (form,)
    return next((member for member in types if isinstance(member, kinds)), None)


def _inside(form: inspect.Type | None, position: str | int) -> inspect.Type | None:
    """Return the type at a name or a position inside a type; None where it has none there."""
    match _member_with_places(form), position:
        case inspect.DataclassType(fields=fields) | inspect.StructType(fields=fields), str():
            return next((field.type for field in fields if field.encode_name == position), None)
        case inspect.VarTupleType(item_type=item) | inspect.ListType(item_type=item), int():
            return item
        case inspect.TupleType(item_types=items), int():
            return items[min(position, len(items) - 1)]
        case _:
            return None


def _sentence(error: msgspec.ValidationError, places: Mapping[str, tuple[Any, inspect.Type | None]]) -> tuple[str, str]:
    """Return the key that msgspec refuses, as a TOML file would write it, and a sentence about it."""
    message, _, location = str(error).partition(" - at `$")
    path = location.strip(".`").removesuffix("[...]")
    cause = error.__cause__
    if cause is None:
        value, form = places[path]
        if absence := re.match(r"Object missing required field `(.*?)`", message):
            return path, f"{_join_key(path, absence[1])} is missing; it must be {_type_text(_inside(form, absence[1]))}"
        return path, f"{path} = {toml_value(value)} is not allowed: it must be {_type_text(form)}"
    # A dataclass that checks itself names the key, in full or relative to itself.
    key = str(getattr(cause, "key", ""))
    if not key:
        return path, f"{path or 'this'}: {cause}"
    full = key if not path or key == path or key.startswith((f"{path}.", f"{path}[")) else f"{path}.{key}"
    advice = str(getattr(cause, "allowed", cause)).rstrip(".")
    return full, f"{full} = {toml_value(getattr(cause, 'value', None))} is not allowed: {advice}"


def _join_key(key: str, name: str) -> str:
    """Return the key of a name inside a table, as TOML writes it.

    >>> _join_key("finger", "tip_radius"), _join_key("", ""), _join_key("a", "a b")
    ('finger.tip_radius', '""', 'a."a b"')
    """
    bare_or_quoted = name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _inline(name)
    return f"{key}.{bare_or_quoted}" if key else bare_or_quoted


def _type_text(form: inspect.Type | None) -> str:
    """Say what a type allows.

    >>> _type_text(inspect.type_info(tuple[float, float])), _type_text(inspect.type_info(float | None))
    ('a list of 2, each a number', 'a number')
    >>> _type_text(inspect.FloatType(gt=0.0, le=1e6)), _type_text(inspect.FloatType(ge=0.0))
    ('a number above 0 and at most 1e+06', 'a number at least 0')
    """
    match form:
        case inspect.UnionType(types):
            return " or ".join(_type_text(choice) for choice in types if not isinstance(choice, inspect.NoneType))
        case inspect.LiteralType(values):
            return " or ".join(f'"{value}"' for value in values)
        case inspect.VarTupleType(item) | inspect.ListType(item):
            return f"a list, each {_type_text(item)}"
        case inspect.FloatType(gt=above, ge=least, le=most):
            limits = {"above": above, "at least": least, "at most": most}
            texts = [f"{label} {limit:g}" for label, limit in limits.items() if limit is not None]
            return f"a number {' and '.join(texts)}".rstrip()
        case inspect.TupleType(items):
            return f"a list of {len(items)}, each {_type_text(items[0])}"
        case _:
            return _WORDS.get(type(form), "a value")


_WORDS: Mapping[type[inspect.Type | None], str] = {
    inspect.IntType: "a whole number",
    inspect.StrType: "text in quotes",
    inspect.BoolType: "true or false",
    inspect.DataclassType: "a table",
    inspect.StructType: "a table",
}


def toml_text(value: Any) -> str:  # noqa: ANN401  any dataclass of texts, numbers, tuples and dataclasses
    """Return the TOML text from which `from_toml` makes the same dataclass; None is left out."""
    return "\n".join(_lines(msgspec.to_builtins(value), "")) + "\n"


def _lines(table: Mapping[str, Any], name: str) -> Iterator[str]:
    """Yield a table's own values, and then the tables inside it."""
    tables: dict[str, Mapping[str, Any]] = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    values = {key: value for key, value in table.items() if value is not None and key not in tables}
    if name and values:
        yield f"\n[{name}]"
    for key, value in values.items():
        yield f"{key} = {_inline(value)}"
    for key, value in tables.items():
        yield from _lines(value, f"{name}.{key}" if name else key)


def _inline(value: Any) -> str:  # noqa: ANN401  as above
    """Return a value as TOML writes it after the equals sign.

    >>> _inline(("a", 1e-05, True)), _inline({"g": 0.2, "tau": None})
    ('["a", 1e-05, true]', '{g = 0.2}')
    """
    if isinstance(value, Mapping):
        table = cast("Mapping[str, Any]", value)
        return "{" + ", ".join(f"{key} = {_inline(item)}" for key, item in table.items() if item is not None) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_inline, cast("tuple[Any, ...]", value))) + "]"
    if isinstance(value, str):
        return "".join(map(_escape, json.dumps(value, ensure_ascii=False)))
    if isinstance(value, date | time):
        return value.isoformat()
    if isinstance(value, bool):
        return {True: "true", False: "false"}[value]
    with suppress(ValueError):
        return repr(value)
    return hex(value)  # of any length, whereas Python limits decimal digits


def _escape(character: str) -> str:
    """Return a character of a text in quotes, or its escape where it is not printable."""
    if character.isprintable():
        return character
    code = ord(character)
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


class _Wrong(SettingsError):
    """A SettingsError with its key, from which the line is found."""

    def __init__(self, where: str, key: str, sentence: str) -> None:
        super().__init__(f"{where}: {sentence}")
        self.key = key
        self.sentence = sentence


def toml_value(value: object) -> str:
    """Return a value as TOML writes it, cut short.

    >>> toml_value("a"), toml_value(True), toml_value([1, 2.5]), toml_value(date(2026, 1, 1))
    ('"a"', 'true', '[1, 2.5]', '2026-01-01')
    """
    if value is None:
        return "nothing"
    text = _inline(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _line_number(text: str, key: str) -> int | None:
    """Return the line of a TOML text on which a dotted key is set or its table begins; None when not found."""
    tables: dict[str, int] = {}
    table = ""
    table_line: int | None = None
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[\[?\s*([\w.\-]+)\s*\]\]?\s*(#.*)?$", line):
            table = header.group(1)
            if line.lstrip().startswith("[["):
                tables[table] = tables.get(table, -1) + 1
                table += f"[{tables[table]}]"
            if key == table or key.startswith((f"{table}.", f"{table}[")):
                table_line = number  # the fallback: a missing key is reported at its table
        elif assignment := re.match(r"\s*([\w.\-]+)\s*=", line):
            full = f"{table}.{assignment.group(1)}" if table else assignment.group(1)
            if key == full or key.startswith((f"{full}.", f"{full}[")):
                return number
    return table_line
