"""The way from a number back to its readings as a line of links: Tab goes from one to the next, Enter follows it."""

from html import escape

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QLabel, QSizePolicy

from daq_app.analyst.lineage import Link
from daq_app.qt.tokens import Tokens
from daq_app.wording import tr


class LineageLabel(QLabel):
    """Links in their order."""

    followed = Signal(str)  # the place that a link leads to

    def __init__(self, tokens: Tokens) -> None:
        """Show no way yet."""
        super().__init__()
        self._tokens = tokens
        self._links: tuple[Link, ...] = ()
        self.setTextFormat(Qt.TextFormat.RichText)
        self.setWordWrap(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.setTextInteractionFlags(Qt.TextInteractionFlag.LinksAccessibleByMouse)
        self.setTextInteractionFlags(
            Qt.TextInteractionFlag.LinksAccessibleByMouse | Qt.TextInteractionFlag.LinksAccessibleByKeyboard
        )
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.linkActivated.connect(self.followed.emit)
        self.linkHovered.connect(self._tell)
        self.setAccessibleName(tr("from the number back to its readings"))

    def show_links(self, links: tuple[Link, ...]) -> None:
        """Show a way."""
        if links == self._links:
            return
        self._links = links
        colour = self._tokens.act
        self.setText(
            " &nbsp;→&nbsp; ".join(
                f'<a href="{link.place}" style="color: {colour}">{escape(link.words)}</a>' for link in links
            )
        )
        whole = " → ".join(link.words for link in links)
        self.setAccessibleName(tr("from the number back to its readings: {whole}", whole=whole))

    def _tell(self, place: str) -> None:
        self.setToolTip(next((link.more for link in self._links if link.place == place), ""))
