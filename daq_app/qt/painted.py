"""A widget painted by hand: what stands still is painted once, and copied under what moves."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QPainter, QPixmap, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.qt.tokens import LIGHT, theme_of


class PaintedWidget(QWidget):
    """Takes all the room there is; a subclass paints the ground, and in its `paintEvent` upon it."""

    def __init__(self) -> None:
        super().__init__()
        self._ground: QPixmap | None = None  # what stands still ...
        self.theme = LIGHT  # ... and the theme in which it was painted
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)  # nothing behind it needs painting
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Paint the ground for the new size."""
        super().resizeEvent(event)
        self.forget_ground()

    def forget_ground(self) -> None:
        """Draw what stands still once more when the widget is next painted."""
        self._ground = None

    def redraw(self) -> None:
        """Paint everything anew, the ground too."""
        self.forget_ground()
        self.update()

    def painter_on_ground(self) -> QPainter:
        """Return a painter at work on the widget, the ground already there."""
        ratio, theme = self.devicePixelRatioF(), theme_of(self)
        if self._ground is None or self._ground.devicePixelRatio() != ratio or theme is not self.theme:
            self.theme = theme
            self._ground = self.draw_ground()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._ground)
        return painter

    def draw_ground(self) -> QPixmap:
        """Return what stands still, as large as the widget."""
        raise NotImplementedError
