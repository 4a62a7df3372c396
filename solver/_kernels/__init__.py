"""The compiled loops of the solver, and the only modules that are compiled (numba, cached on disk).

The tests hold a plain twin of them in NumPy, and compare the two.
"""

import gc
import signal
import threading
from contextlib import ExitStack
from functools import cache
from types import FrameType
from typing import Any

from solver._kernels.compiling import events
from solver.progress import aside


class _Compilation(events.Listener):
    """Says which loop is being compiled, and makes sure that Ctrl-C is not lost meanwhile.

    Python delivers Ctrl-C between two of its own steps. One that comes while LLVM calls Python is printed and lost, so
    it is raised once more when the loop is compiled.
    """

    def __init__(self) -> None:
        """Listen to nothing yet."""
        self._count = 0
        self._open: ExitStack | None = None
        self._loop: object = None
        self._stopped = False

    def on_start(self, event: Any) -> None:  # noqa: ANN401 - numba declares no types
        """Report the loop whose compilation begins, unless it is part of another's."""
        loop = event.data["dispatcher"]
        if self._open is not None or loop.py_func.__module__.rpartition(".")[0] != __name__:
            return
        _warn()
        self._count += 1
        self._loop, self._open = loop, ExitStack()
        doing = f"compiling {loop.py_func.__name__}, loop number {self._count}, once on this machine"
        self._open.enter_context(aside(doing))
        if gc.isenabled():  # numba makes millions of objects that stay: to look through them is a sixth of its time
            gc.disable()
            self._open.callback(gc.enable)
        self._hear_ctrl_c()

    def on_end(self, event: Any) -> None:  # noqa: ANN401 - numba declares no types
        """Report again what was reported before; raise KeyboardInterrupt where Ctrl-C came meanwhile."""
        if self._open is None or event.data["dispatcher"] is not self._loop:
            return
        opened, self._open = self._open, None
        opened.close()
        if self._stopped:
            self._stopped = False
            raise KeyboardInterrupt

    def _hear_ctrl_c(self) -> None:
        mine = threading.current_thread() is threading.main_thread()
        if not mine or signal.getsignal(signal.SIGINT) is not signal.default_int_handler or self._open is None:
            return

        def stop(number: int, frame: FrameType | None) -> None:
            self._stopped = True
            signal.default_int_handler(number, frame)

        signal.signal(signal.SIGINT, stop)
        self._open.callback(signal.signal, signal.SIGINT, signal.default_int_handler)


@cache
def _warn() -> None:
    """Say, once a process, why the first run ever takes so long."""
    import logging

    logging.getLogger(__name__).warning("Compiling the loops, once on this machine: half a minute if it is not busy.")


events.register("numba:compile", _Compilation())
