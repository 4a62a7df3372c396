"""The stand-alone force/torque controller on a pseudo-terminal.

Behaviour and bytes follow the command list of its manual (9620-05-CTL) as given by published drivers, and are packed
here only. The wording of banner and refusals, and the error digit of a saturated transducer (1), are assumed.
"""

import struct

import numpy as np

from drivers.arrays import Array
from drivers.clock import Clock
from simulators.bench import Bench
from simulators.faults import Faults
from simulators.simulator import LineBox, PseudoTerminal, Simulator, serve_on_ports

COUNTS_PER_N = 800.0
COUNTS_PER_NM = 60_000.0
BANNER = b"\r\nSIMULATED F/T Controller\r\nsimulated transducer %s\r\nready\r\n"

_NAP = 0.01  # longest wait, and so the longest delay of an end [real s]
_SHORTEST_NAP = 0.0005
_BURST = 400  # most records in one send after the computer was busy
_START_UP = 0.2  # from power to prompt [s]
_COMMANDS = (b"SA", b"CV", b"CL", b"CR", b"CP", b"SM", b"SP", b"SR", b"CF", b"SF", b"CS", b"CE", b"RS", b"RL", b"%")


class SerialFtBox(LineBox):
    """A controller with a simulated bench behind it. Its time and the bench's begin when it is started.

    Bytes are sent no faster than the line's speed, and as garbage where the reader uses another speed.
    """

    def __init__(self, bench: Bench, clock: Clock, *, baud: int = 38400, faults: Faults | None = None) -> None:
        """Set up a controller whose line runs at `baud` bits a second."""
        super().__init__("ttyFT", clock, faults)
        self._bench = bench
        self._baud = baud
        self._rated = np.array(bench.settings.rated)
        self._counts = np.repeat([COUNTS_PER_N, COUNTS_PER_NM / 1000.0], 3)  # per N or N mm
        self.power_up(0.0)

    def address(self, path: str) -> str:
        force, torque = self._rated[0], self._rated[3] / 1000.0
        return (
            f"serial-ft://{path}?baud={self._baud}&counts_per_N={COUNTS_PER_N:g}"
            f"&counts_per_Nm={COUNTS_PER_NM:g}&range_N={force:g}&range_Nm={torque:g}"
            f"&serial={self._bench.serial}&simulated=1"
        )

    def power_up(self, now: float) -> None:
        self.is_on = True
        self._binary = False
        self._biases: list[Array] = []
        self._line = bytearray()
        self._streaming_since: float | None = None  # departure of the stream's first record [s]
        self._sent = 0  # records of this stream
        self._last = (0, [0] * 6)
        self._ready_at: float | None = now + _START_UP  # time of the banner, after power-up

    def work(self, port: PseudoTerminal, now: float) -> None:
        """Send the banner and records that are due, and answer received bytes."""
        if self._ready_at is not None and now >= self._ready_at:
            self._ready_at = None
            self._send(port, BANNER % self._bench.serial.encode() + b">")
        self._send_due(port, now)
        for byte in port.receive(self._until_due()):
            if self._ready_at is None:
                self._on_byte(port, byte if port.baud == self._baud else byte ^ 0x55)

    def _send(self, port: PseudoTerminal, data: bytes) -> None:
        """Send `data`, garbled where the reader uses another speed."""
        port.send(data if port.baud == self._baud else bytes(byte ^ 0xA5 for byte in data))

    @property
    def _period(self) -> float:
        """Duration of a record on the line, with ten bits for each byte [s]."""
        return (13 if self._binary else 45) * 10 / self._baud

    def _until_due(self) -> float:
        """Return the time until the next record is due, within the limits of a wait [real s]."""
        if self._streaming_since is None:
            return _NAP
        since = self.faults.device_time(np.array([self._streaming_since]))
        due = float(self.faults.instants(since + (self._sent + 1) * self._period)[0])  # the next record's last byte
        return min(max((due - self.now()) / self.clock.factor, _SHORTEST_NAP), _NAP)

    def _send_due(self, port: PseudoTerminal, now: float) -> None:
        """Send the records whose last byte is due, and delayed ones."""
        if self._streaming_since is None:
            return
        times, self._sent = self.faults.due(self._streaming_since, now, 1.0 / self._period, self._sent, _BURST)
        for record in self.faults.route(now, zip(times.tolist(), self._records(times), strict=True)):
            self._send(port, record)

    def _on_byte(self, port: PseudoTerminal, byte: int) -> None:
        if byte == 0x17:
            self.power_up(self.now())
        elif byte == 0x14:
            self._send(port, self._record())
        elif byte == 0x0D:
            command = bytes(self._line).strip().upper()
            self._line.clear()
            if self._streaming_since is not None:
                self._streaming_since = None
                self._send(port, b"\r\n>")
            else:
                self._send(port, command + b"\r\n" + self._answer(command))
        elif byte != 0x0A and len(self._line) < 80:
            self._line.append(byte)

    def _answer(self, command: bytes) -> bytes:
        """Carry out one command and return the bytes after its echo."""
        name, _, argument = command.partition(b" ")
        if command == b"QS":
            self._streaming_since, self._sent = self.now(), 0
            return b""
        if command == b"QR":
            return self._record() + (b"\x06\r\n>" if self._binary else b">")
        if name == b"CD":
            if argument not in (b"A", b"B", b"R", b"U"):
                return b"not simulated\r\n>"
            self._binary = {b"A": False, b"B": True}.get(argument, self._binary)
        elif name == b"SB":
            self._biases = [*self._biases, self._bench.wrench(np.array([self.now()]))[0]][-3:]
        elif name == b"SU":
            self._biases = self._biases[:-1]
        elif name == b"SZ":
            self._biases = []
        elif name == b"SA" and argument != b"0":
            return b"not simulated\r\n>"
        elif name and name not in _COMMANDS:
            return b"not a command\r\n>"
        return b"\r\n>"

    def _record(self) -> bytes:
        return self._records(np.array([self.now()]))[0]

    def _records(self, times: Array) -> list[bytes]:
        """Return the bytes of a record for each of `times` (n,) [s]."""
        if not len(times):
            return []
        wrench = self.faults.sensed_wrench(self._bench, times)
        records: list[bytes] = []
        overloaded = np.any(np.abs(wrench) > self._rated, axis=1)
        bias = self._biases[-1] if self._biases else np.zeros(6)
        counts = np.rint((np.clip(wrench, -self._rated, self._rated) - bias) * self._counts)
        counts = np.clip(counts, -32768, 32767).astype(int)
        for time, above, six in zip(times.tolist(), overloaded.tolist(), counts.tolist(), strict=True):
            if not self.faults.active("stall", time):
                self._last = (self.faults.status(time) or int(above or self.faults.active("saturate", time)), six)
            error, values = self._last
            if self._binary:
                records.append(struct.pack(">B6h", error, *values))
            else:
                records.append((f"{error}" + "".join(f",{value:6d}" for value in values) + "\r\n").encode())
        return records


SIMULATOR = Simulator(
    "serial-ft",
    serve_on_ports(SerialFtBox),
    factor=2.0,
    statuses=tuple(range(1, 10)),
    unshown=0.2,  # binary records have no checksum
)
