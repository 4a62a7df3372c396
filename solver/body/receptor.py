"""Quadrature over the receptor endings in a mesh: probes and weights."""

from dataclasses import fields

import numpy as np

from solver.arrays import Array, Indices
from solver.body import Endings, Probes
from solver.mesh import GAUSS_3, distinct
from solver.mesh.mesher import FingerMesh
from solver.scene.tables import Receptor

_POINTS, _WEIGHTS = GAUSS_3
_ASIDE = 2e-8  # distance of probes on both sides of a line between elements, relative to the tip radius


def endings(finger: FingerMesh, centre: Array, receptor: Receptor, arcs: Array) -> Endings:
    """Return endings of `receptor` at positions `arcs` (r,) [mm], with Gauss points in each piece of an element.

    An ending extends by half its length to both sides, measured along its middle line.
    """
    across, along = receptor.ending
    outline = finger.outline
    near, far = receptor.depth - across / 2, receptor.depth + across / 2
    depth_lines = distinct(np.concatenate([[near, far], np.clip(finger.depths, near, far)]))
    low, high = (outline.along(arcs, receptor.depth, side * along / 2) for side in (-1.0, 1.0))
    reaches = (outline.palmar_cut + 1e-9 < low) & (high < outline.dorsal_cut - 1e-9)
    start, stop = np.maximum(low[:, None], finger.arcs[:-1]), np.minimum(high[:, None], finger.arcs[1:])
    patch, piece = np.nonzero((start < stop) & reaches[:, None])
    arc, arc_weight = _gauss(start[patch, piece], stop[patch, piece])
    depth, depth_weight = _gauss(depth_lines[:-1], depth_lines[1:])
    curved = (arc > outline.palmar) & (arc < outline.dorsal)  # beneath the tip's arc, lengths shrink with depth
    shrinkage = np.where(curved[:, None], 1.0 - depth / outline.finger.tip_radius, 1.0)
    area = (arc_weight[:, None] * depth_weight * shrinkage).ravel()
    patch = np.repeat(patch, len(_POINTS) * len(depth))
    tangent = np.repeat(outline.tangent(arc), len(depth), axis=0)
    return Endings(_probes(finger, centre, arc, depth), area, patch, len(arcs), tangent)


def middle(finger: FingerMesh, centre: Array, receptor: Receptor) -> Endings:
    """Return the midpoint of the reference ending, as the mean of the limits from the elements around it."""
    aside = _ASIDE * finger.outline.finger.tip_radius * np.array([-1.0, 1.0])
    probes, tangent = _probes(finger, centre, aside, receptor.depth + aside), finger.outline.tangent(aside)
    return Endings(probes, np.full(4, 0.25), np.zeros(4, np.int64), 1, np.repeat(tangent, 2, axis=0))


def join(first: Endings, second: Endings) -> Endings:
    """Return the endings of `first`, then those of `second`."""
    probes = (np.concatenate([getattr(e.probes, f.name) for e in (first, second)]) for f in fields(Probes))
    weights, tangent = np.concatenate([first.weights, second.weights]), np.concatenate([first.tangent, second.tangent])
    patch = np.concatenate([first.patch, first.count + second.patch])
    return Endings(Probes(*probes), weights, patch, first.count + second.count, tangent)


def _gauss(start: Array, stop: Array) -> tuple[Array, Array]:
    """Return the Gauss points and weights (3 n,) of the intervals between `start` and `stop` (n,)."""
    half = (stop - start)[:, None] / 2.0
    return (start[:, None] + half * (1.0 + _POINTS)).ravel(), (half * _WEIGHTS).ravel()


def _probes(finger: FingerMesh, centre: Array, arc: Array, depth: Array) -> Probes:
    """Return probes (n m,) at every `depth` (m,) below each of the `arc` positions (n,) in turn [mm]."""
    station = np.searchsorted(finger.arcs[1:-1], arc)
    layer = np.searchsorted(-finger.depths[1:-1], -depth)
    element = station[:, None] * (finger.fat + len(finger.depths) - 1) + finger.fat + layer
    side, reach = _along_side(finger, arc, station)
    radius = finger.outline.finger.tip_radius
    deep = np.where(reach[:, None] == 1.0, depth, radius - (radius - depth) / reach[:, None])
    out = (finger.depths[layer] - deep) / (finger.depths[layer] - finger.depths[layer + 1]) * 2.0 - 1.0
    local = np.stack([out.ravel(), np.repeat(side, len(depth))], axis=1)
    return Probes.at(finger.mesh, centre, element.ravel(), local)


def _along_side(finger: FingerMesh, arc: Array, station: Indices) -> tuple[Array, Array]:
    """Return the local coordinates (n,) of `arc` positions, and the radius of the mapped arc relative to the true one.

    The sides of an element lie along normals of the skin. Between them the isoparametric map replaces the skin's arc by
    a parabola a little deeper than the arc: E(s) = (1 - s^2 (1 - cos a)) e_m + s sin a e_t at unit radius. Here a is
    half its angle, and e_m, e_t are radial and tangential at its middle. The ratio is 1 where the skin is straight.
    """
    start, stop = finger.arcs[station], finger.arcs[station + 1]
    angles, first, last = (finger.outline.angle(place) for place in (arc, start, stop))
    half, angle = (last - first) / 2.0, angles - (first + last) / 2.0
    sine, rise = np.sin(half), 1.0 - np.cos(half)
    slope = np.tan(angle)
    straight = half == 0.0
    along = (2.0 * arc - start - stop) / (stop - start)
    side = np.where(
        straight, along, 2.0 * slope / np.where(straight, 1.0, sine + np.sqrt(sine**2 + 4.0 * slope**2 * rise))
    )
    return side, np.where(straight, 1.0, np.cos(angle) * (1.0 - side**2 * rise) + np.sin(angle) * side * sine)
