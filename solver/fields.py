"""A prediction as a picture: the deformed finger in triangles with the SED at their corners, and its outlines."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from solver.elements import Q2P1
from solver.mesh import Array, Indices, Mesh
from solver.outline import Outline
from solver.prediction import Prediction
from solver.receptor import Endings
from solver.stiffness import Elastic, Probes, local_coordinates
from solver.tissues import finite_laws, settled_moduli

# Eight triangles of each element, in its nine nodes
_SPLIT = np.array([[8, 0, 4], [8, 4, 1], [8, 1, 5], [8, 5, 2], [8, 2, 6], [8, 6, 3], [8, 3, 7], [8, 7, 0]])


@dataclass(frozen=True, slots=True, eq=False)
class Fields:
    """What is drawn, in the world: the surface is y = 0, the finger above it, pressed and dragged."""

    nodes: Array  # (n, 2) deformed positions [mm]; a node between layers is there once for each
    triangles: Indices  # (t, 3)
    sed: Array  # (n,) SED, averaged over the elements of one layer that meet at the node [MPa]
    outlines: Mapping[str, Array]  # "skin", "epidermis", "dermis", "bone": (m, 2) deformed lines [mm]
    patch: Array  # (m, 2) outline of the reference ending, deformed [mm]


def fields_of(prediction: Prediction) -> Fields:
    """Return the picture of `prediction`."""
    mesh, scene = prediction.mesh, prediction.scene
    count = len(mesh.elements)
    sed = _energies(prediction)
    # one node for each pair of node and layer
    pairs = mesh.elements + len(mesh.nodes) * mesh.region[:, None]
    kept, place = np.unique(pairs, return_inverse=True)
    place = place.reshape(count, 9)
    mean = np.bincount(place.ravel(), sed) / np.bincount(place.ravel())
    lowered = mesh.nodes + prediction.displacement - [0.0, prediction.indentation]
    outline = Outline.of(scene.finger)
    arcs = np.linspace(outline.palmar_cut, outline.dorsal_cut, 241)
    depths = {"skin": 0.0, "epidermis": scene.finger.epidermis, "dermis": scene.finger.epidermis + scene.finger.dermis}
    lines = {name: outline.tissue(arcs, np.asarray(depth)) for name, depth in depths.items()}
    drawn = {name: _moved(prediction, lowered, line) for name, line in lines.items()}
    return Fields(
        nodes=lowered[kept % len(mesh.nodes)],
        triangles=place[:, _SPLIT].reshape(-1, 3),
        sed=mean,
        outlines=drawn | {"bone": outline.bone(arcs) - [0.0, prediction.indentation]},
        patch=_moved(prediction, lowered, _patch(outline, prediction)),
    )


def _energies(prediction: Prediction) -> Array:
    """Return the SED at the nodes of every element, one element after the other (9 e,) [MPa]."""
    mesh, scene = prediction.mesh, prediction.scene
    elastic = Elastic.of(mesh, settled_moduli(scene.materials))
    count = len(mesh.elements)
    probes = Probes.at(mesh, elastic, np.repeat(np.arange(count), 9), np.tile(Q2P1.positions, (count, 1)))
    if scene.solve.kinematics == "small":
        return probes.energy(mesh, elastic, prediction.displacement[:, :, None])[:, 0]
    # Imported here: a picture at small strain need not wait for the compiled loops to be loaded.
    from solver.finite_body import FiniteBody, FiniteProbes

    body = FiniteBody.of(mesh, finite_laws(scene.materials))
    places = Endings(probes, np.ones(9 * count), np.arange(9 * count), 9 * count)
    return FiniteProbes.of(body, places).energy(body, prediction.displacement)


def _patch(outline: Outline, prediction: Prediction) -> Array:
    """Return the undeformed outline of the reference ending (m, 2) [mm]."""
    receptor = prediction.scene.receptor
    across, along = receptor.ending
    arc = outline.along(0.0, receptor.depth, np.linspace(-along / 2, along / 2, 11))
    near, far = (outline.tissue(arc, np.asarray(receptor.depth + side * across / 2)) for side in (-1, 1))
    return np.concatenate([near, far[::-1], near[:1]])


def _moved(prediction: Prediction, lowered: Array, points: Array) -> Array:
    """Return where undeformed `points` (m, 2) are after deformation."""
    mesh = prediction.mesh
    element = _holding(mesh, points)
    corners = mesh.nodes[mesh.elements[element]]
    local = local_coordinates(corners, points, np.zeros(points.shape))
    return (Q2P1.shape(local)[0][:, None] @ lowered[mesh.elements[element]])[:, 0]


def _holding(mesh: Mesh, points: Array) -> Indices:
    """Return the element (m,) that holds each point, or the one nearest to holding it."""
    centres = mesh.nodes[mesh.elements[:, 8]]
    near = np.argsort(np.sum((points[:, None] - centres) ** 2, axis=2), axis=1)[:, :12]
    tried = near.ravel()
    corners = mesh.nodes[mesh.elements[tried]]
    local = local_coordinates(corners, np.repeat(points, near.shape[1], axis=0), np.zeros((len(tried), 2)))
    outside = np.abs(local).max(axis=1).reshape(near.shape)
    return near[np.arange(len(points)), np.argmin(np.where(np.isfinite(outside), outside, np.inf), axis=1)]
