"""A simulated device: how it starts, the thread and serial line it is served on, and what can go wrong on its wire."""

import contextlib
import os
import select
import shutil
import struct
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from drivers.clock import Clock
from drivers.transducer import SetupError
from simulators.bench import Bench
from simulators.faults import Fault, Faults, Kind

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
        self._buffer = bytearray()
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
        import fcntl  # these exist where pseudo-terminals do
        import termios
        import tty

        if self.is_plugged:
            return
        self._ours, self._theirs = os.openpty()  # theirs stays open too, or the port would hang up between two readers
        tty.setraw(self._theirs)
        fcntl.ioctl(self._ours, termios.TIOCPKT, struct.pack("i", 1))  # what is read begins with a byte of control
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
        self._buffer.clear()

    def receive(self, timeout: float) -> bytes:
        """Return what the other side has sent, waiting up to `timeout` real seconds for it."""
        self._obey()
        self._flush()
        ready, _, _ = select.select([self._ours], [], [], timeout)
        return self._read() if ready else b""

    def send(self, data: bytes) -> None:
        """Send `data`. What the other side has not read beyond ROOM bytes is lost, as on a line."""
        self._obey()
        self._buffer += data[: max(ROOM - len(self._buffer), 0)]
        self._flush()

    def _read(self) -> bytes:
        """Return what was sent; where a reader threw away what had come for it, as on opening, so is what waits."""
        import termios  # exists where pseudo-terminals do

        try:
            data = os.read(self._ours, 4096)
        except OSError:
            return b""
        if data[:1] == b"\0":
            return data[1:]
        if data and data[0] & termios.TIOCPKT_FLUSHREAD:
            self._buffer.clear()
        return b""

    def _obey(self) -> None:
        """Read a byte of control, where there is one."""
        if self.is_plugged and select.select([], [], [self._ours], 0.0)[2]:
            self._read()

    def _flush(self) -> None:
        """Pass on what the system's own few kilobytes have room for."""
        with contextlib.suppress(OSError):
            del self._buffer[: os.write(self._ours, self._buffer)]

    def close(self) -> None:
        """Remove the port. Harmless when repeated."""
        self.unplug()
        shutil.rmtree(self._folder, ignore_errors=True)


def stopwatch(clock: Clock) -> Callable[[], float]:
    """Return a function that returns the time [s] of a clock since now."""
    origin_ns = clock.now_ns()
    return lambda: (clock.now_ns() - origin_ns) * 1e-9


class ServedBox:
    """One box. Its time, and the bench's, begins when it is started."""

    now: Callable[[], float]  # [s]; from `serve` on

    def __init__(self, clock: Clock, faults: Faults | None) -> None:
        self.clock = clock
        self.faults = faults or Faults()
        self.closing = threading.Event()
        self._thread: threading.Thread | None = None

    def serve(self, work: Callable[[], None], name: str) -> None:
        """Let time begin, and a thread work until `closing` is set."""
        self.now = stopwatch(self.clock)
        self._thread = threading.Thread(target=work, name=f"simulated {name}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Switch the box off. Harmless when repeated."""
        self.closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None


_NAP = 0.01  # of a box without its line or its power [real s]


class LineBox(ServedBox):
    """One box on a line."""

    is_on: bool  # by `power_up`; False: without power

    def __init__(self, name: str, clock: Clock, faults: Faults | None) -> None:
        """Set up a box whose port's path ends with `name`."""
        super().__init__(clock, faults)
        self._name = name
        self._port: PseudoTerminal | None = None

    @property
    def path(self) -> str:
        """Path of the port; known once the box is started."""
        assert self._port is not None
        return self._port.path

    def start(self) -> None:
        """Make the port and begin to serve. Raises SetupError where there are no pseudo-terminals."""
        port = self._port = PseudoTerminal(self._name)
        self.serve(lambda: self._serve(port), self._name)

    def close(self) -> None:
        super().close()
        if self._port is not None:
            self._port.close()

    def _serve(self, port: PseudoTerminal) -> None:
        """Be the box until closed: unplugged, without power, powered up again, or at work."""
        while not self.closing.is_set():
            now = self.now()
            if self.faults.active("unplug", now):
                port.unplug()
                self.closing.wait(_NAP)
                continue
            port.plug_in()
            if self.faults.active("reboot", now):
                self.is_on = False
                port.receive(_NAP)
                continue
            if not self.is_on:
                self.power_up(now)
            self.work(port, now)

    def power_up(self, now: float) -> None:
        """Forget what is not kept over power-off; the box is on."""
        raise NotImplementedError

    def work(self, port: PseudoTerminal, now: float) -> None:
        """Send what is due, then listen for a short while and answer."""
        raise NotImplementedError


LINE_FAULTS: tuple[Kind, ...] = ("lose", "corrupt", "shorten", "saturate", "unplug", "reboot", "slow")


@dataclass(frozen=True, slots=True)
class RunningSimulator:
    """A simulated device that runs, and how to reach and to stop it."""

    uri: str  # the address that opens it
    bench: Bench  # what it feels
    now: Callable[[], float]  # its time and the bench's [s]
    close: Callable[[], None]  # takes it away
    open_handles: Callable[[], int] = lambda: 0  # that somebody has on it, where there are some beyond open files
    forget: Callable[[], None] = lambda: None  # lets the computer have its own USB and libraries again


Start = Callable[..., RunningSimulator]  # takes bench, clock, faults, a folder for what it writes, and own settings


@dataclass(frozen=True, slots=True)
class Simulator:
    """How a simulated device is started, and what can go wrong on its wire."""

    name: str  # of the driver that reads it
    start: Start
    factor: float  # times as fast as real it can run on a computer that has much else to do
    tells: tuple[Kind, ...] = LINE_FAULTS  # faults that can happen on this wire and that a driver can notice
    hides: tuple[Kind, ...] = ("stall",)  # faults that can happen and that no driver can tell
    statuses: tuple[int, ...] = ()  # that its maker's manual lists, to be set one after the other
    unshown: float = 0.0  # share of damaged records that no check on this wire shows
    on_ports: bool = True  # of this computer, so that any program can open it (`daq-app simulate`)
    at_start: bool = False  # a status is sent in full only where it is set when a stream begins


class _Box(Protocol):
    @property
    def uri(self) -> str: ...

    def now(self) -> float: ...

    def start(self) -> None: ...

    def close(self) -> None: ...


def serve_on_ports(make: Callable[..., _Box]) -> Start:
    """Return the function that starts a box with ports of its own; `make` takes bench, clock, `faults` and settings."""

    def start(bench: Bench, clock: Clock, faults: Faults, _: Path, **settings: object) -> RunningSimulator:
        box = make(bench, clock, faults=faults, **settings)
        box.start()
        return RunningSimulator(box.uri, bench, box.now, box.close)

    return start


def unplug(faults: Faults) -> Callable[[], None]:
    """Return what takes a device away that serves on no port: its plug is pulled for good."""
    return lambda: faults.put(Fault("unplug", 0.0, 1e9))
