"""Pictures of every place of the window in every setting, to be looked at: python -m benchmarks.screenshots --out DIR.

Sizes are those of the screen in its own pixels; a scaling of 2 leaves half as many to the window.
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

SCALES = (1.0, 1.5, 2.0)
SIZES = ((1366, 768), (1920, 1080), (3840, 2160))
THEMES = ("light", "dark")
LOCALES = ("de_DE", "ja_JP")


def main() -> None:
    """Take pictures in every setting, each in a process of its own: a scaling cannot be changed while Qt runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--setting", help="one setting alone, such as 1366x768-1.5-dark-de_DE")
    parser.add_argument("--session", type=Path, help="a session folder: then the analyst's places too")
    parser.add_argument("--take", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.take:
        _take(options.setting, options.out, options.session)
        return
    settings = [options.setting] if options.setting else list(_settings())
    for setting in settings:
        scale = setting.split("-")[1]
        environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "QT_SCALE_FACTOR": scale}
        command = [sys.executable, "-m", "benchmarks.screenshots", "--take", "--setting", setting]
        command += ["--session", str(options.session)] if options.session else []
        subprocess.run([*command, "--out", str(options.out)], env=environment, check=True)
        print(setting)
    print(f"{len(list(options.out.glob('*.png')))} pictures in {options.out}")


def _settings() -> list[str]:
    settings: list[str] = []
    for number, ((width, height), scale, theme) in enumerate(itertools.product(SIZES, SCALES, THEMES)):
        settings.append(f"{width}x{height}-{scale:g}-{theme}-{LOCALES[number % 2]}")
    return settings


def _take(setting: str, out: Path, session: Path | None) -> None:
    """Take the pictures of one setting."""
    from PySide6.QtCore import QLocale, QSettings
    from PySide6.QtWidgets import QApplication

    from daq_app.qt.tokens import DARK, LIGHT

    size, scale, theme, locale = setting.split("-")
    width, height = (round(int(part) / float(scale)) for part in size.split("x"))
    QLocale.setDefault(QLocale(locale))
    out.mkdir(parents=True, exist_ok=True)
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(out / "settings"))
    application = QApplication([])
    chosen = DARK if theme == "dark" else LIGHT
    places = _Places(application, (width, height), chosen, lambda name: out / f"{name}-{setting}.png")
    places.all()
    places.window.bridge.end()
    if session is not None:
        _take_analyst(application, session, (width, height), chosen, lambda name: out / f"{name}-{setting}.png")


def _take_analyst(application, session: Path, size, theme, path) -> None:  # noqa: ANN001
    """Take a picture of each of the analyst's places, on a copy of a session."""
    from daq_app.analyst import messages as m
    from daq_app.qt.analyst_window import AnalystWindow

    def until(condition) -> None:  # noqa: ANN001
        end = time.monotonic() + 120.0
        while not condition() and time.monotonic() < end:
            application.processEvents()
            time.sleep(0.005)

    def picture(name: str, page: int) -> None:
        until(lambda: window.state.step is None)
        window._pages.setCurrentIndex(page)
        for _ in range(5):
            application.processEvents()
            time.sleep(0.02)
        window.grab().save(str(path(name)))

    folder = Path(tempfile.mkdtemp()) / session.name
    shutil.copytree(session, folder)
    window = AnalystWindow(folder, theme)
    window.resize(*size)
    window.show()
    picture("19-opening", 0)
    until(lambda: window.state.stage == "predicted")
    picture("20-analyst-trials", 0)
    picture("21-analyst-finger", 2)
    steady = window.state.report.strokes[0].steady
    window.ask(m.Move(1, "steady begin", steady[0] + 0.1, "E02", "the finger still stuck there"))
    picture("22-analyst-window-moved", 1)
    window._follow("readings")
    window.stroke.player.step(-300)
    picture("23-analyst-replay", 1)
    window.model.near.click()
    window.model.history.click()
    until(lambda: window.state.film is not None)
    window.model.player.seek(30)
    picture("24-analyst-history", 2)
    window.model.tabs.setCurrentIndex(1)
    until(lambda: window.state.drawn)
    picture("25-analyst-session", 2)
    window.ask(m.Compare(str(session)))
    until(lambda: "compared" in window.state.drawn)
    picture("26-analyst-comparison", 2)
    window._show_keys()
    picture("27-analyst-keys", 2)
    window.close()
    shutil.rmtree(folder.parent)


class _Places:
    """The window, brought to each of its places."""

    def __init__(self, application, size, theme, path) -> None:  # noqa: ANN001
        from benchmarks.played_recorder import PlayedRecorder
        from daq_app.qt.start import opened

        self.application, self.path = application, path
        self.recorder = PlayedRecorder()
        self.window = opened(application, lambda: self.recorder, theme)
        self.window.resize(*size)
        self.window.show()
        self.subject = self.window.subject
        self.subject.resize(*size)
        self.window.side.show = self.subject.show
        self.now = 0.0

    def all(self) -> None:
        """Take a picture of each place."""
        from benchmarks import played_recorder as p
        from sessions.run import steps

        trial, second, other = p.PLAN.trials[0], p.PLAN.trials[1], p.PLAN.trials[5]
        self.play(*p.OPEN, until=3.0)
        self.picture("01-new-session")
        self.window.page.subject.setText("Ada Lovelace")
        self.window.page.seed.setText("seven")
        self.window.act("primary")
        self.picture("02-refused")
        self.window.page.seed.clear()
        self.play(*p.BEGUN, until=3.5)
        self.picture("03-begin")
        self.play(steps.ShowInstruction(p.PLAN.blocks[0]), steps.AskMount(trial), until=3.6)
        self.picture("04-mount")
        self.picture("05-subject-instruction", self.subject)
        self.play(steps.StartTake(1, 1), steps.MeasureZero(), until=4.0)
        self.recorder.stroke(1, 4.0)
        self.play(steps.AskStroke(trial), until=5.0)
        self.picture("06-subject-stroke", self.subject)
        self.play(p.logged("contact_onset", 1, time=4.7, noticed=4.71), until=6.5)
        self.picture("07-stroking")
        self.play(p.logged("finger_lifted", 1, time=7.2, noticed=7.25), until=7.3)
        self.play(steps.AskScore(trial, p.PLAN.blocks[0].scale_ends), until=8.5)
        self.wait(lambda: self.window.bridge.state.session.judged == 1)
        self.picture("08-scoring")
        self.picture("09-subject-line-empty", self.subject)
        line = self.subject.line
        line._take(line.answer.pressed(1.0, 63.0, "mouse").released())
        self.picture("10-subject-line-answered", self.subject)
        self.play(*p.scored(1, 63.0), steps.AskMount(second), until=9.0)
        self.window.act("skip")
        self.picture("11-reason")
        self.window.course.leave()
        for number in range(2, 6):
            self.play(*p.scored(number, 20.0 * number), until=9.0 + number / 10)
        self.play(steps.ShowInstruction(p.PLAN.blocks[1]), steps.AskMount(other), until=9.8)
        self.window.live.show_seconds(5)
        self.picture("12-second-block")
        self.play(p.m.LinkDown("no readings for 1 s"), p.health(lost=12), until=9.8)
        self.picture("13-link-lost")
        self.play(p.m.LinkBack(p.INFO, True), until=9.9)
        self.window._show_keys()
        self.picture("14-keys")
        self.window._show_keys()
        self.play(p.CUT, until=9.9)
        self.picture("15-cut-short")
        self.play(p.ENDED, p.m.Sealing(p.FOLDER), p.m.Sealed(p.FOLDER), until=9.9)
        self.picture("16-ended")
        self.picture("17-subject-thanks", self.subject)
        self.subject.check_ruler()
        self.picture("18-subject-ruler", self.subject)

    def play(self, *reports, until: float) -> None:  # noqa: ANN002
        """Have reports said, then readings up to an instant."""
        from benchmarks import played_recorder as p

        self.recorder.play(*reports)
        self.recorder.readings(until)
        self.wait(lambda: not any(isinstance(said, p.m.Live) for said in self.recorder._waiting))

    def wait(self, condition) -> None:  # noqa: ANN001
        """Let the window work until something holds."""
        end = time.monotonic() + 60.0
        while not condition() and time.monotonic() < end:
            self._safe()
            self.application.processEvents()
            time.sleep(0.002)

    def _safe(self) -> None:
        """Have the disk acknowledge, as it does all the time."""
        from benchmarks import played_recorder as p

        if self.window.bridge.recording:
            self.recorder.play(p.status(time.monotonic_ns()))

    def picture(self, name: str, widget=None) -> None:  # noqa: ANN001
        """Take a picture."""
        for _ in range(5):
            self._safe()
            self.application.processEvents()
            time.sleep(0.02)
        (widget or self.window).grab().save(str(self.path(name)))


if __name__ == "__main__":
    main()
