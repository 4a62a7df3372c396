"""Types of arrays that every module shares, two-by-two matrices, and the arrays that compiled loops take together."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Narrow = NDArray[np.int32]
Flags = NDArray[np.bool_]


def determinant(matrices: Array) -> Array:
    """Return the determinants (...) of matrices (..., 2, 2), complex ones too."""
    return matrices[..., 0, 0] * matrices[..., 1, 1] - matrices[..., 0, 1] * matrices[..., 1, 0]


def inverse(matrices: Array) -> Array:
    """Return the inverses of matrices (..., 2, 2), complex ones too."""
    adjugate = np.empty_like(matrices)
    adjugate[..., 0, 0], adjugate[..., 1, 1] = matrices[..., 1, 1], matrices[..., 0, 0]
    adjugate[..., 0, 1], adjugate[..., 1, 0] = -matrices[..., 0, 1], -matrices[..., 1, 0]
    return adjugate / determinant(matrices)[..., None, None]


class ElementGeometry(NamedTuple):
    """What is integrated over e elements, whatever they are made of; q = 9 quadrature points."""

    grad_x: Array  # as in `ElementArrays`
    grad_y: Array
    weight: Array
    modes: Array
    laplace: Array
    centre: Array  # (e, 2) from which x and y of the modes are counted [mm]
    combination: Array  # (e, 3, 3) the modes by 1, x, y: the inverse of the Cholesky factor of their mass


class ElementArrays(NamedTuple):
    """Elements of nine nodes and what they are made of: e elements, q = 9 quadrature points."""

    grad_x: Array  # (e, q, 9) gradients of the shape functions at the quadrature points [1/mm]
    grad_y: Array  # (e, q, 9)
    weight: Array  # (e, q) areas of the quadrature points [mm2]
    modes: Array  # (e, q, 3) pressure modes there, orthonormal over the element [1/mm]
    laplace: Array  # (e, 9, 9) integrals of grad N_i . grad N_j [-]
    shear: Array  # (e,) [MPa]
    stiffening: Array  # (e,) Ogden's exponent [-]
    lame: Array  # (e,) [MPa]
    nodes: Narrow  # (e, 9)
    unknown: Narrow  # (e, 8, 2) of the outer nodes, -1 where fixed


class ElementSystem(NamedTuple):
    """Forces and tangents of e elements whose centre nodes are eliminated inside them; n unknowns."""

    tangent: Array  # (e, 16, 16) of the outer nodes, lower half [N/mm per mm]
    force: Array  # (n,) internal forces [N/mm]
    recovery_matrix: Array  # (e, 2, 17): displacement of the centre = -(recovery_matrix @ (outer displacements, 1))
    condensed_inverse: Array  # (e, 3) of the centre's stiffness: xx, xy, yy
    dilate: Array  # (e, 3, 18) derivative of the modes of ln J
    volume: Array  # (e, 3) those modes
    more_force: Array  # (e, 18) of relaxing tissue, ordered as in `ElementWork`; (0, 18) where there is none
    more_tangent: Array  # (e, 18, 18) of it, or (0, 18, 18)


class ElementWork(NamedTuple):
    """Memory for one element. Sums over quadrature points are products of small matrices of a fixed size.

    Their sixteen columns are x of the outer nodes, then y; the centre's come last.
    """

    turned: Array  # (q, 4) inverse of F, transposed: xx, xy, yx, yy
    exceeds: Array  # (q, 4) F less that
    h: Array  # (q, 18) gradients of shape functions times the former: in the deformed body
    s: Array  # (q, 18) and times the latter
    wide: Array  # (q, 3) weights times modes
    push: Array  # (q,) shear modulus as it has grown, by weight
    more: Array  # (q,) how fast it grows, by weight
    bend: Array  # (q,) the modulus less the pressure, by weight
    d: Array  # (3, 18) derivatives of the modes of ln J
    f: Array  # (18,) forces
    by_x: Array  # (9, 16) products of deformed gradients, by x of a node
    by_y: Array  # (9, 16) and by its y
    laplace: Array  # (9, 9) as in `ElementArrays`, times the shear modulus as it has grown [N/mm per mm]
    left: Array  # (18, 5) the tangent less the products is left right: three modes of pressure, and the centre
    right: Array  # (5, 16)
    own: Array  # (18, 18) what stiffening and relaxing tissue add to the tangent
    product: Array  # (16, 16) of left and right


class BodyState(NamedTuple):
    """Displacements and pressures of a body at finite strain."""

    u: Array  # (nodes, 2) [mm]
    pressure: Array  # (e, 3) modes


class ShapeFunctions(NamedTuple):
    """The shape functions of nine nodes at the quadrature points."""

    values: Array  # (q, 9)
    along: Array  # (q, 9) slopes along the first local coordinate
    up: Array  # (q, 9) and along the second
    weights: Array  # (q,)


class SymbolicFactorization(NamedTuple):
    """Parts of a body, p of them, children before parents, and the unknowns n that each eliminates.

    Unknowns are numbered in the order of their elimination; those of the skin, m, come last: x, y of each of its nodes.
    """

    unknown: Narrow  # (e, 16) of the elements' outer nodes, -1 where fixed
    size: int  # n
    start: Narrow  # (p,) first unknown eliminated in each part
    inner: Narrow  # (p,) how many are
    border: Narrow  # (p,) how many are passed on
    children: Narrow  # (p, 2) parts joined in each, -1 in a leaf
    border_at: Narrow  # (p,) where each part's border begins in `numbers` and `place`
    numbers: Narrow  # unknowns of all borders
    place: Narrow  # where each of them stands in the front of the parent
    run: Narrow  # where in its border the run of neighbours ends that are neighbours there too
    factor_at: Indices  # (p,) where each part's factor begins
    wait_at: Indices  # (p,) where each part's border waits for the parent
    leaf: Narrow  # (p, 2) range of `order` that belongs to each leaf
    order: Narrow  # (e,) elements, leaf after leaf
    at: Narrow  # (e, 16) in that order: where an element's unknowns stand in the front of its leaf, -1 where fixed
    factors: int  # numbers that all factors hold
    waiting: int  # numbers that wait at once


class Factors(NamedTuple):
    """The factors of an elimination, and where they stand; the integer arrays are a SymbolicFactorization's."""

    start: Narrow
    inner: Narrow
    border: Narrow
    border_at: Narrow
    numbers: Narrow
    factor_at: Indices
    values: Array  # rows of D L^T, part after part
    near: Array  # (k + b,) memory for the largest part


class CondensedArrays(NamedTuple):
    """A linearised body as its skin of k nodes feels it: x, y of one node, x, y of the next."""

    stiffness: Array  # (2 k, 2 k) [N/mm per mm]
    force: Array  # (2 k,) of the skin on the surface, were there no surface [N/mm]


class Skin(NamedTuple):
    """The skin that may touch: k nodes."""

    held: Narrow  # (k,) whether a node is held: along x HELD_X, along y HELD_Y, both their sum
    middle: Narrow  # (k,) 1 at the middle of an edge whose length follows the deformed skin, else 0
    fixed_length: Array  # (k,) skin that each node stands for whatever the state [mm]


class ContactControl(NamedTuple):
    """Which of depth and travel follow from forces, in one linear system, and how often states may change."""

    kind: int  # DEPTH_GIVEN, PUSH_GIVEN or DRAG_GIVEN
    drag: float  # of the surface along +x [N/mm]
    push: float  # and along +y
    stride: float  # largest change of depth or travel [mm]
    rounds: int  # of changes of the contact states, at most


class LoadArguments(NamedTuple):
    """What the surface does."""

    depth: float  # how far it has risen [mm]
    mu: float  # coefficient of friction [-]
    tau: float  # bound of its traction [MPa]
    sense: int  # +1, -1: all that touches slips, the friction force pointing there; 0: sticks, slips and turns round


class SkinPosition(NamedTuple):
    """Where the skin's nodes are in relation to the surface."""

    x: Array  # (k,) along the surface [mm]
    above: Array  # (k,) over it [mm]
    anchor: Array  # (k,) positions along it where nodes stick [mm]


class ContactStates(NamedTuple):
    """States of the skin's k nodes and the forces on them."""

    state: Narrow  # (k,) OPEN, STICK, SLIP or SHEAR_LIMITED
    sense: Narrow  # (k,) direction of the friction force where they slip
    reaction: Array  # (k, 2) forces of the surface on them [N/mm]


class ContactSystem(NamedTuple):
    """The linear system of the skin's contact, and memory for it: n = 2 k + 3 unknowns at most."""

    length: Array  # (k,) length of skin on which a bound acts that each node stands for [mm]
    free: Narrow  # (n,) the unknowns, displacements or forces
    matrix: Array  # (n n,)
    right: Array  # (n, 4)
    steps: Array  # (2 k, 4) of the skin: to equilibrium, and by depth, mu and travel of the surface along +x
    motion: Array  # (2,) change of depth and travel in the first of them, where forces are given [mm]


class StateChanges(NamedTuple):
    """States of the skin's k nodes that a solution calls for."""

    state: Narrow  # (k,)
    sense: Narrow  # (k,)
    badness: Array  # (k,) how badly each node contradicts its own [N/mm]; -1 where it does not


class Slack(NamedTuple):
    """What is round-off of forces and heights, by the largest of each."""

    force: float  # [N/mm]
    height: float  # [mm]
    by_height: float  # the largest force by the largest height [N/mm per mm]
