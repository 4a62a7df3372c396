"""Outline of the finger: points by arc position along the skin and depth below it, in the world.

The arc position is measured on the undeformed skin from the point of first touch, positive towards the tip. In the
world the surface is y = 0, the finger above it, first touch at the origin, and +x runs from proximal to distal.
"""

from dataclasses import dataclass
from math import cos, pi, radians, sin
from typing import Self

import numpy as np

from solver.arrays import Array
from solver.scene.scene import Finger


@dataclass(frozen=True, slots=True)
class Outline:
    """Where things lie on one finger. Arc positions and depths in mm; any shape, broadcast together."""

    finger: Finger
    palmar_cut: float  # arc position of the cut's palmar end
    palmar: float  # where the palmar straight edge meets the tip's arc
    dorsal: float  # where the tip's arc meets the dorsal straight edge
    dorsal_cut: float  # arc position of the cut's dorsal end
    touch: float  # angle of first touch on the tip's arc, finger frame [rad]

    @classmethod
    def of(cls, finger: Finger) -> Self:
        """Measure the outline of `finger`.

        >>> o = Outline.of(Finger())
        >>> round(o.palmar, 4), round(o.dorsal, 4)  # an eighth and three eighths of a circle of radius 5
        (-3.927, 11.781)
        """
        touch = radians(finger.contact_angle) - pi / 2
        palmar = finger.tip_radius * (-pi / 2 - touch)
        dorsal = finger.tip_radius * (pi / 2 - touch)
        return cls(finger, palmar - finger.shaft_length, palmar, dorsal, dorsal + finger.shaft_length, touch)

    @property
    def nail_end(self) -> float:
        """Arc position of the proximal end of the nail plate, which begins where the tip's arc ends [mm]."""
        return self.dorsal + self.finger.nail_length

    def angle(self, arc: Array) -> Array:
        """Return the angle on the tip's arc [rad]; on a straight edge, that of its end."""
        return np.asarray(self.touch + np.clip(arc, self.palmar, self.dorsal) / self.finger.tip_radius)

    def _course(self, arc: Array) -> tuple[Array, Array]:
        """Return the angle on the tip's arc [rad], and the distance back along a straight edge [mm], 0 on the arc."""
        angle = self.angle(arc)
        back = np.maximum(self.palmar - arc, 0.0) + np.maximum(arc - self.dorsal, 0.0)
        return angle, back

    def tissue(self, arc: Array, depth: Array) -> Array:
        """Return the points (..., 2) at `depth` below the skin at `arc`, along the skin's inward normal.

        >>> Outline.of(Finger()).tissue(np.array(0.0), np.array([0.0, 1.9])).round(12)
        array([[0. , 0. ],
               [0. , 1.9]])
        """
        angle, back = self._course(arc)
        radius = self.finger.tip_radius - depth
        return self.world(radius * np.cos(angle) - back, radius * np.sin(angle))

    def tangent(self, arc: Array) -> Array:
        """Return the directions (..., 2) of the skin at `arc`, towards the tip: unit vectors in the world.

        >>> Outline.of(Finger()).tangent(np.array([0.0, -20.0])).round(4)  # at first touch, and on the palmar side
        array([[ 1.    ,  0.    ],
               [ 0.7071, -0.7071]])
        """
        angle = self.angle(arc)
        return self._turned(-np.sin(angle), np.cos(angle))

    def bone(self, arc: Array, part: Array | float = 1.0) -> Array:
        """Return the points (..., 2) of the bone's outline that the mesh pairs with `arc` on the skin.

        With `part`, those inside the bone at this part of its radius.
        """
        angle, back = self._course(arc)
        (x, y), length = self.finger.bone_centre, self.finger.shaft_length
        r = self.finger.bone_radius * part
        return self.world(x + r * np.cos(angle) - back * (x + length) / length, y + r * np.sin(angle))

    def world(self, x: Array, y: Array) -> Array:
        """Return the points (..., 2) of the world for finger coordinates `x`, `y`."""
        return self._turned(x, y) + np.array([0.0, self.finger.tip_radius])

    def _turned(self, x: Array, y: Array) -> Array:
        """Return vectors (..., 2) of the finger frame in the world."""
        angle = radians(self.finger.contact_angle)
        return np.stack([x * cos(angle) + y * sin(angle), y * cos(angle) - x * sin(angle)], axis=-1)

    def along(self, arc: Array | float, depth: float, distance: Array | float) -> Array:
        """Return the arc positions that lie `distance` from `arc`, measured at `depth` below the skin.

        On the tip's arc a length at depth 1.9 is 3.1/5 of the skin's above it; on straight skin they are equal.

        >>> Outline.of(Finger()).along(0.0, 1.9, np.array([-0.5, 0.5])).round(4)
        array([-0.8065,  0.8065])
        """
        ratio = 1.0 - depth / self.finger.tip_radius
        skin = np.array([self.palmar_cut, self.palmar, self.dorsal, self.dorsal_cut])
        below = np.array([self.palmar - self.finger.shaft_length, self.palmar, 0.0, 0.0])
        below[2] = self.palmar + ratio * (self.dorsal - self.palmar)
        below[3] = below[2] + self.finger.shaft_length
        return np.asarray(np.interp(np.interp(arc, skin, below) + distance, below, skin))
