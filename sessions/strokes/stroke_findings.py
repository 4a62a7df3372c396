"""The numbers and flaws of one stroke while they are gathered: a flaw names the numbers it forbids."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sessions.strokes.flaws import Flaw, FlawName, Grade

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
