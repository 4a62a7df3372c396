"""The depth at which the model presses as hard as a measured finger did."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_stepping import slide_under, sliding_load
from solver.failures import ContactLost, NoSteadyState, NotConverged
from solver.mesh.mesher import Sizing
from solver.scene import Scene
from solver.scene.tables import SHALLOW, Friction, SceneError

FINENESS = 6.0  # good to some tenths of a per cent of the depth
COVERED = 0.9  # of the highest skin that touches: a mesh for that depth looks for contact up to 1.25 times of it
NEARLY = 0.5  # of what makes it slide, from which a finger that is dragged is about as deep as one that slides
DEEPEST = 0.85  # of the tissue between first touch and bone: beyond, a small-strain depth means nothing


def matching_depths(scenes: Sequence[Scene], normal_forces: Sequence[float]) -> tuple[float | None, ...]:
    """Return for each scene the indentation [mm] at which its settled normal force is the given one [N/mm].

    Found directly, with the depth as an unknown and the force given. All scenes share the finger, materials and
    receptor of the first. None where the finger would be pressed to its bone, or has no such settled state.
    """
    if not scenes:
        return ()
    deepest = DEEPEST * scenes[0].finger.pulp_thickness()
    finger = _finger(scenes[0].frictionless_press(deepest))
    pressed = [_pressed(finger, scene, force, deepest) for scene, force in zip(scenes, normal_forces, strict=True)]
    return tuple(None if state is None else state.load.depth for state in pressed)


def expected_depth(scene: Scene) -> float:
    """Return the indentation [mm], or about what a given force will lead to, for which meshes are made."""
    force = scene.normal_force
    if force is None:
        return scene.loading.depth
    deepest = DEEPEST * scene.finger.pulp_thickness()
    try:
        finger = _finger(scene.frictionless_press(deepest))
    except (SceneError, NotConverged):  # who makes the meshes that count will tell
        return deepest
    state = _pressed(finger, scene, force, deepest)
    drag = scene.tangential_force or 0.0
    held = scene.loading.direction == 0 or scene.loading.dragged
    if held and (state is None or drag < NEARLY * abs(state.force[0])):
        # Then it goes about as deep as one that slides with so much drag and no more.
        friction = Friction(min(drag / force, float(scene.friction.mu)), scene.friction.tau_max)
        state = _pressed(finger, replace(scene, friction=friction), force, deepest)
    if state is None:
        return deepest
    # A strong drag lifts the bone while it lays ever more skin on the surface, which the mesh must be made for.
    highest = float(finger.body.condensed.rest[state.touching, 1].max())
    return max(state.load.depth, COVERED * highest, SHALLOW)


def within_reach(scene: Scene, depth: float, most: float | None = None) -> None:
    """Raise SolveFailure where a given force has led to a `depth` [mm] that no model of the tissue reaches.

    `most` is the normal force [N/mm] that the tissue carries down to the bone, where that is known.
    """
    force, room = scene.normal_force, scene.finger.pulp_thickness()
    if force is None or SHALLOW <= depth < room:
        return
    if depth < 0.0:
        raise NotConverged(
            f"Under a normal force of {force:.3g} N/mm the drag holds the bone {-depth:.3g} mm above first touch: ask "
            "for more force, or less friction or drag."
        )
    if depth < SHALLOW:
        raise NotConverged(
            f"A normal force of {force:.3g} N/mm presses the finger {depth:.1g} mm deep only: below {SHALLOW:g} mm "
            "round-off is as large as what there is to find; ask for more."
        )
    carried = "" if most is None else f": with this friction the {room:.3g} mm of tissue carry up to {most:.3g} N/mm"
    raise NoSteadyState(
        f"A normal force of {force:.3g} N/mm would press the finger {depth:.3g} mm deep, to its bone{carried}; "
        "ask for less."
    )


@lru_cache(maxsize=1)
def _finger(bare: Scene) -> LinearFinger:
    """Return the finger on a rough mesh: surfaces of one finger follow each other and share it."""
    return LinearFinger.of(bare, Sizing(FINENESS, bare.loading.depth))


def _pressed(finger: LinearFinger, scene: Scene, normal_force: float, deepest: float) -> EquilibriumState | None:
    """Return the settled slide under a normal force [N/mm], None where none is less deep than `deepest` [mm]."""
    try:
        state = slide_under(finger.newton, sliding_load(scene), normal_force, deepest)
    except ContactLost:
        return None
    return None if state.reaches_end or state.load.depth > deepest else state
