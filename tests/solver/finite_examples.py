"""The published finger at finite strain, blocks and sheets, for the tests of several files."""

from dataclasses import replace
from functools import cache

import numpy as np

from solver import Finger, Friction, Loading, Materials, Receptor, Scene, Solve
from solver.body.finite import FiniteBody, FinitePatches
from solver.body.receptor import endings
from solver.constitutive import NeoHooke
from solver.equilibrium import Newton
from solver.equilibrium.finger import FiniteFinger
from solver.mesh import Mesh, quality
from solver.mesh import block as grid_block
from solver.mesh.mesher import Sizing, finger_mesh
from solver.verification.published.bodies import distort


@cache
def finger(fineness, indentation=2.0, margin=2.0, nu=0.48):
    """Return Newton on the finger's body, the reference ending's probes, and the nodes of the whole skin."""
    geometry = finger_mesh(Finger(), Receptor(), Sizing(fineness, indentation, margin=margin))
    tissues = Materials()
    moduli = [tissue.E for tissue in (tissues.epidermis, tissues.dermis, tissues.fat)]
    body = FiniteBody.of(geometry.mesh, [NeoHooke(E, nu) for E in moduli])
    probes = FinitePatches(body, endings(geometry, body.centre, Receptor(), np.zeros(1)))
    return Newton(body.condensed), probes, geometry.all_skin


@cache
def published(fineness, indentation=2.0):
    """Return the same finger as scenes have it."""
    scene = Scene(friction=Friction(0.0), loading=Loading(indentation), solve=Solve("finite"))
    return FiniteFinger.of(scene, Sizing(fineness, indentation, margin=3.0))


def block(columns=3, rows=2, width=2.0, height=1.0, distortion=0.0, seed=0, held="top"):
    """Return a block of nine-node elements over y = 0, its bottom being skin, its inner nodes moved at random."""
    x = np.linspace(0.0, width, 2 * columns + 1)
    y = np.linspace(height, 0.0, 2 * rows + 1)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    if distortion:
        shift = np.random.default_rng(seed).uniform(-distortion, distortion, points.shape)
        shift[[0, -1]] = 0.0
        shift[:, [0, -1]] = 0.0
        points = points + shift * np.array([width / columns, height / rows])
    nx, ny = points.shape[:2]
    number = np.arange(nx * ny).reshape(nx, ny)
    i, j = np.meshgrid(np.arange(0, nx - 1, 2), np.arange(0, ny - 1, 2), indexing="ij")
    column, row = np.array([0, 2, 2, 0, 1, 2, 1, 0, 1]), np.array([2, 2, 0, 0, 2, 1, 0, 1, 1])
    elements = number[i.ravel()[:, None] + column, j.ravel()[:, None] + row]
    nodes = {
        "top": number[:, 0],
        "sides and top": np.unique(np.concatenate([number[0], number[-1], number[:, 0]])),
    }
    return Mesh(points.reshape(-1, 2), elements, np.zeros(len(elements), np.int64), number[:, -1].copy(), nodes[held])


def boundary_nodes(mesh):
    """Return the nodes on the sides of a rectangle."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    return np.flatnonzero(np.any((mesh.nodes < low + 1e-9) | (mesh.nodes > high - 1e-9), axis=1))


def sheet(kind):
    """Return a mesh without skin, held all round: "straight", "distorted", "curved" or "aspect 50"."""
    height = 2.0 / 50 if kind == "aspect 50" else 2.0
    mesh = grid_block(np.linspace(0, 3, 5), np.linspace(0, height, 5), held=False)
    mesh = replace(mesh, held=boundary_nodes(mesh), skin=mesh.skin[:0])
    if kind == "distorted":
        return distort(mesh, 0.45, 2)
    if kind == "curved":
        nodes = mesh.nodes.copy()
        inner = np.setdiff1d(np.arange(len(nodes)), mesh.held)
        nodes[inner] += np.random.default_rng(4).uniform(-0.05, 0.05, (len(inner), 2))
        mesh = replace(mesh, nodes=nodes)
        quality(mesh)
    return mesh
