"""The named flaws of a recording and its strokes, and the numbers of a stroke that they forbid."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal

Grade = Literal["note", "doubtful", "refused"]  # numbers stand; numbers stand but doubt them; numbers were withheld


class FlawName(StrEnum):
    """Every flaw there is."""

    LOST_READINGS = "lost_readings"
    SATURATED = "saturated"
    DEVICE_FAULT = "device_fault"  # the device tells of a fault of its own
    FROZEN = "frozen_sensor"
    DEAD = "dead_sensor"
    WILD = "wild_reading"
    IRREGULAR_TIME = "irregular_time"
    UNKNOWN_RATE = "unknown_rate"
    RECORDING = "recording"  # what the recording itself says it lost
    NO_UNLOADED_STRETCH = "no_unloaded_stretch"
    ZERO_AFTER_CONTACT = "zero_after_contact"
    DRIFT = "drift"
    TILT_ASSUMED = "tilt_assumed"  # no press tells how the face leans
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
    DECISION = "decision"  # what a person decided cannot be done, or cannot be read


@dataclass(frozen=True, slots=True)
class Flaw:
    """One named defect, where it lies and what it costs."""

    name: FlawName
    sentence: str  # what was found, and what it does to the numbers
    grade: Grade
    trial: int | None = None  # None: the whole recording, or a recording without trials
    stroke: int | None = None  # position in `Analysis.strokes`; None: not one stroke's


COEFFICIENTS = ("mu_static", "mu_dynamic", "mu_dynamic_sd", "mu_dynamic_interval", "mu_max", "tau_max", "contact_area")
LOADS = ("normal_force", "tangential_force", "peak_normal", "peak_tangential")
PEAKS = ("mu_static", "mu_max", "tau_max", "contact_area", "peak_normal", "peak_tangential")
SPEED = ("speed", "speed_error")
DIRECTION = ("direction", "direction_from", "heading")
EVERYTHING = (*COEFFICIENTS, *LOADS, *SPEED, *DIRECTION, "steady", "readings", "break_away", "slide_onset")


@dataclass
class Findings:
    """Numbers and flaws of one stroke while they are gathered."""

    numbers: dict[str, Any] = field(default_factory=dict[str, Any])
    flaws: list[Flaw] = field(default_factory=list[Flaw])
    reasons: dict[str, str] = field(default_factory=dict[str, str])

    def flaw(self, name: FlawName, sentence: str, grade: Grade, withheld: tuple[str, ...] = ()) -> None:
        """Name a flaw, and the numbers it forbids; the first to forbid a number is its reason."""
        self.flaws.append(Flaw(name, sentence, grade))
        for number in withheld:
            self.reasons.setdefault(number, str(name))

    def allowed(self, names: tuple[str, ...]) -> Mapping[str, Any]:
        """Return the numbers under these names, None for those that are missing or forbidden."""
        return {name: None if name in self.reasons else self.numbers.get(name) for name in names}
