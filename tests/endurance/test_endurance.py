"""Runs that take minutes: `make test-long`. Their last figures stand in docs/endurance.md."""

import os
import random
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from daq_app.wiring import connected
from drivers.clock import RealClock
from sessions.recording import Recording, RecordingError
from sessions.recording.archive import problems, seal

pytestmark = pytest.mark.slow

KILLS = 60
FULL_RATE = 7000  # [Hz]
LISTENED = 60.0  # [s]


@pytest.mark.skipif(os.name != "posix", reason="kill -9 needs POSIX")
def test_a_session_killed_at_any_moment_holds_all_that_was_said_to_be_safe(tmp_path):
    chance = random.Random(11)
    kept: list[int] = []
    for number in range(KILLS):
        folder = tmp_path / f"killed-{number}"
        words = ["run", "sensotact-friction", "--device", "sim:", "--subject", "P1", "--headless"]
        command = [sys.executable, "-m", "daq_app", *words, "--simulate-subject", "1", "--pace", "20"]
        process = subprocess.Popen([*command, "--out", str(folder)], stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 20
        while not (folder / "session.sqlite").exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(chance.uniform(0.0, 2.8))
        process.send_signal(signal.SIGKILL)
        said = process.communicate()[1]
        safe = max((int(found) for found in re.findall(r"(\d+) readings safe", said)), default=0)
        try:
            recording = Recording.open(folder)
        except RecordingError:
            assert safe == 0
            continue
        block = recording.readings()
        assert len(block) >= safe
        assert np.all(np.diff(block.sequence) == 1)
        if not (folder / "MANIFEST.json").exists():
            seal(folder)
        assert all("end" in problem or "log" in problem for problem in problems(folder))
        kept.append(len(block))
    print(f"\n{KILLS} kills: {len(kept)} recordings opened, {min(kept)} to {max(kept)} readings each, none lost")


def test_the_box_at_its_full_rate_loses_nothing_for_a_minute():
    clock = RealClock()
    with connected(f"sim:?rate={FULL_RATE}", clock) as bench:
        bench.transducer.start()
        began, numbers, lags = clock.now_ns(), [], []
        while clock.now_ns() - began < LISTENED * 1e9:
            numbers.append(bench.transducer.read(0.02).sequence)
            lags.append(bench.transducer.health.lag_ms)
        bench.transducer.stop()
        health = bench.transducer.health
    sequence = np.concatenate(numbers)
    assert health.lost == health.malformed == health.late == health.repeated == 0
    assert np.all(np.diff(sequence) == 1)
    assert len(sequence) > 0.98 * FULL_RATE * LISTENED
    print(f"\n{len(sequence)} readings, 0 lost; lag p50 {np.median(lags):.2f} ms, p99 {np.percentile(lags, 99):.2f} ms")
