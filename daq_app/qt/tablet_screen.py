"""The subject's page on a tablet, as the window sees it: it shows views and gives answers, and it may be away."""

import io
import time
from functools import partial

from PySide6.QtCore import QObject, Qt, Signal

from daq_app.qt.indicators import FULL, newest_force
from daq_app.qt.languages import direction, translator
from daq_app.qt.score_line import LENGTH
from daq_app.qt.screens import USUAL_DPI
from daq_app.tablet.dialogue import Dialogue
from daq_app.tablet.messages import AnswerGiven, Force, FromTablet, Hello, Ruler
from daq_app.tablet.server import TabletServer, own_address
from daq_app.window.course_state import SessionState
from daq_app.window.live_trace import LiveTrace
from daq_app.window.view_subject import SubjectView
from daq_app.wording import tr
from sessions.recording import Setting

FORCE_EVERY = 0.05  # between two values of the bar [s]
STEPS = 200  # of the bar, that can be distinguished


class TabletScreen(QObject):
    """One tablet at the other end of a server of our own."""

    answered = Signal(object)  # an event of `run.steps`
    changed = Signal()  # the tablet has come or gone, it has another line, or the code is a new one
    _arrived = Signal(object, float)  # from the server's threads
    _moved = Signal()

    def __init__(self, address: str | None, port: int) -> None:
        """Serve the page at an address of this machine. Raises NoTabletServer."""
        super().__init__()
        self.session_offset = 0.0  # session clock minus this machine's monotonic one [s]
        self._pixels: float | None = None  # in a millimetre, measured with a ruler
        self._part = 0.0
        self._last_sent = 0.0  # when the bar got its last value [s]
        self._arrived.connect(self._take, Qt.ConnectionType.QueuedConnection)
        self._moved.connect(self.changed, Qt.ConnectionType.QueuedConnection)
        self.server = TabletServer(address or own_address(), port, self._arrived.emit, self._moved.emit)
        self._dialogue = Dialogue(self.server.send)

    @property
    def words(self) -> str:
        """Return what is worth knowing of the tablet, for the experimenter."""
        if not self.server.connected:
            return tr("Open {url} on the tablet, and type the code {code}.", url=self.server.url, code=self.server.code)
        checked = tr("checked") if self._pixels else tr("not checked")
        return tr(
            "The tablet shows the page. Line of {length:.0f} mm, {checked} with a ruler.",
            length=LENGTH,
            checked=checked,
        )

    def picture(self) -> bytes:
        """Return the address with the code as a QR code, PNG; nothing while the tablet is there."""
        if self.server.connected:
            return b""
        import segno  # an optional package, which the server has looked for

        drawn = io.BytesIO()
        segno.make(self.server.link, micro=False).save(drawn, kind="png", scale=4, border=4)
        return drawn.getvalue()

    @property
    def missing(self) -> str:
        """Return why no session can begin; empty where one can."""
        return "" if self.server.connected else self.words

    def show_view(self, view: SubjectView, session: SessionState | None) -> None:
        """Show what is to be done now."""
        mirrored = direction(view.language) == Qt.LayoutDirection.RightToLeft
        self._dialogue.show(view, session, translator(view.language), mirrored=mirrored)

    def show_force(self, trace: LiveTrace) -> None:
        """Show how hard the finger presses."""
        part, now = min(max(newest_force(trace) / FULL, 0.0), 1.0), time.monotonic()
        if now - self._last_sent >= FORCE_EVERY and round(part * STEPS) != round(self._part * STEPS):
            self._part, self._last_sent = part, now
            self.server.send(Force(part))

    def line_settings(self) -> tuple[Setting, ...]:
        """Return what a session keeps of the line that is answered on."""
        origin = "measured" if self._pixels else "default"
        return (
            Setting("subject's screen", "web", "", "set"),
            Setting("answer line length", LENGTH, "mm", origin),
            Setting(
                "pixels in a millimetre of the answering screen",
                round(self._pixels or USUAL_DPI / 25.4, 4),
                "1/mm",
                origin,
            ),
        )

    def close(self) -> None:
        """Serve no more."""
        self.server.close()

    def _take(self, said: FromTablet, arrived: float) -> None:
        match said:
            case Hello(pixels_per_mm=pixels) | Ruler(pixels):
                self._pixels = pixels
                self.changed.emit()
            case AnswerGiven():
                event = self._dialogue.take(said, partial(self._session_time, said.sent, arrived))
                if event is not None:
                    self.answered.emit(event)

    def _session_time(self, sent: float, arrived: float, at: float) -> float:
        """Return the session's clock [s] at an instant of the tablet's [ms]: so long before the answer arrived."""
        return arrived + self.session_offset - max(sent - at, 0.0) * 1e-3
