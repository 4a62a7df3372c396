"""A small picture of the page that the subject sees now, which folds away."""

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from daq_app.qt.openness import Openness
from daq_app.qt.parts import bare, button
from daq_app.qt.subject_picture import SubjectPicture
from daq_app.qt.tokens import Tokens
from daq_app.window.view_subject import SubjectView
from daq_app.wording import tr

HEIGHT = 150  # of the picture, before the font's scale [px]
MIRROR = "panels/mirror"  # under which it is remembered whether it is open


class Mirror(QWidget):
    """Shows the subject's page without any answer on it, so that it serves under every blinding.

    It begins folded where there is no room for it, and can be opened there all the same.
    """

    def __init__(self, tokens: Tokens, scale: float) -> None:
        """Show nothing yet."""
        super().__init__()
        self._tokens, self._scale = tokens, scale
        self._view: SubjectView | None = None
        self._size = QSize(1000, 640)
        self.open = Openness(MIRROR, self._place)
        self.picture: SubjectPicture | None = None  # made when it is first seen
        self.tab = button("", tr("the subject's page"), self.open.toggle, "handle")
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        layout = bare(QVBoxLayout(self), 4)
        layout.addWidget(self.tab)
        self._place()

    def show_view(self, view: SubjectView | None, size: QSize) -> None:
        """Show a page as it looks in the subject's window of a size; None before a session."""
        self._view, self._size = view, QSize(size)
        self._draw()

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._tokens = tokens
        if self.picture is not None:
            self.picture.set_tokens(tokens)

    def _place(self) -> None:
        self.tab.setText(tr("The subject sees  V  {word}", word="▾" if self.open else "▸"))
        self.tab.setAccessibleName(tr("{word} the subject's page", word=tr("fold") if self.open else tr("show")))
        if self.picture is not None:
            self.picture.setVisible(bool(self.open))
        self._draw()

    def _draw(self) -> None:
        if self._view is None or not self.open:
            return
        if self.picture is None:
            self.picture = SubjectPicture(self._tokens, self._scale, self._size)
            self.picture.setFixedHeight(round(HEIGHT * min(self._scale, 1.4)))
            self.picture.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            self.layout().addWidget(self.picture)  # pyright: ignore[reportOptionalMemberAccess]  it was set above
        self.picture.show_page(self._view, self._size)
