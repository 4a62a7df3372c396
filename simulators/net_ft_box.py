"""The networked force/torque box on this computer's loopback network: its UDP, TCP and HTTP ports."""

import contextlib
import os
import selectors
import socket
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from drivers.clock import Clock
from drivers.transducer import SetupError
from simulators.bench import Bench
from simulators.faults import Faults
from simulators.net_ft_electronics import AXIA, NET_FT, Electronics, Product
from simulators.simulator import LINE_FAULTS, ServedBox, Simulator, serve_on_ports

HOST = "127.0.0.1"
_BURST = 200  # most records in one send after the computer was busy, to spare the reader
_NAP = 0.02  # longest wait, and so the longest delay of an end [real s]
# Records due within it leave together [real s]. At half of it a recorder at 2 kHz takes about a third more of a core,
# at twice as much about a quarter less (single runs on a busy machine).
_SHORTEST_NAP = 0.004


@dataclass(slots=True)
class _Stream:
    to: tuple[str, int]
    tick: int  # of the next record
    number: int  # of the next record
    records_to_send: int | None  # None: until stopped
    in_datagram: int  # records in a datagram
    buffer: list[bytes] = field(default_factory=list[bytes])  # records of a datagram not yet full


class NetFtBox(ServedBox):
    """A box on loopback, with a simulated bench behind it. Its time and the bench's begin when it is started.

    One thread serves all its ports. The product name on its page marks it as simulated.
    """

    def __init__(
        self,
        bench: Bench,
        clock: Clock,
        *,
        rate: int = 200,
        ports: tuple[int, int, int | None] = (0, 0, 0),
        faults: Faults | None = None,
        first: tuple[int, int] = (0, 1),
        product: Product = NET_FT,
    ) -> None:
        """Set up a box that streams at `rate` [Hz].

        `ports` are those of UDP, TCP and HTTP, 0 for a free one; None for HTTP: 80, or a free one where 80 is refused.
        `first` holds the counter at the start, as after a long run, and the first number of the first stream.
        """
        super().__init__(clock, faults)
        first_tick, self._first_record = first
        self._inside = Electronics(bench, self.faults, rate=rate, first_tick=first_tick, product=product)
        socket_types = socket.SOCK_DGRAM, socket.SOCK_STREAM, socket.SOCK_STREAM
        self._addresses = tuple(zip(socket_types, ("rdt", "tcp", "http"), ports, strict=True))
        self._is_on = True
        self._stream: _Stream | None = None
        self._selector = selectors.SelectSelector()  # with waits finer than a millisecond
        self._sockets: list[socket.socket] = []

    def start(self) -> None:
        with contextlib.ExitStack() as stack:  # closes the open ports where one fails
            self._sockets = [stack.enter_context(_open_port(*address)) for address in self._addresses]
            stack.pop_all()
        for server, serve in zip(self._sockets, (self._on_datagram, self._on_caller, self._on_caller), strict=True):
            self._selector.register(server, selectors.EVENT_READ, serve)
        rdt, tcp, http = (server.getsockname()[1] for server in self._sockets)
        self.uri = f"net-ft://{HOST}?rdt={rdt}&tcp={tcp}&http={http}"
        self.serve(self._serve, "net-ft box")

    def close(self) -> None:
        super().close()
        for key in list((self._selector.get_map() or {}).values()):
            assert isinstance(key.fileobj, socket.socket)
            key.fileobj.close()
        self._selector.close()

    def _serve(self) -> None:
        """Run the box until closed: send due records, then wait for the next one or a request."""
        while not self.closing.is_set():
            now = self.now()
            if not self._has_power(now):
                self.closing.wait(_NAP)
                continue
            self._send_due(now)
            if self.faults.active("unplug", now):  # it receives nothing either
                self.closing.wait(self._until_due())
                continue
            for key, _ in self._selector.select(self._until_due()):
                key.data(key.fileobj)

    def _until_due(self) -> float:
        """Return the time until the next record is due, within the limits of a wait [real s]."""
        if self._stream is None:
            return _NAP
        due = (self._inside.time(self._stream.tick) - self.now()) / self.clock.factor
        return min(max(due, _SHORTEST_NAP), _NAP)

    def _has_power(self, now: float) -> bool:
        """Apply the timetable's reboots; return whether the box is on."""
        is_on = not self.faults.active("reboot", now)
        if is_on and not self._is_on:
            self._inside.reboot(now)
            self._stream = None
            while self._receive() is not None:  # datagrams that arrived while it was off are dropped
                pass
        self._is_on = is_on
        return is_on

    def _send_due(self, now: float) -> bool:
        """Send due records, at most a burst, and delayed datagrams; say whether more are due."""
        stream = self._stream
        if stream is None:
            return False
        step = self._inside.pages.step
        due = (self._inside.tick(now) - stream.tick) // step + 1
        count = min(max(due, 0), _BURST if stream.records_to_send is None else stream.records_to_send)
        if stream.records_to_send is not None:
            stream.records_to_send -= count
        datagrams: list[tuple[float, bytes]] = []
        ticks = [stream.tick + step * i for i in range(count)]
        for time, reading in zip(self._inside.times(ticks).tolist(), self._inside.readings(ticks), strict=True):
            stream.buffer.append(struct.pack(">I", stream.number % 2**32) + reading)
            if len(stream.buffer) == stream.in_datagram:
                datagrams.append((time, b"".join(stream.buffer)))
                stream.buffer.clear()
            stream.number += 1
            stream.tick += step
        if stream.records_to_send == 0:
            datagrams += [(now, b"".join(stream.buffer))] if stream.buffer else []
            self._stream = None
        if self.faults.active("steal", now):  # another client has it; the next request takes it back
            self._stream = None
            return False
        for datagram in self.faults.route(now, datagrams):
            with contextlib.suppress(BlockingIOError, ConnectionError):  # a network drops excess datagrams
                self._sockets[0].sendto(datagram, stream.to)
        return self._stream is not None and count < due

    def _receive(self) -> tuple[bytes, tuple[str, int]] | None:
        try:
            return self._sockets[0].recvfrom(2048)
        except ConnectionError:  # an earlier datagram was refused: the reader is gone
            return b"", (HOST, 0)
        except BlockingIOError:
            return None

    def _on_datagram(self, _: socket.socket) -> None:
        """Carry out one request. The last client to request a stream has it."""
        request, asker = self._receive() or (b"", (HOST, 0))
        if len(request) != 8 or request[:2] != b"\x12\x34":
            return
        command, count = struct.unpack(">HI", request[2:])
        pages = self._inside.pages
        now = self.now()
        while self._send_due(now):
            pass  # a box that is never busy has sent these before it receives the request
        starts = (0x0001, 0x0002, 0x0003) if pages.product is AXIA else (0x0002, 0x0003)
        if command == 0x0000:
            self._stream = None
        elif command in starts and pages.streams:
            size = pages.numbers["comrdtbsiz"] if command == 0x0003 else 1
            tick = (self._inside.tick(now) // pages.step + 1) * pages.step  # the same ticks at any instant of asking
            self._stream = _Stream(asker, tick, self._first_record, count or None, size)
            self._first_record = 1
        elif command == 0x0042:
            self._inside.set_bias(self.now())
        # 0x0041 resets a threshold latch; no threshold is crossed here.

    def _on_caller(self, listener: socket.socket) -> None:
        """Take a connection to the TCP command port or to the web pages."""
        connection, _ = listener.accept()
        connection.setblocking(False)
        answer = self._answer_page if listener is self._sockets[2] else self._answer_commands
        self._selector.register(connection, selectors.EVENT_READ, partial(self._on_call, bytearray(), answer))

    def _on_call(
        self, request: bytearray, answer: Callable[[bytearray], tuple[bytes, bool]], caller: socket.socket
    ) -> None:
        """Answer the bytes received on a connection so far, and close it when done."""
        try:
            data = caller.recv(4096)
            request += data
            reply, hang_up = answer(request) if data else (b"", True)
            caller.sendall(reply)
        except (BlockingIOError, ConnectionError):
            hang_up = True
        if hang_up:
            self._selector.unregister(caller)
            caller.close()

    def _answer_commands(self, request: bytearray) -> tuple[bytes, bool]:
        """Return the replies to all whole commands of 20 bytes; the connection stays open."""
        replies = b""
        while len(request) >= 20:
            replies += self._inside.tcp_reply(bytes(request[:20]), self.now())
            del request[:20]
        return replies, False

    def _answer_page(self, request: bytearray) -> tuple[bytes, bool]:
        if b"\r\n\r\n" not in request:
            return b"", len(request) > 8192
        return self._inside.http_reply(bytes(request), self.now()), True


def _open_port(socket_type: socket.SocketKind, option: str, port: int | None) -> socket.socket:
    """Return a socket on `port` of loopback; None: 80 or a free one. Raises SetupError when this fails."""
    if port is None:
        with contextlib.suppress(SetupError):
            return _open_port(socket_type, option, 80)
        port = 0
    server = socket.socket(socket.AF_INET, socket_type)
    try:
        if socket_type == socket.SOCK_STREAM and os.name == "posix":  # frees a port soon after its use
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        server.bind((HOST, port))
        if socket_type == socket.SOCK_STREAM:
            server.listen()
    except OSError as error:
        server.close()
        name = "UDP" if socket_type == socket.SOCK_DGRAM else "TCP"
        raise SetupError(
            f"{name} port {port} on {HOST} cannot be opened ({(error.strerror or 'refused').lower()}); "
            f"end the program that holds it, or choose another {option} port"
        ) from None
    server.setblocking(False)
    return server


_ERROR = 1 << 31  # set with any other bit
SIMULATOR = Simulator(
    "net-ft",
    # Its counter is that of a box after a long run.
    serve_on_ports(partial(NetFtBox, first=(10_000_000, 1))),
    factor=10.0,
    tells=("repeat", "reorder", "delay", "stall", *LINE_FAULTS),
    hides=(),
    statuses=tuple(_ERROR | 1 << n for n in (*range(1, 15), *range(16, 31))),
)
