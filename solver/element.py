"""Shape functions and quadrature, a class each; the list of elements is at the foot.

Q2/P-1: nine-node quadrilateral, biquadratic displacements, and a pressure that is linear in x and y inside each element
and discontinuous between elements, so that it can be condensed in the element. Stable and of optimal order up to the
incompressible limit (Boffi and Gastaldi 2002, Computing 69, 1-10, with the pressure linear in true coordinates).
"""

import numpy as np

from solver.arrays import Array

# Gauss's points and weights on a line from -1 to 1, in closed form: NumPy's polynomials take longer to import
GAUSS_3 = np.array([-(0.6**0.5), 0.0, 0.6**0.5]), np.array([5.0, 8.0, 5.0]) / 9.0
_FAR, _NEAR = (3.0 / 7.0 + 2.0 / 7.0 * 1.2**0.5) ** 0.5, (3.0 / 7.0 - 2.0 / 7.0 * 1.2**0.5) ** 0.5
GAUSS_4 = np.array([-_FAR, -_NEAR, _NEAR, _FAR]), 0.5 + np.array([-1.0, 1.0, 1.0, -1.0]) * 30.0**0.5 / 36.0
_ACROSS = np.array([0, 2, 2, 0, 1, 2, 1, 0, 1])  # position of each node among -1, 0, +1 along xi
_UP = np.array([0, 0, 2, 2, 0, 1, 2, 1, 1])  # and along eta


def line(s: Array) -> tuple[Array, Array]:
    """Return the three quadratic shape functions of a line at `s` (...), and their slopes, each (..., 3).

    >>> line(np.array(0.5))
    (array([-0.125,  0.75 ,  0.375]), array([ 0., -1.,  1.]))
    """
    values = np.stack([s * (s - 1.0) / 2.0, 1.0 - s * s, s * (s + 1.0) / 2.0], axis=-1)
    slopes = np.stack([s - 0.5, -2.0 * s, s + 0.5], axis=-1)
    return values, slopes


class Q2P1:
    """The nine-node quadrilateral with three pressure modes."""

    name = "Q2/P-1"
    order = 2  # of the displacements
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    positions = np.stack([_ACROSS - 1.0, _UP - 1.0], axis=-1)  # (9, 2) of the nodes
    points = np.stack([np.tile(GAUSS_3[0], 3), np.repeat(GAUSS_3[0], 3)], axis=-1)  # (9, 2) quadrature
    weights = np.tile(GAUSS_3[1], 3) * np.repeat(GAUSS_3[1], 3)  # (9,)

    @staticmethod
    def shape(at: Array) -> tuple[Array, Array]:
        """Return the shape functions (..., 9) at local points (..., 2), and their gradients (..., 9, 2).

        >>> values, gradients = Q2P1.shape(np.array([1.0, 1.0]))
        >>> values
        array([0., 0., 1., 0., 0., 0., 0., 0., 0.])
        """
        (nx, dx), (ny, dy) = line(at[..., 0]), line(at[..., 1])
        across, up = nx[..., _ACROSS], ny[..., _UP]
        gradients = np.stack([dx[..., _ACROSS] * up, across * dy[..., _UP]], axis=-1)
        return across * up, gradients


ELEMENTS = (Q2P1,)
