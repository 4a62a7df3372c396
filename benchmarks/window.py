"""What the window costs: first paint, frames, blocking and latencies at 7000 readings a second, the recorder's lag.

Run: python -m benchmarks.window [--seconds 20] [--rate 7000] [--size 1920x1080]. It draws in memory, with the processor
alone; a session with simulated people runs meanwhile. Times by the clock depend on what else the computer does, whose
load is shown; processor times hardly do.
"""

import argparse
import contextlib
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np
import psutil

BEAT = 5  # interval of a timer in the event loop [ms]
FIRST_PAINT = """
import os, sys, time
sys.argv = ["daq-app"]
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
from PySide6.QtWidgets import QApplication
from daq_app.qt.start import open_window
application = QApplication([])
window = open_window(application)
window.show()
application.processEvents()
print(time.time(), sum(os.times()[:2]), flush=True)
window.bridge._client.close()
os._exit(0)
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rate", type=int, default=7000)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--shown", type=int, default=10, help="seconds shown in the plots")
    parser.add_argument("--repeats", type=int, default=5, help="of the first paint")
    options = parser.parse_args()
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    print(f"load of this computer: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    _first_paint(options.repeats)
    _session(options)
    print(f"load of this computer: {os.getloadavg()[0]:.1f}")


def _first_paint(repeats: int) -> None:
    wall, processor = [], []
    for _ in range(repeats + 1):
        start = time.time()
        output = subprocess.run([sys.executable, "-c", FIRST_PAINT], capture_output=True, text=True, check=True).stdout
        paint_time, cpu = map(float, output.split())
        wall.append(paint_time - start)
        processor.append(cpu)
    print(
        f"first paint (warm, median of {repeats}): {statistics.median(wall[1:]):.2f} s from start, "
        f"{statistics.median(processor[1:]):.2f} s of the processor"
    )


def _session(options: argparse.Namespace) -> None:
    """Run a session of simulated people with the window drawing, and watch its event loop."""
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    from daq_app.qt import start

    start.SIMULATED_BENCH = f"sim:?seed=7&rate={options.rate}"
    observations = _Observations()
    application = QApplication([])
    window = start.open_window(application)
    window.resize(*map(int, options.size.split("x")))
    window.show()
    _until(lambda: window.bridge.state.bench.link == "open")
    window.live.show_seconds(options.shown)
    heart = QTimer()
    heart.setInterval(BEAT)
    heart.timeout.connect(lambda: observations.beat(window))
    with tempfile.TemporaryDirectory() as folder:
        window.page.folder.setText(folder)
        window.page.subject.setText("B01")
        window.page.simulated.setChecked(True)
        window.act("primary")
        _until(lambda: window.bridge.state.session is not None and window.bridge.model.provisional is not None)
        _for(3.0)
        observations.begin(window)
        heart.start()
        earlier = _processor()
        _for(options.seconds)
        cpu = {name: total - earlier.get(name, 0.0) for name, total in _processor().items()}
        heart.stop()
        print(f"{options.rate} readings a second, {options.shown} s shown, {options.size}, {options.seconds:g} s long:")
        observations.report(options.seconds, cpu)
        print(f"  readings lost: {window.bridge.state.bench.health.lost}")
        window.bridge.end()
        with contextlib.suppress(subprocess.TimeoutExpired):
            window.bridge._client._process.wait(20.0)


class _Observations:
    """Records of the window's paints, and of the beats of a timer in its event loop."""

    def __init__(self) -> None:
        """Watch every plot made from now on."""
        from daq_app.qt.live_plot import LivePlot

        self.window = None
        self.paints: list[float] = []  # instants of a painted frame [s]
        self.late: list[float] = []  # delay of a beat beyond its interval [s]
        self.busy: list[float] = []  # processor time between two beats: the delay on an idle machine [s]
        self.behind: list[float] = []  # recorder to device [ms]
        self.age: list[float] = []  # from a reading's arrival to the paint that shows it [s]
        self.model_age: list[float] = []  # from a reading's arrival to the paint of the SED it led to [s]
        self.predictions = 0
        paint = LivePlot.paintEvent

        def paint_and_note(plot: LivePlot, event: object) -> None:
            paint(plot, event)
            self._note(plot)

        LivePlot.paintEvent = paint_and_note

    def begin(self, window: object) -> None:
        """Start counting."""
        for values in (self.paints, self.late, self.busy, self.behind, self.age, self.model_age):
            values.clear()
        self.window, self.predictions = window, window.bridge.model.predictions
        self._last, self._own, self._newest_ns, self._prediction = time.perf_counter(), time.thread_time(), 0, None

    def beat(self, window: object) -> None:
        """Record the delay of a beat, and the processor time since the previous one."""
        now, own = time.perf_counter(), time.thread_time()
        self.late.append(now - self._last - BEAT / 1000)
        self.busy.append(own - self._own)
        self.behind.append(window.bridge.state.bench.health.lag_ms)
        self._last, self._own = now, own

    def _note(self, plot: object) -> None:
        """Record the paint of a plot and the age of its newest reading."""
        if self.window is None:
            return
        bridge, now = self.window.bridge, time.monotonic()
        if plot is self.window.live.plots[0]:
            self.paints.append(time.perf_counter())
            blocks = bridge.feed._take
            received = int(blocks[-1].received_ns[-1]) if blocks else self._newest_ns
            if received != self._newest_ns:
                self.age.append(now - (1e-9 * received - bridge.session_offset))
                self._newest_ns = received
        elif plot is self.window.live._model_plot and bridge.model.provisional not in (None, self._prediction):
            self._prediction = bridge.model.provisional
            self.model_age.append(now - (1e-9 * self._prediction.received_ns - bridge.session_offset))

    def report(self, seconds: float, cpu: dict[str, float]) -> None:
        """Print the records of `seconds` seconds; `cpu` is processor time by process [s]."""
        count = self.window.bridge.model.predictions - self.predictions
        print(f"  frames: {len(self.paints) / seconds:.0f} a second, {_parts(np.diff(self.paints))} ms apart")
        print(f"  processor of the window: {1000 * cpu['window'] / len(self.paints):.1f} ms a frame, all it does")
        print("  processor by process: " + ", ".join(f"{name} {cpu_s / seconds:.2f}" for name, cpu_s in cpu.items()))
        late, busy = (sum(x > 0.05 for x in values) for values in (self.late, self.busy))
        print(f"  between two turns of the event loop: {_parts(self.late)} ms, over 50 ms {late} times")
        print(f"  of that its own work: {_parts(self.busy)} ms, over 50 ms {busy} times")
        print(f"  from a reading's arrival to the paint that shows it: {_parts(self.age)} ms")
        print(f"  to the paint of the SED it leads to: {_parts(self.model_age)} ms, {count / seconds:.0f} a second")
        print(f"  recorder: {np.median(self.behind):.1f} ms behind at the median, {max(self.behind):.1f} ms at most")


def _processor() -> dict[str, float]:
    """Return the processor time of the window's process and of its child processes [s]."""
    seconds = {"window": sum(os.times()[:2])}
    for process in psutil.Process().children():
        with contextlib.suppress(psutil.Error):
            name = "recorder" if "daq_app.recorder" in process.cmdline() else f"helper {process.pid}"
            seconds[name] = sum(process.cpu_times()[:2])
    return seconds


def _parts(seconds: object) -> str:
    values = 1000 * np.asarray(seconds)
    return f"{np.median(values):.1f} median, {np.percentile(values, 99):.1f} at 99 %, {values.max():.1f} greatest"


def _for(seconds: float) -> None:
    end = time.monotonic() + seconds
    _until(lambda: time.monotonic() >= end)


def _until(condition: Callable[[], bool]) -> None:
    from PySide6.QtCore import QEventLoop, QTimer

    loop = QEventLoop()
    timer = QTimer()
    timer.setInterval(20)
    timer.timeout.connect(lambda: condition() and loop.quit())
    timer.start()
    loop.exec()


if __name__ == "__main__":
    main()
