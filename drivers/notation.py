"""Parsing of makers' notation: numbers with a decimal point, units by name, XML without declarations."""

import math
import re
from collections.abc import Mapping
from xml.etree import ElementTree

# FORCE and TORQUE: newtons, and newton millimetres, in one of each unit.
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_POUND = 4.4482216152605  # [N]
FORCE = {"N": 1.0, "kN": 1e3, "lb": _POUND, "lbf": _POUND, "klb": 1e3 * _POUND, "klbf": 1e3 * _POUND} | {
    "kg": 9.80665, "kgf": 9.80665, "g": 9.80665e-3, "gf": 9.80665e-3
}  # fmt: skip
TORQUE = {"Nmm": 1.0, "Nm": 1e3, "kNm": 1e6, "kgcm": 98.0665, "kgfcm": 98.0665} | {
    name: millimetres * _POUND
    for pound in ("lb", "lbf")
    for length, millimetres in (("in", 25.4), ("ft", 304.8))
    for name in (pound + length, length + pound)
}


def number(text: str) -> float:
    """Return a number with a decimal point, or nan for any other spelling, independent of the locale."""
    return float(text) if len(text) <= 40 and _NUMBER.fullmatch(text) else math.nan


def unit(text: str, units: Mapping[str, float]) -> float | None:
    """Return the size of a unit, ignoring case, blanks and separators; None where it is not among `units`.

    >>> unit("N-m", TORQUE), unit("lbf·in", TORQUE), unit("stone", FORCE)
    (1000.0, 112.98482902761668, None)
    """
    name = re.sub(r"[\s.·-]", "", text).lower()
    return next((size for spelling, size in units.items() if spelling.lower() == name), None)


class _Builder(ElementTree.TreeBuilder):
    """Refuses a document type before any of its entities expands."""

    def doctype(self, *_: object) -> None:
        raise ElementTree.ParseError("it declares a document type")


def parse_xml(data: bytes) -> ElementTree.Element:
    """Return the root of an XML document. Raises ValueError, with a message to follow the document's name."""
    parser = ElementTree.XMLParser(target=_Builder())
    try:
        parser.feed(data)
        return parser.close()
    except ElementTree.ParseError as error:
        raise ValueError(f"is not sound XML ({error})") from None
    except (LookupError, ValueError):
        raise ValueError("is in an unknown encoding") from None
