"""What a user may ask of the model, and the finger that it is asked of."""

from dataclasses import dataclass, replace
from typing import Literal

from sessions.plan.plan import SessionPlan
from solver import Friction, Loading, Scene
from solver.scene.published import SCALE
from solver.scene.published import Reading as TauReading


@dataclass(frozen=True, slots=True)
class PredictionOptions:
    """What a user may ask of the model."""

    tau_reading: TauReading = "computed"  # "as-printed": a hundredth of it, as the paper's tables are headed
    scene: Scene | None = None  # whose finger, width, materials, receptor and tolerance to take; None: the published
    indentation: float | None = None  # [mm], instead of each block's own
    course: Literal["steady", "history"] = "history"
    kinematics: Literal["small", "finite"] = "small"
    intervals: bool = (
        False  # also what the uncertainty of friction makes of each SED, see `sessions.prediction.uncertainty`
    )
    variant_intervals: bool = False  # those of the variants at finite strain too, which takes longer
    variants: Literal["none", "small", "both"] = (
        "none"  # also otherwise, see `sessions.prediction.side_by_side`; at which strain
    )


def with_own_finger(options: PredictionOptions, plan: SessionPlan) -> PredictionOptions:
    """Return the options with the subject's own finger, as far as the plan knows it and no other was asked for."""
    if options.scene is not None:
        return options
    published = template(options)
    own = replace(
        published.finger,
        tip_radius=plan.finger.tip_radius or published.finger.tip_radius,
        contact_angle=plan.contact_angle,
        width=plan.finger.width or published.finger.width,
    )
    scene = replace(published, finger=own)
    return options if scene == published else replace(options, scene=scene)


def template(options: PredictionOptions) -> Scene:
    """Return the scene whose finger is predicted; its friction and loading are put in for each trial."""
    return options.scene or Scene(friction=Friction(0.0), loading=Loading(1.0))


def tau_scale(options: PredictionOptions) -> float:
    """Return what tau_max as measured is multiplied by in the reading asked for."""
    return SCALE[options.tau_reading] / SCALE["computed"]


def bound(tau_max: float | None, options: PredictionOptions) -> float | None:
    """Return the traction bound [MPa] in the reading asked for."""
    return None if tau_max is None else tau_max * tau_scale(options)
