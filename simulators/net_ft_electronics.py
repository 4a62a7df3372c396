"""What is inside the simulated networked box: its counter, its readings, and its replies as bytes.

Layouts from the maker's manual 9620-05-NET FT (chapters 9 to 11), packed here and nowhere else.
"""

import struct

import numpy as np
from numpy.typing import NDArray

from simulators.bench import Bench
from simulators.faults import Faults
from simulators.net_ft_pages import NET_FT, Pages, Product

Array = NDArray[np.float64]

_REASONS = {200: "OK", 302: "Found", 404: "Not Found"}


class Electronics:
    """The box without its ports. Times are the bench's [s]; a reading after its number is 32 bytes."""

    def __init__(
        self,
        bench: Bench,
        faults: Faults,
        *,
        rate: int,
        first_tick: int,
        rate_error: float = 0.0,
        product: Product = NET_FT,
    ) -> None:
        """Switch on at time 0 with the counter at `first_tick`, running wrong by `rate_error` [-]."""
        self._bench = bench
        self._faults = faults
        self._rated = np.array(bench.settings.rated)
        self.pages = Pages(f"SIM{bench.seed:05d}", self._rated, rate, product)
        self._ticks_a_second = product.ticks * (1.0 + rate_error)
        self._bias = np.zeros(6)  # software bias [N, N mm]
        self._powered = 0.0  # when the counter stood at _first_tick [s]
        self._first_tick = first_tick
        self._last = bytes(32)  # the last reading streamed: a stalled converter gives it again

    def reboot(self, now: float) -> None:
        """Forget what is not kept over power-off."""
        self._powered, self._first_tick = now, 0
        self._bias = np.zeros(6)

    def tick(self, time: float) -> int:
        """Return the counter at `time`."""
        return self._first_tick + int((self._age(time) - self._age(self._powered)) * self._ticks_a_second)

    def time(self, tick: int) -> float:
        """Return when the counter reaches `tick`."""
        age = self._age(self._powered) + (tick - self._first_tick) / self._ticks_a_second
        return float(self._faults.instants(np.array([age]))[0])

    def _age(self, time: float) -> float:
        """Return how far the box's own clock has come at `time`."""
        return float(self._faults.aged(np.array([time]))[0])

    def readings(self, ticks: list[int]) -> list[bytes]:
        """Return counter, status and six counts, packed, at each of `ticks`."""
        if not ticks:
            return []
        ages = self._age(self._powered) + (np.array(ticks) - self._first_tick) / self._ticks_a_second
        times = self._faults.instants(ages)
        status, counts = self._status_and_counts(times)
        packed: list[bytes] = []
        for tick, time, word, six in zip(ticks, times.tolist(), status, counts.tolist(), strict=True):
            if not self._faults.active("stall", time):
                self._last = struct.pack(">II6i", tick % 2**32, word, *six)
            packed.append(self._last)
        return packed

    def set_bias(self, now: float) -> None:
        """Let what is felt now read as zero."""
        self._bias = np.clip(self._bench.wrench(np.array([now]))[0], -self._rated, self._rated)

    def tcp_reply(self, request: bytes, now: float) -> bytes:
        """Return the reply to the 20 bytes of a TCP request; none to a command that is not simulated."""
        self.pages.counting = self._faults.counting(now)
        if request[0] == 0:  # READFT: counts in 16 bits, and system commands in the last two bytes
            if request[19] & 1:
                self.set_bias(now)
            status, counts = self._status_and_counts(np.array([now]))
            small = np.clip(np.rint(counts[0] / np.array(self.pages.scales)), -32768, 32767).astype(int).tolist()
            return struct.pack(">HH6h", 0x1234, status[0] >> 16, *small)
        if request[0] == 1:  # READCALINFO
            units = (self.pages.force_code, self.pages.torque_code)
            return struct.pack(">HBBII6H", 0x1234, *units, self.pages.counts, self.pages.counts, *self.pages.scales)
        return b""

    def http_reply(self, request: bytes, now: float) -> bytes:
        """Return the reply to an HTTP request."""
        words = request.split(b"\r\n", 1)[0].decode("latin-1").split(" ")
        target = words[1] if len(words) == 3 and words[0] == "GET" else "/"
        if target.startswith("/rundata.cgi") and "cmd=bias" in target:
            self.set_bias(now)
        self.pages.counting = self._faults.counting(now)
        status, counts = self._status_and_counts(np.array([now]))
        code, page = self.pages.answer(target, status[0], counts[0].tolist())
        body = page.encode()
        head = f"HTTP/1.0 {code} {_REASONS[code]}\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n"
        return (head + ("Location: /index.htm\r\n" if code == 302 else "") + "\r\n").encode() + body

    def _status_and_counts(self, times: Array) -> tuple[list[int], NDArray[np.int64]]:
        """Return the status (n) and the six counts (n, 6) at `times` (n,)."""
        wrench = self._faults.sensed(self._bench.wrench(times), times, self._bench.settings.rated)
        forced = np.array([self._faults.active("saturate", time) for time in times.tolist()], bool)
        wrench[forced] = self._rated  # what a clipped converter shows
        over = forced | np.any(np.abs(wrench) > self._rated, axis=1)
        counts = (np.clip(wrench, -self._rated, self._rated) - self._bias) * self.pages.counts_per_wrench
        counts *= np.array([self._faults.counting(time) for time in times.tolist()])[:, None]
        whole = np.clip(np.rint(counts), -(2**31), 2**31 - 1).astype(np.int64)
        saturated = self.pages.product.saturated
        flags = zip(over.tolist(), times.tolist(), strict=True)
        return [(saturated if above else 0) | self._faults.status(time) for above, time in flags], whole
