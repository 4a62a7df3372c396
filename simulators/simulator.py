"""What a module of a simulated device gives: one `SIMULATOR`, how it is started and what can go wrong on its wire."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from drivers.clock import Clock
from simulators.bench import Bench
from simulators.faults import Fault, Faults, Kind

LINE_FAULTS: tuple[Kind, ...] = ("lose", "corrupt", "shorten", "saturate", "unplug", "reboot", "slow")


@dataclass(frozen=True, slots=True)
class Simulated:
    """A simulated device that runs."""

    uri: str  # the address that opens it
    bench: Bench  # what it feels
    now: Callable[[], float]  # its time and the bench's [s]
    close: Callable[[], None]  # takes it away
    open_handles: Callable[[], int] = lambda: (
        0
    )  # handles that somebody has on it, where there are some beyond open files
    forget: Callable[[], None] = lambda: None  # lets the computer have its own USB and libraries again


Start = Callable[[Bench, Clock, Faults, Path], Simulated]  # in a folder for what it writes


@dataclass(frozen=True, slots=True)
class Simulator:
    """How a simulated device is started, and what can go wrong on its wire."""

    name: str  # of the driver that reads it
    start: Start
    factor: float  # times as fast as real it can run on a computer that has much else to do
    tells: tuple[Kind, ...] = LINE_FAULTS  # faults that can happen on this wire and that a driver can tell
    hides: tuple[Kind, ...] = ("stall",)  # faults that can happen and that no driver can tell
    statuses: tuple[int, ...] = ()  # that its maker's manual lists, to be planted one after the other
    unshown: float = 0.0  # share of damaged records that no check on this wire shows
    serial_line: bool = False  # so that hostile bytes on a line are tried on its driver too
    at_start: bool = False  # a status is sent in full only where it is set when a stream begins


class _Box(Protocol):
    @property
    def uri(self) -> str: ...

    def now(self) -> float: ...

    def start(self) -> None: ...

    def close(self) -> None: ...


def served(make: Callable[[Bench, Clock, Faults], _Box]) -> Start:
    """Return how a box is started that serves on ports of this computer."""

    def start(bench: Bench, clock: Clock, faults: Faults, _: Path) -> Simulated:
        box = make(bench, clock, faults)
        box.start()
        return Simulated(box.uri, bench, box.now, box.close)

    return start


def unplug(faults: Faults) -> Callable[[], None]:
    """Return what takes a device away that serves on no port: its plug is pulled for good."""
    return lambda: faults.put(Fault("unplug", 0.0, 1e9))
