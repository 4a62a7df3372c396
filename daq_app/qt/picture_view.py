"""One picture of the analysis: drawn from its SVG, and saved as SVG, PNG, or its numbers as CSV."""

from pathlib import Path

from PySide6.QtCore import QByteArray, QRectF, QSize, Qt
from PySide6.QtGui import QImage, QPainter, QPaintEvent
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from daq_app.qt.parts import button
from sessions.exports.figures.style import Panel
from sessions.exports.html import panel_csv, swap_in

DOTS = 4.0  # pixels of a saved PNG in one of the picture's own units


class PictureView(QWidget):
    """A picture with its buttons."""

    def __init__(self) -> None:
        """Show nothing yet."""
        super().__init__()
        self._panel: Panel | None = None
        self._head = ""
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
        self.show_panel(None, "")

    def show_panel(self, panel: Panel | None, head: str) -> None:
        """Show a picture; `head` is the first line of whatever is made of a simulated session."""
        if panel is self._panel and panel is not None:
            return
        self._panel, self._head = panel, head
        self._canvas.show_svg("" if panel is None else panel.svg)
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
                image = self._canvas.image(DOTS)
                if not image.save(str(path), "PNG"):  # pyright: ignore[reportArgumentType, reportCallIssue]
                    raise OSError(f"{path} cannot be written; free space or choose another folder")

    def _ask(self, kind: str) -> None:
        if self._panel is None:
            return
        name, _ = QFileDialog.getSaveFileName(self, f"Save as {kind}", f"{self._panel.name}.{kind.lower()}")
        if name:
            self.save(Path(name).with_suffix(f".{kind.lower()}"))


class _Canvas(QWidget):
    """Paints an SVG as large as there is room, its proportions kept, on white: its own colours are made for paper."""

    def __init__(self) -> None:
        super().__init__()
        self._renderer = QSvgRenderer()
        self._shown = False
        self.setMinimumSize(160, 120)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_svg(self, text: str) -> None:
        """Show a picture, or nothing."""
        self._shown = bool(text) and self._renderer.load(QByteArray(text.encode()))
        self.update()

    def image(self, dots: float) -> QImage:
        """Return the picture with so many pixels in each of its units."""
        size = self._renderer.defaultSize()
        image = QImage(QSize(round(size.width() * dots), round(size.height() * dots)), QImage.Format.Format_ARGB32)
        image.fill(Qt.GlobalColor.white)
        painter = QPainter(image)
        self._renderer.render(painter)
        painter.end()
        return image

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint it."""
        if not self._shown:
            return
        painter = QPainter(self)
        size = self._renderer.defaultSize()
        scale = min(self.width() / size.width(), self.height() / size.height())
        box = QRectF(0.0, 0.0, size.width() * scale, size.height() * scale)
        box.moveCenter(QRectF(self.rect()).center())
        painter.fillRect(box, Qt.GlobalColor.white)
        self._renderer.render(painter, box)
