"""From a scene to a prediction: strain-energy density at a receptor in a fingertip that slides on a surface.

Lengths are in mm, times in s, forces in N per mm of width, stresses and energy densities in MPa.

>>> from solver import Friction, Loading, NoSteadyState, Scene, Solve, solve, solve_many
>>> slide = solve(Scene(friction=Friction(0.44), loading=Loading(1.5, "+x")))
>>> f"{1e3 * slide.sed_ending:.2f} kPa, drag {slide.tangential_force / slide.normal_force:.2f} of the normal force"
'5.43 kPa, drag 0.44 of the normal force'
>>> scenes = [Scene(friction=Friction(mu), loading=Loading(2.0, "+x"), solve=Solve("finite")) for mu in (0.2, 0.9)]
>>> [isinstance(answer, NoSteadyState) for answer in solve_many(scenes)]
[False, True]

Other names are private and may change; `docs/how-to/solve-another-body.md` lists those that other bodies need. Names
that need the compiled loops are imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from solver.failures import ContactLost, NoSteadyState, NotConverged, SolveFailure
from solver.progress import Cancelled
from solver.scene import Scene
from solver.scene.tables import (
    Finger,
    Friction,
    Loading,
    Material,
    Materials,
    Receptor,
    Relaxation,
    SceneError,
    Slide,
    Solve,
)

if TYPE_CHECKING:
    from solver.prediction import Prediction
    from solver.response.solution import solve, solve_many
    from solver.response.stepper import Stepper, stepper

_LATER = {
    "Prediction": "solver.prediction",
    "solve": "solver.response.solution",
    "solve_many": "solver.response.solution",
    "Stepper": "solver.response.stepper",
    "stepper": "solver.response.stepper",
}
__all__ = [
    "Cancelled",
    "ContactLost",
    "Finger",
    "Friction",
    "Loading",
    "Material",
    "Materials",
    "NoSteadyState",
    "NotConverged",
    "Prediction",
    "Receptor",
    "Relaxation",
    "Scene",
    "SceneError",
    "Slide",
    "Solve",
    "SolveFailure",
    "Stepper",
    "solve",
    "solve_many",
    "stepper",
]


def __dir__() -> list[str]:
    """Return the public names, including those imported on first use."""
    return __all__


def __getattr__(name: str) -> object:
    """Import a public name on first use. Raises AttributeError for an unknown name."""
    if name not in _LATER:
        raise AttributeError(f"module 'solver' has no attribute '{name}'")
    return getattr(import_module(_LATER[name]), name)
