"""Whether a window can be opened here at all: Qt ends the program where it cannot, so it is asked before."""

import ctypes
import os
import sys

NO_SCREEN = (
    "there is no screen to open a window on: start it from a desktop (or under xvfb-run), "
    "or use the command line, 'daq-app --help'"
)
# What Qt loads to speak X11, and the Debian package that holds it.
LIBRARIES = {
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-image.so.0": "libxcb-image0",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-render-util.so.0": "libxcb-render-util0",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
}


def what_is_missing() -> str | None:
    """Return in one sentence why no window can be opened, and what to do; None where it can."""
    if not sys.platform.startswith("linux") or os.environ.get("QT_QPA_PLATFORM", "") not in ("", "xcb"):
        return None
    if os.environ.get("WAYLAND_DISPLAY") and not os.environ.get("QT_QPA_PLATFORM"):
        return None
    if not os.environ.get("DISPLAY"):
        return NO_SCREEN
    for library, package in LIBRARIES.items():
        if _loaded(library) is None:
            return f"the window needs {library}, which is not on this computer: install the system package {package}"
    return None if _answers() else f"the display {os.environ['DISPLAY']} does not answer: {NO_SCREEN}"


def missing_library(error: ImportError) -> str:
    """Return in one sentence which library Qt could not be loaded for."""
    library = str(error).split(":", maxsplit=1)[0]
    if ".so" in library:
        return f"the window needs {library}, which is not on this computer: install the system package that holds it"
    return f"the window needs PySide6, which cannot be loaded ({error}): install it with 'make setup'"


def _loaded(library: str) -> ctypes.CDLL | None:
    try:
        return ctypes.CDLL(library)
    except OSError:
        return None


def _answers() -> bool:
    """Say whether an X server answers at DISPLAY."""
    xcb = _loaded("libxcb.so.1")
    if xcb is None:
        return True  # Qt brings its own
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connection_has_error.argtypes = [ctypes.c_void_p]
    xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
    connection = xcb.xcb_connect(None, None)
    try:
        return not xcb.xcb_connection_has_error(connection)
    finally:
        xcb.xcb_disconnect(connection)
