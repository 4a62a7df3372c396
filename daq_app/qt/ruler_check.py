"""The page on which a line of 100 mm is held against a ruler, once a screen."""

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QScreen
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QVBoxLayout, QWidget

from daq_app.qt.painted import Painted
from daq_app.qt.parts import button, label, say
from daq_app.qt.screens import LEAST, MOST, checked, millimetres
from daq_app.qt.tokens import GRID, Tokens
from daq_app.wording import tr

LENGTH = 100.0  # [mm]


class RulerCheck(QWidget):
    """Shows a line, and takes what a ruler says of it."""

    done = Signal()

    def __init__(self, tokens: Tokens, scale: float) -> None:
        """Build the page."""
        super().__init__()
        self._screen: QScreen | None = None
        self._line = _Line(tokens)
        self._sentence = label(tr("Hold a ruler to the line. How long is it?"), "title", wrap=True)
        self._measured = QLineEdit()
        self._measured.setAccessibleName(tr("length of the line in millimetres, as the ruler says"))
        self._measured.setFixedWidth(round(100 * scale))
        self._measured.returnPressed.connect(self._keep)
        self._wrong = label("", "quiet", wrap=True)
        row = QHBoxLayout()
        row.addWidget(self._measured)
        row.addWidget(label("mm"))
        row.addWidget(button(tr("Keep"), tr("keep the measured length"), self._keep))
        row.addWidget(button(tr("Leave as it is"), tr("leave the line as it is"), self.done.emit))
        row.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4 * GRID, 4 * GRID, 4 * GRID, 4 * GRID)
        layout.addWidget(self._sentence)
        layout.addStretch(1)
        layout.addWidget(self._line)
        layout.addStretch(1)
        layout.addLayout(row)
        layout.addWidget(self._wrong)

    def begin(self, screen: QScreen) -> None:
        """Check this screen."""
        self._screen = screen
        self._line.set_length(LENGTH * millimetres(screen).pixels)
        self._measured.setText("100")
        self._measured.selectAll()
        self._measured.setFocus(Qt.FocusReason.OtherFocusReason)
        say(self._wrong, tr("Screen: {name}, {words}.", name=screen.name(), words=millimetres(screen).words))

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._line.set_tokens(tokens)

    def _keep(self) -> None:
        text = self._measured.text().strip().replace(",", ".")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if self._screen is None or checked(self._screen, value) is None:
            say(
                self._wrong,
                tr(
                    "Give the length in millimetres, from {least:.0f} to {most:.0f}: '{it}' is not one.",
                    least=LEAST,
                    most=MOST,
                    it=text,
                ),
            )
            return
        self.done.emit()


class _Line(Painted):
    def __init__(self, tokens: Tokens) -> None:
        super().__init__(tokens)
        self._length = 0.0
        self.setMinimumHeight(60)
        self.setAccessibleName(tr("line of 100 millimetres to be measured"))

    def set_length(self, pixels: float) -> None:
        """Show a line of this length."""
        self._length = pixels
        self.setMinimumWidth(round(pixels) + 20)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint the line with its two ends."""
        painter = QPainter(self)
        painter.setPen(QPen(QColor(self.tokens.text), 2))
        box = QRectF((self.width() - self._length) / 2, 10, self._length, 40)
        middle = box.center().y()
        painter.drawLine(QPointF(box.left(), middle), QPointF(box.right(), middle))
        for x in (box.left(), box.right()):
            painter.drawLine(QPointF(x, box.top()), QPointF(x, box.bottom()))
