"""Serves the subject's page to one tablet on the lab's own network, and nothing else.

There are two addresses: `/` is the page, which is the same for everybody and holds no data, and `/socket` is the
conversation. A client there must first send the code that the experimenter's window shows. The code admits one
device. After `TRIES` wrong codes it is replaced. Messages cross the network as plain text.
"""

import ipaddress
import logging
import secrets
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from daq_app.tablet.dialogue import LARGEST, FromTablet, Hello, Refused, ToTablet, Welcome, decode, encode

if TYPE_CHECKING:  # an optional package
    from websockets.http11 import Request, Response
    from websockets.sync.server import ServerConnection

PORT = 8377  # unless it is taken; unassigned by IANA
TRIES = 5  # wrong codes before the code is replaced
WRONG_CODE = 1.0  # wait after a wrong code [s]: with 10^6 codes and `TRIES` a guess succeeds once in days
ALIVE = 5.0  # longest silence of a connected tablet [s]
_PATIENCE = 10.0  # for the first message [s]
_FAREWELL = 0.1  # for the last one [s], which the window may wait for: a message travels in milliseconds
REPLACED = 4000  # close code for a tab that another tab of the same browser replaces; see page.html
OFF = logging.CRITICAL + 1
_PAGE = Path(__file__).with_name("page.html")
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'"
_MISSING = "the subject's page on a tablet needs the packages websockets and segno: pip install 'daq-app[tablet]'"


class NoTabletServer(Exception):
    """The page cannot be served; the sentence says why."""


class TabletServer:
    """A server in its own thread. All methods may be called from any thread."""

    def __init__(
        self, address: str, port: int, on_message: Callable[[FromTablet, float], None], on_change: Callable[[], None]
    ) -> None:
        """Listen at an address of this machine. Raises NoTabletServer.

        `on_message` takes each message of the admitted tablet, and its arrival by the monotonic clock [s].
        `on_change` is called when a tablet comes or goes or the code changes. A free port replaces a taken one.
        """
        try:
            import segno  # noqa: F401  # the window draws the link with it
            from websockets.sync.server import serve
        except ImportError as error:
            raise NoTabletServer(_MISSING) from error
        self._on_message = on_message
        self._on_change = on_change
        self._lock = threading.Lock()
        self._door = threading.Lock()  # one guess at a time over all connections
        self._tablet: ServerConnection | None = None  # of the admitted tablet
        self._token = ""
        self._wrong = 0
        self._last: dict[type, str] = {}  # sent to a tablet that reconnects
        self.code = _new_code()
        listener = _listen(address, port)
        self.url = "http://{}:{}".format(*listener.getsockname()[:2])
        self._page = _PAGE.read_text(encoding="utf-8")
        self._server = serve(
            self._talk,
            sock=listener,
            process_request=self._answer,
            origins=[self.url],
            max_size=LARGEST,
            ping_interval=ALIVE / 2,
            ping_timeout=ALIVE / 2,
            close_timeout=_FAREWELL,
            compression=None,
            logger=logging.Logger("tablet", OFF),  # no tracebacks in the terminal that opened the window
        )
        threading.Thread(target=self._server.serve_forever, name="the tablet's server", daemon=True).start()

    @property
    def connected(self) -> bool:
        """Say whether the tablet is connected."""
        return self._tablet is not None

    @property
    def code_is_used(self) -> bool:
        """Say whether the code has admitted a tablet; it admits only one."""
        return bool(self._token)

    @property
    def link(self) -> str:
        """Return the address with the code, after a # that browsers do not send."""
        return f"{self.url}/#{self.code}"

    def send(self, message: ToTablet) -> None:
        """Send a message to the tablet; a tablet that connects later gets the last message of each kind."""
        text = encode(message)
        with self._lock:  # a tablet that is just connecting must not get it too early
            self._last[type(message)] = text
            if self._tablet is not None:
                _send_text(self._tablet, text)

    def renew(self) -> None:
        """Disconnect the tablet, and admit the next one by a new code."""
        with self._lock:
            tablet, self._tablet, self._token = self._tablet, None, ""
            self.code, self._wrong = _new_code(), 0
        if tablet is not None:
            tablet.close()
        self._on_change()

    def close(self) -> None:
        """Stop listening."""
        self._server.shutdown()

    def _answer(self, connection: "ServerConnection", request: "Request") -> "Response | None":
        """Return the response to a request for a page; None if it begins a conversation."""
        if request.path == "/socket":
            return None
        if request.path != "/":
            return connection.respond(HTTPStatus.NOT_FOUND, "Nothing is here.\n")
        page = connection.respond(HTTPStatus.OK, self._page)
        del page.headers["Content-Type"]
        page.headers["Content-Type"] = "text/html; charset=utf-8"
        page.headers["Content-Security-Policy"] = POLICY
        page.headers["Cache-Control"] = "no-store"
        return page

    def _talk(self, connection: "ServerConnection") -> None:
        """Admit a tablet, and take its messages until it disconnects."""
        from websockets.exceptions import ConnectionClosed

        with suppress(ConnectionClosed, TimeoutError, msgspec.DecodeError):
            hello = decode(connection.recv(_PATIENCE))
            if not isinstance(hello, Hello) or not self._let_in(connection, hello):
                return
            try:
                self._on_message(hello, time.monotonic())
                while True:
                    self._on_message(decode(connection.recv()), time.monotonic())
            finally:
                with self._lock:
                    if current := self._tablet is connection:
                        self._tablet = None
                if current:
                    self._on_change()

    def _let_in(self, connection: "ServerConnection", hello: Hello) -> bool:
        """Say whether a tablet is admitted; one that reconnects replaces its lost connection."""
        if self._admit(connection, hello.token, by_code=False):
            return True
        with self._door:
            if self._admit(connection, hello.code, by_code=True):
                return True
            refusal = self._refuse_code(hello)
        _send_text(connection, encode(Refused(refusal)))
        return False

    def _admit(self, connection: "ServerConnection", secret: str, *, by_code: bool) -> bool:
        """Admit a tablet by the token, or by the code while there is no token yet; return whether it is admitted."""
        with self._lock:
            right = self.code if by_code else self._token
            if by_code == bool(self._token) or not secrets.compare_digest(secret.encode(), right.encode()):
                return False
            previous, self._tablet = self._tablet, connection
            self._token = self._token or secrets.token_urlsafe()
            for text in (encode(Welcome(self._token)), *self._last.values()):
                _send_text(connection, text)
        if previous is not None:
            previous.close(REPLACED)
        self._on_change()
        return True

    def _refuse_code(self, hello: Hello) -> str:
        """Return, after a pause, why a tablet is refused; replace the code after several wrong ones."""
        time.sleep(WRONG_CODE)
        with self._lock:
            in_use = bool(self._token)
            self._wrong += bool(hello.code)
            renewed = self._wrong >= TRIES and not in_use
            if renewed:
                self.code, self._wrong = _new_code(), 0
        if renewed:
            self._on_change()
        if in_use:
            return "Another device shows this page. Ask for a new code."
        return "This is not the code." if hello.code else "Another code is now valid."


def own_address() -> str:
    """Return this machine's network address, or loopback; the system only looks up a route and sends no packet."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # network reserved for documentation (RFC 5737): has no machines
            return str(probe.getsockname()[0])
        except OSError:
            return "127.0.0.1"


def _listen(address: str, port: int) -> socket.socket:
    """Return a socket that listens at an address, on a free port if the requested one is taken."""
    try:
        private = ipaddress.IPv4Address(address).is_private and address != "0.0.0.0"
    except ValueError as error:
        raise NoTabletServer(f"{address} is not an IPv4 address: give this machine's, such as 192.168.1.20") from error
    if not private:
        raise NoTabletServer(
            f"{address} is not an address of a private network: the subject's page is served only in the lab;"
            " give --subject-address with this machine's address there"
        )
    for candidate in (port, 0):
        try:
            return socket.create_server((address, candidate))
        except OSError as error:
            refusal = error
    raise NoTabletServer(f"{address} is not an address of this machine ({refusal.strerror}); give --subject-address")


def _new_code() -> str:
    return f"{secrets.randbelow(10**6):06d}"


def _send_text(connection: "ServerConnection", text: str) -> None:
    """Send a text to a tablet; if it is gone, its receiving thread notices."""
    from websockets.exceptions import ConnectionClosed

    with suppress(ConnectionClosed, OSError):
        connection.send(text)
