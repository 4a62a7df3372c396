"""A serial line as a link, and the part of a device address that names its port."""

import contextlib
import errno
import os
import select
from typing import Literal
from urllib.parse import unquote, urlsplit

import serial
from serial.tools import list_ports

from drivers.address import Address, AddressError
from drivers.transducer import LinkLost, SetupError

try:
    from termios import error as terminal_error  # of a port's settings
except ImportError:  # Windows
    terminal_error = OSError

Parity = Literal["none", "even"]

_PARITY = {"none": serial.PARITY_NONE, "even": serial.PARITY_EVEN}
# Raised when a port is unplugged, or used after that. pyserial's own errors are OSErrors.
_PORT_ERRORS: tuple[type[Exception], ...] = (OSError, ValueError, terminal_error)
_POSIX = os.name == "posix"
_MOST = 65536  # bytes taken in one call
_WRITE_PATIENCE = 0.1  # for the system to accept bytes [real s]


class SerialLink:
    """Eight data bits and one stop bit over one serial port, opened exclusively."""

    def __init__(self, port: str, baud: int, parity: Parity = "none") -> None:
        """Open `port` at `baud` bits a second. Raises SetupError when it is missing, busy or not permitted."""
        self._port_name = port
        self._timeout = 0.0
        try:
            self._port = serial.Serial(
                port,
                baud,
                bytesize=serial.EIGHTBITS,
                parity=_PARITY[parity],
                stopbits=serial.STOPBITS_ONE,
                timeout=0.0,
                write_timeout=0.0 if _POSIX else _WRITE_PATIENCE,
                xonxoff=False,  # binary records may contain those bytes
                exclusive=True,
            )
        except _PORT_ERRORS as error:
            raise SetupError(f"{port} cannot be opened: {_reason(error, baud)}") from None

    def send(self, data: bytes) -> None:
        try:
            while data:
                # pyserial's own write timeout expires on a busy computer.
                if _POSIX and not select.select([], [self._port.fileno()], [], _WRITE_PATIENCE)[1]:
                    raise OSError
                data = data[self._port.write(data) :]
        except _PORT_ERRORS:
            raise LinkLost(f"{self._port_name} takes no bytes any more; check that its plug is in") from None

    def receive(self, timeout: float) -> bytes | None:
        try:
            if timeout != self._timeout:
                self._port.timeout = timeout
                self._timeout = timeout
            data = self._port.read(1)
            while data and len(data) < _MOST and (available := self._port.in_waiting):  # at most 4 KB at a time
                data += self._port.read(available)
            return data or None
        except _PORT_ERRORS:
            raise LinkLost(f"{self._port_name} is gone; check that its plug is in") from None

    def close(self) -> None:
        with contextlib.suppress(*_PORT_ERRORS):  # unplugged
            self._port.close()


def serial_ports() -> tuple[str, ...]:
    """Return the serial ports with a device plugged in, without opening them."""
    return tuple(sorted(port.device for port in list_ports.comports() if port.vid is not None))


def port_of(address: Address) -> str:
    """Return the serial port in an address. Raises SetupError without one.

    >>> from drivers.address import parse_address
    >>> port_of(parse_address("serial-ft:///dev/ttyUSB0?baud=38400")), port_of(parse_address("serial-ft://COM3"))
    ('/dev/ttyUSB0', 'COM3')
    """
    parts = urlsplit(address.uri)
    port = unquote(parts.netloc + parts.path if parts.path != "/" else parts.netloc)
    if not port:
        raise AddressError(f"{address.uri} names no port; write for example {address.scheme}:///dev/ttyUSB0")
    return port


def _reason(error: Exception, baud: int) -> str:
    number = getattr(error, "errno", None)
    text = str(error)
    if number in (errno.EAGAIN, errno.EBUSY) or "exclusively lock" in text:
        return "another program has it; end that program"
    if number in (errno.EACCES, errno.EPERM) or "PermissionError" in text:
        return "you may not use it, or another program has it; join the group that owns it, or end that program"
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or "FileNotFoundError" in text:
        return "there is no such port; check the plug and the name"
    if isinstance(error, ValueError):
        return f"it cannot be set to {baud} baud; choose another baud rate"
    return "it is no serial port or cannot be set as asked; check the name, the baud rate and the parity"
