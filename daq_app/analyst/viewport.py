"""Which part of the finger a picture shows: moved and zoomed, and back from a pixel to a place."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]  # left, right, below, above [mm]

# Pixels to a millimetre. At the least a finger is some 20 pixels wide; at the most a pixel is half a micrometre,
# which is finer than any element of a mesh.
LEAST, MOST = 1.0, 2000.0


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
        per_mm = max(min(width / (box[1] - box[0]), height / (box[3] - box[2])), LEAST)
        middle = box[2] + height / per_mm / 2.0
        return View((box[0] + box[1]) / 2.0, middle, left + width / 2.0, top + height / 2.0, per_mm)

    def placed(self, points: Array) -> Array:
        """Return where points (n, 2) [mm] lie on the screen (n, 2) [pixel]."""
        return np.array([self.across, self.down]) + (points - [self.x, self.y]) * [self.per_mm, -self.per_mm]

    def place(self, across: float, down: float) -> tuple[float, float]:
        """Return the place [mm] at a pixel."""
        return self.x + (across - self.across) / self.per_mm, self.y - (down - self.down) / self.per_mm

    def moved(self, across: float, down: float) -> "View":
        """Return the view after the picture was moved by so many pixels."""
        return replace(self, x=self.x - across / self.per_mm, y=self.y + down / self.per_mm)

    def zoomed(self, factor: float, across: float, down: float) -> "View":
        """Return the view `factor` times as large; what is at the pixel stays there."""
        x, y = self.place(across, down)
        return replace(self, x=x, y=y, across=across, down=down, per_mm=min(max(self.per_mm * factor, LEAST), MOST))

    def visible(self, left: float, top: float, width: float, height: float) -> Box:
        """Return what a rectangle of the screen shows."""
        (x0, y1), (x1, y0) = self.place(left, top), self.place(left + width, top + height)
        return x0, x1, y0, y1
