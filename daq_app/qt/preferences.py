"""What the window remembers from one start to the next: looks, language, place and recent sessions."""

import json
import os
from pathlib import Path

from PySide6.QtCore import QByteArray, QLocale, QSettings, QSize, Qt
from PySide6.QtWidgets import QWidget

from daq_app.qt.tokens import DARK, LIGHT, Tokens, current_tokens, font_scale
from daq_app.wording import ENGLISH, EXPERIMENTER, VARIABLE, languages, tr_noop

THEMES = tr_noop(("system", "light", "dark"))
SCALES = (1.0, 1.25, 1.5, 2.0)  # of the type [-]
RECENT = 12  # sessions that are offered
FRAME = QSize(16, 48)  # that a desktop draws around a window, title bar included [px]
DRAWER = "window/drawer open"
DRAWER_SIZES = "window/drawer sizes"
THEME, SCALE, LANGUAGE = "window/theme", "window/type scale", "window/language"
_GEOMETRY, _RECENT = "window/geometry", "window/recent sessions"


def choose(what: str, value: object) -> None:
    """Remember what was chosen as `THEME`, `SCALE` or `LANGUAGE`; None follows the system again."""
    settings().setValue(what, "" if value is None else str(value))


def theme() -> str:
    """Return the theme that was chosen, one of THEMES."""
    said = str(settings().value(THEME))
    return said if said in THEMES else "system"


def chosen_tokens() -> Tokens:
    """Return the tokens of the theme that was chosen, or of the one that the system asks for."""
    return {"light": LIGHT, "dark": DARK}.get(theme()) or current_tokens()


def type_scale() -> float:
    """Return how much larger than usual the type is [-]: as it was chosen, or as the system asks for."""
    try:
        chosen = float(str(settings().value(SCALE)))
    except ValueError:
        return font_scale()
    return chosen if chosen in SCALES else font_scale()


def language() -> str:
    """Return the language of the experimenter's windows: as it was chosen, or as the environment says."""
    said = str(settings().value(LANGUAGE) or os.environ.get(VARIABLE))
    return said if said in languages(EXPERIMENTER) else ENGLISH


def recent_sessions() -> tuple[Path, ...]:
    """Return the sessions that were recorded or opened last and are still there, the newest first."""
    try:
        listed = json.loads(str(settings().value(_RECENT)))
    except ValueError:
        return ()
    places = [Path(one) for one in listed if isinstance(one, str)] if isinstance(listed, list) else []  # pyright: ignore[reportUnknownVariableType]
    return tuple(place for place in places if place.is_dir())[:RECENT]


def remember_session(folder: Path) -> None:
    """Put a session first among the recent ones."""
    whole = folder.absolute()
    kept = [whole, *(place for place in recent_sessions() if place != whole)]
    settings().setValue(_RECENT, json.dumps([str(place) for place in kept[:RECENT]]))


def save_place(window: QWidget) -> None:
    """Remember where a window is, and how large."""
    settings().setValue(_GEOMETRY, window.saveGeometry())


def restore_place(window: QWidget) -> None:
    """Put a window where it was; Qt brings it back onto a screen that is there.

    A new one is as large as it likes where there is room: left to itself Qt takes at most two thirds of a screen.
    """
    kept = settings().value(_GEOMETRY)
    if isinstance(kept, QByteArray):
        window.restoreGeometry(kept)
    else:
        window.resize(window.sizeHint().boundedTo(window.screen().availableSize() - FRAME))


def settings() -> QSettings:
    """Return what the window remembers on this computer: its looks, the screens' sizes, and folders of sessions."""
    # A file on every system: the format that follows the system cannot be led elsewhere by a test.
    return QSettings(QSettings.Format.IniFormat, QSettings.Scope.UserScope, "daq-app", "window")


def direction(language: str) -> Qt.LayoutDirection:
    """Return which way a language is read."""
    return QLocale(language).textDirection()


def name_of(language: str) -> str:
    """Return what a language calls itself, with its code.

    >>> name_of("de")
    'Deutsch (de)'
    """
    own = "English" if language == ENGLISH else QLocale(language).nativeLanguageName()
    return f"{own[:1].upper()}{own[1:]} ({language})" if own else language
