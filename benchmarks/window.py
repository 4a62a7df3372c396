"""What the window costs: first paint, frame times and blocking at 7000 readings a second, and the recorder's lag.

Run: python -m benchmarks.window [--seconds 20] [--rate 7000] [--size 1920x1080]. It draws in memory, with the processor
alone; a session with simulated people runs meanwhile. Figures depend on what else the computer does: its load is shown.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

FIRST_PAINT = """
import os, sys, time
sys.argv = ["daq-app"]
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
from PySide6.QtWidgets import QApplication
from daq_app.qt.start import opened
application = QApplication([])
window = opened(application)
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
        began = time.time()
        out = subprocess.run([sys.executable, "-c", FIRST_PAINT], capture_output=True, text=True, check=True).stdout
        painted, used = map(float, out.split())
        wall.append(painted - began)
        processor.append(used)
    print(
        f"first paint (warm, median of {repeats}): {statistics.median(wall[1:]):.2f} s from start, "
        f"{statistics.median(processor[1:]):.2f} s of the processor"
    )


def _session(options: argparse.Namespace) -> None:
    """Run a session of simulated people with the window drawing, and watch its event loop."""
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    from daq_app.qt import start
    from daq_app.qt.main_window import MainWindow

    start.SIMULATED_BENCH = f"sim:?seed=7&rate={options.rate}"
    frames: list[float] = []
    lateness: list[float] = []
    busy: list[float] = []  # processor time of the loop's own thread: what is left where nobody else wants it
    lags: list[float] = []
    drawn = MainWindow._draw

    def timed(window: MainWindow) -> None:
        frames.append(time.perf_counter())
        drawn(window)

    MainWindow._draw = timed
    application = QApplication([])
    window = start.opened(application)
    window.resize(*map(int, options.size.split("x")))
    window.show()
    _until(lambda: window.bridge.state.bench.link == "open")
    window.live.show_seconds(options.shown)
    last, own = time.perf_counter(), time.thread_time()

    def tick() -> None:
        nonlocal last, own
        now = time.perf_counter()
        busy.append(time.thread_time() - own)
        own = time.thread_time()
        lateness.append(now - last - 0.005)
        lags.append(window.bridge.state.bench.health.lag_ms)
        last = now

    heart = QTimer()
    heart.setInterval(5)
    heart.timeout.connect(tick)
    with tempfile.TemporaryDirectory() as folder:
        window.page.folder.setText(folder)
        window.page.subject.setText("B01")
        window.page.simulated.setChecked(True)
        window.act("primary")
        _until(lambda: window.bridge.state.session is not None)
        _for(3.0)
        for values in (frames, lateness, busy, lags):
            values.clear()
        last, own = time.perf_counter(), time.thread_time()
        heart.start()
        used = sum(os.times()[:2])
        _for(options.seconds)
        used = sum(os.times()[:2]) - used
        heart.stop()
        state = window.bridge.state
        steps = np.diff(frames)
        print(f"{options.rate} readings a second, {options.shown} s shown, {options.size}, {options.seconds:g} s long:")
        print(f"  frames: {len(frames) / options.seconds:.0f} a second, {_parts(steps)} ms apart")
        print(f"  processor of the window: {1000 * used / len(frames):.1f} ms a frame, all it does counted")
        print(
            f"  blocking of the event loop: {_parts(lateness)} ms, over 50 ms {sum(x > 0.05 for x in lateness)} times"
        )
        print(f"  recorder: {np.median(lags):.1f} ms behind at the median, {max(lags):.1f} ms at most")
        print(f"  readings lost: {state.bench.health.lost}")
        window.bridge.end()
        for _ in range(100):
            if not Path(folder).exists():
                break
            time.sleep(0.1)
            if window.bridge._client._process.poll() is not None:
                break


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
