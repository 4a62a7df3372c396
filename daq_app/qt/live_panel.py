"""What the transducer measures now: forces, ratio, speed, all six axes, and the finger on the sample."""

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QSizePolicy, QVBoxLayout, QWidget

from daq_app.course_state import Mark
from daq_app.live_feed import LiveFeed
from daq_app.live_model_process import LiveModel
from daq_app.live_trace import CHANNELS
from daq_app.plot_scale import PlotScale
from daq_app.qt.contact_map import ContactMap
from daq_app.qt.curve import Curve
from daq_app.qt.parts import button, choice, label, say
from daq_app.qt.tokens import FX, FY, GRID, MODEL, MU, N, T, Tokens
from daq_app.view_model import CHANNELS as MODEL_CHANNELS
from daq_app.view_model import ModelTrace, model_words

if TYPE_CHECKING:
    from daq_app.qt.finger_view import FingerView
    from daq_app.qt.live_plot import LivePlot

LENGTHS = (1, 2, 5, 10, 20, 60)  # what can be shown [s]
LEAST_FOR_SPEED = 280  # a lower panel shows force and ratio alone
TRAIL = 2.0  # of the centre of pressure [s]
READ_EVERY = 0.25  # numbers beside the plots change no more often than they can be read [s]

PLOTS = (
    ("N and T [N]", (Curve("N", N), Curve("T", T)), PlotScale(0.0, 5.0, 5.0)),
    ("µ = T/N [-]", (Curve("mu", MU),), PlotScale(0.0, 1.0, 1.0)),
    ("speed [mm/s]", (Curve("speed", "text"),), PlotScale(0.0, 50.0, 50.0)),
)
AXES = (
    ("Fx Fy Fz [N]", (Curve("Fx", FX), Curve("Fy", FY), Curve("Fz", "fz")), PlotScale(-5.0, 5.0, 10.0)),
    (
        "Tx Ty Tz [N mm]",
        (Curve("Tx", FX, dashed=True), Curve("Ty", FY, dashed=True), Curve("Tz", "fz", dashed=True)),
        PlotScale(-50.0, 50.0, 100.0),
    ),
)
SED = ("SED [kPa], model", (Curve("SED", MODEL),), PlotScale(0.0, 5.0, 5.0))
LEAST_FOR_MODEL = 430  # a lower panel shows what is measured alone
READ = (("N", "N", 2, N), ("T", "N", 2, T), ("mu", "", 2, MU), ("speed", "mm/s", 0, ""))


class LivePanel(QFrame):
    """The middle of the experimenter's window."""

    def __init__(self, feed: LiveFeed, model: LiveModel, tokens: Tokens, scale: float) -> None:
        """Show what `feed` holds and what `model` says; nothing yet."""
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName("live readings")
        self._feed = feed
        self._model = model
        self._model_trace = ModelTrace()
        self._model_plot: LivePlot | None = None
        self.finger: FingerView | None = None
        self._seconds = 10
        self._held: float | None = None  # device time the picture is held at; readings go on behind it
        self._read_at = 0.0
        self._tokens = tokens
        self._scale = scale
        self.plots: list[LivePlot] = []
        self.map = ContactMap(tokens, scale)
        self._forces_shown = True
        self._numbers = QWidget()
        self._values: dict[str, QLabel] = {}
        self.hold = button("Hold  H", "hold the picture; readings go on", self._toggle_hold)
        self.hold.setCheckable(True)
        self.length = choice("stretch of time that is shown")
        self.length.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.length.setFixedWidth(round(120 * scale))
        grid = self._grid = QGridLayout()
        grid.setSpacing(4)
        side = self._side_layout = QVBoxLayout()
        side.setSpacing(4)
        side.addWidget(self.map, 3)
        self._side = QWidget()
        self._side.setLayout(side)
        side.setContentsMargins(0, 0, 0, 0)
        grid.addWidget(self._side, 0, 1, 4, 1)
        grid.setColumnStretch(0, 5)
        grid.setColumnStretch(1, 3)
        for row, stretch in enumerate((3, 2, 2, 2)):
            grid.setRowStretch(row, stretch)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(GRID, GRID, GRID, GRID)
        layout.setSpacing(4)
        layout.addLayout(self._bar(scale))
        self._pictures = QWidget()
        self._pictures.setLayout(grid)
        grid.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._pictures, 1)
        layout.addStretch(0)
        self.show_seconds(self._seconds)

    def build(self) -> None:
        """Make the plots: they take longer to load than all else together, so the window stands before them."""
        from daq_app.qt.finger_view import FingerView
        from daq_app.qt.live_plot import LivePlot

        if self.plots:
            return
        self._model_plot = LivePlot(*SED, self._tokens, self._scale, MODEL_CHANNELS)
        self._model_plot.setMinimumHeight(1)  # folded where there is little room, it must not keep the window large
        self._grid.addWidget(self._model_plot, 3, 0)
        self.finger = FingerView(self._tokens, self._scale)
        self._side_layout.insertWidget(0, self.finger, 5)
        self.plots = [LivePlot(*plot, self._tokens, self._scale) for plot in (*PLOTS, *AXES)]
        for row, plot in enumerate(self.plots[:3]):
            self._grid.addWidget(plot, row, 0)
        for plot in self.plots[3:]:
            self._side_layout.addWidget(plot, 2)
        self.show_seconds(self._seconds)
        self._fit()

    @property
    def holding(self) -> bool:
        """Say whether the picture is held."""
        return self._held is not None

    @property
    def seconds(self) -> int:
        """Return how many seconds are shown."""
        return self._seconds

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._tokens = tokens
        self.map.set_tokens(tokens)
        for part in (*self.plots, self._model_plot, self.finger):
            if part is not None:
                part.set_tokens(tokens)

    def show_side(self, shown: bool) -> None:
        """Show or fold the six axes and the sample, where there is little room."""
        self._side.setVisible(shown)
        self._grid.setColumnStretch(1, 3 if shown else 0)

    def show_forces(self, shown: bool) -> None:
        """Show readings, or nothing of them where the protocol keeps them from the experimenter."""
        if shown != self._forces_shown:
            self._forces_shown = shown
            self._pictures.setVisible(shown)
            self._numbers.setVisible(shown)

    def show_seconds(self, seconds: int) -> None:
        """Show the last so many seconds."""
        self._seconds = seconds
        for plot in (*self.plots, self._model_plot):
            if plot is not None:
                plot.show_seconds(seconds)
        self.length.setCurrentIndex(LENGTHS.index(seconds))

    def change_length(self, by: int) -> None:
        """Show the next longer (+1) or shorter (-1) stretch."""
        at = LENGTHS.index(self._seconds) + by
        if 0 <= at < len(LENGTHS):
            self.show_seconds(LENGTHS[at])

    def toggle_hold(self) -> None:
        """Hold the picture, or go on."""
        self.hold.click()

    def draw(self, marks: tuple[Mark, ...], clock: float) -> None:
        """Draw a frame; `clock` [s] is the machine's."""
        if not self._forces_shown or not self.plots:
            return
        trace = self._feed.trace
        newest = trace.newest
        now = self._held if self._held is not None else newest
        if now is None or newest is None:
            for plot in self.plots:
                plot.show_columns(trace.columns(0.0, 1.0, 1), 0.0, (), clock)
            return
        width = max(self.plots[0].width(), 100)
        columns = trace.columns(now - self._seconds, np.nextafter(now, np.inf), width)
        seen = tuple(mark for mark in marks if mark.stop >= now - self._seconds and mark.start <= now)
        for plot in self.plots:
            if plot.isVisible():
                plot.show_columns(columns, now, seen, clock)
        if self.map.isVisible():
            _, values = trace.between(now - TRAIL, np.nextafter(now, np.inf))
            self.map.show_trail(values[CHANNELS.index("x") : CHANNELS.index("y") + 1].T)
        self._draw_model(now, clock)
        if clock - self._read_at >= READ_EVERY:
            self._read_at = clock
            self._read(now)

    def model_says(self) -> None:
        """Take what the model said since the last call."""
        for said in self._model.poll():
            self._model_trace.add(said)

    def _draw_model(self, now: float, clock: float) -> None:
        """Draw what the model says: of the last stroke once it was solved in full, or else of this moment."""
        if self._model_plot is not None and self._model_plot.isVisible():
            columns = self._model_trace.columns(now - self._seconds, now)
            self._model_plot.show_columns(columns, now, (), clock)
        if self.finger is None or not self.finger.isVisible() or self.holding:
            return
        model = self._model
        words = model_words(model.said, model.settled, model.problem)
        shown = model.settled if model.settled is not None and model.settled.picture is not None else model.said
        if shown is None:
            self.finger.show_model(None, np.empty(0), words, clock)
        else:
            self.finger.show_model(shown.picture, shown.row, words, clock)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802  Qt's name
        """Take the room there is."""
        super().showEvent(event)
        self.show_seconds(self._seconds)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Leave out the numbers where they would be cut."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        needed = self._numbers.sizeHint().width() + self.length.width() + self.hold.sizeHint().width() + 5 * GRID
        self._numbers.setVisible(self._forces_shown and self.width() >= needed)
        room = self.height() >= LEAST_FOR_SPEED
        for plot in self.plots[2:3]:
            plot.setVisible(room)
        self._grid.setRowStretch(2, 2 if room else 0)
        roomy = self.height() >= LEAST_FOR_MODEL
        for part in (self._model_plot, self.finger):
            if part is not None:
                part.setVisible(roomy)
        self._grid.setRowStretch(3, 2 if roomy else 0)

    def _bar(self, scale: float) -> QHBoxLayout:
        """Return the row above the plots: numbers that are read, and what is shown."""
        row = QHBoxLayout()
        row.setSpacing(GRID)
        inside = QHBoxLayout(self._numbers)
        inside.setContentsMargins(0, 0, 0, 0)
        for channel, unit, _, colour in READ:
            name = {"mu": "µ"}.get(channel, channel)
            made = label("–", "title")
            made.setFixedWidth(round((92 if unit == "mm/s" else 76) * scale))
            made.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            made.setAccessibleName(f"{name} now")
            caption = label(f"{name}", "quiet")
            if colour:
                caption.setStyleSheet(f"border-bottom: 3px solid {colour};")
            inside.addWidget(caption)
            inside.addWidget(made)
            self._values[channel] = made
        inside.addStretch(1)
        # They give way where there is no room for all of them.
        self._numbers.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        row.addWidget(self._numbers, 1)
        for seconds in LENGTHS:
            self.length.addItem(f"last {seconds} s", seconds)
        self.length.activated.connect(self._length_chosen)
        row.addStretch(0)
        row.addWidget(self.length)
        row.addWidget(self.hold)
        self.hold.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        return row

    def _read(self, now: float) -> None:
        """Show the means over the last tenth of a second."""
        _, values = self._feed.trace.between(now - 0.1, np.nextafter(now, np.inf))
        for channel, unit, digits, _ in READ:
            known = values[CHANNELS.index(channel)]
            known = known[np.isfinite(known)]
            text = f"{known.mean():.{digits}f} {unit}".strip() if len(known) else "–"
            say(self._values[channel], text.replace("-", "−"))

    def _length_chosen(self, at: int) -> None:
        self.show_seconds(LENGTHS[at])

    def _toggle_hold(self) -> None:
        self._held = self._feed.trace.newest if self.hold.isChecked() else None
        self.hold.setText("Held  H" if self.hold.isChecked() else "Hold  H")
