"""The window's stored preferences: theme, language, position, sessions, and the screens' sizes."""

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
RECENT = 12  # most sessions offered
FRAME = QSize(16, 48)  # of a window on the desktop, title bar included [px]
DRAWER = "window/drawer open"
DRAWER_SIZES = "window/drawer sizes"
THEME, SCALE, LANGUAGE = "window/theme", "window/type scale", "window/language"
LEAST, MOST = 40.0, 250.0  # accepted ruler lengths of the nominal 100 mm; others count as typing errors [mm]
PLAUSIBLE = (40.0, 600.0)  # dots per inch; a screen that reports others does not know its size
USUAL_DPI = 96.0
USUAL_POINTS = 10.0  # size of a system's interface font at a scale of 1
_GEOMETRY, _RECENT = "window/geometry", "window/recent sessions"


def theme() -> str:
    """Return the chosen theme, one of THEMES."""
    name = str(settings().value(THEME))
    return name if name in THEMES else "system"


def preferred_scale() -> float:
    """Return the scale of the type relative to the usual [-], chosen or from the system."""
    try:
        scale = float(str(settings().value(SCALE)))
    except ValueError:
        return font_scale()
    return scale if scale in SCALES else font_scale()


type_scale = cache(preferred_scale)  # fixed for this run: a choice takes effect at the next start


def font_scale() -> float:
    """Return the system's scale of type [-], limited to 1 to 2."""
    points = QFontInfo(QGuiApplication.font()).pointSizeF()
    return min(max(points / USUAL_POINTS, 1.0), 2.0) if points > 0 else 1.0


def language() -> str:
    """Return the language of the experimenter's windows, chosen or from the environment."""
    code = str(settings().value(LANGUAGE) or os.environ.get(VARIABLE))
    return code if code in languages(EXPERIMENTER) else SOURCE_LANGUAGE


def recent_sessions() -> tuple[Path, ...]:
    """Return the existing sessions that were recorded or opened last, the newest first."""
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
    """Store the position and size of a window."""
    settings().setValue(_GEOMETRY, window.saveGeometry())


def restore_place(window: QWidget) -> None:
    """Restore the position and size of a window; Qt moves it onto an existing screen."""
    geometry = settings().value(_GEOMETRY)
    if isinstance(geometry, QByteArray):
        window.restoreGeometry(geometry)
    else:
        resize_to_hint(window)


def resize_to_hint(window: QWidget) -> None:
    """Resize a window to its size hint, within the screen; Qt itself takes at most two thirds of a screen."""
    window.resize(window.sizeHint().boundedTo(window.screen().availableSize() - FRAME))


def settings() -> QSettings:
    """Return the stored preferences of this computer."""
    # A file on every system: tests cannot redirect the native format.
    return QSettings(QSettings.Format.IniFormat, QSettings.Scope.UserScope, "daq-app", "window")


def name_of(language: str) -> str:
    """Return the native name of a language, with its code.

    >>> name_of("de")
    'Deutsch (de)'
    """
    native_name = "English" if language == SOURCE_LANGUAGE else QLocale(language).nativeLanguageName()
    return f"{native_name[:1].upper()}{native_name[1:]} ({language})" if native_name else language


@dataclass(frozen=True, slots=True)
class Millimetres:
    """The scale of a screen."""

    pixels: float  # device-independent pixels per millimetre
    checked: bool  # measured with a ruler

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
    """Store the measured length of a nominally 100 mm line on the screen [mm]; None if it is implausible."""
    if not LEAST <= length <= MOST:
        return None
    pixels = millimetres(screen).pixels * 100.0 / length
    settings().setValue(_key(screen), repr(pixels / _pixels_per_mm(screen)))
    return Millimetres(pixels, checked=True)


def _pixels_per_mm(screen: QScreen) -> float:
    """Return the screen's own device-independent pixels per millimetre, or the usual value if it is implausible."""
    dots = screen.physicalDotsPerInch() * screen.devicePixelRatio()
    return (screen.physicalDotsPerInch() if PLAUSIBLE[0] <= dots <= PLAUSIBLE[1] else USUAL_DPI) / 25.4


def _key(screen: QScreen) -> str:
    """Return a key for a screen at its scaling, unique if it has a serial number."""
    names = (screen.manufacturer(), screen.model(), screen.serialNumber(), screen.name())
    name = "-".join(filter(None, names)) or "screen"
    safe = "".join(character if character.isalnum() or character == "-" else "_" for character in name)
    return f"millimetres/{safe}-{screen.devicePixelRatio():g}"


def line_settings(scale: Millimetres) -> tuple[Setting, ...]:
    """Return the settings that a session stores about the answer line: its length, and pixels per millimetre."""
    origin = "measured" if scale.checked else "default"
    return (
        Setting("answer line length", LENGTH, "mm", origin),
        Setting("pixels in a millimetre of the answering screen", round(scale.pixels, 4), "1/mm", origin),
    )
