"""The order of convergence of errors with the element size, and the scenes that have none.

Errors of quadratic elements beneath a contact fall at least with the square of the element size. So the error of a mesh
is at most `RICHARDSON` times the change by halving its elements (Roache 1994, J. Fluids Eng. 116, 405). At a straight
or convex corner of held and free tissue, displacements follow r^a with a >= 1/2 (Williams 1952, J. Appl. Mech. 19,
526), and errors of the energy follow the power 2 a. Its part of the error is at most `RICHARDSON_AT_CORNER` times its
part of the change. Such a corner lies where bone meets the free cut.

At finite strain that corner is squeezed further on each finer mesh. A free face folds where it is squeezed along itself
below a critical stretch (Biot 1963, Appl. Sci. Res. A 12, 168). Where only one element falls below it, the mesh does
not resolve a fold. Where more do, the cut folds. Such folds have no intrinsic size:
finer meshes fold differently, and no error is known. The same is true where a stiff layer wrinkles on a soft one (Allen
1969, Analysis and Design of Structural Sandwich Panels, chapter 8): its equilibrium without wrinkles is unstable.
"""

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from solver.arrays import Array
from solver.continuation import critical_stretch
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import Finger, FiniteFinger, finite_laws, settled_moduli
from solver.failures import WRINKLES, Folds, cut_folds
from solver.prediction import percent
from solver.scene import Scene
from solver.scene.tables import TISSUES, Materials

RICHARDSON, RICHARDSON_AT_CORNER = 4.0 / 3.0, 2.0  # 1 + 1/4 + 1/16 + ... and 1 + 1/2 + 1/4 + ...
TRIAL_RATIO = 100.0  # largest ratio of stiffnesses of neighbouring tissues in the trials where estimates hold [-]


def local_excess(parts: Array, corners: Array) -> Array:
    """Return how much larger the errors (g,) of results may be than their changes, from signed `parts` (n, g) of these.

    Each part of the error lies between that of the change and `RICHARDSON` times it. Those of `corners` (g,), in all,
    are up to `RICHARDSON_AT_CORNER` times. So parts that cancel in the change may not cancel in the error.

    >>> local_excess(np.array([[3.0], [-1.0]]), np.zeros(1)).round(9)  # a change of 2, an error of 4/3 x 3 - 1
    array([1.])
    """
    positive, negative = np.maximum(parts, 0.0).sum(axis=0), np.maximum(-parts, 0.0).sum(axis=0)
    return (RICHARDSON - 1.0) * np.maximum(positive, negative) + (RICHARDSON_AT_CORNER - RICHARDSON) * corners


def parts_may_cancel(scene: Scene) -> bool:
    """Return whether parts of a mesh cancel in the changes of results in trials of such scenes.

    At finite strain the corner of the cut is squeezed further on each finer mesh. At small strain very stiff tissue
    carries the drag to it.
    """
    return scene.solve.kinematics == "finite" or _stiffness_ratio(scene.materials)[0] > TRIAL_RATIO


def refuse_folds(finger: Finger[Any], state: EquilibriumState) -> None:
    """Raise Folds where errors do not converge, since the free cut folds or tissue wrinkles in a `state`."""
    if not isinstance(finger, FiniteFinger):
        return
    if finger.scene.finger.cut == "free":
        _refuse_folded_cut(finger, state)
    if not finger.newton.is_stable(state):
        raise Folds(WRINKLES)


def _refuse_folded_cut(finger: FiniteFinger, state: EquilibriumState) -> None:
    """Raise Folds where more than one element at an end of a nested mesh's cut is squeezed as faces are that fold."""
    mesh = finger.body.mesh
    columns = np.arange(len(mesh.elements)).reshape(len(finger.geometry.arcs) - 1, -1)
    outer = columns[[0, 1, -2, -1]].ravel()  # in the outer columns of the mesh that this one divides
    F = finger.body.deformation(state.u).reshape(len(mesh.elements), -1, 2, 2)[outer]
    least = np.linalg.svd(F, compute_uv=False)[..., -1].min(axis=1)
    laws = finite_laws(finger.scene.materials)
    folds = np.array([critical_stretch(laws[region]) for region in mesh.region[outer]])
    if (least < folds).reshape(2, -1).sum(axis=1).max() > 1:
        worst = int((least - folds).argmin())
        raise cut_folds(float(least[worst]), float(folds[worst]))


_ROUND_OFF = 1e-12  # relative, of a stiffness
TRIAL_DEPTH = 0.5  # deepest presses at finite strain in those trials, relative to the tissue's thickness [-]


def trial_warnings(scene: Scene, depth: float) -> Iterator[str]:
    """Yield a warning for each way in which a scene, pressed to a `depth` [mm], exceeds the trials of the estimates.

    Tissues are relaxed, as in the answer.
    """
    ratio, stiff, soft = _stiffness_ratio(scene.materials)
    if ratio > TRIAL_RATIO:
        yield (
            f"The {stiff} is {float(f'{ratio:.2g}'):,.0f} times as stiff as the {soft}. Error estimates hold in trials "
            f"up to {TRIAL_RATIO:.0f} times; beyond, there are few trials."
        )
    part = depth / scene.finger.pulp_thickness()
    if scene.solve.kinematics == "finite" and part > TRIAL_DEPTH:
        yield (
            f"The finger is pressed by {percent(part)} of its tissue. Error estimates hold in trials up to "
            f"{percent(TRIAL_DEPTH)}; beyond, there are few trials."
        )


@lru_cache(maxsize=32)
def _stiffness_ratio(materials: Materials) -> tuple[float, str, str]:
    """Return the largest stiffness ratio of neighbouring tissues, less round-off, and the stiffer and softer one."""
    stiffness = {name: moduli.engineering[0] for name, moduli in zip(TISSUES, settled_moduli(materials), strict=True)}
    pairs = [pair for outer, inner in pairwise(TISSUES[:-1]) for pair in ((outer, inner), (inner, outer))]
    ratio, stiff, soft = max((stiffness[a] / stiffness[b], a, b) for a, b in pairs)
    return ratio * (1.0 - _ROUND_OFF), stiff, soft
