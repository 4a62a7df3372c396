"""A window that pages through everything the subject will see; nothing in it is recorded."""

from collections.abc import Sequence

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QDialog, QHBoxLayout, QListWidget, QVBoxLayout, QWidget

from daq_app.qt.languages import missing_glyphs, translator
from daq_app.qt.parts import Wrapped, button, label
from daq_app.qt.subject_picture import SubjectPicture
from daq_app.qt.tokens import GRID, Tokens
from daq_app.window.new_session import Refused, SessionForm
from daq_app.window.preview import PreviewPage, preview
from daq_app.window.subject_texts import SubjectText
from daq_app.wording import tr
from sessions.plan.protocols.languages import ENGLISH

LIST = 250  # width of the list, before the font's scale [px]
STEPS = {Qt.Key.Key_Left: -1, Qt.Key.Key_PageUp: -1, Qt.Key.Key_Right: 1, Qt.Key.Key_PageDown: 1, Qt.Key.Key_Space: 1}


def open_preview(form: SessionForm, size: QSize, tokens: Tokens, scale: float, parent: QWidget) -> str:
    """Show the pages of a form's protocol as they look in a window of a size; return why not, empty where they are."""
    pages = preview(form, translator(form.language or ENGLISH))
    if isinstance(pages, Refused):
        return " ".join(pages.sentences.values())
    shown = SubjectPreview(pages, size, tokens, scale, parent)
    shown.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    shown.show()
    return ""


class SubjectPreview(QDialog):
    """The pages as a list, and the picture of the one that is chosen."""

    def __init__(
        self, pages: Sequence[PreviewPage], size: QSize, tokens: Tokens, scale: float, parent: QWidget | None = None
    ) -> None:
        """Show the first page, as it looks in a subject's window of a size."""
        super().__init__(parent)
        self.setObjectName("window")
        self.setWindowTitle(tr("daq-app · preview of the subject's pages"))
        self.setAccessibleName(tr("preview of the subject's pages"))
        self._pages, self._size = tuple(pages), size
        self.picture = SubjectPicture(tokens, scale, size)
        self.list = _Pages()
        self.list.setAccessibleName(tr("pages that the subject will see"))
        self.list.addItems([page.name for page in self._pages])
        self.list.setFixedWidth(round(LIST * min(scale, 1.5)))
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.lost = Wrapped("value", "look")
        self.back = button(tr("◂ Back"), tr("the page before"), lambda: self._turn(-1))
        self.on = button(tr("On ▸"), tr("the next page"), lambda: self._turn(1))
        self._count = label("", "quiet")
        row = QHBoxLayout()
        for widget in (self.back, self.on, self._count):
            row.addWidget(widget)
        row.addStretch(1)
        row.addWidget(button(tr("Close  Esc"), tr("close the preview"), self.close))
        right = QVBoxLayout()
        right.setSpacing(GRID)
        right.addWidget(self.picture, 1)
        right.addWidget(self.lost)
        right.addLayout(row)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * GRID, 2 * GRID, 2 * GRID, 2 * GRID)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self.list)
        layout.addLayout(right, 1)
        self.resize(round(1000 * min(scale, 1.25)), round(560 * min(scale, 1.25)))
        self.list.currentRowChanged.connect(self._show)
        self.list.setCurrentRow(0)
        self.list.setFocus()

    def _turn(self, by: int) -> None:
        self.list.setCurrentRow(min(max(self.list.currentRow() + by, 0), len(self._pages) - 1))

    def _show(self, row: int) -> None:
        view = self._pages[row].view
        self.picture.show_page(view, self._size)
        own = [*map(translator(view.language), (SubjectText.NEXT, SubjectText.FIRST, SubjectText.SECOND))]
        lost = missing_glyphs([view.title, view.text, *view.ends, *(own if view.asks else ())], self.font())
        self.lost.show_text(tr("▲ No font here draws {lost}: install one that does.", lost=lost) if lost else "")
        self.back.setEnabled(row > 0)
        self.on.setEnabled(row < len(self._pages) - 1)
        self._count.setText(tr("{row} of {len}", row=row + 1, len=len(self._pages)))


class _Pages(QListWidget):
    """A list in which the keys that turn pages turn them too."""

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Turn a page; every other key is the list's own."""
        step = STEPS.get(Qt.Key(event.key()))
        if step is None:
            super().keyPressEvent(event)
        else:
            self.setCurrentRow(min(max(self.currentRow() + step, 0), self.count() - 1))
