"""A stroke, the touching movement inside a trial: its numbers, its flaws, and its friction for the model.

Hertz: the contact area of a smooth elastic sphere on a plane grows as N^(2/3) (Johnson 1985, Contact Mechanics, section
4.2). A finger is neither; the exponent and the force at which the area is the planned one are assumed unless stated. No
area is measured here.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from typing import Annotated, Any, Literal, NamedTuple, get_origin, get_type_hints

from drivers.arrays import Array
from sessions.plan.plan import PROXIMAL_TO_DISTAL, Trial

Interval = tuple[float, float]


def digits(value: float, places: int, sign: Literal["", "+"] = "") -> str:
    """Return a number with `places` decimals and a true minus sign; with "+" positive ones have a sign too.

    >>> digits(-0.25, 2), digits(0.25, 1, "+")
    ('−0.25', '+0.2')
    """
    return f"{value:{sign}z.{places}f}".replace("-", "−")


def significant(value: float, figures: int) -> str:
    """Return a number with `figures` significant figures, without an exponent.

    >>> significant(8.0331, 3), significant(1523.4, 3), significant(0.0, 3)
    ('8.03', '1523', '0')
    """
    if value == 0.0:
        return "0"
    return digits(value, max(0, figures - 1 - math.floor(math.log10(abs(value)))))


class Meaning(NamedTuple):
    """Unit and meaning of a number, for the tables of an export."""

    unit: str  # "" for none
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class StrokeCurve:
    """The n readings of a stroke and some time around it, read-only; nan where a value is undefined."""

    time: Array  # (n,) [s, device time]
    normal: Array  # (n,) filtered normal force [N]
    unfiltered: Array  # (n,) the same before filtering, from which the onset of contact is found [N]
    tangential: Array  # (n,) filtered tangential force [N]
    force: Array  # (n, 2) filtered force along x and y of the face [N]
    ratio: Array  # (n,) T/N [-]
    position: Array  # (n, 2) centre of pressure [mm]
    speed: Array  # (n,) of the centre of pressure [mm/s]
    noise: tuple[float, float]  # standard deviations of each force sideways, and along the normal, unloaded [N]
    quiet: float  # duration of that unloaded stretch [s]
    crests: Array | None = None  # (n,) unfiltered tangential force [N], where the contact sticks and slips
    crest_noise: float = 0.0  # its standard deviation, unloaded [N]
    crest_gap: float = 0.0  # how far readings may miss its greatest value [N]

    def __post_init__(self) -> None:
        for column in fields(self)[:8]:
            view = getattr(self, column.name).view()
            view.flags.writeable = False
            object.__setattr__(self, column.name, view)


@dataclass(frozen=True, slots=True, eq=False)
class Stroke:
    """One stroke. A number is None where it is withheld; `reasons` gives the flaw."""

    trial: Annotated[int | None, Meaning("", "number of its trial")]  # None where the recording has no trials
    # No onset where the recording begins in contact, no lift where it ends in contact, neither without a zero.
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
    mu_static: Annotated[float | None, Meaning("", "height of the static peak of T/N")]  # None without a clear peak
    mu_dynamic: Annotated[float | None, Meaning("", "mean of T/N over the steady window")]
    mu_dynamic_sd: Annotated[float | None, Meaning("", "standard deviation of T/N over the steady window")]
    # From the bootstrap: see `BootstrapSettings.kind`.
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
    """Return unit and meaning, by name, of each field of a record that has them."""
    hints = get_type_hints(record, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items() if get_origin(hint) is Annotated}


Grade = Literal["note", "doubtful", "refused"]  # numbers hold; numbers are doubtful; numbers were withheld


class FlawName(StrEnum):
    """Names of all flaws."""

    LOST_READINGS = "lost_readings"
    SATURATED = "saturated"
    DEVICE_FAULT = "device_fault"  # the device reports a fault of its own
    FROZEN = "frozen_sensor"
    DEAD = "dead_sensor"
    WILD = "wild_reading"
    IRREGULAR_TIME = "irregular_time"
    UNKNOWN_RATE = "unknown_rate"
    RECORDING = "recording"  # losses that the recording reports
    NO_UNLOADED_STRETCH = "no_unloaded_stretch"
    ZERO_AFTER_CONTACT = "zero_after_contact"
    DRIFT = "drift"
    TILT_ASSUMED = "tilt_assumed"  # too few presses measure the tilt
    NORMAL_IMPLAUSIBLE = "normal_axis_implausible"
    UNITS_IMPLAUSIBLE = "units_implausible"
    NO_STROKE = "no_stroke"
    SECOND_STROKE = "second_stroke"
    LIGHT_TOUCH = "light_touch"
    TAP = "tap"
    NOT_LIFTED = "not_lifted_between"
    TURNED = "turned_without_lift"
    BEGINS_IN_CONTACT = "begins_in_contact"
    ENDS_IN_CONTACT = "ends_in_contact"
    SLOW_ONSET = "slow_onset"
    TOO_LITTLE_FORCE = "too_little_force"
    RATIO_ABOVE_ONE = "ratio_above_one_at_low_force"
    RATIO_ABOVE_ONE_THROUGHOUT = "ratio_above_one"
    STICK_SLIP = "stick_slip"
    SIDE_LOAD = "side_load"
    NO_STEADY_SLIDING = "no_steady_sliding"
    ROLLED = "may_only_roll"
    SPEED_NOT_MEASURABLE = "speed_not_measurable"
    HEIGHT_UNKNOWN = "height_unknown"
    DIRECTION_TURNS = "direction_turns"
    DIRECTION_DISAGREES = "direction_disagrees"
    WRONG_DIRECTION = "wrong_direction"
    DECISION = "decision"  # a decision that cannot be applied or read


@dataclass(frozen=True, slots=True)
class Flaw:
    """One named defect, its place and its consequence."""

    name: FlawName
    sentence: str  # the finding, and its effect on the numbers
    grade: Grade
    trial: int | None = None  # None: the whole recording, or a recording without trials
    stroke: int | None = None  # position in `Analysis.strokes`; None: not of one stroke


COEFFICIENTS = ("mu_static", "mu_dynamic", "mu_dynamic_sd", "mu_dynamic_interval", "mu_max", "tau_max", "contact_area")
_LOADS = ("normal_force", "tangential_force", "peak_normal", "peak_tangential")
PEAKS = ("mu_static", "mu_max", "tau_max", "contact_area", "peak_normal", "peak_tangential")
SPEED = ("speed", "speed_error")
DIRECTION = ("direction", "direction_from", "heading")
EVERYTHING = (*COEFFICIENTS, *_LOADS, *SPEED, *DIRECTION, "steady", "readings", "break_away", "slide_onset")


@dataclass
class Findings:
    """Numbers and flaws of one stroke during its analysis."""

    numbers: dict[str, Any] = field(default_factory=dict[str, Any])
    flaws: list[Flaw] = field(default_factory=list[Flaw])
    reasons: dict[str, str] = field(default_factory=dict[str, str])

    def flaw(self, name: FlawName, sentence: str, grade: Grade, withheld: tuple[str, ...] = ()) -> None:
        """Add a flaw and the numbers it withholds; the first flaw to withhold a number is its reason."""
        self.flaws.append(Flaw(name, sentence, grade))
        for number in withheld:
            self.reasons.setdefault(number, str(name))


HERTZ_EXPONENT = 2.0 / 3.0
PLANNED_AT = 2.0  # normal force at which a growing area equals the planned one, unless set [N]


@dataclass(frozen=True, slots=True)
class AreaLaw:
    """Contact area = planned area x (N / force)^exponent; `exponent` is 0 for a fixed area."""

    law: Literal["fixed", "hertz", "power"] = "fixed"
    exponent: float = 0.0  # of the force [-]
    force: float = PLANNED_AT  # [N]

    def area(self, normal: Array, planned_area: float) -> Array:
        """Return the contact area (n,) [mm2] under a normal force (n,) [N], > 0; `planned_area` [mm2].

        >>> import numpy as np
        >>> AreaLaw("power", 0.5, 1.0).area(np.array([1.0, 4.0]), 100.0)
        array([100., 200.])
        """
        return planned_area * (normal / self.force) ** self.exponent

    @property
    def sentence(self) -> str:
        """The law, for people, with its assumptions."""
        if self.law == "fixed":
            return "fixed, whatever the normal force"
        origin = "assumed" if self.force == PLANNED_AT else "set"
        hertz = "Hertz, sphere on plane: Johnson 1985, section 4.2; assumed of a finger"
        reason = hertz if self.law == "hertz" else "set"
        return f"grows as N^{self.exponent:.3g} ({reason}), and is the planned one at {self.force:g} N, {origin}"


FIXED = AreaLaw()


Rule = Literal["maximum", "mean over steady window"]


@dataclass(frozen=True, slots=True)
class FrictionParameters:
    """Friction of one stroke for the model. None for withheld numbers."""

    trial: Annotated[int | None, Meaning("", "number of the trial")]
    stroke: Annotated[int, Meaning("", "position of the stroke, from 0")]
    mu: Annotated[float | None, Meaning("", "coefficient of friction the model is given")]
    mu_interval: tuple[float, float] | None  # of mu, from the bootstrap; None before it is drawn
    tau_max: Annotated[float | None, Meaning("MPa", "traction bound the model is given")]
    contact_area: Annotated[float, Meaning("mm2", "for which tau_max was computed")]
    speed: Annotated[float | None, Meaning("mm/s", "of the stroke")]
    direction: Annotated[int | None, Meaning("", "+1 proximal to distal, -1 back, as measured")]
    rule: Annotated[Rule, Meaning("", "which T/N mu is")]
    flaws: Annotated[tuple[str, ...], Meaning("", "names of what is wrong with the stroke")]


def rule_for(trial: Trial | None) -> Rule:
    """Return the paper's choice (section 3): the maximum for stickiness, the mean over the steady range elsewhere.

    For other descriptors the direction decides: pushed forward the skin is blocked first, as in the paper's stickiness,
    and the maximum is close to the dynamic value. A recording without a plan gets the mean.
    """
    if trial is None or trial.stimulus.descriptor == "slipperiness":
        return "mean over steady window"
    if trial.stimulus.descriptor == "stickiness" or trial.direction == PROXIMAL_TO_DISTAL:
        return "maximum"
    return "mean over steady window"


def friction_parameters(stroke: Stroke, position: int, trial: Trial | None, contact_area: float) -> FrictionParameters:
    """Return the friction, for the model, of the stroke at `position` of `Analysis.strokes`."""
    rule = rule_for(trial)
    return FrictionParameters(
        trial=stroke.trial,
        stroke=position,
        mu=stroke.mu_max if rule == "maximum" else stroke.mu_dynamic,
        mu_interval=None,
        tau_max=stroke.tau_max,
        contact_area=stroke.contact_area or contact_area,
        speed=stroke.speed,
        direction=stroke.direction,
        rule=rule,
        flaws=stroke.flaws,
    )
