"""The friction of a trial as the model is given it."""

from dataclasses import dataclass

Rule = str  # "maximum" | "mean over steady window"


@dataclass(frozen=True, slots=True)
class FrictionParameters:
    """What the model gets of one stroke. None where honesty allows no number."""

    trial: int | None
    mu: float | None  # [-]
    mu_interval: tuple[float, float] | None
    tau_max: float | None  # [MPa]
    contact_area: float  # [mm2]
    speed: float | None  # [mm/s]
    direction: int | None  # +1 proximal to distal, -1 back
    rule: Rule  # which mu it is
    flaws: tuple[str, ...]
