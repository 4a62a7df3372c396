"""How far steady sliding goes at small strain: the limit at which the drag wedges the finger into the surface.

As the coefficient of friction grows, so does the force with which the drag presses the finger down, until the finger
yields less than it is pressed: the forces of the settled state grow without bound at a finite coefficient, and beyond
it there is no settled state. The limit is reached by following the state as the coefficient grows.
"""

from dataclasses import replace

from solver.contact import Contact, ContactLost, Course, Touchable
from solver.finger import FingerModel
from solver.friction import FrictionLaw
from solver.mesher import Sizing
from solver.scene import Scene

WIDE = 16.0  # margin at which nearly all the palmar skin may touch
FINENESS = 10.0  # of the meshes on which the limit of depth is looked for: it hardly depends on the mesh
PATIENCE = 15  # corrections of states that a small step may take
CLOSE = 0.005  # relative step of mu below which a limit is taken as found


def followed(body: Touchable, law: FrictionLaw, depth: float, direction: int) -> tuple[Contact | None, float]:
    """Return the settled sliding state reached by following it from mu = 0, and the largest mu that has one.

    The state is None where that mu falls short of the law's.
    """
    reached, step = 0.0, law.mu
    state = Course(body, replace(law, mu=0.0)).sliding(depth, direction)
    while reached < law.mu and step > CLOSE * max(reached, 0.01):
        aim = min(reached + step, law.mu)
        try:
            found = Course(body, replace(law, mu=aim), PATIENCE).sliding(depth, direction, state.state)
        except ContactLost:
            step /= 2.0
            continue
        if found.touching[0] or found.touching[-1]:  # the skin that may touch ends: what lies beyond is not known
            step /= 2.0
            continue
        state, reached, step = found, aim, 2.0 * step
    return (state if reached == law.mu else None), reached


def deepest(scene: Scene, law: FrictionLaw) -> float | None:
    """Return the largest indentation [mm] below the scene's with settled sliding under `law`, to 1 %; None for none."""
    low, high = 1e-3 * scene.loading.indentation, scene.loading.indentation
    if not _slides(scene, law, low):
        return None
    while high - low > 0.01 * high:
        middle = (low + high) / 2.0
        low, high = (middle, high) if _slides(scene, law, middle) else (low, middle)
    return low


def _slides(scene: Scene, law: FrictionLaw, depth: float) -> bool:
    finger = FingerModel.of(scene, Sizing(FINENESS, depth, margin=WIDE))
    return followed(finger.body.touchable, law, depth, scene.loading.direction)[0] is not None
