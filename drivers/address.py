"""Device addresses, scheme://host?option=value&option=value, and the driver that reads one."""

import math
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TypeVar
from urllib.parse import parse_qsl, urlsplit

from drivers.clock import Clock
from drivers.deadline import Deadline
from drivers.notation import number
from drivers.transducer import DeviceFault, LinkLost, SetupError, Transducer, TransducerInfo

Word = TypeVar("Word", bound=str)


class AddressError(SetupError):
    """An invalid address, or an option that this kind of device does not have."""


@dataclass(frozen=True, slots=True)
class Address:
    """The parts of one device address."""

    uri: str  # as typed
    scheme: str  # the driver's name, e.g. "net-ft"
    host: str
    path: str
    options: Mapping[str, str]

    def number(self, option: str, default: int, lowest: int, highest: int) -> int:
        """Return a whole-number option, or `default` where it is not given. Raises AddressError out of range."""
        text = self.options.get(option)
        if text is None:
            return default
        if not (text.isascii() and text.isdecimal() and len(text) < 10 and lowest <= int(text) <= highest):
            raise AddressError(f"{self.uri}: {option}={text} must be a whole number from {lowest} to {highest}")
        return int(text)

    def positive(self, option: str) -> float:
        """Return an option that is a number above 0, nan where it is not given. Raises AddressError."""
        text = self.options.get(option)
        if text is None:
            return math.nan
        value = number(text)
        if not 1e-9 < value < 1e9:
            raise AddressError(f"{self.uri}: {option}={text[:40]} must be a number above 0")
        return value

    def word(self, option: str, choices: tuple[Word, ...]) -> Word:
        """Return an option that is one of `choices`, the first where it is not given. Raises AddressError."""
        text = self.options.get(option, choices[0])
        if text not in choices:
            raise AddressError(f"{self.uri}: {option}={text} must be {' or '.join(choices)}")
        return choices[choices.index(text)]


def parse_address(uri: str) -> Address:
    """Return the parts of `uri`. Raises AddressError when it is not an address.

    >>> parse_address("net-ft://127.0.0.1?rdt=50000&http=8080").options
    {'rdt': '50000', 'http': '8080'}
    """
    try:
        parts = urlsplit(uri)
        port = parts.port
    except ValueError:
        raise AddressError(f"{uri} is not a device address; one looks like net-ft://192.168.1.1") from None
    scheme, marker, _ = uri.partition(":")
    if marker and " " in uri.strip() and uri.isprintable():
        raise AddressError(f"{uri}: a device address holds no space; write %20 for each, in the name of a file too")
    if not marker or not parts.scheme or any(character.isspace() or not character.isprintable() for character in uri):
        raise AddressError(f"{uri!r} is not a device address; one looks like net-ft://192.168.1.1")
    if port is not None:
        raise AddressError(f"{uri}: write the port as an option, for example {scheme}://{parts.hostname}?http={port}")
    if parts.username is not None or parts.fragment:
        raise AddressError(f"{uri}: a device address has neither user names nor '#'")
    pairs = parse_qsl(parts.query, keep_blank_values=True)
    options = dict(pairs)
    if len(options) < len(pairs):
        raise AddressError(f"{uri} gives an option twice; give each once")
    return Address(uri, parts.scheme, parts.hostname or "", parts.path.removesuffix("/"), options)


@contextmanager
def prefix_failures(address: Address) -> Generator[None]:
    """Prefix failures of a link or a device inside with the address."""
    try:
        yield
    except (LinkLost, DeviceFault) as error:
        raise type(error)(f"{address.uri}: {error}") from None


def check_form(address: Address, example: str, option_names: frozenset[str]) -> None:
    """Raise AddressError unless the address has the parts of an example, and no option that is not in `option_names`.

    Where the example has a path, host and path form one name, which is checked on opening.
    """
    form = parse_address(example)
    for part in () if form.path else ("host", "path"):
        text = getattr(address, part)
        if text and not getattr(form, part):
            raise AddressError(
                f"{address.uri}: a {address.scheme} address has no {part} ({text}); write for example {example}"
            )
        if not text and getattr(form, part):
            raise AddressError(f"{address.uri} names no {part}; write for example {example}")
    for option in address.options:
        if option not in option_names:
            names = ", ".join(sorted(option_names | {"tool"}))  # accepted for every transducer, see `without_tool`
            raise AddressError(f"{address.uri}: unknown option {option!r}; allowed are {names}")


@dataclass(frozen=True, slots=True)
class Driver:
    """One way to reach a transducer."""

    name: str  # the scheme of its addresses
    open: Callable[[Address, Clock, Deadline], Transducer]
    identify: Callable[[Address, Deadline], TransducerInfo]  # identity of the device; changes nothing
    usual: tuple[str, ...] = ()  # default addresses of such a device
    serial_line: bool = False  # it reads a serial line, and its addresses name the port


_FARTHEST = 1000.0  # largest accepted displacement [mm]
_MOST = 360.0  # largest accepted angle [degrees]

Tool = tuple[float, ...]  # (6,), or empty for none


def without_tool(address: Address) -> tuple[Address, Tool]:
    """Return the address without its tool option, and the tool transform. Raises AddressError where that is invalid.

    `tool=dx,dy,dz,rx,ry,rz` is the position of the new origin in the transducer's own frame [mm], then the rotations
    about x, y and z [degrees], in the maker's order (`drivers.calibration.wrench_transform`). It is applied after any
    transform of the calibration or the box.
    """
    text = address.options.get("tool")
    if text is None:
        return address, ()
    numbers = tuple(map(number, text.split(",")))
    limits = (_FARTHEST,) * 3 + (_MOST,) * 3
    if len(numbers) != 6 or not all(abs(value) <= most for value, most in zip(numbers, limits, strict=True)):
        raise AddressError(
            f"{address.uri}: tool={text[:60]} must be six numbers, dx,dy,dz in mm (at most {_FARTHEST:g}) and "
            f"rx,ry,rz in degrees (at most {_MOST:g}), for example tool=0,0,-5,0,0,0"
        )
    options = {name: value for name, value in address.options.items() if name != "tool"}
    return replace(address, options=options), numbers if any(numbers) else ()


def with_tool(info: TransducerInfo, tool: Tool) -> TransducerInfo:
    """Return the transducer's info with the tool transform applied to its calibration."""
    if not tool:
        return info
    description = "{:g} {:g} {:g} mm, {:g} {:g} {:g} degrees, as the address says".format(*tool)
    settings = {**info.settings, "user's tool transform": description}
    return replace(info, calibration=info.calibration.with_tool(tool), settings=settings)
