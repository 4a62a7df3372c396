"""What the window remembers from one start to the next: looks, language, place, sessions, and the screens' sizes."""

import json
import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import cast

from PySide6.QtCore import QByteArray, QLocale, QSettings, QSize
from PySide6.QtGui import QFontInfo, QGuiApplication, QScreen
from PySide6.QtWidgets import QWidget

from daq_app.window.subject import LENGTH
from daq_app.wording import EXPERIMENTER, SOURCE_LANGUAGE, VARIABLE, languages, tr, tr_noop
from sessions.recording import Setting

THEMES = tr_noop(("system", "light", "dark"))
SCALES = (1.0, 1.25, 1.5, 2.0)  # of the type [-]
RECENT = 12  # sessions that are offered
FRAME = QSize(16, 48)  # that a desktop draws around a window, title bar included [px]
DRAWER = "window/drawer open"
DRAWER_SIZES = "window/drawer sizes"
THEME, SCALE, LANGUAGE = "window/theme", "window/type scale", "window/language"
LEAST, MOST = 40.0, 250.0  # what 100 mm may measure on a screen before it is taken for a slip of the hand [mm]
PLAUSIBLE = (40.0, 600.0)  # dots an inch; a screen that says otherwise does not know its size
USUAL_DPI = 96.0
USUAL_POINTS = 10.0  # size of a system's interface font that asks for no scaling
_GEOMETRY, _RECENT = "window/geometry", "window/recent sessions"


def theme() -> str:
    """Return the theme that was chosen, one of THEMES."""
    name = str(settings().value(THEME))
    return name if name in THEMES else "system"


def preferred_scale() -> float:
    """Return how much larger than usual type is to be [-]: as it was chosen, or as the system asks for."""
    try:
        scale = float(str(settings().value(SCALE)))
    except ValueError:
        return font_scale()
    return scale if scale in SCALES else font_scale()


type_scale = cache(preferred_scale)  # of the type of this run: a choice holds from the next start on


def font_scale() -> float:
    """Return how much larger than usual the system wants its type [-], from 1 to 2."""
    points = QFontInfo(QGuiApplication.font()).pointSizeF()
    return min(max(points / USUAL_POINTS, 1.0), 2.0) if points > 0 else 1.0


def language() -> str:
    """Return the language of the experimenter's windows: as it was chosen, or as the environment says."""
    code = str(settings().value(LANGUAGE) or os.environ.get(VARIABLE))
    return code if code in languages(EXPERIMENTER) else SOURCE_LANGUAGE


def recent_sessions() -> tuple[Path, ...]:
    """Return the sessions that were recorded or opened last and are still there, the newest first."""
    try:
        entries = json.loads(str(settings().value(_RECENT)))
    except ValueError:
        return ()
    texts = cast("list[object]", entries) if isinstance(entries, list) else []
    return tuple(folder for text in texts if isinstance(text, str) and (folder := Path(text)).is_dir())[:RECENT]


def remember_session(folder: Path) -> None:
    """Put a session first among the recent ones."""
    path = folder.absolute()
    folders = [path, *(recent for recent in recent_sessions() if recent != path)]
    settings().setValue(_RECENT, json.dumps([str(recent) for recent in folders[:RECENT]]))


def save_place(window: QWidget) -> None:
    """Remember where a window is, and how large."""
    settings().setValue(_GEOMETRY, window.saveGeometry())


def restore_place(window: QWidget) -> None:
    """Put a window where it was; Qt brings it back onto a screen that is there."""
    geometry = settings().value(_GEOMETRY)
    if isinstance(geometry, QByteArray):
        window.restoreGeometry(geometry)
    else:
        resize_to_hint(window)


def resize_to_hint(window: QWidget) -> None:
    """Make a window as large as it likes where there is room: Qt itself takes at most two thirds of a screen."""
    window.resize(window.sizeHint().boundedTo(window.screen().availableSize() - FRAME))


def settings() -> QSettings:
    """Return what the window remembers on this computer: its looks, the screens' sizes, and folders of sessions."""
    # A file on every system: the format that follows the system cannot be led elsewhere by a test.
    return QSettings(QSettings.Format.IniFormat, QSettings.Scope.UserScope, "daq-app", "window")


def name_of(language: str) -> str:
    """Return what a language calls itself, with its code.

    >>> name_of("de")
    'Deutsch (de)'
    """
    native_name = "English" if language == SOURCE_LANGUAGE else QLocale(language).nativeLanguageName()
    return f"{native_name[:1].upper()}{native_name[1:]} ({language})" if native_name else language


@dataclass(frozen=True, slots=True)
class Millimetres:
    """What is known of a screen's size."""

    pixels: float  # device-independent pixels in a millimetre
    checked: bool  # somebody held a ruler to it

    @property
    def origin(self) -> str:
        return tr("checked with a ruler") if self.checked else tr("as the screen says, not checked with a ruler")


def millimetres(screen: QScreen) -> Millimetres:
    """Return the size of a millimetre on a screen."""
    try:
        factor = float(str(settings().value(_key(screen))))
    except ValueError:
        return Millimetres(_pixels_per_mm(screen), checked=False)
    return Millimetres(_pixels_per_mm(screen) * factor, checked=True)


def store_ruler_length(screen: QScreen, length: float) -> Millimetres | None:
    """Store how long a line of nominally 100 mm is on the screen [mm]; None where no screen can show it so."""
    if not LEAST <= length <= MOST:
        return None
    pixels = millimetres(screen).pixels * 100.0 / length
    settings().setValue(_key(screen), repr(pixels / _pixels_per_mm(screen)))
    return Millimetres(pixels, checked=True)


def _pixels_per_mm(screen: QScreen) -> float:
    """Return the screen's own device-independent pixels per millimetre, the usual number where it is not plausible."""
    dots = screen.physicalDotsPerInch() * screen.devicePixelRatio()
    return (screen.physicalDotsPerInch() if PLAUSIBLE[0] <= dots <= PLAUSIBLE[1] else USUAL_DPI) / 25.4


def _key(screen: QScreen) -> str:
    """Return the name of a screen: of this very one where it has a serial number, at this scaling."""
    names = (screen.manufacturer(), screen.model(), screen.serialNumber(), screen.name())
    name = "-".join(filter(None, names)) or "screen"
    safe = "".join(character if character.isalnum() or character == "-" else "_" for character in name)
    return f"millimetres/{safe}-{screen.devicePixelRatio():g}"


def line_settings(scale: Millimetres) -> tuple[Setting, ...]:
    """Return what a session keeps of the line that is answered on: its length, and how long a millimetre is."""
    origin = "measured" if scale.checked else "default"
    return (
        Setting("answer line length", LENGTH, "mm", origin),
        Setting("pixels in a millimetre of the answering screen", round(scale.pixels, 4), "1/mm", origin),
    )
