"""A small picture of the page on which the subject will answer, by the protocol and language of a form."""

from PySide6.QtCore import QSize, Qt

from daq_app.qt.languages import translator
from daq_app.qt.subject_picture import SubjectPicture
from daq_app.qt.tokens import Tokens
from daq_app.window.new_session import Refused, SessionForm
from daq_app.window.preview import preview
from sessions.plan.protocols.languages import ENGLISH

HEIGHT = 110  # before the font's scale [px]


class Thumbnail(SubjectPicture):
    """Shows the first page with a question; nothing while the form's protocol or study is refused."""

    def __init__(self, tokens: Tokens, scale: float) -> None:
        """Show nothing yet."""
        super().__init__(tokens, scale, QSize(1000, 640))
        self._drawn: object = None  # what the picture was drawn from
        self.setFixedHeight(round(HEIGHT * min(scale, 1.4)))
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def show_form(self, form: SessionForm, size: QSize) -> None:
        """Show the page of a form as it looks in a subject's window of a size."""
        drawn = form.protocol, form.study, form.folder, form.language, size
        if drawn == self._drawn:
            return
        self._drawn = drawn
        pages = preview(form, translator(form.language or ENGLISH))
        self.setVisible(not isinstance(pages, Refused))
        if not isinstance(pages, Refused):
            self.show_page(next((page.view for page in pages if page.view.asks), pages[0].view), size)
