"""How many pixels a millimetre has on each screen: what the screen says, corrected once with a ruler."""

from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QScreen
from PySide6.QtWidgets import QLineEdit, QWidget

from daq_app.qt.answer_fields import LENGTH, ScoreLine
from daq_app.qt.parts import button, hbox, label, say, vbox
from daq_app.qt.preferences import settings
from daq_app.qt.tokens import GRID
from daq_app.wording import tr
from sessions.recording import Setting

LEAST, MOST = 40.0, 250.0  # what 100 mm may measure on a screen before it is taken for a slip of the hand [mm]
PLAUSIBLE = (40.0, 600.0)  # dots an inch; a screen that says otherwise does not know its size
USUAL_DPI = 96.0


@dataclass(frozen=True, slots=True)
class Millimetres:
    """What is known of a screen's size."""

    pixels: float  # device-independent pixels in a millimetre
    checked: bool  # somebody held a ruler to it

    @property
    def words(self) -> str:
        return "checked with a ruler" if self.checked else "as the screen says, not checked with a ruler"


def millimetres(screen: QScreen) -> Millimetres:
    """Return the size of a millimetre on a screen."""
    try:
        factor = float(str(settings().value(_key(screen))))
    except ValueError:
        return Millimetres(_said(screen), checked=False)
    return Millimetres(_said(screen) * factor, checked=True)


def checked(screen: QScreen, measured: float) -> Millimetres | None:
    """Keep what a line that should be 100 mm long measured on the screen [mm]; None where no screen can be so."""
    if not LEAST <= measured <= MOST:
        return None
    pixels = millimetres(screen).pixels * 100.0 / measured
    settings().setValue(_key(screen), repr(pixels / _said(screen)))
    return Millimetres(pixels, checked=True)


def _said(screen: QScreen) -> float:
    """Return device-independent pixels in a millimetre as the screen tells, or the usual where it cannot be true."""
    dots = screen.physicalDotsPerInch() * screen.devicePixelRatio()
    return (screen.physicalDotsPerInch() if PLAUSIBLE[0] <= dots <= PLAUSIBLE[1] else USUAL_DPI) / 25.4


def _key(screen: QScreen) -> str:
    """Return the name of a screen: of this very one where it has a serial number, at this scaling."""
    parts = (screen.manufacturer(), screen.model(), screen.serialNumber(), screen.name())
    name = "-".join(filter(None, parts)) or "screen"
    safe = "".join(c if c.isalnum() or c == "-" else "_" for c in name)
    return f"millimetres/{safe}-{screen.devicePixelRatio():g}"


def line_settings(shown: Millimetres) -> tuple[Setting, ...]:
    """Return what a session keeps of the line that is answered on: its length, and how long a millimetre is."""
    origin = "measured" if shown.checked else "default"
    return (
        Setting("answer line length", LENGTH, "mm", origin),
        Setting("pixels in a millimetre of the answering screen", round(shown.pixels, 4), "1/mm", origin),
    )


class RulerCheck(QWidget):
    """Shows a line, and takes what a ruler says of it."""

    done = Signal()

    def __init__(self, scale: float) -> None:
        super().__init__()
        self._screen: QScreen | None = None
        self._line = ScoreLine(lambda: 0.0)  # the very line on which is answered
        self._line.setEnabled(False)
        self._line.setAccessibleName(tr("line of 100 millimetres to be measured"))
        sentence = label(tr("Hold a ruler to the line. How long is it?"), "title", wrap=True)
        self._measured = QLineEdit()
        self._measured.setAccessibleName(tr("length of the line in millimetres, as the ruler says"))
        self._measured.setFixedWidth(round(100 * scale))
        self._measured.returnPressed.connect(self._keep)
        self._wrong = label("", "quiet", wrap=True)
        keep = button(tr("Keep"), tr("keep the measured length"), self._keep)
        leave = button(tr("Leave as it is"), tr("leave the line as it is"), self.done.emit)
        row = hbox(self._measured, label("mm"), keep, leave, 1)
        vbox(sentence, 1, hbox(1, self._line, 1), 1, row, self._wrong, on=self, margins=4 * GRID)

    def begin(self, screen: QScreen) -> None:
        self._screen = screen
        self._line.set_pixels_per_mm(millimetres(screen).pixels)
        self._measured.setText("100")
        self._measured.selectAll()
        self._measured.setFocus(Qt.FocusReason.OtherFocusReason)
        say(self._wrong, tr("Screen: {name}, {words}.", name=screen.name(), words=millimetres(screen).words))

    def _keep(self) -> None:
        text = self._measured.text().strip().replace(",", ".")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if self._screen is None or checked(self._screen, value) is None:
            words = tr(
                "Give the length in millimetres, from {least:.0f} to {most:.0f}: '{it}' is not one.",
                least=LEAST, most=MOST, it=text,
            )  # fmt: skip
            say(self._wrong, words)
            return
        self.done.emit()
