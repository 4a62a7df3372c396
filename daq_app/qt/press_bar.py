"""How hard the subject's finger presses, where the protocol lets the subject see it."""

import numpy as np
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen

from daq_app.qt.painted import Painted
from daq_app.qt.tokens import GRID, Tokens
from daq_app.window.live_trace import CHANNELS, LiveTrace
from daq_app.window.subject_texts import SubjectText as Text

FULL = 5.0  # of the bar [N]
OVER = 0.1  # the mean of so long is shown: an eye follows it, and noise does not move it [s]


def newest_force(trace: LiveTrace) -> float:
    """Return the normal force of the last moment [N]; 0 where nothing is known."""
    newest = trace.newest
    if newest is None:
        return 0.0
    _, values = trace.between(newest - OVER, np.nextafter(newest, np.inf))
    normal = values[CHANNELS.index("N")]
    known = normal[np.isfinite(normal)]
    return float(known.mean()) if len(known) else 0.0


class PressBar(Painted):
    """A bar from no force, where reading begins, to `FULL`; no number, so that nobody aims at one."""

    def __init__(self, tokens: Tokens, scale: float) -> None:
        """Start empty."""
        super().__init__(tokens)
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
        painter.fillRect(filled, QColor(self.tokens.act))
        painter.setPen(QPen(QColor(self.tokens.quiet), 2))
        painter.drawRect(box)
