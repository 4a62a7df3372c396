"""Every example in a docstring of the program gives what stands below it."""

import ast
import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("daq_app", "drivers", "sessions", "simulators", "solver")
FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")) if ">>> " in path.read_text()]
MODULES = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in FILES}


@pytest.mark.parametrize("name", MODULES)
def test_every_example_of_a_module_gives_what_stands_below_it(name):
    # From the source, as doctest's own search leaves out cached properties.
    nodes = (ast.Module, ast.ClassDef, ast.FunctionDef)
    tree, module = ast.parse(MODULES[name].read_text()), importlib.import_module(name)
    runner, parser = doctest.DocTestRunner(), doctest.DocTestParser()
    for docstring in (ast.get_docstring(node) for node in ast.walk(tree) if isinstance(node, nodes)):
        runner.run(parser.get_doctest(docstring or "", dict(vars(module)), name, str(MODULES[name]), 0))
    result = runner.summarize()
    assert result.attempted > 0
    assert result.failed == 0
