"""The RS-485 transducer on a pseudo-terminal.

Registers, frames and packets follow its manual (9620-05-Digital FT, chapter 8) as cited by a published driver, and are
packed here only. The required length of a jam, and the deaf time after it, are not verified.
"""

import struct

import numpy as np

from drivers.arrays import Array
from drivers.clock import Clock
from simulators.bench import FT32831, Bench
from simulators.faults import Faults
from simulators.simulator import ROOM, LineBox, PseudoTerminal, Simulator, serve_on_ports

_RATE = 7000  # packets a second
COUNTS_PER_VOLT = 3000.0  # of a gauge
_COUNTS = 1_000_000  # per N and per N m, of the stored matrix's results
_SIZE = 3_400  # registers
_STATUS = 0x001D
_CALIBRATION = 0x00E3  # the first register of calibration 1
_GAINS_AND_OFFSETS = (*range(1000, 1006), *range(32_000, 32_006))  # of calibration 1
_JAM = 14  # bytes received while streaming that end the stream
_DEAF = 0.3  # after a jam [s]
_START_UP = 0.2  # after power-up [s]
_NAP = 0.005  # longest wait [real s]
_SHORTEST_NAP = 0.001
_BURST = ROOM // 13  # most packets in one send after the computer was busy: the buffer of a late reader


class DigitalFtBox(LineBox):
    """A transducer with a simulated bench behind it. Its time and the bench's begin when it is started.

    It holds one calibration, number 1, with a part number that marks it as simulated.
    """

    def __init__(
        self,
        bench: Bench,
        clock: Clock,
        *,
        rate_error: float = 0.0,
        faults: Faults | None = None,
        streaming: bool = False,
    ) -> None:
        """Set up a transducer whose rate has the error `rate_error` [-], possibly still `streaming` from before."""
        super().__init__("ttyDigitalFT", clock, faults)
        self._bench = bench
        self._rate = _RATE * (1.0 + rate_error)
        self._rated = np.array(bench.settings.rated)
        self._gauges = np.linalg.inv(FT32831) * COUNTS_PER_VOLT  # counts per N or N mm
        self._memory = self._calibration()
        self.power_up(0.0)
        self._deaf_until = 0.0
        self._streaming_since = 0.0 if streaming else None

    def address(self, path: str) -> str:
        return f"digital-ft://{path}?parity=none"  # pseudo-terminals have no parity

    def _calibration(self) -> bytes:
        serial = self._bench.serial.encode()[:8]
        matrix = np.vstack([FT32831[:3], FT32831[3:] / 1000.0]) * (_COUNTS / COUNTS_PER_VOLT)
        ratings = np.concatenate([self._rated[:3], self._rated[3:] / 1000.0])
        names = (
            serial.ljust(8, b"\0") + b"SIMULATED SI-36-0.5".ljust(32, b"\0") + b"DIG\0" + b"2026/11/21".ljust(20, b"\0")
        )
        numbers = struct.pack(">36f", *matrix.ravel()) + bytes([2, 3]) + struct.pack(">6f", *ratings)
        return names + numbers + struct.pack(">ii12H", _COUNTS, _COUNTS, *_GAINS_AND_OFFSETS)

    def power_up(self, now: float) -> None:
        self.is_on = True
        self._unlocked = False
        self._registers = bytearray(2 * _SIZE)
        self._registers[2 * _CALIBRATION : 2 * _CALIBRATION + len(self._memory)] = self._memory
        self._inbox = bytearray()
        self._streaming_since: float | None = None
        self._sent = 0  # packets of this stream
        self._jammed_by = 0  # bytes received while streaming
        self._deaf_until = now + _START_UP
        self._last = bytes(13)

    def work(self, port: PseudoTerminal, now: float) -> None:
        """Send packets and answer requests; any byte received while it streams jams it."""
        self._send_due(port, now)
        data = port.receive(_NAP if self._streaming_since is None else _SHORTEST_NAP)
        if self._streaming_since is not None:
            self._jammed_by += len(data)
            if self._jammed_by >= _JAM:
                self._streaming_since = None
                self._deaf_until = self.now() + _DEAF
        elif self.now() >= self._deaf_until:
            self._inbox += data
            port.send(self._answers())

    def _send_due(self, port: PseudoTerminal, now: float) -> None:
        if self._streaming_since is None:
            return
        times, self._sent = self.faults.due(self._streaming_since, now, self._rate, self._sent, _BURST)
        port.send(b"".join(self.faults.route(now, zip(times.tolist(), self._packets(times), strict=True))))

    def _packets(self, times: Array) -> list[bytes]:
        """Return a packet for each of `times` (n,) [s]."""
        gauges = np.rint(self.faults.sensed_wrench(self._bench, times) @ self._gauges.T)
        gauges[self.faults.during("saturate", times)] = 32767
        overloaded = np.any(np.abs(gauges) >= 32767, axis=1)
        gauges = np.clip(gauges, -32768, 32767)[:, [0, 2, 4, 1, 3, 5]].astype(">i2")
        packets: list[bytes] = []
        for time, six, above in zip(times.tolist(), gauges, overloaded.tolist(), strict=True):
            if not self.faults.active("stall", time):
                body, fault = six.tobytes(), above or self.faults.status(time) != 0
                self._last = body + bytes([sum(body) & 0x7F | (0x80 if fault else 0)])
            packets.append(self._last)
        return packets

    def _answers(self) -> bytes:
        """Return the answers to all whole requests received; other bytes are dropped."""
        answers = b""
        while len(self._inbox) >= 5:
            function = self._inbox[1]
            long = {0x03: 8, 0x10: 9 + self._inbox[6] if len(self._inbox) > 6 else 300}.get(function, 5)
            if len(self._inbox) < long:
                break
            frame = bytes(self._inbox[:long])
            if frame[0] != 0x0A or _crc(frame[:-2]) != frame[-2:]:
                self._inbox.clear()
                break
            del self._inbox[:long]
            answer = b"\x0a" + self._carry_out(function, frame[2:-2])
            answers += answer + _crc(answer)
        return answers

    def _carry_out(self, function: int, data: bytes) -> bytes:
        """Carry out one request; return function code and data of the answer."""
        if function == 0x46 and data == b"\x55":
            self._streaming_since, self._sent, self._jammed_by = self.now(), 0, 0
            return b"\x46\x01"
        if function == 0x6A and data in (b"\xaa", b"\x18"):
            self._unlocked = data == b"\xaa"
            return b"\x6a\x01"
        if function not in (0x03, 0x10):
            return bytes([function | 0x80, 1])
        first, count = struct.unpack(">HH", data[:4])
        registers = slice(2 * first, 2 * (first + count))
        if not (1 <= count <= 64 and first + count <= _SIZE):
            return bytes([function | 0x80, 2])
        self._registers[2 * _STATUS : 2 * _STATUS + 2] = struct.pack(">H", self.faults.status(self.now()) & 0xFFFF)
        if function == 0x03:
            return bytes([3, 2 * count]) + bytes(self._registers[registers])
        if not self._unlocked or len(data) != 5 + 2 * count:
            return bytes([0x90, 4])
        self._registers[registers] = data[5:]
        return b"\x10" + data[:4]


def _crc(frame: bytes) -> bytes:
    """Return the two check bytes that end a Modbus RTU frame."""
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc.to_bytes(2, "little")


SIMULATOR = Simulator(
    "digital-ft",
    serve_on_ports(DigitalFtBox),
    factor=0.5,
    statuses=(sum(1 << n for n in (*range(6), 7, *range(8, 14))),),
    unshown=0.2,  # a seven-bit checksum
    at_start=True,
)
