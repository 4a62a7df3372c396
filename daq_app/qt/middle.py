"""The middle of the experimenter's window: the trials, the signals or an inspected trial, and the last stroke."""

from collections.abc import Callable

from PySide6.QtWidgets import QStackedWidget, QWidget

from daq_app.qt.bridge import Bridge
from daq_app.qt.inspected_trial import InspectedTrial, TrialStrip
from daq_app.qt.live_panel import LivePanel
from daq_app.qt.parts import Panel, Wrapped, button, hbox, regrade, scrolled, vbox
from daq_app.qt.tokens import GRID
from daq_app.window.view_course import CourseView
from daq_app.window.view_trials import inspection
from daq_app.wording import tr

GRADES = {"refused": "wrong", "doubtful": "look"}  # of the style sheet
AFTER_ONSET = ("stroking", "scoring", "settling")  # phases of a trial whose stroke has begun


class Middle(QWidget):
    """Shows the signals of this moment, until a trial is inspected; the next stroke brings the signals back."""

    def __init__(self, bridge: Bridge, scale: float, act: Callable[[str], None]) -> None:
        """Show no session; `act` does what a button stands for."""
        super().__init__()
        self._bridge = bridge
        self.inspected: int | None = None  # number of the trial that is; None where none is
        self._phase = ""  # of the session that was shown last
        self.strip = TrialStrip(scale, self.inspect)
        self.live = LivePanel(bridge.feed, bridge.model, scale)
        self.trial = InspectedTrial(scale, self.leave)
        self.stroke = Wrapped("value")
        self.redo = button(tr("Redo  R"), tr("redo the last stroke"), lambda: act("redo"))
        self.undo = button("", tr("undo the last redo"), lambda: act("undo"))
        self.undo.hide()
        self._pages = QStackedWidget()
        frame = Panel(tr("inspected trial"))
        vbox(scrolled(self.trial), on=frame, margins=(2 * GRID, int(1.5 * GRID), 2 * GRID, int(1.5 * GRID)))
        for page in (self.live, frame):
            self._pages.addWidget(page)
        vbox(self.strip, (self._pages, 1), hbox((self.stroke, 1), self.undo, self.redo), on=self, spacing=GRID)

    def show_view(self, course: CourseView | None) -> None:
        """Show the session in hand, or that there is none."""
        self.strip.setVisible(course is not None)
        self.live.show_forces(course is None or not course.no_forces)
        if course is None:
            self._show_stroke(tr("No stroke yet."), "", "")
            self.redo.setEnabled(False)
            self.undo.hide()
            self.leave()
            return
        self.live.map.show_direction(course.direction)
        self._show_stroke(
            course.no_forces or course.stroke.words, course.stroke.details, GRADES.get(course.stroke.grade, "")
        )
        self.redo.setEnabled(course.redo.enabled)
        self.redo.setText(f"{course.redo.label}  {tr(course.redo.key)}")
        self.undo.setText(f"{course.undo.label}  {tr(course.undo.key)}")
        self.undo.setVisible(course.undo.enabled)
        self.strip.show_tiles(course.tiles)
        session = self._bridge.state.session
        phase = "" if session is None else session.phase
        begun = phase in AFTER_ONSET and self._phase not in AFTER_ONSET  # a busy machine never shows some phases
        if begun or phase == "stroking":
            self.leave()
        self._phase = phase
        self._show_inspected()

    def inspect(self, number: int) -> None:
        """Show a trial; the one that is shown already gives way to the signals."""
        self.inspected = None if number == self.inspected else number
        self._show_inspected()

    def toggle_inspection(self) -> None:
        """Inspect the trial whose stroke was looked at last, or else the one in hand; or go back."""
        session = self._bridge.state.session
        number = self.inspected
        if number is None and session is not None:
            number = session.judged if session.judged is not None else session.trial
        if number is not None:
            self.inspect(number)

    def leave(self) -> None:
        """Go back to the signals."""
        if self.inspected is not None:
            self.inspect(self.inspected)

    def toggle_drawer(self) -> None:
        """Open or close the drawer of the signals, which come back where a trial is inspected."""
        if self.inspected is not None:
            self.leave()
        else:
            self.live.toggle_drawer()

    def _show_inspected(self) -> None:
        session, number = self._bridge.state.session, self.inspected
        shown = None if session is None or number is None else inspection(session, number)
        if shown is not None:
            self.trial.show_trial(shown)
        self._pages.setCurrentIndex(0 if shown is None else 1)
        self.strip.show_inspected(None if shown is None else shown.number)

    def _show_stroke(self, words: str, details: str, grade: str) -> None:
        self.stroke.show_text(words)
        self.stroke.setAccessibleName(f"{tr('The last stroke:')} {words}")
        self.stroke.setToolTip(details)
        regrade(self.stroke, grade)
