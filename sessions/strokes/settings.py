"""Every setting of the analysis and its intervals, stored and shown with their results.

A comment gives each threshold's meaning, and a source or reason where it has one. Effects of halving and doubling are
the largest over 150 strokes, one a trial, of `benchmarks.friction_coverage`: sets base, noise x 5, drift x 5, wandering
mu and stick-slip, seeds 995000 to 995002. Field names are unique among all groups.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from sessions.strokes.stroke import FIXED, AreaLaw

ASSUMED_GAIN_ERROR = 0.01  # standard uncertainty of each axis' gain where the transducer's is unknown [-]
TILT_PRIOR = 1.0  # standard uncertainty of the tilt about an axis: 1 mm under one end of a sample 60 mm long [degrees]

Pair = tuple[float, float]
WindowRule = Literal["widened", "least variance", "middle half", "whole slide"]


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """Detection of contact; forces are relative to the measured zero."""

    onset_floor: float = 0.05  # least force of a contact above zero [N]
    onset_noise: float = 5.0  # least force of a contact relative to the noise's standard deviation [-]
    onset_hold: float = 0.010  # least time for which a contact exceeds both [s]
    leave_noise: float = 3.0  # force relative to the noise's standard deviation to which the onset is traced back [-]
    lift_fraction: float = 0.6  # force relative to the onset threshold below which the finger is lifted [-]
    lift_hold: float = 0.020  # least time for which it stays below [s]
    baseline: float = 0.3  # length of the unloaded stretch that gives zero and noise [s]
    baseline_readings: int = 12  # fewest readings of that stretch
    baseline_parts: int = 6  # number of parts in which the stretch is renewed
    quiet_noise: float = 2.0  # largest spread of an unloaded stretch relative to the noise [-]
    quiet_floor: float = 0.02  # spread that always counts as unloaded, for readings smoothed by the device [N]


@dataclass(frozen=True, slots=True)
class SignalSettings:
    """Detection of unusable readings."""

    missing_step: float = 1.8  # a reading is missing from this ratio to the usual step: two, less a tenth of jitter [-]
    uneven: float = 0.05  # relative spread of the time steps from which the rate is irregular [-]
    frozen_shortest: float = 0.05  # least time of six equal numbers that counts as a frozen sensor [s]
    frozen_readings: int = 8  # fewest readings in that time
    frozen_refused: float = 0.5  # share of frozen readings from which nothing is analysed [-]
    frozen_off: float = 0.1  # least distance of a value frozen to the end from earlier rests, by the axis' range [-]
    coarse_steps: float = 3.0  # an axis is coarse if half its changes are at most this many least steps [-]
    coarse_jump: float = 2.0  # a coarse step is a jump from this ratio to the axis' 95th percentile of changes [-]
    flat_top: float = 0.02  # least time at an axis' greatest or least value that counts as clipped [s]
    flat_readings: int = 4  # fewest readings in that time
    flat_jump: float = 3.5  # fewest least steps on entering or leaving that value: a slow reversal has fewer [-]
    flat_around: float = 0.15  # surrounding time in which other axes must move: unloaded ones show noise only [s]
    flat_moves: float = 3.0  # least spread of those axes relative to their noise [-]
    long_run: float = 20.0  # a run of equal values is frozen from this ratio to the usual length of such runs [-]
    wild_noise: float = 10.0  # least distance of a wild reading from its neighbours, relative to the noise [-]
    wild_steps: float = 3.0  # least ratio of that distance to the greatest step around it [-]
    wild_coarse: float = 4.0  # least steps of a coarse axis in that distance [-]
    wild_widest: int = 2  # most consecutive wild readings; a longer force may be a touch
    wild_neighbours: int = 2  # readings on each side that a wild one is compared with
    wild_around: int = 20  # readings on each side whose steps show the usual step
    wild_fewest: int = 8  # fewest such steps


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """How readings are smoothed and averaged."""

    cut_off: float = 20.0  # of the zero-phase filter of forces and torques [Hz]
    speed_cut_off: float = 5.0  # of the filter of the centre of pressure's speed [Hz]
    shortest_segment: int = 12  # fewest readings with filtered values: the filter's ends reach across fewer
    smoothing: float = 0.1  # averaging time of the forces whose ratio gives the maximum of T/N [s]
    block: float = 0.1  # averaging time of the blocks for intervals and standard errors [s]
    fewest_blocks: int = 4  # fewest blocks that give a standard error


@dataclass(frozen=True, slots=True)
class ZeroSettings:
    """Unloaded stretches, and the uncertainty of the zero.

    Half of `drift_doubted` marks 6 more of 150 strokes; doubled, or with half or twice `drift_refused`, none changes.
    """

    quiet_share: float = 0.002  # spread relative to the range of N below which a stretch is always quiet [-]
    # Largest spread of its torques relative to the range of N. A standard deviation of 1 mm in 0.3 s is a centre of
    # pressure moving at 11.5 mm/s, slower than the slowest published stroke (13 mm/s) [mm]
    quiet_moves: float = 1.0
    quiet_hops: int = 6  # windows start at every sixth of their length
    quiet_gap: float = 1.5  # duration relative to the usual one from which a window contains a gap [-]
    zero_stretch: float = 0.6  # longest part of an unloaded stretch that gives the zero [s]
    near: float = 1.0  # greatest distance in time of unloaded forces that show the error of a stroke's zero [s]
    unloaded_share: float = 0.3  # force relative to the range of N from which a quiet stretch is a steady press [-]
    drift_doubted: float = 0.05  # relative change of mu by drift from which a stroke is doubtful [-]
    drift_refused: float = 0.10  # relative change of mu by drift from which a stroke is refused [-]


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """Selection of strokes among contacts, and cuts between strokes.

    Where each trial holds one stroke, half or twice `valley`, `turn_share`, `turn_unsure`, `light_share`,
    `shortest_stroke`, `longest_gap` and `slow_onset` change no number and no flaw.
    """

    valley: float = 0.2  # N relative to the lower of two peaks below which two strokes are separated [-]
    turn_share: float = 0.5  # to and fro: least T/N each way relative to the median T/N [-]
    turn_unsure: float = 2.0  # to and fro: least drag each way relative to the zero's uncertainty [-]
    turn_shortest: float = 0.1  # to and fro: least duration of each way relative to the longest [-]
    turn_block: float = 0.05  # averaging time of the drag whose direction is followed [s]
    turn_recent: int = 4  # number of these means that give its latest direction
    light_share: float = 0.2  # peak relative to the greatest peak below which a contact is a light touch [-]
    shortest_stroke: float = 0.2  # a shorter contact is a tap [s]
    longest_gap: float = 0.05  # a longer gap between readings may contain a peak [s]
    gap_beside: float = 2.5  # distance from unsound readings within which a contact may continue in them [readings]
    slow_onset: float = 0.5  # longest time from onset to a fifth of the peak: ten times that of a finger [s]
    greatest_force: float = 200.0  # greatest normal force of a finger [N]
    pull_share: float = 0.5  # pull relative to press from which the normal axis must be wrong [-]
    curve_before: float = 0.25  # length of a stroke's curve before its onset [s]
    curve_after: float = 0.15  # length of a stroke's curve after its lift [s]


@dataclass(frozen=True, slots=True)
class SteadySettings:
    """Choice of the steady window.

    Half or twice the value moves mu by at most 0.02 % (`steady_seed`), 2.3 % (`steady_trend`) and 0.9 %
    (`steady_scatter`). Half of `steady_spread` withholds mu of 20 of 30 strokes with stick-slip; doubled, none changes.
    """

    steady_rule: WindowRule = "widened"  # how the steady window is chosen: see `sliding.steady_window`
    steady_seed: float = 0.5  # share of the slide with the least variance of T/N, from which the window is widened [-]
    steady_spread: float = 0.10  # largest standard deviation of T/N relative to its mean [-]
    steady_trend: float = 0.05  # largest difference of a quarter's mean from the whole window's [-]
    steady_scatter: float = 2.0  # scatter of T/N that such a difference may have beyond it [standard deviations]
    steady_share: float = 0.25  # shortest steady window relative to the stroke [-]
    steady_shortest: float = 0.05  # shortest steady window in time [s]
    steady_readings: int = 5  # shortest steady window in readings
    steady_held: float = 0.95  # least share of a window's readings that have a ratio [-]
    steady_edges: int = 121  # number of instants on the grid where windows begin and end


@dataclass(frozen=True, slots=True)
class SlideSettings:
    """Evidence of a slide, its speed and its direction.

    Half or twice `sliding_share` moves mu by at most 0.8 %; `side_load` and `speed_error` change nothing.
    """

    sliding_share: float = 0.5  # sliding: speed of the centre of pressure relative to its 90th percentile [-]
    slide_share: float = 0.2  # start of the slide: speed relative to the steady speed [-]
    shear: float = 3.0  # largest movement of the centre of pressure while the skin only shears [mm]
    # Largest movement while the finger only rolls: a quarter turn of a finger 15 mm wide, as in the model, 7.5 mm * pi
    # / 2 [mm]
    roll: float = 11.8
    shear_steps: float = 2.0  # most steps of coarse torques that do not count as movement [-]
    one_way: float = 0.9  # least length of the mean unit vector of a tangential force that keeps its direction [-]
    drag_share: float = 0.1  # least drag relative to its greatest for a direction: noise has any direction [-]
    along_share: float = 0.5  # least share along x of a direction along x, of drag or speed: 60 degrees off [-]
    side_load: float = 0.3  # drag across the movement relative to the whole drag from which it is a side load [-]
    speed_error: float = 0.10  # relative standard error from which a speed is refused [-]
    speed_line: float = 0.95  # least share of the movement that the line of a speed explains [-]
    speed_step: float = 0.10  # largest step of the centre of pressure relative to the movement [-]
    height_doubt: float = 20.0  # uncertainty of a face height that nobody stated [mm]
    farthest: float = 150.0  # farthest centre of pressure of a finger [mm]


@dataclass(frozen=True, slots=True)
class RatioSettings:
    """Definition of T/N, its static peak and its stick phase."""

    force_floor: float = 0.3  # least normal force at which T/N is defined [N]
    force_floor_share: float = 0.2  # the same relative to the stroke's peak [-]
    light_half: float = 0.5  # N relative to its peak: T/N above 1 only below this is drift or a side load [-]
    static_share: float = 0.05  # least height of a static peak relative to the level after it [-]
    static_noise: float = 3.0  # least height of a static peak relative to the noise of T/N [-]
    static_after: float = 0.2  # time after the peak with which it is compared [s]
    static_late: float = 0.1  # latest time of the peak after the slide began [s]
    law_fewest: int = 5  # fewest block means that give a power of N and its error
    law_steepest: float = -1.0 / 3.0  # steepest undetected power of N in mu: T as the area of a Hertz contact [-]
    slip_within: float = 0.02  # longest drop of T/N in a slip: a fifth of a period at 10 Hz [s]
    slip_share: float = 0.05  # least drop of a slip relative to the level of T/N, as for a static peak [-]
    slip_noise: float = 4.0  # least drop relative to the noise of a difference: once in 15000 readings by chance [-]
    slips_fewest: int = 3  # fewest slips of stick-slip: two periods
    slips_upwards: float = 1.0 / 3.0  # most equally sudden climbs per slip: hum has one per slip [-]
    stick_rise: float = 0.1  # least climb of T/N in a stick phase relative to the level it reaches [-]
    stick_left: float = 0.5  # largest share of the variance that the fitted climb leaves unexplained [-]


@dataclass(frozen=True, slots=True)
class ClimbSettings:
    """Fit of the climb of T/N before the break-away."""

    climb_bends: tuple[float, float] = (1.0, 2.0)  # powers of a climb at which the search starts [-]
    climb_bend_limits: tuple[float, float] = (0.5, 4.0)  # limits of that power [-]
    climb_falls: tuple[float, float] = (0.05, 0.15)  # start values of the time in which a static peak falls to 1/e [s]
    climb_fall_limits: tuple[float, float] = (0.005, 1.0)  # limits of that time [s]
    climb_fewest: int = 5  # fewest readings of the climb, and of the level
    climb_most: int = 400  # most means that replace the readings
    climb_candidates: int = 41  # number of instants tried where rest or level meets the climb
    climb_shortest: float = 1e-3  # shortest climb [s]
    climb_steps: int = 60  # most steps of the Levenberg-Marquardt method
    climb_still: float = 1e-10  # relative decrease of the squares below which a fit has converged [-]
    climb_bends_surely: float = 6.6  # ratio of variances from which a climb counts as bent: 1 in 100 by chance [-]


@dataclass(frozen=True, slots=True)
class PressSettings:
    """Selection of presses, which measure the tilt of the face."""

    press_held: float = 0.5  # force relative to the peak above which a press is held [-]
    press_shortest: float = 0.5  # shortest hold of a press [s]
    press_moves: float = 1.0  # largest movement of the centre of pressure during the hold [mm]
    press_ratio: float = 0.2  # largest T/N during the hold [-]
    press_fewest: int = 3  # fewest presses, or blocks of one press, that give an interval


@dataclass(frozen=True, slots=True)
class SystematicSettings:
    """Systematic errors shared by all readings of a session, where not measured."""

    # Standard uncertainty of the cross-talk between forces [-]; None: that of a gain. A certificate states one error of
    # an axis in per cent of full scale under any load, so it covers gain and cross-talk.
    cross_talk: float | None = None
    tilt_prior: float = TILT_PRIOR  # of the tilt about each axis [degrees]


@dataclass(frozen=True, slots=True)
class AnalysisSettings:
    """Detection and measurement of strokes."""

    detector: DetectorSettings = field(default_factory=DetectorSettings)
    signal: SignalSettings = field(default_factory=SignalSettings)
    filter: FilterSettings = field(default_factory=FilterSettings)
    zero: ZeroSettings = field(default_factory=ZeroSettings)
    contact: ContactSettings = field(default_factory=ContactSettings)
    steady: SteadySettings = field(default_factory=SteadySettings)
    slide: SlideSettings = field(default_factory=SlideSettings)
    ratio: RatioSettings = field(default_factory=RatioSettings)
    climb: ClimbSettings = field(default_factory=ClimbSettings)
    press: PressSettings = field(default_factory=PressSettings)
    systematic: SystematicSettings = field(default_factory=SystematicSettings)
    area: AreaLaw = FIXED  # for tau_max
    confidence: float = 0.95
    gain_error: float | None = None  # standard uncertainty of each axis' gain that was set [-]; None: assumed
    bootstrap_seed: int = 0  # of the intervals drawn
    tilt: tuple[float, float] = (0.0, 0.0)  # tilt of the face's normal to +x and +y that is corrected [degrees]

    @property
    def gain_uncertainty(self) -> float:
        """Standard uncertainty of each axis' gain [-]: set or assumed."""
        return ASSUMED_GAIN_ERROR if self.gain_error is None else self.gain_error

    def to_dict(self) -> dict[str, Any]:
        """Return every setting by its group, and most also ungrouped by name, as in the previous release's format."""
        groups = asdict(self)
        alone = ("signal", "filter", "zero", "contact", "steady", "slide", "ratio", "press")
        return {name: value for group in alone for name, value in groups[group].items()} | groups


@dataclass(frozen=True, slots=True)
class BootstrapSettings:
    """Settings of the bootstrap, stored with the intervals."""

    repeats: int = 1000
    seed: int = 0
    block: float = 0.1  # [s]
    inwards: float = 0.2  # largest shift inwards of each end of the steady window relative to its length [-]
    slide_share: tuple[float, float] = (0.1, 0.3)  # shares of the steady speed between which the slide may begin [-]
    gain_error: float = ASSUMED_GAIN_ERROR  # standard uncertainty of each axis' gain [-]
    gain_error_origin: str = "assumed"  # "set" where somebody stated it for this transducer
    cross_talk: float = ASSUMED_GAIN_ERROR  # standard uncertainty of the cross-talk between forces [-]
    tilt: tuple[float, float] = (0.0, 0.0)  # tilt of the face's normal to +x and +y that is not corrected [degrees]
    tilt_error: tuple[float, float] = (TILT_PRIOR, TILT_PRIOR)  # its standard uncertainty [degrees]
    tilt_origin: str = "assumed: too few presses to measure it"
    tilt_presses: int = 0  # number of presses: the error then follows Student's law and includes cross-talk from N
    confidence: float = 0.95
    fewest_blocks: int = 4  # fewest blocks for a spread
    fewest_quiet: int = 10  # fewest readings before the onset that give the noise
    quiet_before: float = 0.02  # time before the onset at which these end: later ones may belong to the touch [s]
    top_share: float = 0.97  # readings above this share of the peak may be the peak [-]
    top_alike: float = 0.25  # filtered readings nearer than this share of a block are correlated [-]
    most_alike: float = 0.8  # largest correlation of neighbouring blocks: few blocks cannot give a larger one [-]
    least_free: float = 2.0  # least degrees of freedom of a mean of few blocks
    onset_fewest: int = 3  # fewest readings that give the steepness of the force's rise
    onset_most: int = 400  # most readings about the crossing in which noise is drawn
    onset_steep: float = 0.2  # least initial slope of a bent rise of force relative to its mean slope [-]
    onset_reach: float = 4.0  # standard deviations of noise within which it may move the crossing [-]
    climb_ends: int = 5  # number of ends of the fitted climb, from that of the steady window inwards
    detector: DetectorSettings = field(default_factory=DetectorSettings)  # those of the analysis
    climb: ClimbSettings = field(default_factory=ClimbSettings)  # those of the analysis

    @property
    def kind(self) -> str:
        """Description of the intervals, for people."""
        x, y = (f"{angle:.2g} ± {error:.2g}°" for angle, error in zip(self.tilt, self.tilt_error, strict=True))
        return (
            f"{100 * self.confidence:g} % percentile interval of {self.repeats} block-bootstrap repeats (blocks of "
            f"{self.block:g} s, widened for correlation between blocks, seed {self.seed}): sensor noise, zero and its "
            f"drift, calibration ({self.calibration}; cross-talk {100 * self.cross_talk:g} % of each other force), "
            f"tilt of the face ({x} to +x and {y} to +y, {self.tilt_origin}), "
            f"choice of window (ends up to {100 * self.inwards:g} % inwards)"
        )

    @property
    def calibration(self) -> str:
        """The calibration's uncertainty, for people: 0.3 % of each axis, set."""
        return f"{100 * self.gain_error:g} % of each axis, {self.gain_error_origin}"

    @property
    def kinds(self) -> Mapping[str, str]:
        """Description of the intervals of numbers that are not plain means, for people."""
        low, high = (100 * share for share in self.slide_share)
        return {
            "normal_force": "zero and its drift, calibration, choice of window, for the tangential force too; how the "
            "force varies along the stroke is not an uncertainty of its mean",
            "heading": "noise, zero, choice of window, and unequal gains of the axes, but not a rotated "
            "transducer; beside it the share of repeats with the reported direction",
            "onset": "the zero, and the detector repeated with fresh noise on a force that rises as steeply; a gain "
            "does not move an instant; no interval where a person decided the instant",
            "break_away": "wild bootstrap of the residuals of the fitted rise (the same blocks), zero, and the end of "
            "the fit; a gain does not move an instant; no interval where a person decided the instant",
            "slide_onset": f"a range of thresholds from {low:g} to {high:g} % of the steady speed, with noise and "
            "variation of the speed; from the contact on where the finger already slid when its speed was first known; "
            "no interval where a person decided the instant",
        }
