"""Every number the analysis was set by; stored and shown with what came out."""

from dataclasses import dataclass, field
from typing import Literal

from sessions.strokes.contact_area import FIXED, AreaLaw
from sessions.strokes.onset import DetectorSettings

ASSUMED_GAIN_ERROR = 0.01  # standard uncertainty of each axis' gain where nobody stated the transducer's own [-]

WindowRule = Literal["widened", "least variance", "middle half", "whole slide"]


@dataclass(frozen=True, slots=True)
class AnalysisSettings:
    """How strokes are found and measured."""

    detector: DetectorSettings = field(default_factory=DetectorSettings)
    cut_off: float = 20.0  # of the zero-phase filter of forces and torques [Hz]
    speed_cut_off: float = 5.0  # of the filter of the centre of pressure's speed [Hz]
    force_floor: float = 0.3  # T/N means nothing below this normal force [N] ...
    force_floor_share: float = 0.2  # ... nor below this share of the stroke's peak [-]
    quiet_share: float = 0.002  # a spread below this share of the range of N is quiet whatever the noise [-]
    # ... and torques spread by less than this times the range of N: a standard deviation of 1 mm in 0.3 s is a centre
    # of pressure that moves at 11.5 mm/s, slower than the slowest published stroke (13 mm/s) [mm]
    quiet_moves: float = 1.0
    zero_stretch: float = 0.6  # most of the unloaded stretch that gives the zero [s]
    near: float = 1.0  # unloaded forces so near a stroke tell how far its zero can be trusted [s]
    unloaded_share: float = 0.3  # a quiet stretch higher than this share of the range of N is a steady press [-]
    valley: float = 0.2  # two strokes are told apart where N falls below this share of the lower peak [-]
    turn_share: float = 0.5  # to and fro: the drag counts beyond this share of the median T/N each way [-] ...
    turn_shortest: float = 0.1  # ... and each way lasts so long beside the longest [-]
    light_share: float = 0.2  # a contact whose peak is below this share of the greatest is a light touch [-]
    shortest_stroke: float = 0.2  # a shorter contact is a tap [s]
    sliding_share: float = 0.5  # sliding: the centre of pressure is faster than this share of its greatest speed [-]
    slide_share: float = 0.2  # the slide has begun: faster than this share of the steady speed [-]
    steady_rule: WindowRule = "widened"  # how the steady window is chosen: see `sliding.steady_window`
    steady_seed: float = 0.5  # share of the slide over which the variance of T/N is least, before it is widened [-]
    steady_spread: float = 0.10  # steady: standard deviation of T/N over its mean [-] ...
    steady_trend: float = 0.05  # ... and the means of its four quarters differ from it by no more than this [-]
    steady_share: float = 0.25  # shortest steady window, as a share of the stroke [-] ...
    steady_shortest: float = 0.05  # ... and in time [s]
    static_share: float = 0.05  # a static peak stands so far above the 0.2 s after it [-] ...
    static_noise: float = 3.0  # ... and so many standard deviations of the noise of T/N [-]
    stick_rise: float = 0.1  # a stick phase: T/N climbs by this share of its level before it stays there [-] ...
    stick_left: float = 0.5  # ... and the climb leaves no more than this share of its variance [-]
    smoothing: float = 0.1  # the maximum of T/N is that of the force means over so long [s]
    block: float = 0.1  # intervals and standard errors are those of the means over so long [s]
    confidence: float = 0.95
    drift_doubted: float = 0.05  # doubtful: drift may have changed mu by this share [-]
    drift_refused: float = 0.10  # refused: by this one [-]
    shear: float = 3.0  # the centre of pressure may move so far while the skin only shears [mm]
    # A finger that only rolls moves it no further than a quarter turn of a finger 15 mm wide (the width the model has):
    # 7.5 mm * pi / 2. Further than that, something slid [mm]
    roll: float = 11.8
    shear_steps: float = 2.0  # and so many steps of coarse torques are no movement [-]
    one_way: float = 0.9  # the tangential force keeps its direction: length of its mean unit vector [-]
    side_load: float = 0.3  # so much of the drag across the movement is a load from the side [-]
    speed_error: float = 0.10  # a speed with a greater relative standard error is refused [-]
    speed_line: float = 0.95  # so is one whose line explains less than this share of the movement [-]
    speed_step: float = 0.10  # so is one whose centre of pressure moves in steps of this share of the way [-]
    height_doubt: float = 20.0  # how wrong a face height that nobody stated may be [mm]
    farthest: float = 150.0  # a centre of pressure further out is no finger's [mm]
    greatest_force: float = 200.0  # a greater normal force is no finger's [N]
    longest_gap: float = 0.05  # a peak may hide in a longer gap [s]
    frozen_shortest: float = 0.05  # as long as this the same six numbers mean a frozen sensor [s] ...
    frozen_readings: int = 8  # ... and in so many readings
    frozen_refused: float = 0.5  # share of frozen readings from which on nothing is analysed [-]
    flat_top: float = 0.02  # an axis so long at its own greatest or least value is clipped [s] ...
    long_run: float = 20.0  # ... or frozen at another, if so many times longer than its usual repeats [-]
    wild_noise: float = 10.0  # a wild reading stands beyond its neighbours by so many standard deviations of noise [-]
    wild_steps: float = 3.0  # ... and so many times the greatest step around it [-]
    uneven: float = 0.05  # spread of the time steps that makes the rate irregular [-]
    press_shortest: float = 0.5  # a contact held so long [s] ...
    press_moves: float = 1.0  # ... whose centre of pressure moves no further [mm] ...
    press_ratio: float = 0.2  # ... and whose T/N stays below this is a press, and tells how the face leans [-]
    area: AreaLaw = FIXED  # by which tau_max is told
    gain_error: float | None = None  # standard uncertainty of each axis' gain that somebody set [-]; None: assumed
    bootstrap_seed: int = 0  # of the intervals drawn
    tilt: tuple[float, float] = (0.0, 0.0)  # lean of the face's normal to +x and +y that is levelled [degrees]
    slow_onset: float = 0.5  # from onset to a fifth of the peak; a finger takes a tenth of it [s]

    @property
    def gain_uncertainty(self) -> float:
        """Standard uncertainty of each axis' gain [-]: the one that was set, or the one assumed."""
        return ASSUMED_GAIN_ERROR if self.gain_error is None else self.gain_error

    @property
    def interval_kind(self) -> str:
        """What an interval of mu is."""
        return (
            f"{100 * self.confidence:g} % t interval of the mean over the steady window from {self.block:g} s means, "
            "neighbours being alike allowed for, widened by the zero's noise, its drift where that was seen, and the "
            f"calibration ({100 * self.gain_uncertainty:g} % of each axis, "
            f"{'assumed' if self.gain_error is None else 'set'}): not by choice of window"
        )
