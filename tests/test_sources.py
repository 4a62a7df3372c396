"""What holds for every source file: the names it uses, the names it keeps to itself, and what it never calls."""

import ast
import gc
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("daq_app", "drivers", "sessions", "simulators", "solver")
SCRIPTS = ("benchmarks", "docs")  # no packages of the program, but with the same words
PRIVATE_IN = ("sessions", "daq_app", "drivers", "simulators")  # packages whose underscore names stay in their files
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
ROWS = [line.split("|") for line in GLOSSARY.splitlines() if line.startswith("|")]
NOT_THIS = sorted({name for row in ROWS for name in re.findall(r"`(\w+)`", row[3])})
ONLY_IN_SOLVER = {"evidence", "folding"}  # of models, and of skin
HELD_NODES = {"held"}  # of a mesh: driven nodes, as scripts name them
# A value that has a kind is not called by what happened to it.
PARTICIPLES = {
    *("asked", "beside", "both", "carried", "chosen", "felt", "found", "given", "heard", "held", "leaning", "made"),
    *("marked", "others", "owed", "planted", "said", "solved", "stated", "swapped", "taken", "told", "used", "wanted"),
    *("saved", "spoken", "written"),
}
# Records and messages have these for fields and kinds, and constants for parts of their names; other values do not.
PARTICIPLES_OF_RECORDS = {
    *("arrived", "broken", "compared", "decided", "done", "drawn", "gathered", "gone", "judged", "kept", "known"),
    *("listed", "named", "needed", "packed", "related", "replayed", "seen", "shown"),
}
# Modules that read what can run, and calls that run what was read.
RUNS = frozenset({"pickle", "cPickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "yaml"})
CALLS = frozenset({"eval", "exec", "compile", "__import__", "read_pickle"})
LISTENS = frozenset({"bind", "listen", "create_server", "serve_forever", "start_server"})
FUNCTIONS = ast.FunctionDef, ast.AsyncFunctionDef
SIMULATORS = "simulators"  # the boxes of `sim:` and of `daq-app simulate`, on loopback
TABLET = Path("daq_app", "tablet", "server.py")  # asked for by `--subject-screen web` alone, on a private network


@pytest.fixture(scope="module", autouse=True)
def no_collection():
    """Keep the garbage collector from a million nodes, which it would look through again and again."""
    gc.disable()
    yield
    parsed.cache_clear()
    nodes.cache_clear()
    gc.enable()


@pytest.fixture(scope="module")
def trees() -> dict[Path, ast.Module]:
    """Return every module of ours, parsed once."""
    return parsed(PACKAGES)


@cache
def parsed(folders: tuple[str, ...]) -> dict[Path, ast.Module]:
    files = [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]
    return {path.relative_to(ROOT): ast.parse(path.read_text(encoding="utf-8")) for path in files}


@cache
def nodes(tree: ast.Module) -> dict[type[ast.AST], list[ast.AST]]:
    """Return the nodes of a module by their kind, gathered once."""
    kinds = defaultdict(list)
    for node in ast.walk(tree):
        kinds[type(node)].append(node)
    return kinds


def of_kind(tree: ast.Module, *kinds: type[ast.AST]) -> Iterator[ast.AST]:
    for kind in kinds:
        yield from nodes(tree)[kind]


# ---- terms of the field


def identifiers(file: Path, tree: ast.Module) -> Iterator[str]:
    """Yield the names that a file defines: its own, and those of classes, functions, parameters and variables."""
    yield file.parent.name if file.stem == "__init__" else file.stem
    yield from (node.name for node in of_kind(tree, *FUNCTIONS, ast.ClassDef))
    yield from (node.arg for node in of_kind(tree, ast.arg))
    yield from (node.id for node in of_kind(tree, ast.Name) if isinstance(node.ctx, ast.Store))
    yield from (node.attr for node in of_kind(tree, ast.Attribute) if isinstance(node.ctx, ast.Store))


def values(tree: ast.Module) -> set[str]:
    """Return the variables, parameters and functions of a file, without constants and without fields of records."""
    fields = {
        id(line.target)
        for record in of_kind(tree, ast.ClassDef)
        for line in record.body
        if isinstance(line, ast.AnnAssign)
    }
    stored = [node for node in of_kind(tree, ast.Name) if isinstance(node.ctx, ast.Store)]
    functions = {node.name for node in of_kind(tree, *FUNCTIONS)}
    parameters = {node.arg for node in of_kind(tree, ast.arg)}
    return {*functions, *parameters, *(node.id for node in stored if id(node) not in fields)}


def test_the_glossary_names_what_a_thing_is_not_called():
    assert {"NumberGiven", "Pacing", "CAP", "planted"} <= set(NOT_THIS)


def test_no_name_says_only_what_happened_to_a_value(trees):
    every = trees | parsed((*SCRIPTS, "tests"))
    names = {
        file: {name.strip("_").lower() for name in identifiers(file, tree)}
        & (PARTICIPLES - HELD_NODES if "solver" in file.parts else PARTICIPLES)
        for file, tree in every.items()
    }
    assert len(every) > 300
    assert {str(file): participles for file, participles in names.items() if participles} == {}
    names = {
        str(file): {name.strip("_") for name in values(tree)} & PARTICIPLES_OF_RECORDS for file, tree in every.items()
    }
    assert {file: participles for file, participles in names.items() if participles} == {}


def test_no_name_of_the_column_not_this_is_used(trees):
    uses = []
    for file, tree in (trees | parsed(SCRIPTS)).items():
        refused = set(NOT_THIS) - (ONLY_IN_SOLVER if file.parts[0] == "solver" else set())
        for name in set(identifiers(file, tree)):
            words = {word.lower() for word in re.findall("[A-Z]?[a-z]+|[A-Z]+", name)}
            uses += [f"{file}: {name}"] if refused & {name.strip("_"), *words} else []
    assert uses == []


PARTS_OF_A_KIND = {"DRIVER", "SIMULATOR", "EXAMPLE"}  # one in every driver, simulator and verb


def public_constants(tree: ast.Module) -> Iterator[str]:
    """Yield the constants of a module that other modules may import."""
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = [name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)]
            yield from (name for name in names if name.isupper() and len(name) > 1 and name[0] != "_")


def test_the_name_of_a_public_constant_is_unique_in_the_tree(trees):
    places = defaultdict(list)
    for file, tree in trees.items():
        if file.parts[0] not in ("drivers", "simulators"):  # each device stands alone
            for name in public_constants(tree):
                places[name].append(str(file))
    assert len(places) > 300
    assert {name: files for name, files in places.items() if len(files) > 1 and name not in PARTS_OF_A_KIND} == {}


# ---- names that begin with an underscore belong to the file or the class that defines them


def private(trees: dict[Path, ast.Module]) -> Iterator[tuple[Path, ast.Module]]:
    yield from ((path, tree) for path, tree in trees.items() if path.parts[0] in PRIVATE_IN)


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def imported_private_names(tree: ast.Module) -> Iterator[str]:
    """Yield each underscore name that a file imports from a module of the project."""
    for node in of_kind(tree, ast.ImportFrom):
        if (node.module or "").partition(".")[0] in PRIVATE_IN:
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
        theirs = {member: base for base in bases if base in classes for member in defined_in(classes[base])}
        names = {node.attr for node in of_self(body)} | defined_in(body)
        yield from (f"{name} takes {member} of {theirs[member]}" for member in sorted(names & set(theirs)))


def test_no_file_imports_a_private_name_of_another(trees):
    assert not [f"{path} {sentence}" for path, tree in private(trees) for sentence in imported_private_names(tree)]


def test_no_class_overrides_or_uses_a_private_name_of_its_base(trees):
    classes = {node.name: node for _, tree in private(trees) for node in of_kind(tree, ast.ClassDef)}
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


# ---- nothing listens on the network, and nothing that can run is read


def test_no_class_holds_a_partial_that_newer_pythons_bind_to_its_objects(trees):
    """From Python 3.14 on such a `functools.partial` gets the object as its first argument, and 3.13 warns of it."""
    places = [
        f"{file}:{line.lineno}"
        for file, tree in trees.items()
        for body in of_kind(tree, ast.ClassDef)
        for line in body.body
        if isinstance(line, ast.Assign | ast.AnnAssign) and isinstance(line.value, ast.Call)
        if getattr(line.value.func, "attr", getattr(line.value.func, "id", "")) == "partial"
    ]
    assert places == []


def called(tree):
    """Names of what is called."""
    for node in of_kind(tree, ast.Call):
        function = node.func
        yield function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", ""), node


def imported(tree):
    yield from (alias.name.split(".")[0] for node in of_kind(tree, ast.Import) for alias in node.names)
    yield from ((node.module or "").split(".")[0] for node in of_kind(tree, ast.ImportFrom))


def test_no_module_reads_a_format_that_can_run(trees):
    uses = []
    for path, tree in trees.items():
        uses += [(path, name) for name in imported(tree) if name in RUNS]
        for name, node in called(tree):
            plain = isinstance(node.func, ast.Name) or name == "read_pickle"  # `re.compile` is none of these
            pickles = any(keyword.arg == "allow_pickle" for keyword in node.keywords)
            if (name in CALLS and plain) or pickles:
                uses.append((path, name))
    assert uses == []


def test_nothing_but_a_simulated_box_and_the_tablets_server_listens(trees):
    uses = [
        (path, name)
        for path, tree in trees.items()
        if path.parts[0] != SIMULATORS and path != TABLET
        for name, node in called(tree)
        if name in LISTENS and isinstance(node.func, ast.Attribute)
    ]
    assert uses == []
