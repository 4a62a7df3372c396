"""Devices that talk without end and never as their maker says, on real ports of this computer."""

import contextlib
import os
import socket
import struct
import threading
import time

from drivers import usb_link
from drivers.catalog import DRIVERS
from drivers.clock import RealClock
from simulators.bench import Bench, calibration_file
from simulators.faults import Faults
from simulators.labjack_u6_box import LabJackU6Box, SimulatedBus
from simulators.serving import SIMULATORS
from simulators.simulator import PseudoTerminal

PAGE = (
    b"HTTP/1.0 200 OK\r\n\r\n<netft><prodname>Net F/T</prodname><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>"
    b"<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu><comrdtrate>200</comrdtrate></netft>"
)
STUCK = struct.pack(">III6i", 7, 35, 0, *range(6))
UDP = {
    "datagrams of 35 bytes": bytes(35),
    "one number again and again": STUCK,
    "empty datagrams": b"",
    "datagrams of 36 random bytes": None,
}


class Hostile:
    """Threads that serve until it is closed, and the address at which they do."""

    def __init__(self):
        self.uri = ""
        self.stream_request = threading.Event()  # for a stream
        self._over = threading.Event()
        self._threads = []
        self._ends = []

    def serve(self, work):
        self._threads.append(threading.Thread(target=self._repeat, args=(work,), daemon=True))
        self._threads[-1].start()

    def _repeat(self, work):
        with contextlib.suppress(OSError, ValueError):
            while not self._over.is_set():
                work()

    def at_close(self, end):
        self._ends.append(end)

    def close(self):
        self._over.set()
        for thread in self._threads:
            thread.join(2.0)
        for end in self._ends:
            end()


def _port(hostile, kind=socket.SOCK_STREAM):
    listener = socket.socket(socket.AF_INET, kind)
    listener.bind(("127.0.0.1", 0))
    listener.settimeout(0.1)
    hostile.at_close(listener.close)
    if kind == socket.SOCK_STREAM:
        listener.listen()
    return listener


def _serve_answer(hostile, listener, answer, *, drip=0.0):
    """Answer each call with these bytes, all at once, or a byte every `drip` seconds."""

    def answer_call():
        try:
            caller, _ = listener.accept()
        except TimeoutError:
            return
        with caller:
            caller.recv(4096)
            for piece in [answer] if not drip else [answer[i : i + 1] for i in range(len(answer))]:
                caller.sendall(piece)
                if hostile._over.wait(drip):
                    return

    hostile.serve(answer_call)


def web(status, body):
    """Return a web server that gives every page the same answer, at the address of a box."""
    hostile = Hostile()
    http = _port(hostile)
    _serve_answer(hostile, http, f"HTTP/1.0 {status} X\r\n\r\n".encode() + body)
    hostile.uri = f"net-ft://127.0.0.1?http={http.getsockname()[1]}"
    return hostile


def net_ft(datagram, *, page_drip=0.0):
    """Return a box whose page is in order, and whose stream is this datagram, every millisecond."""
    hostile = Hostile()
    http, tcp, rdt = _port(hostile), _port(hostile), _port(hostile, socket.SOCK_DGRAM)
    _serve_answer(hostile, http, PAGE, drip=page_drip)
    _serve_answer(hostile, tcp, bytes(24), drip=2.0)
    client_address = []

    def stream():
        rdt.settimeout(0.001)
        with contextlib.suppress(TimeoutError, ConnectionError):
            client_address[:] = [rdt.recvfrom(100)[1]]
            hostile.stream_request.set()
        if client_address:
            with contextlib.suppress(ConnectionError):
                rdt.sendto(os.urandom(36) if datagram is None else datagram, client_address[0])

    hostile.serve(stream)
    http_port, tcp_port, rdt_port = (endpoint.getsockname()[1] for endpoint in (http, tcp, rdt))
    hostile.uri = f"net-ft://127.0.0.1?http={http_port}&tcp={tcp_port}&rdt={rdt_port}"
    return hostile


def line(scheme, options, data):
    """Return a serial line on which these bytes come without end."""
    hostile, port = Hostile(), PseudoTerminal("ttyHostile")

    def talk():
        port.receive(0.002)
        port.send(data() if callable(data) else data)

    hostile.serve(talk)
    hostile.at_close(port.close)
    hostile.uri = f"{scheme}://{port.path}?{options}"
    return hostile


class _Endless(LabJackU6Box):
    """A converter whose stream cannot be stopped, and holds no scan."""

    def stream_packet(self, patience):
        """Return bytes at once, however long may be waited."""
        time.sleep(min(patience, 0.001))
        return bytes(62)


def labjack_u6(folder):
    """Return a converter that answers as it should, and streams bytes without end that are no scans."""
    hostile = Hostile()
    usb_link.BACKEND = SimulatedBus([_Endless(Bench(3), RealClock())])
    hostile.at_close(lambda: setattr(usb_link, "BACKEND", None))
    hostile.uri = f"labjack-u6://?rate=300&cal={calibration_file(folder, 'SIM00003')}"
    return hostile


def any_line(name, data):
    """Return a line at the address of a driver's own simulated device on which these bytes come without end."""

    def start(folder):
        device = SIMULATORS[name].start(Bench(3), RealClock(), Faults(), folder)
        device.close()
        return line(name, device.uri.partition("?")[2], data)

    return start


SERIAL = "baud=38400&counts_per_N=20&counts_per_Nm=333.33"
HOSTILE = {
    **{f"net-ft, {name}": (lambda _, d=datagram: net_ft(d)) for name, datagram in UDP.items()},
    "net-ft, a page that drips": lambda _: net_ft(STUCK, page_drip=0.5),
    "serial-ft, prompts": lambda _: line("serial-ft", SERIAL, b">"),
    "serial-ft, at any baud rate": lambda _: line("serial-ft", SERIAL.partition("&")[2], b"\xff" * 9),
    "digital-ft, one packet": lambda _: line("digital-ft", "parity=none", b"\x55" * 26),
    "labjack-u6, zeros": labjack_u6,
    **{
        f"{driver.name}, {what}": any_line(driver.name, data)
        for driver in DRIVERS
        for what, data in (("zeros", bytes(50)), ("random bytes", lambda: os.urandom(30)))
        if driver.serial_line
    },
}
