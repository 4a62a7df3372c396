"""Names that begin with an underscore belong to the file or the class that defines them."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("sessions", "daq_app", "drivers", "simulators")


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def imported_private_names(tree: ast.Module) -> Iterator[str]:
    """Yield each underscore name that a file imports from a module of the project."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] in PACKAGES:
            yield from (f"imports {alias.name}" for alias in node.names if is_private(alias.name))


def defined_in(body: ast.ClassDef) -> set[str]:
    """Return the underscore names that a class defines: methods, fields, and attributes it sets on itself."""
    names = {node.name for node in body.body if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)}
    names |= {node.id for node in ast.walk(body) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    names |= {node.attr for node in of_self(body) if isinstance(node.ctx, ast.Store)}
    return {name for name in names if is_private(name)}


def of_self(body: ast.ClassDef) -> Iterator[ast.Attribute]:
    """Yield each `self.name` inside a class."""
    for node in ast.walk(body):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in ("self", "cls"):
            yield node


def inherited_private_names(classes: dict[str, ast.ClassDef]) -> Iterator[str]:
    """Yield each underscore name of a base class that a class derived from it overrides or uses."""
    for name, body in classes.items():
        bases = [base.attr if isinstance(base, ast.Attribute) else getattr(base, "id", "") for base in body.bases]
        theirs = {one: base for base in bases if base in classes for one in defined_in(classes[base])}
        used = {node.attr for node in of_self(body)} | defined_in(body)
        yield from (f"{name} takes {one} of {theirs[one]}" for one in sorted(used & set(theirs)))


@pytest.fixture(scope="module")
def trees():
    files = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return {path.relative_to(ROOT): ast.parse(path.read_text(encoding="utf-8")) for path in files}


def test_no_file_imports_a_private_name_of_another(trees):
    assert not [f"{path} {said}" for path, tree in trees.items() for said in imported_private_names(tree)]


def test_no_class_overrides_or_uses_a_private_name_of_its_base(trees):
    classes = {node.name: node for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
    assert not list(inherited_private_names(classes))


SPOILT = """
from sessions.plan.plan import _hidden
class Base:
    def __init__(self): self._kept = 1
    def _step(self): ...
class Derived(Base):
    def _step(self): return self._kept
"""


def test_a_private_name_taken_from_elsewhere_is_found():
    tree = ast.parse(SPOILT)
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    assert list(imported_private_names(tree)) == ["imports _hidden"]
    assert list(inherited_private_names(classes)) == ["Derived takes _kept of Base", "Derived takes _step of Base"]
