"""The analyst's work in a process of its own, and its client in the window."""

import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from daq_app.analyst import Cancelled, Message, Problem, Step, Write, Written

Connection = Any  # one end of a pipe; its type is another one on each system


def run(connection: Connection, folder: str) -> None:
    """Analyse and predict the session in `folder`, then write what is asked for until the window is gone."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What is half written is taken back before the end.
    signal.signal(signal.SIGTERM, _leave)
    from daq_app.analyst_work import Work, sentence_of

    def say(message: Message) -> None:
        connection.send(message)

    with suppress(EOFError, OSError):
        try:
            work = Work(Path(folder), say)
        except Exception as error:  # noqa: BLE001  whatever it is, the window is told and stays
            say(Problem(sentence_of(error)))
            return
        while True:
            asked: Write = connection.recv()
            try:
                say(Written(work.write(asked)))
            except Exception as error:  # noqa: BLE001  likewise
                say(Problem(sentence_of(error)))


def _leave(_signal: int, _frame: object) -> None:
    sys.exit(0)


class Analyst:
    """The work as the window sees it: nothing here waits."""

    def __init__(self, folder: Path) -> None:
        """Begin with a session."""
        self._folder = folder
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._start()

    def poll(self) -> tuple[Message, ...]:
        """Return what came since the last call."""
        said: list[Message] = []
        while self._connection is not None:
            try:
                if not self._connection.poll():
                    break
                said.append(self._connection.recv())
            except (EOFError, OSError):
                self._gone()
                if not said or not isinstance(said[-1], Problem):
                    said.append(Problem("The work has stopped without a word; open the session again."))
        return tuple(said)

    def write(self, asked: Write) -> None:
        """Ask for a file; where the work was stopped before, it is done again first."""
        if self._connection is None:
            self._start()
        assert self._connection is not None
        self._connection.send(asked)

    def cancel(self) -> Cancelled:
        """Stop what is being done, at once."""
        if self._process is not None:
            self._process.terminate()
        self._gone()
        return Cancelled()

    close = cancel

    def _start(self) -> None:
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        self._process = context.Process(target=run, args=(theirs, str(self._folder)), daemon=True, name="analyst")
        self._process.start()
        theirs.close()
        self._connection = ours

    def _gone(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._process = self._connection = None


def timed(say: Callable[[Message], None], words: str) -> Callable[[float], bool]:
    """Return a listener to progress that says the part done and the time left."""
    began = time.monotonic()

    def told(part: float) -> bool:
        took = time.monotonic() - began
        say(Step(part, words, took * (1.0 - part) / part if part > 0.05 and took > 1.0 else None))
        return True

    return told
