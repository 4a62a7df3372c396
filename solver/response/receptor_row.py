"""Every quantity along a row of receptors of a prediction, at any depth: those of the ending are in it already."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from solver.arrays import Array
from solver.body.receptor import LinearPatches, Patches, endings
from solver.body.stiffness import Elastic
from solver.equilibrium.finger import finite_laws, settled_moduli
from solver.prediction import ROW, Prediction
from solver.scene.scene import Receptor


def responses_along(predictions: Sequence[Prediction], arcs: Array = ROW, receptor: Receptor | None = None) -> Array:
    """Return every quantity of `solver.quantities` (n, q, r) at arc positions (r,) [mm] of n predictions.

    Each is averaged over an ending like that of `receptor`, or else of the scene: SA-I and RA endings lie less deep
    than an SA-II. nan where the finger ends before the ending does. Unlike those in `Prediction.responses`, and the SED
    in `Prediction.row`, these have no error estimate.
    """
    out: list[Array] = []
    for _, same in groupby(predictions, lambda found: (id(found.geometry), found.scene.solve.kinematics)):
        group = list(same)
        along = _probed(group[0], arcs, receptor or group[0].scene.receptor)
        out += [along.responses(found.displacement) for found in group]
    return np.array(out)


def _probed(found: Prediction, arcs: Array, receptor: Receptor) -> Patches:
    """Return endings like that of `receptor` on the mesh of a prediction."""
    mesh, materials = found.geometry.mesh, found.scene.materials
    elastic = Elastic.of(mesh, settled_moduli(materials))
    row = endings(found.geometry, elastic, receptor, arcs)
    if found.scene.solve.kinematics == "small":
        return LinearPatches(mesh, elastic, row)
    # Imported here: small strain need not wait for the compiled loops of finite strain to be loaded.
    from solver.body.finite import FiniteBody, FinitePatches

    return FinitePatches.of(FiniteBody.of(mesh, finite_laws(materials), checked=True), row)
