"""Small-strain stiffness of all elements at once, with the pressure condensed, and what follows from displacements."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from solver._kernels import hooke
from solver.arrays import Array, Indices, LinearElements, LinearMesh, ShapeFunctions
from solver.constitutive import PLAIN, Elasticity
from solver.mesh import Q2P1, Mesh
from solver.quantities import SED, LocalState

_VALUES, _GRADIENTS = Q2P1.shape(Q2P1.points)  # (9 points, 9 nodes), (9, 9, 2)
_SHAPES = ShapeFunctions(
    _VALUES, np.ascontiguousarray(_GRADIENTS[..., 0]), np.ascontiguousarray(_GRADIENTS[..., 1]), Q2P1.weights
)


class Centred(Protocol):
    """Elements with the places that their pressure modes are counted from."""

    @property
    def centre(self) -> Array:
        """Where they are, (e, 2) [mm]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Elastic:
    """Elements made of Hooke materials: e of them, displacements ordered x, y, x, y, ... within each."""

    stiffness: Array  # (e, 18, 18) [N/mm per mm]
    dilatation: Array  # (e, 3, 18): displacements to the volume strain's modes 1, x - xc, y - yc
    centre: Array  # (e, 2) xc, yc of the modes [mm]
    shear: Array  # (e,) [MPa]
    lame: Array  # (e,) [MPa]

    @staticmethod
    def of(mesh: Mesh, materials: Sequence[Elasticity]) -> "Elastic":
        """Integrate the stiffness of every element with 3 x 3 Gauss points; `materials` by region.

        K = integral of 2 G eps:eps + lambda theta^2, where theta is the best fit of the volume strain by 1, x, y. That
        is the mixed form with pressure lambda theta, its three pressure modes eliminated (exact for Hooke). Raises
        LinAlgError where an element is folded.
        """
        return condensed_elements(mesh, materials, np.empty((len(mesh.elements), 16, 16)))[0]


def condensed_elements(mesh: Mesh, materials: Sequence[Elasticity], outer: Array) -> tuple[Elastic, Array]:
    """Return the elements of `mesh`, and the matrices (e, 2, 16) that recover their centre nodes.

    Filled: `outer` (e, 16, 16), lower half, their stiffness when the centre nodes are eliminated. Raises LinAlgError
    where an element is folded.
    """
    count = len(mesh.elements)
    shear = np.array([m.shear for m in materials])[mesh.region]
    lame = np.array([m.lame for m in materials])[mesh.region]
    filled = LinearElements(
        np.empty((count, 18, 18)), np.empty((count, 3, 18)), np.empty((count, 2)), np.empty((count, 2, 16))
    )
    if not hooke.stiffen(LinearMesh(mesh.nodes, mesh.elements, shear, lame), _SHAPES, filled, outer):
        raise LinAlgError("an element is folded")
    stiffness, dilatation, centre, recovery_matrix = filled
    return Elastic(stiffness, dilatation, centre, shear, lame), recovery_matrix


@dataclass(frozen=True, slots=True, eq=False)
class Probes:
    """Places inside elements where the strain energy is wanted; p of them."""

    element: Indices  # (p,)
    gradient: Array  # (p, 9, 2) of the shape functions there [1/mm]
    modes: Array  # (p, 3) volume-strain modes there

    @staticmethod
    def at(mesh: Mesh, elements: Centred, element: Indices, local: Array) -> "Probes":
        """Place probes at `local` (p, 2) coordinates of `element` (p,)."""
        values, slopes = Q2P1.shape(local)
        corners = mesh.nodes[mesh.elements[element]]
        jacobian = np.swapaxes(corners, 1, 2) @ slopes
        place = (values[:, None] @ corners)[:, 0] - elements.centre[element]
        modes = np.concatenate([np.ones((len(element), 1)), place], axis=1)
        return Probes(element, slopes @ inverse(jacobian), modes)

    def displacement_gradient(self, mesh: Mesh, displacement: Array) -> Array:
        """Return du_a/dx_b (p, 2, 2, ...) for displacements (nodes, 2, ...)."""
        moved = displacement[mesh.elements[self.element]]  # (p, 9, 2, ...)
        moved = moved - moved[:, 8:]  # what moves an element as a whole would drown small strains in round-off
        slopes = np.swapaxes(self.gradient, 1, 2) @ moved.reshape(len(moved), 9, -1)
        return np.swapaxes(slopes.reshape(len(moved), 2, *moved.shape[2:]), 1, 2)

    def state(self, mesh: Mesh, elastic: Elastic, displacement: Array, tangent: Array | None = None) -> LocalState:
        """Return what is known of the places for displacements (nodes, 2, ...): arrays (p, ...).

        `tangent` (p, 2) are the skin's directions there; the x axis where none are given.
        """
        gradient = self.displacement_gradient(mesh, displacement)
        held, place = np.unique(self.element, return_inverse=True)
        local = displacement[mesh.elements[held]]
        local = (local - local[:, 8:]).reshape(len(local), 18, -1)
        volume = (self.modes[:, None] @ (elastic.dilatation[held] @ local)[place])[:, 0]
        wide = (slice(None), *([None] * (displacement.ndim - 2)))
        half = (gradient[:, 0, 1] + gradient[:, 1, 0]) / 2.0
        along = np.array([[1.0, 0.0]]) if tangent is None else tangent
        return LocalState(
            xx=gradient[:, 0, 0],
            xy=half,
            yx=half,
            yy=gradient[:, 1, 1],
            dilatation=volume.reshape(half.shape),
            shear=elastic.shear[self.element][wide],
            lame=elastic.lame[self.element][wide],
            stiffening=np.array(PLAIN),
            tangent=(along[:, 0][wide], along[:, 1][wide]),
        )

    def energy(self, mesh: Mesh, elastic: Elastic, displacement: Array) -> Array:
        """Return the SED (p, ...) [MPa] for displacements (nodes, 2, ...)."""
        return SED.small(self.state(mesh, elastic, displacement))


def inverse(matrices: Array) -> Array:
    """Return the inverses of matrices (..., 2, 2), in closed form."""
    (a, b), (c, d) = np.moveaxis(matrices, (-2, -1), (0, 1))
    return np.moveaxis(np.array([[d, -b], [-c, a]]) / (a * d - b * c), (0, 1), (-2, -1))


def local_coordinates(corners: Array, points: Array, start: Array) -> Array:
    """Return the local coordinates (p, 2) of `points` (p, 2) in elements with nodes `corners` (p, 9, 2), by Newton."""
    local: NDArray[np.float64] = start.copy()
    for _ in range(8):
        values, slopes = Q2P1.shape(local)
        missing = points - (values[:, None] @ corners)[:, 0]
        step = np.einsum("pab,pb->pa", inverse(np.swapaxes(corners, 1, 2) @ slopes), missing)
        local += step
        if np.abs(step).max(initial=0.0) < 1e-7:  # what is left is the square of this step
            break
    return local
