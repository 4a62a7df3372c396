"""The recorder's process: requests come in through one pipe, reports go out through another.

Between sessions the main loop shows the transducer's readings; during a session `session.run` has the loop. When
the client is gone, the current session is ended by its rule (`session.py`) and the process ends.
"""

import os
import signal
import sys
from collections.abc import Callable

from daq_app.console import is_ours
from daq_app.recorder import messages as m
from daq_app.recorder.bench import Bench, NotNow
from daq_app.recorder.display import Display
from daq_app.recorder.pipes import Inbox, Outbox
from daq_app.recorder.session import SessionSetup, begin, resume, run
from drivers.clock import LONGEST_STEP, Clock, clock_at
from sessions.file_access import failure_sentence

LAST_WORDS = 2.0  # for the client to fetch the last reports [s]


def main(pace: float = 1.0) -> None:
    """Serve the client at stdin and stdout until it goes, with a clock of this pace [-]."""
    reading, writing = os.dup(0), os.dup(1)
    # Stray prints must not mix with the messages.
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, lambda _signal, _frame: None)  # a nudge that only interrupts waiting
    outbox = Outbox(writing)
    try:
        Recorder(Inbox(reading), outbox, clock_at(pace, LONGEST_STEP)).serve()
    finally:
        outbox.flush(LAST_WORDS)
    sys.stdout.flush()
    os._exit(0)  # threads of drivers and pipes have nothing left to do


class Recorder:
    """The main loop of the process."""

    def __init__(self, inbox: Inbox, outbox: Outbox, clock: Clock) -> None:
        self._inbox = inbox
        self._send = outbox.send
        self._clock = clock
        self._display = Display(outbox.send, clock.factor)
        self._bench = Bench(clock, self._display, outbox.send)

    def serve(self) -> None:
        """Carry out requests until the client leaves."""
        while not self._inbox.leaving.is_set():
            self._attempt("Tare", self._bench.look)
            self._display.look(self._bench.health)
            for request in self._inbox.take_requests():
                self._attempt(type(request).__name__, lambda request=request: self._do(request))
        self._bench.disconnect()

    def _do(self, request: m.Request) -> None:
        match request:
            case m.Connect(uri):
                self._bench.connect(uri)
            case m.Disconnect():
                self._bench.disconnect()
            case m.Tare(duration):
                self._bench.begin_tare(duration)
            case m.AcknowledgeOverloads():
                self._display.acknowledge()
            case m.StartSession():
                self._session(lambda: begin(request, self._bench, self._clock))
            case m.ResumeSession():
                self._session(lambda: resume(request, self._bench, self._clock))
            case m.Stop() | m.Shutdown():
                self._inbox.answer_stop()
                self._bench.end_tare("stopped by the user")
            case _:
                raise NotNow("no session is running")

    def _session(self, prepare: Callable[[], SessionSetup]) -> None:
        """Run a session; afterwards show the transducer again."""
        try:
            run(prepare(), self._bench, self._display, self._inbox, self._send)
        finally:
            self._inbox.answer_stop()
            self._bench.stream()

    def _attempt(self, name: str, work: Callable[[], None]) -> None:
        """Carry out a request; a failure is reported, and ends nothing else."""
        try:
            work()
        except Exception as error:  # noqa: BLE001  a bug must not end the recorder
            kind, from_us = type(error).__name__, is_ours(type(error).__module__)
            sentence = " ".join(str(error).split()) if from_us else f"unexpected {kind} ({error})"
            if isinstance(error, OSError) and error.filename is not None and not from_us:
                sentence = failure_sentence(error)
            self._send(m.Failed(name, sentence, kind))


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
