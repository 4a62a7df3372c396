"""How fast the net-ft driver reads the simulated box, what it loses, how old its readings are and what it costs.

The box runs in a process of its own, so that the CPU share is the driver's alone: its receiving thread, and a reader
that asks every few milliseconds as a session does. The age of a reading is counted from the instant it was taken in
the box (both processes share the machine's monotonic clock) to its hand-over, newest reading of each hand-over.

    python -m benchmarks.net_ft_throughput [--seconds 10] [--every 2] [--rates 200 1000 7000 14000 28000]

Rates above 7000 Hz tell the box that time runs faster.
"""

import argparse
import multiprocessing
import time
from multiprocessing.connection import Connection

import numpy as np

from drivers.catalog import open_transducer
from drivers.clock import Clock, PacedClock, RealClock
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox

TOP = 7000  # [Hz] of the box itself


def main() -> None:
    """Print a row for each rate."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seconds", type=float, default=10.0)
    options.add_argument("--every", type=float, default=2.0, help="the reader's pause between two hand-overs [ms]")
    options.add_argument("--rates", type=int, nargs="+", default=[200, 1000, 7000, 14000, 28000])
    given = options.parse_args()
    print(f"{'':>8} {'received':>10} {'of them':>8} {'':>9} {'age of newest [ms]':>19} {'CPU':>8}")
    print(f"{'rate Hz':>8} {'a second':>10} {'lost':>8} {'malformed':>9} {'p50':>9} {'p99':>9} {'% core':>8}")
    for rate in given.rates:
        print(row(rate, given.seconds, given.every * 1e-3), flush=True)


def row(rate: int, seconds: float, every: float) -> str:
    """Measure one rate [Hz] for so many real seconds, asking `every` so many seconds."""
    factor = max(1.0, rate / TOP)
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=serve, args=(min(rate, TOP), factor, theirs))
    process.start()
    uri, origin = ours.recv()
    transducer = open_transducer(uri, clock(factor))
    transducer.start()
    ages: list[float] = []
    began, used, received = time.monotonic(), time.process_time(), transducer.health.received
    while time.monotonic() - began < seconds:
        block = transducer.read(0.1 * factor)
        if len(block):
            ages.append(time.monotonic() - origin - float(block.counter[-1]) / 7000.0 / factor)
        time.sleep(every)
    wall, used, received = (
        time.monotonic() - began,
        time.process_time() - used,
        transducer.health.received - received,
    )
    health = transducer.health
    transducer.close()
    ours.send("end")
    process.join()
    p50, p99 = np.percentile(ages, [50, 99]) * 1e3
    return (
        f"{rate:8d} {received / wall:10.0f} {health.lost:8d} {health.malformed:9d} "
        f"{p50:9.2f} {p99:9.2f} {100 * used / wall:8.1f}"
    )


def serve(rate: int, factor: float, pipe: Connection) -> None:
    """Be the other process: serve a box until told to end. First tell its address and when its time began [s]."""
    box = NetFtBox(Bench(1), clock(factor), rate=rate)
    box.start()
    pipe.send((box.uri, time.monotonic() - box.now() / factor))
    pipe.recv()
    box.close()


def clock(factor: float) -> Clock:
    """Return a clock that runs `factor` times as fast as real."""
    return RealClock() if factor == 1.0 else PacedClock(factor)


if __name__ == "__main__":
    main()
