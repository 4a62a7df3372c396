"""The process that looks at strokes beside the window."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

PREPARED = """
import os, signal
from daq_app.window.stroke_quality import Judge

if __name__ == "__main__":
    judge = Judge(print)
    judge.prepare()
    judge._worker.submit(os.getpid).result()
    print(*judge._worker._processes, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc to see processes in")
def test_a_window_that_is_killed_leaves_no_process_behind(tmp_path):
    script = tmp_path / "prepared.py"
    script.write_text(PREPARED)
    told = tmp_path / "told"
    with told.open("w") as out:
        subprocess.run([sys.executable, str(script)], stdout=out, check=False)
    worker = Path(f"/proc/{int(told.read_text())}")
    end = time.monotonic() + 60.0  # of a machine that hangs, not of a slow one
    while worker.exists() and time.monotonic() < end:
        time.sleep(0.05)
    assert not worker.exists()
