"""The depth at which the model presses as hard as a measured finger did."""

from collections.abc import Sequence

from solver.contact import ContactLost
from solver.finger import FingerModel
from solver.friction import FrictionLaw
from solver.mesher import Sizing
from solver.pressing import depth_of, sliding_under
from solver.scene import Scene

FINENESS = 6.0  # good to some tenths of a per cent of the depth
DEEPEST = 0.85  # of the tissue between first touch and bone: beyond, a small-strain depth means nothing


def matching_depths(
    scenes: Sequence[Scene], normal_forces: Sequence[float], *, in_loops: bool = False
) -> tuple[float | None, ...]:
    """Return for each scene the indentation [mm] at which its settled normal force is the given one [N/mm].

    Found directly, with the depth as an unknown and the force given. All scenes share the finger, materials and
    receptor of the first. None where the finger would be pressed to its bone, or has no such settled state. `in_loops`
    as in `solver.solution.answers`.
    """
    if not scenes:
        return ()
    deepest = DEEPEST * scenes[0].finger.pulp_thickness()
    finger = FingerModel.of(scenes[0], Sizing(FINENESS, deepest), in_loops=in_loops)
    return tuple(_depth(finger, scene, force, deepest) for scene, force in zip(scenes, normal_forces, strict=True))


def expected_depth(scene: Scene, *, in_loops: bool = False) -> float:
    """Return the indentation [mm], or about what a given force will lead to, for which meshes are made."""
    if scene.normal_force is None:
        return scene.loading.depth
    depth = matching_depths((scene,), (scene.normal_force,), in_loops=in_loops)[0]
    return DEEPEST * scene.finger.pulp_thickness() if depth is None else depth


def _depth(finger: FingerModel, scene: Scene, normal_force: float, deepest: float) -> float | None:
    law = FrictionLaw(float(scene.friction.mu), scene.friction.cap)
    try:
        found = sliding_under(finger.body.touchable, law, normal_force, scene.loading.direction or 1, deepest)
    except ContactLost:
        return None
    inside = not (found.touching[0] or found.touching[-1])
    return depth_of(found) if inside and depth_of(found) <= deepest else None
