"""Starts the window: checks for a screen, opens the window with the simulated bench, and runs it."""

import ctypes
import gc
import os
import signal
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING
from weakref import WeakMethod

from daq_app.console import FAILED, STOPPED, WRONG, NotWritten, Parser, WrongValue
from daq_app.wording import VARIABLE

if TYPE_CHECKING:  # Qt is loaded only after a check that it can be
    from PySide6.QtCore import QObject, QTimer
    from PySide6.QtWidgets import QApplication, QWidget

    from daq_app.qt.analyst_window import AnalystWindow
    from daq_app.qt.bridge import Client
    from daq_app.qt.main_window import MainWindow
    from daq_app.qt.subject_side import TabletScreen
    from daq_app.qt.tokens import Tokens

SIMULATED_BENCH = "sim:?rate=200"
COLLECT_EVERY = 1000  # [ms]: the window creates 50 to 900 objects in this time, and Python collects after 700
ICON = Path(__file__).with_name("daq-app.svg")
NO_SCREEN = (
    "there is no screen to open a window on: start it from a desktop (or under xvfb-run), "
    "or use the command line, 'daq-app --help'"
)
# Libraries that Qt loads for X11, and their Debian packages.
_LIBRARIES = {
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-image.so.0": "libxcb-image0",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-render-util.so.0": "libxcb-render-util0",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
}


def window(arguments: list[str]) -> int:
    """Open the analyst's window on the session named, or the experimenter's without one; return the exit code."""
    parser = command_line()
    try:
        options = parser.parse_args(arguments)
        folder: Path | None = options.session
        web = options.subject_screen == "web"
        if web and folder is not None:
            parser.error("a session that is reviewed has no subject: leave out SESSION or --subject-screen")
        if options.subject_address is not None and not web:
            parser.error("--subject-address is a tablet's way to this machine: give --subject-screen web too")
    except WrongValue as error:
        return _fail(str(error), WRONG)
    except (NotWritten, BrokenPipeError) as error:
        return _fail(str(error))
    if folder is None:
        return _show_window(
            lambda application: open_window(application, tablet=_tablet(options.subject_address) if web else None),
            ("daq_app.recorder.client", "daq_app.tablet.server", "daq_app.window.state"),
        )
    if not folder.is_dir():
        return _fail(f"{folder} is not a folder: give a session's folder")

    def analyst(application: "QApplication") -> "AnalystWindow":
        from daq_app.qt.analyst_window import AnalystWindow
        from daq_app.qt.preferences import remember_session, resize_to_hint
        from daq_app.qt.tokens import preferred_tokens

        tokens = preferred_tokens()
        remember_session(folder)
        window = AnalystWindow(folder, tokens)
        _apply_theme(application, tokens)
        resize_to_hint(window)
        return window

    return _show_window(analyst, ("daq_app.analyst.state",))


def command_line() -> Parser:
    """Return the parser of `daq-app window`."""
    parser = Parser("daq-app window", description="Open the window.", epilog="Example: daq-app window recordings/P07")
    parser.add_argument("session", nargs="?", type=Path, metavar="SESSION", help="a session to review (a new one)")
    meaning = "show the subject's page in a window here, or in a tablet's browser on the lab's network (window)"
    parser.add_argument("--subject-screen", choices=("window", "web"), default="window", help=meaning)
    meaning = "this computer's address for the tablet (its address in its own network)"
    parser.add_argument("--subject-address", metavar="IP", help=meaning)
    return parser


@contextmanager
def _without_garbage_collection() -> Generator[None]:
    """Disable garbage collection in the context, and exempt its objects for good, as they live with the window."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if enabled:
            gc.enable()


def collect_between_events(parent: "QObject") -> "QTimer":
    """Collect garbage between two Qt events, never inside a Qt call, in place of Python; return the timer that does.

    Qt locks senders of signals while it calls Python's `disconnectNotify`. A widget that Python's own collector deletes
    at that moment waits for the same lock in the same thread, and the window hangs forever. No other thread than the
    window's may delete a widget.
    """
    from PySide6.QtCore import QTimer

    gc.disable()
    timer = QTimer(parent)
    timer.timeout.connect(_collect_due)
    timer.start(COLLECT_EVERY)
    return timer


def _collect_due() -> None:
    """Collect the oldest generation beyond its threshold, as Python itself would."""
    for generation in (2, 1, 0):
        if gc.get_count()[generation] > gc.get_threshold()[generation]:
            gc.collect(generation)
            return


@_without_garbage_collection()
def open_window(
    application: "QApplication", start: "Callable[[], Client] | None" = None, tablet: "TabletScreen | None" = None
) -> "MainWindow":
    """Return the experimenter's window while the simulated bench connects; `start` makes a recorder.

    With a `tablet` the subject's page is on it.
    """
    from daq_app.recorder.client import Recorder
    from daq_app.recorder.messages import Connect

    # The recorder's process starts while the window is being built.
    recorder = (start or Recorder.start)()
    recorder.send(Connect(SIMULATED_BENCH))
    from daq_app.qt.bridge import Bridge
    from daq_app.qt.main_window import MainWindow
    from daq_app.qt.tokens import preferred_tokens

    def follow_theme() -> None:
        _apply_theme(application, preferred_tokens())

    application.setQuitOnLastWindowClosed(False)
    bridge = Bridge(recorder, start or Recorder.start)
    bridge.connecting(SIMULATED_BENCH)
    window = MainWindow(bridge, tablet)
    follow_theme()  # after all parts are in place: each move to another parent styles a part and all inside it again
    window.theme_chosen.connect(follow_theme)
    application.styleHints().colorSchemeChanged.connect(follow_theme)

    # Python keeps its hook until exit; a bridge kept by it would be disconnected there, which crashes PySide.
    report = WeakMethod(bridge.report_drawing_failure)

    def show_error(_type: type[BaseException], error: BaseException, _trace: TracebackType | None) -> None:
        """Report an error in the window, which continues: a bug there never stops a recording."""
        if isinstance(error, Exception) and (report_failure := report()) is not None:
            report_failure(error)

    sys.excepthook = show_error
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:  # from now on Ctrl-C in a terminal must not end a session
        signal.signal(signal.SIGINT, signal.default_int_handler)
    bridge.begin()
    return window


def _tablet(address: str | None) -> "TabletScreen":
    from daq_app.qt.subject_side import TabletScreen
    from daq_app.tablet.server import PORT

    return TabletScreen(address, PORT)


def _show_window(build: "Callable[[QApplication], QWidget]", modules: tuple[str, ...] = ()) -> int:
    """Show the window, after loading `modules`, until it is closed; return the exit code, or report what is missing."""
    if problem := what_is_missing():
        return _fail(problem)
    for module in modules:  # before Qt's, because PySide reads the source of every module loaded after it
        import_module(module)
    try:
        from PySide6.QtCore import QTimer
        from PySide6.QtWidgets import QApplication
    except ImportError as error:
        return _fail(missing_library(error))
    from daq_app.tablet.server import NoTabletServer

    application = QApplication(sys.argv[:1])
    collect_between_events(application)
    _speak(application)
    try:
        window = build(application)
    except NoTabletServer as error:
        return _fail(str(error))
    window.show()
    codes: list[int] = []

    def stop(number: int, _frame: object) -> None:
        """Close the window like its button: it asks first while a session is recorded, but not on SIGTERM."""
        codes.append(STOPPED)

        def close() -> None:
            if not window.close() and number == signal.SIGTERM:
                window.close()  # it asks once

        QTimer.singleShot(0, close)

    signal.signal(signal.SIGINT, stop)
    signal.signal(signal.SIGTERM, stop)
    code = application.exec()
    return codes[0] if codes else code


def _speak(application: "QApplication") -> None:
    """Set the experimenter's language for this process, its child processes and Qt's own dialogs."""
    from PySide6.QtCore import QLibraryInfo, QLocale, QTranslator

    from daq_app.qt import preferences

    language = os.environ[VARIABLE] = preferences.language()
    application.setLayoutDirection(QLocale(language).textDirection())
    qt_texts = QTranslator(application)
    if qt_texts.load(f"qtbase_{language}", QLibraryInfo.path(QLibraryInfo.LibraryPath.TranslationsPath)):
        application.installTranslator(qt_texts)


def _apply_theme(application: "QApplication", tokens: "Tokens") -> None:
    from PySide6.QtGui import QIcon

    from daq_app.qt.tokens import palette, style_sheet, tick_palette

    sheet = style_sheet(tokens)
    if application.styleSheet() == sheet:  # Qt would lay out every widget again
        return
    application.setApplicationName("daq-app")
    application.setDesktopFileName("daq-app")
    application.setWindowIcon(QIcon(str(ICON)))
    if not application.styleSheet():  # at the first call
        application.setStyle("Fusion")  # the only style with our colours and the same look everywhere
    application.setPalette(palette(tokens))
    for box in ("QCheckBox", "QRadioButton"):  # the stub expects bytes
        application.setPalette(tick_palette(tokens), box)  # pyrefly: ignore[bad-argument-type]
    application.setStyleSheet(sheet)


def _fail(sentence: str, code: int = FAILED) -> int:
    sys.stderr.write(f"daq-app: {sentence}\n")
    return code


def what_is_missing() -> str | None:
    """Return one sentence on why no window can be opened, and the remedy; None if it can."""
    if not sys.platform.startswith("linux") or os.environ.get("QT_QPA_PLATFORM", "") not in ("", "xcb"):
        return None
    if os.environ.get("WAYLAND_DISPLAY") and not os.environ.get("QT_QPA_PLATFORM"):
        return None
    if not os.environ.get("DISPLAY"):
        return NO_SCREEN
    if missing := {library: package for library, package in _LIBRARIES.items() if _load(library) is None}:
        libraries, packages = ", ".join(missing), " ".join(missing.values())
        return f"the window needs {libraries}, not on this computer: install the system packages {packages}"
    return None if _display_answers() else f"the display {os.environ['DISPLAY']} does not answer: {NO_SCREEN}"


def missing_library(error: ImportError) -> str:
    """Return one sentence that names the library missing for Qt."""
    library = str(error).split(":", maxsplit=1)[0]
    if ".so" in library:
        return f"the window needs {library}, which is not on this computer: install the system package that holds it"
    return f"the window needs PySide6, which cannot be loaded ({error}): install it with 'make setup'"


def _load(library: str) -> ctypes.CDLL | None:
    try:
        return ctypes.CDLL(library)
    except OSError:
        return None


def _display_answers() -> bool:
    """Say whether an X server answers at DISPLAY."""
    xcb = _load("libxcb.so.1")
    if xcb is None:
        return True  # Qt ships its own library
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connection_has_error.argtypes = [ctypes.c_void_p]
    xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
    connection = xcb.xcb_connect(None, None)
    try:
        return not xcb.xcb_connection_has_error(connection)
    finally:
        xcb.xcb_disconnect(connection)
