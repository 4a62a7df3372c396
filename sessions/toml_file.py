"""A TOML file as frozen dataclasses, or one sentence that says which value is wrong and what is allowed; and back."""

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import MISSING, fields, is_dataclass
from datetime import date, time
from pathlib import Path
from types import NoneType
from typing import Any, Literal, TypeVar, cast, get_args, get_origin, get_type_hints

import msgspec

from sessions.file_access import LARGEST_TEXT, read_limited, remedy

T = TypeVar("T")


class SettingsError(ValueError):
    """A value in a file given by the user is wrong; the message names file, key, value and what is allowed."""


class NotAllowed(ValueError):
    """A value that is out of its range; raised by a dataclass that checks itself when it is made."""

    def __init__(self, key: str, value: object, allowed: str) -> None:
        """Name the `key` as the file does, the `value` found, and what is `allowed`."""
        super().__init__(f"{key} = {value!r} is not allowed: {allowed}")
        self.key = key
        self.value = value
        self.allowed = allowed


def load_toml(path: Path, cls: type[T]) -> T:
    """Return the dataclass that a TOML file describes.

    Raises FileNotFoundError where there is none, SettingsError for anything wrong in it.
    """
    return from_toml(text_of(path), cls, str(path))


def text_of(path: Path) -> str:
    """Return the text of a TOML file, which may be a pipe. Raises as `load_toml` does."""
    if path.is_dir() or not path.exists():
        found = "this is a folder" if path.is_dir() else "there is no such file"
        raise FileNotFoundError(f"{path}: {found}; give the path of a TOML file")
    try:
        return read_limited(path, LARGEST_TEXT).decode(
            "utf-8-sig"
        )  # some editors begin a file with a mark that is no part of it
    except UnicodeDecodeError as error:
        raise SettingsError(f"{path}: byte {error.start} is no UTF-8 text; save the file as UTF-8") from error
    except OSError as error:
        raise SettingsError(f"{path} cannot be read ({error.strerror}); {remedy(error)}") from error


def from_toml(text: str, cls: type[T], where: str, instead: Mapping[str, Any] | None = None) -> T:
    """Return the dataclass that a TOML text describes; `where` is how messages call it. Raises SettingsError.

    `instead` are tables and values that count in place of the text's own, or of those that it lacks.
    """
    try:
        return from_table({**tables_in(text, where), **(instead or {})}, cls, where)
    except _Wrong as wrong:
        line = _line_of(text, wrong.key)
        raise SettingsError(
            f"{where}, line {line}: {wrong.sentence}" if line else f"{where}: {wrong.sentence}"
        ) from wrong


def tables_in(text: str, where: str) -> dict[str, Any]:
    """Return what a TOML text holds; `where` is how messages call it. Raises SettingsError."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(f"{where}: this is not TOML: {error}") from error
    except RecursionError as error:
        raise SettingsError(f"{where}: lists or tables are nested too deep; write it with fewer brackets") from error
    except ValueError as error:  # Python's limit, 4300 unless told
        raise SettingsError(f"{where}: a whole number has thousands of digits; shorten it") from error


def from_table(table: Mapping[str, Any], cls: type[T], where: str) -> T:
    """Return the dataclass that a table describes; `where` is how messages call the place it came from.

    Unknown keys are refused, whole numbers are taken where a number with a fraction may stand, true and false are no
    numbers, nan and infinity are refused. Raises SettingsError.
    """
    _check_keys(table, cls, "", where)
    try:
        return msgspec.convert(table, cls)
    except msgspec.ValidationError as error:
        path = _dotted(str(error))
        cause = error.__cause__
        if cause is None:
            value, kind = _found_at(table, cls, path)
            allowed = f"it must be {_in_words(kind)}"
            raise _Wrong(where, path, f"{path} = {shown(value)} is not allowed: {allowed}") from error
        # A dataclass that checks itself names the key, in full or from itself on.
        key = str(getattr(cause, "key", ""))
        full = key if not path or key == path or key.startswith((f"{path}.", f"{path}[")) else f"{path}.{key}"
        if not key:
            raise _Wrong(where, path, f"{path or 'this'}: {cause}") from error
        value: object = getattr(cause, "value", None)
        allowed = str(getattr(cause, "allowed", cause)).rstrip(".")
        raise _Wrong(where, full, f"{full} = {shown(value)} is not allowed: {allowed}") from error


def toml_text(made: Any) -> str:  # noqa: ANN401  any dataclass of texts, numbers, tuples and dataclasses
    """Return the TOML text from which `from_toml` makes the same dataclass; what is None is left out."""
    return "\n".join(_lines(msgspec.to_builtins(made), "")) + "\n"


def _lines(table: Mapping[str, Any], name: str) -> Iterator[str]:
    """Yield a table's own values, and then the tables inside it."""
    inside: dict[str, Mapping[str, Any]] = {key: value for key, value in table.items() if isinstance(value, Mapping)}
    own = {key: value for key, value in table.items() if value is not None and key not in inside}
    if name and own:
        yield f"\n[{name}]"
    for key, value in own.items():
        yield f"{key} = {_inline(value)}"
    for key, value in inside.items():
        yield from _lines(value, f"{name}.{key}" if name else key)


def _inline(value: Any) -> str:  # noqa: ANN401  as above
    """Return a value as it stands after the equals sign.

    >>> _inline(("a", 1e-05, True)), _inline({"g": 0.2, "tau": None})
    ('["a", 1e-05, true]', '{g = 0.2}')
    """
    if isinstance(value, Mapping):
        held = cast("Mapping[str, Any]", value)
        return "{" + ", ".join(f"{key} = {_inline(item)}" for key, item in held.items() if item is not None) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_inline, cast("tuple[Any, ...]", value))) + "]"
    if isinstance(value, str):
        return "".join(c if c.isprintable() else _escaped(c) for c in json.dumps(value, ensure_ascii=False))
    if isinstance(value, date | time):
        return value.isoformat()
    if isinstance(value, bool):
        return {True: "true", False: "false"}[value]
    with suppress(ValueError):
        return repr(value)
    return hex(value)  # of any length, whereas Python limits decimal digits


def _escaped(character: str) -> str:
    """Return a character as it stands in a text in quotes: one that a terminal would obey, or nobody would see."""
    code = ord(character)
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def _key(name: str) -> str:
    """Return a key as TOML writes it.

    >>> _key("tip_radius"), _key(""), _key("a b")
    ('tip_radius', '""', '"a b"')
    """
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _inline(name)


class _Wrong(SettingsError):
    """A SettingsError that still knows its key, so that the line can be found."""

    def __init__(self, where: str, key: str, sentence: str) -> None:
        super().__init__(f"{where}: {sentence}")
        self.key = key
        self.sentence = sentence


def _check_keys(value: Any, kind: Any, key: str, where: str) -> None:  # noqa: ANN401  any TOML value, any annotation
    """Refuse unknown and missing keys and numbers that are none, at any depth."""
    if isinstance(value, float) and not math.isfinite(value):
        raise _Wrong(where, key, f"{key} = {value} is not allowed: it must be a finite number")
    if isinstance(value, list):
        inner = _item_type(kind)
        for i, item in enumerate(cast("list[Any]", value)):
            _check_keys(item, inner, f"{key}[{i}]", where)
    dataclass = _dataclass_in(kind)
    if not isinstance(value, Mapping) or dataclass is None:
        return
    table = cast("Mapping[str, Any]", value)
    hints = get_type_hints(dataclass)
    for name, inside in table.items():
        full = f"{key}.{_key(name)}" if key else _key(name)
        if name not in hints:
            raise _Wrong(where, full, f"{full} is not known; allowed here: {', '.join(hints)}")
        _check_keys(inside, hints[name], full, where)
    for field in fields(dataclass):
        if field.default is MISSING and field.default_factory is MISSING and field.name not in table:
            full = f"{key}.{field.name}" if key else field.name
            raise _Wrong(where, key, f"{full} is missing; it must be {_in_words(hints[field.name])}")


def _dataclass_in(kind: Any) -> Any:  # noqa: ANN401  annotations are objects of many classes
    """Return the dataclass an annotation names, alone or in a union; else None."""
    return next((choice for choice in (kind, *get_args(kind)) if is_dataclass(choice)), None)


def _item_type(kind: Any) -> Any:  # noqa: ANN401  as above
    """Return the type of the items of a tuple annotation; None where it is none, or its items differ."""
    items = [item for item in get_args(kind) if item is not Ellipsis]
    return items[0] if get_origin(kind) is tuple and len(items) == 1 else None


def _in_words(kind: Any) -> str:  # noqa: ANN401  as above
    """Say what an annotation allows.

    >>> _in_words(tuple[float, float]), _in_words(Literal["steady", "history"]), _in_words(float | None)
    ('a list of 2, each a number', '"steady" or "history"', 'a number')
    """
    simple = {float: "a number", int: "a whole number", str: "text in quotes", bool: "true or false"}
    if kind in simple:
        return simple[kind]
    arguments = [argument for argument in get_args(kind) if argument is not NoneType]
    if get_origin(kind) is Literal:
        return " or ".join(f'"{choice}"' for choice in arguments)
    if get_origin(kind) is tuple:
        item = _in_words(arguments[0])
        return f"a list, each {item}" if Ellipsis in arguments else f"a list of {len(arguments)}, each {item}"
    if is_dataclass(kind):
        return "a table"
    return " or ".join(_in_words(argument) for argument in arguments) or "a value"


def _dotted(message: str) -> str:
    """Return the key a msgspec message speaks of, as a TOML file would write it; "" for the whole file."""
    found = re.search(r" - at `\$\.?(.*?)`$", message)
    return found.group(1) if found else ""


def _found_at(table: Any, kind: Any, key: str) -> tuple[object, Any]:  # noqa: ANN401  as above
    """Return the value at a dotted key, and the annotation it should have met."""
    for part in re.findall(r"[^.\[\]]+", key):
        if part.isdigit():
            lists = [choice for choice in (kind, *get_args(kind)) if get_origin(choice) is tuple]
            kinds = [item for item in get_args(lists[0]) if item is not Ellipsis]
            table, kind = table[int(part)], kinds[min(int(part), len(kinds) - 1)]
        else:
            table, kind = table[part], get_type_hints(_dataclass_in(kind))[part]
    return table, kind


def shown(value: object) -> str:
    """Return a value as TOML writes it, cut short.

    >>> shown("a"), shown(True), shown([1, 2.5]), shown(date(2026, 1, 1))
    ('"a"', 'true', '[1, 2.5]', '2026-01-01')
    """
    if value is None:
        return "nothing"
    text = _inline(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _line_of(text: str, key: str) -> int | None:
    """Return the line of a TOML text on which a dotted key is set or its table begins; None when not found."""
    counted: dict[str, int] = {}
    here = ""
    best: int | None = None
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[\[?\s*([\w.\-]+)\s*\]\]?\s*(#.*)?$", line):
            here = header.group(1)
            if line.lstrip().startswith("[["):
                counted[here] = counted.get(here, -1) + 1
                here += f"[{counted[here]}]"
            if key == here or key.startswith((f"{here}.", f"{here}[")):
                best = number  # where nothing better comes: a key that is missing is missed in its table
        elif assigned := re.match(r"\s*([\w.\-]+)\s*=", line):
            full = f"{here}.{assigned.group(1)}" if here else assigned.group(1)
            if key == full or key.startswith((f"{full}.", f"{full}[")):
                return number
    return best
