"""The compiled loops of the solver (numba, cached on disk). No other module is compiled.

Tests compare the loops with plain NumPy versions.
"""

import gc
import signal
import threading
from contextlib import ExitStack
from functools import cache
from types import FrameType
from typing import Any

from solver._kernels.compiling import events
from solver.progress import interlude


class _Compilation(events.Listener):
    """Report which loop numba compiles, and deliver a Ctrl-C that arrives during the compilation.

    Python raises KeyboardInterrupt between two bytecodes. Where LLVM calls back into Python, the exception is printed
    and lost, so it is raised again once the loop is compiled.
    """

    def __init__(self) -> None:
        self._count = 0
        self._open: ExitStack | None = None
        self._loop: object = None
        self._stopped = False

    def on_start(self, event: Any) -> None:  # noqa: ANN401 - numba declares no types
        """Report the loop whose compilation starts, unless it is part of another loop's compilation."""
        loop = event.data["dispatcher"]
        if self._open is not None or loop.py_func.__module__.rpartition(".")[0] != __name__:
            return
        _warn()
        self._count += 1
        self._loop, self._open = loop, ExitStack()
        doing = f"compiling {loop.py_func.__name__}, loop number {self._count}, once on this machine"
        self._open.enter_context(interlude(doing))
        if gc.isenabled():  # numba makes millions of permanent objects: scanning them costs a sixth of the time
            gc.disable()
            self._open.callback(gc.enable)
        self._hear_ctrl_c()

    def on_end(self, event: Any) -> None:  # noqa: ANN401 - numba declares no types
        """Restore the previous progress report; raise KeyboardInterrupt if Ctrl-C came during the compilation."""
        if self._open is None or event.data["dispatcher"] is not self._loop:
            return
        opened, self._open = self._open, None
        opened.close()
        if self._stopped:
            self._stopped = False
            raise KeyboardInterrupt

    def _hear_ctrl_c(self) -> None:
        in_main = threading.current_thread() is threading.main_thread()
        if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler or self._open is None:
            return

        def stop(number: int, frame: FrameType | None) -> None:
            self._stopped = True
            signal.default_int_handler(number, frame)

        signal.signal(signal.SIGINT, stop)
        self._open.callback(signal.signal, signal.SIGINT, signal.default_int_handler)


@cache
def _warn() -> None:
    """Log, once per process, why the first run takes longer."""
    import logging

    logging.getLogger(__name__).warning("Compiling the loops, once on this machine: half a minute if it is not busy.")


events.register("numba:compile", _Compilation())
