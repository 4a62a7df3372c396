"""Processor time of a frame of Run's plots: painted by hand, and with pyqtgraph at its best, in turns.

Run: python -m benchmarks.live_plots [--frames 300]. Both draw in memory the same columns of the last 10 s, with the
marks of a stroke, in the same widgets' sizes at 1920x1080.
"""

import argparse
import os
import time

import numpy as np

SECONDS = 10.0
STEP = 1 / 60  # of time between two frames [s]
SIZES = ((700, 230), (700, 150), (700, 150), (700, 150), (560, 110), (560, 110))  # of the plots [px]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=300, help="of each kind")
    frames = parser.parse_args().frames
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from PySide6.QtWidgets import QApplication

    application = QApplication([])
    kinds = {"painted by hand": _by_hand(), "pyqtgraph": _by_pyqtgraph()}
    taken: dict[str, list[float]] = {name: [] for name in kinds}
    for number in range(frames + 10):
        now = STEP * number
        for name, draw in kinds.items():
            began = time.process_time()
            draw(now)
            application.processEvents()
            if number >= 10:  # the first frames lay everything out
                taken[name].append(1000 * (time.process_time() - began))
    for name, each in taken.items():
        print(f"{name}: {np.mean(each):.2f} ms of the processor a frame, {np.percentile(each, 99):.2f} at 99 %")


def _values(now: float, rows: int, columns: int):  # noqa: ANN202
    at = np.linspace(now - SECONDS, now, columns)
    return at, np.stack([2.0 + np.sin(3.0 * at + row) + 0.1 * np.sin(200.0 * at) for row in range(rows)])


def _by_hand():  # noqa: ANN202
    from daq_app.qt.live_panel import AXES, PLOTS, SED
    from daq_app.qt.live_plot import LivePlot
    from daq_app.window.course_state import Mark
    from daq_app.window.live_model import MODEL_CHANNELS
    from daq_app.window.live_trace import CHANNELS, Columns

    plots = [LivePlot(*plot) for plot in PLOTS]
    plots += [LivePlot(*SED, MODEL_CHANNELS), *(LivePlot(*plot) for plot in AXES)]
    _show(plots)

    def draw(now: float) -> None:
        marks = [Mark("onset", now - 4, now - 4), Mark("steady", now - 3, now - 1), Mark("lift", now - 1, now - 1)]
        for plot, (wide, _) in zip(plots, SIZES, strict=True):
            rows = len(MODEL_CHANNELS if plot is plots[3] else CHANNELS)
            plot.show_columns(Columns(*_values(now, rows, wide // 2)), now, marks, now)

    return draw


def _by_pyqtgraph():  # noqa: ANN202
    import pyqtgraph as pg

    from daq_app.qt.live_panel import AXES, PLOTS, SED

    plots, curves, marks = [], [], []
    for _, named, scale in (*PLOTS, SED, *AXES):
        plot = pg.PlotWidget()
        plot.setXRange(-SECONDS, 0.0, padding=0.0)
        plot.setYRange(scale.low, scale.high)
        plot.disableAutoRange()
        plot.showGrid(x=False, y=True, alpha=0.2)
        curves.append([pg.PlotCurveItem(pen=pg.mkPen("k", width=1), connect="finite") for _ in named])
        lines = [pg.InfiniteLine(), pg.InfiniteLine(), pg.LinearRegionItem(movable=False)]
        for item in (*curves[-1], *lines):
            plot.addItem(item, ignoreBounds=True)
        marks.append(lines)
        plots.append(plot)
    _show(plots)

    def draw(now: float) -> None:
        for _plot, own, (onset, lift, steady), (wide, _) in zip(plots, curves, marks, SIZES, strict=True):
            at, values = _values(now, len(own), wide // 2)
            for curve, row in zip(own, values, strict=True):
                curve.setData(at - now, row, skipFiniteCheck=True)
            onset.setPos(-4 - 1e-6 * now)  # they move with the readings
            lift.setPos(-1 - 1e-6 * now)
            steady.setRegion((-3 - 1e-6 * now, -1 - 1e-6 * now))

    return draw


def _show(plots) -> None:  # noqa: ANN001
    for plot, size in zip(plots, SIZES, strict=True):
        plot.resize(*size)
        plot.show()


if __name__ == "__main__":
    main()
