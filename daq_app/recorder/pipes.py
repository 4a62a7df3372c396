"""The recorder's ends of its pipes: requests come in, reports go out."""

import os
import threading
import time
from collections import deque
from contextlib import suppress
from queue import Queue

from msgspec import structs

from daq_app.child_process import press_ctrl_c
from daq_app.recorder import messages as m

POKE_EVERY = 0.05  # between two nudges of the main thread by an unanswered stop [s]
MOST_LIVE = 120  # messages of readings waiting to be fetched; later ones are left out, and counted


class Inbox:
    """Incoming requests, read by a thread; a stop nudges the main thread out of any waiting."""

    def __init__(self, reading: int) -> None:
        self._reading = reading
        self._queue: deque[m.Request] = deque()
        self._nudge_lock = threading.Lock()
        self.client_gone = threading.Event()
        self.stop_wanted = threading.Event()
        self.leaving = threading.Event()  # on a shutdown, or when the client is gone
        threading.Thread(target=self._read, name="requests", daemon=True).start()

    def take_requests(self) -> tuple[m.Request, ...]:
        """Return the requests since the last call, in order."""
        return tuple(self._queue.popleft() for _ in range(len(self._queue)))

    @property
    def exhausted(self) -> bool:
        """Whether the client is gone and every request of it was taken."""
        return self.client_gone.is_set() and not self._queue

    def answer_stop(self) -> None:
        """End the nudging, so that later work is not interrupted."""
        with self._nudge_lock:
            self.stop_wanted.clear()

    def _read(self) -> None:
        with suppress(OSError, m.BrokenMessage), open(self._reading, "rb", closefd=False) as pipe:
            for request in m.Codec(m.REQUESTS).read(pipe):
                if isinstance(request, m.Stop | m.Shutdown):
                    if isinstance(request, m.Shutdown):
                        self.leaving.set()
                    self.stop_wanted.set()
                    threading.Thread(target=self._nudge, name="nudge", daemon=True).start()
                self._queue.append(request)
        # A client that sends invalid messages counts as gone.
        self.client_gone.set()
        self.leaving.set()

    def _nudge(self) -> None:
        """Interrupt the main thread's waiting repeatedly until it has noticed."""
        while True:
            with self._nudge_lock:
                if not self.stop_wanted.is_set():
                    return
                press_ctrl_c()
            time.sleep(POKE_EVERY)


class Outbox:
    """Reports on their way to the client. Sending never waits for the client."""

    def __init__(self, writing: int) -> None:
        self._file = os.fdopen(writing, "wb", closefd=False)
        self._codec = m.Codec(m.REPORTS)
        self._reports: Queue[m.Report] = Queue()
        self._live = 0  # messages of readings among them
        self._left_out = 0  # readings
        self._lock = threading.Lock()
        threading.Thread(target=self._write, name="reports", daemon=True).start()

    def send(self, report: m.Report) -> None:
        """Queue a report. Readings that the client does not fetch are left out and counted."""
        with self._lock:
            if isinstance(report, m.Live | m.HealthReport):
                if self._live >= MOST_LIVE:
                    self._left_out += len(report.sequence) if isinstance(report, m.Live) else 0
                    return
                self._live += 1
            if isinstance(report, m.Live) and self._left_out:
                report = structs.replace(report, left_out=self._left_out)
                self._left_out = 0
            self._reports.put(report)

    def flush(self, patience: float) -> None:
        """Wait until the client has taken everything, but not longer than `patience` [s]."""
        with self._reports.all_tasks_done:
            self._reports.all_tasks_done.wait_for(lambda: not self._reports.unfinished_tasks, patience)

    def _write(self) -> None:
        client_there = True
        while True:
            report = self._reports.get()
            with self._lock:
                self._live -= isinstance(report, m.Live | m.HealthReport)
            try:
                if client_there:
                    self._file.write(self._encode(report))
                    self._file.flush()
            except OSError:
                client_there = False
            self._reports.task_done()

    def _encode(self, report: m.Report) -> bytes:
        """Return the bytes of a report, or of a failure if it cannot be encoded, so that others are still sent."""
        try:
            return self._codec.encode(report)
        except Exception as error:  # noqa: BLE001  a bug must not cut the client off
            return self._codec.encode(m.Failed(type(report).__name__, f"a report could not be sent ({error})"))
