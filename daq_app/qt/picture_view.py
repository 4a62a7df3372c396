"""One picture of the analysis with its buttons, saved as SVG, PNG, or its numbers as CSV; and two sessions compared."""

from collections.abc import Callable, Sequence

from PySide6.QtCore import QRectF
from PySide6.QtGui import QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QFileDialog, QSizePolicy, QWidget

from daq_app.analyst.seen import NAMES, ComparedRow
from daq_app.qt.parts import button, hbox, label, say, vbox
from daq_app.qt.tables import TextTable
from daq_app.qt.tokens import GRID
from daq_app.wording import tr

KINDS = ("SVG", "PNG", "CSV")
Save = Callable[[str, str], object]  # name of a picture, and the path to write it to
PICTURE = "compared"  # its name


class SaveButtons(QWidget):
    """Saves a picture by its name."""

    def __init__(self, what: str, save: Save) -> None:
        """Offer to save `what`; nothing is shown yet."""
        super().__init__()
        self._name, self._save = "", save
        self.buttons = [
            button(kind, tr("save {what} as {kind}", what=what, kind=kind), lambda kind=kind: self._ask(kind), "small")
            for kind in KINDS
        ]
        hbox(1, *self.buttons, on=self, spacing=GRID // 2)
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
        super().__init__()
        self._canvas = _Canvas()
        self.save = SaveButtons(what, save)
        vbox((self._canvas, 1), self.save, on=self)

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


class ComparedView(QWidget):
    """Offers to open a second session, and shows what came of it."""

    def __init__(self, choose: Callable[[], object], save: Save) -> None:
        super().__init__()
        self.words = label("", "quiet", wrap=True)
        self.choose = button(tr("Compare with…"), tr("compare with another session"), choose)
        head = (tr("stimulus"), *(f"{tr(name)} {part}" for name in NAMES for part in ("A", "B", "B − A")))
        self.table = TextTable(tr("two sessions compared"), head)
        self.table.setMinimumHeight(130)
        self.picture = PictureView(tr("the picture of both sessions"), save)
        vbox(hbox((self.words, 1), self.choose), (self.table, 1), (self.picture, 2), on=self)
        self.show_rows((), ("", ""))

    def show_rows(self, rows: Sequence[ComparedRow], sessions: tuple[str, str]) -> None:
        """Show the stimuli of two sessions, by their names."""
        there = bool(sessions[1])
        named = "\n".join(f"{name}: {session}" for name, session in zip("AB", sessions, strict=True))
        say(self.words, named if there else tr("No second session is open."))
        self.table.setVisible(there)
        self.picture.setVisible(there)
        lines: list[tuple[str, ...]] = []
        for row in rows:
            cells = [f"{row.experiment} {row.index}"]
            for name, pair in zip(NAMES, row.pairs, strict=True):
                digits = 1 if name == "score" else 3
                cells += [_number(value, digits) for value in (pair.first, pair.second)]
                cells.append(_number(pair.difference, digits, sign=True))
            lines.append(tuple(cells))
        self.table.show_lines(tuple(lines))


def _number(value: float | None, digits: int, *, sign: bool = False) -> str:
    if value is None:
        return "–"
    return f"{value:+.{digits}f}".replace("-", "−") if sign else f"{value:.{digits}f}"
