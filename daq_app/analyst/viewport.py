"""Where places of the finger lie in a picture, and back from a pixel to a place."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]  # left, right, below, above [mm]


@dataclass(frozen=True, slots=True)
class View:
    """A place in the world, where on the screen it lies, and the scale. Pixels count downwards."""

    x: float  # [mm]
    y: float  # [mm]
    across: float  # [pixel]
    down: float  # [pixel]
    per_mm: float  # [pixel/mm]

    @staticmethod
    def fitted(box: Box, left: float, top: float, width: float, height: float) -> "View":
        """Return the view that shows all of `box` at the foot of a rectangle of the screen [pixel]."""
        per_mm = min(width / (box[1] - box[0]), height / (box[3] - box[2]))
        middle = box[2] + height / per_mm / 2.0
        return View((box[0] + box[1]) / 2.0, middle, left + width / 2.0, top + height / 2.0, per_mm)

    def placed(self, points: Array) -> Array:
        """Return where points (n, 2) [mm] lie on the screen (n, 2) [pixel]."""
        return np.array([self.across, self.down]) + (points - [self.x, self.y]) * [self.per_mm, -self.per_mm]

    def place(self, across: float, down: float) -> tuple[float, float]:
        """Return the place [mm] at a pixel."""
        return self.x + (across - self.across) / self.per_mm, self.y - (down - self.down) / self.per_mm

    def visible(self, left: float, top: float, width: float, height: float) -> Box:
        """Return what a rectangle of the screen shows."""
        (x0, y1), (x1, y0) = self.place(left, top), self.place(left + width, top + height)
        return x0, x1, y0, y1
