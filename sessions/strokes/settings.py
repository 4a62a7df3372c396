"""Every number the analysis and its intervals were set by; stored and shown with what came out.

Where no source stands beside a threshold, its reason does. Names of fields are unique among all groups.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from sessions.strokes.stroke import FIXED, AreaLaw

ASSUMED_GAIN_ERROR = 0.01  # standard uncertainty of each axis' gain where nobody stated the transducer's own [-]
TILT_PRIOR = 1.0  # standard uncertainty of the lean about an axis: 1 mm under one end of a sample 60 mm long [degrees]

Pair = tuple[float, float]
WindowRule = Literal["widened", "least variance", "middle half", "whole slide"]


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """What counts as touching; forces are above the measured zero."""

    onset_floor: float = 0.05  # a contact exceeds this [N] ...
    onset_noise: float = 5.0  # ... and so many standard deviations of the noise [-] ...
    onset_hold: float = 0.010  # ... for so long [s]
    leave_noise: float = 3.0  # its onset is walked back to where the force left so many standard deviations [-]
    lift_fraction: float = 0.6  # lifted below this fraction of the onset threshold [-] ...
    lift_hold: float = 0.020  # ... for so long [s]
    baseline: float = 0.3  # unloaded stretch that gives zero and noise [s]
    baseline_readings: int = 12  # and the fewest readings it may have
    baseline_parts: int = 6  # in which it is renewed
    quiet_noise: float = 2.0  # it is unloaded when its spread stays within so many times the noise [-] ...
    quiet_floor: float = 0.02  # ... or within this, for readings that were smoothed before they came [N]


@dataclass(frozen=True, slots=True)
class SignalSettings:
    """Which readings cannot be used."""

    missing_step: float = 1.8  # a step so many times the usual lacks a reading: two steps, less a tenth of jitter [-]
    uneven: float = 0.05  # spread of the time steps that makes the rate irregular [-]
    frozen_shortest: float = 0.05  # as long as this the same six numbers mean a frozen sensor [s] ...
    frozen_readings: int = 8  # ... and in so many readings
    frozen_refused: float = 0.5  # share of frozen readings from which on nothing is analysed [-]
    frozen_off: float = 0.1  # frozen to the end: so far from every rest before, as a share of an axis' range [-]
    coarse_steps: float = 3.0  # coarse: half an axis' changes are no more than so many of its least steps [-]
    coarse_jump: float = 2.0  # a jump of coarse steps: so many times the change that an axis seldom exceeds [-]
    flat_top: float = 0.02  # an axis so long at its own greatest or least value is clipped [s] ...
    flat_readings: int = 4  # ... in so many readings ...
    flat_jump: float = 3.5  # ... that it enters or leaves by so many least steps: a slow turn does neither [-] ...
    flat_around: float = 0.15  # ... while others move over so long: where nothing presses they only make noise [s] ...
    flat_moves: float = 3.0  # ... by a spread so many times their noise [-]
    long_run: float = 20.0  # frozen at another value, if so many times longer than its usual repeats [-]
    wild_noise: float = 10.0  # a wild reading stands beyond its neighbours by so many standard deviations of noise [-]
    wild_steps: float = 3.0  # ... and so many times the greatest step around it [-] ...
    wild_coarse: float = 4.0  # ... and so many least steps of a coarse axis [-]
    wild_widest: int = 2  # readings; a force that lasts longer may be a touch
    wild_neighbours: int = 2  # readings on each side that a wild one stands out of
    wild_around: int = 20  # readings on each side whose steps tell what is usual there
    wild_fewest: int = 8  # such steps; fewer tell nothing


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """How readings are smoothed and averaged."""

    cut_off: float = 20.0  # of the zero-phase filter of forces and torques [Hz]
    speed_cut_off: float = 5.0  # of the filter of the centre of pressure's speed [Hz]
    shortest_segment: int = 12  # readings; fewer have no filtered value, for the filter's ends reach across them
    smoothing: float = 0.1  # the maximum of T/N is that of the force means over so long [s]
    block: float = 0.1  # intervals and standard errors are those of the means over so long [s]
    fewest_blocks: int = 4  # of which a standard error is given


@dataclass(frozen=True, slots=True)
class ZeroSettings:
    """Where nothing presses, and how far that is trusted."""

    quiet_share: float = 0.002  # a spread below this share of the range of N is quiet whatever the noise [-]
    # ... and torques spread by less than this times the range of N: a standard deviation of 1 mm in 0.3 s is a centre
    # of pressure that moves at 11.5 mm/s, slower than the slowest published stroke (13 mm/s) [mm]
    quiet_moves: float = 1.0
    quiet_hops: int = 6  # windows start at every sixth of their length
    quiet_gap: float = 1.5  # a window that takes so many times its length holds a gap [-]
    zero_stretch: float = 0.6  # most of the unloaded stretch that gives the zero [s]
    near: float = 1.0  # unloaded forces so near a stroke tell how far its zero can be trusted [s]
    unloaded_share: float = 0.3  # a quiet stretch higher than this share of the range of N is a steady press [-]
    drift_doubted: float = 0.05  # doubtful: drift may have changed mu by this share [-]
    drift_refused: float = 0.10  # refused: by this one [-]


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """Which contacts are strokes, and where they are cut."""

    valley: float = 0.2  # two strokes are separated where N falls below this share of the lower peak [-]
    turn_share: float = 0.5  # to and fro: the drag counts beyond this share of the median T/N each way [-] ...
    turn_unsure: float = 2.0  # ... and beyond so many times what the zero leaves open [-] ...
    turn_shortest: float = 0.1  # ... and each way lasts so long beside the longest [-]
    turn_block: float = 0.05  # the drag is followed in means over so long [s] ...
    turn_recent: int = 4  # ... of which so many tell the way it pointed last
    light_share: float = 0.2  # a contact whose peak is below this share of the greatest is a light touch [-]
    shortest_stroke: float = 0.2  # a shorter contact is a tap [s]
    longest_gap: float = 0.05  # a peak may hide in a longer gap [s]
    gap_beside: float = 2.5  # readings: a contact so near to unsound ones may go on in them
    slow_onset: float = 0.5  # from onset to a fifth of the peak; a finger takes a tenth of it [s]
    greatest_force: float = 200.0  # a greater normal force is no finger's [N]
    pull_share: float = 0.5  # a recording that pulls so much of what it presses has another normal axis [-]
    curve_before: float = 0.25  # a stroke's curve begins so long before its onset [s] ...
    curve_after: float = 0.15  # ... and ends so long after its lift [s]


@dataclass(frozen=True, slots=True)
class SteadySettings:
    """Where T/N is steady."""

    steady_rule: WindowRule = "widened"  # how the steady window is chosen: see `sliding.steady_window`
    steady_seed: float = 0.5  # share of the slide over which the variance of T/N is least, before it is widened [-]
    steady_spread: float = 0.10  # steady: standard deviation of T/N over its mean [-] ...
    steady_trend: float = 0.05  # ... and the means of its four quarters differ from it by no more than this [-]
    steady_share: float = 0.25  # shortest steady window, as a share of the stroke [-] ...
    steady_shortest: float = 0.05  # ... in time [s] ...
    steady_readings: int = 5  # ... and in readings
    steady_held: float = 0.95  # share of a window's readings that must have a ratio [-]
    steady_edges: int = 121  # windows begin and end on a grid of so many instants


@dataclass(frozen=True, slots=True)
class SlideSettings:
    """What shows that the contact slides, how fast and which way."""

    sliding_share: float = 0.5  # sliding: the centre of pressure is faster than this share of its greatest speed [-]
    slide_share: float = 0.2  # the slide has begun: faster than this share of the steady speed [-]
    shear: float = 3.0  # the centre of pressure may move so far while the skin only shears [mm]
    # A finger that only rolls moves it no further than a quarter turn of a finger 15 mm wide (the width the model has):
    # 7.5 mm * pi / 2. Further than that, something slid [mm]
    roll: float = 11.8
    shear_steps: float = 2.0  # and so many steps of coarse torques are no movement [-]
    one_way: float = 0.9  # the tangential force keeps its direction: length of its mean unit vector [-] ...
    drag_share: float = 0.1  # ... where it exceeds this share of its greatest: the noise of less points anywhere [-]
    along_share: float = 0.5  # a direction along x: the drag's, or the speed's, share along it; 60 degrees off [-]
    side_load: float = 0.3  # so much of the drag across the movement is a load from the side [-]
    speed_error: float = 0.10  # a speed with a greater relative standard error is refused [-]
    speed_line: float = 0.95  # so is one whose line explains less than this share of the movement [-]
    speed_step: float = 0.10  # so is one whose centre of pressure moves in steps of this share of the way [-]
    height_doubt: float = 20.0  # how wrong a face height that nobody stated may be [mm]
    farthest: float = 150.0  # a centre of pressure further out is no finger's [mm]


@dataclass(frozen=True, slots=True)
class RatioSettings:
    """Where T/N means something, its static peak and its stick phase."""

    force_floor: float = 0.3  # T/N means nothing below this normal force [N] ...
    force_floor_share: float = 0.2  # ... nor below this share of the stroke's peak [-]
    light_half: float = 0.5  # T/N above 1 only below this share of the peak of N is drift or a load from the side [-]
    static_share: float = 0.05  # a static peak stands so far above what follows it [-] ...
    static_noise: float = 3.0  # ... and so many standard deviations of the noise of T/N [-] ...
    static_after: float = 0.2  # ... that follows it for so long [s]; ...
    static_late: float = 0.1  # ... it may come so long after the slide began [s]
    law_fewest: int = 5  # block means from which a power of N and its error are estimated
    law_steepest: float = -1.0 / 3.0  # power by which mu may follow N unseen: T as the area of a Hertz contact [-]
    slip_within: float = 0.02  # a slip drops T/N within so long: a fifth of a period at 10 Hz [s] ...
    slip_share: float = 0.05  # ... by this share of its level, as a static peak stands out [-] ...
    slip_noise: float = 4.0  # ... and so many deviations of a difference: once in 15000 readings by chance [-]
    slips_fewest: int = 3  # slips of stick-slip: two periods
    slips_upwards: float = 1.0 / 3.0  # climbs as sudden, for each slip, at most: hum has one for each [-]
    stick_rise: float = 0.1  # a stick phase: T/N climbs by this share of its level before it stays there [-] ...
    stick_left: float = 0.5  # ... and the climb leaves no more than this share of its variance [-]


@dataclass(frozen=True, slots=True)
class ClimbSettings:
    """How the climb of T/N before the break-away is fitted."""

    climb_bends: tuple[float, float] = (1.0, 2.0)  # from which the power of a climb is sought [-] ...
    climb_bend_limits: tuple[float, float] = (0.5, 4.0)  # ... and between which it stays [-]
    climb_falls: tuple[float, float] = (0.05, 0.15)  # from which the fall of a static peak to 1/e is sought [s] ...
    climb_fall_limits: tuple[float, float] = (0.005, 1.0)  # ... and between which it stays [s]
    climb_fewest: int = 5  # readings of the climb, and of the level
    climb_most: int = 400  # at most so many means stand for the readings
    climb_candidates: int = 41  # instants at which rest or level may meet the climb
    climb_shortest: float = 1e-3  # a climb takes so long [s]
    climb_steps: int = 60  # of Levenberg's and Marquardt's method at most
    climb_still: float = 1e-10  # a fit that gains no more than this share of the squares has settled [-]
    climb_bends_surely: float = 6.6  # ratio of variances from which a climb is not straight: 1 in 100 by chance [-]


@dataclass(frozen=True, slots=True)
class PressSettings:
    """Which contacts are presses, that tell how the face leans."""

    press_held: float = 0.5  # held: above this share of its peak [-] ...
    press_shortest: float = 0.5  # ... for so long [s] ...
    press_moves: float = 1.0  # ... while its centre of pressure moves no further [mm] ...
    press_ratio: float = 0.2  # ... and T/N stays below this [-]
    press_fewest: int = 3  # presses, or blocks of one press, of which an interval is given


@dataclass(frozen=True, slots=True)
class SystematicSettings:
    """What all readings of a session share, where nobody measured it."""

    # Standard uncertainty of what each force shows of another [-]; None: that of a gain. A certificate states one error
    # of an axis in per cent of full scale, whatever is loaded, so it holds for gain and cross-talk alike.
    cross_talk: float | None = None
    tilt_prior: float = TILT_PRIOR  # of the lean about each axis [degrees]


@dataclass(frozen=True, slots=True)
class AnalysisSettings:
    """How strokes are found and measured."""

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
    area: AreaLaw = FIXED  # by which tau_max is computed
    confidence: float = 0.95
    gain_error: float | None = None  # standard uncertainty of each axis' gain that somebody set [-]; None: assumed
    bootstrap_seed: int = 0  # of the intervals drawn
    tilt: tuple[float, float] = (0.0, 0.0)  # tilt of the face's normal to +x and +y that is levelled [degrees]

    @property
    def gain_uncertainty(self) -> float:
        """Standard uncertainty of each axis' gain [-]: the one that was set, or the one assumed."""
        return ASSUMED_GAIN_ERROR if self.gain_error is None else self.gain_error

    @property
    def cross_talk_uncertainty(self) -> float:
        """Standard uncertainty of what each force shows of another [-]: the one that was set, or that of a gain."""
        return self.gain_uncertainty if self.systematic.cross_talk is None else self.systematic.cross_talk

    def to_dict(self) -> dict[str, Any]:
        """Return every setting by its group, and for one release each also under its name alone, as it was before."""
        groups = asdict(self)
        alone = (groups[group] for group in _GROUPS)
        return {name: value for group in alone for name, value in group.items()} | groups


_GROUPS = ("signal", "filter", "zero", "contact", "steady", "slide", "ratio", "press")


@dataclass(frozen=True, slots=True)
class BootstrapSettings:
    """What every repeat draws from; stored with the intervals."""

    repeats: int = 1000
    seed: int = 0
    block: float = 0.1  # [s]
    inwards: float = 0.2  # the steady window may begin or end so much of its length further inwards [-]
    slide_share: tuple[float, float] = (0.1, 0.3)  # of the steady speed: at any between them the slide has begun [-]
    gain_error: float = ASSUMED_GAIN_ERROR  # standard uncertainty of each axis' gain [-]
    gain_error_origin: str = "assumed"  # nobody stated it for this transducer; "set" where somebody did
    cross_talk: float = ASSUMED_GAIN_ERROR  # standard uncertainty of what each force shows of another [-]
    tilt: tuple[float, float] = (0.0, 0.0)  # tilt of the face's normal to +x and +y that is not levelled [degrees]
    tilt_error: tuple[float, float] = (TILT_PRIOR, TILT_PRIOR)  # its standard uncertainty [degrees]
    tilt_origin: str = "assumed: too few presses to measure it"
    tilt_presses: int = 0  # that measured it: its error then follows Student's law, and holds cross-talk from N, too
    confidence: float = 0.95
    fewest_blocks: int = 4  # from which a spread is estimated
    fewest_quiet: int = 10  # readings before the onset from which noise is estimated ...
    quiet_before: float = 0.02  # ... which end so long before it: later ones may be the touch's already [s]
    top_share: float = 0.97  # readings above this share of the peak may be the peak [-]
    top_alike: float = 0.25  # ... and filtered ones nearer than this share of a block are alike [-]
    most_alike: float = 0.8  # neighbouring blocks: more cannot be estimated from so few [-]
    least_free: float = 2.0  # degrees of freedom of a mean, likewise
    onset_fewest: int = 3  # readings that tell how steeply the force climbs
    onset_most: int = 400  # readings about the crossing in which noise is drawn
    onset_steep: float = 0.2  # least steepness of a bent rise of force, by its mean steepness [-]
    onset_reach: float = 4.0  # standard deviations of the noise within which it may move the crossing [-]
    climb_ends: int = 5  # of the fit of a climb, from that of the steady window inwards
    detector: DetectorSettings = field(default_factory=DetectorSettings)  # those of the analysis
    climb: ClimbSettings = field(default_factory=ClimbSettings)  # likewise

    @classmethod
    def of(
        cls, settings: AnalysisSettings, lean: Pair = (0.0, 0.0), lean_error: Pair | None = None, presses: int = 0
    ) -> "BootstrapSettings":
        """Return what the intervals of an analysis are drawn from; `presses`, where any, measured the `lean`."""
        prior = settings.systematic.tilt_prior
        bootstrap = cls(
            seed=settings.bootstrap_seed,
            gain_error=settings.gain_uncertainty,
            gain_error_origin="assumed" if settings.gain_error is None else "set",
            cross_talk=settings.cross_talk_uncertainty,
            tilt_error=lean_error or (prior, prior),
            tilt_presses=presses,
            confidence=settings.confidence,
            detector=settings.detector,
            climb=settings.climb,
        )
        if not presses:
            return bootstrap
        remaining = (lean[0] - settings.tilt[0], lean[1] - settings.tilt[1])
        return replace(bootstrap, tilt=remaining, tilt_origin=f"by {presses} presses")

    @property
    def kind(self) -> str:
        """What an interval is, for people."""
        return (
            f"{100 * self.confidence:g} % percentile interval of {self.repeats} block-bootstrap repeats (blocks of "
            f"{self.block:g} s, widened for correlation between blocks, seed {self.seed}): sensor noise, zero and its "
            f"drift, calibration ({self.calibration}; cross-talk {100 * self.cross_talk:g} % of each other force), "
            f"tilt of the face ({self.lean_sentence}), choice of window (ends up to {100 * self.inwards:g} % inwards)"
        )

    @property
    def lean_sentence(self) -> str:
        """The tilt of the face that is not levelled, and its standard uncertainty, for people."""
        x, y = (f"{angle:.2g} ± {error:.2g}°" for angle, error in zip(self.tilt, self.tilt_error, strict=True))
        return f"{x} to +x and {y} to +y, {self.tilt_origin}"

    @property
    def calibration(self) -> str:
        """The calibration's uncertainty, for people: 0.3 % of each axis, set."""
        return f"{100 * self.gain_error:g} % of each axis, {self.gain_error_origin}"

    @property
    def kinds(self) -> Mapping[str, str]:
        """What the intervals hold of the numbers that are no plain means, for people."""
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
