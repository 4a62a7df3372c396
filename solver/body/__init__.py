"""A body: what is asked of it as a whole, as Newton sees it, condensed to its skin, and of places inside it."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar, NamedTuple, Protocol, Self

import numpy as np
from numpy.linalg import LinAlgError

from solver._kernels import elements as element_loops
from solver._kernels.compiling import HELD_X, HELD_Y
from solver.arrays import Array, ElementArrays, ElementGeometry, Indices, Narrow, ShapeFunctions, inverse
from solver.constitutive import PLAIN, Elasticity, LocalState
from solver.mesh import Q2P1, Mesh, distinct

UNHELD = 1e14  # stiffness by its inverse, largest numbers, from which a body is taken to move freely [-]


class CondensedBody(Protocol):
    """A body whose stiffness and forces about the last state asked for are those of its skin alone."""

    constant: bool  # whether the stiffness is that of every state, so that one linear solve is exact
    bulk: float  # how much stiffer the body is to a change of volume than to shear, at most [-]
    held: Narrow  # (k,) whether a node of the skin is held: along x HELD_X, along y HELD_Y, both their sum
    middle: Narrow  # (k,) 1 at the middle of an edge whose length follows the deformed skin, else 0
    fixed_length: Array  # (k,) skin that each node stands for whatever the state [mm]
    stiffness: Array  # (2 k, 2 k) x, y of one node, x, y of the next [N/mm per mm]
    equilibrium: Array | None  # displacements of the equilibrium that the tangent led to, where it may serve once more
    load: Array  # (2 k,) of the skin, or of all that moves: dead loads [N/mm]
    force: Array  # (2 k,) of the skin on the surface, were there no surface [N/mm]

    @property
    def compliance(self) -> Array:
        """The inverse of the stiffness, bordered by `motions` (2 k + m, 2 k + m) [mm per N/mm]; (0, 0) if not known."""
        ...

    @property
    def motions(self) -> Array:
        """Motions (2 k, m) of the body as a whole that the surface alone balances."""
        ...

    def undeformed(self) -> tuple[Array, Array]:
        """Return displacements and pressures of the body at rest."""
        ...

    def place(self, u: Array) -> Array:
        """Return where the skin's nodes are (k, 2) for displacements `u` [mm]."""
        ...

    def linearise(self, u: Array, pressure: Array) -> bool:
        """Set `stiffness` and `force` at a state; False where the body has none there."""
        ...

    def relinearise(self, u: Array) -> bool:
        """Set the `force` at a state and leave the stiffness as it is; False where the body has none there."""
        ...

    def recover(self, u: Array, pressure: Array, step: Array, scale: float) -> tuple[Array, Array, float]:
        """Return a state after `scale` times the skin's `step` (2 k,), and the largest move of the full step [mm]."""
        ...

    def stored_energy(self, u: Array, reaction: Array) -> float:
        """Return the energy stored at displacements `u` that forces `reaction` (k, 2) hold [N mm per mm]."""
        ...

    def work(self, way: Sequence[Array], trapezoid: float) -> float:
        """Return the work of the skin's forces along displacements, by the `trapezoid` rule so much [N mm per mm]."""
        ...


class Body(Protocol):
    """A body of n nodes; displacements are relative to the bone or to whatever drives it [mm]."""

    @property
    def mesh(self) -> Mesh:
        """Its mesh."""
        ...

    @property
    def condensed(self) -> CondensedBody:
        """What Newton sees of it."""
        ...

    @property
    def dofs(self) -> int:
        """Number of unknown displacements."""
        ...

    @property
    def centre(self) -> Array:
        """Where the pressure modes of its elements are counted from (e, 2) [mm]."""
        ...

    def displacement(self, u: Array, only: Indices | None = None) -> Array:
        """Return the displacements (n, 2, ...) of all nodes for those of one state or of several.

        With `only` (node numbers), other nodes may be left at 0.
        """
        ...

    def following(self, skin: Array) -> Array:
        """Return the small displacements (n, 2, c) that go with those of the skin (2 k, c)."""
        ...

    def forces(self, displacement: Array) -> Array:
        """Return the forces (n, 2) that hold all nodes at `displacement` (n, 2) [N/mm]."""
        ...

    def energy_growth(self, displacement: Array) -> float:
        """Return by how much the stored energy grows as `displacement` (n, 2) grows by a part of itself [N]."""
        ...

    def smallest_det(self, displacement: Array) -> float:
        """Return the least det F [-] at `displacement` (n, 2); not positive where tissue is inside out."""
        ...


class CondensedLinear:
    """A body at small strain, whose states are those of its skin: u (k, 2) [mm] are the displacements of that alone."""

    def __init__(self, rest: Array, stiffness: Array, load: Array, length: Array, held: Narrow) -> None:
        """Take skin at `rest` (k, 2) [mm] with `length` (k,) [mm] and `held` (k,) as in CondensedBody.

        `stiffness` (2 k, 2 k) and dead `load` (2 k,) have x, y of each node in turn.
        """
        self.constant, self.bulk = True, 0.0
        self.rest, self.stiffness, self.load = rest, stiffness, load
        self.fixed_length, self.held, self.middle = length, held, np.zeros(len(rest), np.int32)
        self.motions = np.zeros((2 * len(rest), 0))  # of the body as a whole that the surface alone balances
        self.springs = self.motions  # all that nothing holds, orthonormal
        self.force = -load
        self.equilibrium: Array | None = None
        self._compliance: Array | None = None

    @property
    def compliance(self) -> Array:
        """Do as `CondensedBody` says, 0 for what is held. Raises LinAlgError where there is no inverse."""
        if self._compliance is None:
            self._compliance = self._inverse()
        return self._compliance

    def _inverse(self) -> Array:
        free, count = np.flatnonzero(self.stiffness.diagonal() > 0.0), self.motions.shape[1]
        # Rigid motions cost no energy: a spring on each makes the matrix invertible, and stays unloaded, since the
        # surface's forces balance the loads along every motion.
        spring = self.stiffness.trace() / max(len(free), 1)
        inside = (self.stiffness + spring * self.springs @ self.springs.T)[np.ix_(free, free)]
        inverse = np.asarray(np.linalg.inv(inside), np.float64)
        if not np.abs(inside).max(initial=0.0) * np.abs(inverse).max(initial=0.0) < UNHELD:
            raise LinAlgError("the body is neither held nor balanced")
        size = len(self.stiffness)
        out = np.zeros((size + count, size + count))
        out[:size, size:], out[size:, :size] = self.motions, self.motions.T
        out[np.ix_(free, free)] = (inverse + inverse.T) / 2.0
        return out

    def _follow(self, forces: Array) -> Array:
        """Return the displacements (k, 2) that `forces` (2 k,) on the skin hold."""
        size = len(forces)
        return (self.compliance[:size, :size] @ forces).reshape(-1, 2)

    def with_load(self, load: Array) -> "CondensedLinear":
        """Return the same body under another dead `load` (2 k,) [N/mm]."""
        other = copy(self)
        other.load, other.force, other._compliance = load, -load, self.compliance  # noqa: SLF001 - of its own kind
        return other

    def undeformed(self) -> tuple[Array, Array]:
        """Return displacements (k, 2) of the skin at rest, and no pressures."""
        return np.zeros(self.rest.shape), np.zeros((0, 3))

    def free_displacement(self) -> Array:
        """Return the displacements (k, 2) under the dead loads alone, motions left out that nothing holds."""
        return self._follow(self.load)

    def displacement_under(self, reaction: Array) -> Array:
        """Return the displacements (k, 2) that forces `reaction` (k, 2) of the surface hold."""
        return self._follow(self.load + reaction.ravel())

    def stored_energy(self, u: Array, reaction: Array) -> float:  # noqa: ARG002 - tissues that relax may be elsewhere
        """Return the energy stored once forces `reaction` (k, 2) alone hold the body [N mm per mm]."""
        return 0.5 * float(np.sum(reaction * self.displacement_under(reaction)))

    def work(self, way: Sequence[Array], trapezoid: float) -> float:  # noqa: ARG002 - as every body is asked
        """Do as `CondensedBody` says: forces grow in proportion, so that the rule is exact."""
        return trapezoid

    def place(self, u: Array) -> Array:
        """Return where the skin's nodes are (k, 2) for displacements `u` (k, 2) [mm]."""
        return self.rest + u

    def linearise(self, u: Array, pressure: Array) -> bool:  # noqa: ARG002 - as every body is asked
        """Set the `force` at a state."""
        return self.relinearise(u)

    def relinearise(self, u: Array) -> bool:
        """Do the same: the stiffness is that of every state."""
        self.force = self.stiffness @ u.ravel() - self.load if u.any() else -self.load
        return True

    def recover(self, u: Array, pressure: Array, step: Array, scale: float) -> tuple[Array, Array, float]:
        """Return a state after `scale` times the skin's `step` (2 k,), and the largest move of the full step [mm]."""
        return u + scale * step.reshape(u.shape), pressure, float(np.abs(step).max(initial=0.0))


@dataclass(frozen=True, slots=True, eq=False)
class Probes:
    """Places inside elements where the strain energy is wanted; p of them."""

    element: Indices  # (p,)
    gradient: Array  # (p, 9, 2) of the shape functions there [1/mm]
    modes: Array  # (p, 3) volume-strain modes there

    @staticmethod
    def at(mesh: Mesh, centre: Array, element: Indices, local: Array) -> "Probes":
        """Place probes at `local` (p, 2) coordinates of `element` (p,), whose modes are about `centre` (e, 2)."""
        values, slopes = Q2P1.shape(local)
        corners = mesh.nodes[mesh.elements[element]]
        jacobian = np.swapaxes(corners, 1, 2) @ slopes
        place = (values[:, None] @ corners)[:, 0] - centre[element]
        modes = np.concatenate([np.ones((len(element), 1)), place], axis=1)
        return Probes(element, slopes @ inverse(jacobian), modes)

    def displacement_gradient(self, mesh: Mesh, displacement: Array) -> Array:
        """Return du_a/dx_b (p, 2, 2, ...) for displacements (nodes, 2, ...)."""
        moved = displacement[mesh.elements[self.element]]  # (p, 9, 2, ...)
        moved = moved - moved[:, 8:]  # what moves an element as a whole would drown small strains in round-off
        slopes = np.swapaxes(self.gradient, 1, 2) @ moved.reshape(len(moved), 9, -1)
        return np.swapaxes(slopes.reshape(len(moved), 2, *moved.shape[2:]), 1, 2)


@dataclass(frozen=True, slots=True, eq=False)
class Endings:
    """Probes of several patches: r of them, p probes in all."""

    probes: Probes
    weights: Array  # (p,) areas [mm2]
    patch: Indices  # (p,) number of the patch each probe belongs to
    count: int
    tangent: Array  # (p, 2) direction of the undeformed skin above each probe, towards the tip

    @property
    def areas(self) -> Array:
        """Area of each patch (r,) [mm2]; nan where there is no patch."""
        area = np.bincount(self.patch, self.weights, self.count)
        return np.where(area > 0.0, area, np.nan)

    def means(self, values: Array) -> Array:
        """Return values (p, ...) averaged over each patch (r, ...); nan where there is no patch."""
        wide = (slice(None), *([None] * (values.ndim - 1)))
        total = np.zeros((self.count, *values.shape[1:]), values.dtype)
        np.add.at(total, self.patch, values * self.weights[wide])
        return total / self.areas[wide]


VALUES, _SLOPES = Q2P1.shape(Q2P1.points)  # (9 points, 9 nodes), (9, 9, 2)
_SHAPES = ShapeFunctions(
    VALUES, np.ascontiguousarray(_SLOPES[..., 0]), np.ascontiguousarray(_SLOPES[..., 1]), Q2P1.weights
)


class Places(NamedTuple):
    """Probes, and what they need of their elements."""

    probes: "Probes"
    held: Indices  # (m,) elements that hold probes
    number: Indices  # (p,) which of those holds each
    gradients: Array  # (2, m, q, 9) of their shape functions
    modes: Array  # (p, 3) the elements' own modes there
    constants: Array  # (5, p) shear modulus, Lamé's first constant, stiffening, and the skin's direction x, y


@dataclass(frozen=True, eq=False)
class MeshElements:
    """The elements of a mesh, integrated: e of them, q = 9 quadrature points each.

    What is driven is fixed; centre nodes meet no other element and are eliminated inside their own.
    """

    mesh: Mesh
    elements: ElementArrays  # as loops take them; modes are orthonormal over the element
    centre: Array  # (e, 2) the modes are combinations of 1, x - centre, y - centre [mm]
    combination: Array  # (e, 3, 3) mode m = sum over l of combination[m, l] (1, x - centre, y - centre)[l]

    @classmethod
    def of(cls, mesh: Mesh, materials: Sequence[Elasticity]) -> Self:
        """Integrate the elements of `mesh`, of `materials` by region. Raises LinAlgError where one is folded."""
        return cls(*integrate_elements(mesh, materials, np.full((len(mesh.elements), 16), -1, np.int32)))

    def volume_modes(self, volume: Array, element: Indices | slice = slice(None)) -> Array:
        """Return the modes (e, 3, ...) that fit a measure of `volume` (e, q, ...) best."""
        return np.einsum("eq,eqm,eq...->em...", self.elements.weight[element], self.elements.modes[element], volume)

    def volume(self, xx: Array, xy: Array, yx: Array, yy: Array) -> Array:  # noqa: ARG002 - as at finite strain
        """Return the measure of volume change of a displacement gradient: its trace at small strain, else ln J."""
        return xx + yy

    def places(self, probes: "Probes", tangent: Array | None = None) -> "Places":
        """Return what stays of probes whatever the displacements; `tangent` (p, 2) is along x where it is not given."""
        of, element, held = self.elements, probes.element, distinct(probes.element)
        along = np.tile([1.0, 0.0], (len(element), 1)) if tangent is None else tangent
        constants = np.stack([of.shear[element], of.lame[element], of.stiffening[element], *along.T])
        gradients = np.stack([of.grad_x[held], of.grad_y[held]])
        return Places(probes, held, np.searchsorted(held, element), gradients, self.modes_at(probes), constants)

    def state(self, places: "Places", displacement: Array) -> LocalState:
        """Return what is known of places for displacements (nodes, 2, ...): arrays (p, ...)."""
        held, wide = places.held, (slice(None), slice(None), *([None] * (displacement.ndim - 2)))
        gradient = places.probes.displacement_gradient(self.mesh, displacement)
        local = displacement[self.mesh.elements[held]]
        local = (local - local[:, 8:]).reshape(len(local), 9, -1)
        by = np.moveaxis((places.gradients @ local).reshape(2, len(held), 9, *displacement.shape[1:]), 3, 1)
        fit = self.volume_modes(self.volume(by[0, 0], by[1, 0], by[0, 1], by[1, 1]), held)[places.number]
        shear, lame, stiffening, x, y = places.constants[wide]
        return LocalState(
            gradient[:, 0, 0], gradient[:, 0, 1], gradient[:, 1, 0], gradient[:, 1, 1],
            np.einsum("pm,pm...->p...", places.modes, fit), shear, lame, stiffening, (x, y),
        )  # fmt: skip

    @cached_property
    def divergence(self) -> Array:
        """Matrices (e, 3, 18) from displacements of elements' nodes, x, y, x, y, ..., to the modes of their trace."""
        weighted = np.swapaxes(self.elements.weight[:, :, None] * self.elements.modes, 1, 2)
        by_axis = np.stack([weighted @ self.elements.grad_x, weighted @ self.elements.grad_y], axis=-1)
        return by_axis.reshape(-1, 3, 18)

    def modes_at(self, probes: "Probes") -> Array:
        """Return the elements' own modes (p, 3) at probes."""
        return (self.combination[probes.element] @ probes.modes[:, :, None])[:, :, 0]


@lru_cache(maxsize=4)  # bodies of one mesh and several materials follow one another
def _geometry(mesh: Mesh) -> tuple[Array, ...]:
    """Return gradients along x and y, weights, modes, Laplacian, centre and combination of the elements of `mesh`."""
    count = len(mesh.elements)
    sizes = (9, 9), (9, 9), (9,), (9, 3), (9, 9), (2,), (3, 3)
    out = tuple(np.empty((count, *size)) for size in sizes)
    if not element_loops.integrate(mesh.nodes, mesh.elements, _SHAPES, ElementGeometry(*out)):
        raise LinAlgError("an element is folded")
    return out


def integrate_elements(
    mesh: Mesh, materials: Sequence[Elasticity], unknown: Narrow
) -> tuple[Mesh, ElementArrays, Array, Array]:
    """Return what `MeshElements` are made of; `unknown` (e, 16) are those of their outer nodes, -1 where fixed.

    Raises LinAlgError where an element is folded.
    """
    shear, lame, stiffening = (
        np.array(numbers, np.float64)[mesh.region]
        for numbers in zip(*((m.shear, m.lame, getattr(m, "stiffening", PLAIN)) for m in materials), strict=True)
    )
    grad_x, grad_y, weight, modes, laplace, centre, combination = _geometry(mesh)
    elements = ElementArrays(
        grad_x, grad_y, weight, modes, laplace, shear, stiffening, lame, mesh.elements.astype(np.int32),
        unknown.reshape(-1, 8, 2),
    )  # fmt: skip
    return mesh, elements, centre, combination


def held_directions(mesh: Mesh) -> Narrow:
    """Return whether each node of the skin is held (k,): along x HELD_X, along y HELD_Y, both their sum."""
    return (mesh.driven[mesh.skin] @ np.array([HELD_X, HELD_Y])).astype(np.int32)


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class Patches:
    """Endings of a body, averaged over r patches."""

    elements: MeshElements
    endings: Endings
    quantities: ClassVar[tuple[Callable[[LocalState], Array], ...]]  # of the kinematics, SED first

    def nodes(self) -> Indices:
        """Return the numbers of the nodes whose displacements count."""
        return distinct(self.elements.mesh.elements[distinct(self.endings.probes.element)])

    def state(self, displacement: Array) -> LocalState:
        """Return what is known of the places for displacements (nodes, 2, ...): arrays (p, ...)."""
        return self.elements.state(self._places, displacement)

    @cached_property
    def _places(self) -> "Places":
        return self.elements.places(self.endings.probes, self.endings.tangent)

    def energy(self, displacement: Array) -> Array:
        """Return the SED at the places (p, ...) [MPa] for displacements (nodes, 2, ...)."""
        return self.quantities[0](self.state(displacement))

    def average(self, displacement: Array) -> Array:
        """Return the SED averaged over each (r, ...) [MPa] for displacements (nodes, 2, ...); nan where no patch."""
        return self.endings.means(self.energy(displacement))

    def responses(self, displacement: Array) -> Array:
        """Return every quantity averaged over each (q, r, ...) for displacements (nodes, 2, ...), even complex ones."""
        state = self.state(displacement)
        return np.stack([self.endings.means(quantity(state)) for quantity in self.quantities])
