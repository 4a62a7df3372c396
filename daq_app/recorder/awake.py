"""Keeps the computer from going to sleep while a session is recorded, where the system lets a program ask for it."""

import os
import shutil
import subprocess
import sys
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress

WHY = "a session is being recorded"
# For SetThreadExecutionState of Windows: until the next call; the system must stay on (its screen may not).
CONTINUOUS, SYSTEM_REQUIRED = 0x8000_0000, 0x0000_0001


@contextmanager
def awake() -> Generator[bool]:
    """Hold the computer awake while inside; True where the system was asked, which it may still refuse.

    What is asked for ends with this process, however it ends. A lid that is closed or an empty battery wins.
    """
    if sys.platform == "win32":
        yield _windows(CONTINUOUS | SYSTEM_REQUIRED)
        _windows(CONTINUOUS)
        return
    command = holder(os.getpid(), sys.platform)
    if command is None or shutil.which(command[0]) is None:
        yield False
        return
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
    except OSError:
        yield False
        return
    try:
        yield True
    finally:
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(1.0)


def holder(pid: int, system: str) -> Sequence[str] | None:
    """Return a command that holds the computer awake as long as the process `pid` lives; None where none is known.

    >>> holder(7, "darwin")
    ('caffeinate', '-i', '-w', '7')
    """
    if system == "darwin":
        return "caffeinate", "-i", "-w", str(pid)
    if system == "linux":  # tail ends with the process it watches: nothing is left behind by a crash
        options = ("--what=sleep:idle", "--who=daq-app", f"--why={WHY}", "--mode=block")
        return "systemd-inhibit", *options, "tail", f"--pid={pid}", "-f", "/dev/null"
    return None


def _windows(state: int) -> bool:
    import ctypes

    windows = getattr(ctypes, "windll", None)
    return windows is not None and windows.kernel32.SetThreadExecutionState(state) != 0
