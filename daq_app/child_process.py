"""How every Python process of the program starts: safe from the current folder, ended with the one that started it.

Python itself puts the current folder first on the path of `python -m` and `python -c`, which is how child processes
begin. A `random.py` that lies among somebody's recordings would be run in place of Python's own.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # multiprocessing takes a while to import, and most verbs start no process
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.context import SpawnContext
    from multiprocessing.process import BaseProcess

_BELOW = 5  # on POSIX, nice's steps towards the end of the queue
BELOW_NORMAL = 0x4000  # on Windows, its name for the same
MOST_WORKERS = 61  # on Windows, which waits for no more processes at once (Python's ProcessPoolExecutor)
SAFE_PATH = "PYTHONSAFEPATH"  # a Python that finds this in its environment starts as with -P


def keep_current_folder_out() -> None:
    """Take the folder that Python put first off the module path, and keep it off that of every child process.

    It is the current folder under `python -m daq_app`; the folder that holds the program itself stays.
    """
    os.environ[SAFE_PATH] = "1"
    if not sys.flags.safe_path and not __file__.startswith(f"{sys.path[0]}{os.sep}daq_app"):
        del sys.path[0]


def use_one_thread() -> None:
    """Let linear algebra run in one thread, here and in child processes, where numpy was not imported before.

    The solver's matrices are small: threads only wait for each other (2 to 10 times slower), and change the last bits.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def interpreter(*words: str) -> list[str]:
    """Return the command that starts this Python with some words, for a child process."""
    return [sys.executable, "-P", *words]


def fresh_processes() -> "SpawnContext":
    """Return the context in which pools and processes of multiprocessing start, each with a Python of its own."""
    from multiprocessing import get_context

    os.environ[SAFE_PATH] = "1"  # multiprocessing takes no option for the Python that it starts
    use_one_thread()
    return get_context("spawn")


class Child:
    """A process that ends with this one, at the other end of a pipe. Nothing here waits for it."""

    def __init__(self, target: Callable[..., None], *more: object, name: str) -> None:
        """Start it: `target` gets its end of the pipe, and `more`."""
        context = fresh_processes()
        self._pipe, child_end = context.Pipe()
        self.process: BaseProcess = context.Process(target=target, args=(child_end, *more), daemon=True, name=name)
        self.process.start()
        child_end.close()

    def send(self, message: object) -> None:
        """Send a message. Raises OSError where the process is gone."""
        self._pipe.send(message)

    def receive(self) -> Any:  # noqa: ANN401  whatever the process sends
        """Return the next message, None where none has come. Raises EOFError or OSError where the process is gone."""
        return self._pipe.recv() if self._pipe.poll() else None

    def close(self) -> None:
        """End it."""
        self._pipe.close()
        self.process.terminate()


def process_pool(workers: int) -> "ProcessPoolExecutor":
    """Return a pool of processes that leave Ctrl-C to this one and end with it, however it ends."""
    from concurrent.futures import ProcessPoolExecutor

    workers = min(workers, MOST_WORKERS) if sys.platform == "win32" else workers
    return ProcessPoolExecutor(workers, fresh_processes(), initializer=_attend_parent)


def _attend_parent() -> None:
    """Leave Ctrl-C to the process that was asked to stop, and end where that one was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)  # nobody is left to hand anything to


def press_ctrl_c() -> None:
    """Send the main thread what Ctrl-C sends it, which also ends its sleep where the system can."""
    main_thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main_thread is not None:
        signal.pthread_kill(main_thread, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


def give_way() -> None:
    """Let this process go behind recorder and window; where the system refuses, nothing happens."""
    if sys.platform == "win32":
        import ctypes

        kernel = ctypes.windll.kernel32
        kernel.SetPriorityClass(kernel.GetCurrentProcess(), BELOW_NORMAL)
    else:
        os.nice(_BELOW)
