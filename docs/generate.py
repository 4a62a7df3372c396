"""Reference pages made from the program itself: the command line from argparse, files from the types they become."""

import ast
import dataclasses
import importlib
import inspect
from pathlib import Path

import against_the_paper
import looks

from daq_app.cli import main
from daq_app.qt import start

SCENE = "solver.scene.tables"
PROTOCOL = "sessions.plan.protocols.protocol"


def write(folder: Path) -> None:
    """Write every generated page into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {
        "command-line": command_line(),
        "scene-keys": scene_keys(),
        "protocol-keys": protocol_keys(),
        "against-the-paper": against_the_paper.page(),
        "looks": looks.page(),
    }
    looks.write_pictures(folder)
    for name, text in pages.items():
        file = folder / f"{name}.md"
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def command_line() -> str:
    """Return the help of every verb, as argparse prints it."""
    lines = ["# Command line", "", "`daq-app VERB --help` prints the same.", ""]
    parsers = [("window", "open the window, which `daq-app` alone does too", start.command_line())]
    for name, summary in main.VERBS.items():
        parsers.append((name, summary, main.parser_of(name, main.verb_module(name))))
    for name, summary, parser in parsers:
        text = parser.format_help().rstrip()
        lines += [f"## {name}", "", f"{summary[0].upper()}{summary[1:]}.", "", "```text", text, "```", ""]
    return "\n".join(lines)


def scene_keys() -> str:
    """Return the keys of a scene file, table by table."""
    tables = ["Finger", "Material", "Relaxation", "Friction", "Loading", "Receptor", "Solve"]
    return _keys("Keys of a scene file", SCENE, tables)


def protocol_keys() -> str:
    """Return the keys of a protocol file, table by table."""
    module = importlib.import_module(PROTOCOL)
    classes = [cls for cls in vars(module).values() if inspect.isclass(cls) and dataclasses.is_dataclass(cls)]
    return _keys("Keys of a protocol file", PROTOCOL, [cls.__name__ for cls in classes if cls.__module__ == PROTOCOL])


def _keys(title: str, module: str, tables: list[str]) -> str:
    lines = [f"# {title}", ""]
    for name in tables:
        table = getattr(importlib.import_module(module), name)
        meaning = _comments(table)
        lines += [f"## {name}", "", inspect.getdoc(table).split("\n")[0], ""]
        fields = dataclasses.fields(table)
        rows = [(f"`{field.name}`", _default(field), _cell(meaning.get(field.name, ""))) for field in fields]
        lines += looks.table(("key", "default", "meaning"), rows)
    return "\n".join(lines)


def _default(field: "dataclasses.Field[object]") -> str:
    if field.default is not dataclasses.MISSING:
        return f"`{_cell(repr(field.default))}`"
    return "its own defaults" if field.default_factory is not dataclasses.MISSING else "required"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _comments(table: type) -> dict[str, str]:
    """Return the comment that ends the line of each field in the source of `table`."""
    source = inspect.getsource(table)
    lines = source.split("\n")
    body = ast.parse(inspect.cleandoc(source)).body[0].body
    fields = [node for node in body if isinstance(node, ast.AnnAssign)]
    return {node.target.id: lines[node.end_lineno - 1].partition("  # ")[2] for node in fields}
