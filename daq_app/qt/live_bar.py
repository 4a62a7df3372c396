"""The row above the live plots: the numbers of this moment, which model is followed, how long a stretch is shown."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QFontMetrics, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QLabel, QSizePolicy, QWidget

from daq_app.qt.parts import button, choice, hbox, label, regrade, say
from daq_app.qt.tokens import GRID, MU, SMALL, TEXT, TITLE, N, T, font
from daq_app.window.live_trace import CHANNELS
from daq_app.wording import tr, tr_noop

LENGTHS = (1, 2, 5, 10, 20, 60)  # what can be shown [s]
READ = (("N", "N", 2, N), ("T", "N", 2, T), ("mu", "", 2, MU), ("speed", "mm/s", 0, ""))
SIZES = ((TITLE, "title"), (TEXT, "value"), (SMALL, "tight"))  # of the numbers: the first for which there is room
LEAST_FOR_ACTS = 170  # a lower panel has room for the numbers alone, before the font's scale [px]
NAMES = {
    "N": tr_noop("Normal force"),
    "T": tr_noop("Tangential force"),
    "mu": tr_noop("Friction coefficient"),
    "speed": tr_noop("Speed"),
}  # as spoken
WIDEST = {"N": "−00.00 N", "T": "00.00 N", "mu": "0.00", "speed": "000 mm/s"}  # each number keeps its place


class LiveBar(QWidget):
    """Numbers that are read, and what is shown."""

    def __init__(
        self, scale: float, length: Callable[[int], None], hold: Callable[[], None], finite: Callable[[bool], None]
    ) -> None:
        """Show no numbers; `length` takes what is chosen [s], `hold` is called at a press, `finite` takes a choice."""
        super().__init__()
        self._forces_shown = True
        self._on_hold = False
        self._short = False  # the buttons show their keys alone
        self._acts = 0  # width of the buttons with their words and of the drop-down [px]
        self._scale = scale
        self.values: dict[str, QLabel] = {}
        self._pairs: list[tuple[QLabel, QLabel]] = []
        self.hold = button(tr("Hold  H"), tr("hold the picture; readings go on"), hold, checkable=True)
        self.finite = button(
            tr("Finite  M"), tr("live model at finite strain"), lambda: finite(self.finite.isChecked()), checkable=True
        )
        self.finite.setToolTip(
            tr("Live model at small strain, or at finite strain where the forces are within its reach")
        )
        self.length = choice(tr("stretch of time that is shown"))
        for seconds in LENGTHS:
            self.length.addItem(f"{seconds} s", seconds)
        self.length.activated.connect(lambda: length(LENGTHS[self.length.currentIndex()]))
        self.length.setFixedWidth(round(84 * scale))
        acts = hbox(1, self.finite, self.length, self.hold, spacing=GRID)
        self._rows = hbox(self._numbers(), acts, on=self, spacing=GRID // 2)
        for widget in (self.hold, self.finite, self.length):
            widget.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        # Numbers give way where there is no room for all of them, and buttons where there is none for a second row.
        self.setMinimumSize(1, QFontMetrics(font(TITLE, scale)).height())

    def show_forces(self, shown: bool) -> None:
        """Show the numbers, or keep them from the experimenter where the protocol does."""
        self._forces_shown = shown
        self._fit()

    def fit_into(self, height: int) -> None:
        """Fold the buttons away where the panel is so low; their keys still serve."""
        for widget in (self.finite, self.length, self.hold):
            widget.setVisible(height >= LEAST_FOR_ACTS * self._scale)

    def show_held(self, on_hold: bool) -> None:
        """Say whether the picture is held."""
        self._on_hold = on_hold
        self._show_words()

    def show_numbers(self, values: NDArray[np.float64]) -> None:
        """Show the means of the last readings (channels, n)."""
        for channel, unit, digits, _ in READ:
            known = values[CHANNELS.index(channel)]
            known = known[np.isfinite(known)]
            # Adding nothing makes a zero of what would be a minus zero.
            text = f"{round(float(known.mean()), digits) + 0.0:.{digits}f} {unit}".strip() if len(known) else "–"
            text = text.replace("-", "−")
            if text != self.values[channel].text():
                say(self.values[channel], text)
                self.values[channel].setAccessibleName(spoken(channel, text))

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Hide the last numbers, and shorten the buttons, where the bar is too narrow for them."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        """Put the acts below the numbers where both find no room in a row, and the numbers in smaller type then."""
        if not self._short:
            self._acts = sum(w.sizeHint().width() + GRID for w in (self.finite, self.hold)) + self.length.width()
        self._short = self._acts > self.width()
        self._show_words()
        side_by_side = self._forces_shown and self._needed(TITLE) + self._acts <= self.width()
        size, role = next((pair for pair in SIZES if self._needed(pair[0]) <= self.width()), SIZES[-1])
        direction = QBoxLayout.Direction.LeftToRight if side_by_side else QBoxLayout.Direction.TopToBottom
        self._rows.setDirection(direction if self._forces_shown else QBoxLayout.Direction.LeftToRight)
        room = self.width()
        for channel, (caption, value) in zip(self.values, self._pairs, strict=True):
            value.setFixedWidth(self._widest(channel, size))
            regrade(value, role, "role")
            room -= caption.sizeHint().width() + value.width() + 2 * GRID
            for widget in (caption, value):
                widget.setVisible(self._forces_shown and room >= 0)

    def _show_words(self) -> None:
        self.finite.setText("M" if self._short else tr("Finite  M"))
        words = tr("Held  H") if self._on_hold else tr("Hold  H")
        self.hold.setText("H" if self._short else words)

    def _needed(self, size: int) -> int:
        """Return the width of all numbers in a type [px]."""
        captions = sum(caption.sizeHint().width() + 2 * GRID for caption, _ in self._pairs)
        return captions + sum(self._widest(channel, size) for channel in self.values)

    def _widest(self, channel: str, size: int) -> int:
        metrics = QFontMetrics(font(size, self._scale, bold=size == TITLE))
        return metrics.horizontalAdvance(WIDEST[channel]) + 4

    def _numbers(self) -> QHBoxLayout:
        for channel, _, _, colour in READ:
            value = label("–", "title")
            value.setFixedWidth(self._widest(channel, TITLE))
            value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            value.setAccessibleName(spoken(channel, "–"))
            caption = label(short_name(channel), "quiet")
            if colour:
                caption.setStyleSheet(f"border-bottom: 3px solid {colour};")
            self.values[channel] = value
            self._pairs.append((caption, value))
        # Where there is room, a caption stands nearer to its own number than to another.
        spread = [part for pair in self._pairs for part in (1, *pair)]
        return hbox(*spread[1:], len(READ), spacing=GRID)


def spoken(channel: str, text: str) -> str:
    """Return what a screen reader says of a number.

    >>> spoken("N", "1.20 N"), spoken("mu", "–")
    ('Normal force 1.20 N', 'Friction coefficient no number')
    """
    return f"{tr(NAMES[channel])} {tr('no number') if text == '–' else text}"


def short_name(channel: str) -> str:
    """Return how a channel is written where there is little room."""
    return {"mu": "µ", "speed": tr("speed")}.get(channel, channel)
