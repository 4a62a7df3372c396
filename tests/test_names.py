"""Names in the code are terms of the field: none stands in the glossary's column "not this"."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("daq_app", "drivers", "sessions", "simulators", "solver")
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
ROWS = [line.split("|") for line in GLOSSARY.splitlines() if line.startswith("|")]
NOT_THIS = sorted({name for row in ROWS for name in re.findall(r"`(\w+)`", row[3])})
# The solver still has these; elsewhere they are not used.
ONLY_IN_SOLVER = {"evidence"}


def identifiers(file: Path) -> Iterator[str]:
    """Yield the names that a file defines: its own, and those of classes, functions, parameters and variables."""
    yield file.parent.name if file.stem == "__init__" else file.stem
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        match node:
            case ast.FunctionDef(name) | ast.AsyncFunctionDef(name) | ast.ClassDef(name) | ast.arg(name):
                yield name
            case ast.Name(name, ast.Store()) | ast.Attribute(_, name, ast.Store()):
                yield name
            case _:
                pass


FILES = [file.relative_to(ROOT) for package in PACKAGES for file in (ROOT / package).rglob("*.py")]


def test_the_glossary_names_what_a_thing_is_not_called():
    assert {"NumberGiven", "Pacing", "CAP"} <= set(NOT_THIS)


@pytest.mark.parametrize("package", PACKAGES)
def test_no_name_of_the_column_not_this_is_used(package):
    found = []
    for file in (file for file in FILES if file.parts[0] == package):
        solver = package == "solver"
        names = {name.strip("_") for name in identifiers(ROOT / file)} & set(NOT_THIS)
        found += [f"{file}: {name}" for name in sorted(names - (ONLY_IN_SOLVER if solver else set()))]
    assert found == []
