"""How far numbers may be off: estimates from coarser meshes, and which mesh a tolerance asks for.

An estimate is made of a part of the largest difference between the answer and those of other meshes, and of what the
mesh alone decides: errors fall with fineness squared, and two meshes can agree by chance. Those are errors of different
kinds, which seldom are large together, so that the root of the sum of their squares is taken. At small strain there is
one coarser mesh of elements twice as long, moved along the skin by half of one, so that the edges of contact fall
differently between nodes (another one that is not moved told nothing more of 110 scenes); and under a traction bound
the drag is that bound times the length of skin that touches, known to a part of an element; forces have one more term,
which matters on the coarsest meshes alone, where both can agree by chance. At finite strain lines follow the edges, and
one coarser mesh will do, as long as it has fewer layers than the answer's: in the fat meshes of 3.6 to 6 have three,
and those of 6 agreed with those of 3.6 where both were 4 % off; in the skin meshes of 4 to 10 have four, and those of
10 agreed with those of 6 where both were 0.2 % off, three times as much as those of 11. What is left at the edges falls
hardly faster than elements get shorter. Where skin slips at the bound up to an edge, the mesh before its lines were
moved there is one of the others, and `felt` says what a number makes of the bound. Near the friction limit of small
strain numbers grow without bound, and each mesh has its own limit: there `felt` says what they make of the coefficient.
Meshes were chosen on the published finger; others' errors are larger, the more so the thinner the bone is, whatever two
meshes differ by. The factors were chosen and measured with the surveys of meshes of `solver.verification.survey`.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.contact.law import STEEP
from solver.equilibrium.step_error import Steps
from solver.mesh.mesher import ANYWHERE, EDGE, FINEST, POINT, SHORT
from solver.scene import Finger, Receptor, Scene

FINENESS = {"small": (5, 6, 8, 10, 12, 16, 20, 24), "finite": (7, 11, 14, 20, 24)}  # meshes that can be asked for
DEFAULT = {"small": 8, "finite": 11}
FROM_MESHES = {
    "small": 0.25,
    "finite": 0.36 / 0.64,  # what errors that fall with the square of an element leave of a mesh 0.6 times as fine
}
FROM_COURSES = 0.75  # the same at the end of a course at finite strain
AT_EDGES = 1.0  # and where skin slips at the bound up to an edge: between that and 1.5, were errors as long as elements
FROM_NAIL = {"small": 2.5, "finite": 4.0}  # the same where a nail ends: errors fall with the element, or its root
FROM_FINENESS = {"small": ((0.08, 2.0),), "finite": ((0.15, 2.0), (0.0215, 1.1))}  # the largest, by the power given
OF_OTHERS = ((0.115, 2.0), (0.8, 3.0))  # the same at small strain of any finger but the published one
ELSEWHERE = {"small": 1.3, "finite": 1.0}  # times that in the SED, where the receptor is not the published one
THIN = 0.75  # power with which those grow as the bone gets thinner by the tissue below it: fat is sheared most there
OF_STEEP = 2.0  # times what the mesh alone decides at small strain where friction is steep
FROM_ROOT = 0.05  # of both forces at small strain where a nail ends, by fineness
FROM_COARSE = 1.0  # of both forces at small strain, by fineness to the fourth power
FROM_FORCE = 10.0  # of the SED under a given force at finite strain, likewise
FROM_LIMIT, CALM = 3.0, 2.0  # of the mesh's own part, for every relative change by friction's beyond that many
FROM_BOUND = {"small": 0.2, "finite": 0.16}  # of an element that touches, in the drag under a bound
FROM_EDGE = {  # the same in all numbers where skin slips at the bound up to an edge of contact
    "small": 0.8,  # where friction is steep
    "finite": 0.12,
}
OF_DEPTH = 0.5  # of what the mesh alone decides, in a depth that is found at finite strain
FROM_WIDTH = {
    "small": 0.12,
    "finite": 0.08,
}  # of an element at the edge of contact, by which either edge may lie elsewhere
FROM_LIGHT = 0.025  # of the smallest element by half the contact, squared, in the SED
FROM_SHORT = 0.25  # of the smallest element, in the width of a contact that is no longer


class Errors(NamedTuple):
    """How far numbers may be off: relative, but for the shift. None for what was given, or is not there."""

    sed: float
    normal: float | None
    tangential: float | None  # 0 where nothing rubs
    indentation: float | None
    shift: float | None  # [mm]
    width: float | None  # of the contact


DEPTH = slice(3, 4)  # place of the indentation among the numbers
UNKNOWN = Errors(1.0, 1.0, 1.0, 1.0, None, 1.0)


def errors(
    scene: Scene,
    fineness: float,
    numbers: Array,
    others: Array,
    felt: Array,
    steps: Steps | None,
    bounded: Array | float = 0.0,
) -> Errors:
    """Return the errors of SED, normal and tangential force, indentation, shift and contact width, `numbers` (6,).

    `others` (n, 6), `felt` and `bounded` (6,) are as for `estimates`; but at the end of a course that depends on its
    way, which has taken `steps`, what is felt is the traction bound at both kinematics.
    """
    if not len(others):
        return _given_none(scene, UNKNOWN)
    driven = scene.driven(float(numbers[3]))
    forced = scene.normal_force is not None
    off = _off(driven, fineness, numbers, others, felt, bounded, marched=steps is not None, forced=forced)
    off[5] += 2.0 * FROM_WIDTH[scene.solve.kinematics] * _element(driven, fineness)
    of_light, of_width = _of_light(scene, float(numbers[5]))
    off[0] = np.hypot(off[0], of_light * abs(numbers[0]))
    off[1:4] = np.hypot(off[1:4], of_light / 2.0 * np.abs(numbers[1:4]))  # the SED goes with the force squared
    off[5] += of_width
    if steps is not None:
        more = steps.error(numbers)
        off[0] = np.hypot(off[0], more[0])
        off[1:] += more[1:]  # the drag that a press leaves over suffers from both in the same way
    relative = np.minimum(off / np.maximum(np.abs(numbers), np.finfo(float).tiny), 1.0)
    sed, normal, tangential, depth, _, width = relative.tolist()
    return _given_none(scene, Errors(sed, normal, tangential, depth, float(off[4]), width))


def _given_none(scene: Scene, found: Errors) -> Errors:
    """Return the errors without those of what the scene gives, and of the drag where nothing rubs."""
    by_force, dragged = scene.normal_force is not None, scene.loading.dragged
    rubs = scene.friction.mu > 0.0 and scene.friction.cap > 0.0
    return found._replace(
        normal=None if by_force else found.normal,
        tangential=None if dragged else found.tangential if rubs else 0.0,
        indentation=found.indentation if by_force else None,
        shift=found.shift if dragged else None,
    )


def estimates(
    scene: Scene,
    fineness: float,
    numbers: Array,
    others: Array,
    felt: Array | float = 0.0,
    bounded: Array | float = 0.0,
) -> Array:
    """Return the estimated errors (3,), relative, of SED, normal and tangential force `numbers` (3,) of a slide.

    `others` (n, 3) are those of the other meshes; where there are none, so near a limit that a coarser mesh has no
    state, nothing is known of the errors. `felt` (3,) is the relative change of each by that of the friction
    coefficient (small strain) or, where skin slips at the bound up to an edge of contact, of the bound (finite strain);
    `bounded` (3,) is the latter at small strain. A number that is 0 on all meshes, as the drag without friction, is
    exact.
    """
    if not len(others):
        return np.ones(len(numbers))
    size = np.maximum(np.abs(numbers), np.finfo(float).tiny)
    off = _off(scene, fineness, numbers, others, np.broadcast_to(felt, numbers.shape), bounded)
    return np.minimum(off / size, 1.0)


def _off(
    scene: Scene,
    fineness: float,
    numbers: Array,
    others: Array,
    felt: Array,
    bounded: Array | float,
    *,
    marched: bool = False,
    forced: bool = False,
) -> Array:
    """Return how far numbers may be off (n,): those of `estimates`, and maybe others of `errors` after them."""
    kind = scene.solve.kinematics
    size, largest = np.abs(numbers), np.abs(others - numbers).max(axis=0)
    part = np.full(len(numbers), _least(scene, fineness))
    part[0] *= ELSEWHERE[kind] if _elsewhere(scene) else 1.0
    if kind == "finite":
        part[DEPTH] *= OF_DEPTH
    if kind == "small":
        part *= OF_STEEP if scene.friction.mu > STEEP else 1.0
        part[1:] += FROM_COARSE / _resolved(scene, fineness) ** 4
        if scene.finger.nail_length > 0.0:
            part[1:] += FROM_ROOT / _resolved(scene, fineness)
        if forced:  # what the force would be off by at a depth, the SED is off by under the force
            part[0] = np.hypot(part[0], part[1])
        if not marched:
            part += FROM_LIMIT * _least(scene, fineness) * np.maximum(np.abs(felt) - CALM, 0.0)
    elif forced:
        part[0] = np.hypot(part[0], FROM_FORCE / _resolved(scene, fineness) ** 4)
    of_bound, of_edge = np.zeros(len(numbers)), np.zeros(len(numbers))
    if marched:
        contact = 2.0 * _half(scene) * scene.finger.tip_radius
        of_bound = FROM_BOUND[kind] * _element(scene, fineness) / contact * np.abs(felt)
    else:
        at_edge = np.abs(felt if kind == "finite" else bounded)
        if np.any(at_edge):
            of_edge = FROM_EDGE[kind] * scene.friction.cap * _element(scene, fineness) / size[2] * at_edge
        else:
            of_bound[2] = _of_bound(scene, fineness, float(size[1]), float(size[2]))
    from_meshes = (FROM_NAIL if scene.finger.nail_length > 0.0 else FROM_MESHES)[kind]
    if kind == "finite":
        from_meshes = max(from_meshes, FROM_COURSES if marched else AT_EDGES if np.any(of_edge) else 0.0)
    return np.linalg.norm([from_meshes * largest, part * size, of_bound * size, of_edge * size], axis=0)


def coarsest_for(scene: Scene, tolerance: float) -> float:
    """Return the fineness of the coarsest mesh whose estimate can meet the tolerance, the finest where none can.

    In a light touch that is one beyond which the smallest elements, along the skin, are as small as they get. For a
    receptor elsewhere than the published one it is none coarser than the usual one.
    """
    kind = scene.solve.kinematics
    usual, part = (DEFAULT[kind], ELSEWHERE[kind]) if _elsewhere(scene) else (0, 1.0)
    meets = (n for n in FINENESS[kind] if n >= usual and part * _least(scene, n) <= 0.9 * tolerance)
    return next(meets, next(n for n in FINENESS[kind] if n >= DEFAULT[kind] and not finer_than(scene, n)))


def finer_than(scene: Scene, fineness: float) -> list[int]:
    """Return the finer meshes, coarsest first; none where the contact is so light that they are none where it lies."""
    least = _least(scene, fineness)
    return [n for n in FINENESS[scene.solve.kinematics] if n > fineness and _least(scene, n) < least]


def _least(scene: Scene, fineness: float) -> float:
    """Return the part of an estimate that the mesh alone decides."""
    resolved, kind, published = _resolved(scene, fineness), scene.solve.kinematics, _published(scene)
    parts = OF_OTHERS if kind == "small" and not published else FROM_FINENESS[kind]
    thinner = 1.0 if published else _around_bone(scene.finger) / _around_bone(Finger())
    return thinner**THIN * max(part / resolved**order for part, order in parts)


def _elsewhere(scene: Scene) -> bool:
    """Return whether the receptor is another than the published one, by tip radius, on which meshes were chosen.

    One that is hardly more than a point has elements made for it.
    """
    own, published = (
        np.array([*r.ending, r.depth]) / f.tip_radius
        for r, f in ((scene.receptor, scene.finger), (Receptor(), Finger()))
    )
    return not np.allclose(own, published) and not np.all(own[:2] < POINT)


def _around_bone(finger: Finger) -> float:
    """Return how much tissue lies below the bone, by the bone's radius."""
    return finger.pulp_thickness() / finger.bone_radius


def _published(scene: Scene) -> bool:
    """Return whether outline and receptor are the published ones at any size, on which the meshes were chosen."""
    return _by_radius(scene.finger, scene.receptor) == _by_radius(Finger(), Receptor())


def _by_radius(finger: Finger, receptor: Receptor) -> tuple[float, ...]:
    inside = finger.epidermis, finger.dermis, finger.shaft_length, finger.bone_radius, *finger.bone_centre
    return tuple(round(length / finger.tip_radius, 9) for length in (*inside, receptor.depth, *receptor.ending))


def _resolved(scene: Scene, fineness: float) -> float:
    """Return the fineness that counts: less, where half the contact is shorter than that many smallest elements."""
    return min(fineness, _half(scene) / (ANYWHERE * FINEST))


def _half(scene: Scene) -> float:
    """Return half the length of the skin that may touch, by the tip's radius."""
    return sqrt(2.0 * scene.loading.depth / scene.finger.tip_radius)


def _element(scene: Scene, fineness: float) -> float:
    """Return the length of an element at an edge of contact [mm]."""
    long, short = (ANYWHERE, SHORT[0]) if scene.solve.kinematics == "small" else (EDGE, SHORT[1])
    return scene.finger.tip_radius * max(long / fineness * min(1.0, _half(scene) / short), FINEST)


def _of_light(scene: Scene, width: float) -> tuple[float, float]:
    """Return what the SED, relative, and the contact `width` [mm] may be off by for a contact shorter than elements.

    The smallest element does not get smaller with the contact. Both vanish where it is much shorter: at 0.01 mm of
    indentation the first is 4e-5.
    """
    smallest = FINEST * scene.finger.tip_radius
    shorter = 2.0 * smallest / max(width, smallest / 2.0)
    return FROM_LIGHT * shorter**2, FROM_SHORT * smallest * min(1.0, shorter**2)


def _of_bound(scene: Scene, fineness: float, normal: float, drag: float) -> float:
    """Return what the drag may be off, relative, for not knowing how much of its last element touches."""
    bound, most = scene.friction.tau_max, scene.friction.mu * normal
    if bound is None or drag == 0.0 or drag >= most:
        return 0.0
    part = FROM_BOUND[scene.solve.kinematics] * (1.0 - drag / most)
    return part * bound * _element(scene, fineness) / drag
