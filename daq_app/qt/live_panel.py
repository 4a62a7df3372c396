"""What the transducer measures now: forces, ratio, speed, all six axes, and the finger on the sample."""

from collections.abc import Sequence

import numpy as np
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QVBoxLayout, QWidget

from daq_app.qt.contact_map import ContactMap
from daq_app.qt.drawer import Drawer
from daq_app.qt.finger_view import FingerView
from daq_app.qt.live_bar import LENGTHS, LiveBar
from daq_app.qt.live_plot import Curve, LivePlot
from daq_app.qt.parts import Panel, button, fill, hbox, vbox
from daq_app.qt.screens import settings
from daq_app.qt.tokens import FX, FY, GRID, MODEL, MU, N, T
from daq_app.window.course_state import Mark, picture_end
from daq_app.window.live_feed import LiveFeed
from daq_app.window.live_model_process import LiveModel
from daq_app.window.live_trace import CHANNELS
from daq_app.window.plot_scale import PlotScale
from daq_app.window.view_model import CHANNELS as MODEL_CHANNELS
from daq_app.window.view_model import ModelTrace, model_words
from daq_app.wording import tr, tr_noop

LEAST_FOR_SPEED = 280  # a lower panel shows force and ratio alone
LEAST_FOR_MODEL = 430  # a lower panel shows what is measured alone
TRAIL = 2.0  # of the centre of pressure [s] ...
POINTS = 120  # ... in so many points
TAB = 24  # width of what opens and closes the drawer, before the font's scale [px]
READ_EVERY = 0.25  # numbers beside the plots change no more often than they can be read [s]

PLOTS = (
    (tr_noop("N and T [N]"), (Curve("N", N), Curve("T", T)), PlotScale(0.0, 5.0, 5.0)),
    ("µ = T/N [-]", (Curve("mu", MU),), PlotScale(0.0, 1.0, 1.0)),
    (tr_noop("speed [mm/s]"), (Curve("speed", "text"),), PlotScale(0.0, 50.0, 50.0)),
)
AXES = (
    ("Fx Fy Fz [N]", (Curve("Fx", FX), Curve("Fy", FY), Curve("Fz", "fz")), PlotScale(-5.0, 5.0, 10.0)),
    (
        "Tx Ty Tz [N mm]",
        (Curve("Tx", FX, dashed=True), Curve("Ty", FY, dashed=True), Curve("Tz", "fz", dashed=True)),
        PlotScale(-50.0, 50.0, 100.0),
    ),
)
SED = (
    tr_noop("SED [kPa], model"),
    (Curve("SED", MODEL), Curve("SED instead", MODEL, dashed=True, named=False)),
    PlotScale(0.0, 5.0, 5.0),
)
FINITE = "live model/finite strain"  # under which the choice is remembered


class LivePanel(Panel):
    """The middle of the experimenter's window."""

    def __init__(self, feed: LiveFeed, model: LiveModel, scale: float) -> None:
        """Show what `feed` holds and what `model` says; nothing yet."""
        super().__init__(tr("live readings"))
        self._feed = feed
        self._model = model
        self._model_trace = ModelTrace()
        self._seconds = 10
        self._hold_time: float | None = None  # device time the picture is held at; readings go on behind it
        self._read_at = 0.0
        self._drawn: object = None  # what the picture was drawn of
        self._forces_shown = True
        self.plots = [LivePlot(*plot, scale) for plot in (*PLOTS, *AXES)]
        self._model_plot = LivePlot(*SED, scale, MODEL_CHANNELS)
        self._model_plot.setMinimumHeight(1)  # folded where there is little room, it must not keep the window large
        self.finger = FingerView(scale)
        self.map = ContactMap(scale)
        self.bar = LiveBar(scale, self.show_seconds, self._hold, self._finite)
        self.drawer = Drawer(*self._placed())
        self.tab = button("", tr("drawer"), self.toggle_drawer, "handle")
        self.tab.setFixedWidth(round(TAB * scale))
        self.tab.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)
        self._pictures = QWidget()
        hbox((self.drawer, 1), self.tab, on=self._pictures, spacing=2)
        vbox(self.bar, (self._pictures, 1), 0, on=self, margins=GRID, spacing=4)
        self._show_tab()
        self.show_seconds(self._seconds)
        self.show_finite(settings().value(FINITE) == "yes")

    def set_room(self, room: bool) -> None:
        """Say whether there is room for the stroke and an open drawer beside each other."""
        self.drawer.open.set_room(room)
        self._show_tab()

    def toggle_drawer(self) -> None:
        """Open or close the drawer, where readings are shown."""
        if self._forces_shown:
            self.drawer.open.toggle()
            self._show_tab()

    def _show_tab(self) -> None:
        opened = bool(self.drawer.open)
        self.tab.setText("▸\nD" if opened else "◂\nD")
        self.tab.setAccessibleName(
            tr("{word} the drawer: six axes, sample and finger", word=tr("close") if opened else tr("open"))
        )
        self.tab.setToolTip(self.tab.accessibleName())

    def show_forces(self, shown: bool) -> None:
        """Show readings, or nothing of them where the protocol keeps them from the experimenter."""
        if shown != self._forces_shown:
            self._forces_shown = shown
            self._pictures.setVisible(shown)
            self.bar.show_forces(shown)

    def show_seconds(self, seconds: int) -> None:
        """Show the last so many seconds."""
        self._seconds = seconds
        for plot in (*self.plots, self._model_plot):
            plot.show_seconds(seconds)
        self.bar.length.setCurrentIndex(LENGTHS.index(seconds))

    def change_length(self, by: int) -> None:
        """Show the next longer (+1) or shorter (-1) stretch."""
        at = LENGTHS.index(self._seconds) + by
        if 0 <= at < len(LENGTHS):
            self.show_seconds(LENGTHS[at])

    def show_finite(self, finite: bool) -> None:
        """Follow the finger at finite strain, or at small strain."""
        self.bar.finite.setChecked(finite)
        self._model.follow_at("finite" if finite else "small")

    def draw(self, marks: tuple[Mark, ...], clock: float) -> None:
        """Draw a frame; `clock` [s] is the machine's."""
        if not self._forces_shown:
            return
        trace = self._feed.trace
        newest = trace.newest
        now = self._hold_time if self._hold_time is not None else newest
        if now is None or newest is None:
            now, marks = 0.0, ()
        end = picture_end(marks, now)
        seen = tuple(mark for mark in marks if mark.stop >= end - self._seconds and mark.start <= now)
        drawn = (trace, now, end, self._seconds, self._columns(), seen)
        if drawn != self._drawn:
            self._drawn = drawn
            if end == newest or trace.holds(end - self._seconds):  # else the stroke stays as it was drawn last
                self._show_until(self.plots[:3], end, seen, clock)
            self._show_until(self.plots[3:], now, seen, clock)
            frozen = newest is not None and end < newest
            for plot in (*self.plots[:3], self._model_plot):
                plot.show_end(
                    tr("lift + 1 s") if frozen and self._hold_time is None else tr("held") if frozen else tr("now")
                )
            if self.map.isVisible():
                every = max(round(TRAIL * trace.rate / POINTS), 1)
                _, values = trace.between(now - TRAIL, np.nextafter(now, np.inf), every)
                self.map.show_trail(values[CHANNELS.index("x") : CHANNELS.index("y") + 1].T)
        self._draw_model(end, clock, still=end != newest)
        if clock - self._read_at >= READ_EVERY:
            self._read_at = clock
            _, values = trace.between(now - 0.1, np.nextafter(now, np.inf))
            self.bar.show_numbers(values)

    def _show_until(self, plots: Sequence[LivePlot], end: float, marks: tuple[Mark, ...], clock: float) -> None:
        """Show the readings up to `end` [s, device time]."""
        columns = self._feed.trace.columns(end - self._seconds, np.nextafter(end, np.inf), self._columns())
        for plot in plots:
            if plot.isVisible():
                plot.show_columns(columns, end, marks, clock)

    def model_says(self) -> None:
        """Take what the model said since the last call."""
        for said in self._model.poll():
            self._model_trace.add(said)

    def _columns(self) -> int:
        """Return how many columns a curve has: two pixels each, as its line is wide."""
        shown = next((plot for plot in self.plots if plot.isVisible()), self.plots[0])
        return max(shown.width() // 2, 100)

    def _draw_model(self, now: float, clock: float, *, still: bool) -> None:
        """Draw what the model says: of the last stroke once it was solved in full, or else of this moment."""
        if self._model_plot.isVisible() and (not still or self._model_trace.holds(now - self._seconds)):
            last = np.nextafter(now, np.inf)
            columns = self._model_trace.columns(now - self._seconds, last, self._columns())
            self._model_plot.show_columns(columns, now, (), clock)
        if not self.finger.isVisible() or self._hold_time is not None:
            return
        model = self._model
        words = model_words(model.said, model.settled, model.problem)
        shown = model.settled if model.settled is not None and model.settled.picture is not None else model.said
        if shown is None:
            self.finger.show_model(None, np.empty(0), words, clock)
        else:
            self.finger.show_model(shown.picture, shown.row, words, clock)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Take the room there is; what there is none for is folded."""
        super().resizeEvent(event)
        self.bar.fit_into(self.height())
        speed, model = self.height() >= LEAST_FOR_SPEED, self.height() >= LEAST_FOR_MODEL
        column = (*self.plots[:3], self._model_plot)
        for plot, shown in zip(column, (True, True, speed, model), strict=True):
            plot.setVisible(shown)
        lowest = column[3] if model else column[2] if speed else column[1]
        for plot in column:
            plot.show_times(plot is lowest)  # one axis for all of them
        self._grid.setRowStretch(2, 2 if speed else 0)
        self._grid.setRowStretch(3, 2 if model else 0)
        self.finger.setVisible(model)

    def _placed(self) -> tuple[QWidget, QWidget]:
        """Return the stroke's plots, and what the drawer holds: finger, sample and the six axes."""
        stroke, drawer = QWidget(), QWidget()
        grid = self._grid = QGridLayout(stroke)
        side = QVBoxLayout(drawer)
        for layout in (grid, side):
            layout.setContentsMargins(0, 0, 0, 0)
            layout.setSpacing(4)
        for row, (plot, stretch) in enumerate(zip((*self.plots[:3], self._model_plot), (3, 2, 2, 2), strict=True)):
            grid.addWidget(plot, row, 0)
            grid.setRowStretch(row, stretch)
        fill(side, (self.finger, 7), (self.map, 3))
        for plot in self.plots[3:]:
            side.addWidget(plot, 2)
        self.plots[3].show_times(False)
        return stroke, drawer

    def _hold(self) -> None:
        self._hold_time = self._feed.trace.newest if self.bar.hold.isChecked() else None
        self.bar.show_held(self.bar.hold.isChecked())

    def _finite(self, chosen: bool) -> None:
        settings().setValue(FINITE, "yes" if chosen else "no")
        self.show_finite(chosen)
