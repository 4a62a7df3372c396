"""The centre of pressure on a drawing of the sample, seen from above with the subject below."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen, QPixmap

from daq_app.qt.painted import PaintedWidget
from daq_app.qt.shapes import blank, lines
from daq_app.qt.tokens import MU, SMALL, font
from daq_app.wording import tr

Array = NDArray[np.float64]

ALONG, ACROSS = 60.0, 40.0  # what is drawn of the face [mm]
MARGIN = 4  # [pixels]
TOO_SMALL = 0.2  # a picture with fewer pixels to the millimetre is left out


class ContactMap(PaintedWidget):
    """Where the finger presses now, and where it came from. The drawing is of the face's middle, not to its edges."""

    def __init__(self, scale: float) -> None:
        super().__init__()
        self._scale = scale
        self._trail: Array = np.empty((0, 2))
        self._touching = False
        self._direction = 0
        self._words = (tr("distal"), tr("10 mm grid"), tr("proximal"))
        self.setMinimumSize(100, 60)
        self.setAccessibleName(tr("centre of pressure on the sample: nothing touches"))

    def show_direction(self, direction: int) -> None:
        """Show which way the stroke is to go: +1 away from the subject, -1 towards, 0 none."""
        if direction != self._direction:
            self._direction = direction
            self.redraw()

    def show_trail(self, position: Array) -> None:
        """Show the last positions (n, 2) [mm], the newest last; nan where nothing presses."""
        shown = position[np.isfinite(position[:, 0])]
        touching = bool(len(position)) and bool(np.isfinite(position[-1, 0]))
        if not len(shown) and not len(self._trail):
            return
        self._trail = shown
        self._touching = touching
        where = f"x {shown[-1, 0]:.0f}, y {shown[-1, 1]:.0f} mm" if touching else tr("nothing touches")
        self.setAccessibleName(tr("centre of pressure on the sample: {where}", where=where))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Copy the sample, and paint the trail upon it."""
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
        """Return how many pixels a millimetre has."""
        return min((self.height() - 2 * MARGIN) / ALONG, (self.width() - self._words_width() - 2 * MARGIN) / ACROSS)

    def _words_width(self) -> float:
        """Return the width of the column of words at the right of the sample."""
        metrics = QFontMetricsF(font(SMALL, self._scale))
        return max(metrics.horizontalAdvance(words) for words in self._words) + 2 * MARGIN

    def _middle(self) -> QPointF:
        """Return where the middle of the face is: that of the widget, or as far left as the words need."""
        room = self.width() - self._words_width() - MARGIN
        return QPointF(min(self.width() / 2, room - ACROSS * self._per_mm() / 2), self.height() / 2)

    def draw_ground(self) -> QPixmap:
        """Return sample, grid, words and arrow."""
        t = self.theme
        picture = blank(self, t.surface)
        per_mm = self._per_mm()
        if per_mm <= TOO_SMALL:
            return picture
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = self._middle()
        box = QRectF(0, 0, ACROSS * per_mm, ALONG * per_mm)
        box.moveCenter(middle)
        painter.setPen(QPen(QColor(t.line), 1))
        painter.setBrush(QColor(t.raised))
        painter.drawRoundedRect(box, 4, 4)
        painter.setFont(font(SMALL, self._scale))
        painter.setPen(QColor(t.quiet))
        margin_box = QRectF(box.right() + 2 * MARGIN, box.top(), self.width() - box.right() - 2 * MARGIN, box.height())
        places = (Qt.AlignmentFlag.AlignTop, Qt.AlignmentFlag.AlignVCenter, Qt.AlignmentFlag.AlignBottom)
        if box.height() >= len(places) * painter.fontMetrics().height():
            for place, text in zip(places, self._words, strict=True):
                painter.drawText(margin_box, Qt.AlignmentFlag.AlignLeft | place, text)
        painter.setPen(QPen(QColor(t.line), 1, Qt.PenStyle.DotLine))
        for mm in range(-20, 30, 10):
            y = middle.y() - mm * per_mm
            painter.drawLine(QPointF(box.left(), y), QPointF(box.right(), y))
        for mm in range(-10, 20, 10):
            x = middle.x() + mm * per_mm
            painter.drawLine(QPointF(x, box.top()), QPointF(x, box.bottom()))
        self._paint_arrow(painter, box)
        painter.end()
        return picture

    def _paint_arrow(self, painter: QPainter, box: QRectF) -> None:
        if not self._direction:
            return
        painter.setPen(QPen(QColor(self.theme.quiet), 2))
        x, half = box.right() - 10, box.height() * 0.3
        tip = box.center().y() - self._direction * half
        painter.drawLine(QPointF(x, box.center().y() + self._direction * half), QPointF(x, tip))
        for side in (-5, 5):
            painter.drawLine(QPointF(x, tip), QPointF(x + side, tip + self._direction * 8))
