"""What the simulated networked box remembers, and shows and lets be set on its web pages."""

from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COUNTS = 1_000_000  # counts in one unit of force, and in one of torque

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
_SETTABLE = {  # page: variables it accepts
    "/setting.cgi": {"setcfgsel", "setuserfilter", "setpke", *(f"setbias{i}" for i in range(6))},
    "/config.cgi": {"cfgid", "cfgnam", "cfgfu", "cfgtu"},
    "/comm.cgi": {"comrdte", "comrdtrate", "comrdtbsiz"},
}


@dataclass(frozen=True, slots=True)
class Product:
    """Which box is simulated."""

    name: str
    ticks: float  # of its own sampling in a second
    saturated: int  # status of a reading out of range
    converter: str  # what its pages say of its converter's rate; nothing where they do not


NET_FT = Product("SIMULATED Net F/T", 7000.0, 1 << 31 | 1 << 17, "")
AXIA = Product("SIMULATED Ethernet Axia80", 7812.5, 1 << 31 | 1 << 30, "7812")


class Pages:
    """The box's settings, kept over a reboot as the real one keeps them."""

    def __init__(self, serial: str, rated: Array, rate: int, product: Product = NET_FT) -> None:
        """Begin with the maker's settings: N and N-m, no filter, no bias."""
        self.product = product
        self._serial = serial
        self._rated = rated  # (6,) [N, N mm]
        self._kept = {"setuserfilter": "0", "setpke": "0", "cfgnam": "Nano43 SI-36-0.5", "cfgid": "default"}
        self._bias = [0] * 6
        self.counting = 1.0  # times as many counts to a unit as usual
        self.force_code = 2
        self.torque_code = 3
        self.buffered = 10  # records in a datagram of buffered streaming
        self.streams = True
        self.step = 1
        self._set_rate(rate)

    @property
    def counts_per_wrench(self) -> Array:
        """Counts in one N or N mm of each axis, shape (6,), by the units; `counting` is beyond it."""
        return COUNTS / np.repeat([_FORCES[self.force_code][1], _TORQUES[self.torque_code][1]], 3)

    @property
    def scales(self) -> list[int]:
        """What one of the six 16-bit counts of the TCP port stands for, in full counts."""
        return [int(np.ceil(rated / 32767)) for rated in self._rated * self.counts_per_wrench]

    @property
    def counts(self) -> int:
        """Counts in one unit."""
        return max(round(COUNTS * self.counting), 1)

    def answer(self, target: str, status: int, counts: list[int]) -> tuple[int, str]:
        """Return (HTTP status, page) for a GET of `target`, with the box's status and counts of this instant."""
        parts = urlsplit(target)
        query = dict(parse_qsl(parts.query))
        if parts.path == "/netftapi2.xml":
            return 200, self._configuration(status, counts)
        if parts.path == "/netftcalapi.xml":
            return 200, _page("netftCalibration", {"calsn": self._serial, "calcpf": self.counts, "calcpt": self.counts})
        if parts.path in _SETTABLE:
            for name in _SETTABLE[parts.path] & query.keys():
                self._set(name, query[name])
            return 302, ""
        return 404, ""

    def _configuration(self, status: int, counts: list[int]) -> str:
        force, torque = _FORCES[self.force_code], _TORQUES[self.torque_code]
        rated = self._rated / np.repeat([force[1], torque[1]], 3)
        elements = {
            "prodname": self.product.name,
            "mfgtxdmdl": "SI-36-0.5",
            "runstat": f"0x{status:08x}",
            "runft": _listed(counts),
            "runsg": _listed([0] * 6),
            "setbias": _listed(self._bias),
            "setuserfilter": self._kept["setuserfilter"],
            "setpke": self._kept["setpke"],
            "setmce": 0,
            "setcfgsel": 0,
            "setrate": int(self.product.ticks),
            "cfgid": self._kept["cfgid"],
            "cfgnam": self._kept["cfgnam"],
            "cfgcalsel": 0,
            "cfgcalsn": self._serial,
            "cfgfu": self.force_code,
            "scfgfu": force[0],
            "cfgtu": self.torque_code,
            "scfgtu": torque[0],
            "cfgcpf": self.counts,
            "cfgcpt": self.counts,
            "cfgmr": _listed([f"{r:.9g}" for r in rated]),
            "cfgtdu": 3,
            "scfgtdu": "mm",
            "cfgtau": 1,
            "scfgtau": "degrees",
            "cfgtfx": _listed([0] * 6),
            "comrdte": "Enabled" if self.streams else "Disabled",
            "comrdtrate": int(self.product.ticks / self.step),
            "comrdtbsiz": self.buffered,
        }
        if self.product.converter:
            elements["setadcrate"] = self.product.converter
        return _page("netft", elements)

    def _set(self, name: str, text: str) -> None:
        """Take one value, or leave all as it is where the value makes no sense, as the box does."""
        if name in ("cfgid", "cfgnam"):
            self._kept[name] = text
            return
        if name == "comrdte":
            self.streams = text in ("1", "Enabled")
            return
        try:
            value = int(text)
        except ValueError:
            return
        if name == "comrdtrate" and 1 <= value <= self.product.ticks:
            self._set_rate(value)
        elif name == "comrdtbsiz" and 1 <= value <= 40:
            self.buffered = value
        elif name == "cfgfu" and value in _FORCES:
            self.force_code = value
        elif name == "cfgtu" and value in _TORQUES:
            self.torque_code = value
        elif name.startswith("setbias") and -32768 <= value <= 32767:
            self._bias[int(name[-1])] = value
        elif name in self._kept and 0 <= value <= 12:
            self._kept[name] = text

    def _set_rate(self, rate: int) -> None:
        """Send every so-many-th tick, at `rate` readings a second or the next higher rate that divides the ticks."""
        self.step = int(self.product.ticks // rate)


def _listed(values: list[int] | list[str]) -> str:
    return ";".join(str(value) for value in values)


def _page(root: str, elements: dict[str, str | int]) -> str:
    lines = "".join(f"<{name}>{escape(str(value))}</{name}>\n" for name, value in elements.items())
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<{root}>\n{lines}</{root}>\n'
