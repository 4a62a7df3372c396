"""How far steady sliding goes at small strain: the limit at which the drag wedges the finger into the surface.

As the coefficient of friction grows, so does the force with which the drag presses the finger down, until the finger
yields less than it is pressed: the forces of the settled state grow without bound at a finite coefficient, and beyond
it there is no settled state. The limit is reached by following the state as the coefficient grows.
"""

from collections.abc import Callable
from contextlib import suppress
from math import log2, sqrt

from solver.body.linear import LinearBody
from solver.equilibrium.finger import settled_moduli
from solver.equilibrium.full_slip import settled, slide_beside, slide_under
from solver.equilibrium.newton import EquilibriumState, LoadState, Newton
from solver.failures import ContactLost
from solver.mesh.mesher import Sizing, finger_mesh
from solver.scene.scene import Scene

WIDE = 16.0  # margin at which nearly all the palmar skin may touch
FINENESS = 7.0  # of the meshes on which limits of depth and force are looked for: they hardly depend on the mesh
FINER = 1.6  # times as fine is the mesh on which a limit of depth is looked at once more
BEYOND = 2.0  # times the largest depth met as a force grew, up to which the largest is looked for
PATIENCE = 15  # corrections of states that a small step may take
LEAST = 1e-3  # part of a depth or force below which no limit of it is looked for
CLOSE = 0.005  # relative step of mu below which a limit is taken as found


def continue_branch(
    newton: Newton, load: LoadState, force: float | None = None, first: EquilibriumState | None = None
) -> tuple[EquilibriumState | None, float]:
    """Return the settled sliding state under `load` reached by following it from mu = 0, and the largest mu with one.

    The state is None where that mu falls short of the one of `load`. Under a normal `force`, `first` is the state at
    mu = 0; the mu is then 0 where contact grew beyond the skin that may touch: nothing is known.
    """
    reached, step, unknown = 0.0, load.mu, False
    try:
        state = settled(newton, load._replace(mu=0.0)) if first is None else first
    except ContactLost:
        return None, 0.0
    while reached < load.mu and step > CLOSE * max(reached, min(0.01, load.mu)):
        aim = min(reached + step, load.mu)
        try:
            found = slide_beside(newton, load._replace(mu=aim), state.state, force, PATIENCE)
        except ContactLost:
            step /= 2.0
            continue
        if found.touching[0] or found.touching[-1]:  # the skin that may touch ends: what lies beyond is not known
            step, unknown = step / 2.0, first is not None
            continue
        if first is not None and not found.load.depth > 0.0:  # pressed by a surface that it does not reach
            step /= 2.0
            continue
        state, reached, step = found, aim, 2.0 * step
    if reached == load.mu:
        return state, reached
    return None, 0.0 if unknown else reached


class Bodies:
    """Meshes of one finger, each for depths around a power of two."""

    def __init__(self, scene: Scene) -> None:
        """Make none yet."""
        self._scene = scene
        self._made: dict[int, Newton] = {}

    def at(self, depth: float) -> Newton:
        """Return a body whose mesh serves `depth` [mm], from 0.7 to 1.4 times the one it was made for."""
        power = round(log2(depth))
        if power not in self._made:
            self._made[power] = self.made_for(2.0**power, FINENESS)
        return self._made[power]

    def made_for(self, depth: float, fineness: float) -> Newton:
        """Return a body with a mesh of its own."""
        scene = self._scene
        mesh = finger_mesh(scene.finger, scene.receptor, Sizing(fineness, depth, margin=WIDE)).mesh
        return Newton(LinearBody.of(mesh, settled_moduli(scene.materials), checked=True).condensed)


def limits(scene: Scene, load: LoadState) -> tuple[float | None, float | None]:
    """Return the largest normal force [N/mm] and depth [mm] with settled sliding under `load`, to 3 and 4 %.

    Below those of the scene; the force is None where the scene gives none, and either where it is not known.
    """
    bodies = Bodies(scene)
    if scene.normal_force is None:
        return None, _deepest(bodies, load, scene.loading.depth)
    found = _strongest(bodies, scene, scene.normal_force, load)
    if found is None:
        return None, None
    return found[0], _deepest(bodies, load, BEYOND * found[1], found[1])


def _deepest(bodies: Bodies, load: LoadState, high: float, low: float | None = None) -> float | None:
    """Return the largest indentation [mm] below `high`, and above `low` where that is known, with settled sliding.

    None where there is none, or where a finer mesh puts it elsewhere, as it does at coefficients far beyond the limit.
    """

    def slides(depth: float) -> bool:
        return continue_branch(bodies.at(depth), load._replace(depth=depth))[0] is not None

    least = LEAST * high
    while low is None:
        if high < least:
            return None
        low, high = (high / 2.0, high) if slides(high / 2.0) else (None, high / 2.0)
    found = _largest(slides, low, high)
    finer = bodies.made_for(found, FINER * FINENESS)
    ends = [continue_branch(finer, load._replace(depth=part * found))[0] is None for part in (0.97, 1.03)]
    return found if ends == [False, True] else None


def _strongest(bodies: Bodies, scene: Scene, force: float, load: LoadState) -> tuple[float | None, float] | None:
    """Return the largest normal force [N/mm] below `force` with settled sliding, and the largest depth [mm] on the way.

    The force is None where a finer mesh puts it elsewhere; all is None where there is no sliding.
    """
    depths, bone = [0.0], scene.finger.pulp_thickness()
    bare = load._replace(mu=0.0)

    def reached(newton: Newton, force: float) -> EquilibriumState | None:
        return continue_branch(newton, load, force, slide_under(newton, bare, force, bone))[0]

    def rubless(force: float) -> float:
        return slide_under(bodies.at(bone / 2.0), bare, force, bone).load.depth

    def slides(force: float) -> bool:
        with suppress(ContactLost):
            found = reached(bodies.at(rubless(force)), force)
            if found is not None:
                depths.append(found.load.depth)
            return found is not None
        return False

    if not slides(LEAST * force):
        return None
    most = _largest(slides, LEAST * force, force)
    finer = bodies.made_for(rubless(most), FINER * FINENESS)
    ends = [reached(finer, part * most) is None for part in (0.97, 1.03)]
    return most if ends == [False, True] else None, max(depths)


def _largest(exists: Callable[[float], bool], low: float, high: float) -> float:
    """Return up to where between `low`, which does, and `high` there is what `exists`, within 1 %."""
    while high > 1.02 * low:
        middle = sqrt(low * high)
        low, high = (middle, high) if exists(middle) else (low, middle)
    return sqrt(low * high)
