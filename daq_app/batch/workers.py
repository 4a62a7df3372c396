"""Processes of a pool that do not outlive the one that started them."""

import multiprocessing
import os
import signal
import threading


def attend() -> None:
    """Leave Ctrl-C to the process that was asked to stop, and end where that one was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)  # nobody is left to hand anything to
