"""A body at small strain reduced to its skin: assembled and eliminated by the compiled loops."""

from collections.abc import Callable, Sequence
from copy import copy
from functools import lru_cache
from threading import Lock
from typing import Self

import numpy as np
from numpy.linalg import LinAlgError

from solver import _kernels as kernels
from solver._kernels import hooke
from solver._kernels.arguments import RecoveryArrays
from solver.arrays import Array, Indices
from solver.body.stiffness import Isotropic, condensed_elements
from solver.linalg.multifrontal import factors_of, symbolic_factorization
from solver.mesh import Mesh

_ALONE = Lock()  # held while the memory of `_memory` is in use


class LinearElimination:
    """A body at small strain reduced to the displacements of its skin, normal ones first: m of them."""

    def __init__(self, mesh: Mesh, materials: Sequence[Isotropic]) -> None:
        """Assemble `mesh` of `materials` by region, and eliminate all but its skin.

        Raises LinAlgError where an element is folded, or the inner stiffness is not positive definite.
        """
        plan = symbolic_factorization(mesh)
        count, width = len(mesh.elements), int(plan.border[-1])
        values, skin = np.empty(plan.factors), np.empty((width, width))
        with _ALONE:
            memory = _memory(256 * count + plan.waiting)
            outer, waiting = memory[: 256 * count].reshape(count, 16, 16), memory[256 * count :]
            self.elastic, self._recovery_matrix = condensed_elements(mesh, materials, outer)
            regular = kernels.eliminate(outer, plan, values, waiting, skin)
        self._factors = factors_of(plan, values)
        if not regular or not hooke.definite(self._factors):
            raise LinAlgError("the stiffness inside the body is not positive definite")
        self._mesh, self._plan = mesh, plan
        nodes = np.arange(width // 2)
        self._kept = np.concatenate([2 * nodes + 1, 2 * nodes])  # where in the plan's skin they stand
        self.stiffness = skin[np.ix_(self._kept, self._kept)]  # (m, m)
        self.load = np.zeros((width, 0))  # (m, l) dead loads as the skin feels them
        self._still = self._loaded = np.zeros(plan.size), np.zeros((count, 2))

    def loaded(self, loads: Array) -> Self:
        """Return the same body under dead `loads` (size,) on its unknowns."""
        other = copy(self)
        other._loaded = self._condensed(loads)  # noqa: SLF001 - of its own kind
        other.load = self._felt(other._loaded[0])[:, None]  # noqa: SLF001
        return other

    def all_unknowns(self, kept: Array, loaded: bool = False, only: Indices | None = None) -> Array:
        """Return all unknowns (size, c) for the kept ones (m, c): fixed ones 0; with the dead loads where `loaded`.

        With `only` (unknowns), others may be left at 0.
        """
        return self._unfolded(kept, self._loaded if loaded else self._still, only)

    def condensed(self, load: Array) -> tuple[Array, Callable[[Array], Array]]:
        """Return what the skin feels (m,) of a `load` (size,), and what makes all unknowns (size,) of the skin's (m,).

        Those are then under that load.
        """
        under = self._condensed(load)
        return self._felt(under[0]), lambda kept: self._unfolded(kept[:, None], under, None)[:, 0]

    def _condensed(self, load: Array) -> tuple[Array, Array]:
        """Return a load (size,) condensed on the unknowns (n,), and the moves (e, 2) of the centres under it alone."""
        mesh, plan, nodal = self._mesh, self._plan, load.reshape(-1, 2)
        centre = nodal[mesh.elements[:, 8], :, None]
        own: Array = np.asarray(np.linalg.solve(self.elastic.stiffness[:, 16:, 16:], centre)[:, :, 0], np.float64)
        passed = (np.swapaxes(self._recovery_matrix, 1, 2) @ centre)[:, :, 0]  # (e, 16)
        free = plan.unknown >= 0
        force = np.zeros(plan.size)
        force[plan.unknown[free]] = -nodal[mesh.elements[:, :8]].reshape(-1, 16)[free]
        np.add.at(force, plan.unknown[free], passed[free])
        kernels.condense(force, self._factors)
        return force, own

    def _felt(self, carried: Array) -> Array:
        """Return what the skin feels (m,) of a condensed load."""
        return -carried[self._plan.size - len(self._kept) :][self._kept]

    def _unfolded(self, kept: Array, under: tuple[Array, Array], only: Indices | None) -> Array:
        mesh, plan = self._mesh, self._plan
        asked = np.full(len(mesh.nodes), only is None)
        if only is not None:
            asked[only // 2] = True
        skin = np.empty((kept.shape[1], len(kept)))
        skin[:, self._kept] = kept.T
        out = np.zeros((*mesh.nodes.shape, kept.shape[1]))
        recovery = RecoveryArrays(mesh.elements, self._recovery_matrix)
        hooke.displace(skin, *under, asked, plan, self._factors, recovery, out)
        return out.reshape(-1, kept.shape[1])


@lru_cache(maxsize=1)
def _memory(size: int) -> Array:
    """Return memory for what is forgotten at once, always the same: to be given new takes as long as the work."""
    return np.empty(size)
