"""The door for bodies handed in as arrays: what cannot be solved is refused there with one sentence."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from solver.elements import Q2P1
from solver.grid import jacobians
from solver.mesh import Array, Mesh


class BodyError(ValueError):
    """A body that cannot be solved as it was handed in: what is wrong, where, and what to do."""


class Stiff(Protocol):
    """What is asked of a material at the door."""

    @property
    def shear(self) -> float:
        """Shear modulus [MPa]."""
        ...

    @property
    def lame(self) -> float:
        """Lamé's first constant [MPa]."""
        ...


def check_body(mesh: Mesh, materials: Sequence[Stiff]) -> None:
    """Raise BodyError where numbers of `mesh` or of its `materials` by region make no body.

    Raises MeshError where an element is folded at a point of its quadrature, which is all that is asked of it.
    """
    count = len(mesh.nodes)
    if not np.isfinite(mesh.nodes).all():
        worst = int(np.argmin(np.isfinite(mesh.nodes).all(axis=1)))
        raise BodyError(f"node {worst} of the mesh has no finite position; give every node two lengths in mm")
    for name in ("elements", "skin", "held"):
        numbers = getattr(mesh, name)
        if numbers.size and not (numbers.min() >= 0 and numbers.max() < count):
            raise BodyError(f"mesh.{name} names a node that is not there; number the {count} nodes from 0")
    if len(mesh.region) != len(mesh.elements):
        raise BodyError(f"mesh.region has {len(mesh.region)} entries for {len(mesh.elements)} elements; give one each")
    if not (mesh.region.min() >= 0 and mesh.region.max() < len(materials)):
        worst = int(mesh.region.max() if mesh.region.min() >= 0 else mesh.region.min())
        raise BodyError(
            f"region {worst} of the mesh has no material: {len(materials)} are given; give one for every region from 0"
        )
    for number, material in enumerate(materials):
        try:
            shear, lame = material.shear, material.lame
        except ZeroDivisionError:
            shear, lame = np.nan, np.nan
        if not (0.0 < shear < np.inf and np.isfinite(lame) and lame > -2.0 / 3.0 * shear):
            raise BodyError(
                f"material {number}, {material}, is none that can be computed; E must be above 0 and nu from 0 to "
                "0.4999999, since nu = 0.5 leaves no energy of volume change"
            )
    jacobians(mesh, Q2P1.points)


def check_loads(mesh: Mesh, loads: Array | None, prescribed: Array | None) -> None:
    """Raise BodyError unless dead `loads` are (nodes, 2) and `prescribed` (held, 2), and all of them finite."""
    for name, given, rows in (("loads", loads, len(mesh.nodes)), ("prescribed", prescribed, len(mesh.held))):
        if given is None:
            continue
        if given.shape != (rows, 2):
            raise BodyError(f"{name} has the shape {given.shape}; it must be ({rows}, 2)")
        if not np.isfinite(given).all():
            row = int(np.argmin(np.isfinite(given).all(axis=1)))
            raise BodyError(f"row {row} of {name} is not finite; give 0 where there is none")


def check_held(mesh: Mesh, free: Sequence[str] = ()) -> None:
    """Raise BodyError where nothing holds a body and no motion of it is `free` for the surface to balance."""
    if not len(mesh.held) and not free:
        raise BodyError(
            "nothing holds the body; name the nodes that are driven in mesh.held, or the motions along which the "
            'surface alone balances the loads, as free = ("y", "turn")'
        )
