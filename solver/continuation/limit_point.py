"""How far settled sliding goes, on meshes made for it.

A rough mesh is followed along the branch to near its end, and tells where the skin is squeezed most. Skin folds within
some tenths of a millimetre: on a mesh with small elements there the branch is followed on. What that mesh is good to is
measured.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

from solver.arrays import Array
from solver.continuation.arc_length import CREASE, LARGEST_MU, TOLERANCE, Branch, continue_branch
from solver.continuation.surface_instability import folds_at
from solver.equilibrium.finger import FiniteFinger, finite_laws
from solver.equilibrium.full_slip import settled
from solver.equilibrium.newton import BY_DEPTH, BY_FRICTION, EquilibriumState, LoadState
from solver.failures import NotConverged
from solver.mesh.mesher import EPIDERMIS, Sizing
from solver.scene.scene import Finger, Materials, Receptor, Scene

FINENESS = 7.0  # of both meshes, but where the skin folds
MARGIN = 6.0  # how far above the indentation the undeformed skin may lie and still be looked at for contact
SMOOTH = 0.66  # stretch down to which a rough mesh has the states of the fine one
SOUND = 0.65  # least stretch of the skin from which others may be sought: neo-Hookean surfaces fold at 0.54
PLAIN = 0.71  # and that needs no proof: just below limits meshes not made for the fold have up to 0.70
ASTRAY = 0.5  # between where the skin folds and where it was thought to, from which another mesh is made [mm]
STARTS = (0.3, 0.1, 0.03, 0.01)  # of the depth asked for, at which its branch may begin
NEARLY = 0.02  # stretch above the one that folds, from which a limit is near: about two hundredths of the friction


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """How far the branch of settled sliding goes, from no friction or from a small depth."""

    value: float  # coefficient of friction, or depth [mm]: the one asked for, or the largest
    limited: bool  # whether it ends there
    lost: bool  # whether it was lost there, and may go on
    least: float  # least stretch of the skin at its last state [-]
    folds: float  # stretch at which it would fold [-]
    numbers: Array  # (3,) SED of the ending, normal and tangential force at its last state

    @property
    def near(self) -> bool:
        """Whether the last state lies near a limit."""
        return self.least < self.folds + NEARLY


@dataclass(frozen=True, slots=True)
class _Question:
    finger: Finger
    materials: Materials
    receptor: Receptor
    load: LoadState
    by: int
    target: float
    scene: Scene = field(compare=False)
    stop: Callable[[], bool] = field(compare=False)


def of_friction(scene: Scene, load: LoadState, target: float, stop: Callable[[], bool] = lambda: False) -> Reach:
    """Return how far sliding at the depth and bound of `load` goes from mu = 0 towards `target`.

    Raises NotConverged where not even the frictionless state is found, Cancelled where `stop` says so.
    """
    return _reach(_asked(scene, load._replace(mu=0.0), BY_FRICTION, target, stop))


def of_depth(scene: Scene, load: LoadState, stop: Callable[[], bool] = lambda: False) -> Reach:
    """Return how far sliding at the friction of `load` goes from a small depth towards that of `load`.

    Raises NotConverged where there is none even at a hundredth of it, Cancelled where `stop` says so.
    """
    return _reach(_asked(scene, load, BY_DEPTH, load.depth, stop))


def sound(finger: FiniteFinger, shape: EquilibriumState, least: float = SOUND) -> bool:
    """Return whether the skin is nowhere squeezed to `least`, has no crease and does not cross itself."""
    compression = finger.skin_compression(shape)
    return compression.lowest >= least and compression.kink <= CREASE and not finger.crosses(shape)


def folded(finger: FiniteFinger, shape: EquilibriumState) -> bool:
    """Return whether the skin has a crease or crosses itself."""
    return finger.skin_compression(shape).kink > CREASE or finger.crosses(shape)


def _asked(scene: Scene, load: LoadState, by: int, target: float, stop: Callable[[], bool]) -> _Question:
    return _Question(scene.finger, scene.materials, scene.receptor, load._replace(travel=0.0), by, target, scene, stop)


@lru_cache(maxsize=32)
def _reach(asked: _Question) -> Reach:
    """Answer, and keep what was answered: all meshes of a scene ask the same."""
    folds = folds_at(finite_laws(asked.materials)[EPIDERMIS])
    sizing = Sizing(FINENESS, asked.load.depth, margin=MARGIN)
    rough = FiniteFinger.of(asked.scene, sizing)
    branch = _followed(rough, _start(rough, asked), asked, folds)
    if not branch.limited and sound(rough, branch.last, PLAIN):
        return _told(rough, branch, folds)
    fine, branch, place = _finely(rough, branch.states, asked, folds)
    if abs(_squeezed(fine, branch.last) - place) > ASTRAY:
        fine, branch, _ = _finely(fine, branch.states, asked, folds)
    return _told(fine, branch, folds)


def _finely(
    finger: FiniteFinger, states: tuple[EquilibriumState, ...], asked: _Question, folds: float
) -> tuple[FiniteFinger, Branch, float]:
    """Follow the branch on a mesh that is fine where the last of these `states` is squeezed most; return that place."""
    place = _squeezed(finger, states[-1])
    fine = FiniteFinger.of(asked.scene, Sizing(FINENESS, asked.load.depth, margin=MARGIN, fold=place))
    return fine, _followed(fine, _begun(fine, finger, states, asked), asked, folds), place


def _followed(finger: FiniteFinger, start: EquilibriumState, asked: _Question, folds: float) -> Branch:
    """Return the branch from `start` on. Beyond LARGEST_MU the bound decides, and what is asked for is a step away."""
    target = asked.target if asked.by == BY_DEPTH else min(asked.target, LARGEST_MU)
    branch = continue_branch(finger, start, asked.by, target, folds, asked.stop)
    if branch.limited or target == asked.target:
        return branch
    last = settled(finger.newton, branch.last.load._replace(mu=asked.target), branch.last, TOLERANCE, asked.stop)
    return Branch((*branch.states, last), asked.target, limited=False)


def _told(finger: FiniteFinger, branch: Branch, folds: float) -> Reach:
    least = finger.skin_compression(branch.last).least
    return Reach(float(branch.value), branch.limited, branch.lost, least, folds, finger.numbers([branch.last])[0])


def _squeezed(finger: FiniteFinger, shape: EquilibriumState) -> float:
    """Return the arc position where the skin is squeezed most [mm]."""
    place = finger.skin_compression(shape).place
    return float(finger.geometry.arcs[place : place + 2].mean())


def _start(finger: FiniteFinger, asked: _Question) -> EquilibriumState:
    """Return the state at which the branch begins. Raises NotConverged."""
    if asked.by == BY_FRICTION:
        return settled(finger.newton, asked.load, None, TOLERANCE, asked.stop)
    for part in STARTS:
        try:
            start = settled(finger.newton, asked.load._replace(depth=part * asked.target), None, TOLERANCE, asked.stop)
        except NotConverged:
            continue
        if sound(finger, start):
            return start
    raise NotConverged(
        f"no sliding state was found at mu = {asked.load.mu:.3g} even at {STARTS[-1] * asked.target:.3g} mm: ask for "
        "less friction"
    )


def _begun(
    fine: FiniteFinger, rough: FiniteFinger, states: tuple[EquilibriumState, ...], asked: _Question
) -> EquilibriumState:
    """Return a state of the branch on the `fine` mesh from which to go on: the last that is as good on the rough one.

    Raises NotConverged.
    """
    for state in reversed(states):
        if rough.skin_compression(state).lowest < SMOOTH:
            continue
        try:
            shape = settled(fine.newton, state.load, fine.transfer(state, rough), TOLERANCE, asked.stop)
        except NotConverged:
            continue
        if sound(fine, shape) or state is states[0]:
            return shape
    return _start(fine, asked)
