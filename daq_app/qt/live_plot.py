"""One live plot: curves over the last seconds, with gaps and with marks of detected events.

Static parts are painted once and copied, curves are lines a pixel wide. So a frame costs a fraction of
a scene of items (docs/decisions/2026-11-21-the-live-plots-are-painted.md).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen, QPixmap, QStaticText

from daq_app.qt.painting import PaintedWidget, blank, draw_line, fine, sheer
from daq_app.qt.preferences import type_scale
from daq_app.qt.tokens import SMALL, font, px
from daq_app.window.course_state import Mark
from daq_app.window.live_trace import CHANNELS, SCALE_MARGIN, Columns, PlotScale, ticks, times
from daq_app.wording import tr, tr_noop

AXIS_WIDTH = 52  # the same for all plots, so that their time axes align, before the font's scale [px]
_LEAST = 36  # height of the name and the times below it, before the font's scale [px]
SAMPLE = 14  # length of the line sample before a curve's name, before the font's scale [px]
DASHES = 45  # thirds of a dash period in the displayed stretch
_TOP = 2  # room above the names [px]
LINES = 3  # height in lines of type below which a plot has no line for its names
_MARK_STYLES = {"onset": Qt.PenStyle.SolidLine, "lift": Qt.PenStyle.DashLine, "steady": Qt.PenStyle.DotLine}
FAR = 1e4  # distance to which values outside of the plot are clipped [px]


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve of a plot."""

    channel: str
    colour: str  # a token's name, or a colour
    dashed: bool = False
    named: bool = True  # show its name if the plot has several curves


class LivePlot(PaintedWidget):
    """A plot whose time axis stands still: 0 is now."""

    def __init__(
        self, name: str, curves: Sequence[Curve], scale: PlotScale, channels: Iterable[str] = CHANNELS
    ) -> None:
        """Show nothing yet; `channels` names the rows of the data."""
        super().__init__()
        self._name = tr(name)
        self._rows = tuple(tuple(channels).index(curve.channel) for curve in curves)
        self._curves = tuple(curves)
        self._scale = scale
        self._seconds: float = 10.0
        self._times_shown: bool = True
        self._end_label: str = tr("now")  # label of the right edge
        self._now = 0.0
        self._columns = Columns(np.empty(0), np.empty((len(tuple(channels)), 0)))
        self._marks: tuple[Mark, ...] = ()
        self._mark_texts = {kind: QStaticText(tr(kind)) for kind in tr_noop(("onset", "lift"))}
        self.setMinimumSize(40, px(_LEAST))
        self.setAccessibleName(tr("plot of {name}", name=self._name))

    def show_axis(self, seconds: float | None = None, *, times: bool | None = None, end: str | None = None) -> None:
        """Set the displayed stretch [s], whether its times are shown, and the label of the right edge."""
        previous = self._seconds, self._times_shown, self._end_label
        self._seconds = self._seconds if seconds is None else seconds
        self._times_shown = self._times_shown if times is None else times
        self._end_label = self._end_label if end is None else end
        if previous != (self._seconds, self._times_shown, self._end_label):
            self.redraw()

    def show_columns(self, columns: Columns, now: float, marks: Sequence[Mark], clock: float) -> None:
        """Draw the columns with `now` [s, device time] at the right edge; `clock` [s] is for the scale's patience."""
        self._columns, self._now, self._marks = columns, now, tuple(marks)
        values = columns.values[list(self._rows)]
        least, greatest = (float(extremum.reduce(values, axis=None, initial=np.nan)) for extremum in (np.fmin, np.fmax))
        previous, self._scale = self._scale, self._scale.following(least, greatest, clock)
        if (previous.low, previous.high) != (self._scale.low, self._scale.high):
            self.redraw()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self.painter_on_ground()
        inside = self._inside()
        painter.setClipRect(inside)
        self._paint_marks(painter, inside)
        x = inside.right() + (self._columns.time - self._now) * inside.width() / self._seconds
        low, high = self._reach()
        for curve, row in zip(self._curves, self._rows, strict=True):
            y = inside.bottom() - (self._columns.values[row] - low) * (inside.height() / (high - low))
            if curve.dashed:
                # Dashes belong to the readings, and move with them.
                y = np.where(np.floor(self._columns.time * DASHES / self._seconds) % 3 < 2, y, np.nan)
            painter.setPen(fine(self._colour(curve.colour)))
            draw_line(painter, x, np.clip(y, -FAR, FAR))
        painter.setClipping(False)
        painter.drawPixmap(0, 0, self._names)

    def _inside(self) -> QRectF:
        """Return the rectangle of the curves: below the names, or in a low plot under them."""
        left = px(AXIS_WIDTH)
        below = px(SMALL + 5) if self._times_shown else 3
        names, high = QFontMetricsF(font(SMALL, bold=True)).height(), self.height() - below - _TOP
        top = _TOP + names if high >= LINES * names else _TOP
        return QRectF(left, top, max(self.width() - left - 4, 8), max(self.height() - below - top, 8))

    def _reach(self) -> tuple[float, float]:
        """Return the values at the lower and the upper edge."""
        beyond = SCALE_MARGIN * (self._scale.high - self._scale.low)
        return self._scale.low - beyond, self._scale.high + beyond

    def draw_ground(self) -> QPixmap:
        picture = blank(self, self.theme.surface)
        painter = QPainter(picture)
        painter.setFont(font(SMALL))
        inside = self._inside()
        self._paint_values(painter, inside)
        self._paint_times(painter, inside)
        painter.setPen(fine(self.theme.line))
        painter.drawLine(inside.topLeft(), inside.bottomLeft())
        painter.drawLine(inside.bottomLeft(), inside.bottomRight())
        painter.end()
        self._names = self._draw_names(inside)
        return picture

    def _paint_values(self, painter: QPainter, inside: QRectF) -> None:
        line = painter.fontMetrics().height()
        low, high = self._reach()
        per_unit = inside.height() / (high - low)
        above, below = (self._scale.high - high) * per_unit, (self._scale.low - low) * per_unit
        shift = max(line / 2.0 - inside.top() + above, inside.bottom() - below + line / 2.0 - self.height(), 0.0)
        room = (inside.height() + above - below - 2.0 * shift) / line  # the labels at the edges are moved inside
        for value in ticks(self._scale.low, self._scale.high, room):
            y = inside.bottom() - (value - low) * per_unit
            painter.setPen(fine(sheer(self.theme.line, 110)))
            painter.drawLine(QPointF(inside.left(), y), QPointF(inside.right(), y))
            painter.setPen(QColor(self.theme.quiet))
            box = QRectF(0, min(max(y - line / 2.0, 0.0), self.height() - line), inside.left() - 5, line)
            painter.drawText(box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, _number(value))

    def _paint_times(self, painter: QPainter, inside: QRectF) -> None:
        metrics = QFontMetricsF(painter.font())
        widest = metrics.horizontalAdvance("−00 s ")
        greatest_x = inside.right() - metrics.horizontalAdvance(f" {self._end_label}")  # where the end's label begins
        for value in times(self._seconds, inside.width() / widest):
            x = inside.right() + value * inside.width() / self._seconds
            painter.setPen(fine(self.theme.line))
            painter.drawLine(QPointF(x, inside.bottom()), QPointF(x, inside.bottom() - 4))
            if not self._times_shown:
                continue
            text = f"{_number(value)} s" if value else self._end_label
            width = metrics.horizontalAdvance(text)
            left = min(max(x - width / 2.0, inside.left() - 3), self.width() - width - 1)
            if value and left + width > greatest_x:
                continue
            painter.setPen(QColor(self.theme.quiet))
            painter.drawText(QPointF(left, inside.bottom() + metrics.ascent() + 1), text)

    def _draw_names(self, inside: QRectF) -> QPixmap:
        """Return the plot's name, and line samples with names if it has several curves.

        They are painted last: in a low plot they lie over the curves, and would be illegible under them.
        """
        metrics = QFontMetricsF(font(SMALL, bold=True))
        picture = blank(self, "transparent")
        painter = QPainter(picture)
        painter.setFont(font(SMALL, bold=True))
        x, baseline = inside.left() + 6, _TOP + metrics.ascent() + 1
        curves = [curve for curve in self._curves if curve.named]
        several = len(curves) > 1
        unit = self._name[max(self._name.find("["), 0) :] if several else self._name
        names_width = sum(4 + metrics.horizontalAdvance(f"{tr(curve.channel)}  ") for curve in curves)
        room = (inside.width() - 6 - names_width - metrics.horizontalAdvance(unit)) / max(len(curves), 1)
        sample = max(min(SAMPLE * type_scale(), room), 0.0)
        width = names_width + len(curves) * sample if several else 0.0
        ground = QRectF(x - 3, _TOP, width + metrics.horizontalAdvance(unit) + 6, metrics.height())
        painter.fillRect(ground, sheer(self.theme.surface, 200))
        for curve in curves if several else ():
            pen = QPen(QColor(self._colour(curve.colour)), 3)
            if curve.dashed:
                pen.setDashPattern([1.6, 1.2])
            painter.setPen(pen)
            line_end, middle = x + sample, baseline - metrics.xHeight() / 2.0
            painter.drawLine(QPointF(x, middle), QPointF(line_end, middle))
            painter.setPen(QColor(self.theme.quiet))
            painter.drawText(QPointF(line_end + 4, baseline), tr(curve.channel))
            x = line_end + 4 + metrics.horizontalAdvance(f"{tr(curve.channel)}  ")
        painter.setPen(QColor(self.theme.quiet))
        painter.drawText(QPointF(x, baseline), unit)
        painter.end()
        return picture

    def _paint_marks(self, painter: QPainter, inside: QRectF) -> None:
        """Mark detected events: a line for onset and lift, a shaded stretch for the steady window."""
        across = inside.width() / self._seconds
        painter.setFont(font(SMALL))
        line = painter.fontMetrics().height()
        free = inside.left()  # end of the text so far
        for mark in self._marks:
            start, stop = (inside.right() + (time - self._now) * across for time in (mark.start, mark.stop))
            window, text = QRectF(start, inside.top(), stop - start, inside.height()), self._mark_texts.get(mark.kind)
            painter.fillRect(window, sheer(self.theme.act, 36))
            painter.setPen(fine(self.theme.quiet if text else self.theme.act, _MARK_STYLES[mark.kind]))
            painter.drawLine(window.topLeft(), window.bottomLeft())
            painter.drawLine(window.topRight(), window.bottomRight())
            if text and inside.bottom() - _TOP >= 5 * line:  # a lower plot has no room for text; plots above it have it
                width = text.size().width()
                left = start - width - 3 if mark.kind == "onset" else start + 3
                if free <= left <= inside.right() - width:
                    painter.drawStaticText(QPointF(left, _TOP + line), text)
                    free = left + width

    def _colour(self, name: str) -> str:
        return name if name.startswith("#") else str(getattr(self.theme, name))


def _number(value: float) -> str:
    return f"{value:g}".replace("-", "−")
