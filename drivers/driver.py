"""What a driver's folder gives: one `DRIVER` in its `__init__.py`."""

from collections.abc import Callable
from dataclasses import dataclass

from drivers.address import Address
from drivers.clock import Clock
from drivers.deadline import Deadline
from drivers.transducer import Transducer, TransducerInfo


@dataclass(frozen=True, slots=True)
class Driver:
    """One way to reach a transducer."""

    name: str  # the scheme of its addresses
    open: Callable[[Address, Clock, Deadline], Transducer]
    identify: Callable[[Address, Deadline], TransducerInfo]  # who answers; changes nothing
    usual: tuple[str, ...] = ()  # addresses where such a device stands unless somebody moved it
