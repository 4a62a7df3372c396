"""A picture of the subject's page, drawn by the very window that the subject sees; nothing can be answered on it."""

from PySide6.QtCore import QPoint, QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent, QPixmap, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.qt.subject_window import SubjectWindow
from daq_app.qt.tokens import Tokens
from daq_app.window.view_subject import SubjectView
from daq_app.wording import tr


class SubjectPicture(QWidget):
    """Shows a page at the size it has on the subject's screen, made as small as there is room for.

    The window that draws it is a second one that nobody sees, so that the subject's answer is never in the picture.
    """

    def __init__(self, tokens: Tokens, scale: float, size: QSize) -> None:
        """Show nothing yet; `size` is that of the subject's window."""
        super().__init__()
        self._page = SubjectWindow(tokens, scale, lambda: 0.0)
        self._page.setAttribute(Qt.WidgetAttribute.WA_DontShowOnScreen)
        self._page.resize(size)
        self._view: SubjectView | None = None
        self._picture = QPixmap()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(160, 100)

    @property
    def page(self) -> SubjectWindow:
        """Return the window that draws the picture."""
        return self._page

    def show_page(self, view: SubjectView, size: QSize) -> None:
        """Show a page as it looks in a window of a size; where it asks, with the button that ends the answer."""
        if (view, size) == (self._view, self._page.size()):
            return
        self._view = view
        self._page.resize(size)
        self._page.show()  # nowhere: it only makes Qt lay it out
        self._page.show_view(view, None)
        self._page.next.setVisible(view.asks)
        self._picture = self._page.grab()
        self._page.hide()
        self.setAccessibleName(tr("the subject's page: {title} {it}", title=view.title, it=view.text).strip())
        self.update()

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._page.set_tokens(tokens)
        if self._view is not None:
            view, self._view = self._view, None
            self.show_page(view, self._page.size())

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Draw the picture anew at another size."""
        super().resizeEvent(event)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint the picture in the middle, with a line around it."""
        if self._picture.isNull():
            return
        ratio = self.devicePixelRatioF()
        room = QSize(round(self.width() * ratio), round(self.height() * ratio))
        drawn = self._picture.scaled(
            room, Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation
        )
        drawn.setDevicePixelRatio(ratio)
        size = drawn.deviceIndependentSize().toSize()
        at = QPoint((self.width() - size.width()) // 2, (self.height() - size.height()) // 2)
        painter = QPainter(self)
        painter.drawPixmap(at, drawn)
        painter.setPen(self.palette().mid().color())
        painter.drawRect(at.x(), at.y(), size.width() - 1, size.height() - 1)
