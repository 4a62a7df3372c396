"""The list of drivers, read from the folders, and opening of transducers by address."""

import pkgutil
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module

import drivers
from drivers.address import Address, AddressError, Driver, parse_address, with_tool, without_tool
from drivers.clock import Clock
from drivers.deadline import Deadline
from drivers.transducer import DeviceFault, LinkLost, SetupError, Transducer, TransducerInfo, WrappedTransducer


@dataclass(frozen=True, slots=True)
class Probe:
    """The result of probing one address: the transducer, or why none answered."""

    uri: str
    info: TransducerInfo | None
    problem: str | None


# Each folder of this package is a driver.
DRIVERS: tuple[Driver, ...] = tuple(
    import_module(f"drivers.{module.name}").DRIVER for module in pkgutil.iter_modules(drivers.__path__) if module.ispkg
)


def open_transducer(uri: str, clock: Clock, *other_schemes: str) -> Transducer:
    """Return the transducer at `uri`, identified and set up by its address, not yet streaming.

    The caller itself opens addresses of `other_schemes`; messages name them. Raises SetupError when the address or a
    setting is not possible, LinkLost when nothing answers.
    """
    address, tool = without_tool(parse_address(uri))
    transducer = _driver(address, *other_schemes).open(address, clock, Deadline.for_opening())
    return WrappedTransducer(transducer, with_tool(transducer.info, tool)) if tool else transducer


def reachable(uris: Iterable[str] = (), patience: float = 0.5) -> tuple[Probe, ...]:
    """Return a probe of each usual address and of `uris`, within `patience` [s] each; disturbs no device."""
    usual = [uri for driver in DRIVERS for uri in driver.usual]
    return tuple(_probe(uri, patience) for uri in dict.fromkeys([*usual, *uris]))


def _probe(uri: str, patience: float) -> Probe:
    try:
        address, tool = without_tool(parse_address(uri))
        return Probe(uri, with_tool(_driver(address).identify(address, Deadline(patience)), tool), None)
    except (SetupError, LinkLost, DeviceFault) as error:
        return Probe(uri, None, str(error))


def _driver(address: Address, *other_schemes: str) -> Driver:
    for driver in DRIVERS:
        if driver.name == address.scheme:
            return driver
    schemes = ", ".join((*(f"{driver.name}://" for driver in DRIVERS), *other_schemes))
    raise AddressError(f"there is no driver {address.scheme!r} for {address.uri}; addresses begin with {schemes}")
