"""The published finger at finite strain, ready to be pressed and slid, for the tests of the finite-strain files."""

from functools import cache

import numpy as np

from solver import Finger, Friction, Loading, Materials, Receptor, Scene, Solve
from solver.body.finite import FiniteBody, FinitePatches
from solver.body.receptor import endings
from solver.constitutive import NeoHooke
from solver.equilibrium import Newton
from solver.equilibrium.finger import FiniteFinger
from solver.mesh import Mesh
from solver.mesh.mesher import Sizing, finger_mesh


@cache
def finger(fineness, indentation=2.0, margin=2.0, nu=0.48):
    """Return Newton on the finger's body, the reference ending's probes, and the nodes of the whole skin."""
    made = finger_mesh(Finger(), Receptor(), Sizing(fineness, indentation, margin=margin))
    tissues = Materials()
    moduli = [tissue.E for tissue in (tissues.epidermis, tissues.dermis, tissues.fat)]
    body = FiniteBody.of(made.mesh, [NeoHooke(E, nu) for E in moduli])
    probes = FinitePatches(body, endings(made, body.centre, Receptor(), np.zeros(1)))
    return Newton(body.condensed), probes, made.whole


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
    long, wide = points.shape[:2]
    number = np.arange(long * wide).reshape(long, wide)
    i, j = np.meshgrid(np.arange(0, long - 1, 2), np.arange(0, wide - 1, 2), indexing="ij")
    along, down = np.array([0, 2, 2, 0, 1, 2, 1, 0, 1]), np.array([2, 2, 0, 0, 2, 1, 0, 1, 1])
    elements = number[i.ravel()[:, None] + along, j.ravel()[:, None] + down]
    holding = {
        "top": number[:, 0],
        "sides and top": np.unique(np.concatenate([number[0], number[-1], number[:, 0]])),
    }
    return Mesh(points.reshape(-1, 2), elements, np.zeros(len(elements), np.int64), number[:, -1].copy(), holding[held])
