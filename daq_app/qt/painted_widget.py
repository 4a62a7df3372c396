"""A widget painted by hand: what stands still is painted once, and copied under what moves."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QPainter, QPixmap, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.qt.tokens import Tokens


class PaintedWidget(QWidget):
    """Takes all the room there is; a subclass paints the ground, and in its `paintEvent` upon it."""

    def __init__(self, tokens: Tokens) -> None:
        """Begin without a ground."""
        super().__init__()
        self._tokens = tokens
        self._ground: QPixmap | None = None  # what stands still
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)  # nothing behind it needs painting
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._tokens = tokens
        self._anew()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Paint the ground for the new size."""
        super().resizeEvent(event)
        self._ground = None

    def _anew(self) -> None:
        """Paint everything anew, the ground too."""
        self._ground = None
        self.update()

    def _upon_ground(self) -> QPainter:
        """Return a painter at work on the widget, the ground already there."""
        if self._ground is None or self._ground.devicePixelRatio() != self.devicePixelRatioF():
            self._ground = self._painted_ground()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._ground)
        return painter

    def _painted_ground(self) -> QPixmap:
        """Return what stands still, as large as the widget."""
        raise NotImplementedError
