"""The scene: its tables and their checks, the published finger and its ten surfaces."""

from solver.scene.scene import (
    TISSUES,
    Finger,
    Friction,
    Loading,
    Material,
    Materials,
    Receptor,
    Relaxation,
    Scene,
    SceneError,
    Slide,
    Solve,
)

__all__ = [
    "TISSUES",
    "Finger",
    "Friction",
    "Loading",
    "Material",
    "Materials",
    "Receptor",
    "Relaxation",
    "Scene",
    "SceneError",
    "Slide",
    "Solve",
]
