"""Which process goes first where there are too few cores: the recorder and the window, then what explains."""

import os
import sys

BELOW = 5  # on POSIX, nice's steps towards the end of the queue
BELOW_NORMAL = 0x4000  # on Windows, its name for the same


def give_way() -> None:
    """Let this process go behind recorder and window; where the system refuses, nothing happens."""
    if sys.platform == "win32":
        import ctypes

        kernel = ctypes.windll.kernel32
        kernel.SetPriorityClass(kernel.GetCurrentProcess(), BELOW_NORMAL)
    else:
        os.nice(BELOW)
