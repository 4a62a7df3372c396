"""The centre of pressure on a drawing of the sample, seen from above with the subject below."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.qt.tokens import MU, SMALL, Tokens, font

Array = NDArray[np.float64]

ALONG, ACROSS = 60.0, 40.0  # what is drawn of the face [mm]


class ContactMap(QWidget):
    """Where the finger presses now, and where it came from. The drawing is of the face's middle, not to its edges."""

    def __init__(self, tokens: Tokens, scale: float) -> None:
        """Show an untouched sample."""
        super().__init__()
        self._tokens = tokens
        self._scale = scale
        self._trail: Array = np.empty((0, 2))
        self._direction = 0
        self.setMinimumSize(100, 60)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("centre of pressure on the sample: nothing touches")

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._tokens = tokens
        self.update()

    def show_direction(self, direction: int) -> None:
        """Show which way the stroke is to go: +1 away from the subject, -1 towards, 0 none."""
        if direction != self._direction:
            self._direction = direction
            self.update()

    def show_trail(self, position: Array) -> None:
        """Show the last positions (n, 2) [mm], the newest last; nan where nothing presses."""
        known = position[np.isfinite(position[:, 0])]
        touching = bool(len(position)) and bool(np.isfinite(position[-1, 0]))
        shown = known[:: max(len(known) // 120, 1)] if len(known) else known
        if not len(shown) and not len(self._trail):
            return
        self._trail = shown
        self._touching = touching
        where = f"x {known[-1, 0]:.0f}, y {known[-1, 1]:.0f} mm" if touching else "nothing touches"
        self.setAccessibleName(f"centre of pressure on the sample: {where}")
        self.update()

    _touching = False

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint sample, scale, arrow and trail."""
        t = self._tokens
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        margin = round(24 * self._scale)
        per_mm = min((self.height() - 2 * margin) / ALONG, (self.width() - 2 * margin) / ACROSS)
        if per_mm <= 0.2:
            return
        middle = QPointF(self.width() / 2, self.height() / 2)
        box = QRectF(0, 0, ACROSS * per_mm, ALONG * per_mm)
        box.moveCenter(middle)
        painter.setPen(QPen(QColor(t.line), 1))
        painter.setBrush(QColor(t.raised))
        painter.drawRoundedRect(box, 4, 4)
        painter.setFont(font(SMALL, self._scale))
        painter.setPen(QColor(t.quiet))
        words = QRectF(0, 0, self.width(), margin)
        painter.drawText(words, Qt.AlignmentFlag.AlignCenter, "distal")
        words.moveBottom(self.height())
        painter.drawText(words, Qt.AlignmentFlag.AlignCenter, "proximal · 10 mm grid")
        grid = QPen(QColor(t.line), 1, Qt.PenStyle.DotLine)
        painter.setPen(grid)
        for mm in range(-20, 30, 10):
            y = middle.y() - mm * per_mm
            painter.drawLine(QPointF(box.left(), y), QPointF(box.right(), y))
        for mm in range(-10, 20, 10):
            x = middle.x() + mm * per_mm
            painter.drawLine(QPointF(x, box.top()), QPointF(x, box.bottom()))
        self._paint_arrow(painter, box)
        if not len(self._trail):
            return
        # +x of the face frame points away from the subject: up. +y then points to the subject's left.
        points = [QPointF(middle.x() - y * per_mm, middle.y() - x * per_mm) for x, y in self._trail]
        painter.setPen(QPen(QColor(MU), 2))
        painter.drawPolyline(QPolygonF(points))
        if self._touching:
            painter.setPen(QPen(QColor(t.text), 2))
            painter.setBrush(QColor(MU))
            painter.drawEllipse(points[-1], 6, 6)

    def _paint_arrow(self, painter: QPainter, box: QRectF) -> None:
        if not self._direction:
            return
        painter.setPen(QPen(QColor(self._tokens.quiet), 2))
        x, half = box.right() - 10, box.height() * 0.3
        tip = box.center().y() - self._direction * half
        painter.drawLine(QPointF(x, box.center().y() + self._direction * half), QPointF(x, tip))
        for side in (-5, 5):
            painter.drawLine(QPointF(x, tip), QPointF(x + side, tip + self._direction * 8))
