"""The list of drivers: which name opens what."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivers.address import Address, AddressError, parse_address
from drivers.clock import Clock
from drivers.deadline import Deadline
from drivers.digital_ft.device import identify_digital_ft, open_digital_ft
from drivers.labjack_u6.device import identify_labjack_u6, open_labjack_u6
from drivers.net_ft.handshake import identify_net_ft, open_net_ft
from drivers.nidaq.device import identify_nidaq, open_nidaq
from drivers.serial_ft.device import identify_serial_ft, open_serial_ft
from drivers.tool import TransducerWithTool, with_tool, without_tool
from drivers.transducer import DeviceFault, LinkLost, SetupError, Transducer, TransducerInfo


@dataclass(frozen=True, slots=True)
class Driver:
    """One way to reach a transducer."""

    name: str  # the scheme of its addresses
    open: Callable[[Address, Clock, Deadline], Transducer]
    identify: Callable[[Address, Deadline], TransducerInfo]  # who answers; changes nothing
    usual: tuple[str, ...]  # addresses where such a device stands unless somebody moved it


@dataclass(frozen=True, slots=True)
class Found:
    """What answered at one address: either who, or why nobody did."""

    uri: str
    info: TransducerInfo | None
    problem: str | None


DRIVERS: tuple[Driver, ...] = (
    Driver("net-ft", open_net_ft, identify_net_ft, ("net-ft://192.168.1.1",)),
    Driver("serial-ft", open_serial_ft, identify_serial_ft, ()),
    Driver("digital-ft", open_digital_ft, identify_digital_ft, ()),
    Driver("labjack-u6", open_labjack_u6, identify_labjack_u6, ("labjack-u6://",)),
    Driver("nidaq", open_nidaq, identify_nidaq, ()),
)


def open_transducer(uri: str, clock: Clock) -> Transducer:
    """Return the transducer at `uri`, identified and set as the address asks, not yet streaming.

    Raises SetupError when the address or a setting cannot be met, LinkLost when nothing answers.
    """
    address, tool = without_tool(parse_address(uri))
    transducer = _driver(address).open(address, clock, Deadline.for_opening())
    return TransducerWithTool(transducer, tool) if tool else transducer


def reachable(named: Iterable[str] = (), patience: float = 0.5) -> tuple[Found, ...]:
    """Return what answers now at the usual addresses and at those `named`, within `patience` real seconds each.

    Only reads who is there: a device in use is not disturbed.
    """
    usual = [uri for driver in DRIVERS for uri in driver.usual]
    return tuple(_found(uri, patience) for uri in dict.fromkeys([*usual, *named]))


def _found(uri: str, patience: float) -> Found:
    try:
        address, tool = without_tool(parse_address(uri))
        return Found(uri, with_tool(_driver(address).identify(address, Deadline(patience)), tool), None)
    except (SetupError, LinkLost, DeviceFault) as error:
        return Found(uri, None, str(error))


def _driver(address: Address) -> Driver:
    for driver in DRIVERS:
        if driver.name == address.scheme:
            return driver
    known = ", ".join(f"{driver.name}://" for driver in DRIVERS)
    raise AddressError(f"{address.uri}: there is no driver {address.scheme!r}; addresses begin with {known}")
