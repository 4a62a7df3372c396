"""Pictures of every place of the window in every setting: python -m benchmarks.screenshots --out DIR.

Sizes are those of the screen in its own pixels; a scaling of 2 leaves half as many to the window. The recorder
is played: its reports are made up in advance, its readings are of the simulated bench, and no process runs.
"""

import argparse
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from msgspec import structs

from daq_app.recorder import messages as m
from drivers.calibration import Calibration, loads
from drivers.transducer import Health, TransducerInfo
from sessions.plan.plan import Frame
from sessions.plan.protocols.planning import VisitSetting, plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Acknowledged, LoggedEvent
from sessions.run import steps
from sessions.run.runner import SessionEnd, Status
from simulators.bench import RATED, Bench
from simulators.stroke import Stroke, paper_surfaces

RATE = 7000.0
FRAME = Frame("-z", "set", 20.0, "set")
CALIBRATION = Calibration("FT12345", "N, N mm", np.eye(6), np.array(RATED), "FT12345.cal, made 2025-11-03")
INFO = TransducerInfo("sim:", "sim", "SIMULATED Net F/T SI-36-0.5", "FT12345", True, RATE, RATE, CALIBRATION)
PLAN = plan(protocol("sensotact-friction"), "P07", 7, setting=VisitSetting(frame=FRAME, stroking_hand="right"))
FOLDER = "recordings/P07_sensotact-friction_20260301T143005"


class PlayedRecorder:
    """A recorder whose reports are scripted; requests of the window have no effect."""

    pid = 0

    def __init__(self) -> None:
        self._queue: list[m.Report] = []
        self._bench = Bench(3)
        self._last = 0
        self._health = health()  # last report
        self._peak = np.zeros(7)

    def play(self, *reports: m.Report) -> None:
        """Send these reports at the next poll."""
        self._queue += reports
        self._health = next((report for report in reports if isinstance(report, m.HealthReport)), self._health)

    def stroke(self, trial: int, time: float) -> None:
        """Begin the stroke of a trial's surface at an instant [s, device time]."""
        row = PLAN.trials[trial - 1]
        surface = paper_surfaces()[row.stimulus.descriptor, row.stimulus.index]
        self._bench.mount(surface)
        self._bench.begin_stroke(Stroke(surface.peak_normal_force, surface.speed, row.direction), time)

    def readings(self, until: float) -> None:
        """Send all readings up to an instant [s, device time], a tenth of a second per message."""
        while self._last < until * RATE:
            number = np.arange(self._last, min(self._last + int(RATE / 10), int(until * RATE) + 1))
            time = number / RATE
            wrench = self._bench.wrench(time)
            status = np.zeros(len(number), np.int64)
            self._queue.append(m.Live(1, number, time, number, wrench, status, (0.0,) * 6))
            load = loads(wrench, np.array(RATED)).max(axis=0)
            self._peak = np.fmax(self._peak, load)
            shares = {"load": tuple(load.tolist()), "peak": tuple(self._peak.tolist())}
            self._health = structs.replace(self._health, **shares)
            self._queue.append(self._health)
            self._last = int(number[-1]) + 1

    def send(self, request: object) -> None:
        """Do nothing."""

    def poll(self, timeout: float = 0.0) -> tuple[m.Report, ...]:  # noqa: ARG002  it does not wait
        """Return the scripted reports, or that the bench's health is the same while the script waits."""
        reports, self._queue = tuple(self._queue), []
        return reports or (self._health,)

    def close(self) -> None:
        """Do nothing."""

    def leave(self) -> None:
        """Do nothing."""


def health(**counts: int) -> m.HealthReport:
    """Return a report of a healthy bench, except for these counts."""
    return m.HealthReport(Health(received=123_456, lag_ms=2.0, **counts), 6999.7, (0.0,) * 7, (0.0,) * 7, 0)


def log_line(kind: str, trial: int | None = None, **data: object) -> LoggedEvent:
    """Return a line of the log."""
    return LoggedEvent(1, 0, kind, trial, 0, data)


def status(safe_ns: int) -> Status:
    """Return a status with readings acknowledged up to `safe_ns`."""
    return Status("", 1, 10, 1000, 0, 2.0, Acknowledged(1000, 3, safe_ns))


def score_reports(trial: int, score: float) -> tuple[m.Report, ...]:
    """Return the reports of a scored trial."""
    return (log_line("scored", trial, score=score), log_line("take_kept", trial, take=1))


TARED = m.Tared((0.008, -0.007, -0.061, 1.2, -0.4, 0.02), (0.0041,) * 3 + (0.052,) * 3, 7000, 1.0)
OPEN = (m.Device(INFO, FRAME), health(), TARED)
SIMULATED = "SIMULATED transducer and hand"
BEGINNING = (m.SessionBegun(FOLDER, PLAN, "simulated hand", SIMULATED, 0), steps.AskBegin(), status(1))
ENDED = m.SessionEnded(FOLDER, SessionEnd("every trial is done", "finished", True, 900_000, Health()), False)
CABLE_FAULT = "the transducer does not answer; check its power and the cable"
LINK_LOSS = SessionEnd(CABLE_FAULT, "device", False, 90_000, Health(lost=12))
CUT_SHORT = m.SessionEnded(FOLDER, LINK_LOSS, True)


SCALES = (1.0, 1.5, 2.0)
SIZES = ((1366, 768), (1920, 1080), (3840, 2160))
THEMES = ("light", "dark")
LOCALES = ("de_DE", "ja_JP")


def main() -> None:
    """Take pictures in every setting, each in a separate process, since Qt cannot change its scaling at run time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--setting", action="append", help="this setting alone, or these: 1366x768-1.5-dark-de_DE")
    parser.add_argument("--session", type=Path, help="a session folder: then Review's places with it too")
    parser.add_argument("--take", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.take:
        _take(options.setting[0], options.out, options.session)
        return
    for setting in options.setting or _settings():
        scale = setting.split("-")[1]
        environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "QT_SCALE_FACTOR": scale}
        command = [sys.executable, "-m", "benchmarks.screenshots", "--take", "--setting", setting]
        command += ["--session", str(options.session)] if options.session else []
        subprocess.run([*command, "--out", str(options.out)], env=environment, check=True)
        print(setting)
    print(f"{len(list(options.out.glob('*.png')))} pictures in {options.out}")


def _settings() -> list[str]:
    return [
        f"{width}x{height}-{scale:g}-{theme}-{LOCALES[number % 2]}"
        for number, ((width, height), scale, theme) in enumerate(itertools.product(SIZES, SCALES, THEMES))
    ]


def _take(setting: str, folder: Path, session: Path | None) -> None:
    from PySide6.QtCore import QLocale, QSettings
    from PySide6.QtWidgets import QApplication

    from daq_app.qt.preferences import THEME, settings

    size, scale, theme, locale = setting.split("-")
    width, height = (round(int(length) / float(scale)) for length in size.split("x"))
    QLocale.setDefault(QLocale(locale))
    folder.mkdir(parents=True, exist_ok=True)
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(folder / "settings"))
    settings().setValue(THEME, theme)
    arguments = QApplication([]), (width, height), lambda name: folder / f"{name}-{setting}.png"
    _Places(*arguments).picture_all()
    if session is not None:
        _Places(*arguments).review(session)


class _Places:
    """The window, taken to each of its places."""

    def __init__(self, application, size, path) -> None:  # noqa: ANN001
        from daq_app.qt.start import open_window

        self.application, self.path, self.recorder = application, path, PlayedRecorder()
        self.window = open_window(application, lambda: self.recorder)
        self.subject = self.window.subject
        self.window.side.show = self.subject.show
        for widget in (self.window, self.subject):
            widget.resize(*size)
        self.window.show()

    def picture_all(self) -> None:
        """Take a picture of each place."""
        trial, second, redone = PLAN.trials[0], PLAN.trials[1], PLAN.trials[5]
        self.play(*OPEN, until=3.0)
        self.picture("01-new-session")
        self.window.go_to("review")
        self.picture("01-review-empty")
        self.window.go_to("prepare")
        self.window.page.subject.setText("Ada Lovelace")
        self.window.page.seed.setText("seven")
        self.window.act("primary")
        self.picture("02-refused")
        self.window.page.seed.clear()
        self.play(*BEGINNING, until=3.5)
        self.picture("03-begin")
        self.play(steps.ShowInstruction(PLAN.blocks[0]), steps.AskMount(trial), until=3.6)
        self.picture("04-mount")
        self.picture("05-subject-instruction", self.subject)
        model = self.window.live._model
        # The model responds to readings, so send one at a time until it is ready.
        self.wait(lambda: model.provisional or self.recorder.readings((self.recorder._last + 1) / RATE))
        self.play(steps.StartTake(1, 1), steps.MeasureZero(), until=4.0)
        self.recorder.stroke(1, 4.0)
        self.play(steps.AskStroke(trial), until=5.0)
        self.picture("06-subject-stroke", self.subject)
        self.play(log_line("contact_onset", 1, time=4.7, noticed=4.71), until=6.5)
        self.wait(lambda: not model._under_way)
        self.picture("07-stroking")
        self.play(log_line("finger_lifted", 1, time=7.2, noticed=7.25), until=7.3)
        self.play(steps.AskScore(trial, PLAN.blocks[0].scale_ends), until=8.5)
        self.wait(lambda: self.window.bridge.state.session.judged_trial == 1)
        self.picture("08-scoring")
        self.picture("09-subject-line-empty", self.subject)
        line = self.subject.line
        line._take(line.answer.press(1.0, 63.0, "mouse").release())
        self.picture("10-subject-line-answered", self.subject)
        self.play(*score_reports(1, 63.0), steps.AskMount(second), until=9.0)
        self.window.act("skip")
        self.picture("11-reason")
        self.window.course.leave()
        for number in range(2, 6):
            self.play(*score_reports(number, 20.0 * number), until=9.0 + number / 10)
        self.play(steps.ShowInstruction(PLAN.blocks[1]), steps.AskMount(redone), until=9.8)
        self.window.live.show_seconds(5)
        self.picture("12-second-block")
        self.play(m.LinkDown("no readings for 1 s"), health(lost=12), until=9.8)
        self.picture("13-link-lost")
        self.play(m.LinkBack(INFO, True), until=9.9)
        self.window.keys.toggle()
        self.picture("14-keys")
        self.window.keys.toggle()
        self.play(CUT_SHORT, until=9.9)
        self.picture("15-cut-short")
        self.play(ENDED, m.Sealing(FOLDER), m.Sealed(FOLDER), until=9.9)
        self.picture("16-ended")
        self.picture("17-subject-thanks", self.subject)
        self.subject.check_ruler()
        self.picture("18-subject-ruler", self.subject)
        self.window.bridge.end()

    def review(self, session: Path) -> None:
        """Take a picture of each of Review's places, on a copy of a session."""
        from daq_app.analyst import state

        self.play(*OPEN, until=3.0)
        folder = Path(tempfile.mkdtemp()) / session.name
        shutil.copytree(session, folder)
        self.window.rooms.open(folder)
        window = self.window.rooms.analyst

        def picture(name: str, page: int) -> None:
            self.wait(lambda: window.state.step is None)
            window._pages.setCurrentIndex(page)
            self.picture(name)

        self.picture("19-review-opening")
        self.wait(lambda: window.state.stage == "predicted")
        picture("20-review-trials", 0)
        picture("21-review-finger", 2)
        steady = window.state.report.strokes[0].steady
        window.ask(state.Move(1, "steady begin", steady[0] + 0.1, "E02", "the finger still stuck there"))
        picture("22-review-window-moved", 1)
        window._follow("readings")
        window.stroke.player.step(-300)
        picture("23-review-replay", 1)
        window.model.near.click()
        window.model.history.click()
        self.wait(lambda: window.state.film is not None)
        window.model.player.seek(30)
        picture("24-review-history", 2)
        window.model.tabs.setCurrentIndex(1)
        self.wait(lambda: window.state.pictures)
        picture("25-review-session", 2)
        window.ask(state.Compare(str(session)))
        self.wait(lambda: "compared" in window.state.pictures)
        picture("26-review-comparison", 2)
        window.keys.toggle()
        picture("27-review-keys", 2)
        self.window.rooms.review.leave()
        self.window.bridge.end()
        shutil.rmtree(folder.parent)

    def play(self, *reports, until: float) -> None:  # noqa: ANN002
        """Send reports, then readings up to an instant."""
        self.recorder.play(*reports)
        self.recorder.readings(until)
        self.wait(lambda: not any(isinstance(report, m.Live) for report in self.recorder._queue))

    def picture(self, name: str, widget=None) -> None:  # noqa: ANN001
        """Save a picture of the window, or of another widget, once it is painted."""
        for _ in range(5):
            self._work()
            time.sleep(0.02)
        (widget or self.window).grab().save(str(self.path(name)))

    def wait(self, condition) -> None:  # noqa: ANN001
        """Let the window work until `condition` is true, for 120 s at most."""
        deadline = time.monotonic() + 120.0
        while not condition() and time.monotonic() < deadline:
            self._work()
            time.sleep(0.002)

    def _work(self) -> None:
        """Let the window process events; during a recording the disk acknowledges continually."""
        if self.window.bridge.recording:
            self.recorder.play(status(time.monotonic_ns()))
        self.application.processEvents()


if __name__ == "__main__":
    main()
