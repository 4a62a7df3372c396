"""What a scene asks of the surface, as equilibria see it."""

from solver.equilibrium.newton import Given, LoadState
from solver.scene.scene import Scene


def load_of(scene: Scene) -> LoadState:
    """Return depth, friction and bound of a scene as what the surface does; a bound of zero is no friction."""
    bound = scene.friction.cap
    depth = scene.loading.depth if scene.normal_force is None else 0.0  # found, where a force is given
    return LoadState(depth, float(scene.friction.mu) if bound > 0.0 else 0.0, bound)


def sliding_load(scene: Scene) -> LoadState:
    """Return what the surface does while it slides as a scene has it, or along +x where that does not matter."""
    return load_of(scene)._replace(sense=-(scene.loading.direction or 1))


def forces_of(scene: Scene, load: LoadState) -> Given | None:
    """Return the forces that a scene gives to a state under `load`, None where it gives a depth."""
    if scene.normal_force is None:
        return None
    holds = scene.tangential_force is not None and load.sense == 0 and not load.frictionless
    drag = -scene.loading.direction * scene.tangential_force if holds and scene.tangential_force is not None else None
    return Given(scene.normal_force, drag, load.travel)
