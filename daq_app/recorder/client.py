"""The recorder's client interface for window and terminal: start it, send requests, poll reports, close.

    with Recorder.start() as recorder:
        recorder.send(Connect("sim:?seed=7"))              # -> Device, then Live and HealthReport while it streams
        recorder.send(Tare())                              # -> Tared, or Failed("Tare", why)
        recorder.send(StartSession(plan, "recordings/P07", People("simulated hand", 7)))
        for report in recorder.poll(0.05):                 # waits up to 0.05 s for the first; () if none came
            match report:
                case AskMount(trial): ...                  # a command of sessions.run.steps: ask the experimenter
                case LoggedEvent(): ...                    # stored safely: the session so far
                case Status(safe=safe): ...                # the recording lamp: what the disk has acknowledged
                case SessionEnded(folder, end): ...        # its end is written; Sealing and Sealed follow
                case Gone(requested, sentence): ...            # always the last report
        recorder.send(StimulusMounted("K31"))              # an event of sessions.run.steps: somebody's act

Requests and reports are the dataclasses of `messages.py`, the events and commands of `run.steps`, `LoggedEvent`
and `Status`. The recorder answers an impossible request with `Failed(request, sentence)`, and an event that does not
apply now with the command `Refuse`. `Stop` is answered within 0.2 s: waiting for a device is interrupted, a session
gets its written end. No call waits, except `poll` for its timeout, `close`, and `Recorder.start` for the process to
be created. Use `Recorder` from one thread; another thread calls `wake` whenever there is something to poll.

The recorder is a child process at the other end of two pipes; no port is open. Ctrl-C and the closing of a
terminal do not reach it. **When the client goes** (ends, is killed, closes the pipe), a running session is recorded
until the finger has lifted, 10 s at most, then gets a written end whose cause is `client`, and the process ends.
`ResumeSession(folder)`, sent to a new recorder, goes on at the same trial. **When the recorder goes**, the last report
is `Gone`, all that was reported as safe is on the disk, and the same `ResumeSession` continues.
"""

import os
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from queue import SimpleQueue
from typing import Self

from daq_app.child_process import interpreter, use_one_thread
from daq_app.recorder.messages import REPORTS, REQUESTS, BrokenMessage, Codec, Gone, Report, Request, Shutdown

_PATIENCE = 10.0  # for a recorder to end; it may be sealing [s]


class Recorder(AbstractContextManager["Recorder"]):
    """The client of a recorder's process."""

    def __init__(self, process: subprocess.Popen[bytes], wake: Callable[[], None]) -> None:
        """Not for direct use: call `Recorder.start`."""
        self._process = process
        self._wake = wake
        self._requests = Codec(REQUESTS)
        self._reports = Codec(REPORTS)
        self._queue: deque[Report] = deque()
        self._to_send: SimpleQueue[bytes | None] = SimpleQueue()
        self._news = threading.Event()
        self._asked_to_end = False
        self._last_report_time = time.monotonic()
        self._reader = threading.Thread(target=self._read, name="recorder's reports", daemon=True)
        self._reader.start()
        threading.Thread(target=self._write, name="requests to the recorder", daemon=True).start()

    @classmethod
    def start(cls, pace: float = 1.0, wake: Callable[[], None] = lambda: None, *, debug: bool = False) -> Self:
        """Start a recorder whose clock runs `pace` times as fast as real (not 1 only on a simulated bench).

        With `debug` its errors go to our stderr. Raises OSError if no process can be created.
        """
        use_one_thread()
        process = subprocess.Popen(
            interpreter("-m", "daq_app.recorder", repr(pace)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=None if debug else subprocess.DEVNULL,
            # Out of reach of Ctrl-C and of a terminal that is closed: a new session; on Windows a new process group
            # and a console without a window (CREATE_NEW_PROCESS_GROUP, CREATE_NO_WINDOW).
            start_new_session=os.name == "posix",
            creationflags=0x0800_0200 if os.name == "nt" else 0,
        )
        return cls(process, wake)

    def __exit__(self, error_type: type[BaseException] | None, *_: object) -> None:
        """Close the recorder; after Ctrl-C without waiting."""
        self.close(0.0 if error_type is not None and issubclass(error_type, KeyboardInterrupt) else _PATIENCE)

    @property
    def pid(self) -> int:
        """Return the recorder's process id."""
        return self._process.pid

    @property
    def silence(self) -> float:
        """Return the time since the recorder's last report [s]; more than 1 means that it hangs or sleeps."""
        return time.monotonic() - self._last_report_time

    def send(self, request: Request) -> None:
        """Send a request or an event. A recorder that is gone does not get it, which `Gone` reports."""
        self._asked_to_end |= isinstance(request, Shutdown)
        self._to_send.put(self._requests.encode(request))

    def poll(self, timeout: float = 0.0) -> tuple[Report, ...]:
        """Return all reports since the last call, in order, waiting up to `timeout` [s] for the first."""
        if not self._queue and timeout > 0.0:
            self._news.wait(timeout)
        self._news.clear()
        return tuple(self._queue.popleft() for _ in range(len(self._queue)))

    def close(self, patience: float = _PATIENCE) -> None:
        """End session and recorder, and wait; after `patience` [s] the recorder is left to end by itself.

        A running session is stopped and sealed for good; `leave` cuts it short to be resumed. Repeating is harmless.
        """
        if self._process.poll() is None:
            self.send(Shutdown())
            try:
                self._process.wait(patience)
            except subprocess.TimeoutExpired:
                self.leave()
                return
        self._reader.join(patience)
        self.leave()

    def kill(self) -> None:
        """Kill the recorder as a crash would, to test that nothing acknowledged is lost."""
        self._process.kill()

    def leave(self) -> None:
        """Disconnect from the recorder: it ends by its rule for a client that is gone."""
        self._to_send.put(None)

    def _read(self) -> None:
        assert self._process.stdout is not None
        detail = ""
        with suppress(OSError), self._process.stdout as pipe:
            try:
                for report in self._reports.read(pipe):
                    self._last_report_time = time.monotonic()
                    self._arrive(report)
            except BrokenMessage as error:
                detail = f"; it said {error}"
        self._arrive(self._end_message(detail))

    def _arrive(self, report: Report) -> None:
        self._queue.append(report)
        self._news.set()
        self._wake()

    def _end_message(self, detail: str) -> Gone:
        if self._asked_to_end:
            return Gone(True, "the recorder has ended")
        try:
            code = self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            code = None
        cause = f"exit code {code}" if code is None or code >= 0 else f"signal {-code}"
        outcome = "everything it acknowledged is safe; resume the session to continue at the same trial"
        return Gone(False, f"the recorder has ended unexpectedly ({cause}){detail}: {outcome}")

    def _write(self) -> None:
        """Send requests, in a thread, so that a full pipe blocks nobody else."""
        assert self._process.stdin is not None
        with suppress(OSError, ValueError), self._process.stdin as pipe:  # it is gone: the reader reports that
            while (message := self._to_send.get()) is not None:
                pipe.write(message)
                pipe.flush()
