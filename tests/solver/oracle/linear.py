"""A body at small strain assembled and eliminated in plain NumPy: the judge of the compiled loops."""

from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.mesh import Q2P1

_VALUES, _GRADIENTS = Q2P1.shape(Q2P1.points)  # (9 points, 9 nodes), (9, 9, 2)
_ALONG, _UP = np.ascontiguousarray(_GRADIENTS[..., 0].T), np.ascontiguousarray(_GRADIENTS[..., 1].T)  # (9 nodes, 9)


class ElementMatrices(NamedTuple):
    """Elements by their matrices, displacements being ordered x, y, x, y, ..."""

    stiffness: Array  # (e, 18, 18) [N/mm per mm]
    dilatation: Array  # (e, 3, 18): displacements to the volume strain's modes 1, x - xc, y - yc
    centre: Array  # (e, 2) xc, yc of the modes [mm]
    shear: Array  # (e,) [MPa]
    lame: Array  # (e,) [MPa]


def elastic(mesh, materials):
    """Integrate the stiffness of every element with 3 x 3 Gauss points; `materials` by region.

    K = integral of 2 G eps:eps + lambda theta^2, where theta is the best fit of the volume strain by 1, x, y. That
    is the mixed form with pressure lambda theta, its three pressure modes eliminated (exact for Hooke).
    """
    corners = mesh.nodes[mesh.elements]  # (e, 9, 2)
    count = len(corners)
    x, y = np.ascontiguousarray(corners[..., 0]), np.ascontiguousarray(corners[..., 1])
    x_xi, x_eta, y_xi, y_eta = x @ _ALONG, x @ _UP, y @ _ALONG, y @ _UP  # (e, q)
    det = x_xi * y_eta - x_eta * y_xi
    weight = det * Q2P1.weights
    by_x = (y_eta / det)[:, :, None] * _ALONG.T  # (e, q, 9) dN/dx
    by_x -= (y_xi / det)[:, :, None] * _UP.T
    by_y = (x_xi / det)[:, :, None] * _UP.T
    by_y -= (x_eta / det)[:, :, None] * _ALONG.T

    shear = np.array([m.shear for m in materials])[mesh.region]
    lame = np.array([m.lame for m in materials])[mesh.region]
    points = _VALUES @ corners  # (e, q, 2)
    centre = points.mean(axis=1)
    modes = np.ones((count, 9, 3))
    modes[:, :, 1:] = points - centre[:, None]
    weighted_modes = np.swapaxes(modes * weight[:, :, None], 1, 2)  # (e, 3, q)
    moments = np.empty((count, 3, 9, 2))  # integral of mode times divergence
    moments[..., 0], moments[..., 1] = weighted_modes @ by_x, weighted_modes @ by_y
    moments = moments.reshape(count, 3, 18)
    dilatation = np.linalg.inv(weighted_modes @ modes) @ moments
    stiffness = np.swapaxes(lame[:, None, None] * moments, 1, 2) @ dilatation

    # K_ia,jb gets G (delta_ab grad N_i . grad N_j + dN_i/db dN_j/da), one pair of directions after the other
    blocks = stiffness.reshape(count, 9, 2, 9, 2)
    weight *= shear[:, None]
    along = np.swapaxes(by_x * weight[:, :, None], 1, 2)
    xx, xy = along @ by_x, along @ by_y
    yy = np.swapaxes(by_y * weight[:, :, None], 1, 2) @ by_y
    laplacian = xx + yy
    blocks[:, :, 0, :, 0] += laplacian + xx
    blocks[:, :, 1, :, 1] += laplacian + yy
    blocks[:, :, 0, :, 1] += np.swapaxes(xy, 1, 2)
    blocks[:, :, 1, :, 0] += xy
    return ElementMatrices(stiffness, dilatation, centre, shear, lame)


class CondensedBody:
    """A body reduced to the displacements of its skin, x and y in turn, by one dense elimination of all others."""

    def __init__(self, mesh, stiffness, loads=None):
        count = mesh.nodes.size
        at = (2 * mesh.elements[:, :, None] + np.arange(2)).reshape(len(mesh.elements), 18)
        matrix = np.zeros((count, count))
        np.add.at(matrix, (at[:, :, None], at[:, None, :]), stiffness)
        self.loads = np.zeros((count, 1)) if loads is None else loads
        self.skin_unknowns = (2 * mesh.skin[:, None] + np.arange(2)).ravel()
        self.inner = np.setdiff1d(np.arange(count), np.concatenate([mesh.fixed, self.skin_unknowns]))
        self.inside = matrix[np.ix_(self.inner, self.inner)]
        self.across = matrix[np.ix_(self.inner, self.skin_unknowns)]
        self.follow = np.linalg.solve(self.inside, self.across)
        self.stiffness = matrix[np.ix_(self.skin_unknowns, self.skin_unknowns)] - self.across.T @ self.follow
        self.load = self.skin_load(self.loads)

    def skin_load(self, loads):
        """Return what the skin (m, l) feels of `loads` (size, l)."""
        return loads[self.skin_unknowns] - self.follow.T @ loads[self.inner]

    def all_unknowns(self, skin, loads=None):
        """Return all unknowns (size, c) for those of the skin (m, c), under `loads` (size, c) too."""
        unknowns = np.zeros((len(self.loads), skin.shape[1]))
        unknowns[self.skin_unknowns] = skin
        force = np.zeros(unknowns.shape) if loads is None else loads
        unknowns[self.inner] = np.linalg.solve(self.inside, force[self.inner] - self.across @ skin)
        return unknowns

    def under(self, loads):
        """Return all unknowns (size, c) under `loads` (size, c) alone."""
        return self.all_unknowns(np.linalg.solve(self.stiffness, self.skin_load(loads)), loads)
