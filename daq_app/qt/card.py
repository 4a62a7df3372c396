"""A card of the checklist: its name, a mark that tells whether it is ready, and one line that says why not."""

from PySide6.QtWidgets import QFrame, QHBoxLayout, QVBoxLayout

from daq_app.qt.parts import label, regrade, say
from daq_app.qt.tokens import GRID
from daq_app.window.checklist import Card
from daq_app.wording import tr


class CardFrame(QFrame):
    """Holds the fields of a card in `body`."""

    def __init__(self, name: str) -> None:
        """Show a card that is not ready."""
        super().__init__()
        self._name = name
        self._card: Card | None = None
        self.setProperty("role", "card")
        self._mark = label("○")
        self.words = label("", "quiet", wrap=True)
        head = QHBoxLayout()
        head.setSpacing(GRID)
        head.addWidget(self._mark)
        head.addWidget(label(tr(name), "name", wrap=True), 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(GRID, GRID, GRID, GRID)
        layout.setSpacing(4)
        layout.addLayout(head)
        layout.addWidget(self.words)
        self.body = QVBoxLayout()
        self.body.setSpacing(4)
        layout.addLayout(self.body)

    def show_card(self, card: Card) -> None:
        """Show whether the card is ready, and its line; nobody is blamed before Start was asked for."""
        if card == self._card:
            return
        self._card = card
        say(self._mark, "✓" if card.ready else "○")
        say(self.words, card.words)
        self.words.setVisible(bool(card.words))
        self.setAccessibleName(
            f"{tr(self._name)}: {tr('ready') if card.ready else tr('not ready')}. {card.words}".strip()
        )
        regrade(self.words, "")

    def insist(self) -> None:
        """Mark the line as what keeps the session from beginning."""
        regrade(self.words, "wrong")
