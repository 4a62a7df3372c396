"""The named flaws of a recording and its strokes: a name for scripts, a sentence for people."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

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
