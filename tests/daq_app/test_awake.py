import os
import subprocess
import sys
import time

import pytest

from daq_app.recorder import session as module
from daq_app.recorder.session import awake, holder


@pytest.mark.skipif(os.name != "posix", reason="Windows is asked by a call, not by a process")
def test_the_computer_is_held_awake_while_inside_and_no_longer(monkeypatch, tmp_path):
    mark = tmp_path / "held"
    script = f"import pathlib, time; pathlib.Path({str(mark)!r}).touch(); time.sleep(60)"
    monkeypatch.setattr(module, "holder", lambda _pid, _system: (sys.executable, "-c", script))
    processes = []
    start = subprocess.Popen
    monkeypatch.setattr(
        module.subprocess, "Popen", lambda *args, **options: processes.append(start(*args, **options)) or processes[0]
    )
    with awake() as is_asked:
        while not mark.exists():
            time.sleep(0.01)
        assert is_asked
        assert processes[0].poll() is None
    assert processes[0].poll() is not None


@pytest.mark.skipif(os.name != "posix", reason="Windows is asked by a call, not by a process")
def test_where_nobody_can_be_asked_a_session_runs_all_the_same(monkeypatch):
    monkeypatch.setattr(module, "holder", lambda _pid, _system: ("no-such-program",))
    with awake() as is_asked:
        assert not is_asked


@pytest.mark.skipif(sys.platform != "linux", reason="tail --pid is GNU's")
def test_what_holds_the_computer_awake_on_linux_ends_with_the_process_it_watches():
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    command = holder(process.pid, "linux")
    holding = subprocess.Popen(command[command.index("tail") :])
    process.communicate(b"\n")
    holding.wait(60)
    assert holder(7, "plan9") is None


def test_windows_may_sleep_again_after_a_session_that_failed(monkeypatch):
    calls = []
    monkeypatch.setattr(module.sys, "platform", "win32")
    monkeypatch.setattr(module, "_windows", calls.append)
    with pytest.raises(OSError, match="full"), awake():
        raise OSError("full")
    assert calls == [0x8000_0001, 0x8000_0000]  # ES_CONTINUOUS | ES_SYSTEM_REQUIRED, then ES_CONTINUOUS alone
