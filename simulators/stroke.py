"""Stimuli of known friction, the ten of the paper, and the course of a simulated stroke over one."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from drivers.arrays import Array

CONTACT_AREA = 100.0  # [mm2] 1 cm², by which the paper divides the greatest tangential force


@dataclass(frozen=True, slots=True)
class Surface:
    """A flat stimulus: its friction, and the stroke of the paper's subject over it."""

    mu: float  # coefficient of friction, independent of force and speed [-]
    descriptor: str = "stickiness"
    index: int = 50  # its maker's number on the descriptor, 0 to 100
    tau_max: float = 0.02  # greatest tangential force of the stroke over CONTACT_AREA [MPa]
    speed: float = 20.0  # speed of the stroke [mm/s]
    direction: int = 1  # of the stroke: +1 proximal to distal, -1 distal to proximal
    holds: bool = True  # the surface blocks the finger first, so T/N climbs to mu before the slide

    def __post_init__(self) -> None:
        if not (self.mu > 0.0 and self.tau_max > 0.0 and self.speed > 0.0):
            raise ValueError(
                f"surface needs mu, tau_max and speed above 0, not {self.mu}, {self.tau_max}, {self.speed}"
            )
        if self.direction not in (1, -1):
            raise ValueError(f"surface has direction {self.direction}, which must be 1 or -1")

    @property
    def peak_normal_force(self) -> float:
        """Normal force at which friction reaches the stroke's greatest tangential force [N].

        >>> round(Surface(mu=0.28, tau_max=0.008033).peak_normal_force, 2)
        2.87
        """
        return self.tau_max * CONTACT_AREA / self.mu


# Tables 1 and 2 of the paper. tau_max is headed 1e-4 MPa there; with the stated 1 cm² the exponent must belong to
# pascals (0.8 N, not 0.008 N, of tangential force), so the numbers here are the printed ones times 1e4 Pa.
_TABLE_1 = {  # index: mu [-], tau_max [MPa], speed [mm/s]
    0: (0.28, 0.008033, 20.0),
    20: (0.44, 0.015478, 22.0),
    50: (0.48, 0.019038, 21.0),
    80: (0.64, 0.049998, 17.5),
    100: (0.67, 0.05255, 15.0),
}
_TABLE_2 = {
    0: (0.62, 0.04707, 13.0),
    20: (0.55, 0.042404, 33.0),
    55: (0.44, 0.03009, 39.0),
    75: (0.52, 0.0260, 38.0),
    100: (0.24, 0.00877, 39.0),
}


def paper_surfaces() -> Mapping[tuple[str, int], Surface]:
    """Return the ten surfaces of the paper's Tables 1 and 2 by (descriptor, index).

    Stickiness is judged proximal to distal, where the surface blocks the finger first; slipperiness distal to
    proximal, where the finger slides immediately (the paper's section 3).
    """
    surfaces = {
        (descriptor, index): Surface(mu, descriptor, index, tau_max, speed, direction, holds=direction == 1)
        for descriptor, direction, table in (("stickiness", 1, _TABLE_1), ("slipperiness", -1, _TABLE_2))
        for index, (mu, tau_max, speed) in table.items()
    }
    return MappingProxyType(surfaces)


PRESS = 0.10  # from touch to full normal force [s]
RELEASE = 0.12  # from full normal force to lift [s]
SPEED_UP = 0.15  # from rest to full speed [s]
ROLL = 0.3  # movement of the centre of pressure by rolling while the skin sticks [mm]


@dataclass(frozen=True, slots=True)
class Stroke:
    """Motion and force of one stroke. Times count from its beginning, before contact."""

    peak_normal_force: float  # reached once, in the slide [N]
    speed: float  # mean over the steady slide [mm/s]
    direction: int = 1  # +1 proximal to distal, -1 distal to proximal
    approach: float = 0.7  # before the touch: the unloaded stretch [s]
    stick: float = 0.5  # from touch to slide where the surface holds the finger; otherwise 0 is used [s]
    slide: float = 2.0  # from the first slip to the lift [s]
    peak_at: float = 0.55  # instant of the normal force's peak, as a share of the slide [-]
    peak_width: float = 0.25  # duration of the peak [s]
    sag: float = 0.35  # mean drop of the normal force below its peak, away from it [-]
    wander: float = 0.12  # amplitude of its wandering about that level [-]
    speed_wander: float = 0.05  # amplitude of the speed's wandering about its mean [-]
    phases: tuple[float, ...] = (0.3, 2.1, 4.4)  # three, of the wandering [rad]
    slant: float = 0.0  # angle of the path with the x axis [degrees]
    across: float = 0.0  # y of the path at x = 0 [mm]

    def __post_init__(self) -> None:
        if self.peak_normal_force <= 0.0 or self.speed <= 0.0 or self.approach < 0.0 or self.stick < 0.0:
            raise ValueError("a stroke needs a force and a speed above 0, and no time below 0")
        if self.direction not in (1, -1):
            raise ValueError(f"a stroke has direction {self.direction}, which must be 1 or -1")
        if self.slide < 0.8 or not 0.35 <= self.peak_at <= 0.75:
            raise ValueError("a stroke slides for at least 0.8 s and peaks between 0.35 and 0.75 of the slide")
        if not 0.0 <= self.wander < self.sag <= 0.8 - self.wander:
            raise ValueError("wander must lie below sag, and both together below 0.8, or the peak is not the greatest")


@dataclass(frozen=True, slots=True)
class Course:
    """A stroke over a surface: forces and position at any time since the stroke began."""

    stroke: Stroke
    mu: float  # of the surface [-]
    holds: bool  # the surface blocks the finger before it slides

    @property
    def touch(self) -> float:
        """First instant of contact [s]."""
        return self.stroke.approach

    @property
    def slip(self) -> float:
        """Instant from which the whole contact slides [s]."""
        return self.touch + (self.stroke.stick if self.holds else 0.0)

    @property
    def lift(self) -> float:
        """Last instant of contact [s]."""
        return self.slip + self.stroke.slide

    @property
    def peak(self) -> float:
        """Instant of the greatest normal force [s]."""
        return self.slip + self.stroke.peak_at * self.stroke.slide

    @property
    def steady(self) -> tuple[float, float]:
        """Stretch in which the finger slides at its full speed and presses fully [s]."""
        return self.slip + max(SPEED_UP, 0.0 if self.holds else PRESS), self.lift - RELEASE

    def normal_force(self, time: Array) -> Array:
        """Return N (n,) [N] at `time` (n,) [s]: minimum-jerk press and release, and a level with one peak."""
        stroke = self.stroke
        first, second, _ = stroke.phases
        since = time - self.touch
        wander = 0.6 * np.sin(2 * np.pi * 0.9 * since + first) + 0.4 * np.sin(2 * np.pi * 2.3 * since + second)
        away = 1.0 - np.exp(-0.5 * ((time - self.peak) / stroke.peak_width) ** 2)
        level = 1.0 - away * (stroke.sag + stroke.wander * wander)
        press = minimum_jerk(since / PRESS) * (1.0 - minimum_jerk((time - self.lift + RELEASE) / RELEASE))
        return stroke.peak_normal_force * level * press

    def ratio(self, time: Array) -> Array:
        """Return T/N (n,) [-]: a straight climb from touch to slip where the surface holds, then mu."""
        if not self.holds or self.stroke.stick == 0.0:
            return np.full_like(time, self.mu)
        return self.mu * np.clip((time - self.touch) / self.stroke.stick, 0.0, 1.0)

    def position(self, time: Array) -> Array:
        """Return the centre of pressure along the path (n,) [mm], positive in the stroke's direction.

        While the skin sticks the finger only rolls; then speed rises with minimum jerk and wanders about its mean.
        """
        stroke = self.stroke
        sliding = np.maximum(time - self.slip, 0.0)
        rate = 2 * np.pi * 1.3  # of the wandering [rad/s]
        sway = stroke.speed * stroke.speed_wander / rate * np.sin(rate * sliding + stroke.phases[2])
        travel = stroke.speed * _jerk_integral(sliding, SPEED_UP) + sway * minimum_jerk(sliding / 0.3)
        roll = ROLL * self.ratio(time) / self.mu if self.holds else 0.0
        return travel + roll - 0.5 * stroke.speed * stroke.slide


def minimum_jerk(phase: Array) -> Array:
    """Return 0 before phase 0, 1 after phase 1, and a minimum-jerk rise between (Flash and Hogan, 1985, eq. 4).

    >>> minimum_jerk(np.array([-1.0, 0.0, 0.5, 1.0, 2.0]))
    array([0. , 0. , 0.5, 1. , 1. ])
    """
    u = np.clip(phase, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _jerk_integral(time: Array, rise: float) -> Array:
    """Return the integral of `minimum_jerk(t / rise)` from 0 to `time` >= 0 [s]."""
    u = np.minimum(time / rise, 1.0)
    return rise * u**4 * (2.5 - 3.0 * u + u**2) + np.maximum(time - rise, 0.0)
