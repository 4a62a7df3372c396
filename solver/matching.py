"""The depth at which the model presses as hard as a measured finger did."""

from collections.abc import Sequence

import numpy as np

from solver.contact import OPEN, SLIP, ContactLost, Course, forced
from solver.finger import FingerModel
from solver.friction import FrictionLaw
from solver.mesher import Sizing
from solver.scene import Scene

FINENESS = 8.0  # good to some tenths of a per cent of the depth
DEEPEST = 0.85  # of the tissue between first touch and bone: beyond, a small-strain depth means nothing


def matching_depths(scenes: Sequence[Scene], normal_forces: Sequence[float]) -> tuple[float | None, ...]:
    """Return for each scene the indentation [mm] at which its settled normal force is the given one [N/mm].

    Found directly, with the depth as an unknown and the force given. All scenes share the finger, materials and
    receptor of the first. None where the finger would be pressed to its bone, or has no such settled state.
    """
    if not scenes:
        return ()
    deepest = DEEPEST * scenes[0].finger.pulp_thickness()
    finger = FingerModel.of(scenes[0], Sizing(FINENESS, deepest))
    return tuple(_depth(finger, scene, force, deepest) for scene, force in zip(scenes, normal_forces, strict=True))


def _depth(finger: FingerModel, scene: Scene, normal_force: float, deepest: float) -> float | None:
    touch = finger.body.touchable
    course = Course(forced(touch, normal_force), FrictionLaw(float(scene.friction.mu), scene.friction.cap))
    for part in (0.3, 0.6, 0.1, 0.9):  # first guesses of the depth, for which points touch
        guess = np.where(touch.gap < part * deepest, SLIP, OPEN).astype(np.int8)
        try:
            found = course.sliding(0.0, scene.loading.direction or 1, guess)
        except ContactLost:
            continue
        depth = -float(found.motion[-1])
        inside = not (found.touching[0] or found.touching[-1])
        return depth if inside and 0.0 < depth <= deepest else None
    return None
