"""Pictures of the subject's page, drawn by the same window class as the page; they accept no answers."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QSize, Qt, QTimer
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QPixmap
from PySide6.QtWidgets import QDialog, QSizePolicy, QWidget

from daq_app.qt.layout import hbox, vbox
from daq_app.qt.painting import paint_fitted
from daq_app.qt.parts import Openness, RowList, WrappedLabel, button, label
from daq_app.qt.subject_window import SubjectWindow
from daq_app.qt.tokens import GRID, missing_glyphs, px
from daq_app.window.new_session import Refusal, SessionForm
from daq_app.window.subject import PreviewPage, SubjectText, SubjectView, first_question, preview, translator
from daq_app.wording import tr
from sessions.plan.protocols.protocol import ENGLISH

THUMBNAIL_HEIGHT = 110  # before the font's scale [px]
MIRROR_HEIGHT = 150  # of the picture, before the font's scale [px]
MIRROR = "panels/mirror"  # key under which its openness is remembered
LIST = 250  # width of the list, before the font's scale [px]
_STEPS = {Qt.Key.Key_Left: -1, Qt.Key.Key_PageUp: -1, Qt.Key.Key_Right: 1, Qt.Key.Key_PageDown: 1, Qt.Key.Key_Space: 1}


class SubjectPicture(QWidget):
    """Shows a page laid out for the subject's screen, scaled down to fit.

    A second, invisible window draws it, so that the subject's answer is never in the picture.
    """

    def __init__(self, size: QSize) -> None:
        """Show nothing yet; `size` is that of the subject's window."""
        super().__init__()
        self.page = SubjectWindow(lambda: 0.0)  # draws the picture
        self.page.setAttribute(Qt.WidgetAttribute.WA_DontShowOnScreen)
        self.page.resize(size)
        self._view: SubjectView | None = None
        self._picture = QPixmap()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(160, 100)

    def show_page(self, view: SubjectView, size: QSize) -> None:
        """Show a page as in a window of a size; if it asks a question, with the button that ends the answer."""
        if (view, size) == (self._view, self.page.size()):
            return
        self.page.resize(size)
        self._draw(view)
        self.setAccessibleName(tr("the subject's page: {title} {it}", title=view.title, it=view.text).strip())

    def _draw(self, view: SubjectView) -> None:
        self._view = view
        self.page.show()  # not on a screen: it only makes Qt lay it out
        self.page.show_view(view, None)
        self.page.next.setVisible(view.asks)
        self._picture = self.page.grab()
        self.page.hide()
        self.update()

    def changeEvent(self, event: QEvent) -> None:
        """Redraw the page in a new theme, after its window."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.StyleChange and (view := self._view) is not None:
            QTimer.singleShot(0, self, lambda: self._draw(view))

    def paintEvent(self, event: QPaintEvent) -> None:
        if not self._picture.isNull():
            painter = QPainter(self)
            box = paint_fitted(painter, self._picture)
            painter.setPen(self.palette().mid().color())
            painter.drawRect(box.adjusted(0, 0, -1, -1))


class Thumbnail(SubjectPicture):
    """Shows the first page with a question, or nothing while the form's protocol or study is refused."""

    def __init__(self) -> None:
        super().__init__(QSize(1000, 640))
        self._source: object = None  # source data of the picture
        self.setFixedHeight(px(THUMBNAIL_HEIGHT, most=1.4))

    def show_form(self, form: SessionForm, size: QSize) -> None:
        source = form.protocol, form.study, form.folder, form.language, size
        if source == self._source:
            return
        self._source = source
        view = first_question(form, translator(form.language or ENGLISH))
        self.setVisible(not isinstance(view, Refusal))
        if not isinstance(view, Refusal):
            self.show_page(view, size)


class Mirror(QWidget):
    """Shows the subject's page without any answer, so that it is safe under every blinding."""

    def __init__(self) -> None:
        super().__init__()
        self._view: SubjectView | None = None
        self._size = QSize(1000, 640)
        self.open = Openness(MIRROR, self._show_openness)
        self.picture: SubjectPicture | None = None  # created when first visible
        self.tab = button("", tr("the subject's page"), self.open.toggle, "handle")
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        vbox(self.tab, on=self, spacing=4)
        self._show_openness()

    def show_view(self, view: SubjectView | None, size: QSize) -> None:
        """Show a page as in the subject's window of a size; None before a session."""
        self._view, self._size = view, QSize(size)
        self._show_page()

    def _show_openness(self) -> None:
        self.tab.setText(tr("The subject sees  V  {word}", word="▾" if self.open else "▸"))
        self.tab.setAccessibleName(tr("{word} the subject's page", word=tr("fold") if self.open else tr("show")))
        if self.picture is not None:
            self.picture.setVisible(bool(self.open))
        self._show_page()

    def _show_page(self) -> None:
        if self._view is None or not self.open:
            return
        if self.picture is None:
            self.picture = SubjectPicture(self._size)
            self.picture.setFixedHeight(px(MIRROR_HEIGHT, most=1.4))
            self.layout().addWidget(self.picture)  # pyrefly: ignore[missing-attribute]  it was set above
        self.picture.show_page(self._view, self._size)


def open_preview(form: SessionForm, size: QSize, parent: QWidget) -> str:
    """Show the pages of a form's protocol as in a window of a size; return why that failed, or ""."""
    pages = preview(form, translator(form.language or ENGLISH))
    if isinstance(pages, Refusal):
        return " ".join(pages.values())
    window = SubjectPreview(pages, size, parent)
    window.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    window.show()
    return ""


class SubjectPreview(QDialog):
    """A list of the pages, and the picture of the chosen one."""

    def __init__(self, pages: Sequence[PreviewPage], size: QSize, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("window")
        self.setWindowTitle(tr("daq-app · preview of the subject's pages"))
        self.setAccessibleName(tr("preview of the subject's pages"))
        self._pages, self._size = tuple(pages), size
        self.picture = SubjectPicture(size)
        self.list = _Pages(tr("pages that the subject will see"))
        self.list.addItems([page.name for page in self._pages])
        self.list.setFixedWidth(px(LIST, most=1.5))
        self.lost = WrappedLabel("value", "look")
        self.back = button(tr("◂ Back"), tr("the page before"), lambda: self.list.turn(-1))
        self.forward = button(tr("Forward ▸"), tr("the next page"), lambda: self.list.turn(1))
        self._count = label("", "quiet")
        close = button(tr("Close  Esc"), tr("close the preview"), self.close)
        page = vbox((self.picture, 1), self.lost, hbox(self.back, self.forward, self._count, 1, close), spacing=GRID)
        hbox(self.list, (page, 1), on=self, margins=2 * GRID, spacing=2 * GRID)
        self.resize(px(1000, most=1.25), px(560, most=1.25))
        self.list.currentRowChanged.connect(self._show)
        self.list.setCurrentRow(0)
        self.list.setFocus()

    def _show(self, row: int) -> None:
        view = self._pages[row].view
        self.picture.show_page(view, self._size)
        button_texts = map(translator(view.language), (SubjectText.NEXT, SubjectText.FIRST, SubjectText.SECOND))
        lost = missing_glyphs([view.title, view.text, *view.ends, *(button_texts if view.asks else ())], self.font())
        self.lost.show_text(tr("▲ No font here draws {lost}: install one that does.", lost=lost) if lost else "")
        self.back.setEnabled(row > 0)
        self.forward.setEnabled(row < len(self._pages) - 1)
        self._count.setText(tr("{row} of {len}", row=row + 1, len=len(self._pages)))


class _Pages(RowList):
    """A list that also accepts the keys for turning pages."""

    def turn(self, step: int) -> None:
        self.setCurrentRow(min(max(self.currentRow() + step, 0), self.count() - 1))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = _STEPS.get(Qt.Key(event.key()))
        if step is None:
            super().keyPressEvent(event)
        else:
            self.turn(step)
