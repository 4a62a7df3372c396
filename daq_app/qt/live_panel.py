"""Live signals of the transducer: forces, ratio, speed, all six axes, and the finger on the sample."""

from collections.abc import Callable, Sequence

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QFontMetrics, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QSizePolicy, QWidget

from daq_app.qt.layout import hbox, set_horizontal, vbox
from daq_app.qt.live_pictures import ContactMap, FingerView
from daq_app.qt.live_plot import Curve, LivePlot
from daq_app.qt.parts import Drawer, Panel, button, choice, label, regrade, set_text
from daq_app.qt.preferences import settings
from daq_app.qt.tokens import FX, FY, GRID, MODEL, MU, SMALL, TEXT, TITLE, N, T, font, px
from daq_app.window.course_state import PICTURE, Mark, picture_end
from daq_app.window.live_feed import LiveFeed
from daq_app.window.live_model import MODEL_CHANNELS, ModelTrace, model_text
from daq_app.window.live_model_process import LiveModel
from daq_app.window.live_trace import CHANNELS, PlotScale
from daq_app.wording import quantity, tr, tr_noop
from drivers.arrays import Array

_LENGTHS = (1, 2, 5, 10, 20, 60)  # selectable stretches [s]
_COLOURS = {"N": N, "T": T, "mu": MU}  # below the captions of the numbers
_SIZES = ((TITLE, "title"), (TEXT, "value"), (SMALL, "tight"))  # of the numbers: the first that fits is used
LEAST_FOR_ACTS = 170  # a lower panel has room for the numbers only, before the font's scale [px]
_NAMES = {  # as spoken
    "N": tr_noop("Normal force"), "T": tr_noop("Tangential force"),
    "mu": tr_noop("Friction coefficient"), "speed": tr_noop("Speed"),
}  # fmt: skip
_WIDEST = {"N": "−00.00 N", "T": "00.00 N", "mu": "0.00", "speed": "000 mm/s"}  # of each number
LEAST_FOR_SPEED = 280  # a lower panel shows force and ratio only
LEAST_FOR_MODEL = 430  # a lower panel shows measured signals only
TRAIL = 2.0  # of the centre of pressure [s] ...
_POINTS = 120  # ... and its number of points
TAB = 24  # width of the drawer's tab, before the font's scale [px]
READ_EVERY = 0.25  # least time between changes of the numbers, to keep them readable [s]

PLOTS = (
    (tr_noop("N and T [N]"), (Curve("N", N), Curve("T", T)), PlotScale(0.0, 5.0, 5.0)),
    ("µ = T/N [-]", (Curve("mu", MU),), PlotScale(0.0, 1.0, 1.0)),
    (tr_noop("speed [mm/s]"), (Curve("speed", "text"),), PlotScale(0.0, 50.0, 50.0)),
)
TORQUES = (Curve("Tx", FX, dashed=True), Curve("Ty", FY, dashed=True), Curve("Tz", "text", dashed=True))
AXIS_PLOTS = (
    ("Fx Fy Fz [N]", (Curve("Fx", FX), Curve("Fy", FY), Curve("Fz", "text")), PlotScale(-5.0, 5.0, 10.0)),
    ("Tx Ty Tz [N mm]", TORQUES, PlotScale(-50.0, 50.0, 100.0)),
)
INSTEAD = Curve("SED instead", MODEL, dashed=True, named=False)
_SED = (tr_noop("SED [kPa], model"), (Curve("SED", MODEL), INSTEAD), PlotScale(0.0, 5.0, 5.0))
FINITE = "live model/finite strain"  # key under which the choice is remembered


class LiveBar(QWidget):
    """The numbers above the plots, and the display options."""

    def __init__(self, length: Callable[[int], None], hold: Callable[[], None], finite: Callable[[bool], None]) -> None:
        """Show no numbers; `length` takes the stretch [s], `hold` is called on a press, `finite` takes a choice."""
        super().__init__()
        self.forces_shown = True
        self._short = False  # the buttons show only their keys
        self._acts = 0  # width of the buttons with their words and of the drop-down [px]
        self.values: dict[str, QLabel] = {}
        self._captions: dict[str, QLabel] = {}
        self.hold = button(tr("Hold  H"), tr("hold the picture; readings continue"), hold, checkable=True)
        name, text = tr("live model at finite strain"), tr("Finite  M")
        self.finite = button(text, name, lambda: finite(self.finite.isChecked()), checkable=True)
        text = tr("Live model at small strain, or at finite strain where the forces are within its reach")
        self.finite.setToolTip(text)
        self.length = choice(tr("stretch of time that is shown"), (f"{seconds} s" for seconds in _LENGTHS))
        self.length.activated.connect(lambda: length(_LENGTHS[self.length.currentIndex()]))
        self.length.setFixedWidth(px(84))
        acts = hbox(1, self.finite, self.length, self.hold, spacing=GRID)
        self._rows = hbox(self._numbers(), acts, on=self, spacing=GRID // 2)
        for widget in (self.hold, self.finite, self.length):
            widget.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        # Numbers shrink if they do not all fit, and buttons if there is no room for a second row.
        self.setMinimumSize(1, QFontMetrics(font(TITLE)).height())

    def show_forces(self, visible: bool) -> None:
        self.forces_shown = visible
        self._fit()

    def show_numbers(self, values: Array) -> None:
        """Show the means of the latest readings (channels, n)."""
        for channel, form in PICTURE.items():
            finite = values[CHANNELS.index(channel)]
            finite = finite[np.isfinite(finite)]
            text = quantity(float(finite.mean()) if len(finite) else None, *form)
            if text != self.values[channel].text():
                set_text(self.values[channel], text)
                self.values[channel].setAccessibleName(speech(channel, text))

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._fit()

    def _fit(self) -> None:
        """Put the buttons below the numbers if both do not fit into a row, and then use smaller numbers."""
        if not self._short:
            self._acts = sum(push.sizeHint().width() + GRID for push in (self.finite, self.hold)) + self.length.width()
        self._short = self._acts > self.width()
        self.show_words()
        set_horizontal(self._rows, self._in_a_row(self.width()))
        size, role = next((pair for pair in _SIZES if self._needed_width(pair[0]) <= self.width()), _SIZES[-1])
        room = self.width()
        for channel, value in self.values.items():
            caption = self._captions[channel]
            value.setFixedWidth(self._widest(channel, size))
            regrade(value, role, "role")
            room -= caption.sizeHint().width() + value.width() + 2 * GRID
            for widget in (caption, value):
                widget.setVisible(self.forces_shown and room >= 0)

    def height_with_acts(self, width: int) -> int:
        """Return the height of numbers and buttons at a width [px]."""
        numbers, acts = self.minimumHeight(), self.hold.sizeHint().height()
        return max(numbers, acts) if self._in_a_row(width) else numbers + self._rows.spacing() + acts

    def _in_a_row(self, width: int) -> bool:
        return not self.forces_shown or self._needed_width(TITLE) + self._acts <= width

    def show_words(self) -> None:
        self.finite.setText("M" if self._short else tr("Finite  M"))
        self.hold.setText("H" if self._short else tr("Held  H") if self.hold.isChecked() else tr("Hold  H"))

    def _needed_width(self, size: int) -> int:
        """Return the width that all numbers need in a font size [px]."""
        captions = sum(caption.sizeHint().width() + 2 * GRID for caption in self._captions.values())
        return captions + sum(self._widest(channel, size) for channel in self.values)

    def _widest(self, channel: str, size: int) -> int:
        return QFontMetrics(font(size, bold=size == TITLE)).horizontalAdvance(_WIDEST[channel]) + 4

    def _numbers(self) -> QHBoxLayout:
        for channel in PICTURE:
            value = label("–", "title")
            value.setFixedWidth(self._widest(channel, TITLE))
            value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            value.setAccessibleName(speech(channel, "–"))
            caption = label(short_name(channel), "quiet")
            if channel in _COLOURS:
                caption.setStyleSheet(f"border-bottom: 3px solid {_COLOURS[channel]};")
            self.values[channel], self._captions[channel] = value, caption
        # If there is room, a caption is nearer to its own number than to another.
        spread = [widget for channel, value in self.values.items() for widget in (1, self._captions[channel], value)]
        return hbox(*spread[1:], len(PICTURE), spacing=GRID)


def speech(channel: str, text: str) -> str:
    """Return a screen reader's text for a number.

    >>> speech("N", "1.20 N"), speech("mu", "–")
    ('Normal force 1.20 N', 'Friction coefficient no number')
    """
    return f"{tr(_NAMES[channel])} {tr('no number') if text == '–' else text}"


def short_name(channel: str) -> str:
    """Return the short name of a channel."""
    return {"mu": "µ", "speed": tr("speed")}.get(channel, channel)


class LivePanel(Panel):
    """The middle of the experimenter's window."""

    def __init__(self, feed: LiveFeed, model: LiveModel) -> None:
        super().__init__(tr("live readings"))
        self._feed, self._model, self._model_trace = feed, model, ModelTrace()
        self._seconds = 10
        self._hold_time: float | None = None  # device time of the held picture, while readings continue
        self._read_at = 0.0
        self._content: object = None  # data of the drawn picture
        self.plots = [LivePlot(*plot) for plot in (*PLOTS, *AXIS_PLOTS)]
        self._model_plot = LivePlot(*_SED, MODEL_CHANNELS)
        self._model_plot.setMinimumHeight(1)  # it must not keep the window large
        self._column = (*self.plots[:3], self._model_plot)  # one below the other
        self.finger = FingerView()
        self.map = ContactMap()
        self.bar = LiveBar(self.show_seconds, self._hold, self._finite)
        self.drawer = Drawer(*self._lay_out())
        self.tab = button("", tr("drawer"), self.toggle_drawer, "handle")
        self.tab.setFixedWidth(px(TAB))
        self.tab.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)
        self._pictures = QWidget()
        hbox((self.drawer, 1), self.tab, on=self._pictures, spacing=2)
        self._rows = vbox(self.bar, (self._pictures, 1), 0, on=self, margins=GRID, spacing=4)
        self._show_tab()
        self.show_seconds(self._seconds)
        self.show_finite(settings().value(FINITE) == "yes")

    def set_room(self, room: bool) -> None:
        """Set whether the stroke and an open drawer fit next to each other."""
        self.drawer.open.set_room(room)
        self._show_tab()

    def toggle_drawer(self) -> None:
        if self.bar.forces_shown:
            self.drawer.open.toggle()
            self._show_tab()

    def _show_tab(self) -> None:
        is_open = bool(self.drawer.open)
        self.tab.setText("▸\nD" if is_open else "◂\nD")
        word = tr("close") if is_open else tr("open")
        self.tab.setAccessibleName(tr("{word} the drawer: six axes, sample and finger", word=word))
        self.tab.setToolTip(self.tab.accessibleName())
        self._show_acts()

    def show_forces(self, visible: bool) -> None:
        """Show readings, or hide them if the protocol hides them from the experimenter."""
        if visible != self.bar.forces_shown:
            self._pictures.setVisible(visible)
            self.bar.show_forces(visible)
            self._show_acts()

    def show_seconds(self, seconds: int) -> None:
        self._seconds = seconds
        for plot in (*self.plots, self._model_plot):
            plot.show_axis(seconds)
        self.bar.length.setCurrentIndex(_LENGTHS.index(seconds))

    def change_length(self, step: int) -> None:
        """Show the next longer (+1) or shorter (-1) stretch."""
        index = _LENGTHS.index(self._seconds) + step
        if 0 <= index < len(_LENGTHS):
            self.show_seconds(_LENGTHS[index])

    def show_finite(self, finite: bool) -> None:
        self.bar.finite.setChecked(finite)
        self._model.follow_at("finite" if finite else "small")

    def draw(self, marks: tuple[Mark, ...], clock: float, *, silent: bool = False) -> None:
        """Draw a frame; `clock` [s] is the machine's. A `silent` transducer measures nothing now."""
        if not self.bar.forces_shown:
            return
        trace = self._feed.trace
        newest = trace.newest
        if self._hold_time is not None and (newest is None or newest < self._hold_time):  # another device's clock
            self.bar.hold.click()
        now = self._hold_time if self._hold_time is not None else newest
        if now is None or newest is None:
            now, marks = 0.0, ()
        end_time = picture_end(marks, now)
        visible_marks = tuple(mark for mark in marks if mark.stop >= end_time - self._seconds and mark.start <= now)
        hold = tr("held") if self._hold_time is not None else ""
        frozen = newest is not None and end_time < newest
        latest = tr("last reading") if silent else tr("now")
        content = (trace, now, end_time, self._seconds, self._columns(), visible_marks, frozen, hold, latest)
        if content != self._content:
            self._content = content
            if end_time == newest or trace.holds(end_time - self._seconds):  # else the drawn stroke stays
                self._show_until(self.plots[:3], end_time, visible_marks, clock)
            self._show_until(self.plots[3:], now, visible_marks, clock)
            for plot in self._column:
                plot.show_axis(end=hold or (tr("lift + 1 s") if frozen else latest))
            for plot in self.plots[3:]:
                plot.show_axis(end=hold or latest)
            if self.map.isVisible():
                every = max(round(TRAIL * trace.rate / _POINTS), 1)
                _, values = trace.between(now - TRAIL, np.nextafter(now, np.inf), every)
                self.map.show_trail(values[CHANNELS.index("x") : CHANNELS.index("y") + 1, : 0 if silent else None].T)
        self._draw_model(end_time, clock, still=end_time != newest, silent=silent)
        if clock - self._read_at >= READ_EVERY:
            self._read_at = clock
            _, values = trace.between(now - 0.1, np.nextafter(now, np.inf))
            self.bar.show_numbers(values[:, :0] if silent else values)

    def _show_until(self, plots: Sequence[LivePlot], end_time: float, marks: tuple[Mark, ...], clock: float) -> None:
        """Show the readings up to `end_time` [s, device time]."""
        columns = self._feed.trace.columns(end_time - self._seconds, np.nextafter(end_time, np.inf), self._columns())
        for plot in plots:
            if plot.isVisible():
                plot.show_columns(columns, end_time, marks, clock)

    def model_says(self) -> None:
        for prediction in self._model.poll():
            self._model_trace.add_prediction(prediction)

    def _columns(self) -> int:
        """Return the number of columns of a curve: two pixels each, the width of its line."""
        first = next((plot for plot in self.plots if plot.isVisible()), self.plots[0])
        return max(first.width() // 2, 100)

    def _draw_model(self, now: float, clock: float, *, still: bool, silent: bool) -> None:
        """Draw the model: the last stroke once it has its full solve, else the present state."""
        if self._model_plot.isVisible() and (not still or self._model_trace.holds(now - self._seconds)):
            columns = self._model_trace.columns(now - self._seconds, np.nextafter(now, np.inf), self._columns())
            self._model_plot.show_columns(columns, now, (), clock)
        if not self.finger.isVisible() or self._hold_time is not None:
            return
        model = self._model
        text = model_text(model.provisional, model.settled, model.problem, silent=silent)
        provisional = None if silent else model.provisional
        answer = model.settled if model.settled is not None and model.settled.picture is not None else provisional
        picture, row = (None, np.empty(0)) if answer is None else (answer.picture, answer.row)
        self.finger.show_model(picture, row, text, clock)

    def _show_acts(self) -> None:
        """Show the buttons if the pictures below keep their least height; their keys always work."""
        inside = self.contentsRect().marginsRemoved(self._rows.contentsMargins())
        least = self.bar.height_with_acts(inside.width()) + self._rows.spacing() + self.drawer.least_height()
        visible = self.bar.forces_shown and self.height() >= px(LEAST_FOR_ACTS) and inside.height() >= least
        for act in (self.bar.finite, self.bar.length, self.bar.hold):
            act.setVisible(visible)

    def resizeEvent(self, event: QResizeEvent) -> None:
        speed, model = self.height() >= LEAST_FOR_SPEED, self.height() >= LEAST_FOR_MODEL
        visible = [True, True, speed, model]
        for plot, fits, below in zip(self._column, visible, [*visible[1:], False], strict=True):
            plot.setVisible(fits)
            plot.show_axis(times=not below)  # one axis for all of them
        self.finger.setVisible(model)
        self._show_acts()

    def _lay_out(self) -> tuple[QWidget, QWidget]:
        stroke, drawer = QWidget(), QWidget()
        vbox(*zip(self._column, (3, 2, 2, 2), strict=True), on=stroke, spacing=4)
        vbox((self.finger, 7), (self.map, 3), *((plot, 2) for plot in self.plots[3:]), on=drawer, spacing=4)
        self.plots[3].show_axis(times=False)
        return stroke, drawer

    def _hold(self) -> None:
        self._hold_time = self._feed.trace.newest if self.bar.hold.isChecked() else None
        self.bar.hold.setChecked(self._hold_time is not None)  # without readings, no picture is held
        self.bar.show_words()

    def _finite(self, finite: bool) -> None:
        settings().setValue(FINITE, "yes" if finite else "no")
        self.show_finite(finite)
