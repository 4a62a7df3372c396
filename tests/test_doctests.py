"""Every example in a docstring of the program gives what stands below it."""

import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("daq_app", "drivers", "sessions", "simulators", "solver")
FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")) if ">>> " in path.read_text()]
MODULES = [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in FILES]


@pytest.mark.parametrize("name", MODULES)
def test_every_example_of_a_module_gives_what_stands_below_it(name):
    runner = doctest.DocTestRunner()
    for docstring in doctest.DocTestFinder().find(importlib.import_module(name), name):
        if docstring.examples:  # to run one without any still looks up the file of each module
            runner.run(docstring)
    result = runner.summarize()
    assert result.attempted > 0
    assert result.failed == 0
