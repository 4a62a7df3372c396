"""Every driver through hundreds of pulled plugs and minutes of random faults: `make test-long`."""

import contextlib
import gc
import os
import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from drivers.catalog import open_transducer
from drivers.clock import Clock, PacedClock, RealClock
from drivers.transducer import LinkLost, SetupError, Transducer
from simulators.bench import Bench
from simulators.faults import Fault, Faults
from simulators.serving import SIMULATORS
from simulators.simulator import RunningSimulator, Simulator

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="needs pseudo-terminals")]

CYCLES = 500
AWAY, CYCLE = (1.2, 1.6), 2.0  # the plug is out between these, in each cycle [s]
SIMULATED = 600.0  # of random faults [s]


@dataclass
class Run:
    """What one driver went through."""

    readings: int = 0
    lost: int = 0
    restarted: int = 0
    reopened: int = 0
    error: str = ""


def boxes(clock: Clock, faults: Callable[[Simulator], Faults], folder: Path) -> dict[str, RunningSimulator]:
    """Return every simulated device in the list, started."""
    return {name: simulator.start(Bench(3), clock, faults(simulator), folder) for name, simulator in SIMULATORS.items()}


def start(transducer: Transducer) -> None:
    """Start it as soon as its plug is in for long enough."""
    for _ in range(600):
        with contextlib.suppress(LinkLost, SetupError):
            transducer.start()
            return
        time.sleep(0.05)
    raise AssertionError("it never came back")


def follow_readings(transducer: Transducer, clock: Clock, until: float, begun_ns: int) -> Run:
    """Read until so many simulated seconds have passed; every number is received or lost, times never run back."""
    run, last, time_ = Run(), 0, 0.0
    start(transducer)
    count = 0
    while (clock.now_ns() - begun_ns) * 1e-9 < until:
        try:
            block = transducer.read(0.1)
        except LinkLost:
            run.lost += transducer.health.lost
            run.reopened += 1
            count, last, time_ = 0, 0, 0.0
            transducer.stop()
            start(transducer)
            continue
        if len(block):
            assert block.sequence[0] > last
            assert np.all(np.diff(block.sequence) > 0)
            assert block.time[0] >= time_
            last, time_ = int(block.sequence[-1]), float(block.time[-1])
            count += len(block)
            run.readings += len(block)
    transducer.stop()
    count += len(transducer.read(0.0))
    health = transducer.health
    assert health.received == count
    run.lost += health.lost
    run.restarted = health.restarted
    return run


def follow_all(clock: Clock, faults: Callable[[Simulator], Faults], folder: Path, until: float) -> dict[str, Run]:
    """Follow all drivers at once, each in a thread of its own."""
    devices = boxes(clock, faults, folder)
    runs = {name: Run(error="never ended") for name in devices}
    begun_ns = clock.now_ns()

    def follow(name: str, uri: str) -> None:
        try:
            while True:
                try:
                    transducer = open_transducer(uri, clock)
                    break
                except Exception as error:  # the plug may be out just now
                    if (clock.now_ns() - begun_ns) * 1e-9 > until:
                        raise error
            runs[name] = follow_readings(transducer, clock, until, begun_ns)
            transducer.close()
        except BaseException as error:  # noqa: BLE001 - the test reports it
            runs[name] = Run(error=f"{type(error).__name__}: {error}")

    threads = [threading.Thread(target=follow, args=(name, device.uri)) for name, device in devices.items()]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for device in devices.values():
        device.close()
        device.forget()
    return runs


def resources() -> tuple[int, int, float]:
    """Return threads, open files and resident memory [MB] of this process."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return threading.active_count(), len(list(Path("/dev/fd").iterdir())), pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from Linux's /proc")
def test_hundreds_of_pulled_plugs_leave_nothing_behind_and_every_reading_counted(tmp_path):
    faults = lambda _: Faults([Fault("unplug", *AWAY)], seed=1, repeat=CYCLE)  # noqa: E731
    follow_all(RealClock(), faults, tmp_path, 3 * CYCLE)
    threads, files, memory = resources()
    start = time.monotonic()
    runs = follow_all(RealClock(), faults, tmp_path, CYCLES * CYCLE)
    after = resources()
    for name, run in runs.items():
        assert not run.error, f"{name}: {run.error}"
        assert run.readings > 0
        assert run.lost > 0
        print(f"\n{name}: {CYCLES} unplugs, {run.readings} readings, {run.lost} lost, {run.restarted} restarts")
    assert after[:2] == (threads, files)
    assert after[2] - memory < 30.0
    print(f"{time.monotonic() - start:.0f} s; threads and files as before, memory {after[2] - memory:+.1f} MB")


def test_ten_told_minutes_of_random_faults_leave_every_reading_received_or_lost(tmp_path):
    chance = random.Random(5)

    def faults(device: Simulator) -> Faults:
        kinds = [kind for kind in (*device.tells, *device.hides) if kind not in ("reboot", "unplug")]
        begins = np.arange(2.0, SIMULATED - 10.0, 6.0)
        return Faults(
            [
                Fault(chance.choice(kinds), at, at + chance.uniform(0.2, 3.0), chance.uniform(0.05, 0.6))
                for at in begins
            ],
            seed=chance.randrange(1000),
        )

    runs = follow_all(PacedClock(4.0), faults, tmp_path, SIMULATED)
    for name, run in runs.items():
        assert not run.error, f"{name}: {run.error}"
        assert run.readings > 0
        print(f"\n{name}: {run.readings} readings, {run.lost} lost, given up and started again {run.reopened} times")
