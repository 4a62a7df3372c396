"""Links over the network. Only this, `serial_link` and `usb_link` open ports."""

import contextlib
import io
import re
import socket
import threading
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

from drivers.deadline import TICK, Deadline
from drivers.transducer import LinkLost, SetupError

RECEIVE_BUFFER = 4 * 2**20  # requested for UDP [bytes]; the system may grant less
MOST_BODY = 64 * 1024  # a page longer than this is refused [bytes]
MOST_HEAD = 8 * 1024


class UdpLink:
    """Datagrams to and from one address and port only."""

    def __init__(self, address: str, port: int) -> None:
        """Bind a free local port. Raises LinkLost without a route to the IP address."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            self._socket.connect((address, port))
        except OSError as error:
            self._socket.close()
            raise LinkLost(
                f"no way leads to {address}: {_reason(error)}; check the network cable and settings"
            ) from None
        self._location = f"{address}, UDP port {port}"
        self._timeout = 0.0
        self._socket.settimeout(0.0)

    def send(self, data: bytes) -> None:
        """Send one datagram. A refusal of an earlier one is ignored: the device may be starting."""
        try:
            self._socket.send(data)
        except ConnectionError:
            with contextlib.suppress(ConnectionError):
                self._socket.send(data)
        except OSError as error:
            raise LinkLost(f"cannot send to {self._location}: {_reason(error)}; check the network cable") from None

    def receive(self, timeout: float) -> bytes | None:
        if timeout != self._timeout:
            self._socket.settimeout(timeout)
            self._timeout = timeout
        try:
            return self._socket.recv(65536)
        except (TimeoutError, BlockingIOError, ConnectionError):  # the last: an earlier datagram was refused
            return None
        except OSError as error:
            raise LinkLost(f"cannot receive from {self._location}: {_reason(error)}; check the network cable") from None

    def close(self) -> None:
        self._socket.close()


def tcp_answer(address: str, port: int, request: bytes, size: int, deadline: Deadline) -> bytes:
    """Return the `size` bytes that answer a request, or fewer if the connection ends before.

    Raises LinkLost without a complete answer by the deadline.
    """
    absence, advice = "no whole answer", "check the address and the tcp port"
    with _call(address, port, deadline, f"{address}, TCP port {port}", absence, advice) as call:
        return call.ask(request).read(size)


class _Call(io.RawIOBase):
    """A connection to a port of an IP address; every wait ends by a deadline. Reading raises OSError."""

    def __init__(self, address: str, port: int, deadline: Deadline) -> None:
        """Connect. Raises OSError."""
        self._deadline = deadline
        self._socket = socket.create_connection((address, port), timeout=self._remaining())

    def ask(self, request: bytes) -> io.BufferedReader:
        """Send a request, and return the reader of its answer. Raises OSError."""
        self._socket.settimeout(self._remaining())
        self._socket.sendall(request)
        return io.BufferedReader(self)

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any, /) -> int:  # noqa: ANN401  any buffer
        while True:
            self._socket.settimeout(min(self._remaining(), TICK))
            try:
                return self._socket.recv_into(buffer)
            except TimeoutError:
                continue  # check for a stop and for the deadline

    def close(self) -> None:
        self._socket.close()
        super().close()

    def _remaining(self) -> float:
        """Return the time that remains [real s]. Raises TimeoutError, Stopped."""
        remaining_s = self._deadline.remaining
        if remaining_s <= 0.0:
            raise TimeoutError
        return remaining_s


@contextlib.contextmanager
def _call(address: str, port: int, deadline: Deadline, location: str, absence: str, advice: str) -> Generator[_Call]:
    """Connect to a port. Raises LinkLost for network failures, with place, missing answer and remedy."""
    try:
        with _Call(address, port, deadline) as call:
            yield call
    except TimeoutError:
        raise LinkLost(f"{location} gave {absence} within {deadline.spent:.2g} s; {advice}") from None
    except OSError as error:
        raise LinkLost(f"nothing answers at {location}: {_reason(error)}; {advice}") from None


@dataclass(frozen=True, slots=True)
class HttpAnswer:
    """Answer of a web page."""

    status: int
    body: bytes


def http_get(address: str, port: int, path: str, deadline: Deadline) -> HttpAnswer:
    """Return the answer to one GET; the whole exchange ends by the deadline.

    Redirects are not followed. Raises LinkLost without an HTTP answer of at most MOST_BODY bytes in time.
    """
    location = f"http://{address}:{port}{path}"
    with _call(address, port, deadline, location, "no answer", "check power, cable and address") as call:
        request = f"GET {path} HTTP/1.0\r\nHost: {address}\r\nConnection: close\r\n\r\n"
        return _answer(call.ask(request.encode()), location)


def _answer(reader: io.BufferedReader, location: str) -> HttpAnswer:
    """Read one HTTP/1.0 answer: up to its stated length, or to the end of the connection."""
    no_page = LinkLost(f"{location} does not answer as a web page does; check the address and the http port")
    header = b""
    while not header.endswith(b"\r\n\r\n"):
        line = reader.readline(MOST_HEAD)
        header += line
        if not line or len(header) > MOST_HEAD:
            raise no_page
    status = re.match(rb"HTTP/\S*[ \t]+(\d+)(?!\S)", header)
    if status is None:
        raise no_page
    length_field = re.search(rb"\n[ \t]*content-length[ \t]*:[ \t]*(\d+)[ \t]*\r\n", header, re.IGNORECASE)
    length = None if length_field is None else int(length_field[1][:12])
    too_long = (length or 0) > MOST_BODY
    body = b"" if too_long else reader.read(MOST_BODY + 1 if length is None else length)
    if too_long or len(body) > MOST_BODY:
        raise LinkLost(f"{location} sends more than {MOST_BODY} bytes; check that it is the address of the box")
    if length is not None and len(body) < length:
        raise LinkLost(f"{location} broke off after {len(body)} of {length} bytes; try again")
    return HttpAnswer(int(status[1][:4]), body)


def resolve(host: str, deadline: Deadline) -> str:
    """Return the IPv4 address of a host. Raises SetupError when none is found in time.

    Called once, at opening: a failing name server must not end a stream.
    """
    hosts: list[str] = []

    def look() -> None:
        with contextlib.suppress(OSError, UnicodeError):
            hosts.append(socket.gethostbyname(host))

    search = threading.Thread(target=look, name=f"looking for {host}", daemon=True)  # the system's lookup has no limit
    search.start()
    while search.is_alive() and (remaining_s := deadline.remaining) > 0.0:
        search.join(min(remaining_s, TICK))
    if not hosts:
        raise SetupError(f"the host {host!r} cannot be found; give its IP address, for example 192.168.1.1")
    return hosts[0]


def _reason(error: OSError) -> str:
    return (error.strerror or type(error).__name__).lower()
