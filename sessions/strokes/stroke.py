"""A stroke: the touching movement inside a trial, with its numbers and what is wrong with them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class StrokeCurve:
    """The course of a stroke with some time around it; n readings. nan where a value means nothing. Read-only."""

    time: Array  # (n,) [s, device time]
    normal: Array  # (n,) filtered normal force [N]
    unfiltered: Array  # (n,) the same as it was felt, not filtered: by it the contact's onset is told [N]
    tangential: Array  # (n,) filtered tangential force [N]
    force: Array  # (n, 2) filtered force along x and y of the face [N]
    ratio: Array  # (n,) T/N [-]
    position: Array  # (n, 2) centre of pressure [mm]
    speed: Array  # (n,) of the centre of pressure [mm/s]
    noise: tuple[float, float]  # standard deviations of each force sideways, and along the normal, unloaded [N]
    quiet: float  # how long that was seen [s]
    crests: Array | None = None  # (n,) unfiltered tangential force [N], where the contact sticks and slips
    crest_noise: float = 0.0  # its standard deviation, unloaded [N]
    crest_missed: float = 0.0  # how far readings may miss its greatest value [N]

    def __post_init__(self) -> None:
        """Make the columns read-only views."""
        for column in fields(self)[:8]:
            view = getattr(self, column.name).view()
            view.flags.writeable = False
            object.__setattr__(self, column.name, view)


@dataclass(frozen=True, slots=True, eq=False)
class Stroke:
    """One stroke. None stands where the recording allows no honest number; `flaws` says why."""

    trial: int | None  # None where the recording has no trials
    onset: float | None  # [s, device time]; None where the recording begins in contact, or no zero is known
    lift: float | None  # [s, device time]; None where it ends in contact, or no zero is known
    steady: Interval | None  # steady window [s, device time]
    break_away: float | None  # where T/N stops climbing, by a change point [s, device time]; None: no stick phase
    slide_onset: float | None  # from here on the centre of pressure slides [s, device time], where that is seen
    direction: int | None  # +1 proximal to distal (along +x of the face frame), -1 back
    direction_from: str | None  # "centre of pressure", "tangential force" or "decision"
    heading: float | None  # angle of the movement, or else of the drag, from +x towards +y of the face [degrees]
    speed: float | None  # slope of the centre of pressure on time over the steady window [mm/s]
    speed_error: float | None  # its standard error [mm/s]
    mu_static: float | None  # height of the static peak [-]; None where none stands out
    mu_dynamic: float | None  # mean of T/N over the steady window [-]
    mu_dynamic_sd: float | None  # standard deviation of T/N in it [-]
    mu_dynamic_interval: Interval | None  # the bootstrap's: see `BootstrapSettings.kind`
    mu_max: float | None  # greatest T/N above the force floor, smoothed as the settings say [-]
    tau_max: float | None  # greatest tangential force over the contact area there [MPa]
    normal_force: float | None  # mean over the steady window [N]
    tangential_force: float | None  # mean over the steady window [N]
    peak_normal: float | None  # [N]
    peak_tangential: float | None  # [N]
    readings: int  # in the steady window
    zero: str  # where the zero came from
    zero_drift: float | None  # how far the forces' zero moved from before the stroke to after it [N]
    flaws: tuple[str, ...]
    reasons: Mapping[str, str]  # for each number withheld, the flaw that forbids it
    contact_area: float | None = None  # by which tau_max was told [mm2]
    area_exponent: float = 0.0  # with which that area follows the normal force [-]
    number: int = 1  # within its trial, or within a recording without trials, from 1
    kept: bool = True  # False: a person left it out, and the model does not get it
    decided: Mapping[str, str] = field(default_factory=dict[str, str])  # what a person decided, with who and why
    curve: StrokeCurve | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the stroke as plain data, without its curve."""
        return {column.name: getattr(self, column.name) for column in fields(self) if column.name != "curve"}
