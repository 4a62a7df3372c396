"""Pages on the keys of `study.json`, scenes and protocols, made from the types that they become."""

import ast
import inspect
import typing
from itertools import takewhile

import looks
import msgspec

from sessions.plan.protocols.protocol import Protocol
from sessions.statistics.findings import StudyFindings
from sessions.strokes.stroke import meanings
from solver import Scene

STUDY = """# Keys of a study's numbers

`study.json` holds one `StudyFindings`. Null stands where a number is withheld or does not apply. A number without a unit is a
count, a share, a correlation or a p. That of a record of its own, such as `Average`, has the unit of the key that holds the
record. A point is one of the 100 of a score. [The scene](../../scene-file.md) has a page of its own.
"""


SCENE = """# Keys of a scene file

A table for each table of the file, `Scene` first. [The scene](../../scene-file.md) explains them and their ranges.
"""

PROTOCOL = """# Keys of a protocol file

A table for each table of the file, `Protocol` first. [Add a protocol](../../how-to/add-a-protocol.md) explains them and their
ranges.
"""


def pages() -> dict[str, str]:
    """Return the text of each page by its name."""
    return {
        "study-keys": _page(STUDY, StudyFindings),
        "scene-keys": _page(SCENE, Scene),
        "protocol-keys": _page(PROTOCOL, Protocol),
    }


def _page(head: str, root: type) -> str:
    """Return a page with a table for each record of `root`."""
    lines = [head]
    for record in _records(root):
        annotated = meanings(record).items()
        texts = _comments(record) | {key: f"{text} [{unit}]" if unit else text for key, (unit, text) in annotated}
        rows = [(f"`{key}`", f"`{_cell(kind)}`", _cell(texts[name])) for name, (key, kind) in _types(record).items()]
        lines += [f"## {record.__name__}", "", inspect.getdoc(record).split("\n")[0], ""]
        lines += looks.table(("key", "type", "meaning"), rows)
    return "\n".join(lines)


def _records(root: type) -> list[type]:
    """Return `root` and the types of all records that it holds, of its own package."""
    records: dict[type, None] = {}
    package = root.__module__.partition(".")[0]

    def add(hint: object) -> None:
        is_record = getattr(hint, "__module__", "").startswith(f"{package}.") and hasattr(hint, "__annotations__")
        if is_record and hint not in records:
            records[hint] = None
            for field in typing.get_type_hints(hint).values():
                add(field)
        for part in typing.get_args(hint):
            add(part)

    add(root)
    return list(records)


def _types(record: type) -> dict[str, tuple[str, str]]:
    """Return the key of each field, and its type and default as they are written, without units and meanings."""
    structs = msgspec.structs.fields(record) if issubclass(record, msgspec.Struct) else ()
    keys = {field.name: field.encode_name for field in structs}
    types: dict[str, tuple[str, str]] = {}
    for node in _fields(record):
        name, kind = node.target.id, ast.unparse(node.annotation)
        if kind.startswith("Annotated["):
            kind = ast.unparse(node.annotation.slice.elts[0])
        default = f" = {ast.unparse(node.value)}" if isinstance(node.value, ast.Constant) else ""
        types[name] = keys.get(name, name), kind + default
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
