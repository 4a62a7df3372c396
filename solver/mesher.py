"""The finger's mesh: a half-O from the bone to the skin, fine along the skin where it may touch."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil

import numpy as np

from solver.grid import grid_mesh
from solver.mesh import Array, Indices, Mesh
from solver.outline import Outline
from solver.scene import Finger, Receptor

EPIDERMIS, DERMIS, FAT, BONE = 0, 1, 2, 3  # numbers of the regions
CORE = 1.0 / 3.0  # radius of a meshed bone's core, which is driven, by the bone's [-]
# Sizes of elements, by tip radius over fineness; chosen on random scenes at finite strain (docs/solver.md)
ANYWHERE = 0.5  # along the skin that may touch, where the edges of contact are not known
EDGE = 0.85  # along the skin at the edges of contact, where they are known
MIDDLE = 1.7  # along the skin, in the middle of a contact whose edges are known
TOWARDS = 2.85  # growth from edge to middle, by tip radius
AWAY = (1.0, 1.9)  # growth outside the contact, palmar and dorsal: skin behind a contact is squeezed, and may fold
TALL = 1.7  # across the skin at the surface, by that along it
BULK = 1.5  # across the tissue, at most
AT_BONE, FROM_BONE = 0.45, 6.0  # across at the bone, where fat is sheared most; growth from there, by tip radius
ENDING, FROM_ENDING = 0.7, 3.0  # the same for the ending
GROWTH = 0.2  # of elements smaller than that, at the surface, with the depth below it [-]
SHORT = (0.56, 0.4)  # half contacts shorter than that, by tip radius, have smaller elements: overlaps, known contacts
NEAR = 0.15  # a line nearer to another, by the element's size, is left out
FINEST = 1e-3  # smallest element by tip radius: thinner ones across the whole finger would drown in round-off [-]


@dataclass(frozen=True, slots=True)
class Sizing:
    """How fine the mesh is, and where."""

    fineness: float  # elements to a tip radius
    indentation: float  # the skin that lies lower than this may touch [mm]
    shift: bool = False  # move the mesh along the skin by half an element
    margin: float = 1.0  # contact is looked for where undeformed skin lies lower than (1 + margin/4) indentation
    edges: tuple[float, float] | None = None  # arc positions where contact ends, where they are known: lines lie there


@dataclass(frozen=True, slots=True, eq=False)
class FingerMesh:
    """The mesh of a finger, with the lines it was made of."""

    mesh: Mesh
    outline: Outline
    arcs: Array  # (a + 1,) arc positions of the lines between elements [mm]
    depths: Array  # (b + 1,) depths of the lines between the elements of the skin, outermost last; bone not included
    fat: int  # elements below the dermis: of the fat, and of the bone where it is meshed
    whole: Indices  # (2 a + 1,) nodes of all the skin, those that may touch and those that may not


def finger_mesh(finger: Finger, receptor: Receptor, sizing: Sizing) -> FingerMesh:
    """Return the mesh of `finger`, its bone left out and its bone's surface held, or the core of a meshed bone.

    Where the cut is driven with the bone, and where a nail plate is fixed to it, the nodes there are held too.
    Lines between elements frame the reference ending: averages over whole elements converge faster than over parts.
    Raises MeshError where the outline cannot be meshed.
    """
    outline = Outline.of(finger)
    contact = sizing.edges or _lower_than(outline, sizing.indentation)
    size = finger.tip_radius / sizing.fineness
    half = (contact[1] - contact[0]) / 2.0
    along, short = (ANYWHERE, SHORT[0]) if sizing.edges is None else (EDGE, SHORT[1])
    fine = max(size * along * min(1.0, half / (short * finger.tip_radius)), FINEST * finger.tip_radius)
    arcs = _stations(outline, contact, fine, size, receptor, sizing)
    lines, fat = _layers(finger, fine, size, receptor)
    every_arc = with_middles(arcs)
    depths = with_middles(lines)
    core = outline.tissue(every_arc, np.asarray(lines[0]))[:, None]
    bone = outline.bone(every_arc)[:, None]
    inner = bone + (core - bone) * with_middles(fat)[:-1, None]
    points = np.concatenate([inner, outline.tissue(every_arc[:, None], depths[None, :])], axis=1)
    skin = np.where(_middles(lines) > finger.epidermis, DERMIS, EPIDERMIS)
    layers = np.concatenate([np.full(len(fat) - 1, FAT), skin])
    below = len(fat) - 1
    if finger.bone == "meshed":
        parts = np.linspace(CORE, 1.0, 2 * max(2, ceil((1.0 - CORE) * finger.bone_radius / (BULK * size))) + 1)[:-1]
        points = np.concatenate([outline.bone(every_arc[:, None], parts), points], axis=1)
        layers = np.concatenate([np.full(len(parts) // 2, BONE), layers])
        below += len(parts) // 2
    touching = _lower_than(outline, sizing.indentation * (1.0 + 0.25 * sizing.margin))
    low = max(int(np.searchsorted(arcs, touching[0])) - 1, 0)
    high = min(int(np.searchsorted(arcs, touching[1])), len(arcs) - 1)
    long, wide = points.shape[0], points.shape[1]
    number: Indices = np.arange(long * wide, dtype=np.int64).reshape(long, wide)
    held = [number[:, 0]]
    if finger.cut == "driven":
        held += [number[0], number[-1]]
        low, high = max(low, 1), min(high, len(arcs) - 2)
    if finger.nail_length > 0.0:
        nail = np.flatnonzero((every_arc >= outline.dorsal - 1e-9) & (every_arc <= outline.nail_end + 1e-9))
        held.append(number[nail, -1])
        high = min(high, int(nail[0]) // 2 - 1)
    mesh = grid_mesh(points, layers, slice(2 * low, 2 * high + 1), np.unique(np.concatenate(held)))
    return FingerMesh(mesh, outline, arcs, lines, below, number[:, -1].copy())


def _lower_than(outline: Outline, height: float) -> tuple[float, float]:
    """Return the arc positions between which the undeformed skin lies lower than `height` [mm]."""
    side = np.geomspace(1e-9, 1.0, 2001)
    ends: list[float] = []
    for end in (outline.palmar_cut, outline.dorsal):
        rise = outline.tissue(end * side, np.asarray(0.0))[:, 1]
        ends.append(float(end * np.interp(height, np.maximum.accumulate(rise), side)))
    return ends[0], ends[1]


def _middles(lines: Array) -> Array:
    return (lines[1:] + lines[:-1]) / 2.0


def with_middles(lines: Array) -> Array:
    """Return the lines with one more in the middle of each gap."""
    out = np.empty(2 * len(lines) - 1)
    out[::2], out[1::2] = lines, _middles(lines)
    return out


def _spaced(
    place: Array, size: Array, ends: tuple[float, ...], least: tuple[int, ...], spare: float, *, shift: bool
) -> list[Array]:
    """Return lines between each two of `ends`, spaced as `size` at `place` asks, at least so many gaps in each.

    The last `spare` part of a gap is spread over the others. With `shift` they lie half a gap further, save the ends.
    """
    number = np.concatenate([[0.0], np.cumsum((1.0 / size[1:] + 1.0 / size[:-1]) / 2.0 * np.diff(place))])
    out: list[Array] = []
    for start, stop, few in zip(ends[:-1], ends[1:], least, strict=True):
        first, last = np.interp([start, stop], place, number)
        count = max(few, ceil(last - first - spare))
        steps = np.arange(count + 1.0)
        if shift:
            steps = np.concatenate([[0.0], steps[:-1] + 0.5, [float(count)]])
        lines = np.interp(first + (last - first) * steps / count, number, place)
        lines[0], lines[-1] = start, stop
        out.append(lines)
    return out


def _layers(finger: Finger, fine: float, size: float, receptor: Receptor) -> tuple[Array, Array]:
    """Return the depths of the lines in the skin, from the fat outwards, and those in the fat from 0 (bone) to 1."""
    skin = finger.epidermis + finger.dermis
    thick = finger.pulp_thickness() - skin
    depth = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 1000)]) * (skin + thick)
    depth = np.union1d(depth, np.linspace(0.0, skin + thick, 1000))
    of_bone = AT_BONE + FROM_BONE * (skin + thick - depth) / finger.tip_radius
    of_ending = ENDING + FROM_ENDING * np.abs(depth - receptor.depth) / finger.tip_radius
    asked = np.minimum(size * np.minimum(BULK, np.minimum(of_bone, of_ending)), TALL * (fine + GROWTH * depth))
    half = receptor.ending[0] / 2.0
    ends = _distinct(0.0, finger.epidermis, skin, skin + thick, receptor.depth - half, receptor.depth + half)
    # one element between epidermis and ending would be too stiff in shear whatever its size
    least = [2 if end < receptor.depth - half <= after and end > 0.0 else 1 for end, after in pairwise(ends[:-1])]
    *inside, fat = _spaced(depth, asked, ends, (*least, 2), 0.1, shift=False)
    lines = np.concatenate([inside[0], *(lines[1:] for lines in inside[1:])])
    return lines[::-1].copy(), (1.0 - (fat - skin) / thick)[::-1].copy()


def _distinct(*ends: float) -> tuple[float, ...]:
    """Return the ends in order, leaving out those that repeat another to a thousandth of a millimetre."""
    ordered = sorted(ends)
    return (ordered[0], *(b for a, b in pairwise(ordered) if b - a > 1e-3))


def _stations(
    outline: Outline, contact: tuple[float, float], fine: float, size: float, receptor: Receptor, sizing: Sizing
) -> Array:
    """Return the arc positions of the lines across the mesh: fine in the contact, coarser with the distance from it.

    Lines always lie where straight edge and arc meet, since an element cannot follow a jump in curvature, at the ends
    of the ending and of a nail plate, and where contact is known to end, since no element can follow a skin half of
    which touches.
    """
    low, high = contact
    scale = size / outline.finger.tip_radius
    away = np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 1000)])
    palmar, dorsal = low + (outline.palmar_cut - low) * away, high + (outline.dorsal_cut - high) * away
    arc = np.unique(np.concatenate([palmar, np.linspace(low, high, 1000), dorsal]))
    asked = fine + scale * (AWAY[0] * np.maximum(low - arc, 0.0) + AWAY[1] * np.maximum(arc - high, 0.0))
    if sizing.edges is not None:
        inside = np.maximum(np.minimum(arc - low, high - arc), 0.0)
        asked += np.minimum(scale * TOWARDS * inside, (MIDDLE / EDGE - 1.0) * fine)
    half = receptor.ending[1] / 2.0
    frame = outline.along(0.0, receptor.depth, np.array([-half, half])).tolist()
    ends = [outline.palmar_cut, outline.palmar, *frame, outline.dorsal, outline.dorsal_cut]
    if outline.finger.nail_length > 0.0:
        ends.append(outline.nail_end)
    ends = _distinct(*ends)
    if sizing.edges is not None:
        apart = [e for e in sizing.edges if min(abs(e - end) for end in ends) > NEAR * fine]
        ends = tuple(sorted((*ends, *apart)))
    least = [2 if end in (outline.palmar_cut, outline.dorsal) else 1 for end in ends[:-1]]
    lines = _spaced(arc, asked, ends, tuple(least), 0.2, shift=sizing.shift)
    return np.concatenate([lines[0], *(more[1:] for more in lines[1:])])
