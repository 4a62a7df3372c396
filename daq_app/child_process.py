"""Child processes in Python that import nothing from the current folder and end with their parent.

Python puts the current folder first on the module path of `python -m` and `python -c`, which start the child
processes. A `random.py` among somebody's recordings would run in place of Python's own.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # multiprocessing is slow to import, and most verbs start no process
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.context import SpawnContext
    from multiprocessing.process import BaseProcess
    from multiprocessing.synchronize import Lock

_BELOW = 5  # increment of nice on POSIX
BELOW_NORMAL = 0x4000  # priority class on Windows
MOST_WORKERS = 61  # on Windows, which can wait for no more processes (Python's ProcessPoolExecutor)
COMPILATION = "solver._kernels"  # logger of the warning that loops are compiled
SAFE_PATH = "PYTHONSAFEPATH"  # environment variable with the effect of -P


def keep_current_folder_out() -> None:
    """Remove the folder that Python put first from the module path, here and in every child process.

    Under `python -m daq_app` it is the current folder; the folder that holds the program stays.
    """
    os.environ[SAFE_PATH] = "1"
    if not sys.flags.safe_path and not __file__.startswith(f"{sys.path[0]}{os.sep}daq_app"):
        del sys.path[0]


def use_one_thread() -> None:
    """Run linear algebra in one thread, here and in child processes, unless numpy is already imported.

    The solver's matrices are small: threads only wait for each other (2 to 10 times slower), and change the last bits.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def interpreter(*words: str) -> list[str]:
    """Return the command that starts this Python interpreter with some arguments, for a child process."""
    return [sys.executable, "-P", *words]


def fresh_processes() -> "SpawnContext":
    """Return the context in which multiprocessing spawns each process with a fresh interpreter."""
    from multiprocessing import get_context

    os.environ[SAFE_PATH] = "1"  # multiprocessing cannot pass -P to the interpreter
    use_one_thread()
    return get_context("spawn")


class Child:
    """A process that ends with this one, at the other end of a pipe. No method waits for it."""

    def __init__(self, target: Callable[..., None], *more: object, name: str) -> None:
        """Start the process: `target` gets its end of the pipe, and `more`."""
        context = fresh_processes()
        self._pipe, child_end = context.Pipe()
        self.process: BaseProcess = context.Process(target=target, args=(child_end, *more), daemon=True, name=name)
        self.process.start()
        child_end.close()

    def send(self, message: object) -> None:
        """Send a message. Raises OSError if the process is gone."""
        self._pipe.send(message)

    def receive(self) -> Any:  # noqa: ANN401  any message of the process
        """Return the next message, or None. Raises EOFError or OSError if the process is gone."""
        return self._pipe.recv() if self._pipe.poll() else None

    def close(self) -> None:
        """End the process."""
        self._pipe.close()
        self.process.terminate()


def process_pool(workers: int) -> "ProcessPoolExecutor":
    """Return a pool of processes that leave Ctrl-C to this one and end with it, even if it is killed."""
    from concurrent.futures import ProcessPoolExecutor

    workers = min(workers, MOST_WORKERS) if sys.platform == "win32" else workers
    return ProcessPoolExecutor(workers, fresh_processes(), initializer=_attend_parent, initargs=(_first_message(),))


@cache
def _first_message() -> "Lock":
    """Return what the first process of a command takes that warns of a compilation: the others stay silent."""
    return fresh_processes().Lock()


def _attend_parent(first_message: "Lock") -> None:
    """Ignore Ctrl-C, which the parent handles, end if the parent is killed, and repeat no warning of other workers."""
    import logging  # here, because only workers need it

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    logging.getLogger(COMPILATION).addFilter(lambda _: first_message.acquire(block=False))


def _end_with_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)  # nobody is left to take a result


def press_ctrl_c() -> None:
    """Interrupt the main thread as Ctrl-C does, which also ends its sleep on systems that allow it."""
    main_thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main_thread is not None:
        signal.pthread_kill(main_thread, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


def give_way() -> None:
    """Lower this process's priority below recorder and window; if the system refuses, do nothing."""
    if sys.platform == "win32":
        import ctypes

        kernel = ctypes.windll.kernel32
        kernel.SetPriorityClass(kernel.GetCurrentProcess(), BELOW_NORMAL)
    else:
        os.nice(_BELOW)
