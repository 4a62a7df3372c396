"""The recorder's ends of its pipes: what is asked for comes in, what is to be shown goes out."""

import os
import signal
import threading
import time
from collections import deque
from contextlib import suppress

from msgspec import structs

from daq_app.recorder.messages import (
    REPORTS,
    REQUESTS,
    BrokenMessage,
    Codec,
    Failed,
    HealthReport,
    Live,
    Report,
    Request,
    Shutdown,
    Stop,
)

POKE_EVERY = 0.05  # between two nudges of the main thread by a stop nobody has answered [s]
MOST_LIVE = 120  # messages of readings waiting to be fetched; later ones are left out, and counted


class Inbox:
    """Requests as they come, read by a thread; a stop nudges the main thread out of whatever it waits for."""

    def __init__(self, reading: int) -> None:
        """Read from this file descriptor."""
        self._reading = reading
        self._arrived: deque[Request] = deque()
        self._nudging = threading.Lock()
        self.client_gone = threading.Event()
        self.stop_wanted = threading.Event()
        self.leaving = threading.Event()  # a shutdown was asked for, or nobody is left to ask
        threading.Thread(target=self._read, name="requests", daemon=True).start()

    def take_requests(self) -> tuple[Request, ...]:
        """Return what was asked for since the last call, in order."""
        return tuple(self._arrived.popleft() for _ in range(len(self._arrived)))

    def answer_stop(self) -> None:
        """End the nudging: what comes next is not to be broken off."""
        with self._nudging:
            self.stop_wanted.clear()

    def _read(self) -> None:
        with suppress(OSError, BrokenMessage), open(self._reading, "rb", closefd=False) as pipe:
            for request in Codec(REQUESTS).read(pipe):
                self._take(request)
        # A client that cannot be understood is as good as gone.
        self.client_gone.set()
        self.leaving.set()

    def _take(self, request: Request) -> None:
        if isinstance(request, Stop | Shutdown):
            if isinstance(request, Shutdown):
                self.leaving.set()
            self.stop_wanted.set()
            threading.Thread(target=self._nudge, name="nudge", daemon=True).start()
        self._arrived.append(request)

    def _nudge(self) -> None:
        """Break off what the main thread waits for, again and again until it has noticed."""
        main = threading.main_thread().ident
        while True:
            with self._nudging:
                if not self.stop_wanted.is_set():
                    return
                if hasattr(signal, "pthread_kill") and main is not None:
                    signal.pthread_kill(main, signal.SIGINT)
                else:
                    signal.raise_signal(signal.SIGINT)
            time.sleep(POKE_EVERY)


class Outbox:
    """Reports on their way to the client. Whoever sends never waits, whatever the client does."""

    def __init__(self, writing: int) -> None:
        """Write to this file descriptor."""
        self._file = os.fdopen(writing, "wb", closefd=False)
        self._codec = Codec(REPORTS)
        self._waiting: deque[Report] = deque()
        self._live = 0  # messages of readings among them
        self._left_out = 0  # readings
        self._news = threading.Event()
        self._lock = threading.Lock()
        self._idle = threading.Event()
        self._idle.set()
        self._broken = False
        threading.Thread(target=self._write, name="reports", daemon=True).start()

    def send(self, report: Report) -> None:
        """Have a report sent. Readings the client does not fetch are left out, and their number is sent."""
        with self._lock:
            if self._broken:
                return
            if isinstance(report, Live | HealthReport):
                if self._live >= MOST_LIVE:
                    self._left_out += len(report.sequence) if isinstance(report, Live) else 0
                    return
                self._live += 1
            if isinstance(report, Live) and self._left_out:
                report = structs.replace(report, left_out=self._left_out)
                self._left_out = 0
            self._waiting.append(report)
            self._idle.clear()
        self._news.set()

    def flush(self, patience: float) -> None:
        """Wait until everything was taken by the client, but not longer than `patience` [s]."""
        self._idle.wait(patience)

    def _write(self) -> None:
        while True:
            self._news.wait()
            self._news.clear()
            while (report := self._next()) is not None:
                try:
                    self._file.write(self._encode(report))
                    self._file.flush()
                except OSError:
                    with self._lock:
                        self._broken = True
                        self._waiting.clear()
                        self._idle.set()
                    return

    def _encode(self, report: Report) -> bytes:
        """Return the bytes of a report, or of a sentence where it cannot be encoded, so that others still go out."""
        try:
            return self._codec.encode(report)
        except Exception as error:  # noqa: BLE001  the client must not go blind for an error of ours
            return self._codec.encode(Failed(type(report).__name__, f"a report could not be sent ({error})"))

    def _next(self) -> Report | None:
        with self._lock:
            if not self._waiting:
                self._idle.set()
                return None
            report = self._waiting.popleft()
            if isinstance(report, Live | HealthReport):
                self._live -= 1
            return report
