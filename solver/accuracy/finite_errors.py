"""How far the numbers of a scene at finite strain may be off: what another mesh and fewer load steps make of them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.accuracy import finite_ends
from solver.accuracy.adaptivity import MeshSolution, NestedSolution, solution_on
from solver.accuracy.error_estimate import FROM_MESHES, Errors, errors
from solver.arrays import Array
from solver.body.finite_measures import deformation
from solver.body.tissues import stiff, strains_the_cut
from solver.continuation.finite_states import depends_on_way
from solver.equilibrium.step_error import Steps
from solver.failures import NoSteadyState, NotConverged, SolveFailure
from solver.scene import Scene

COARSER = 0.6  # fineness of the mesh that the error is estimated from, by that of the answer
NUDGE = 1e-3  # of the traction bound, to see what it does
SQUEEZED = 0.82  # least det F, below which tissue is squeezed where the cut meets the bone
OF_CORNER = np.array([3.4, 1.9, 1.9, 1.9, 1.9, 1.9])  # part of an estimate then, by the difference in force or depth
OF_STIFF = 6.0  # the same of the SED where skin is stiff, and does not only stiffen
OF_SQUEEZED = 2.6  # under other skin, of the element there squared and what det F has fallen by cubed


def error_estimates(
    scene: Scene, fineness: float, way_up: NestedSolution, numbers: Array, stop: Callable[[], bool]
) -> tuple[Errors, Array, float]:
    """Return how far the `numbers` (6,) (`finger.all_numbers`) of a scene may be off that was solved by `way_up`.

    The same scene is solved on a coarser mesh with lines at the same edges of contact. Beside the errors: its numbers
    there (1, 6), or none where it has no state; and what of the SED's error meshes of all finenesses have in common.
    """
    found = compared(scene, fineness, way_up, numbers, stop)
    return errors(scene, fineness, *found), found[1][:1], _squeezed(scene, way_up.top)


def compared(
    scene: Scene, fineness: float, way_up: NestedSolution, numbers: Array, stop: Callable[[], bool]
) -> tuple[Array, Array, Array, Steps | None]:
    """Return what errors are estimated from: numbers (6,), those of other meshes (n, 6), what is felt (6,), and steps.

    There are no others where one has no state.
    """
    at, steps = way_up.top, way_up.steps
    on_way = depends_on_way(scene, at.shape)
    try:
        if steps is None and on_way:  # since it slid on the rough mesh
            judged = finite_ends.steps_asked(scene, at.finger, at.shape, stop)
            steps = None if judged is None else replace(judged, times=1)
        coarse = _nearest(scene, COARSER * fineness, at, stop)
        if steps is not None and on_way:
            shape = finite_ends.end(coarse.finger, scene, stop) if finite_ends.relaxes(scene) else coarse.shape
            others = steps.taken(coarse.finger.all_numbers(shape))[None]
            felt = finite_ends.sensitivity_to_bound(scene, way_up.coarse.finger, way_up.coarse.shape, stop)
            return numbers, others, felt, steps
    except SolveFailure:
        return numbers, np.empty((0, 6)), np.zeros(6), steps
    both = (coarse, way_up.first)
    others = np.array([other.finger.all_numbers(other.shape) for other in both if other is not None])
    felt = np.zeros(6) if way_up.first is None else sensitivity_to_bound(coarse)
    corner = _of_corner(scene, at, numbers, others[0]) / FROM_MESHES["finite"]
    return numbers, np.vstack([others, numbers * (1.0 + corner)]), felt, None


def _of_corner(scene: Scene, at: MeshSolution, numbers: Array, other: Array) -> Array:
    """Return the parts (6,) of estimates, relative, for what meshes have in common where the cut meets the bone.

    They are told by how far tissue is squeezed there, and under stiff skin by what the `other` mesh makes of the force.
    """
    if _crowded(scene, at):
        change = np.abs(other / np.where(numbers == 0.0, 1.0, numbers) - 1.0)[[1, 3]].max()
        part = OF_CORNER.copy()
        part[0] = OF_STIFF if stiff(scene.materials) else part[0]
        return part * change
    return np.full(6, _squeezed(scene, at))


def _squeezed(scene: Scene, at: MeshSolution) -> float:
    """Return the same for skin that is not stiff, in all numbers: told by the first element and its least det F."""
    if scene.finger.cut == "driven" or at.at_cut is None:
        return 0.0
    arcs = at.finger.geometry.arcs
    element = float(arcs[1] - arcs[0]) / scene.finger.tip_radius
    return OF_SQUEEZED * element**2 * max(1.0 - at.finger.least_at_cut(at.shape), 0.0) ** 3


def _volumes(at: MeshSolution) -> Array:
    """Return det F (e, 9) at the quadrature points."""
    return np.linalg.det(deformation(at.finger.newton.body, at.shape.u))


def _crowded(scene: Scene, at: MeshSolution) -> bool:
    """Return whether stiff or stiffening skin squeezes the tissue where the cut meets the bone.

    Strains are without bound in that corner, so that errors fall with the element and not with its square; in the SED
    two meshes may then agree by chance, in the normal force they do not.
    """
    if not strains_the_cut(scene.materials):
        return False
    return float(_volumes(at).min()) < SQUEEZED


def _nearest(scene: Scene, fineness: float, at: MeshSolution, stop: Callable[[], bool]) -> MeshSolution:
    """Return the settled state on a coarser mesh, whose friction limit may lie just below the drag asked for."""
    try:
        return solution_on(scene, fineness, at, stop)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return solution_on(scene.undragged(), fineness, at, stop)


def sensitivity_to_bound(at: MeshSolution) -> Array:
    """Return how the numbers (6,) of a settled slide answer to the traction bound: relative change by its own.

    Zero where no state lies beside this one.
    """
    newton, shape = at.finger.newton, at.shape
    if shape.pull.sense == 0:  # it does not slide as a whole, and depends on its way
        return np.zeros(6)
    try:
        beside = newton.settle(shape, shape.pull._replace(tau=(1.0 + NUDGE) * shape.pull.tau))
    except NotConverged:
        return np.zeros(6)
    before = at.finger.all_numbers(shape)
    return (at.finger.all_numbers(beside) - before) / np.where(before == 0.0, 1.0, before) / NUDGE
