"""The only connection between recorder and window: it folds reports into the state and sends acts."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Protocol

from PySide6.QtCore import QObject, QTimer, Signal

from daq_app.recorder import messages as m
from daq_app.recorder.device_history import life_of
from daq_app.recorder.messages import REQUESTS, Report, Request
from daq_app.window.course_state import Judged
from daq_app.window.live_feed import LiveFeed, merge_live
from daq_app.window.live_model import Settle
from daq_app.window.live_model_process import LiveModel
from daq_app.window.state import (
    AppState,
    DevicesFound,
    DrawingFailed,
    LifeKnown,
    Message,
    NewSession,
    Searching,
    Tick,
    fold,
)
from daq_app.window.stroke_quality import Judge
from daq_app.window.subject import translator
from daq_app.window.view import View, derive_view
from drivers.catalog import reachable
from sessions.plan.plan import Frame

_FRAME = 16  # between two polls of the recorder [ms]: 60 a second
AFTER_OPENING = 1500  # delay of work that is not needed to open the window [ms]
BEGINNING = (m.Connect, m.StartSession, m.ResumeSession)  # requests that start a new recorder if there is none
_TICK = 0.1  # between two ticks, for texts with an age [s]


class Client(Protocol):
    """The window's interface to the recorder."""

    def send(self, request: Request) -> None: ...
    def poll(self) -> tuple[Report, ...]: ...
    def close(self) -> None: ...

    def leave(self) -> None:
        """Disconnect: a current session gets an end from which it can be resumed."""


class Bridge(QObject):
    """Holds the window's one state. Every change passes through `send` or `poll`."""

    changed = Signal(object)  # View, whenever it has changed
    frame = Signal()  # time to draw: there may be new readings

    def __init__(self, client: Client, start: Callable[[], Client]) -> None:
        """Connect to a recorder; `start` makes another if it goes."""
        super().__init__()
        self._client, self._start = client, start
        self._ticked = -1.0
        self._from_threads: SimpleQueue[Message] = SimpleQueue()
        self._judge = Judge(self._from_threads.put)
        self.state = fold(AppState(), Tick(time.monotonic()))
        self.view: View = derive_view(self.state)
        self._last_state = self.state
        self.feed = LiveFeed()
        self.model = LiveModel()
        self.session_offset = 0.0  # session clock minus this machine's [s]
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.poll)

    @property
    def recording(self) -> bool:
        return self.state.session is not None and not self.state.session.is_over

    def connecting(self, uri: str) -> None:
        """Note that the recorder has already been told to connect a transducer."""
        self._fold(m.Connect(uri))

    def begin(self) -> None:
        self._timer.start(_FRAME)
        QTimer.singleShot(AFTER_OPENING, self._judge.prepare)
        QTimer.singleShot(AFTER_OPENING, self.model.prepare)

    def end(self) -> None:
        """Stop polling, and let the recorder end; a current session can be resumed."""
        self._timer.stop()
        self.model.close()
        if self.recording:
            self._client.leave()
        else:
            self._client.close()
        self._judge.close()

    def session_now(self) -> float:
        return time.monotonic() + self.session_offset

    def send(self, message: Message) -> None:
        """Carry out a message: fold it, and if it is a request or an event, send it to the recorder."""
        self._fold(message)
        if isinstance(message, REQUESTS) and (self.state.exit_reason is None or isinstance(message, BEGINNING)):
            if self.state.exit_reason is not None:  # a new recorder replaces it
                self._client.close()
                self._client = self._start()
                self._fold(m.Gone(True, ""))
            self._client.send(message)
        if isinstance(message, NewSession) and self.state.session is None:
            self.model.follow(None)  # the next subject's page shows nothing of the last stroke
        self._show()

    def search(self) -> None:
        """Search for transducers without blocking the window."""
        self.send(Searching())
        self._look_up(lambda: DevicesFound(reachable()))

    def poll(self) -> None:
        now = time.monotonic()
        if now - self._ticked >= _TICK:
            self._ticked = now
            self._fold(Tick(now))
        for report in merge_live(self._client.poll()):
            try:
                self._take(report)
            except Exception as error:  # noqa: BLE001  a failure with one report must not lose the others
                self.report_drawing_failure(error)
        with suppress(Empty):
            while True:
                self._fold(message := self._from_threads.get_nowait())
                if isinstance(message, Judged) and message.live:
                    self._settle(message)
        self._show()
        self.frame.emit()

    def report_drawing_failure(self, error: Exception) -> None:
        """Report that a picture could not be drawn; nothing else is affected."""
        sentence = f"{type(error).__name__}: {str(error).strip().partition(chr(10))[0]}"
        if self.state.drawing_error != sentence:
            self._fold(DrawingFailed(sentence))

    def _take(self, report: Report) -> None:
        match report:
            case m.Live():
                self.feed.add(report, self._frame())
                self._judge.look(self.feed, self.state)
                self.model.add(report, self._frame())
                return
            case m.Device(info):
                self.feed.device(info)
            case m.NoDevice():
                self.feed.device(None)
            case m.SessionBegun(plan=plan, clock_offset_ns=offset):
                self.session_offset = offset * 1e-9
                self.model.follow(plan)
        overloads = self.state.bench.peak.overloads
        self._fold(report)
        self._judge.follow(report, self.feed)
        bench = self.state.bench
        if bench.info is not None and (isinstance(report, m.Device | m.Tared) or bench.peak.overloads != overloads):
            serial = bench.info.serial
            self._look_up(lambda: LifeKnown(serial, life_of(serial)))  # from a file that may be large

    def _look_up(self, read: Callable[[], Message]) -> None:
        """Read in a thread, without blocking the window; the result is folded."""
        threading.Thread(target=lambda: self._from_threads.put(read()), daemon=True).start()

    def _settle(self, judgement: Judged) -> None:
        session, stroke, friction = self.state.session, judgement.quality.stroke, judgement.quality.friction
        if session and friction and stroke and stroke.steady and stroke.normal_force:
            self.model.settle(Settle(session.plan, friction, stroke.normal_force, stroke.steady))

    def _fold(self, message: Message) -> None:
        self.state = fold(self.state, message)

    def _show(self) -> None:
        if self.state is self._last_state:
            return
        self._last_state = self.state
        session = self.state.session
        view = derive_view(self.state, translator(self.state.language if session is None else session.plan.language))
        if view != self.view:
            self.view = view
            self.changed.emit(view)

    def _frame(self) -> Frame:
        """Return the transducer's orientation to the face, from the session or the bench."""
        session = self.state.session
        return self.state.bench.frame or Frame() if session is None or session.is_over else session.plan.frame
