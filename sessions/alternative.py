"""A trial predicted under another reading, at another strain, or driven otherwise: one more answer beside the first."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

Driven = Literal["depth", "force", "other way"]


@dataclass(frozen=True, slots=True)
class Way:
    """How a trial is predicted."""

    kinematics: Literal["small", "finite"]
    tau_reading: Literal["computed", "as-printed"]
    driven: Driven  # by the block's depth; by the force measured; by the depth, slid the other way

    @property
    def sentence(self) -> str:
        """The way, for people.

        >>> Way("finite", "as-printed", "depth").sentence
        'finite strain, tau_max as printed, at the planned depth'
        """
        reading = "tau_max as printed, " if self.tau_reading == "as-printed" else ""
        return f"{self.kinematics} strain, {reading}{_DRIVEN[self.driven]}"


_DRIVEN = {
    "depth": "at the planned depth",
    "force": "at the measured force",
    "other way": "at the planned depth, slid the other way",
}


_KINDS: Mapping[str, tuple[Literal["small", "finite"], ...]] = {
    "none": (),
    "small": ("small",),
    "both": ("small", "finite"),
}


@dataclass(frozen=True, slots=True)
class Alternative:
    """The settled state of a trial along one way. A number is None where `reason` says why."""

    way: Way
    tau_max: float | None  # that the model got [MPa]
    indentation: float | None  # given, or found under the force [mm]
    sed: float | None  # averaged over the ending [MPa]
    error_estimate: float | None  # relative, of sed
    normal_force: float | None  # of the whole finger [N]
    tangential_force: float | None  # [N]
    reason: str = ""


def ways(beside: Literal["none", "small", "both"]) -> Iterator[Way]:
    """Yield the ways asked for: those at small strain, or those at finite strain too."""
    for kinematics in _KINDS[beside]:
        yield Way(kinematics, "computed", "depth")
        yield Way(kinematics, "as-printed", "depth")
        yield Way(kinematics, "computed", "force")
        yield Way(kinematics, "computed", "other way")
