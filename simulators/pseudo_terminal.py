"""A serial port that is no hardware: one end for a simulated box, the other for whoever opens its path."""

import contextlib
import os
import select
import shutil
import tempfile
from pathlib import Path

from drivers.transducer import SetupError

ROOM = 65536  # bytes kept for a reader that is late, as much as a computer's serial driver keeps


class PseudoTerminal:
    """A pair of ends that can be pulled apart and plugged in again under the same path. Linux and macOS only."""

    def __init__(self, name: str) -> None:
        """Make the port, plugged in, at a path that ends with `name`. Raises SetupError where there are none."""
        if os.name != "posix":
            raise SetupError("a simulated serial port needs Linux or macOS; use the sim: address on this computer")
        self._folder = Path(tempfile.mkdtemp(prefix="daq-app-"))
        self.path = str(self._folder / name)
        self._ours = self._theirs = -1
        self._waiting = bytearray()
        self.plug_in()

    @property
    def is_plugged(self) -> bool:
        """Whether the port is there."""
        return self._ours >= 0

    @property
    def baud(self) -> int:
        """The rate at which the other side has set its end [bits a second]; 0 where it is none of the usual ones."""
        import termios  # exists where pseudo-terminals do

        code: int = termios.tcgetattr(self._theirs)[5]
        usual = (300, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400)
        return next((baud for baud in usual if getattr(termios, f"B{baud}", None) == code), 0)

    def plug_in(self) -> None:
        """Let the port be there (again), raw."""
        import tty  # exists where pseudo-terminals do

        if self.is_plugged:
            return
        self._ours, self._theirs = os.openpty()  # theirs stays open too, or the port would hang up between two readers
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        Path(self.path).unlink(missing_ok=True)
        Path(self.path).symlink_to(os.ttyname(self._theirs))

    def unplug(self) -> None:
        """Let the port vanish under whoever holds it."""
        if not self.is_plugged:
            return
        Path(self.path).unlink(missing_ok=True)
        os.close(self._theirs)
        os.close(self._ours)
        self._ours = self._theirs = -1
        self._waiting.clear()

    def heard(self, timeout: float) -> bytes:
        """Return what the other side has sent, waiting up to `timeout` real seconds for it."""
        self._flush()
        ready, _, _ = select.select([self._ours], [], [], timeout)
        if not ready:
            return b""
        try:
            return os.read(self._ours, 4096)
        except OSError:
            return b""

    def say(self, data: bytes) -> None:
        """Send `data`. What the other side has not read beyond ROOM bytes is lost, as on a line."""
        self._waiting += data[: max(ROOM - len(self._waiting), 0)]
        self._flush()

    def _flush(self) -> None:
        """Pass on what the system's own few kilobytes have room for."""
        with contextlib.suppress(OSError):
            del self._waiting[: os.write(self._ours, self._waiting)]

    def close(self) -> None:
        """Remove the port. Harmless when repeated."""
        self.unplug()
        shutil.rmtree(self._folder, ignore_errors=True)
