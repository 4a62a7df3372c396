"""A widget that paints itself in the colours of the theme."""

from PySide6.QtWidgets import QWidget

from daq_app.qt.tokens import Tokens


class Painted(QWidget):
    """A widget that paints itself, anew in another theme."""

    def __init__(self, tokens: Tokens) -> None:
        """Begin with a theme."""
        super().__init__()
        self.tokens = tokens

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self.tokens = tokens
        self.update()
