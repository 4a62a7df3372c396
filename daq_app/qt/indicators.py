"""Small painted things that show a state by shape, word and colour together: lamps, bars, the stroke's arrow."""

from typing import Literal

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.qt.tokens import GRID, Tokens, theme_of
from daq_app.window.live_trace import CHANNELS, LiveTrace
from daq_app.window.subject_texts import SubjectText as Text
from daq_app.window.view_bench import Bar
from daq_app.wording import tr

Grade = Literal["off", "on", "well", "look", "wrong"]
FULL = 5.0  # of the bar [N]
OVER = 0.1  # the mean of so long is shown: an eye follows it, and noise does not move it [s]


class Lamp(QWidget):
    """A lamp: a ring when off, a disc when well or recording, a triangle to look at, a square when wrong."""

    def __init__(self, name: str) -> None:
        """Start switched off; `name` is said to screen readers."""
        super().__init__()
        self._grade: Grade = "off"
        self._name = name
        self.setFixedSize(2 * GRID + 4, 2 * GRID + 4)
        self.show_grade("off", "off")

    def show_grade(self, grade: Grade, words: str) -> None:
        """Show a state and its words."""
        self.setAccessibleName(f"{self._name}: {words}")
        self.setToolTip(words)
        if grade != self._grade:
            self._grade = grade
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint the shape of the state."""
        t = theme_of(self)
        colour = {"off": t.quiet, "on": t.record, "well": t.quiet, "look": t.look, "wrong": t.wrong}[self._grade]
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QRectF(self.rect()).adjusted(3, 3, -3, -3)
        painter.setPen(QPen(QColor(colour), 2))
        if self._grade != "off":
            painter.setBrush(QColor(colour))
        match self._grade:
            case "look":
                middle = box.center().x()
                painter.drawPolygon(
                    QPolygonF([QPointF(middle, box.top()), box.bottomRight(), box.bottomLeft()]),
                )
            case "wrong":
                painter.drawRect(box)
            case _:
                painter.drawEllipse(box)


class LoadBar(QWidget):
    """How far one axis is loaded now, and the most it was loaded since somebody acknowledged it."""

    NAME, NOISE = 86, 104  # widths of the words beside the bar, before the font's scale

    def __init__(self, name: str, scale: float) -> None:
        super().__init__()
        self._scale = scale
        self._bar = Bar(name, 0.0, 0.0, over=False, noise="")
        self.setAccessibleName(tr("load on {name}", name=tr(name)))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(round(2.75 * GRID * scale))

    def sizeHint(self) -> QSize:  # noqa: N802  Qt's name
        """Return the usual size."""
        return QSize(round(200 * self._scale), self.height())

    def show_bar(self, bar: Bar) -> None:
        """Show a load."""
        if bar == self._bar:
            return
        self._bar = bar
        now = (
            tr("no rated range") if bar.share is None else tr("{share:.0f} % of the rated load", share=100 * bar.share)
        )
        peak = "" if bar.peak is None else tr(", at most {peak:.0f} %", peak=100 * bar.peak)
        state = tr(", OVERLOAD") if bar.over else ""
        noise = tr(", noise {noise}", noise=bar.noise) if bar.noise else ""
        self.setAccessibleName(
            tr(
                "load on {name}: {now}{peak}{state}{noise}",
                name=tr(bar.name),
                now=now,
                peak=peak,
                state=state,
                noise=noise,
            )
        )
        self.setToolTip(self.accessibleName())
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint name, bar, peak and noise."""
        t, bar = theme_of(self), self._bar
        painter = QPainter(self)
        left, right = round(self.NAME * self._scale), round(self.NOISE * self._scale)
        if self.width() < left + right + 40:
            right = 0
        colour = QColor(t.wrong if bar.over else t.text)
        painter.setPen(colour)
        name = QRectF(0, 0, left - 4, self.height())
        painter.drawText(name, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, tr(bar.name))
        track = QRectF(left, self.height() / 2 - 5, max(self.width() - left - right - 4, 8), 10)
        painter.setPen(QPen(QColor(t.line), 1))
        painter.setBrush(QColor(t.raised))
        painter.drawRect(track)
        if bar.share is not None:
            filled = track.adjusted(1, 1, -1, -1)
            filled.setWidth(filled.width() * min(bar.share, 1.0))
            painter.fillRect(filled, QColor(t.wrong if bar.share >= 1 else t.quiet))
        if bar.peak is not None:
            at = track.left() + track.width() * min(bar.peak, 1.0)
            painter.fillRect(QRectF(at - 1.5, track.top() - 3, 3, track.height() + 6), colour)
        if right:
            painter.setPen(QColor(t.wrong if bar.over else t.quiet))
            words = tr("OVERLOAD") if bar.over else bar.noise
            place = QRectF(self.width() - right + 4, 0, right - 4, self.height())
            painter.drawText(place, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, words)


class Arrow(QWidget):
    """Which way the stroke goes, as somebody facing the subject's finger from behind sees it: up is away."""

    def __init__(self) -> None:
        super().__init__()
        self._direction = 0
        self.setFixedSize(5 * GRID, 7 * GRID)
        self.setAccessibleName(tr("no stroke asked for"))

    def show_direction(self, direction: int) -> None:
        """Show +1 away from the subject (up), -1 towards the subject (down), 0 nothing."""
        if direction != self._direction:
            self._direction = direction
            words = {
                1: tr("stroke away from the subject"),
                -1: tr("stroke towards the subject"),
                0: tr("no stroke asked for"),
            }
            self.setAccessibleName(words[direction])
            self.setToolTip(words[direction])
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint the arrow."""
        if not self._direction:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.translate(self.width() / 2, self.height() / 2)
        painter.scale(1, self._direction)
        painter.setPen(QPen(QColor(theme_of(self).text), 4, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        half = self.height() / 2 - 6
        painter.drawLine(QPointF(0, half), QPointF(0, -half))
        painter.drawLine(QPointF(0, -half), QPointF(-12, -half + 14))
        painter.drawLine(QPointF(0, -half), QPointF(12, -half + 14))


def paint_lost(painter: QPainter, at: QPointF, tokens: Tokens) -> None:
    """Mark the place of a failed solve, on any ground: a ring with a cross."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for colour, width in ((tokens.surface, 5.0), (tokens.wrong, 2.5)):
        painter.setPen(QPen(QColor(colour), width))
        painter.drawEllipse(at, 11.0, 11.0)
        painter.drawLine(at + QPointF(-7, -7), at + QPointF(7, 7))
        painter.drawLine(at + QPointF(-7, 7), at + QPointF(7, -7))


def newest_force(trace: LiveTrace) -> float:
    """Return the normal force of the last moment [N]; 0 where nothing is known."""
    newest = trace.newest
    if newest is None:
        return 0.0
    _, values = trace.between(newest - OVER, np.nextafter(newest, np.inf))
    normal = values[CHANNELS.index("N")]
    known = normal[np.isfinite(normal)]
    return float(known.mean()) if len(known) else 0.0


class PressBar(QWidget):
    """A bar from no force, where reading begins, to `FULL`; no number, so that nobody aims at one."""

    def __init__(self, scale: float) -> None:
        super().__init__()
        self._force = 0.0
        self.setAccessibleName(Text.PRESSING)
        self.setFixedHeight(round(6 * GRID * scale))

    def show_force(self, trace: LiveTrace) -> None:
        """Show the normal force of the last moment; an empty bar where nothing is known."""
        force = newest_force(trace)
        if abs(force - self._force) * self.width() > FULL:  # a pixel
            self._force = force
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint the bar."""
        painter = QPainter(self)
        box = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        filled = QRectF(box)
        filled.setWidth(box.width() * min(max(self._force / FULL, 0.0), 1.0))
        if self.layoutDirection() == Qt.LayoutDirection.RightToLeft:
            filled.moveRight(box.right())
        painter.fillRect(filled, QColor(theme_of(self).act))
        painter.setPen(QPen(QColor(theme_of(self).quiet), 2))
        painter.drawRect(box)
