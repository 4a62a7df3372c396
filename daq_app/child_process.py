"""How every Python process of the program starts: none looks for modules in the current folder.

Python itself puts that folder first on the path of `python -m` and `python -c`, which is how child processes begin. A
`random.py` that lies among somebody's recordings would be run in place of Python's own.
"""

import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from multiprocessing.context import SpawnContext

SAFE_PATH = "PYTHONSAFEPATH"  # a Python that finds this in its environment starts as with -P


def keep_current_folder_out() -> None:
    """Take the folder that Python put first off the module path, and keep it off that of every child process.

    It is the current folder under `python -m daq_app`; the folder that holds the program itself stays.
    """
    os.environ[SAFE_PATH] = "1"
    if not sys.flags.safe_path and not __file__.startswith(f"{sys.path[0]}{os.sep}daq_app"):
        del sys.path[0]


def interpreter(*words: str) -> list[str]:
    """Return the command that starts this Python with some words, for a child process."""
    return [sys.executable, "-P", *words]


def fresh_processes() -> "SpawnContext":
    """Return the context in which pools and processes of multiprocessing start, each with a Python of its own."""
    from multiprocessing import get_context  # which takes a while to import, and most verbs start none

    os.environ[SAFE_PATH] = "1"  # multiprocessing takes no option for the Python that it starts
    return get_context("spawn")
