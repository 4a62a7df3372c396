"""A body: what is asked of it as a whole, and as Newton sees it, condensed to the k nodes of skin that may touch."""

from collections.abc import Sequence
from typing import Protocol

from solver.arrays import Array, Indices, Narrow
from solver.mesh import Mesh


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
        """The inverse of the stiffness (2 k, 2 k) where that is known, else (0, 0) [mm per N/mm]."""
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

    def stored(self, u: Array, reaction: Array) -> float:
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
