"""The friction of a stroke as the model is given it, and the contact area by which a force becomes a traction.

Hertz: of a smooth elastic sphere on a plane the area grows as N^(2/3) (Johnson 1985, Contact Mechanics, section 4.2).
A finger is neither; the exponent and the force at which the area is the planned one are assumed unless somebody gives
them. No area is measured here.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from sessions.plan.plan import PROXIMAL_TO_DISTAL, Trial
from sessions.strokes.stroke import Meaning, Stroke

Array = NDArray[np.float64]

HERTZ = 2.0 / 3.0
PLANNED_AT = 2.0  # normal force at which an area that grows is the planned one, where nobody said another [N]


@dataclass(frozen=True, slots=True)
class AreaLaw:
    """Contact area = planned area x (N / force)^exponent; `exponent` 0 is a fixed area."""

    law: Literal["fixed", "hertz", "power"] = "fixed"
    exponent: float = 0.0
    force: float = PLANNED_AT  # [N]

    def area(self, normal: Array, planned: float) -> Array:
        """Return the contact area (n,) [mm2] under a normal force (n,) [N], > 0; `planned` [mm2].

        >>> AreaLaw("power", 0.5, 1.0).area(np.array([1.0, 4.0]), 100.0)
        array([100., 200.])
        """
        return planned * (normal / self.force) ** self.exponent

    @property
    def sentence(self) -> str:
        """The law, for people, with what was assumed."""
        if self.law == "fixed":
            return "fixed, whatever the normal force"
        assumed = ", assumed" if self.force == PLANNED_AT else ", set"
        why = "Hertz, sphere on plane: Johnson 1985, section 4.2; assumed of a finger" if self.law == "hertz" else "set"
        return f"grows as N^{self.exponent:.3g} ({why}), and is the planned one at {self.force:g} N{assumed}"


FIXED = AreaLaw()


Rule = Literal["maximum", "mean over steady window"]


@dataclass(frozen=True, slots=True)
class FrictionParameters:
    """What the model gets of one stroke. None where honesty allows no number."""

    trial: Annotated[int | None, Meaning("", "number of the trial")]
    stroke: Annotated[int, Meaning("", "position of the stroke, from 0")]
    mu: Annotated[float | None, Meaning("", "coefficient of friction the model is given")]
    mu_interval: tuple[float, float] | None  # the bootstrap's, of that very number; None before it is drawn
    tau_max: Annotated[float | None, Meaning("MPa", "traction bound the model is given")]
    contact_area: Annotated[float, Meaning("mm2", "for which tau_max was computed")]
    speed: Annotated[float | None, Meaning("mm/s", "of the stroke")]
    direction: Annotated[int | None, Meaning("", "+1 proximal to distal, -1 back, as measured")]
    rule: Annotated[Rule, Meaning("", "which T/N mu is")]
    flaws: Annotated[tuple[str, ...], Meaning("", "names of what is wrong with the stroke")]


def rule_for(trial: Trial | None) -> Rule:
    """Return the paper's choice (section 3): the maximum for stickiness, the mean over the steady range elsewhere.

    A protocol with other descriptors is judged by direction: pushed forward the skin is blocked first, as in the
    paper's stickiness, and the maximum is about the dynamic value. A recording without a plan gets the mean.
    """
    if trial is None or trial.stimulus.descriptor == "slipperiness":
        return "mean over steady window"
    if trial.stimulus.descriptor == "stickiness" or trial.direction == PROXIMAL_TO_DISTAL:
        return "maximum"
    return "mean over steady window"


def friction_parameters(stroke: Stroke, at: int, trial: Trial | None, contact_area: float) -> FrictionParameters:
    """Return what the model gets of the stroke at a position of `Analysis.strokes`."""
    rule = rule_for(trial)
    return FrictionParameters(
        trial=stroke.trial,
        stroke=at,
        mu=stroke.mu_max if rule == "maximum" else stroke.mu_dynamic,
        mu_interval=None,
        tau_max=stroke.tau_max,
        contact_area=stroke.contact_area or contact_area,
        speed=stroke.speed,
        direction=stroke.direction,
        rule=rule,
        flaws=stroke.flaws,
    )
