"""Options of a prediction: finger, depth, course, strain and variants; and the scene file that describes a finger."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from sessions.file_access import leaves
from sessions.plan.plan import SessionPlan
from sessions.toml_file import SettingsError, from_toml, text_of
from solver import Friction, Loading, Scene
from solver.quantities import QUANTITIES, Quantity
from solver.scene.published import BOUND_SCALE
from solver.scene.published import Reading as TauReading

Kinematics = Literal["small", "finite"]  # strain
BY_NAME: Mapping[str, Quantity] = {quantity.name: quantity for quantity in QUANTITIES}


@dataclass(frozen=True, slots=True)
class PredictionOptions:
    """A user's options of a prediction."""

    tau_reading: TauReading = "computed"  # "as-printed": a hundredth of it, as headed in the paper's tables
    scene: Scene | None = None  # source of finger, width, materials, receptor and tolerance; None: the published one
    indentation: float | None = None  # [mm], instead of each block's own
    course: Literal["steady", "history"] = "history"
    kinematics: Kinematics = "small"
    # Intervals of each SED from the uncertainty of friction, and variants: see `prediction.uncertainty`
    intervals: bool = False
    variant_intervals: bool = False  # also for variants at finite strain, which takes longer
    variants: Literal["none", "small", "both"] = "none"  # at which strain


def with_own_finger(options: PredictionOptions, plan: SessionPlan) -> PredictionOptions:
    """Return the options with the subject's own finger, as far as the plan has it, unless they name another."""
    if options.scene is not None:
        return options
    published = template(options)
    finger = replace(
        published.finger,
        tip_radius=plan.finger.tip_radius or published.finger.tip_radius,
        contact_angle=plan.contact_angle,
        width=plan.finger.width or published.finger.width,
    )
    scene = replace(published, finger=finger)
    return options if scene == published else replace(options, scene=scene)


def template(options: PredictionOptions) -> Scene:
    """Return the scene with the finger; friction and loading are replaced for each trial."""
    return options.scene or Scene(friction=Friction(0.0), loading=Loading(1.0))


def tau_scale(options: PredictionOptions) -> float:
    """Return the factor of the measured tau_max in the chosen reading."""
    return BOUND_SCALE[options.tau_reading] / BOUND_SCALE["computed"]


def bound(tau_max: float | None, options: PredictionOptions) -> float | None:
    """Return the traction bound [MPa] in the chosen reading."""
    return None if tau_max is None else tau_max * tau_scale(options)


# Placeholders that every scene needs; `sessions.prediction.scenes` replaces them by those of the trials.
_OF_TRIALS: Mapping[str, Mapping[str, Any]] = {"friction": {"mu": 0.0}, "loading": {"indentation": 1.0}}
_OF_OPTIONS = ("kinematics", "course", "evidence")


def finger_in(path: Path) -> tuple[Scene, str]:
    """Return the scene with a file's finger, materials, receptor and tolerance, and a sentence on ignored keys.

    The file may lack friction and loading. The sentence is "" where no key is ignored. Raises FileNotFoundError, and
    SettingsError for an error in the used part, or where nothing is used.
    """
    text = text_of(path)
    scene = from_toml(text, Scene, str(path), instead=_OF_TRIALS)
    document = tomllib.loads(text)
    keys = [f"[{name}]" for name in _OF_TRIALS if name in document]
    keys += [f"solve.{name}" for name in _OF_OPTIONS if name in document.get("solve", {})]
    not_taken = ("title", *_OF_TRIALS, *(f"solve.{name}" for name in _OF_OPTIONS))
    if all(name.startswith(not_taken) for name, _ in leaves(document)):
        raise SettingsError(f"{path} says nothing of a finger; give it [finger] or [materials], or name no file")
    if not keys:
        return scene, ""
    verb = "is" if len(keys) == 1 else "are"
    return scene, (
        f"{path}: {', '.join(keys)} {verb} not taken: each trial brings its own friction and loading, and strain "
        "and course are options of the verb"
    )
