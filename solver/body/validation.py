"""Validation of a user's body; each error is one sentence."""

from collections.abc import Sequence
from math import isfinite

import numpy as np

from solver.arrays import Array, Flags
from solver.constitutive import Elasticity, Prony
from solver.mesh import Q2P1, Mesh, distinct, jacobians
from solver.scene.tables import STIFFENING

MOTIONS = ("x", "y", "turn")  # rigid motions
CUT = 1e-9  # relative size of a rigid motion at the held nodes below which these do not prevent it [-]


class BodyError(ValueError):
    """A body that cannot be solved; the message says what is wrong, where, and what to do."""


def check_body(mesh: Mesh, materials: Sequence[Elasticity]) -> None:
    """Raise BodyError where arrays of `mesh` or its `materials` by region are not valid.

    Raises MeshError where an element is folded at a quadrature point.
    """
    _check_arrays(mesh)
    _check_driven_nodes(mesh)
    check_moduli(mesh, materials)
    jacobians(mesh, Q2P1.points)
    _check_skin(mesh)


def _check_arrays(mesh: Mesh) -> None:
    """Raise BodyError where an array has a wrong shape, type or range."""
    count = len(mesh.nodes)
    if mesh.nodes.shape != (count, 2) or mesh.nodes.dtype != np.float64:
        raise BodyError(
            f"mesh.nodes has the shape {mesh.nodes.shape} of {mesh.nodes.dtype}; give every node x and y in mm, (n, 2)"
        )
    if mesh.elements.shape != (len(mesh.elements), 9) or not len(mesh.elements):
        raise BodyError(
            f"mesh.elements has the shape {mesh.elements.shape}; name nine nodes of each, of one at least, (e, 9)"
        )
    if not np.isfinite(mesh.nodes).all():
        worst = int(np.argmin(np.isfinite(mesh.nodes).all(axis=1)))
        raise BodyError(f"node {worst} of the mesh has no finite position; give every node two lengths in mm")
    for name in ("elements", "region", "skin", "held", "held_x", "held_y"):
        numbers = getattr(mesh, name)
        if numbers.dtype != np.int64:
            raise BodyError(f"mesh.{name} is made of {numbers.dtype}; give whole numbers, counted from 0")
        if numbers.ndim != 1 and name != "elements":
            raise BodyError(f"mesh.{name} has the shape {numbers.shape}; give one row of numbers")
        if name != "region" and numbers.size and not (numbers.min() >= 0 and numbers.max() < count):
            raise BodyError(f"mesh.{name} names a node that does not exist; number the {count} nodes from 0")
    if len(mesh.region) != len(mesh.elements):
        raise BodyError(f"mesh.region has {len(mesh.region)} entries for {len(mesh.elements)} elements; give one each")


def _stray(mesh: Mesh) -> Flags:
    """Return flags (n,) of the nodes that belong to no element."""
    out = np.ones(len(mesh.nodes), bool)
    out[mesh.elements] = False
    return out


def _check_driven_nodes(mesh: Mesh) -> None:
    """Raise BodyError for a driven node without an element, or at the centre of an element that is not all driven."""
    stray = np.flatnonzero(_stray(mesh) & mesh.driven.any(axis=1))
    if len(stray):
        raise BodyError(f"node {stray[0]} is held and belongs to no element of the mesh; leave it out")
    outer, centre = mesh.driven[mesh.elements[:, :8]].all(axis=1), mesh.driven[mesh.elements[:, 8]]
    wrong = (centre & ~outer).any(axis=1)
    if wrong.any():
        element = int(np.argmax(wrong))
        raise BodyError(
            f"node {mesh.elements[element, 8]} is held and is the centre of element {element}, whose other nodes are "
            "not all held so; hold them too, or leave the centre out"
        )


def check_moduli(mesh: Mesh, materials: Sequence[Elasticity]) -> None:
    """Raise BodyError where a region of `mesh` has no material, or moduli are not allowed."""
    if not (mesh.region.min() >= 0 and mesh.region.max() < len(materials)):
        worst = int(mesh.region.max() if mesh.region.min() >= 0 else mesh.region.min())
        raise BodyError(
            f"region {worst} of the mesh has no material: {len(materials)} are given; give one for every region from 0"
        )
    for number, material in enumerate(materials):
        try:
            shear, lame = material.shear, material.lame
        except (AttributeError, ZeroDivisionError):
            shear, lame = np.nan, np.nan
        if not (0.0 < shear < np.inf and np.isfinite(lame) and lame > -2.0 / 3.0 * shear):
            raise BodyError(
                f"material {number}, {material}, cannot be computed; give one of solver.constitutive, whose "
                "E must be above 0 and nu from 0 to 0.4999999, since nu = 0.5 leaves no energy of volume change"
            )


def check_laws(laws: Sequence[Elasticity]) -> None:
    """Raise BodyError unless `laws` are for finite strain, with exponents that the scene file allows."""
    for number, law in enumerate(laws):
        exponent = getattr(law, "stiffening", None)
        if exponent is None:
            raise BodyError(f"material {number}, {law}, is no law of finite strain; give one of solver.constitutive")
        low, high = STIFFENING
        if not low <= exponent <= high:
            raise BodyError(
                f"material {number}, {law}, stiffens with the exponent {exponent:g}; it must lie between "
                f"{low:g} and {high:g}"
            )


def check_terms(laws: Sequence[Prony]) -> None:
    """Raise BodyError where terms of a Prony series are not allowed."""
    for number, law in enumerate(laws):
        if not (all(g >= 0.0 and 0.0 < tau < np.inf for g, tau in law.terms) and law.long_term > 0.0):
            raise BodyError(
                f"material {number}, {law}, has terms that cannot relax; every g must be 0 or more, all together below "
                "1, and every tau a time above 0"
            )


def _check_skin(mesh: Mesh) -> None:
    """Raise BodyError unless the skin is one chain of free sides of elements, with the body to the left of it.

    The body then lies above skin that runs from left to right, where the surface can meet it.
    """
    if not mesh.skin.size:
        return
    advice = "name one chain of them from left to right, from corner by middle to corner, and so on"
    if len(mesh.skin) < 3 or len(mesh.skin) % 2 == 0:
        raise BodyError(f"mesh.skin has {len(mesh.skin)} nodes, which make no whole sides of elements; {advice}")
    sides = np.stack([mesh.skin[:-2:2], mesh.skin[1::2], mesh.skin[2::2]], axis=1)
    corner = np.arange(4)
    around = mesh.elements[:, np.stack([corner, corner + 4, (corner + 1) % 4], axis=1)].reshape(-1, 3)
    middles, first, counts = np.unique(around[:, 1], return_index=True, return_counts=True)
    position = np.minimum(np.searchsorted(middles, sides[:, 1]), len(middles) - 1)
    wrong = (around[first[position]] != sides).any(axis=1) | (counts[position] > 1)
    if wrong.any():
        nodes = ", ".join(str(node) for node in sides[int(np.argmax(wrong))])
        raise BodyError(f"nodes {nodes} of mesh.skin are no free side of an element with the body above it; {advice}")
    if len(np.unique(mesh.skin)) < len(mesh.skin):
        raise BodyError(f"mesh.skin names a node twice; {advice}")


def check_loads(mesh: Mesh, loads: Array | None, prescribed: Array | None) -> None:
    """Raise BodyError unless `loads` and `prescribed` are finite (nodes, 2), the latter 0 where nothing is held."""
    for name, array in (("loads", loads), ("prescribed", prescribed)):
        if array is None:
            continue
        array = np.asarray(array)
        if array.dtype.kind not in "fiu" or array.shape != mesh.nodes.shape:
            raise BodyError(
                f"{name} has the shape {array.shape} of {array.dtype}; it must be numbers in {mesh.nodes.shape}, a row "
                "for every node"
            )
        if not np.isfinite(array).all():
            row = int(np.argmin(np.isfinite(array).all(axis=1)))
            raise BodyError(f"row {row} of {name} is not finite; give 0 where there is none")
    stray = _stray(mesh) & np.asarray(0.0 if loads is None else loads).any(axis=-1)
    if stray.any():
        raise BodyError(f"loads pull at node {np.argmax(stray)}, which belongs to no element; give 0 there")
    if prescribed is not None and np.asarray(prescribed)[~mesh.driven].any():
        row, along = (int(index[0]) for index in np.nonzero(prescribed * ~mesh.driven))
        raise BodyError(
            f"prescribed moves node {row} along {'xy'[along]}, where nothing holds it; name it in mesh.held, or in "
            f"mesh.held_{'xy'[along]}"
        )


def finite(name: str, value: float) -> float:
    """Return `value` as a float. Raises ValueError where it is not finite."""
    if not isfinite(value):
        raise ValueError(f"{name} = {value} is not allowed: give a finite number")
    return float(value)


def rigid_motions(points: Array) -> Array:
    """Return the displacements (2 n, 3) of points (n, 2) by each of MOTIONS: along x, along y, and by a turn."""
    (x, y), ones, zeros = points.T, np.ones(len(points)), np.zeros(len(points))
    return np.stack([np.c_[ones, zeros].ravel(), np.c_[zeros, ones].ravel(), np.c_[-y, x].ravel()], axis=1)


def unprevented_motions(mesh: Mesh) -> Array:
    """Return a basis (3, r) of the rigid motions that no held node prevents, as combinations of MOTIONS."""
    if len(distinct(mesh.held)) > 1:
        return np.zeros((3, 0))
    moves = rigid_motions(mesh.nodes / np.ptp(mesh.nodes))[mesh.fixed]
    _, sizes, ways = np.linalg.svd(np.concatenate([moves, np.zeros((3, 3))]), full_matrices=False)
    ways[:, 2] /= np.ptp(mesh.nodes)
    return ways[sizes[:3] < CUT * np.sqrt(len(mesh.fixed) + 1.0)].T


def check_driven(mesh: Mesh) -> None:
    """Raise BodyError where no node of a body is held along x and y, as finite strain needs."""
    if not mesh.driven.any():
        raise BodyError(
            "nothing holds the body; name the nodes that are driven in mesh.held, or along one direction alone in "
            "mesh.held_x and mesh.held_y"
        )


def check_held(mesh: Mesh, free: Sequence[str] = ()) -> None:
    """Raise BodyError where the supports leave a body a rigid motion that is not `free` for the surface to balance.

    Skin that may touch must not be held along y either, because it could not yield to the surface.
    """
    unknown = [name for name in free if name not in MOTIONS]
    if unknown:
        raise BodyError(f"free names the motion {unknown[0]!r}; name some of {', '.join(map(repr, MOTIONS))}")
    if not free and not mesh.driven.any():
        raise BodyError(
            "nothing holds the body; name the nodes that are driven in mesh.held, or the motions along which the "
            'surface alone balances the loads, as free = ("y", "turn")'
        )
    motions = unprevented_motions(mesh)
    motions[[MOTIONS.index(name) for name in free]] = 0.0
    if len(mesh.fixed) and np.abs(motions).max(initial=0.0) > CUT:
        raise BodyError(
            "what is held leaves the body a motion as a whole; hold more of it, or name the motion in free, for the "
            "surface to balance"
        )
    stiff = mesh.skin[mesh.driven[mesh.skin, 1]]
    if len(stiff):
        raise BodyError(f"node {stiff[0]} of the skin is held along y; leave its edge out of mesh.skin")
