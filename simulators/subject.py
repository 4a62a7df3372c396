"""A simulated subject: a hand that strokes a surface and a judge who scores it, from a seed. It knows no solver."""

from dataclasses import dataclass, replace

import numpy as np

from simulators.stroke import Stroke, Surface

SLIPPERIEST, STICKIEST = 0.24, 0.67  # coefficients of friction, the paper's extremes [-]


@dataclass(frozen=True, slots=True)
class SubjectSettings:
    """How subjects differ from one another and from themselves. Scores are on the 0 to 100 line."""

    gain: float = 0.94  # how far they spread their scores on average: few use the whole line [-]
    gain_spread: float = 0.06  # standard deviation between subjects of that [-]
    offset_spread: float = 3.0  # and of where they put the middle
    judgement_noise: float = 4.0  # standard deviation between judgements of the same surface
    friction_weight: float = 0.0  # share of a judgement that follows friction instead of the maker's index [-]
    drift: float = 0.0  # rise of a judgement with each trial of its block
    carry_over: float = 0.0  # and by this share of how far the index judged before lay above the middle [-]
    moisture: float = 0.0  # standard deviation between fingers of the logarithm of their friction [-]
    # Of two strokes that differ by this in log µ the one of more friction is chosen in Φ(1) = 84 %. A JND of 18 % of µ,
    # so that comparisons of the paper's surfaces are answered neither by chance nor all alike [-].
    discrimination: float = 0.25
    lapse: float = 0.04  # share of choices by friction that are made by chance [-]


class SimulatedSubject:
    """One subject. The same seed strokes and scores in the same way, whatever the order of the surfaces."""

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
        """Return the surface with this subject's friction on it; normal forces stay as they are."""
        return replace(surface, mu=surface.mu * self._moisture, tau_max=surface.tau_max * self._moisture)

    def stroke(self, surface: Surface, repetition: int = 1) -> Stroke:
        """Return how the subject strokes `surface`: force and speed are the surface's own, the course is personal."""
        draw = self._draw(surface, repetition, 3)
        return Stroke(
            peak_normal_force=surface.peak_normal_force,
            speed=surface.speed,
            direction=surface.direction,
            approach=float(draw.uniform(0.6, 1.0)),
            stick=float(self._stick * draw.uniform(0.9, 1.1)),
            # A stroke covers some 40 mm; slower ones last longer, none shorter than it takes to feel anything.
            slide=float(np.clip(40.0 * self._pace / surface.speed, 1.9, 2.8) * draw.uniform(0.95, 1.05)),
            peak_at=float(draw.uniform(0.4, 0.7)),
            sag=float(draw.uniform(0.28, 0.4)),
            wander=float(draw.uniform(0.06, 0.14)),
            phases=tuple(draw.uniform(0.0, 2 * np.pi, 3).tolist()),
            slant=self._slant + float(draw.normal(0.0, 0.5)),
            across=float(draw.normal(0.0, 1.0)),
        )

    def score(self, surface: Surface, take: int = 1, position: int = 0, previous_index: int | None = None) -> float:
        """Return the score on the line from 0 to 100, in tenths: the mark's position in hundredths of the line.

        `position` counts the earlier trials of the block, `previous_index` is the index judged last; None: the first.
        """
        noise = self._draw(surface, take, 4).normal(0.0, self.settings.judgement_noise)
        score = self.expected_score(surface, position, previous_index) + float(noise)
        return round(min(max(score, 0.0), 100.0), 1)

    def expected_score(self, surface: Surface, position: int = 0, previous_index: int | None = None) -> float:
        """Return what `score` would be without the noise of a single judgement and without an end of the line."""
        settings = self.settings
        # Friction between the paper's extremes, as a score: stickier is more, slipperier is less.
        friction_score = 100.0 * (surface.mu - SLIPPERIEST) / (STICKIEST - SLIPPERIEST)
        judgement = friction_score if surface.descriptor == "stickiness" else 100.0 - friction_score
        target = (1.0 - settings.friction_weight) * surface.index + settings.friction_weight * judgement
        carry_over = 0.0 if previous_index is None else settings.carry_over * (previous_index - 50)
        return 50.0 + self._gain * (target - 50.0) + self._offset + settings.drift * position + carry_over

    def by_friction(self, descriptor: str) -> float:
        """Return how many points a score rises with each unit of perceived µ, over subjects of these settings."""
        sense = 1.0 if descriptor == "stickiness" else -1.0
        return sense * self.settings.gain * self.settings.friction_weight * 100.0 / (STICKIEST - SLIPPERIEST)

    def more_friction(self, first: Surface, second: Surface, trial: int, take: int = 1) -> bool:
        """Say whether the first has more friction in the judgement of this subject, independent in every trial.

        A cumulative-normal observer of log µ: right with Φ(difference / discrimination), and by chance in a lapse.
        """
        draw = np.random.default_rng([self.seed, 6, trial, take])
        if draw.uniform() < self.settings.lapse:
            return draw.uniform() < 0.5
        return bool(np.log(first.mu / second.mu) > draw.normal(0.0, self.settings.discrimination))

    def number(self, surface: Surface, repetition: int = 1) -> float:
        """Return the number on the subject's own scale: judgements in equal ratios, above 0, of any size.

        Ten points on the line are a factor of 1.25; the modulus is the subject's own (log-uniform from 1 to 20).
        """
        modulus = 20.0 ** np.random.default_rng([self.seed, 5]).uniform()
        return float(f"{modulus * 1.25 ** (self.score(surface, repetition) / 10.0):.3g}")

    def _draw(self, surface: Surface, repetition: int, purpose: int) -> np.random.Generator:
        """Return a source of chance of this subject, this surface and this purpose alone."""
        name = int.from_bytes(surface.descriptor.encode(), "big")
        return np.random.default_rng([self.seed, purpose, name, surface.index, repetition])
