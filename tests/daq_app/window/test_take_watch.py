"""The process that looks at strokes beside the window."""

import subprocess
import sys
import time
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pytest
from session_messages import GOOD, INFO, SCORE, after, log

from daq_app.recorder.messages import Live
from daq_app.window import stroke_quality
from daq_app.window.course_state import Judged
from daq_app.window.live_feed import LiveFeed
from daq_app.window.stroke_quality import Judge
from sessions.plan.plan import Frame
from sessions.run import steps


class Pool:
    """A process that judges a stroke at once, or has ended meanwhile."""

    def __init__(self, *, ended):
        self.ended = ended

    def submit(self, work, *_):
        if self.ended and work is stroke_quality.live_quality:
            raise BrokenProcessPool
        future = Future()
        future.set_result(Judged(1, 1, GOOD))
        return future


def test_a_process_that_ended_while_it_waited_for_strokes_is_replaced_at_the_next(monkeypatch):
    pools = [Pool(ended=True), Pool(ended=False)]
    monkeypatch.setattr(stroke_quality, "process_pool", lambda _: pools.pop(0))
    messages, feed = [], LiveFeed()
    judge = Judge(messages.append)
    judge.prepare()
    feed.device(INFO)
    judge.follow(steps.StartTake(1, 1), feed)
    number = np.arange(700)
    feed.add(Live(1, number, number / 100.0, number, np.zeros((700, 6)), number * 0, (0.0,) * 6), Frame())
    judge.follow(log("finger_lifted", 1, time=3.6), feed)
    judge.look(feed, after(*SCORE))
    assert messages == [Judged(1, 1, GOOD)]


def test_the_process_has_ended_once_the_judge_is_closed():
    judge = Judge(print)
    pool = judge.prepare()
    pool.submit(int).result()
    [process] = pool._processes.values()
    judge.close()
    assert process.exitcode is not None


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
    output_file = tmp_path / "told"
    with output_file.open("w") as out:
        subprocess.run([sys.executable, str(script)], stdout=out, check=False)
    worker = Path(f"/proc/{int(output_file.read_text())}")
    end = time.monotonic() + 60.0  # of a machine that hangs, not of a slow one
    while worker.exists() and time.monotonic() < end:
        time.sleep(0.05)
    assert not worker.exists()
