"""One picture of the analysis, saved as SVG, PNG, or its numbers as CSV."""

from pathlib import Path

from PySide6.QtCore import QRectF
from PySide6.QtGui import QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from daq_app.qt.parts import button
from sessions.exports.figures.style import Panel
from sessions.exports.html import panel_csv, swap_in


class PictureView(QWidget):
    """A picture with its buttons."""

    def __init__(self) -> None:
        """Show nothing yet."""
        super().__init__()
        self._panel: Panel | None = None
        self._pixels, self._head = b"", ""
        self._canvas = _Canvas()
        bar = QHBoxLayout()
        bar.addStretch(1)
        self.buttons = [
            button(kind, f"save the picture as {kind}", lambda kind=kind: self._ask(kind), "small")
            for kind in ("SVG", "PNG", "CSV")
        ]
        for made in self.buttons:
            bar.addWidget(made)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._canvas, 1)
        layout.addLayout(bar)
        self.show_panel(None, b"", "")

    def show_panel(self, panel: Panel | None, pixels: bytes, head: str) -> None:
        """Show a picture by its PNG `pixels`; `head` is the first line of whatever is made of a simulated one."""
        if panel is self._panel and panel is not None:
            return
        self._panel, self._pixels, self._head = panel, pixels, head
        self._canvas.show_png(pixels)
        self.setAccessibleName("no picture" if panel is None else panel.title)
        for made in self.buttons:
            made.setEnabled(panel is not None)

    def save(self, path: Path) -> None:
        """Save the picture in the format of the file's ending. Raises OSError."""
        panel = self._panel
        if panel is None:
            return
        match path.suffix.lower():
            case ".svg":
                swap_in(path, panel.svg)
            case ".csv":
                swap_in(path, panel_csv(panel, self._head))
            case _:
                path.write_bytes(self._pixels)

    def _ask(self, kind: str) -> None:
        if self._panel is None:
            return
        name, _ = QFileDialog.getSaveFileName(self, f"Save as {kind}", f"{self._panel.name}.{kind.lower()}")
        if name:
            self.save(Path(name).with_suffix(f".{kind.lower()}"))


class _Canvas(QWidget):
    """Paints a picture as large as there is room, its proportions kept; its own colours are made for paper."""

    def __init__(self) -> None:
        super().__init__()
        self._image = QImage()
        self.setMinimumSize(160, 120)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_png(self, content: bytes) -> None:
        """Show a picture, or nothing."""
        self._image = QImage.fromData(content) if content else QImage()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint it."""
        if self._image.isNull():
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        size = self._image.size()
        scale = min(self.width() / size.width(), self.height() / size.height())
        box = QRectF(0.0, 0.0, size.width() * scale, size.height() * scale)
        box.moveCenter(QRectF(self.rect()).center())
        painter.drawImage(box, self._image)
