"""A trial predicted under another reading, at another strain, or driven otherwise: one more answer beside the first."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from sessions.prediction.sed_interval import SedInterval

Driven = Literal["depth", "force", "other way"]


@dataclass(frozen=True, slots=True)
class Variant:
    """How a trial is predicted."""

    kinematics: Literal["small", "finite"]
    tau_reading: Literal["computed", "as-printed"]
    driven: Driven  # by the block's depth; by the force measured; by the depth, slid the other way

    @property
    def sentence(self) -> str:
        """It, for people.

        >>> Variant("finite", "as-printed", "depth").sentence
        'finite strain, tau_max as printed, at the planned depth'
        """
        return f"{self.kinematics} strain, {self.way}"

    @property
    def way(self) -> str:
        """It, without the strain."""
        reading = "tau_max as printed, " if self.tau_reading == "as-printed" else ""
        return f"{reading}{_DRIVEN[self.driven]}"


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
    """The settled state of a trial in one variant. A number is None where `reason` says why."""

    variant: Variant
    tau_max: float | None  # that the model got [MPa]
    indentation: float | None  # given, or found under the force [mm]
    sed: float | None  # averaged over the ending [MPa]
    error_estimate: float | None  # relative, of sed
    normal_force: float | None  # of the whole finger [N]
    tangential_force: float | None  # [N]
    reason: str = ""
    traction: float | None = None  # the greatest friction traction on the skin: below tau_max that bounds nothing [MPa]
    interval: SedInterval | None = None  # of the SED, where it was asked for
    normal_force_error: float | None = None  # estimated by the solver, of normal_force, relative [-]; None: given
    tangential_force_error: float | None = None  # likewise of tangential_force
    indentation_error: float | None = None  # likewise of the indentation; None where that was given
    doubt: str = ""  # why the numbers are not to be believed, where the model was driven beyond its range


def variants(choice: Literal["none", "small", "both"]) -> Iterator[Variant]:
    """Yield the variants asked for: those at small strain, or those at finite strain too."""
    for kinematics in _KINDS[choice]:
        yield Variant(kinematics, "computed", "depth")
        yield Variant(kinematics, "as-printed", "depth")
        yield Variant(kinematics, "computed", "force")
        yield Variant(kinematics, "computed", "other way")
