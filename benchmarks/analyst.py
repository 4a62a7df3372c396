"""How soon the analyst's window knows a session, and how soon it lets go: python -m benchmarks.analyst SESSION.

Processor times are those of the process that does the work; wall times depend on what else the machine does.
"""

import argparse
import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

STOPS = 5


def main() -> None:
    """Open a copy of a session, move a window, draw a history, and stop the work again and again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("session", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / options.session.name
        shutil.copytree(options.session, folder)
        _work(folder)
        _stops(folder)


def _work(folder: Path) -> None:
    """Print the processor time of each request."""
    start = time.process_time()
    from daq_app.analyst import state as m
    from daq_app.analyst.work import Work

    print(f"loading the work                 {time.process_time() - start:6.2f} s")
    start = time.process_time()
    delays: dict[str, float] = {}
    messages: list[m.Reply] = []

    def send(message: m.Reply) -> None:
        delays.setdefault(type(message).__name__, time.process_time() - start)
        messages.append(message)

    work = Work(folder, send)
    work.go_on()
    print(
        f"trials and strokes are known after {delays['ReportReady']:4.2f} s, "
        f"the first finger after {delays['TrialAnswer']:.2f} s"
    )
    answers = sum(isinstance(message_, m.TrialAnswer) for message_ in messages)
    print(f"all {answers} trials are answered after {time.process_time() - start:4.2f} s")
    report = next(message_.report for message_ in messages if isinstance(message_, m.ReportReady))
    stroke = next(finding for finding in report.strokes if finding.steady is not None)
    for name, request in (
        (
            "a moved edge, until numbers follow",
            m.Move(stroke.number, "steady begin", stroke.steady[0] + 0.05, "B", "b"),
        ),
        ("undo", m.Undo("B")),
        ("readings of a trial", m.ShowReadings(stroke.number)),
        ("history of a finger", m.ShowHistory((stroke.trial, stroke.number))),
        ("first picture of the session", m.Draw("course")),
        ("second picture", m.Draw("friction")),
    ):
        start = time.process_time()
        work.do(request)
        print(f"{name:36s} {time.process_time() - start:4.2f} s")
    _painting(next(message_.film for message_ in messages if isinstance(message_, m.FingerHistory)))


def _painting(film) -> None:  # noqa: ANN001
    """Print the time of painting a state of the finger."""
    from PySide6.QtWidgets import QApplication
    from shiboken6 import delete

    from daq_app.analyst.frame import FIELD_CHOICES
    from daq_app.qt.finger_canvas import FingerCanvas, Look
    from daq_app.qt.tokens import LIGHT

    application = QApplication([])
    canvas = FingerCanvas(LIGHT)
    canvas.resize(520, 560)
    for near in (False, True):
        times: list[float] = []
        for frame in film.frames[::4]:
            canvas.show_frame(frame, "", Look(FIELD_CHOICES[0], (0.0, 30.0), near))
            start = time.process_time()
            canvas.grab()
            times.append(time.process_time() - start)
        print(
            f"painting the {'contact' if near else 'finger '}                  {1e3 * statistics.median(times):5.0f} ms"
        )
    delete(canvas)  # a widget that outlives its application makes the process end with a fault
    del application


def _stops(folder: Path) -> None:
    """Print the time from a stop to its answer while the model is at work."""
    from daq_app.analyst import state as m
    from daq_app.analyst.process import Analyst

    delays: list[float] = []
    for _ in range(STOPS):
        analyst = Analyst(folder)
        _until(analyst, m.TrialAnswer)
        start = time.monotonic()
        analyst.ask(m.Stop())
        _until(analyst, m.Cancelled)
        delays.append(time.monotonic() - start)
        analyst.close()
    median, longest = 1e3 * statistics.median(delays), 1e3 * max(delays)
    print(f"a stop is answered after {median:.0f} ms by the wall, the longest {longest:.0f} ms")


def _until(analyst, reply_type: type) -> None:  # noqa: ANN001
    while not any(isinstance(reply, reply_type) for reply in analyst.poll()):
        time.sleep(0.001)


if __name__ == "__main__":
    main()
