"""The middle of the experimenter's window: trials, live signals or an inspected trial, and the last stroke."""

import math
from collections.abc import Callable

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton, QScrollArea, QWidget

from daq_app.qt.bridge import Bridge
from daq_app.qt.layout import hbox, scroll_area, stack_pages, vbox
from daq_app.qt.live_panel import PLOTS, LivePanel, short_name, speech
from daq_app.qt.live_plot import LivePlot
from daq_app.qt.parts import Panel, WrappedLabel, button, label, label_grid, regrade, set_text
from daq_app.qt.tokens import GRID, SMALL, TARGET, px
from daq_app.window.course_state import PICTURE, Mark
from daq_app.window.live_trace import Columns
from daq_app.window.view_course import TILES, CourseView, Inspection, StrokeView, Tile, inspection
from daq_app.wording import tr
from sessions.strokes.stroke import Stroke, StrokeCurve

# Grades of the style sheet: of tiles, and of strokes.
TILE_GRADES = {"flawed": "wrong", "current": "current", "coming": "coming"}
GRADES = {"refused": "wrong", "doubtful": "look"}
AFTER_ONSET = ("stroking", "scoring", "settling")  # phases of a trial whose stroke has begun


class TrialStrip(QScrollArea):
    """One row of tiles, which scrolls sideways if it is too long; the current trial stays in sight."""

    def __init__(self, inspect: Callable[[int], None]) -> None:
        """Show no trials; `inspect` is called with the number of the trial whose tile is pressed."""
        super().__init__()
        self._inspect = inspect
        self._view: tuple[Tile, ...] = ()
        self.horizontalScrollBar().rangeChanged.connect(self._take_room)  # new tiles are placed by then
        self.tiles: list[QPushButton] = []
        inside = QWidget()
        self._row = hbox(1, on=inside, spacing=GRID // 2)
        scroll_area(inside, self)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName(tr("trials of the session"))
        self._take_room(0, 0)

    def show_tiles(self, tiles: tuple[Tile, ...]) -> None:
        if tiles == self._view:
            return
        while len(self.tiles) > len(tiles):
            surplus = self.tiles.pop()
            surplus.hide()  # it must not be pressed before it is deleted
            surplus.deleteLater()
        while len(self.tiles) < len(tiles):
            self._add()
        for tile_button, tile in zip(self.tiles, tiles, strict=True):
            tile_button.setText(f"{TILES[tile.kind][0]} {tile.number}\n{tile.code}")
            tile_button.setAccessibleName(tile.description)
            tile_button.setToolTip(tile.description)
            regrade(tile_button, TILE_GRADES.get(tile.kind, ""))
        self._view = tiles
        self._keep_in_sight()

    def show_inspected_trial(self, number: int | None) -> None:
        for tile_button, tile in zip(self.tiles, self._view, strict=True):
            tile_button.setChecked(tile.number == number)

    def _take_room(self, _least: int, greatest: int) -> None:
        """Set the height to that of the tiles and of the scroll bar, if there is one."""
        self.setFixedHeight(max(px(2 * SMALL + 2 * GRID), TARGET) + (12 + GRID // 2 if greatest else 0))
        self._keep_in_sight()

    def _keep_in_sight(self) -> None:
        current = next((index for index, tile in enumerate(self._view) if tile.kind == "current"), None)
        if current is not None:
            self.ensureWidgetVisible(self.tiles[current], 8 * GRID, 0)

    def _add(self) -> None:
        index = len(self.tiles)
        tile_button = button("", tr("trial"), lambda: self._inspect(self._view[index].number), "tile", checkable=True)
        tile_button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves Space to the primary button
        self.tiles.append(tile_button)
        self._row.insertWidget(index, tile_button)


class InspectedTrial(QWidget):
    """Replaces the live signals while a trial is inspected; readings continue."""

    def __init__(self, back: Callable[[], None]) -> None:
        super().__init__()
        self._trial: Inspection | None = None
        self.heading = label("", "name", wrap=True)
        self.verdict = label("", "title", wrap=True)
        self.details = label("", "quiet", wrap=True)
        self.cells = {name: label("–", "value") for name in PICTURE}
        self._plots = [LivePlot(*plot, PICTURE) for plot in PLOTS]
        for plot in self._plots:
            plot.show_axis(times=plot is self._plots[-1], end=tr("end"))
        header = hbox((self.heading, 1), button(tr("Back  I"), tr("back to the signals of this moment"), back))
        # Two means per row fit at every size of type.
        cells = label_grid(((short_name(name), cell) for name, cell in self.cells.items()), 2)
        plots = zip(self._plots, (3, 2, 2), strict=True)
        vbox(header, self.verdict, self.details, cells, *plots, 0, on=self, spacing=GRID // 2)

    def show_trial(self, trial: Inspection) -> None:
        if trial == self._trial:
            return
        self._trial = trial
        set_text(self.heading, trial.heading)
        set_text(self.verdict, trial.verdict, grade=GRADES.get(trial.grade, ""))
        set_text(self.details, trial.details)
        self.details.setVisible(bool(trial.details))
        for name, text in trial.cells:
            set_text(self.cells[name], text)
            self.cells[name].setAccessibleName(speech(name, text))
        for plot in self._plots:
            plot.setVisible(trial.stroke is not None and trial.stroke.curve is not None)
        if trial.stroke is not None and trial.stroke.curve is not None:
            self._show_course(trial.stroke, trial.stroke.curve)

    def _show_course(self, stroke: Stroke, curve: StrokeCurve) -> None:
        time, onset, lift = curve.time, stroke.onset, stroke.lift
        columns = Columns(time, np.vstack([curve.normal, curve.tangential, curve.ratio, curve.speed]))
        begin, end = (float(time[0]), float(time[-1])) if len(time) else (0.0, 0.0)
        marks = [Mark("onset", onset, onset)] if onset is not None else []
        marks += [Mark("lift", lift, lift)] if lift is not None else []
        marks += [Mark("steady", *stroke.steady)] if stroke.steady is not None else []
        for plot in self._plots:
            plot.show_axis(max(math.ceil(2.0 * (end - begin)) / 2.0, 0.5))  # whole halves of a second
            plot.show_columns(columns, end, marks, 0.0)


class Middle(QWidget):
    """Shows live signals, or an inspected trial until the next stroke begins."""

    def __init__(self, bridge: Bridge, act: Callable[[str], None]) -> None:
        super().__init__()
        self._bridge = bridge
        self.inspected: int | None = None  # number of the inspected trial, or None
        self._phase = ""  # of the session shown last
        self.strip = TrialStrip(self.inspect)
        self.live = LivePanel(bridge.feed, bridge.model)
        self.trial = InspectedTrial(self.leave)
        self.stroke = WrappedLabel("value", keeps_room=True)
        self.redo = button(tr("Redo  R"), tr("redo the last stroke"), lambda: act("redo"))
        self.undo = button("", tr("undo the last redo"), lambda: act("undo"))
        frame = Panel(tr("inspected trial"))
        vbox(scroll_area(self.trial), on=frame, margins=(2 * GRID, int(1.5 * GRID), 2 * GRID, int(1.5 * GRID)))
        self._pages = stack_pages(self.live, frame)
        vbox(self.strip, (self._pages, 1), hbox((self.stroke, 1), self.undo, self.redo), on=self, spacing=GRID)

    def show_view(self, course: CourseView | None) -> None:
        self.strip.setVisible(course is not None)
        self.live.show_forces(course is None or not course.no_forces)
        stroke = StrokeView("none", tr("No stroke yet.")) if course is None else course.stroke
        text = stroke.text if course is None else course.no_forces or stroke.text
        self.stroke.show_text(text)
        self.stroke.setAccessibleName(f"{tr('The last stroke:')} {text}")
        self.stroke.setToolTip(stroke.details)
        regrade(self.stroke, GRADES.get(stroke.grade, ""))
        if course is None:
            self.redo.setEnabled(False)
            self.undo.hide()
            self.leave()
            return
        self.live.map.show_direction(course.direction)
        for name, push in (("redo", self.redo), ("undo", self.undo)):
            push.setText(f"{course.buttons[name].label}  {tr(course.buttons[name].key)}")
        self.redo.setEnabled(course.buttons["redo"].enabled)
        self.undo.setVisible(course.buttons["undo"].enabled)
        self.strip.show_tiles(course.tiles)
        session = self._bridge.state.session
        phase = "" if session is None else session.phase
        onset = phase in AFTER_ONSET and self._phase not in AFTER_ONSET  # a busy machine may skip phases
        if onset or phase == "stroking":
            self.leave()
        self._phase = phase
        self._show_inspection()

    def inspect(self, number: int) -> None:
        """Show a trial, or the live signals if it is already shown."""
        self.inspected = None if number == self.inspected else number
        self._show_inspection()

    def toggle_inspection(self) -> None:
        """Inspect the trial whose stroke was judged last, else the current one; or go back."""
        session = self._bridge.state.session
        number = self.inspected
        if number is None and session is not None:
            number = session.judged_trial if session.judged_trial is not None else session.trial
        if number is not None:
            self.inspect(number)

    def leave(self) -> None:
        if self.inspected is not None:
            self.inspect(self.inspected)

    def toggle_drawer(self) -> None:
        """Open or close the drawer of the signals, or leave an inspected trial."""
        if self.inspected is not None:
            self.leave()
        else:
            self.live.toggle_drawer()

    def _show_inspection(self) -> None:
        session, number = self._bridge.state.session, self.inspected
        trial = None if session is None or number is None else inspection(session, number)
        if trial is not None:
            self.trial.show_trial(trial)
        self._pages.setCurrentIndex(0 if trial is None else 1)
        self.strip.show_inspected_trial(None if trial is None else trial.number)
