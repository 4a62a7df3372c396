"""How many pixels a millimetre has on each screen: what the screen says, corrected by a ruler once."""

from dataclasses import dataclass

from PySide6.QtCore import QSettings
from PySide6.QtGui import QScreen

from daq_app.qt.score_line import LENGTH
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
        """Return where it comes from."""
        return "checked with a ruler" if self.checked else "as the screen says, not checked with a ruler"


def settings() -> QSettings:
    """Return what the window remembers on this computer: its looks, the screens' sizes, and folders of sessions."""
    # A file on every system: the format that follows the system cannot be led elsewhere by a test.
    return QSettings(QSettings.Format.IniFormat, QSettings.Scope.UserScope, "daq-app", "window")


def millimetres(screen: QScreen) -> Millimetres:
    """Return the size of a millimetre on a screen."""
    stored = settings().value(_key(screen))
    said = _said(screen)
    try:
        factor = float(str(stored))
    except ValueError:
        return Millimetres(said, checked=False)
    return Millimetres(said * factor, checked=True)


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
    if not PLAUSIBLE[0] <= dots <= PLAUSIBLE[1]:
        return USUAL_DPI / 25.4
    return screen.physicalDotsPerInch() / 25.4


def _key(screen: QScreen) -> str:
    """Return the name of a screen: of this very one where it has a serial number, at this scaling."""
    parts = (screen.manufacturer(), screen.model(), screen.serialNumber(), screen.name())
    name = "-".join(part for part in parts if part) or "screen"
    safe = "".join(c if c.isalnum() or c == "-" else "_" for c in name)
    return f"millimetres/{safe}-{screen.devicePixelRatio():g}"


def line_settings(screen: QScreen) -> tuple[Setting, ...]:
    """Return what a session keeps of the line that is answered on: its length, and how long a millimetre is."""
    shown = millimetres(screen)
    origin = "measured" if shown.checked else "default"
    return (
        Setting("answer line length", LENGTH, "mm", origin),
        Setting("pixels in a millimetre of the answering screen", round(shown.pixels, 4), "1/mm", origin),
    )
