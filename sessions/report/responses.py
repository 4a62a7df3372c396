"""How a quantity at the ending is told: its label, and its numbers in the unit that people read."""

import math
from dataclasses import dataclass

from sessions.prediction import BY_NAME, SED, shown_unit
from sessions.report.contents import Numbers, PredictionFinding
from sessions.report.wording import digits


@dataclass(frozen=True, slots=True)
class ShownResponse:
    """One of `solver.quantities` as pages and figures show it."""

    name: str
    label: str
    kept_unit: str  # of the numbers in files: "MPa", or "-" for a strain
    unit: str  # of the numbers shown: "kPa", or "1"
    factor: float  # a number shown by one kept
    places: int  # decimals of a number shown
    step: str  # unit of a slope on scores or indices, which is a millionth of the kept one

    def text(self, shown: float) -> str:
        """Return a number of the shown unit with that unit.

        >>> shown_response("sed").text(9.5528), shown_response("shear_along_skin").text(-0.25)
        ('9.553 kPa', '−0.2500')
        """
        return digits(shown, self.places) + ("" if self.unit == "1" else f" {self.unit}")

    def of(self, prediction: PredictionFinding) -> Numbers | None:
        """Return a prediction's number in the kept unit, and its error where it has one; None without one."""
        if self.name == SED.name:
            error = prediction.error_estimate
            if prediction.sed is None:
                return None
            return (prediction.sed,) if error is None else (prediction.sed, abs(prediction.sed) * error)
        if self.name not in prediction.responses:
            return None
        value, error = prediction.responses[self.name]
        return (value, error) if math.isfinite(error) else (value,)


def shown_response(name: str) -> ShownResponse:
    """Return how the quantity of that name is told; the names are those of `solver.quantities`."""
    one = BY_NAME[name]
    unit, factor = shown_unit(one)
    places, step = (3, "Pa") if unit == "kPa" else (4, "10⁻⁶")
    return ShownResponse(one.name, one.label, one.unit, unit, factor, places, step)
