"""The analyst's work in a separate process, and its client in the window."""

import signal
import sys
import time
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Any

from daq_app.analyst import state as m
from daq_app.child_process import Child
from daq_app.wording import tr

Connection = Any  # one end of a pipe; its type differs between systems
_PATIENCE = 0.15  # for work to stop, before its process is ended [s]
URGENT = (m.Stop, m.Move, m.Undo)  # requests that interrupt the model's answers, which resume afterwards


def run(connection: Connection, folder: str) -> None:
    """Analyse and predict the session in `folder`, and serve requests until the window is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Partly written files are removed before the end.
    signal.signal(signal.SIGTERM, lambda _signal, _frame: sys.exit(0))
    with suppress(EOFError, OSError):
        _Server(connection).serve(Path(folder))


class _Server:
    """Carries out requests one by one, and computes the model's answers in between."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._send = connection, connection.send
        self._requests: deque[m.Ask] = deque()
        self._halted = False  # somebody stopped the model's answers

    def serve(self, folder: Path) -> None:
        """Work until the window is gone. Raises EOFError or OSError then."""
        from daq_app.analyst.work import Work, sentence_of
        from solver import Cancelled

        try:
            work = Work(folder, self._send, self._urgent)
        except Exception as error:  # noqa: BLE001  the window gets a message and stays open
            self._send(m.Problem(sentence_of(error)))
            return
        while True:
            self._take()
            going_on = work.unfinished and not self._halted
            if not self._requests and not going_on:
                self._send(m.Idle())
                self._requests.append(self._connection.recv())
            request = self._requests.popleft() if self._requests else None
            try:
                if request is None:
                    work.go_on()
                elif isinstance(request, m.Stop):
                    self._halted = True
                    self._send(m.Cancelled())
                else:
                    self._halted = self._halted and not isinstance(request, m.GoOn | m.Move | m.Undo)
                    work.do(request)
            except Cancelled:
                pass  # the interrupting request is the next one
            except Exception as error:  # noqa: BLE001  the window gets a message and stays open
                self._halted = self._halted or request is None
                self._send(m.Problem(sentence_of(error)))

    def _take(self) -> None:
        while self._connection.poll():
            self._requests.append(self._connection.recv())

    def _urgent(self) -> bool:
        """Say whether an urgent request is waiting; a stop discards all other requests."""
        self._take()
        stops = [request for request in self._requests if isinstance(request, m.Stop)]
        if stops:
            self._requests = deque(stops[:1])
        return any(isinstance(request, URGENT) for request in self._requests)


class Analyst:
    """The window's interface to the work. No method waits."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._stop_time: float | None = None  # of a stop that is not yet answered
        self._child: Child | None = self._begin()

    def poll(self) -> tuple[m.Reply, ...]:
        """Return the messages since the last call."""
        messages: list[m.Reply] = []
        try:
            while self._child is not None and (message := self._child.receive()) is not None:
                messages.append(message)
        except (EOFError, OSError):
            self.close()
            if not messages or not isinstance(messages[-1], m.Problem):
                messages.append(m.Problem(tr("The work ended unexpectedly; the next request restarts it.")))
        if any(isinstance(message, m.Cancelled) for message in messages):
            self._stop_time = None
        if self._stop_time is not None and time.monotonic() - self._stop_time > _PATIENCE:
            self.close()
            messages.append(m.Cancelled())
        return tuple(messages)

    def ask(self, request: m.Ask) -> None:
        """Send a request; work that has ended restarts and begins with it."""
        if isinstance(request, m.Stop):
            self._stop_time = time.monotonic()
        if self._child is None:
            if isinstance(request, m.Stop):
                return
            self._child = self._begin()
        with suppress(OSError):  # `poll` notices that it is gone
            self._child.send(request)

    def close(self) -> None:
        """End the work's process."""
        if self._child is not None:
            self._child.close()
        self._child = self._stop_time = None

    def _begin(self) -> Child:
        return Child(run, str(self._folder), name="analyst")
