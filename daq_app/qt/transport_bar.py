"""Play, pause, step, seek and speed: for the replay of readings and for the history of a finger."""

import time
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

from PySide6.QtCore import QSignalBlocker, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QSizePolicy, QSlider, QWidget

from daq_app.qt.parts import button, choice, hbox, label, say
from daq_app.qt.tokens import GRID, TARGET
from daq_app.wording import tr

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
TICK = 33  # between two pictures while it plays [ms]


@dataclass(frozen=True, slots=True)
class Transport:
    """A place between two instants, and whether it moves."""

    first: float  # [s]
    last: float  # [s]
    place: float  # where it stood at `since` [s]
    speed: float = 1.0  # session seconds in a real one
    since: float | None = None  # when it began to move [s, window's clock]; None: it stands

    @property
    def playing(self) -> bool:
        """Say whether it moves."""
        return self.since is not None

    def at(self, now: float) -> float:
        """Return where it is [s]; it does not go beyond its end.

        >>> Transport(0.0, 5.0, 1.0, speed=2.0, since=100.0).at(101.0), Transport(0.0, 5.0, 1.0).at(101.0)
        (3.0, 1.0)
        """
        moved = 0.0 if self.since is None else (now - self.since) * self.speed
        return min(max(self.place + moved, self.first), self.last)

    def ended(self, now: float) -> bool:
        """Say whether it has come to its end."""
        return self.playing and self.at(now) >= self.last

    def played(self, now: float) -> "Transport":
        """Return it moving; from its beginning where it stood at its end."""
        at = self.at(now)
        return replace(self, place=self.first if at >= self.last else at, since=now)

    def paused(self, now: float) -> "Transport":
        """Return it standing where it is."""
        return replace(self, place=self.at(now), since=None)

    def sought(self, place: float, now: float) -> "Transport":
        """Return it at another place, moving where it moved."""
        inside = min(max(place, self.first), self.last)
        return replace(self, place=inside, since=now if self.playing else None)

    def at_speed(self, speed: float, now: float) -> "Transport":
        """Return it with another speed, from where it is on."""
        return replace(self, place=self.at(now), speed=speed, since=now if self.playing else None)


class TransportBar(QWidget):
    """Moves through instants; `moved` tells the position of the one that is shown."""

    moved = Signal(int)
    ended = Signal()

    def __init__(self, what: str, *, tells_time: bool = True) -> None:
        """Offer to play `what`, which is not there yet; without `tells_time` the instants are no times of it."""
        super().__init__()
        self._what = what
        self._times: Sequence[float] = ()
        self._transport = Transport(0.0, 0.0, 0.0)
        self._shown = -1
        self.play = button("▶", tr("play {what}", what=what), self.toggle, "small")
        self.back = button("◀|", tr("one step back in {what}", what=what), lambda: self.step(-1), "small")
        self.forward = button("|▶", tr("one step forward in {what}", what=what), lambda: self.step(+1), "small")
        for widget in (self.play, self.back, self.forward):
            widget.setMinimumWidth(TARGET)
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName(tr("place in {what}", what=what))
        self.slider.setMinimumHeight(TARGET)
        self.slider.setMinimumWidth(60)
        self.slider.valueChanged.connect(self._move_to)
        self.speed = choice(tr("speed of {what}", what=what), (f"× {value:g}" for value in SPEEDS))
        self.speed.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.speed.setCurrentIndex(SPEEDS.index(1.0))
        self.speed.activated.connect(self._change_speed)
        self.place = label("", "quiet")
        self.place.setVisible(tells_time)
        hbox(self.play, self.back, self.forward, (self.slider, 1), self.place, self.speed, on=self, spacing=GRID)
        self._timer = QTimer(self)
        self._timer.setInterval(TICK)
        self._timer.timeout.connect(self._tick)
        self._enable()

    @property
    def playing(self) -> bool:
        return self._transport.playing

    def set_times(self, times: Sequence[float], at: int = 0) -> None:
        """Take the instants [s], rising, and stand at one of them; none of them: nothing can be played."""
        self._times = times
        ends = (times[0], times[-1]) if len(times) else (0.0, 0.0)
        place = times[at] if len(times) else 0.0
        self._transport = Transport(*ends, place, self._transport.speed)
        self._timer.stop()
        with QSignalBlocker(self.slider):
            self.slider.setRange(0, max(len(times) - 1, 0))
            self.slider.setPageStep(max(len(times) // 20, 1))
        self._shown = -1
        self._enable()
        if len(times):
            self._show(place)
        else:
            say(self.place, "")

    def toggle(self) -> None:
        if not len(self._times):
            return
        now = time.monotonic()
        self._transport = self._transport.paused(now) if self.playing else self._transport.played(now)
        (self._timer.start if self.playing else self._timer.stop)()
        self._enable()

    def step(self, by: int) -> None:
        """Go some instants on or back; what plays is paused."""
        if len(self._times):
            if self.playing:
                self.toggle()
            self.seek(min(max(self._shown + by, 0), len(self._times) - 1))

    def seek(self, at: int) -> None:
        self._transport = self._transport.sought(self._times[at], time.monotonic())
        self._show(self._times[at])

    def keyPressEvent(self, event: QKeyEvent) -> None:
        match event.key():
            case Qt.Key.Key_Space:
                self.toggle()
            case Qt.Key.Key_Left:
                self.step(-1)
            case Qt.Key.Key_Right:
                self.step(+1)
            case Qt.Key.Key_Home:
                self.step(-len(self._times))
            case Qt.Key.Key_End:
                self.step(+len(self._times))
            case _:
                super().keyPressEvent(event)

    def _move_to(self, at: int) -> None:
        if at != self._shown and len(self._times):
            self.seek(at)

    def _change_speed(self, at: int) -> None:
        self._transport = self._transport.at_speed(SPEEDS[at], time.monotonic())

    def _tick(self) -> None:
        now = time.monotonic()
        self._show(self._transport.at(now))
        if self._transport.ended(now):
            self.toggle()
            self.ended.emit()

    def _show(self, place: float) -> None:
        at = max(bisect_right(self._times, place) - 1, 0)
        if at == self._shown:
            return
        self._shown = at
        with QSignalBlocker(self.slider):
            self.slider.setValue(at)
        say(self.place, f"{self._times[at] - self._times[0]:.3f} s")
        self.moved.emit(at)

    def _enable(self) -> None:
        there = len(self._times) > 0
        for part in (self.play, self.back, self.forward, self.slider, self.speed):
            part.setEnabled(there)
        self.play.setText("❚❚" if self.playing else "▶")
        words = tr("pause {what}", what=self._what) if self.playing else tr("play {what}", what=self._what)
        self.play.setAccessibleName(words)
