import importlib
import json
import os
import shlex
import signal
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest
from driver_courses import identity_or_reason

from daq_app.cli import main as cli
from daq_app.cli.main import VERBS, run
from daq_app.cli.verbs import simulate
from daq_app.simulation.wiring import WIRES


def test_without_arguments_the_verbs_are_listed_and_the_command_line_counts_as_wrong(capsys):
    assert run([]) == 2
    output = capsys.readouterr().err
    assert all(verb in output for verb in VERBS)


def test_the_version_is_that_of_the_project(capsys):
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"daq-app {project['version']}\n"


def test_an_unknown_verb_is_one_sentence_and_exit_code_2(capsys):
    assert run(["fly"]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    assert "fly" in output.err


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself_within_the_terminal_with_an_example(verb, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run([verb, "--help"]) == 0
    output = capsys.readouterr().out
    usage_and_explanation = output.partition("\nexample:")[0]
    assert "\n\n" in usage_and_explanation
    assert all(len(line) <= 80 for line in usage_and_explanation.splitlines())
    module = importlib.import_module(f"daq_app.cli.verbs.{verb.replace('import', 'import_').replace('-', '_')}")
    assert module.EXAMPLE in output
    assert "--json" in output


@pytest.mark.parametrize("verb", ["analyse", "predict", "report", "verify"])
def test_a_missing_session_is_one_sentence_and_exit_code_1(verb, tmp_path, capsys):
    assert run([verb, str(tmp_path / "nowhere")]) == 1
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    assert "nowhere" in output.err


def test_a_missing_scene_is_one_sentence_and_exit_code_1(tmp_path, capsys):
    assert run(["solve", str(tmp_path / "nowhere.toml")]) == 1
    assert "nowhere.toml" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (
            "[friction]\nmu = 0.3\n[loading]\nindentation = 1.5\n[materials.fat]\nE = 0.034\nnu = 0.5\n",
            "materials.fat.nu",
        ),
        ("[friction]\nmu = -1\n[loading]\nindentation = 1.5\n", "friction.mu"),
        ("[friction]\nmu = 0.3\n[loading]\nindentation = 1.5\nslip = 1\n", "loading.slip"),
        ("[friction]\nmu = 'much'\n[loading]\nindentation = 1.5\n", "friction.mu"),
        ("[friction]\nmu = 0.3\n", "loading"),
        ("mu = \n", "TOML"),
    ],
)
def test_a_wrong_scene_names_key_value_and_what_is_allowed_with_exit_code_2(text, key, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(text)
    assert run(["solve", str(scene)]) == 2
    output = capsys.readouterr()
    assert key in output.err
    assert output.err.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["solve"],
        ["demo", "--seed", "x"],
        ["demo", "--seed", "-1"],
        ["simulate", "net-ft", "--rate", "0"],
        ["simulate", "net-ft", "--factor", "0"],
        ["simulate", "net-ft", "--seed", "-1"],
        ["simulate", "digital-ft", "--baud", "9600"],
        ["simulate", "serial-ft", "--baud", "7"],
        ["simulate", "carrier-pigeon"],
        ["devices", "probe"],
        ["analyse", "a", "--unheard-of"],
        ["import", "a.csv", "--units", "N"],
    ],
)
def test_a_wrong_command_line_is_one_sentence_and_exit_code_2(arguments, capsys):
    assert run(arguments) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["study", "a", "--workers", "many"], "--workers 'many' is not allowed: a whole number from 1 to 1024"),
        (["solve", "a", "--row", "deep"], "--row 'deep' is not allowed: it must be a number; 'daq-app solve --help'"),
        (["decide", "a", "--drop", "--trial", "1.5"], "--trial '1.5' is not allowed: it must be a whole number;"),
        (["simulate", "net-ft", "--factor", "-inf"], "--factor -inf is not allowed: 0.01 to 1000"),
        (["simulate", "net-ft", "--factor", "1,5"], "'1,5' is not allowed: 0.01 to 1000, with a decimal point"),
        (["solve", "a", "--row", "0,5"], "'0,5' is not allowed: it must be a number, with a decimal point;"),
        (["study", "--power", "effect=2,5"], "NAME=VALUE, such as effect=20, with a decimal point"),
    ],
)
def test_what_is_no_number_is_refused_with_what_is_allowed(arguments, words, capsys):
    assert run(arguments) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("words", [["devices", "probe", "foo:"], ["run", "paired-comparison", "--device", "foo:"]])
def test_an_address_of_no_driver_is_refused_with_every_beginning_that_an_address_may_have(words, capsys, tmp_path):
    further = ["--subject", "P01", "--headless", "--out", str(tmp_path / "P01")] if "run" in words else []
    assert run([*words, *further]) == 2
    sentence = capsys.readouterr().err
    assert "there is no driver 'foo' for foo:; addresses begin with " in sentence
    beginnings = ("digital-ft://", "labjack-u6://", "net-ft://", "nidaq://", "serial-ft://", "sim:", "replay:")
    assert all(beginning in sentence for beginning in beginnings)


@pytest.mark.parametrize(
    ("content", "code", "words"),
    [
        (bytes(5 * 2**20), 1, "it holds more than 4 MB"),
        (b"\xff", 2, "byte 0 is no UTF-8 text; save the file as UTF-8"),
        (b"repeat = [", 2, "this is not TOML"),
        (b"strokes = 1", 2, "strokes is not known; allowed here: stroke, fault, repeat"),
    ],
)
def test_a_script_of_a_simulated_device_is_refused_as_every_other_file_is(tmp_path, capsys, content, code, words):
    (tmp_path / "script.toml").write_bytes(content)
    assert run(["simulate", "net-ft", "--script", str(tmp_path / "script.toml")]) == code
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["units", "steal"])
def test_a_fault_that_only_another_box_can_show_is_refused(tmp_path, capsys, kind):
    script = tmp_path / "script.toml"
    script.write_text(f'[[fault]]\nkind = "{kind}"\nfrom = 1.0\nto = 2.0\n')
    assert run(["simulate", "serial-ft", "--script", str(script)]) == 2
    assert f"script.toml: the fault '{kind}' belongs to net-ft, not to serial-ft" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["none.csv", "none.h5"])
def test_a_file_to_be_imported_that_is_not_there_is_said_to_be_so(tmp_path, capsys, name):
    assert run(["import", str(tmp_path / name), "--out", str(tmp_path / "out")]) == 1
    assert f"{name} cannot be read (No such file or directory); restore" in capsys.readouterr().err


@pytest.mark.skipif(os.name != "posix", reason="there are no pseudo-terminals on this system")
@pytest.mark.parametrize("wire", WIRES)
def test_the_simulated_device_of_a_wire_answers_at_the_address_that_is_printed_until_ctrl_c(wire, capsys, monkeypatch):
    answers = []

    def look(_):
        answers.append(identity_or_reason(wire, json.loads(capsys.readouterr().out)["address"]))
        raise KeyboardInterrupt

    monkeypatch.setattr(simulate, "time", SimpleNamespace(sleep=look))
    ports = [f"--{name}-port=0" for name in ("rdt", "tcp", "http")] if wire == "net-ft" else []
    assert run(["simulate", wire, "--json", "--seed", "7", *ports]) == 130
    assert [(answer.driver, answer.serial, answer.simulated) for answer in answers] == [(wire, "SIM00007", True)]


@pytest.mark.parametrize("name", cli._WRONG)
def test_every_failure_that_is_a_wrong_value_exists_where_it_is_looked_for(name):
    module, kind = name.rsplit(".", 1)
    assert issubclass(getattr(importlib.import_module(module), kind), Exception)


on_a_full_device = pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is always full")


@on_a_full_device
@pytest.mark.parametrize("words", [["--help"], ["--version"], ["solve", "--help"], ["window", "--help"]])
def test_an_answer_that_cannot_be_written_is_exit_code_1_and_one_sentence(words, monkeypatch):
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)  # with it no text waits in a buffer for the last flush
    with Path("/dev/full").open("w") as full:
        process = subprocess.run(
            [sys.executable, "-m", "daq_app", *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert process.returncode == 1
    (sentence,) = process.stderr.splitlines()
    assert "could not be written to standard output" in sentence


@on_a_full_device
def test_messages_that_cannot_be_written_change_no_exit_code(monkeypatch):
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    with Path("/dev/full").open("w") as full:
        words = [sys.executable, "-m", "daq_app", "nonsense"]
        assert subprocess.run(words, stderr=full, check=False).returncode == 2


@pytest.mark.skipif(os.name != "posix", reason="asks a shell")
def test_a_verb_whose_standard_streams_are_closed_does_its_work_as_with_them(tmp_path):
    words = [
        sys.executable,
        "-m",
        "daq_app",
        "translate",
        "--program",
        "--language",
        "nl",
        "--out",
        tmp_path / "nl.xlf",
    ]
    command = f"{shlex.join(map(str, words))} <&- >&- 2>&-"
    assert subprocess.run(command, shell=True, check=False).returncode == 0
    assert (tmp_path / "nl.xlf").read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.skipif(os.name != "posix", reason="no process sends itself Ctrl-C there")
def test_ctrl_c_that_comes_while_python_lets_go_of_an_object_still_stops():
    code = """
import os, signal, sys, time, types
from daq_app.__main__ import main

class Stop:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)

def verb(options, console):
    stop = Stop()
    del stop  # Python ignores what is raised in here
    time.sleep(30.0)
    return 0

signal.signal(signal.SIGINT, signal.default_int_handler)  # shells start what runs in the background without one
name = "daq_app.cli.verbs.solve"
sys.modules[name] = types.SimpleNamespace(run=verb, add_arguments=lambda parser: None, EXAMPLE="")
main()
"""
    process = subprocess.run([sys.executable, "-c", code, "solve"], capture_output=True, timeout=20, check=False)
    assert (process.returncode, process.stderr) == (130, b"daq-app: stopped\n")


@pytest.mark.skipif(os.name != "posix", reason="no process dies of a signal there")
@pytest.mark.parametrize(
    ("loaded", "words"),
    [("daq_app.cli.main", ["solve"]), pytest.param("PySide6", ["window"], marks=pytest.mark.qt)],
)
def test_ctrl_c_before_anybody_can_answer_it_ends_the_program_without_a_traceback(loaded, words):
    code = f"""
import os, signal, sys
from daq_app.__main__ import main

class Stop:
    def find_spec(self, name, *_):
        if name == "{loaded}":
            os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)  # shells start what runs in the background without one
sys.meta_path.insert(0, Stop())
main()
"""
    process = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, timeout=60, check=False)
    assert process.returncode == -signal.SIGINT  # which shells tell as 130
    assert process.stderr == b""
