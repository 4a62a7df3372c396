"""How fast the net-ft driver reads the simulated box, what it loses, how old its readings are and what it costs.

Three processes: the box; the driver, its receiving thread and a reader that asks every few milliseconds as a session
does, makes newtons and hands them on 60 times a second as the recorder does; and, with --draw, one that takes them and
draws six axes as the window does. Processor time is the driver's process alone. Lag is counted from a reading's arrival
to its hand-over, age from the instant it was taken in the box (all share the machine's monotonic clock), both of the
newest reading of each hand-over.

    python -m benchmarks.net_ft_throughput [--seconds 60] [--every 2] [--rates 200 1000 7000] [--draw]
    python -m benchmarks.net_ft_throughput --beyond 14000 28000 56000 112000

Beyond 7000 Hz, which no box gives, records packed before are sent by a process that does nothing else, since the
simulated box cannot keep up there; the session's clock runs faster.
"""

import argparse
import contextlib
import multiprocessing
import os
import socket
import time
from dataclasses import replace
from multiprocessing.connection import Connection

import numpy as np

from drivers.catalog import open_transducer
from drivers.clock import clock_at
from drivers.links import UdpLink
from drivers.net_ft.device import NetFtTransducer
from drivers.net_ft.wire import RECORD
from drivers.readings import ReadingBlock
from drivers.transducer import Transducer
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox

TOP = 7000  # [Hz] of the box itself
SHOWN_EVERY = 1 / 60  # [s]


def main() -> None:
    """Print a row for each rate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--every", type=float, default=2.0, help="the reader's pause between two hand-overs [ms]")
    parser.add_argument("--rates", type=int, nargs="+", default=[200, 1000, 7000])
    parser.add_argument("--beyond", type=int, nargs="+", default=[], help="rates to be sent ready packed, instead")
    parser.add_argument("--draw", action="store_true", help="let another process draw what is read")
    options = parser.parse_args()
    print(f"load of this computer: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print("           received  of them                lag [ms]      age [ms]     CPU    drawn")
    print(" rate Hz   a second     lost malformed    p50    p99    p50    p99  % core a second")
    ready = bool(options.beyond)
    for rate in options.beyond or options.rates:
        print(row(rate, options.seconds, options.every * 1e-3, drawing=options.draw, ready=ready), flush=True)
    print(f"load of this computer: {os.getloadavg()[0]:.1f}")


def row(rate: int, seconds: float, every: float, *, drawing: bool, ready: bool) -> str:
    """Measure one rate [Hz] for `seconds` real seconds, reading every `every` seconds; return the row."""
    factor = max(1.0, rate / TOP)
    context = multiprocessing.get_context("spawn")
    box_pipe, far_end = context.Pipe()
    box = context.Process(target=serve, args=(min(rate, TOP), factor, far_end))
    box.start()
    uri, origin = box_pipe.recv()
    drawer_pipe, window = context.Pipe()
    drawer = context.Process(target=draw, args=(rate, window)) if drawing else None
    if drawer is not None:
        drawer.start()
        drawer_pipe.recv()
    transducer: Transducer = open_transducer(uri, clock_at(factor))
    if ready:
        sender_pipe, far_end = context.Pipe()
        context.Process(target=send, args=(rate, seconds + 5.0, far_end), daemon=True).start()
        port, info = sender_pipe.recv(), replace(transducer.info, rate=float(TOP))
        transducer = NetFtTransducer(info, lambda _: UdpLink("127.0.0.1", port), lambda: info, clock_at(factor))
    calibration = transducer.info.calibration
    transducer.start()
    ages: list[float] = []
    lags: list[float] = []
    blocks: list[ReadingBlock] = []
    due = 0.0
    start, processor, received = time.monotonic(), time.process_time(), transducer.health.received
    while (now := time.monotonic()) - start < seconds:
        block = transducer.read(0.1 * factor)
        if len(block):
            now = time.monotonic()
            ages.append(np.nan if ready else now - origin - float(block.counter[-1]) / 7000.0 / factor)
            lags.append(transducer.health.lag_ms / 1e3 / factor)
            blocks.append(block)
        if now >= due and blocks:
            due = now + SHOWN_EVERY
            readings, blocks = ReadingBlock.concatenate(blocks), []
            wrench = calibration.wrench(readings.raw, np.zeros(6))
            if drawer is not None:
                drawer_pipe.send((readings.time, wrench))
        time.sleep(every)
    wall, processor = time.monotonic() - start, time.process_time() - processor
    health = transducer.health
    received = health.received - received
    transducer.close()
    box_pipe.send("end")
    box.join()
    frames = 0.0
    if drawer is not None:
        drawer_pipe.send(None)
        frames = drawer_pipe.recv() / wall
        drawer.join()
    lag, age = np.percentile(lags, [50, 99]) * 1e3, np.percentile(ages, [50, 99]) * 1e3
    return (
        f"{rate:8d} {received / wall:10.0f} {health.lost:8d} {health.malformed:9d} "
        f"{lag[0]:6.2f} {lag[1]:6.2f} {age[0]:6.2f} {age[1]:6.2f} {100 * processor / wall:7.1f} {frames:8.1f}"
    )


def serve(rate: int, factor: float, pipe: Connection) -> None:
    """Run the box's process until it receives a message. First send its address and the instant of its time zero."""
    box = NetFtBox(Bench(1), clock_at(factor), rate=rate)
    box.start()
    pipe.send((box.uri, time.monotonic() - box.now() / factor))
    pipe.recv()
    box.close()


def send(rate: int, seconds: float, pipe: Connection) -> None:
    """Run a box that, once asked to stream, sends `seconds` of prepacked records at `rate` per second."""
    count = round(rate * seconds)
    records = np.zeros(count, RECORD)
    records["number"] = records["counter"] = np.arange(1, count + 1)
    data, size = records.tobytes(), RECORD.itemsize
    port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    port.bind(("127.0.0.1", 0))
    pipe.send(port.getsockname()[1])
    _, asker = port.recvfrom(100)
    port.connect(asker)
    start, sent = time.monotonic(), 0
    with contextlib.suppress(ConnectionError):  # the reader has closed
        while sent < count:
            due = min(round((time.monotonic() - start) * rate), count)
            for i in range(sent, due):
                port.send(data[i * size : (i + 1) * size])
            sent = due
            time.sleep(0.0002)


def draw(rate: int, pipe: Connection) -> None:
    """Run the window's process: draw ten seconds of six axes at each hand-over; finally send the number of frames."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from PySide6.QtWidgets import QApplication

    from daq_app.qt.live_panel import AXIS_PLOTS
    from daq_app.qt.live_plot import LivePlot
    from daq_app.window.live_trace import CHANNELS, LiveTrace

    application = QApplication([])
    trace = LiveTrace(float(rate))
    plots = [LivePlot(*axis) for axis in AXIS_PLOTS]
    for plot in plots:
        plot.resize(1200, 500)
        plot.show()
    pipe.send("ready")
    frames, ended = 0, False
    while not ended:
        messages = [pipe.recv()]
        while pipe.poll():
            messages.append(pipe.recv())
        ended = messages[-1] is None
        for readings in filter(None, messages):
            values = np.full((len(CHANNELS), len(readings[0])), np.nan)
            values[:6] = readings[1].T
            trace.add(readings[0], values)
        if (newest := trace.newest) is not None:
            columns = trace.columns(newest - 10.0, newest, 1200)
            for plot in plots:
                plot.show_columns(columns, newest, (), time.monotonic())
                plot.repaint()
            application.processEvents()
            frames += 1
    with contextlib.suppress(BrokenPipeError):
        pipe.send(frames)


if __name__ == "__main__":
    main()
