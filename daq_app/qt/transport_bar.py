"""Play, pause, step, seek and speed: for the replay of readings and for the history of a finger."""

from bisect import bisect_right
from collections.abc import Sequence

from PySide6.QtCore import QEasingCurve, QSignalBlocker, Qt, QTimeLine, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QSizePolicy, QSlider, QWidget

from daq_app.qt.layout import hbox
from daq_app.qt.parts import button, choice, label, set_text
from daq_app.qt.tokens import GRID, TARGET
from daq_app.wording import tr

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
_TICK = 33  # between two pictures during playback [ms]


class TransportBar(QWidget):
    """Moves through a sequence of times; `moved` carries the index of the current one."""

    moved = Signal(int)
    ended = Signal()

    def __init__(self, name: str, *, tells_time: bool = True) -> None:
        """Offer to play `name`, not yet loaded; without `tells_time` the sequence is not shown as times."""
        super().__init__()
        self._name = name
        self._times: Sequence[float] = ()
        self._index = -1
        self.play = button("▶", tr("play {what}", what=name), self.toggle, "small")
        self.back = button("◀|", tr("one step back in {what}", what=name), lambda: self.step(-1), "small")
        self.forward = button("|▶", tr("one step forward in {what}", what=name), lambda: self.step(+1), "small")
        for widget in (self.play, self.back, self.forward):
            widget.setMinimumWidth(TARGET)
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName(tr("place in {what}", what=name))
        self.slider.setMinimumHeight(TARGET)
        self.slider.setMinimumWidth(60)
        self.slider.valueChanged.connect(self._move_to)
        self.speed = choice(tr("speed of {what}", what=name), (f"× {value:g}" for value in SPEEDS))
        self.speed.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.speed.setCurrentIndex(SPEEDS.index(1.0))
        self.speed.activated.connect(lambda: self._set_time(self._time))
        self.time_label = label("", "quiet")
        self.time_label.setVisible(tells_time)
        hbox(self.play, self.back, self.forward, (self.slider, 1), self.time_label, self.speed, on=self, spacing=GRID)
        linear = QEasingCurve(QEasingCurve.Type.Linear)
        self._line = QTimeLine(parent=self, easingCurve=linear, updateInterval=_TICK)  # from the first time to the last
        self._line.valueChanged.connect(lambda: self._show(self._time))
        self._line.finished.connect(self._enable)
        self._line.finished.connect(self.ended)
        self._enable()

    @property
    def playing(self) -> bool:
        return self._line.state() == QTimeLine.State.Running

    def set_times(self, times: Sequence[float]) -> None:
        """Set the times [s], ascending, and go to the last; without any, nothing can be played."""
        self._times = times
        self._line.stop()
        with QSignalBlocker(self.slider):
            self.slider.setRange(0, max(len(times) - 1, 0))
            self.slider.setPageStep(max(len(times) // 20, 1))
        self._index = -1
        self._enable()
        if len(times):
            self.seek(len(times) - 1)
        else:
            set_text(self.time_label, "")

    def toggle(self) -> None:
        if self.playing:
            self._line.stop()
        elif len(self._times):
            if self._line.currentTime() >= self._line.duration():
                self._line.setCurrentTime(0)
            self._line.resume()
        self._enable()

    def step(self, count: int) -> None:
        """Pause, and move by `count` times forward or back."""
        if len(self._times):
            if self.playing:
                self.toggle()
            self.seek(min(max(self._index + count, 0), len(self._times) - 1))

    def seek(self, index: int) -> None:
        self._set_time(self._times[index])
        self._show(self._times[index])

    def keyPressEvent(self, event: QKeyEvent) -> None:
        steps: dict[int, int] = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}
        steps |= {Qt.Key.Key_Home: -len(self._times), Qt.Key.Key_End: len(self._times)}
        if event.key() == Qt.Key.Key_Space:
            self.toggle()
        elif event.key() in steps:
            self.step(steps[event.key()])
        else:
            super().keyPressEvent(event)

    def _move_to(self, index: int) -> None:
        if index != self._index and len(self._times):
            self.seek(index)

    @property
    def _time(self) -> float:
        """Return the position of the time line [s]."""
        first, last = (self._times[0], self._times[-1]) if len(self._times) else (0.0, 0.0)
        return first + self._line.currentValue() * (last - first)

    def _set_time(self, time: float) -> None:
        """Set the time line to a position [s], at the chosen speed; if it was running it continues from there."""
        if not len(self._times):
            return
        playing, first, last = self.playing, self._times[0], self._times[-1]
        per_second = 1000.0 / SPEEDS[self.speed.currentIndex()]
        with QSignalBlocker(self._line):  # callers show the position, exact to a reading
            self._line.stop()
            self._line.setDuration(max(round(per_second * (last - first)), 1))
            self._line.setCurrentTime(round(per_second * (time - first)))
            if playing:
                self._line.resume()

    def _show(self, time: float) -> None:
        index = max(bisect_right(self._times, time) - 1, 0)
        if index == self._index:
            return
        self._index = index
        with QSignalBlocker(self.slider):
            self.slider.setValue(index)
        set_text(self.time_label, f"{self._times[index] - self._times[0]:.3f} s")
        self.moved.emit(index)

    def _enable(self) -> None:
        playable = len(self._times) > 0
        for widget in (self.play, self.back, self.forward, self.slider, self.speed):
            widget.setEnabled(playable)
        self.play.setText("❚❚" if self.playing else "▶")
        name = tr("pause {what}", what=self._name) if self.playing else tr("play {what}", what=self._name)
        self.play.setAccessibleName(name)
