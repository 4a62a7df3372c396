"""The page on the keys of `study.json`, made from the records that it holds."""

import ast
import inspect
import typing
from itertools import takewhile

import looks
import msgspec

from sessions.statistics.findings import StudyFindings
from sessions.strokes.stroke import meanings

HEAD = """# Keys of a study's numbers

`study.json` holds one `StudyFindings`. Null stands where a number is withheld or does not apply. A number without a unit is a
count, a share, a correlation or a p. That of a record of its own, such as `Average`, has the unit of the key that holds the
record. A point is one of the 100 of a score. [The scene](../../scene-file.md) has a page of its own.
"""


def page() -> str:
    """Return the page: a table for each record."""
    lines = [HEAD]
    for record in _records():
        annotated = meanings(record).items()
        texts = _comments(record) | {key: f"{text} [{unit}]" if unit else text for key, (unit, text) in annotated}
        rows = [(f"`{key}`", f"`{_cell(kind)}`", _cell(texts[name])) for name, (key, kind) in _types(record).items()]
        lines += [f"## {record.__name__}", "", inspect.getdoc(record).split("\n")[0], ""]
        lines += looks.table(("key", "type", "meaning"), rows)
    return "\n".join(lines)


def _records() -> list[type]:
    """Return the types of all records of `study.json`, without scenes."""
    records: dict[type, None] = {}

    def add(hint: object) -> None:
        is_record = getattr(hint, "__module__", "").startswith("sessions.") and hasattr(hint, "__annotations__")
        if is_record and hint not in records:
            records[hint] = None
            for field in typing.get_type_hints(hint).values():
                add(field)
        for part in typing.get_args(hint):
            add(part)

    add(StudyFindings)
    return list(records)


def _types(record: type) -> dict[str, tuple[str, str]]:
    """Return the key of each field, and its type as it is written, without units and meanings."""
    structs = msgspec.structs.fields(record) if issubclass(record, msgspec.Struct) else ()
    keys = {field.name: field.encode_name for field in structs}
    types: dict[str, tuple[str, str]] = {}
    for node in _fields(record):
        name, kind = node.target.id, ast.unparse(node.annotation)
        if kind.startswith("Annotated["):
            kind = ast.unparse(node.annotation.slice.elts[0])
        types[name] = keys.get(name, name), kind
    return types


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _comments(record: type) -> dict[str, str]:
    """Return the comment that ends the line of each field in the source of `record`, or the one above the field."""
    lines = inspect.getsource(record).split("\n")
    comments: dict[str, str] = {}
    for node in _fields(record):
        above = takewhile(lambda line: line.startswith("    # "), lines[node.lineno - 2 :: -1])
        text = lines[node.end_lineno - 1].partition("  # ")[2]
        comments[node.target.id] = text or " ".join(line.removeprefix("    # ") for line in reversed([*above]))
    return comments


def _fields(record: type) -> list[ast.AnnAssign]:
    body = ast.parse(inspect.getsource(record)).body[0].body
    return [node for node in body if isinstance(node, ast.AnnAssign)]
