"""A stroke: the touching movement inside a trial, with its numbers and what is wrong with them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, NamedTuple, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Interval = tuple[float, float]


class Meaning(NamedTuple):
    """What a number is, in the tables of an export."""

    unit: str  # "" for none
    words: str


@dataclass(frozen=True, slots=True, eq=False)
class StrokeCurve:
    """The course of a stroke with some time around it; n readings. nan where a value means nothing. Read-only."""

    time: Array  # (n,) [s, device time]
    normal: Array  # (n,) filtered normal force [N]
    unfiltered: Array  # (n,) the same before filtering, from which the onset of contact is found [N]
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

    trial: Annotated[int | None, Meaning("", "number of its trial")]  # None where the recording has no trials
    # No onset where the recording begins in contact, no lift where it ends in contact, neither where no zero is known.
    onset: Annotated[float | None, Meaning("s", "first contact, device clock")]
    lift: Annotated[float | None, Meaning("s", "end of contact, device clock")]
    steady: Annotated[Interval | None, Meaning("s", "steady window, device clock")]
    # None where there is no stick phase
    break_away: Annotated[
        float | None, Meaning("s", "end of the stick phase: where T/N stops climbing, a change point, device clock")
    ]
    slide_onset: Annotated[float | None, Meaning("s", "from here on the centre of pressure slides, device clock")]
    # Along +x of the face frame is +1.
    direction: Annotated[int | None, Meaning("", "+1 proximal to distal, -1 back, as measured")]
    # "centre of pressure", "tangential force" or "decision"
    direction_from: Annotated[str | None, Meaning("", "what the direction was derived from")]
    heading: Annotated[
        float | None, Meaning("deg", "angle of the movement, or else of the drag, from +x towards +y of the face")
    ]
    speed: Annotated[float | None, Meaning("mm/s", "of the centre of pressure over the steady window")]
    speed_error: Annotated[float | None, Meaning("mm/s", "standard error of the speed")]
    mu_static: Annotated[float | None, Meaning("", "height of the static peak of T/N")]  # None where none stands out
    mu_dynamic: Annotated[float | None, Meaning("", "mean of T/N over the steady window")]
    mu_dynamic_sd: Annotated[float | None, Meaning("", "standard deviation of T/N over the steady window")]
    # The bootstrap's: see `BootstrapSettings.kind`.
    mu_dynamic_interval: Annotated[Interval | None, Meaning("", "confidence interval of mu_dynamic")]
    mu_max: Annotated[float | None, Meaning("", "greatest T/N")]  # smoothed as the settings say
    tau_max: Annotated[float | None, Meaning("MPa", "greatest tangential force over the contact area")]
    normal_force: Annotated[float | None, Meaning("N", "mean over the steady window")]
    tangential_force: Annotated[float | None, Meaning("N", "mean over the steady window")]
    peak_normal: Annotated[float | None, Meaning("N", "greatest normal force")]
    peak_tangential: Annotated[float | None, Meaning("N", "greatest tangential force")]
    readings: Annotated[int, Meaning("", "how many in the steady window")]
    zero: Annotated[str, Meaning("", "where the zero of the forces came from")]
    zero_drift: Annotated[float | None, Meaning("N", "how far the zero moved from before the stroke to after it")]
    flaws: Annotated[tuple[str, ...], Meaning("", "names of what is wrong with it")]
    contact_area: Annotated[float | None, Meaning("mm2", "by which tau_max was computed")] = None
    area_exponent: Annotated[float, Meaning("", "with which that area follows the normal force")] = 0.0
    number: Annotated[int, Meaning("", "of the stroke within its trial, from 1")] = 1
    kept: Annotated[bool, Meaning("", "false: a person left it out, and the model is not given it")] = True
    decided: Annotated[Mapping[str, str], Meaning("", "what a person decided about it, who and why")] = field(
        default_factory=dict[str, str]
    )
    reasons: Annotated[Mapping[str, str], Meaning("", "for each number left out, why")] = field(
        default_factory=dict[str, str]
    )
    curve: StrokeCurve | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the stroke as plain data, without its curve."""
        return {column.name: getattr(self, column.name) for column in fields(self) if column.name != "curve"}


def meanings(record: type) -> dict[str, Meaning]:
    """Return unit and meaning of each field of a record that has one, by its name, for those who read its tables."""
    hints = get_type_hints(record, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items() if get_origin(hint) is Annotated}
