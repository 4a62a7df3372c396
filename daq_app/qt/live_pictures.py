"""Live pictures during a stroke: the contact on the sample, and the deforming finger with its SED."""

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.analyst.frame import View
from daq_app.qt.painting import PaintedWidget, blank, draw_line, fill_faces, fine, lines, mark_failed_solve, paint_arrow
from daq_app.qt.parts import breakable
from daq_app.qt.tokens import MODEL, MU, SMALL, font, theme_of
from daq_app.window.live_model import ModelText, Picture
from daq_app.window.live_trace import PlotScale
from daq_app.wording import tr
from drivers.arrays import Array
from solver.prediction import ROW

_ALONG, ACROSS = 60.0, 40.0  # size of the drawn part of the face [mm]
_MARGIN = 4  # [pixels]
TOO_SMALL = 0.2  # pixels per millimetre below which a picture is left out

_VIEW_BOX = (-9.0, 9.0, -1.0, 13.0)  # left, right, below, above of the drawn region [mm]
_FINGER_SHARE = 0.62  # share of the height for the finger; the row has the rest
# The colour map magma (van der Walt and Smith, 2015), from its light end to a fifth before its dark one.
MAGMA = (
    "#fcfdbf", "#fde9aa", "#fed698", "#fec186", "#feae77", "#fd9a6a", "#fb8660", "#f7715c", "#f05f5d", "#e44f64",
    "#d5446c", "#c43c74", "#b3367a", "#a1307e", "#902a81", "#7f2482", "#6e1e81", "#5d177f", "#4d117a", "#3b0f70",
)  # fmt: skip
ROW_LINES = 4.0  # height in lines of text below which the row is left out
TOP_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop
EVERY = 1 / 30  # least time between two pictures: nobody sees more [s]
_TOP = 0.97  # share of the faces' SED below the end of the colour scale


class ContactMap(PaintedWidget):
    """The present contact and its trail, drawn in the middle of the face, without its edges."""

    def __init__(self) -> None:
        super().__init__()
        self._trail: Array = np.empty((0, 2))
        self._touching = False
        self._direction = 0
        self._labels = (tr("distal"), tr("10 mm grid"), tr("proximal"))
        self.setMinimumSize(100, 60)
        self.setAccessibleName(tr("centre of pressure on the sample: nothing touches"))

    def show_direction(self, direction: int) -> None:
        """Show the direction of the next stroke: +1 away from the subject, -1 towards, 0 none."""
        if direction != self._direction:
            self._direction = direction
            self.redraw()

    def show_trail(self, position: Array) -> None:
        """Show the last positions (n, 2) [mm], the newest last; nan without contact."""
        trail = position[np.isfinite(position[:, 0])]
        touching = bool(len(position)) and bool(np.isfinite(position[-1, 0]))
        if not len(trail) and not len(self._trail):
            return
        self._trail = trail
        self._touching = touching
        position_text = f"x {trail[-1, 0]:.0f}, y {trail[-1, 1]:.0f} mm" if touching else tr("nothing touches")
        self.setAccessibleName(tr("centre of pressure on the sample: {where}", where=position_text))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self.painter_on_ground()
        per_mm = self._per_mm()
        if not len(self._trail) or per_mm <= TOO_SMALL:
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        # +x of the face frame points away from the subject: up. +y then points to the subject's left.
        x = self._middle().x() - self._trail[:, 1] * per_mm
        y = self._middle().y() - self._trail[:, 0] * per_mm
        painter.setPen(QPen(QColor(MU), 2))
        for piece in lines(x, y):
            painter.drawPolyline(piece)
        if self._touching:
            painter.setPen(QPen(QColor(self.theme.text), 2))
            painter.setBrush(QColor(MU))
            painter.drawEllipse(QPointF(x[-1], y[-1]), 6, 6)

    def _per_mm(self) -> float:
        return min((self.height() - 2 * _MARGIN) / _ALONG, (self.width() - self._labels_width() - 2 * _MARGIN) / ACROSS)

    def _labels_width(self) -> float:
        """Return the width of the column of labels to the right of the sample."""
        metrics = QFontMetricsF(font(SMALL))
        return max(metrics.horizontalAdvance(text) for text in self._labels) + 2 * _MARGIN

    def _middle(self) -> QPointF:
        """Return the centre of the face: the centre of the widget, or further left to leave room for the labels."""
        room = self.width() - self._labels_width() - _MARGIN
        return QPointF(min(self.width() / 2, room - ACROSS * self._per_mm() / 2), self.height() / 2)

    def draw_ground(self) -> QPixmap:
        t = self.theme
        picture = blank(self, t.surface)
        per_mm = self._per_mm()
        if per_mm <= TOO_SMALL:
            return picture
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = self._middle()
        box = QRectF(0, 0, ACROSS * per_mm, _ALONG * per_mm)
        box.moveCenter(middle)
        painter.setPen(QPen(QColor(t.line), 1))
        painter.setBrush(QColor(t.raised))
        painter.drawRoundedRect(box, 4, 4)
        painter.setFont(font(SMALL))
        painter.setPen(QColor(t.quiet))
        left = box.right() + 2 * _MARGIN
        margin_box = QRectF(left, box.top(), self.width() - left, box.height())
        alignments = (Qt.AlignmentFlag.AlignTop, Qt.AlignmentFlag.AlignVCenter, Qt.AlignmentFlag.AlignBottom)
        if box.height() >= len(alignments) * painter.fontMetrics().height():
            for alignment, text in zip(alignments, self._labels, strict=True):
                painter.drawText(margin_box, Qt.AlignmentFlag.AlignLeft | alignment, text)
        painter.setPen(QPen(QColor(t.line), 1, Qt.PenStyle.DotLine))
        for mm in range(-20, 30, 10):
            y = middle.y() - mm * per_mm
            painter.drawLine(QPointF(box.left(), y), QPointF(box.right(), y))
        for mm in range(-10, 20, 10):
            x = middle.x() + mm * per_mm
            painter.drawLine(QPointF(x, box.top()), QPointF(x, box.bottom()))
        if self._direction:
            painter.setPen(QPen(QColor(t.quiet), 2))
            y, half = box.center().y(), self._direction * box.height() * 0.3
            paint_arrow(painter, box.right() - 10, y + half, y - half, QPointF(5, 8))
        painter.end()
        return picture


class FingerView(QWidget):
    """A picture of the latest state of the model."""

    def __init__(self) -> None:
        super().__init__()
        self._picture: Picture | None = None
        self._row: Array = np.empty(0)
        self._text = ModelText("", "none")
        self._colours = PlotScale(0.0, 5.0, 5.0)  # [kPa]
        self._heights = PlotScale(0.0, 5.0, 5.0)  # [kPa]
        self._drawn_at = -1.0  # [s]
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)  # nothing behind it needs painting
        self.setMinimumSize(100, 1)  # a low one is folded away
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(tr("finger as the model sees it"))

    def show_model(self, picture: Picture | None, row: Array, text: ModelText, clock: float) -> None:
        """Show a state; `row` (r,) [MPa] at `solver.prediction.ROW`, `clock` [s] is for the scales' patience."""
        if text == self._text and (clock - self._drawn_at < EVERY or _alike(picture, self._picture)):
            return
        self._drawn_at = clock
        self._picture, self._row, self._text = picture, 1000.0 * row, text
        if picture is not None and len(picture.sed):
            self._colours = self._colours.following(0.0, 1000.0 * float(np.quantile(picture.sed, _TOP)), clock)
        finite = self._row[np.isfinite(self._row)]
        if len(finite):
            self._heights = self._heights.following(0.0, float(finite.max()), clock)
        self.setAccessibleName(tr("finger as the model sees it: {words}", words=text.text))
        self.setToolTip(text.text)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter, t = QPainter(self), theme_of(self)
        painter.fillRect(self.rect(), QColor(t.surface))
        painter.setFont(font(SMALL, bold=self._text.state in ("settled", "instead", "beyond")))
        painter.setPen(QColor(t.look if self._text.state in ("instead", "beyond", "failed") else t.quiet))
        flags = int(Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignTop)
        box = QRectF(4, 0, self.width() - 8, self.height())
        height = painter.boundingRect(box, flags, words := breakable(self._text.text)).height()
        painter.drawText(box, flags, words)
        # Three lines are always reserved for text, so that the picture does not move; a failure takes what it needs.
        line = painter.fontMetrics().height()
        top = max(height, 3.0 * line) + 4
        painter.setFont(font(SMALL))
        room = self.height() - top
        row = room * (1.0 - _FINGER_SHARE) if room * (1.0 - _FINGER_SHARE) >= ROW_LINES * line else 0.0
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if room - row >= line:
            self._paint_finger(painter, QRectF(0, top, self.width(), room - row))
        if row:
            self._paint_row(painter, QRectF(0, top + room - row, self.width(), row))

    def _paint_finger(self, painter: QPainter, box: QRectF) -> None:
        t, view = theme_of(self), View.fit(_VIEW_BOX, box.left(), box.top(), box.width(), box.height())
        if view.per_mm < 1.0:
            return
        painter.save()
        painter.setClipRect(box)
        painter.setPen(QPen(QColor(t.quiet), 2))
        ground = view.to_screen(np.zeros((1, 2)))[0, 1]
        painter.drawLine(QPointF(box.left(), ground), QPointF(box.right(), ground))
        picture = self._picture
        if picture is not None:
            corners = view.to_screen(picture.nodes)[picture.faces]
            fill_faces(painter, corners, 1000.0 * picture.sed / self._colours.high, [*map(QColor, MAGMA)])
            style = Qt.PenStyle.SolidLine if self._text.state == "settled" else Qt.PenStyle.DashLine
            painter.setPen(fine(t.text, style))
            draw_line(painter, *view.to_screen(picture.outline).T)
            if picture.lost is not None:
                mark_failed_solve(painter, QPointF(*view.to_screen(np.array([picture.lost]))[0].tolist()), t)
        painter.restore()
        painter.setPen(QColor(t.quiet))
        painter.drawText(box.adjusted(4, 0, -4, -2), TOP_RIGHT, tr("0 to {high:g} kPa", high=self._colours.high))

    def _paint_row(self, painter: QPainter, box: QRectF) -> None:
        line, t = painter.fontMetrics().height(), theme_of(self)
        plot = box.adjusted(6, 2, -6, -line)
        painter.setPen(QColor(t.quiet))
        painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop, tr("  SED along the skin [kPa]"))
        painter.drawText(box.adjusted(0, 0, -6, 0), TOP_RIGHT, f"{self._heights.high:g}")
        side, bottom = Qt.AlignmentFlag, Qt.AlignmentFlag.AlignBottom
        painter.drawText(box, side.AlignLeft | bottom, tr("  {row:g} mm proximal", row=-ROW[0]))
        painter.drawText(box.adjusted(0, 0, -6, 0), side.AlignRight | bottom, tr("{row:g} mm distal", row=ROW[-1]))
        painter.setPen(QPen(QColor(t.line), 1))
        painter.drawLine(plot.bottomLeft(), plot.bottomRight())
        across = (ROW - ROW[0]) / (ROW[-1] - ROW[0])
        middle = plot.left() + plot.width() * float(-ROW[0] / (ROW[-1] - ROW[0]))
        painter.setPen(QPen(QColor(t.quiet), 1, Qt.PenStyle.DotLine))
        painter.drawLine(QPointF(middle, plot.top()), QPointF(middle, plot.bottom()))
        if len(self._row) != len(ROW):
            return
        finite = np.isfinite(self._row)
        x = plot.left() + plot.width() * across[finite]
        y = plot.bottom() - plot.height() * self._row[finite] / self._heights.high
        style = Qt.PenStyle.SolidLine if self._text.state == "settled" else Qt.PenStyle.DashLine
        painter.setPen(fine(MODEL, style))
        draw_line(painter, x, y)


def _alike(picture: Picture | None, previous: Picture | None) -> bool:
    """Say whether two pictures are equal: a finger without contact is reported sixty times a second."""
    if picture is previous or picture is None or previous is None:
        return picture is previous
    return np.array_equal(picture.outline, previous.outline)
