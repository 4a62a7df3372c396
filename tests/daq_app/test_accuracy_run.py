"""A run of the accuracy page: time that is over, Ctrl-C and a subject that breaks off lose nothing else."""

import ast
from pathlib import Path
from time import perf_counter

import pytest

from daq_app.accuracy_page.page import page, write
from daq_app.child_process import interpreter
from daq_app.cli.main import run
from solver.verification import estimates
from solver.verification.costs import COST_PARTS, ENTIRE, shares
from solver.verification.growth import Growth
from solver.verification.measuring import Subject, measure
from solver.verification.random_scenes import random_scene
from solver.verification.request import Host, LeftOut, Request, median_time, rows_within

HOST = Host({}, tuple(interpreter()))
ONE, TWO = (Growth("small", 0.01, n, 0.01, 1e-6) for n in (1000, 4000))


def test_random_scenes_are_the_same_every_time_and_differ_from_each_other():
    assert random_scene("axis", 3, "small") == random_scene("axis", 3, "small")
    assert random_scene("axis", 3, "small") != random_scene("axis", 5, "small")
    assert random_scene("axis", 3, "finite").loading == random_scene("axis", 3, "small").loading


def test_when_time_is_over_one_thing_is_still_measured_and_the_rest_is_named():
    ample, over = (Request(quick=True, until=perf_counter() + seconds, host=HOST) for seconds in (1e6, -1.0))
    assert list(rows_within(ample, [1, 2, 3], "things", lambda n: [n, -n])) == [1, -1, 2, -2, 3, -3]
    rest = LeftOut("Time was over after 1 of 3 things.")
    assert list(rows_within(over, [1, 2, 3], "things", lambda n: [n])) == [1, rest]


def test_a_time_is_the_median_of_runs_and_slow_work_is_run_once():
    runs = []
    median_time(lambda: runs.append(1), repeats=5)
    assert len(runs) == 5
    median_time(lambda: runs.append(1), repeats=5, most_s=-1.0)
    assert len(runs) == 6


def subject(name, *rows):
    def measure(*_):
        for row in rows:
            if row is KeyboardInterrupt:
                raise KeyboardInterrupt
            if isinstance(row, Exception):
                raise row
            yield row

    return Subject(name, f"the {name}", (1.0, 1.0), measure, ())


def quiet(*_):
    """Show no progress, load nothing."""


@pytest.fixture
def unloaded(monkeypatch):
    monkeypatch.setattr("solver.verification.measuring.warm_up", quiet)


@pytest.mark.usefixtures("unloaded")
def test_ctrl_c_keeps_what_was_measured_and_names_what_was_not():
    parts = [subject("one", ONE), subject("two", TWO, KeyboardInterrupt), subject("three", ONE)]
    results = measure(True, quiet, HOST, parts, seconds=5.0)
    assert results.stopped
    assert results.rows == {"one": (ONE,), "two": (TWO,)}
    assert results.left_out == ("Stopped during: the two.", "Stopped before: the three.")
    assert "Stopped by hand" in page(results)


@pytest.mark.usefixtures("unloaded")
@pytest.mark.parametrize("kind", [ValueError, MemoryError])
def test_a_subject_that_breaks_off_loses_nothing_of_the_others(kind):
    parts = [subject("one", ONE, kind("bad luck")), subject("two", TWO)]
    results = measure(True, quiet, HOST, parts, seconds=5.0)
    assert results.rows == {"one": (ONE,), "two": (TWO,)}
    assert results.left_out == ("The one broke off: bad luck",)


def test_time_within_a_part_of_the_solver_counts_for_that_part_and_that_outside_for_its_caller():
    mesher, contact, library = (
        ("/x/solver/mesh/mesher.py", 1, "a"),
        ("/x/solver/contact.py", 1, "b"),
        ("/lib/np.py", 1, "c"),
    )
    calls = {mesher: (1, 1, 3.0, 4.0), contact: (1, 1, 1.0, 3.0)}
    profile = {mesher: (1, 1, 2.0, 6.0, {}), contact: (1, 1, 1.0, 4.0, {}), library: (2, 2, 4.0, 7.0, calls)}
    results = shares(type("Profile", (), {"__init__": lambda self: vars(self).update(stats=profile)})())
    assert results["mesh and tables"] == pytest.approx((2 + 4 * 4 / 7) / 7)
    assert results["contact"] == pytest.approx((1 + 4 * 3 / 7) / 7)


def test_every_part_of_the_solver_whose_time_is_counted_is_there():
    solver = Path(__file__).parents[2] / "solver"
    names = {
        ".".join([*file.relative_to(solver).with_suffix("").parts, node.name]).replace(".__init__", "")
        for file in solver.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    }
    places = {".".join(name.split(".")[:n]) for name in names for n in (1, 2, 3, 4)}
    assert set(COST_PARTS) - places == set()
    assert set(ENTIRE) - {name.split(".")[-1] for name in names} == set()


@pytest.mark.slow
def test_a_quick_run_measures_something_of_every_subject(tmp_path):
    results = measure(True, quiet, HOST, seconds=1.0)
    assert {name for name, rows in results.rows.items() if not rows} == set()
    assert not [reason for reason in results.left_out if "broke off" in reason]
    write(results, tmp_path)
    assert {row.kinematics for row in results.of(estimates.Estimate)} == {"small", "finite"}


def test_a_folder_that_nothing_can_be_written_into_is_named_before_anything_is_measured(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("os.access", lambda *_: False)
    assert run(["accuracy", "--quick", "--out", str(tmp_path)]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert "cannot be written into" in lines[-1]
    assert len(lines) <= 2  # that it loads, and this
