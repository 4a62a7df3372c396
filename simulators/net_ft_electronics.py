"""The inside of the simulated networked box: settings, web pages, counter, readings and replies.

Layouts are from the maker's manual 9620-05-NET FT (chapters 9 to 11), packed here only.
"""

import contextlib
import struct
from collections.abc import Container, Mapping
from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit
from xml.sax.saxutils import escape

import numpy as np

from drivers.arrays import Array, Indices
from simulators.bench import Bench
from simulators.faults import Faults

_COUNTS = 1_000_000  # counts in one unit of force, and in one of torque

_FORCES = {  # code: name, newtons
    1: ("lb", 4.4482216152605),
    2: ("N", 1.0),
    3: ("klb", 4448.2216152605),
    4: ("kN", 1000.0),
    5: ("kg", 9.80665),
    6: ("g", 0.00980665),
}
_TORQUES = {  # code: name, newton millimetres
    1: ("lb-in", 112.9848290276167),
    2: ("lb-ft", 1355.8179483314004),
    3: ("N-m", 1000.0),
    4: ("N-mm", 1.0),
    5: ("kg-cm", 98.0665),
    6: ("kN-m", 1_000_000.0),
}
_SETTABLE: Mapping[str, Mapping[str, Container[int]]] = {  # page: integers that its variables accept
    "/setting.cgi": {name: range(13) for name in ("setuserfilter", "setpke")}
    | {f"setbias{i}": range(-32768, 32768) for i in range(6)},
    "/config.cgi": {"cfgfu": _FORCES, "cfgtu": _TORQUES},
    "/comm.cgi": {"comrdtrate": range(1, 7813), "comrdtbsiz": range(1, 41)},  # no rate above the product's own
}
_TEXTS = {"/config.cgi": ("cfgid", "cfgnam"), "/comm.cgi": ("comrdte",)}  # variables that are text


@dataclass(frozen=True, slots=True)
class Product:
    """The type of the simulated box."""

    name: str
    ticks: float  # samples per second of the box itself
    saturated: int  # status of a reading out of range
    converter: str  # rate of the converter on its pages; "" where they have none


NET_FT = Product("SIMULATED Net F/T", 7000.0, 1 << 31 | 1 << 17, "")
AXIA = Product("SIMULATED Ethernet Axia80", 7812.5, 1 << 31 | 1 << 30, "7812")


class Pages:
    """The box's settings, which survive a reboot as in the real box."""

    def __init__(self, serial: str, rated: Array, rate: int, product: Product) -> None:
        self.product = product
        self._serial = serial
        self._rated = rated  # (6,) [N, N mm]
        self._texts = {"cfgnam": "Nano43 SI-36-0.5", "cfgid": "default", "comrdte": "Enabled"}
        self.numbers = {"setuserfilter": 0, "setpke": 0, "cfgfu": 2, "cfgtu": 3, "comrdtrate": rate, "comrdtbsiz": 10}
        self.numbers |= {f"setbias{i}": 0 for i in range(6)}
        self.count_factor = 1.0  # factor of the counts per unit

    @property
    def streams(self) -> bool:
        """Whether it streams on request."""
        return self._texts["comrdte"] in ("1", "Enabled")

    @property
    def step(self) -> int:
        """Ticks from record to record: of the rate that is set, or of the next higher one that divides the ticks."""
        return int(self.product.ticks // self.numbers["comrdtrate"])

    @property
    def counts_per_wrench(self) -> Array:
        """Counts in one N or N mm of each axis, shape (6,), by the units, without `count_factor`."""
        return _COUNTS / np.repeat([_FORCES[self.numbers["cfgfu"]][1], _TORQUES[self.numbers["cfgtu"]][1]], 3)

    @property
    def scales(self) -> list[int]:
        """Full counts in one 16-bit count of the TCP port, for each axis."""
        return [int(np.ceil(rated / 32767)) for rated in self._rated * self.counts_per_wrench]

    @property
    def counts(self) -> int:
        """Counts in one unit."""
        return max(round(_COUNTS * self.count_factor), 1)

    def answer(self, target: str, status: int, counts: list[int]) -> tuple[int, str]:
        """Return (HTTP status, page) for a GET of `target`, with the box's present status and counts."""
        url = urlsplit(target)
        query = dict(parse_qsl(url.query))
        if url.path == "/netftapi2.xml":
            return 200, self._configuration(status, counts)
        if url.path == "/netftcalapi.xml":
            return 200, _page("netftCalibration", {"calsn": self._serial, "calcpf": self.counts, "calcpt": self.counts})
        if url.path in _SETTABLE:
            self._texts |= {name: query[name] for name in _TEXTS.get(url.path, ()) if name in query}
            for name, allowed in _SETTABLE[url.path].items():
                with contextlib.suppress(KeyError, ValueError):  # an invalid number is ignored, as in the real box
                    number = int(query[name])
                    if number in allowed and (name != "comrdtrate" or number <= self.product.ticks):
                        self.numbers[name] = number
            return 302, ""
        return 404, ""

    def _configuration(self, status: int, counts: list[int]) -> str:
        force, torque = _FORCES[self.numbers["cfgfu"]], _TORQUES[self.numbers["cfgtu"]]
        rated = self._rated / np.repeat([force[1], torque[1]], 3)
        elements = {
            "prodname": self.product.name,
            "mfgtxdmdl": "SI-36-0.5",
            "runstat": f"0x{status:08x}",
            "runft": _join(counts),
            "runsg": _join([0] * 6),
            "setbias": _join([self.numbers[f"setbias{i}"] for i in range(6)]),
            "setuserfilter": self.numbers["setuserfilter"],
            "setpke": self.numbers["setpke"],
            "setmce": 0,
            "setcfgsel": 0,
            "setrate": int(self.product.ticks),
            "cfgid": self._texts["cfgid"],
            "cfgnam": self._texts["cfgnam"],
            "cfgcalsel": 0,
            "cfgcalsn": self._serial,
            "cfgfu": self.numbers["cfgfu"],
            "scfgfu": force[0],
            "cfgtu": self.numbers["cfgtu"],
            "scfgtu": torque[0],
            "cfgcpf": self.counts,
            "cfgcpt": self.counts,
            "cfgmr": _join([f"{limit:.9g}" for limit in rated]),
            "cfgtdu": 3,
            "scfgtdu": "mm",
            "cfgtau": 1,
            "scfgtau": "degrees",
            "cfgtfx": _join([0] * 6),
            "comrdte": "Enabled" if self.streams else "Disabled",
            "comrdtrate": int(self.product.ticks / self.step),
            "comrdtbsiz": self.numbers["comrdtbsiz"],
        }
        if self.product.converter:
            elements["setadcrate"] = self.product.converter
        return _page("netft", elements)


def _join(values: list[int] | list[str]) -> str:
    return ";".join(str(value) for value in values)


def _page(root: str, elements: dict[str, str | int]) -> str:
    lines = "".join(f"<{name}>{escape(str(value))}</{name}>\n" for name, value in elements.items())
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<{root}>\n{lines}</{root}>\n'


_REASONS = {200: "OK", 302: "Found", 404: "Not Found"}


class Electronics:
    """The box without its ports. Times are the bench's [s]; a reading without its number has 32 bytes."""

    def __init__(self, bench: Bench, faults: Faults, *, rate: int, first_tick: int, product: Product) -> None:
        """Switch on at time 0 with the counter at `first_tick`."""
        self._bench = bench
        self._faults = faults
        self._rated = np.array(bench.settings.rated)
        self.pages = Pages(bench.serial, self._rated, rate, product)
        self._bias = np.zeros(6)  # software bias [N, N mm]
        self._power_up = 0.0  # when the counter was `_first_tick` [s]
        self._first_tick = first_tick
        self._last = bytes(32)  # the last reading streamed, repeated by a stalled converter

    def reboot(self, now: float) -> None:
        """Reset everything that is lost at power-off."""
        self._power_up, self._first_tick = now, 0
        self._bias = np.zeros(6)

    def tick(self, time: float) -> int:
        """Return the counter at `time`."""
        return self._first_tick + int((self._age(time) - self._age(self._power_up)) * self.pages.product.ticks)

    def time(self, tick: int) -> float:
        """Return the time at which the counter reaches `tick`."""
        return float(self.times([tick])[0])

    def times(self, ticks: list[int]) -> Array:
        """Return the times at which the counter reaches `ticks`."""
        ages = self._age(self._power_up) + (np.array(ticks) - self._first_tick) / self.pages.product.ticks
        return self._faults.instants(ages)

    def _age(self, time: float) -> float:
        return float(self._faults.device_time(np.array([time]))[0])

    def readings(self, ticks: list[int]) -> list[bytes]:
        """Return the packed counter, status and six counts at each of `ticks`."""
        if not ticks:
            return []
        times = self.times(ticks)
        status, counts = self._status_and_counts(times)
        records: list[bytes] = []
        for tick, time, word, six in zip(ticks, times.tolist(), status, counts.tolist(), strict=True):
            if not self._faults.active("stall", time):
                self._last = struct.pack(">II6i", tick % 2**32, word, *six)
            records.append(self._last)
        return records

    def set_bias(self, now: float) -> None:
        """Set the present load as zero."""
        self._bias = np.clip(self._bench.wrench(np.array([now]))[0], -self._rated, self._rated)

    def tcp_reply(self, request: bytes, now: float) -> bytes:
        """Return the reply to the 20 bytes of a TCP request; b"" for a command that is not simulated."""
        self.pages.count_factor = self._faults.count_factor(now)
        if request[0] == 0:  # READFT: counts in 16 bits, and system commands in the last two bytes
            if request[19] & 1:
                self.set_bias(now)
            status, counts = self._status_and_counts(np.array([now]))
            small = np.clip(np.rint(counts[0] / np.array(self.pages.scales)), -32768, 32767).astype(int).tolist()
            return struct.pack(">HH6h", 0x1234, status[0] >> 16, *small)
        if request[0] == 1:  # READCALINFO
            units = (self.pages.numbers["cfgfu"], self.pages.numbers["cfgtu"])
            return struct.pack(">HBBII6H", 0x1234, *units, self.pages.counts, self.pages.counts, *self.pages.scales)
        return b""

    def http_reply(self, request: bytes, now: float) -> bytes:
        """Return the reply to an HTTP request."""
        request_line = request.split(b"\r\n", 1)[0].decode("latin-1").split(" ")
        target = request_line[1] if len(request_line) == 3 and request_line[0] == "GET" else "/"
        if target.startswith("/rundata.cgi") and "cmd=bias" in target:
            self.set_bias(now)
        self.pages.count_factor = self._faults.count_factor(now)
        status, counts = self._status_and_counts(np.array([now]))
        code, page = self.pages.answer(target, status[0], counts[0].tolist())
        body = page.encode()
        header = f"HTTP/1.0 {code} {_REASONS[code]}\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n"
        return (header + ("Location: /index.htm\r\n" if code == 302 else "") + "\r\n").encode() + body

    def _status_and_counts(self, times: Array) -> tuple[list[int], Indices]:
        """Return the status (n) and the six counts (n, 6) at `times` (n,)."""
        wrench = self._faults.sensed_wrench(self._bench, times)
        saturation = self._faults.during("saturate", times)
        wrench[saturation] = self._rated  # the output of a clipped converter
        overloaded = saturation | np.any(np.abs(wrench) > self._rated, axis=1)
        counts = (np.clip(wrench, -self._rated, self._rated) - self._bias) * self.pages.counts_per_wrench
        counts *= np.array([self._faults.count_factor(time) for time in times.tolist()])[:, None]
        integers = np.clip(np.rint(counts), -(2**31), 2**31 - 1).astype(np.int64)
        saturated = self.pages.product.saturated
        flags = zip(overloaded.tolist(), times.tolist(), strict=True)
        return [(saturated if above else 0) | self._faults.status(time) for above, time in flags], integers
