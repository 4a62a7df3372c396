"""The other end of every driver: the list of simulated devices, by the name of the driver that reads them.

A test that is run on every driver takes them from here. A driver that is added to `drivers.catalog` gets a line here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from drivers import usb_link
from drivers.clock import Clock
from simulators.bench import Bench
from simulators.digital_ft_box import DigitalFtBox
from simulators.faults import Fault, Faults, Kind
from simulators.gauges import calibration_file
from simulators.labjack_u6_box import LabJackU6Box
from simulators.net_ft_box import NetFtBox
from simulators.nidaq_library import SimulatedNidaqmx
from simulators.serial_ft_box import SerialFtBox
from simulators.usb_backend import SimulatedBus


@dataclass(frozen=True, slots=True)
class Simulated:
    """A simulated device that runs."""

    uri: str  # the address that opens it
    bench: Bench  # what it feels
    now: Callable[[], float]  # its time and the bench's [s]
    close: Callable[[], None]  # takes it away
    held: Callable[[], int] = lambda: 0  # handles that somebody has on it, where there are some beyond open files
    forget: Callable[[], None] = lambda: None  # lets the computer have its own USB and libraries again


Start = Callable[[Bench, Clock, Faults, Path], Simulated]  # in a folder for what it writes


@dataclass(frozen=True, slots=True)
class Simulator:
    """How a simulated device is started, and what can go wrong on its wire."""

    start: Start
    factor: float  # times as fast as real it can run on a computer that has much else to do
    tells: tuple[Kind, ...]  # faults that can happen on this wire and that a driver can tell
    hides: tuple[Kind, ...] = ()  # faults that can happen and that no driver can tell: nothing on the wire shows them
    statuses: tuple[int, ...] = ()  # that its maker's manual lists, to be planted one after the other
    at_start: bool = False  # a status can only be told in full where it is set when a stream begins


_LINE: tuple[Kind, ...] = ("lose", "corrupt", "shorten", "saturate", "unplug", "reboot", "slow")
_NETWORK: tuple[Kind, ...] = ("repeat", "reorder", "delay", "stall")


def _net_ft(bench: Bench, clock: Clock, faults: Faults, _: Path) -> Simulated:
    box = NetFtBox(bench, clock, faults=faults, first_tick=10_000_000)  # on since long before
    box.start()
    return Simulated(box.uri, bench, box.now, box.close)


def _serial_ft(bench: Bench, clock: Clock, faults: Faults, _: Path) -> Simulated:
    box = SerialFtBox(bench, clock, faults=faults)
    box.start()
    return Simulated(box.uri, bench, box.now, box.close)


def _digital_ft(bench: Bench, clock: Clock, faults: Faults, _: Path) -> Simulated:
    box = DigitalFtBox(bench, clock, faults=faults)
    box.start()
    return Simulated(box.uri, bench, box.now, box.close)


def _labjack_u6(bench: Bench, clock: Clock, faults: Faults, folder: Path) -> Simulated:
    box = LabJackU6Box(bench, clock, faults=faults)
    bus = SimulatedBus([box])
    usb_link.BACKEND = bus
    uri = f"labjack-u6://?rate=300&cal={calibration_file(folder, f'SIM{bench.seed:05d}')}"

    def pull() -> None:
        faults.put(Fault("unplug", 0.0, 1e9))

    def forget() -> None:
        usb_link.BACKEND = None

    return Simulated(uri, bench, box.now, pull, bus.held, forget)


def _nidaq(bench: Bench, clock: Clock, faults: Faults, folder: Path) -> Simulated:
    library = SimulatedNidaqmx(bench, clock, faults)
    library.install()
    uri = f"nidaq://Dev1?cal={calibration_file(folder, f'SIM{bench.seed:05d}')}"

    def pull() -> None:
        faults.put(Fault("unplug", 0.0, 1e9))

    return Simulated(uri, bench, library.now, pull, lambda: library.open, library.remove)


_ERROR = 1 << 31  # the networked box sets it beside any other
_BITS = (*range(1, 15), *range(16, 31))
_DIGITAL = (*range(6), 7, *range(8, 14))
_CODES = (54, 55, 63)  # in a stream of a converter

SIMULATORS: Mapping[str, Simulator] = {
    "net-ft": Simulator(_net_ft, 10.0, (*_NETWORK, *_LINE), statuses=tuple(_ERROR | 1 << n for n in _BITS)),
    "serial-ft": Simulator(_serial_ft, 2.0, _LINE, hides=("stall",), statuses=tuple(range(1, 10))),
    "digital-ft": Simulator(
        _digital_ft, 0.4, _LINE, hides=("stall",), statuses=(sum(1 << n for n in _DIGITAL),), at_start=True
    ),
    "labjack-u6": Simulator(_labjack_u6, 2.0, _LINE, hides=("stall",), statuses=_CODES),
    "nidaq": Simulator(_nidaq, 1.0, ("lose", "saturate", "unplug", "reboot", "slow"), hides=("stall",)),
}
