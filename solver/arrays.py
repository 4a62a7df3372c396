"""Array types shared by all modules, their memory, two-by-two matrices, and arguments of compiled loops."""

import ctypes
import sys
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Narrow = NDArray[np.int32]
Flags = NDArray[np.bool_]

_LARGEST, _MOST = 32 << 20, 64 << 20  # bytes of one array, the maximum in mallopt's manual, and of all arrays


def _keep_freed_memory() -> None:
    """Make this process reuse the memory of freed arrays, where the C library is glibc.

    Otherwise the system clears new pages for every temporary array, a quarter of the work of a small solve. Twice as
    much memory saves no more; half as much saves an eighth of the work.
    """
    if sys.platform == "linux" and hasattr(library := ctypes.CDLL(None), "mallopt"):
        for parameter, size in ((-1, _MOST), (-3, _LARGEST)):  # M_TRIM_THRESHOLD, M_MMAP_THRESHOLD
            library.mallopt(parameter, size)


_keep_freed_memory()


def determinant(matrices: Array) -> Array:
    """Return the determinants (...) of real or complex matrices (..., 2, 2)."""
    return matrices[..., 0, 0] * matrices[..., 1, 1] - matrices[..., 0, 1] * matrices[..., 1, 0]


def inverse(matrices: Array) -> Array:
    """Return the inverses of real or complex matrices (..., 2, 2)."""
    adjugate = np.empty_like(matrices)
    adjugate[..., 0, 0], adjugate[..., 1, 1] = matrices[..., 1, 1], matrices[..., 0, 0]
    adjugate[..., 0, 1], adjugate[..., 1, 0] = -matrices[..., 0, 1], -matrices[..., 1, 0]
    return adjugate / determinant(matrices)[..., None, None]


NEO_HOOKEAN = 2.0  # Ogden's exponent of the neo-Hookean law, whose shear modulus is constant


class ElementArrays(NamedTuple):
    """Geometry and material of e nine-node elements; q = 9 quadrature points."""

    grad_x: Array  # (e, q, 9) gradients of the shape functions at the quadrature points [1/mm]
    grad_y: Array  # (e, q, 9)
    weight: Array  # (e, q) areas of the quadrature points [mm2]
    modes: Array  # (e, q, 3) pressure modes at these points, orthonormal over the element [1/mm]
    laplace: Array  # (e, 9, 9) integrals of grad N_i . grad N_j [-]
    shear: Array  # (e,) [MPa]
    stiffening: Array  # (e,) Ogden's exponent [-]
    lame: Array  # (e,) [MPa]
    nodes: Narrow  # (e, 9)
    unknown: Narrow  # (e, 8, 2) of the outer nodes, -1 where fixed


class ElementSystem(NamedTuple):
    """Forces and tangents of e elements whose centre nodes are condensed; n unknowns."""

    tangent: Array  # (e, 16, 16) of the outer nodes, lower half [N/mm per mm]
    force: Array  # (n,) internal forces [N/mm]
    recovery_matrix: Array  # (e, 2, 17): displacement of the centre = -(recovery_matrix @ (outer displacements, 1))
    condensed_inverse: Array  # (e, 3) inverse of the centre's stiffness: xx, xy, yy
    dilate: Array  # (e, 3, 18) derivatives of the modes of ln J with respect to displacements
    volume: Array  # (e, 3) modes of ln J
    overstress_force: Array  # (e, 18) of the overstress, ordered as in `ElementWork`; (0, 18) without relaxation
    overstress_tangent: Array  # (e, 18, 18) of the overstress; (0, 18, 18) without relaxation


class ElementWork(NamedTuple):
    """Memory for one element. Sums over quadrature points are products of small matrices of a fixed size.

    Columns are x of the eight outer nodes, y of these nodes, and x and y of the centre.
    """

    f_inv_t: Array  # (q, 4) F^-T: xx, xy, yx, yy
    f_diff: Array  # (q, 4) F - F^-T
    h: Array  # (q, 18) F^-T times gradients of shape functions: their gradients in the deformed body
    s: Array  # (q, 18) F - F^-T times gradients of shape functions
    weighted_modes: Array  # (q, 3) weights times pressure modes
    push: Array  # (q,) weight times current shear modulus
    shear_slope: Array  # (q,) weight times twice the derivative of this modulus with respect to Q
    bend: Array  # (q,) weight times (shear modulus - pressure)
    d: Array  # (3, 18) derivatives of the modes of ln J
    f: Array  # (18,) internal forces
    by_x: Array  # (9, 16) integrals of products of deformed gradients, a row for x of each node
    by_y: Array  # (9, 16) a row for y of each node
    laplace: Array  # (9, 9) as in `ElementArrays`, times the current shear modulus [N/mm per mm]
    left: Array  # (18, 5) left @ right is the tangent's part from three pressure modes and the centre
    right: Array  # (5, 16)
    dyads: Array  # (18, 18) terms of stiffening and overstress in the tangent
    product: Array  # (16, 16) left @ right


class BodyState(NamedTuple):
    """Displacements and pressures of a body at finite strain."""

    u: Array  # (nodes, 2) [mm]
    pressure: Array  # (e, 3) modes


class SymbolicFactorization(NamedTuple):
    """Plan of an elimination: p parts of a body, children before parents, and the unknowns that each part eliminates.

    The n unknowns are numbered in elimination order; the m of the skin come last, x and y of each of its nodes.
    """

    unknown: Narrow  # (e, 16) of the elements' outer nodes, -1 where fixed
    size: int  # n
    start: Narrow  # (p,) first unknown eliminated in each part
    inner: Narrow  # (p,) number of unknowns eliminated
    border: Narrow  # (p,) number of unknowns passed on
    children: Narrow  # (p, 2) child parts, -1 in a leaf
    border_at: Narrow  # (p,) start of each part's border in `numbers` and `place`
    numbers: Narrow  # unknowns of all borders
    place: Narrow  # position of each in the front of the parent
    run: Narrow  # end, within its border, of each entry's run of consecutive positions
    factor_at: Indices  # (p,) start of each part's factor
    wait_at: Indices  # (p,) start of each part's Schur complement in `waiting`
    leaf: Narrow  # (p, 2) range of `order` that belongs to each leaf
    order: Narrow  # (e,) elements, leaf after leaf
    position: Narrow  # (e, 16) positions of the unknowns of `order` in the front of their leaf; -1 where fixed
    factors: int  # size of the memory for factors
    waiting: int  # size of the memory for Schur complements


class Factors(NamedTuple):
    """The factors of an elimination and their positions; the integer arrays are those of a SymbolicFactorization."""

    start: Narrow
    inner: Narrow
    border: Narrow
    border_at: Narrow
    numbers: Narrow
    factor_at: Indices
    values: Array  # rows of D L^T, part after part
    near: Array  # (k + b,) memory for the largest part


class CondensedArrays(NamedTuple):
    """A linearised body condensed to its skin of k nodes: x, y of one node, x, y of the next."""

    stiffness: Array  # (2 k, 2 k) [N/mm per mm]
    force: Array  # (2 k,) reaction of the surface at zero step [N/mm]


class Skin(NamedTuple):
    """The skin that may touch: k nodes."""

    held: Narrow  # (k,) HELD_X, HELD_Y or their sum where displacements are prescribed, else 0
    middle: Narrow  # (k,) 1 at the middle of an edge whose length follows the deformation, else 0
    fixed_length: Array  # (k,) tributary length that does not depend on the state [mm]


class ContactControl(NamedTuple):
    """Whether depth and travel follow from prescribed forces in one linear system, and how often states may change."""

    kind: int  # DEPTH_CONTROL, PUSH_CONTROL or DRAG_CONTROL
    drag: float  # force of the surface along +x [N/mm]
    push: float  # force along +y [N/mm]
    max_increment: float  # of depth or travel [mm]
    max_rounds: int  # of changes of the contact states


class LoadArguments(NamedTuple):
    """Position and friction of the surface."""

    depth: float  # rise of the surface [mm]
    mu: float  # coefficient of friction [-]
    tau: float  # traction bound [MPa]
    sense: int  # +1, -1: touching nodes slip, with friction in this sense; 0: they stick, slip and reverse


class SkinPosition(NamedTuple):
    """Positions of the skin's nodes relative to the surface."""

    x: Array  # (k,) along the surface [mm]
    above: Array  # (k,) height over the surface [mm]
    anchor: Array  # (k,) positions along the surface at which nodes stick [mm]


class ContactStates(NamedTuple):
    """States of the skin's k nodes and the forces on them."""

    state: Narrow  # (k,) OPEN, STICK, SLIP or SHEAR_LIMITED
    sense: Narrow  # (k,) +1 or -1: sense of the friction force on slipping nodes
    reaction: Array  # (k, 2) forces of the surface on the nodes [N/mm]


class ContactSystem(NamedTuple):
    """The linear system of contact and its memory: n = 2 k + 3 unknowns at most."""

    length: Array  # (k,) length of skin on which the traction bound acts at each node [mm]
    free: Narrow  # (n,) the unknowns, displacements or forces
    matrix: Array  # (n n,)
    right: Array  # (n, 4)
    steps: Array  # (2 k, 4) of the skin: to equilibrium; derivatives with respect to depth, mu and travel along +x
    motion: Array  # (2,) changes of depth and travel in the first column, for prescribed forces [mm]


class StateChanges(NamedTuple):
    """States of the skin's k nodes that a solution requires."""

    state: Narrow  # (k,)
    sense: Narrow  # (k,)
    violation: Array  # (k,) violation of the current state by each node [N/mm]; -1 without contradiction


class Slack(NamedTuple):
    """Round-off of forces and heights, relative to the largest of each."""

    force: float  # [N/mm]
    height: float  # [mm]
    by_height: float  # ratio of the largest force to the largest height [N/mm per mm]
