"""Nothing listens on the network, nothing that can run is read, and nothing personal gets into a session's files."""

import ast
import getpass
import os
import platform
from pathlib import Path
from urllib.parse import quote, unquote

import pytest
from desk import PACE, SHORT, Desk

from daq_app.cli.main import run
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import Connect, Device, People, Sealed, StartSession
from sessions.recording.provenance import without_home

ROOT = Path(__file__).parents[2]
PACKAGES = ("daq_app", "drivers", "sessions", "simulators", "solver")
# Modules that read what can run, and calls that run what was read.
RUNS = frozenset({"pickle", "cPickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "yaml"})
CALLS = frozenset({"eval", "exec", "compile", "__import__", "read_pickle"})
LISTENS = frozenset({"bind", "listen", "create_server", "serve_forever", "start_server"})
SIMULATORS = "simulators"  # the boxes of `sim:` and of `daq-app simulate`, on loopback
TABLET = Path("daq_app", "tablet", "server.py")  # asked for by `--subject-screen web` alone, on a private network


@pytest.fixture(scope="module")
def modules():
    """Every module of ours, as a tree."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return [(path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))) for path in paths]


def called(tree):
    """Names of what is called."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            function = node.func
            name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
            yield name, node


def imported(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or "").split(".")[0]


def test_no_module_reads_a_format_that_can_run(modules):
    found = []
    for path, tree in modules:
        found += [(path, name) for name in imported(tree) if name in RUNS]
        for name, node in called(tree):
            plain = isinstance(node.func, ast.Name) or name == "read_pickle"  # `re.compile` is none of these
            pickles = any(keyword.arg == "allow_pickle" for keyword in node.keywords)
            if (name in CALLS and plain) or pickles:
                found.append((path, name))
    assert found == []


def test_nothing_but_a_simulated_box_and_the_tablets_server_listens(modules):
    found = [
        (path, name)
        for path, tree in modules
        if path.parts[0] != SIMULATORS and path != TABLET
        for name, node in called(tree)
        if name in LISTENS and isinstance(node.func, ast.Attribute)
    ]
    assert found == []


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A session whose computer, user and folders have names that would be known again."""
    home = tmp_path_factory.mktemp("anna-schmidts-home")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("HOME", "USERPROFILE", "APPDATA"):
            patch.setenv(name, str(home))
        for name in ("USER", "LOGNAME", "USERNAME"):
            patch.setenv(name, "anna-schmidt")
        folder = home / "recordings" / "P07"
        with Recorder.start(PACE) as recorder:
            desk = Desk(recorder)
            recorder.send(Connect("sim:?seed=7"))
            desk.until(Device)
            recorder.send(StartSession(SHORT, str(folder), People("simulated people", 7)))
            desk.until(Sealed)
        assert run(["analyse", str(folder)]) in (0, 3)
    return folder


def test_no_file_of_a_session_names_computer_user_or_folder(recorded):
    words = {"anna", "schmidt", str(recorded), str(Path.home())}
    words |= {word for word in (platform.node(), getpass.getuser()) if len(word) > 4}
    for path in recorded.rglob("*"):
        content = path.read_bytes().lower() + path.name.lower().encode()
        assert [word for word in words if word.lower().encode() in content] == [], path


@pytest.mark.parametrize("written", [str, quote, lambda home: quote(home, safe="")])
def test_a_device_s_address_is_kept_without_the_name_of_the_user_s_home(monkeypatch, written):
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, os.path.join(os.sep, "home", "anna schmidt"))  # noqa: PTH118  as the system writes it
    uri = f"labjack-u6://?cal={written(str(Path.home() / 'FT1.cal'))}"
    assert "anna" not in without_home(uri)
    assert unquote(without_home(uri)) == f"labjack-u6://?cal=~{os.sep}FT1.cal"


def test_the_names_of_a_sessions_files_are_the_same_whoever_the_subject_is(recorded):
    names = {path.name for path in recorded.iterdir()}
    assert names == {"session.sqlite", "session.h5", "session.json", "MANIFEST.json", "analysis.json"}
    assert [path.name for path in recorded.parent.parent.iterdir()] == ["recordings"]  # nothing is kept at home
