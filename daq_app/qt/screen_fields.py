"""The fields of the subject's screen: its language, a picture of its page, and how far its line can be trusted."""

from collections.abc import Callable

from PySide6.QtCore import QSize
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QLabel, QWidget

from daq_app.qt.languages import missing_glyphs, name_of, translator
from daq_app.qt.parts import button, choice, field, vbox
from daq_app.qt.score_line import LENGTH
from daq_app.qt.screens import Millimetres
from daq_app.qt.subject_picture import Thumbnail
from daq_app.window.new_session import SessionForm, subject_texts
from daq_app.window.subject_texts import SubjectText
from daq_app.wording import tr
from sessions.plan.protocols.languages import ENGLISH


class ScreenFields(QWidget):
    """What stands on the card of the subject's screen, be it a second screen or a tablet."""

    def __init__(self, scale: float, act: Callable[[str], None]) -> None:
        """Show a screen of which nothing is known; `act` takes what a button stands for."""
        super().__init__()
        self.words = ""  # the length of the line, and characters that no font here has
        self.missing = ""  # why the subject's page is on no tablet, where it should be
        self._line_words = ""
        self._size = QSize(1000, 640)  # of the subject's window
        self.language = choice(tr("language that the subject reads"))
        self.thumbnail = Thumbnail(scale)
        self._ruler = button(
            tr("Check with a ruler  Ctrl+M"), tr("check the subject's line with a ruler"), lambda: act("ruler")
        )
        self.camera = QLabel()
        self.camera.setAccessibleName(tr("address and code for the tablet's camera"))
        self.camera.hide()
        self._new_code = button(tr("New code"), tr("let another tablet in, by a new code"), lambda: act("tablet"))
        self._new_code.hide()
        language = field(tr("Language that the subject reads"), self.language)
        vbox(language, self.thumbnail, self._ruler, self.camera, self._new_code, on=self, spacing=4)

    def show_line(self, known: Millimetres, size: QSize) -> None:
        """Say how far the length of the subject's line can be trusted, in a window of a `size`."""
        self._size = size
        self._line_words = tr("Line of {length:.0f} mm, {words}.", length=LENGTH, words=known.words)

    def show_tablet(self, words: str, missing: str, picture: bytes) -> None:
        """Say how the tablet is reached, or what is known of its line; `missing` is why no session can begin.

        `picture` is its address for a camera (PNG), or empty.
        """
        self._line_words, self.missing = words, missing
        shown = QPixmap()
        shown.loadFromData(picture)
        self.camera.setPixmap(shown)
        self.camera.setVisible(bool(picture))
        self._ruler.hide()  # there is one on the tablet's page
        self._new_code.show()

    def offer_languages(self, form: SessionForm) -> None:
        """Offer the languages of a form's protocol, keeping the chosen one where it is among them."""
        offered, _ = subject_texts(form)
        if list(offered) != [self.language.itemData(at) for at in range(self.language.count())]:
            before = self.language.currentData()
            self.language.clear()
            for code in offered:
                self.language.addItem(name_of(code), code)
            self.language.setCurrentIndex(max(self.language.findData(before), 0))

    def show_form(self, form: SessionForm) -> None:
        """Show the page of a form, and say which of its characters no font here has."""
        self.thumbnail.show_form(form, self._size)
        self.words = self._line_words
        if not self._new_code.isHidden():
            return  # the tablet has fonts of its own
        _, texts = subject_texts(form)
        words = translator(form.language or ENGLISH)
        if lost := missing_glyphs([*texts, *map(words, SubjectText)], self.font()):
            self.words += " " + tr("No font here draws {lost}: install one that does.", lost=lost)
