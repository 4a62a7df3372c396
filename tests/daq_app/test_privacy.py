"""Nothing personal gets into a session's files."""

import getpass
import os
import platform
from pathlib import Path
from urllib.parse import quote, unquote

import pytest
from desk import PACE, Desk

from daq_app.cli.main import run
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import Sealed
from sessions.recording.head import without_home


@pytest.fixture(scope="module")
def session_folder(tmp_path_factory):
    """A session whose computer, user and folders have names so long that packed readings do not hold them by chance."""
    home = tmp_path_factory.mktemp("annegret-schmidts-home")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("HOME", "USERPROFILE", "APPDATA"):
            patch.setenv(name, str(home))
        for name in ("USER", "LOGNAME", "USERNAME"):
            patch.setenv(name, "annegret-schmidt")
        folder = home / "recordings" / "P07"
        with Recorder.start(PACE) as recorder:
            desk = Desk(recorder)
            desk.begin(folder, "simulated people")
            desk.until(Sealed)
        assert run(["analyse", str(folder)]) in (0, 3)
    return folder


def test_no_file_of_a_session_names_computer_user_or_folder(session_folder):
    words = {"annegret", "schmidt", str(session_folder), str(Path.home())}
    words |= {word for word in (platform.node(), getpass.getuser()) if len(word) > 4}
    for path in session_folder.rglob("*"):
        content = path.read_bytes().lower() + path.name.lower().encode()
        assert [word for word in words if word.lower().encode() in content] == [], path


@pytest.mark.parametrize("encode", [str, quote, lambda home: quote(home, safe="")])
def test_a_device_s_address_is_kept_without_the_name_of_the_user_s_home(monkeypatch, encode):
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, os.path.join(os.sep, "home", "anna schmidt"))  # noqa: PTH118  as the system writes it
    uri = f"labjack-u6://?cal={encode(str(Path.home() / 'FT1.cal'))}"
    assert "anna" not in without_home(uri)
    assert unquote(without_home(uri)) == f"labjack-u6://?cal=~{os.sep}FT1.cal"


def test_the_names_of_a_sessions_files_are_the_same_whoever_the_subject_is(session_folder):
    names = {path.name for path in session_folder.iterdir()}
    assert names == {"session.sqlite", "session.h5", "session.json", "MANIFEST.json", "analysis.json"}
    assert [path.name for path in session_folder.parent.parent.iterdir()] == ["recordings"]  # nothing is kept at home
