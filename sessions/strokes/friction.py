"""The friction of a stroke as the model is given it."""

from dataclasses import dataclass
from typing import Literal

from sessions.plan.plan import PROXIMAL_TO_DISTAL, Trial
from sessions.strokes.stroke import Stroke

Rule = Literal["maximum", "mean over steady window"]


@dataclass(frozen=True, slots=True)
class FrictionParameters:
    """What the model gets of one stroke. None where honesty allows no number."""

    trial: int | None
    stroke: int  # position in `Analysis.strokes`
    mu: float | None  # [-]
    mu_interval: tuple[float, float] | None  # the bootstrap's, of that very number; None before it is drawn
    tau_max: float | None  # [MPa]
    contact_area: float  # that tau_max was told for [mm2]
    speed: float | None  # [mm/s]
    direction: int | None  # as measured: +1 proximal to distal, -1 back
    rule: Rule  # which mu it is
    flaws: tuple[str, ...]


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
