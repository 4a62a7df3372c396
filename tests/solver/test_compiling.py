"""Loops are compiled once on a machine, whoever comes first, and Ctrl-C stops a compilation."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from solver import _kernels
from solver import _kernels as compiling
from solver._kernels import bind_arguments, contact_system
from solver.progress import listening, report_progress

SCRIPT = """
import numpy as np
from solver._kernels import contact_system
from solver._kernels import bind_arguments
from solver.progress import listening
out = np.zeros(3)
with listening(lambda doing, _: print(doing)):
    contact_system.tributary(np.linspace(0.0, 3.0, 3), np.array([0, 1, 0], np.int32), out)
print(*out)
"""
COMPILED = "compiling tributary, loop number 1, once on this machine"
LENGTHS = "0.5 2.0 0.5"  # Simpson's rule


def start_process(folder):
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT], env=os.environ | {"NUMBA_CACHE_DIR": str(folder)}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def read_lines(process):
    return process.communicate(timeout=300)[0].splitlines()


def test_processes_that_start_together_compile_a_loop_and_those_after_them_find_it(tmp_path):
    processes = [start_process(tmp_path) for _ in range(2)]
    for lines in [read_lines(process) for process in processes]:
        assert lines[-1] == LENGTHS
        assert lines[0] in (COMPILED, LENGTHS)
    assert read_lines(start_process(tmp_path)) == [LENGTHS]


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_the_process_that_compiles_the_loops_gives_the_bits_of_those_that_find_them(tmp_path, kinematics):
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'[friction]\nmu = 0.5\ntau_max = 0.01\n[loading]\nindentation = 1.5\n[solve]\nkinematics = "{kinematics}"\n',
        encoding="utf-8",
    )

    def solve_in_process():
        command = [sys.executable, "-m", "daq_app", "solve", "--json", str(scene)]
        process = subprocess.run(
            command, env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}, capture_output=True, text=True, check=True
        )
        numbers = json.loads(process.stdout)
        durations = [name for name in numbers if name.endswith("_s")]
        return "once on this machine" in process.stderr, {k: v for k, v in numbers.items() if k not in durations}

    (compiling_it, first), (compiling_again, second) = solve_in_process(), solve_in_process()
    assert (compiling_it, compiling_again) == (True, False)
    assert first == second


def test_code_of_other_sources_is_not_taken(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiling, "_FOLDER", tmp_path)
    loop = tmp_path / "loop.py"
    loop.write_text("one", encoding="utf-8")
    first_folder = compiling._cache_folder()
    loop.write_text("two", encoding="utf-8")
    second_folder = compiling._cache_folder()
    assert first_folder.parent == second_folder.parent == tmp_path
    assert first_folder != second_folder
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(second_folder))  # a process that this one started
    assert compiling._cache_folder() == second_folder


def test_code_lies_beside_the_sources_only_where_nobody_else_may_write(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(compiling, "_FOLDER", tmp_path)
    tmp_path.chmod(0o700)
    assert compiling._cache_folder().is_relative_to(tmp_path)
    tmp_path.chmod(0o777)
    assert not compiling._cache_folder().is_relative_to(tmp_path)


@pytest.fixture
def ctrl_c():
    """Let Ctrl-C reach this process, which a shell that starts it in the background prevents."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield lambda: os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_that_is_lost_in_llvm_stops_when_the_loop_is_compiled(ctrl_c):
    watch, event = _kernels._Compilation(), SimpleNamespace(data={"dispatcher": contact_system.tributary})
    messages = []
    with listening(lambda doing, _: messages.append(doing)):
        report_progress("solving")
        watch.on_start(event)
        with pytest.raises(KeyboardInterrupt):  # which LLVM would print and lose
            ctrl_c()
        with pytest.raises(KeyboardInterrupt):
            watch.on_end(event)
    assert messages == ["solving", COMPILED, "solving"]


def test_ctrl_c_ends_a_first_compilation(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text("[friction]\nmu = 0.3\n[loading]\nindentation = 1.0\n", encoding="utf-8")
    program = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from daq_app.__main__ import main; sys.exit(main())"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, "solve", str(scene)], env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    stderr = b""
    while b"Compiling the loops" not in stderr:
        stderr += process.stderr.read1()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)  # one loop's time on a busy machine
    assert process.returncode == 130


def test_small_arrays_of_another_order_are_taken_too():
    x, out = np.repeat(np.linspace(0.0, 3.0, 3), 2), np.zeros(3)
    contact_system.tributary(x[::2], np.array([0, 1, 0], np.int32), out)
    np.testing.assert_allclose(out, [0.5, 2.0, 0.5], rtol=1e-15)


def test_bound_arguments_stay_and_those_of_other_types_find_their_own_code():
    at, out = np.array([0, 1, 0], np.int32), np.zeros(3)
    lengths = bind_arguments(contact_system.tributary, at, out)
    for x in (np.linspace(0.0, 3.0, 3), np.repeat(np.linspace(0.0, 3.0, 3), 2)[::2]):
        out[:] = 0.0
        lengths(x)
        np.testing.assert_allclose(out, [0.5, 2.0, 0.5], rtol=1e-15)


def test_nothing_of_the_program_imports_the_tests_oracles():
    root = Path(compiling.__file__).parents[2]
    for package in ("solver", "sessions", "daq_app"):
        for file in (root / package).rglob("*.py"):
            assert "tests.solver" not in file.read_text(encoding="utf-8"), file
