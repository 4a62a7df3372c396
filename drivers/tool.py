"""The user's tool transform: any transducer, its wrench about another point and other axes.

It is given in the address, `tool=dx,dy,dz,rx,ry,rz`: where the new origin lies in the transducer's own frame [mm], then
the turns about x, y and z [degrees], in the maker's order (`drivers.calibration.wrench_transform`). It comes after
whatever transform the calibration, or the box, holds itself. Raw readings stay as they are.
"""

import math
from dataclasses import replace

from drivers.address import Address, AddressError
from drivers.readings import ReadingBlock
from drivers.transducer import Health, Transducer, TransducerInfo

FARTHEST = 1000.0  # displacement that is believed [mm]
MOST = 360.0  # turn that is believed [degrees]

Tool = tuple[float, ...]  # (6,), or empty for none


def without_tool(address: Address) -> tuple[Address, Tool]:
    """Return the address without its tool option, and the tool. Raises AddressError where that is none."""
    text = address.options.get("tool")
    if text is None:
        return address, ()
    numbers = tuple(_number(part) for part in text.split(","))
    limits = (FARTHEST,) * 3 + (MOST,) * 3
    if len(numbers) != 6 or not all(abs(value) <= most for value, most in zip(numbers, limits, strict=True)):
        raise AddressError(
            f"{address.uri}: tool={text[:60]} must be six numbers, dx,dy,dz in mm (at most {FARTHEST:g}) and "
            f"rx,ry,rz in degrees (at most {MOST:g}), for example tool=0,0,-5,0,0,0"
        )
    options = {name: value for name, value in address.options.items() if name != "tool"}
    return replace(address, options=options), numbers if any(numbers) else ()


def with_tool(info: TransducerInfo, tool: Tool) -> TransducerInfo:
    """Return who the transducer is, its wrench as the tool transform says."""
    if not tool:
        return info
    words = "{:g} {:g} {:g} mm, {:g} {:g} {:g} degrees, as the address says".format(*tool)
    settings = {**info.settings, "user's tool transform": words}
    return replace(info, calibration=info.calibration.with_tool(tool), settings=settings)


class TransducerWithTool:
    """A transducer whose calibration holds the user's tool transform. All else is as it is without."""

    def __init__(self, inner: Transducer, tool: Tool) -> None:
        """Take an opened transducer."""
        self._inner = inner
        self.info = with_tool(inner.info, tool)

    @property
    def health(self) -> Health:
        """Totals so far."""
        return self._inner.health

    def start(self) -> None:
        """Begin streaming."""
        self._inner.start()

    def read(self, timeout: float) -> ReadingBlock:
        """Return all readings not yet handed over, raw as ever."""
        return self._inner.read(timeout)

    def stop(self) -> None:
        """End streaming."""
        self._inner.stop()

    def close(self) -> None:
        """Stop, and give everything back."""
        self._inner.close()


def _number(text: str) -> float:
    """Return a number as people write it, or nan."""
    try:
        return float(text) if text.isascii() and "_" not in text else math.nan
    except ValueError:
        return math.nan
