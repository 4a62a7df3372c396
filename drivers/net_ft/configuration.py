"""The page with the networked box's identity: netftapi2.xml (manual 9620-05-NET FT, chapter 9)."""

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from drivers.arrays import Array
from drivers.calibration import Calibration
from drivers.net_ft.wire import AXIA, COUNTER_RATE, NET_FT
from drivers.notation import FORCE, TORQUE, number, parse_xml, unit
from drivers.transducer import SetupError, StatusTable, TransducerInfo

_CUT_OFFS = (838, 326, 152, 73, 35, 18, 8, 5, 1500, 2000, 2500, 3000)  # of the low-pass filters, by code from 1 [Hz]
_FILTERS = {"0": "off"} | {str(code): f"{cut_off} Hz" for code, cut_off in enumerate(_CUT_OFFS, 1)}


class Configuration(NamedTuple):
    """The box's info and active configuration."""

    info: TransducerInfo
    counts: tuple[float, float]  # in one force unit, and in one torque unit
    streams: bool  # false when its real-time output is switched off


def parse_configuration(page: bytes, uri: str) -> Configuration:
    """Parse netftapi2.xml of the box at `uri`. Raises SetupError where it is incomplete or contradictory."""
    elements = _elements(page)
    product = _required(elements, "prodname")
    status = AXIA if "axia" in product.lower() else NET_FT
    ticks = _ticks(_optional(elements, "setadcrate")) if status is AXIA else COUNTER_RATE
    settings = {
        "configuration": _optional(elements, "cfgnam"),
        "filter": _FILTERS.get(code := _optional(elements, "setuserfilter"), code),  # an unknown code as it is
        "stored bias [gauge counts]": " ".join(re.split(r"[;,\s]+", _optional(elements, "setbias"))),
        "tool transform": _transform(elements),
        "status at opening": _status(_optional(elements, "runstat"), status),
        "records in a datagram, when buffered": _optional(elements, "comrdtbsiz"),
    }
    if status is AXIA:
        settings["time"] = (
            "its counter is taken to tick at its converter's rate, which no manual says: held against this computer's "
            "clock while it streams"
        )
    counts = _positive("cfgcpf", _required(elements, "cfgcpf")), _positive("cfgcpt", _required(elements, "cfgcpt"))
    force, torque = _required(elements, "scfgfu"), _required(elements, "scfgtu")
    units = np.repeat([_unit("force", force, FORCE), _unit("torque", torque, TORQUE)], 3)
    serial = _optional(elements, "cfgcalsn")  # of the active calibration; empty where the box states none
    matrix, rated = np.diag(units / np.repeat(counts, 3)), _ratings(elements) * units
    info = TransducerInfo(
        uri=uri,
        driver="net-ft",
        # The transducer's model as stated by the box, which is not always right.
        model=" ".join(filter(None, (product, _optional(elements, "mfgtxdmdl")))),
        serial=serial,
        simulated="SIMULATED" in product.upper(),
        rate=_rate(_optional(elements, "comrdtrate"), ticks),
        counter_rate=ticks,
        calibration=Calibration(serial, "counts", matrix, rated, f"counts per unit read from {product}"),
        settings={name: value for name, value in settings.items() if value},
        status=status,
    )
    return Configuration(info, counts, _optional(elements, "comrdte").lower() != "disabled")


def true_rate(nominal: float, ticks: float = COUNTER_RATE) -> float:
    """Return the true rate of the box when it is set to, or shows, `nominal` [Hz].

    The box can only send every k-th of its own readings, `ticks` a second. It rounds up to such a rate, and shows it as
    an integer.

    >>> true_rate(200), round(true_rate(150), 2), round(true_rate(152), 2)
    (200.0, 152.17, 152.17)
    """
    return ticks / max(math.floor(ticks / nominal + 1e-9), 1)


def _elements(page: bytes) -> dict[str, list[str]]:
    """Return the texts of all elements without children, by name."""
    try:
        root = parse_xml(page)
    except ValueError as error:
        raise SetupError(f"the box's configuration page {error}; check the address and try again") from None
    if root.tag != "netft":
        raise SetupError(f"the box's configuration page is <{root.tag[:20]}> and not <netft>; check the address")
    elements: dict[str, list[str]] = {}
    for element in root.iter():
        if not len(element):
            elements.setdefault(element.tag, []).append((element.text or "").strip())
    return elements


def _required(elements: Mapping[str, list[str]], name: str) -> str:
    """Return the text of an element that must be there exactly once."""
    texts = elements.get(name, [])
    if len(texts) != 1 or not texts[0]:
        verb = "does not say" if not any(texts) else "says more than once"
        raise SetupError(f"the box's configuration page {verb} what {name} is; check the address and the box's set-up")
    return texts[0]


def _optional(elements: Mapping[str, list[str]], name: str) -> str:
    """Return the text of an element, or "" where it is missing or repeated."""
    texts = elements.get(name, [])
    return texts[0] if len(texts) == 1 else ""


def _positive(name: str, text: str) -> float:
    value = number(text)
    if not (math.isfinite(value) and value > 0.0):
        raise SetupError(
            f"the box says {name} is {text[:40]!r}, which must be a number above 0; check its configuration"
        )
    return value


def _unit(dimension: str, text: str, units: Mapping[str, float]) -> float:
    size = unit(text, units)
    if size is None:
        raise SetupError(
            f"the box gives {dimension} in {text[:20]!r}, a unit unknown here; choose N and N-m on its own page"
        )
    return size


def _ratings(elements: Mapping[str, list[str]]) -> Array:
    """Return six rated ranges in the box's units, nan where it states none."""
    values = np.array([number(piece) for piece in re.split(r"[;,\s]+", _optional(elements, "cfgmr")) if piece])
    return values if len(values) == 6 and np.all(np.isfinite(values) & (values > 0.0)) else np.full(6, np.nan)


def _rate(text: str, ticks: float) -> float:
    value = number(text)
    return true_rate(value, ticks) if 1.0 <= value <= max(ticks, COUNTER_RATE) else math.nan


def _ticks(text: str) -> float:
    """Return the rate of an Axia's converter [Hz], stated as an integer. Raises SetupError for unknown rates."""
    rates = {"488": 488.28125, "976": 976.5625, "1953": 1953.125, "3906": 3906.25, "7812": 7812.5}
    if text not in rates:
        raise SetupError(f"the box says its converter runs at {text[:20]!r} Hz, not at one of {', '.join(rates)}")
    return rates[text]


def _transform(elements: Mapping[str, list[str]]) -> str:
    """Return the active tool transform with its units, "" without one."""
    values = [piece for piece in re.split(r"[;,\s]+", _optional(elements, "cfgtfx")) if piece]
    if not any(number(value) != 0.0 for value in values):
        return ""
    units = f"{_optional(elements, 'scfgtdu')}, {_optional(elements, 'scfgtau')}".strip(", ")
    return f"{' '.join(values)} [{units}]"


def _status(text: str, table: StatusTable) -> str:
    if not re.fullmatch(r"0x[0-9a-fA-F]{1,8}", text):
        return text
    return "; ".join(table.words(int(text, 16))) or "healthy"
