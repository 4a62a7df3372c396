"""One picture of the analysis with its buttons: saved as SVG, PNG, or its numbers as CSV."""

from collections.abc import Callable

from PySide6.QtCore import QRectF
from PySide6.QtGui import QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from daq_app.qt.parts import bare, button
from daq_app.qt.tokens import GRID
from daq_app.wording import tr

KINDS = ("SVG", "PNG", "CSV")
Save = Callable[[str, str], object]  # name of a picture, and the path to write it to


class SaveButtons(QWidget):
    """Saves a picture by its name."""

    def __init__(self, what: str, save: Save) -> None:
        """Offer to save `what`; nothing is shown yet."""
        super().__init__()
        self._name, self._save = "", save
        layout = bare(QHBoxLayout(self), GRID // 2)
        layout.addStretch(1)
        self.buttons = [
            button(kind, tr("save {what} as {kind}", what=what, kind=kind), lambda kind=kind: self._ask(kind), "small")
            for kind in KINDS
        ]
        for widget in self.buttons:
            layout.addWidget(widget)
        self.set_name("")

    def set_name(self, name: str) -> None:
        """Take the name of what is shown; "" for nothing."""
        self._name = name
        for widget in self.buttons:
            widget.setEnabled(bool(name))

    def _ask(self, kind: str) -> None:
        proposed = f"{self._name.replace(' ', '-')}.{kind.lower()}"
        path, _ = QFileDialog.getSaveFileName(self, tr("Save as {kind}", kind=kind), proposed)
        if path:
            ending = f".{kind.lower()}"
            self._save(self._name, path if path.lower().endswith(ending) else path + ending)


class PictureView(QWidget):
    """A picture made for paper."""

    def __init__(self, what: str, save: Save) -> None:
        """Show nothing yet."""
        super().__init__()
        self._canvas = _Canvas()
        self.save = SaveButtons(what, save)
        layout = bare(QVBoxLayout(self))
        layout.addWidget(self._canvas, 1)
        layout.addWidget(self.save)

    def show_picture(self, name: str, title: str, png: bytes) -> None:
        """Show a picture by its PNG; where that is empty, `title` says why."""
        self._canvas.show_png(png, title)
        self._canvas.setAccessibleName(title)
        self.setAccessibleName(title)
        self.save.set_name(name if png else "")


class _Canvas(QWidget):
    """Paints a picture as large as there is room, its proportions kept; its own colours are made for paper."""

    def __init__(self) -> None:
        super().__init__()
        self._image, self._words = QImage(), ""
        self.setMinimumSize(160, 200)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_png(self, content: bytes, words: str) -> None:
        """Show a picture, or words in its place."""
        self._image = QImage.fromData(content) if content else QImage()
        self._words = words
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint it."""
        painter = QPainter(self)
        if self._image.isNull():
            painter.drawText(self.rect(), self._words)
            return
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        size = self._image.size()
        scale = min(self.width() / size.width(), self.height() / size.height())
        box = QRectF(0.0, 0.0, size.width() * scale, size.height() * scale)
        box.moveCenter(QRectF(self.rect()).center())
        painter.drawImage(box, self._image)
