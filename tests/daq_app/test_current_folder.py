"""Code that lies in the current folder is never run, whichever process the program starts."""

import os
import subprocess
import sys
import time
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from daq_app.analyst.process import Analyst
from daq_app.analyst.state import Problem
from daq_app.batch.pool import by_processes, compute_visit
from daq_app.child_process import interpreter
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import Connect, Device, Failed, Gone
from daq_app.window.live_model_process import LiveModel
from daq_app.window.stroke_quality import Judge
from sessions.statistics.visit import VisitOptions
from solver.verification import processes

PROGRAM = Path(__file__).parents[2]
OURS = {"daq_app", "drivers", "sessions", "simulators", "solver"}
LATE = ("argparse", "drivers", "json", "numpy", "random", "sqlite3", "solver")  # Python itself has no need of them
DEADLINE = 300.0  # loops that were never compiled on this machine take a minute or two [s]


@cache
def every_name():
    return {*sys.stdlib_module_names, *packages_distributions()} | OURS


@pytest.fixture
def malicious(tmp_path, monkeypatch):
    """A current folder with a module of every name there is; each leaves a file beside it when it is run."""
    folder = tmp_path / "downloads"
    folder.mkdir()
    for name in every_name() - {"__main__"}:
        if name.isidentifier():
            text = f"open({str(tmp_path / 'run')!r}, 'a').write({name!r} + ' ')\nraise SystemExit(77)\n"
            (folder / f"{name}.py").write_text(text)
    monkeypatch.chdir(folder)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    yield folder
    assert not (tmp_path / "run").exists(), (tmp_path / "run").read_text()


def wait_for(poll):
    start = time.monotonic()
    while time.monotonic() - start < DEADLINE:
        if (answer := poll()) is not None:
            return answer
        time.sleep(0.02)
    raise AssertionError("nothing was said in time")


@pytest.mark.usefixtures("malicious")
def test_the_recorder_runs_nothing_that_lies_in_the_current_folder():
    with Recorder.start() as recorder:
        recorder.send(Connect("sim:?seed=7&rate=100"))
        ends = (Device, Failed, Gone)
        first = wait_for(lambda: next((r for r in recorder.poll(0.1) if isinstance(r, ends)), None))
    assert isinstance(first, Device)


@pytest.mark.slow
@pytest.mark.usefixtures("malicious")
def test_the_live_model_runs_nothing_that_lies_in_the_current_folder():
    model = LiveModel()
    model.prepare()
    process = model._child.process
    try:

        def ready():
            model.poll()
            return True if model.problem or not model._under_way else None

        wait_for(ready)
        assert model.problem == ""
    finally:
        model.close()
        process.join()


@pytest.mark.slow
@pytest.mark.usefixtures("malicious")
def test_the_watch_over_takes_runs_nothing_that_lies_in_the_current_folder():
    judge = Judge(lambda _: None)
    judge.prepare()
    assert judge._worker.submit(os.getpid).result(DEADLINE) != os.getpid()
    judge._worker.shutdown()


@pytest.mark.slow
@pytest.mark.usefixtures("malicious")
def test_the_analysts_work_runs_nothing_that_lies_in_the_current_folder(tmp_path):
    analyst = Analyst(tmp_path / "no session")
    process = analyst._child.process
    try:
        problem = wait_for(lambda: next((message for message in analyst.poll() if isinstance(message, Problem)), None))
        assert "holds no recording" in problem.sentence
    finally:
        analyst.close()
        process.join()


@pytest.mark.slow
@pytest.mark.usefixtures("malicious")
def test_the_pool_of_a_study_runs_nothing_that_lies_in_the_current_folder(tmp_path):
    ((_, answer),) = by_processes(compute_visit, {"none": (tmp_path / "none", VisitOptions())}, 1)
    assert "holds no recording" in answer


@pytest.mark.slow
def test_processes_that_are_timed_run_nothing_that_lies_in_the_current_folder(malicious):
    commands = [command for _, command in processes._commands(malicious, tuple(interpreter()))]
    for command in (commands[1], commands[2], [*commands[-1][:-3], "verify", "--help"]):
        process = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE, check=False)
        assert process.returncode == 0, process.stderr


def run(words, **more):
    """Run a program in the current folder, the window off the screen."""
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "PYTHONPATH": ""}
    return subprocess.run(words, capture_output=True, text=True, env=environment, check=False, **more)


@pytest.mark.usefixtures("malicious")
def test_the_command_line_runs_nothing_that_lies_in_the_current_folder(tmp_path):
    program = Path(sys.executable).with_name("daq-app")
    session = ("run", "sensotact-friction", "--scores-only", "--subject", "P01", "--headless")
    out = ("--simulate-subject", "1", "--pace", "200", "--out", tmp_path / "P01", "--json")
    process = run([program, *session, *out], timeout=2 * DEADLINE)
    assert process.returncode == 0, process.stderr
    assert (tmp_path / "P01" / "MANIFEST.json").exists()


def test_the_program_started_as_a_module_leaves_the_current_folder(malicious):
    for path in malicious.iterdir():
        if path.stem not in LATE:
            path.unlink()
    process = run([sys.executable, "-m", "daq_app", "verify", "nothing"], timeout=DEADLINE)
    assert "holds no recording" in process.stderr


@pytest.mark.slow
@pytest.mark.qt
@pytest.mark.usefixtures("malicious")
def test_the_window_and_its_processes_run_nothing_that_lies_in_the_current_folder():
    program = subprocess.Popen(
        [Path(sys.executable).with_name("daq-app")],
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
        stderr=subprocess.PIPE,
        text=True,
    )
    with pytest.raises(subprocess.TimeoutExpired):
        program.communicate(timeout=8.0)  # its recorder, live model and watch over takes begin within it
    program.terminate()
    assert "Error" not in program.communicate()[1]


def test_child_processes_start_in_one_place():
    starts = ("sys.executable", "get_context(", "multiprocessing.Process(", "fork(")
    files = [path for folder in sorted(OURS) for path in (PROGRAM / folder).rglob("*.py")]
    names = {path.name for path in files if any(words in path.read_text(encoding="utf-8") for words in starts)}
    assert names == {"child_process.py"}
