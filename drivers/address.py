"""Device addresses as people type them: scheme://host?option=value&option=value."""

from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit

from drivers.transducer import SetupError


class AddressError(SetupError):
    """An address that cannot be any device's, or an option that this kind of device does not have."""


@dataclass(frozen=True, slots=True)
class Address:
    """One device address, cut into its parts."""

    uri: str  # as typed
    scheme: str  # the driver's name, e.g. "net-ft"
    host: str
    options: Mapping[str, str]

    def number(self, option: str, default: int, lowest: int, highest: int) -> int:
        """Return a whole-number option, or `default` where it is not given. Raises AddressError out of range."""
        text = self.options.get(option)
        if text is None:
            return default
        if not (text.isascii() and text.isdecimal() and len(text) < 10 and lowest <= int(text) <= highest):
            raise AddressError(f"{self.uri}: {option}={text} must be a whole number from {lowest} to {highest}")
        return int(text)


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
    if not marker or not parts.scheme or any(c.isspace() or not c.isprintable() for c in uri):
        raise AddressError(f"{uri!r} is not a device address; one looks like net-ft://192.168.1.1")
    if port is not None:
        raise AddressError(f"{uri}: write the port as an option, for example {scheme}://{parts.hostname}?http={port}")
    if parts.username is not None or parts.fragment:
        raise AddressError(f"{uri}: a device address has neither user names nor '#'")
    pairs = parse_qsl(parts.query, keep_blank_values=True)
    options = dict(pairs)
    if len(options) < len(pairs):
        raise AddressError(f"{uri} gives an option twice; give each once")
    return Address(uri, parts.scheme, parts.hostname or "", options)


def check_options(address: Address, allowed: frozenset[str]) -> None:
    """Raise SetupError when the address has an option that is not `allowed`."""
    for option in address.options:
        if option not in allowed:
            known = ", ".join(sorted(allowed | {"tool"}))  # which every transducer takes, see `drivers.tool`
            raise AddressError(f"{address.uri}: unknown option {option!r}; allowed are {known}")
