"""A simulated device: its start, its thread, its serial line, and the faults on its wire."""

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

from drivers.clock import Clock
from drivers.transducer import SetupError
from simulators.bench import Bench
from simulators.faults import Fault, Faults, Kind

ROOM = 65536  # buffer for a late reader, as in a computer's serial driver [bytes]


class PseudoTerminal:
    """A pair of ends that can be unplugged and plugged in again under the same path. Linux and macOS only."""

    def __init__(self, name: str) -> None:
        """Create the port, plugged in, at a path that ends with `name`. Raises SetupError on other systems."""
        if os.name != "posix":
            raise SetupError("a simulated serial port needs Linux or macOS; use the sim: address on this computer")
        self._folder = Path(tempfile.mkdtemp(prefix="daq-app-"))
        self.path = str(self._folder / name)
        self._ours = self._theirs = -1
        self._buffer = bytearray()
        self.plug_in()

    @property
    def is_plugged(self) -> bool:
        """Whether the port is plugged in."""
        return self._ours >= 0

    @property
    def baud(self) -> int:
        """Baud rate of the other end [bits a second]; 0 for an unusual one."""
        import termios  # exists where pseudo-terminals do

        code: int = termios.tcgetattr(self._theirs)[5]
        usual = (300, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400)
        return next((baud for baud in usual if getattr(termios, f"B{baud}", None) == code), 0)

    def plug_in(self) -> None:
        """Plug the port in (again), in raw mode."""
        import fcntl  # these exist where pseudo-terminals do
        import termios
        import tty

        if self.is_plugged:
            return
        self._ours, self._theirs = os.openpty()  # theirs stays open too, or the port would hang up between readers
        tty.setraw(self._theirs)
        fcntl.ioctl(self._ours, termios.TIOCPKT, struct.pack("i", 1))  # each read begins with a control byte
        os.set_blocking(self._ours, False)
        Path(self.path).unlink(missing_ok=True)
        Path(self.path).symlink_to(os.ttyname(self._theirs))

    def unplug(self) -> None:
        """Remove the port while others may have it open."""
        if not self.is_plugged:
            return
        Path(self.path).unlink(missing_ok=True)
        os.close(self._theirs)
        os.close(self._ours)
        self._ours = self._theirs = -1
        self._buffer.clear()

    def receive(self, timeout: float) -> bytes:
        """Return bytes from the other side, waiting up to `timeout` real seconds."""
        self._obey()
        self._flush()
        ready, _, _ = select.select([self._ours], [], [], timeout)
        return self._read() if ready else b""

    def send(self, data: bytes) -> None:
        """Send `data`. Unread bytes beyond `ROOM` are lost, as on a line."""
        self._obey()
        self._buffer += data[: max(ROOM - len(self._buffer), 0)]
        self._flush()

    def _read(self) -> bytes:
        """Return bytes from the other side; where a reader flushes its input, as on opening, clear the buffer."""
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
        """Read a control byte, if there is one."""
        if self.is_plugged and select.select([], [], [self._ours], 0.0)[2]:
            self._read()

    def _flush(self) -> None:
        """Pass on as many bytes as the system's buffer takes."""
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
    """One box. Its time and the bench's begin when it is started."""

    uri: str  # its address; from `start` on
    now: Callable[[], float]  # [s]; from `serve` on

    def __init__(self, clock: Clock, faults: Faults | None) -> None:
        self.clock = clock
        self.faults = faults or Faults()
        self.closing = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Open the ports and begin to serve. Raises SetupError where that is not possible."""
        raise NotImplementedError

    def serve(self, work: Callable[[], None], name: str) -> None:
        """Start the time, and a thread that works until `closing` is set."""
        self.now = stopwatch(self.clock)
        self._thread = threading.Thread(target=work, name=f"simulated {name}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Switch the box off. Harmless when repeated."""
        self.closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None


_NAP = 0.01  # of a box without line or power [real s]


class LineBox(ServedBox):
    """One box on a line."""

    is_on: bool  # set by `power_up`; False: without power

    def __init__(self, name: str, clock: Clock, faults: Faults | None) -> None:
        """Set up a box whose port's path ends with `name`."""
        super().__init__(clock, faults)
        self._name = name
        self._port: PseudoTerminal | None = None

    def start(self) -> None:
        port = self._port = PseudoTerminal(self._name)
        self.uri = self.address(port.path)
        self.serve(lambda: self._serve(port), self._name)

    def close(self) -> None:
        super().close()
        if self._port is not None:
            self._port.close()

    def _serve(self, port: PseudoTerminal) -> None:
        """Run the box until closed: unplugged, without power, powered up again, or at work."""
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

    def address(self, path: str) -> str:
        """Return the address of a box whose port has this path."""
        raise NotImplementedError

    def power_up(self, now: float) -> None:
        """Reset everything that is lost at power-off; the box is then on."""
        raise NotImplementedError

    def work(self, port: PseudoTerminal, now: float) -> None:
        """Send due bytes, then listen briefly and answer."""
        raise NotImplementedError


LINE_FAULTS: tuple[Kind, ...] = ("lose", "corrupt", "shorten", "saturate", "unplug", "reboot", "slow")


@dataclass(frozen=True, slots=True)
class RunningSimulator:
    """A running simulated device, with its address and its stop."""

    uri: str  # the address that opens it
    bench: Bench  # the simulated bench
    now: Callable[[], float]  # time of the device and the bench [s]
    close: Callable[[], None]  # removes it
    open_handles: Callable[[], int] = lambda: 0  # on it, other than open files
    forget: Callable[[], None] = lambda: None  # restores the computer's own USB and libraries


Start = Callable[..., RunningSimulator]  # takes bench, clock, faults, a folder for its files, and its settings


@dataclass(frozen=True, slots=True)
class Simulator:
    """Start of a simulated device, and possible faults on its wire."""

    name: str  # of the driver that reads it
    start: Start
    factor: float  # time relative to real time that it sustains on a busy computer
    tells: tuple[Kind, ...] = LINE_FAULTS  # possible faults on this wire that a driver can detect
    hides: tuple[Kind, ...] = ("stall",)  # possible faults that no driver can detect
    statuses: tuple[int, ...] = ()  # listed in the maker's manual, to be set in turn
    unshown: float = 0.0  # share of damaged records that no check on this wire detects
    on_ports: bool = True  # of this computer, so that any program can open it (`daq-app simulate`)
    at_start: bool = False  # a status is sent in full only if set when a stream begins


def serve_on_ports(make: Callable[..., ServedBox]) -> Start:
    """Return the start function of a box with its own ports; `make` takes bench, clock, `faults` and settings."""

    def start(bench: Bench, clock: Clock, faults: Faults, _: Path, **settings: object) -> RunningSimulator:
        box = make(bench, clock, faults=faults, **settings)
        box.start()
        return RunningSimulator(box.uri, bench, box.now, box.close)

    return start


def unplug(faults: Faults) -> Callable[[], None]:
    """Return the stop function of a device without ports, which unplugs it for good."""
    return lambda: faults.put(Fault("unplug", 0.0, 1e9))
