"""What the intervals of a stroke are drawn from, and what they hold, for people."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from sessions.strokes.onset import DetectorSettings
from sessions.strokes.settings import ASSUMED_GAIN_ERROR, TILT_PRIOR, AnalysisSettings, ClimbSettings
from sessions.strokes.tilt import Tilt


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
    def of(cls, settings: AnalysisSettings, tilt: Tilt | None) -> "BootstrapSettings":
        """Return what the intervals of an analysis are drawn from; `tilt` is what its presses tell, if any."""
        bootstrap = cls(
            seed=settings.bootstrap_seed,
            gain_error=settings.gain_uncertainty,
            gain_error_origin="assumed" if settings.gain_error is None else "set",
            cross_talk=settings.cross_talk_uncertainty,
            confidence=settings.confidence,
            detector=settings.detector,
            climb=settings.climb,
        )
        if (
            tilt is None or len(tilt.presses) < settings.press.press_fewest
        ):  # of fewer, the hand's own push is not known
            prior = settings.systematic.tilt_prior
            return replace(bootstrap, tilt_error=(prior, prior))
        rest = (tilt.lean[0] - settings.tilt[0], tilt.lean[1] - settings.tilt[1])
        presses = len(tilt.presses)
        origin = f"by {presses} presses"
        return replace(bootstrap, tilt=rest, tilt_error=tilt.error, tilt_origin=origin, tilt_presses=presses)

    @property
    def kind(self) -> str:
        """What an interval is, for people."""
        return (
            f"{100 * self.confidence:g} % percentile interval of {self.repeats} block-bootstrap repeats (blocks of "
            f"{self.block:g} s, widened for correlation between blocks, seed {self.seed}): sensor noise, zero and its "
            f"drift, calibration ({self.calibration}; cross-talk {100 * self.cross_talk:g} % of each other force), "
            f"tilt of the face ({self.leaning}), choice of window (ends up to {100 * self.inwards:g} % inwards)"
        )

    @property
    def leaning(self) -> str:
        """The tilt of the face that is not levelled, and its standard uncertainty, for people."""
        x, y = (f"{a:.2g} ± {error:.2g}°" for a, error in zip(self.tilt, self.tilt_error, strict=True))
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
