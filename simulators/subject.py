"""A simulated subject: a hand that strokes a surface and a judge who scores it, from a seed, without the solver."""

from dataclasses import dataclass, replace

import numpy as np

from simulators.stroke import Stroke, Surface

SLIPPERIEST, STICKIEST = 0.24, 0.67  # coefficients of friction, the paper's extremes [-]


@dataclass(frozen=True, slots=True)
class SubjectSettings:
    """Variation between and within subjects. Scores are on the 0 to 100 line."""

    gain: float = 0.94  # mean gain of scores: few subjects use the whole line [-]
    gain_spread: float = 0.06  # standard deviation of the gain between subjects [-]
    offset_spread: float = 3.0  # standard deviation of the middle score between subjects
    judgement_noise: float = 4.0  # standard deviation between judgements of the same surface
    friction_weight: float = 0.0  # share of a judgement that follows friction instead of the maker's index [-]
    drift: float = 0.0  # rise of a judgement with each trial of its block
    carry_over: float = 0.0  # share of the preceding index's distance above the middle that is added [-]
    moisture: float = 0.0  # standard deviation of log friction between fingers [-]
    # With this difference in log µ the stroke of more friction is chosen in Φ(1) = 84 %. The JND is 18 % of µ, so that
    # comparisons of the paper's surfaces are neither random nor unanimous [-].
    discrimination: float = 0.25
    lapse: float = 0.04  # share of random choices by friction [-]


class SimulatedSubject:
    """One subject. The same seed gives the same strokes and scores, independent of the order of the surfaces.

    A `repetition` counts the strokes on a surface in a visit, from 1: each is made and judged anew.
    """

    def __init__(self, seed: int, settings: SubjectSettings | None = None) -> None:
        self.seed = seed
        self.settings = settings or SubjectSettings()
        draw = np.random.default_rng([seed, 2])
        self._gain = float(draw.normal(self.settings.gain, self.settings.gain_spread))
        self._offset = float(draw.normal(0.0, self.settings.offset_spread))
        self._stick = float(draw.uniform(0.4, 0.6))
        self._pace = float(draw.uniform(0.9, 1.1))
        self._slant = float(draw.normal(0.0, 1.5))
        self._moisture = float(np.exp(draw.normal(0.0, self.settings.moisture)))

    def perceived_surface(self, surface: Surface) -> Surface:
        """Return the surface with this subject's friction on it; normal forces are unchanged."""
        return replace(surface, mu=surface.mu * self._moisture, tau_max=surface.tau_max * self._moisture)

    def stroke(self, surface: Surface, repetition: int = 1) -> Stroke:
        """Return how the subject strokes `surface`: force and speed are the surface's, the rest is personal."""
        draw = self._draw(surface, repetition, 3)
        return Stroke(
            peak_normal_force=surface.peak_normal_force,
            speed=surface.speed,
            direction=surface.direction,
            approach=float(draw.uniform(0.6, 1.0)),
            stick=float(self._stick * draw.uniform(0.9, 1.1)),
            # A stroke covers about 40 mm; slower ones last longer, with a lower limit for perception.
            slide=float(np.clip(40.0 * self._pace / surface.speed, 1.9, 2.8) * draw.uniform(0.95, 1.05)),
            peak_at=float(draw.uniform(0.4, 0.7)),
            sag=float(draw.uniform(0.28, 0.4)),
            wander=float(draw.uniform(0.06, 0.14)),
            phases=tuple(draw.uniform(0.0, 2 * np.pi, 3).tolist()),
            slant=self._slant + float(draw.normal(0.0, 0.5)),
            across=float(draw.normal(0.0, 1.0)),
        )

    def score(
        self, surface: Surface, repetition: int = 1, position: int = 0, previous_index: int | None = None
    ) -> float:
        """Return the score on the line from 0 to 100, in tenths: the mark's position in hundredths of the line.

        `position` counts the earlier trials of the block, `previous_index` is the index judged last; None: the first.
        """
        noise = self._draw(surface, repetition, 4).normal(0.0, self.settings.judgement_noise)
        score = self.expected_score(surface, position, previous_index) + float(noise)
        return round(min(max(score, 0.0), 100.0), 1)

    def expected_score(self, surface: Surface, position: int = 0, previous_index: int | None = None) -> float:
        """Return the score without judgement noise and without the ends of the line."""
        settings = self.settings
        # Friction between the paper's extremes, as a score: stickier is more, slipperier is less.
        friction_score = 100.0 * (surface.mu - SLIPPERIEST) / (STICKIEST - SLIPPERIEST)
        judgement = friction_score if surface.descriptor == "stickiness" else 100.0 - friction_score
        target = (1.0 - settings.friction_weight) * surface.index + settings.friction_weight * judgement
        carry_over = 0.0 if previous_index is None else settings.carry_over * (previous_index - 50)
        return 50.0 + self._gain * (target - 50.0) + self._offset + settings.drift * position + carry_over

    def by_friction(self, descriptor: str) -> float:
        """Return the mean slope of scores on perceived µ [points], over subjects with these settings."""
        sense = 1.0 if descriptor == "stickiness" else -1.0
        return sense * self.settings.gain * self.settings.friction_weight * 100.0 / (STICKIEST - SLIPPERIEST)

    def more_friction(self, first: Surface, second: Surface, trial: int, take: int = 1) -> bool:
        """Say whether the first has more friction in this subject's judgement, independent in every trial.

        A cumulative-normal observer of log µ: right with probability Φ(difference / discrimination), random in lapses.
        """
        draw = np.random.default_rng([self.seed, 6, trial, take])
        if draw.uniform() < self.settings.lapse:
            return draw.uniform() < 0.5
        return bool(np.log(first.mu / second.mu) > draw.normal(0.0, self.settings.discrimination))

    def number(self, surface: Surface, repetition: int = 1) -> float:
        """Return the number on the subject's own scale: equal ratios for equal differences of judgement, above 0.

        Ten points on the line are a factor of 1.25; the modulus is the subject's own (log-uniform from 1 to 20).
        """
        modulus = 20.0 ** np.random.default_rng([self.seed, 5]).uniform()
        return float(f"{modulus * 1.25 ** (self.score(surface, repetition) / 10.0):.3g}")

    def _draw(self, surface: Surface, repetition: int, purpose: int) -> np.random.Generator:
        """Return the random generator of this subject, surface, repetition and purpose."""
        name = int.from_bytes(surface.descriptor.encode(), "big")
        return np.random.default_rng([self.seed, purpose, name, surface.index, repetition])
