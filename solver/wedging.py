"""How far steady sliding goes at small strain: the limit at which the drag wedges the finger into the surface.

As the coefficient of friction grows, so does the force with which the drag presses the finger down, until the finger
yields less than it is pressed: the forces of the settled state grow without bound at a finite coefficient, and beyond
it there is no settled state. The limit is reached by following the state as the coefficient grows.
"""

from dataclasses import replace
from math import sqrt

from solver.body import Body
from solver.contact import Contact, ContactLost, Course, Touchable
from solver.friction import FrictionLaw
from solver.mesher import Sizing, finger_mesh
from solver.pressing import depth_of
from solver.scene import Scene
from solver.tissues import settled_moduli

WIDE = 16.0  # margin at which nearly all the palmar skin may touch
FINENESS = 7.0  # of the meshes on which the limit of depth is looked for: it hardly depends on the mesh
NEAR = (0.5, 1.5)  # depths that a mesh serves, by the depth it was made for
PATIENCE = 15  # corrections of states that a small step may take
CLOSE = 0.005  # relative step of mu below which a limit is taken as found


def followed(
    body: Touchable, law: FrictionLaw, depth: float, direction: int, first: Contact | None = None
) -> tuple[Contact | None, float]:
    """Return the settled sliding state reached by following it from mu = 0, and the largest mu that has one.

    The state is None where that mu falls short of the law's. Under a given force, with `body` free to move up, `first`
    is the state at mu = 0; the mu is then 0 where contact grew beyond the skin that may touch: nothing is known.
    """
    reached, step, unknown = 0.0, law.mu, False
    try:
        state = Course(body, replace(law, mu=0.0)).sliding(depth, direction) if first is None else first
    except ContactLost:
        return None, 0.0
    while reached < law.mu and step > CLOSE * max(reached, min(0.01, law.mu)):
        aim = min(reached + step, law.mu)
        try:
            found = Course(body, replace(law, mu=aim), PATIENCE).sliding(depth, direction, state.state)
        except ContactLost:
            step /= 2.0
            continue
        if found.touching[0] or found.touching[-1]:  # the skin that may touch ends: what lies beyond is not known
            step, unknown = step / 2.0, first is not None
            continue
        if first is not None and not depth_of(found) > 0.0:  # pressed by a surface that it does not reach
            step /= 2.0
            continue
        state, reached, step = found, aim, 2.0 * step
    if reached == law.mu:
        return state, reached
    return None, 0.0 if unknown else reached


def deepest(scene: Scene, law: FrictionLaw, *, in_loops: bool = False) -> float | None:
    """Return the largest indentation [mm] below the scene's with settled sliding under `law`, to 3 %.

    None where there is none, or where a finer mesh puts it elsewhere, as it does at coefficients far beyond the limit.
    `in_loops` as in `Body.of`.
    """
    body: Touchable | None = None
    meshed = 0.0  # depth that the body's mesh was made for [mm]

    def slides(depth: float) -> bool:
        nonlocal body, meshed
        if body is None or not NEAR[0] * meshed <= depth <= NEAR[1] * meshed:
            body, meshed = _body(scene, depth, FINENESS, in_loops), depth
        return followed(body, law, depth, scene.loading.direction)[0] is not None

    low, high = 1e-3 * scene.loading.depth, scene.loading.depth
    if not slides(low):
        return None
    while high > 1.01 * low:
        middle = sqrt(low * high)
        low, high = (middle, high) if slides(middle) else (low, middle)
    found = sqrt(low * high)
    body, meshed = _body(scene, found, 1.6 * FINENESS, in_loops), found
    return found if slides(0.97 * found) and not slides(1.03 * found) else None


def _body(scene: Scene, depth: float, fineness: float, in_loops: bool) -> Touchable:
    mesh = finger_mesh(scene.finger, scene.receptor, Sizing(fineness, depth, margin=WIDE)).mesh
    return Body.of(mesh, settled_moduli(scene.materials), in_loops=in_loops, checked=True).touchable
