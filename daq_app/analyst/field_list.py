"""The fields that are drawn over the finger: their names, units and ranges of colour."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq_app.analyst.frame import TOP, Frame, step_above
from daq_app.wording import tr, tr_noop
from solver.quantities import FIELDS, SED

Array = NDArray[np.float64]
Range = tuple[float, float]
FIELD_ERRORS = tr_noop(
    "Fields, at every place: no estimate of the mesh's or the model's error. The SED over the finger has both."
)

NEVER_NEGATIVE = (SED.name, "von_mises", "displacement")


@dataclass(frozen=True, slots=True)
class FieldChoice:
    """A field as people read it."""

    name: str  # among the values of a frame
    label: str
    unit: str  # "kPa", "mm", or "-" for a strain
    factor: float  # from the solver's unit to this one
    signed: bool

    def of(self, frame: Frame) -> Array:
        """Return the field at the nodes of a frame (n,), in its own unit; nan where the frame has none."""
        values = frame.values.get(self.name)
        return np.full(len(frame.nodes), np.nan) if values is None else self.factor * values

    def words(self, value: float) -> str:
        """Return a value with its unit."""
        return f"{tr(self.label)} {value:.4g} {self.unit}".removesuffix(" -").replace(" -", " −")

    @property
    def axis(self) -> str:
        """What an axis of it says."""
        return f"{tr(self.label)} [{self.unit}]"


FIELD_CHOICES = (
    *(
        FieldChoice(
            one.name,
            one.label,
            "kPa" if one.unit == "MPa" else one.unit,
            1000.0 if one.unit == "MPa" else 1.0,
            one.name not in NEVER_NEGATIVE,
        )
        for one in FIELDS
    ),
    FieldChoice("displacement", tr_noop("displacement from the bone"), "mm", 1.0, signed=False),
)


def automatic_range(field: FieldChoice, frames: Iterable[Frame]) -> Range:
    """Return where the colours of frames begin and end: few nodes lie beyond; nought is the middle of signed ones."""
    tops = [0.0]
    for frame in frames:
        values = np.abs(field.of(frame))
        known = values[np.isfinite(values)]
        if len(known):
            tops.append(float(np.quantile(known, TOP)))
    high = step_above(max(tops))
    return (-high if field.signed else 0.0), high
