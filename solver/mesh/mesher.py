"""The finger's outline and its mesh: a half-O from the bone to the skin, fine along the skin that may touch.

A position is an arc position along the undeformed skin, from the point of first touch and positive towards the tip, and
a depth below the skin. In the world frame the surface is y = 0 with the finger above it, and first touch is the origin.
+x runs from proximal to distal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from math import ceil, cos, pi, radians, sin
from typing import Self

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.mesh import Fineness, Lines, Mesh, distinct, grid_mesh, with_middles
from solver.scene.tables import Finger, Receptor


@dataclass(frozen=True, slots=True)
class Outline:
    """Geometry of one finger's outline. Arc positions and depths are in mm and broadcast together."""

    finger: Finger
    palmar_cut: float  # arc position of the cut's palmar end
    palmar: float  # arc position where the palmar straight edge meets the tip's arc
    dorsal: float  # arc position where the tip's arc meets the dorsal straight edge
    dorsal_cut: float  # arc position of the cut's dorsal end
    touch: float  # angle of first touch on the tip's arc, finger frame [rad]

    @classmethod
    def of(cls, finger: Finger) -> Self:
        """Measure the outline of `finger`.

        >>> o = Outline.of(Finger())
        >>> round(o.palmar, 4), round(o.dorsal, 4)  # an eighth and three eighths of a circle of radius 5
        (-3.927, 11.781)
        """
        touch = radians(finger.contact_angle) - pi / 2
        palmar = finger.tip_radius * (-pi / 2 - touch)
        dorsal = finger.tip_radius * (pi / 2 - touch)
        return cls(finger, palmar - finger.shaft_length, palmar, dorsal, dorsal + finger.shaft_length, touch)

    @property
    def nail_end(self) -> float:
        """Arc position of the proximal end of the nail plate, which begins where the tip's arc ends [mm]."""
        return self.dorsal + self.finger.nail_length

    def angle(self, arc: Array) -> Array:
        """Return the angle on the tip's arc [rad]; on a straight edge, the angle of its end."""
        return np.asarray(self.touch + np.clip(arc, self.palmar, self.dorsal) / self.finger.tip_radius)

    def _course(self, arc: Array) -> tuple[Array, Array]:
        """Return the angle on the tip's arc [rad], and the distance back along a straight edge [mm], 0 on the arc."""
        angle = self.angle(arc)
        back = np.maximum(self.palmar - arc, 0.0) + np.maximum(arc - self.dorsal, 0.0)
        return angle, back

    def tissue(self, arc: Array, depth: Array) -> Array:
        """Return the points (..., 2) at `depth` below the skin at `arc`, along the skin's inward normal.

        >>> Outline.of(Finger()).tissue(np.array(0.0), np.array([0.0, 1.9])).round(12)
        array([[0. , 0. ],
               [0. , 1.9]])
        """
        angle, back = self._course(arc)
        radius = self.finger.tip_radius - depth
        return self.world(radius * np.cos(angle) - back, radius * np.sin(angle))

    def tangent(self, arc: Array) -> Array:
        """Return the unit vectors (..., 2) along the skin at `arc`, towards the tip, in the world frame.

        >>> Outline.of(Finger()).tangent(np.array([0.0, -20.0])).round(4)  # at first touch, and on the palmar side
        array([[ 1.    ,  0.    ],
               [ 0.7071, -0.7071]])
        """
        angle = self.angle(arc)
        return self._rotate(-np.sin(angle), np.cos(angle))

    def bone(self, arc: Array, part: Array | float = 1.0) -> Array:
        """Return the points (..., 2) of the bone's outline that the mesh pairs with `arc` on the skin.

        With `part`, return those at this fraction of the bone's radius.
        """
        angle, back = self._course(arc)
        (x, y), length = self.finger.bone_centre, self.finger.shaft_length
        r = self.finger.bone_radius * part
        return self.world(x + r * np.cos(angle) - back * (x + length) / length, y + r * np.sin(angle))

    def world(self, x: Array, y: Array) -> Array:
        """Return the points (..., 2) in the world frame for finger coordinates `x`, `y`."""
        return self._rotate(x, y) + np.array([0.0, self.finger.tip_radius])

    def _rotate(self, x: Array, y: Array) -> Array:
        """Return vectors (..., 2) of the finger frame in the world frame."""
        angle = radians(self.finger.contact_angle)
        return np.stack([x * cos(angle) + y * sin(angle), y * cos(angle) - x * sin(angle)], axis=-1)

    def along(self, arc: Array | float, depth: float, distance: Array | float) -> Array:
        """Return the arc positions at `distance` from `arc`, measured at `depth` below the skin.

        On the tip's arc, a length at depth 1.9 is 3.1/5 of the length on the skin above; on straight skin they are
        equal.

        >>> Outline.of(Finger()).along(0.0, 1.9, np.array([-0.5, 0.5])).round(4)
        array([-0.8065,  0.8065])
        """
        ratio = 1.0 - depth / self.finger.tip_radius
        skin = np.array([self.palmar_cut, self.palmar, self.dorsal, self.dorsal_cut])
        below = np.array([self.palmar - self.finger.shaft_length, self.palmar, 0.0, 0.0])
        below[2] = self.palmar + ratio * (self.dorsal - self.palmar)
        below[3] = below[2] + self.finger.shaft_length
        return np.asarray(np.interp(np.interp(arc, skin, below) + distance, below, skin))


EPIDERMIS, DERMIS, FAT, BONE = 0, 1, 2, 3  # numbers of the regions
CORE = 1.0 / 3.0  # radius of a meshed bone's driven core, relative to the bone's radius [-]
FOLD = (0.015, 0.1)  # element size at a fold: the smaller of these parts of the tip radius and of the epidermis
FINEST = 1e-3  # smallest element relative to the tip radius: round-off swamps thinner ones that cross the finger [-]


@dataclass(frozen=True, slots=True)
class ElementSizes:
    """Sizes of elements, relative to tip radius over fineness; chosen on random scenes at finite strain."""

    in_contact: float = 0.5  # along the skin that may touch
    palmar_growth: float = 1.0  # outside the contact: skin behind it is compressed, and may fold
    dorsal_growth: float = 1.9  # outside the contact, towards the tip
    aspect: float = 1.7  # across the skin at the surface, relative to the size along it
    bulk: float = 1.5  # across the tissue, at most
    at_bone: float = 0.45  # across the tissue at the bone, where fat is sheared most
    from_bone: float = 6.0  # growth from the bone, relative to the tip radius
    at_ending: float = 0.7  # across the tissue at the ending
    from_ending: float = 3.0  # growth from the ending, relative to the tip radius
    point_across: float = 0.02  # endings smaller across the skin, relative to the tip radius, count as points
    point_along: float = 0.1  # endings smaller along the skin, relative to the tip radius, count as points
    at_point: float = 0.1  # size of the element around a point
    from_point: float = 0.5  # growth from that element [-]
    growth: float = 0.2  # growth of elements at the surface with the depth below it [-]
    short_overlap: float = 0.56  # half overlaps shorter than this, relative to the tip radius, have smaller elements
    fold_elements: float = 4.0  # number of elements of the size `FOLD` to each side of a fold
    from_fold: float = 0.5  # growth from these elements [-]
    fold_aspect: float = 2.0 / 3.0  # across the skin at a fold, relative to the size along it
    held_distance: float = 0.1  # relative to the tip radius: skin closer to held skin is compressed without bound


_SIZES = ElementSizes()


@dataclass(frozen=True, slots=True)
class Sizing:
    """Element sizes of a mesh and where they apply."""

    fineness: Fineness
    indentation: float  # skin lower than this may touch [mm]
    shift: bool = False  # move the mesh along the skin by half an element
    margin: float = 1.0  # undeformed skin lower than (1 + margin/4) indentation may touch
    fold: float | None = None  # arc position of the largest compression, where a fold is to be resolved
    halved: bool = False  # whether every element is divided in four


@dataclass(frozen=True, eq=False)  # without slots, for a cached property
class FingerMesh:
    """The mesh of a finger, with its lines."""

    mesh: Mesh
    outline: Outline
    sizing: Sizing
    lines: Lines  # before elements are halved
    arcs: Array  # (a + 1,) arc positions of the lines between elements [mm]
    depths: Array  # (b + 1,) depths of the lines between the elements of the skin, outermost last; without the bone
    fat: int  # number of elements below the dermis, in the fat and in a meshed bone
    all_skin: Indices  # (2 a + 1,) nodes of the whole skin, including those that may not touch
    away_from_held: NDArray[np.bool_]  # (a,) elements along the skin that are not close to held skin

    @cached_property
    def skin_arcs(self) -> Array:
        """Arc positions (k,) of the nodes that may touch [mm]."""
        return with_middles(self.arcs)[np.searchsorted(self.all_skin, self.mesh.skin)]


def finger_mesh(finger: Finger, receptor: Receptor, sizing: Sizing) -> FingerMesh:
    """Return the mesh of `finger`: without a bone, whose surface is held, or with a meshed bone, whose core is held.

    Nodes of a driven cut and of a nail plate are held too. Lines between elements frame the reference ending, because
    averages over whole elements converge faster than over parts. Raises MeshError where the outline cannot be meshed.
    """
    outline = Outline.of(finger)
    base = lines = _lines(outline, receptor, replace(sizing, halved=False))
    if sizing.halved:
        lines = base.divide(np.full(len(base.arcs) - 1, 2), np.full(base.rows, 2))
    arcs, depths, fat = np.array(lines.arcs), np.array(lines.skin), np.array(lines.fat)
    every_arc = with_middles(arcs)
    core = outline.tissue(every_arc, depths[0])[:, None]
    bone = outline.bone(every_arc)[:, None]
    inner = bone + (core - bone) * with_middles(fat)[:-1, None]
    points = np.concatenate([inner, outline.tissue(every_arc[:, None], with_middles(depths)[None, :])], axis=1)
    skin = np.where(with_middles(depths)[1::2] > finger.epidermis, DERMIS, EPIDERMIS)
    below = lines.rows - len(skin)
    layers = np.concatenate([np.full(below, FAT), skin])
    if lines.bone:
        radii = with_middles(np.array(lines.bone))[:-1]
        points = np.concatenate([outline.bone(every_arc[:, None], radii), points], axis=1)
        layers[: len(radii) // 2] = BONE
    low, high = _contact_lines(outline, arcs, sizing)
    long, wide = points.shape[0], points.shape[1]
    number: Indices = np.arange(long * wide, dtype=np.int64).reshape(long, wide)
    held = [number[:, 0]]
    away_from_held = np.ones(len(arcs) - 1, bool)
    if finger.cut == "driven":
        held += [number[0], number[-1]]
        low, high = max(low, 1), min(high, len(arcs) - 2)
        away_from_held &= _clear_of_held(arcs, outline.palmar_cut, outline.palmar_cut, finger)
        away_from_held &= _clear_of_held(arcs, outline.dorsal_cut, outline.dorsal_cut, finger)
    if finger.nail_length > 0.0:
        nail = np.flatnonzero((every_arc >= outline.dorsal - 1e-9) & (every_arc <= outline.nail_end + 1e-9))
        held.append(number[nail, -1])
        high = min(high, int(nail[0]) // 2 - 1)
        away_from_held &= _clear_of_held(arcs, outline.dorsal, outline.nail_end, finger)
    mesh = grid_mesh(points, layers, slice(2 * low, 2 * high + 1), distinct(np.concatenate(held)))
    return FingerMesh(mesh, outline, sizing, base, arcs, depths, below, number[:, -1].copy(), away_from_held)


@lru_cache(maxsize=8)  # a mesh and its nested mesh share their lines
def _lines(outline: Outline, receptor: Receptor, sizing: Sizing) -> Lines:
    """Return the lines of a mesh before its elements are halved."""
    finger, fineness = outline.finger, sizing.fineness
    if isinstance(fineness, Lines):
        return fineness
    fine, size = _finest_size(outline, sizing.indentation, fineness), finger.tip_radius / fineness
    row = _Row.of(outline, fine, receptor, sizing, 1.0 / fineness)
    arcs = row.lines(row.gaps(), shift=sizing.shift)
    thin = np.inf if sizing.fold is None else _SIZES.fold_aspect * _fold_size(finger)
    skin, fat = _layers(finger, fine, size, receptor, thin)
    bone = np.empty(0)
    if finger.bone == "meshed":
        count = max(2, ceil((1.0 - CORE) * finger.bone_radius / (_SIZES.bulk * size)))
        bone = np.linspace(CORE, 1.0, count + 1)
    return Lines(*(tuple(part.tolist()) for part in (arcs, bone, fat, skin)))


def _clear_of_held(arcs: Array, start: float, stop: float, finger: Finger) -> NDArray[np.bool_]:
    """Return the elements (a,) between the lines at `arcs` that are apart from skin held between `start` and `stop`."""
    apart = _SIZES.held_distance * finger.tip_radius
    return (arcs[1:] < start - apart) | (arcs[:-1] > stop + apart)


def _fold_size(finger: Finger) -> float:
    """Return the size along the skin of elements at a fold [mm]."""
    return max(min(FOLD[0] * finger.tip_radius, FOLD[1] * finger.epidermis), 2.0 * FINEST * finger.tip_radius)


_DEPTH = distinct(np.concatenate([np.geomspace(1e-6, 1.0, 1000), np.linspace(0.0, 1.0, 1000)]))  # parts of the tissue
_SIDE = np.geomspace(1e-9, 1.0, 2001)  # parts of a side of the skin


@lru_cache(maxsize=8)
def _arcs_below(outline: Outline, height: float) -> tuple[float, float]:
    """Return the arc positions between which the undeformed skin is lower than `height` [mm]."""
    rises = [(end, outline.tissue(end * _SIDE, np.asarray(0.0))[:, 1]) for end in (outline.palmar_cut, outline.dorsal)]
    first, last = (float(end * np.interp(height, np.maximum.accumulate(rise), _SIDE)) for end, rise in rises)
    return first, last


def _contact_lines(outline: Outline, arcs: Array, sizing: Sizing) -> tuple[int, int]:
    """Return the indices in `arcs` of the first and last line between which the skin may touch."""
    first, last = _arcs_below(outline, sizing.indentation * (1.0 + 0.25 * sizing.margin))
    low = max(int(np.searchsorted(arcs, first)) - 1, 0)
    return low, min(int(np.searchsorted(arcs, last)), len(arcs) - 1)


def _finest_size(outline: Outline, indentation: float, fineness: float) -> float:
    """Return the size of the smallest elements along the skin [mm]."""
    low, high = _arcs_below(outline, indentation)
    radius = outline.finger.tip_radius
    overlap = min(1.0, (high - low) / 2.0 / (_SIZES.short_overlap * radius))
    return max(radius / fineness * _SIZES.in_contact * overlap, FINEST * radius)


def _cumulative_count(place: Array, size: Array) -> Array:
    """Return the number of elements before each position `place` (n,), for the element `size` (n,) there."""
    return np.concatenate([[0.0], np.cumsum((1.0 / size[1:] + 1.0 / size[:-1]) / 2.0 * np.diff(place))])


@dataclass(frozen=True, slots=True, eq=False)
class _Row:
    """A row of elements: the required number before each position, and the positions that need a line."""

    place: Array  # (n,)
    number: Array  # (n,) elements before it, fractions included
    ends: tuple[float, ...]
    least: tuple[int, ...]  # least number of elements between consecutive ends
    spare: float  # fraction of an element that is spread over the other elements

    @staticmethod
    def of(outline: Outline, fine: float, receptor: Receptor, sizing: Sizing, scale: float) -> "_Row":
        """Return the row along the skin: fine in the contact, and coarser with the distance from it.

        Lines always lie where straight edge and arc meet, because an element cannot follow a jump in curvature. They
        also lie at the ends of the nerve ending and of a nail plate.
        """
        low, high = _arcs_below(outline, sizing.indentation)
        away = np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 1000)])
        palmar, dorsal = low + (outline.palmar_cut - low) * away, high + (outline.dorsal_cut - high) * away
        arc = np.concatenate([palmar, np.linspace(low, high, 1000), dorsal])
        if sizing.fold is not None:
            near = sizing.fold + np.linspace(-1.0, 1.0, 2001) * outline.finger.tip_radius
            arc = np.concatenate([arc, near[(near > outline.palmar_cut) & (near < outline.dorsal_cut)]])
        arc = distinct(arc)
        sizes = fine + scale * (
            _SIZES.palmar_growth * np.maximum(low - arc, 0.0) + _SIZES.dorsal_growth * np.maximum(arc - high, 0.0)
        )
        if sizing.fold is not None:
            least = _fold_size(outline.finger)
            from_fold = np.maximum(np.abs(arc - sizing.fold) - _SIZES.fold_elements * least, 0.0)
            sizes = np.minimum(sizes, least + _SIZES.from_fold * from_fold)
        near, far = outline.along(0.0, receptor.depth, receptor.ending[1] * np.array([-0.5, 0.5])).tolist()
        if receptor.ending[1] < _SIZES.point_along * outline.finger.tip_radius:
            near, far, largest = _around_point(arc, near, far, _SIZES.at_point * outline.finger.tip_radius * scale)
            sizes = np.minimum(sizes, largest)
        ends = [outline.palmar_cut, outline.palmar, outline.dorsal, outline.dorsal_cut]
        if outline.finger.nail_length > 0.0:
            ends.append(outline.nail_end)
        ends = _framed(ends, (near, far), outline.finger)
        least = tuple(2 if end in (outline.palmar_cut, outline.dorsal) else 1 for end in ends[:-1])
        return _Row(arc, _cumulative_count(arc, sizes), ends, least, 0.2)

    def gaps(self) -> tuple[int, ...]:
        """Return the number of elements between consecutive ends."""
        numbers = np.diff(np.interp(self.ends, self.place, self.number)).tolist()
        return tuple(max(low, ceil(n - self.spare)) for low, n in zip(self.least, numbers, strict=True))

    def lines(self, gaps: Sequence[int], *, shift: bool = False) -> Array:
        """Return the lines for `gaps` elements between consecutive ends; `shift` moves them by half an element."""
        out: list[Array] = []
        numbers = np.interp(self.ends, self.place, self.number)
        for (first, last), (start, stop), count in zip(pairwise(numbers), pairwise(self.ends), gaps, strict=True):
            steps = np.arange(count + 1.0)
            if shift:  # except the ends
                steps = np.concatenate([[0.0], steps[:-1] + 0.5, [float(count)]])
            lines = np.interp(first + (last - first) * steps / count, self.number, self.place)
            lines[0], lines[-1] = start, stop
            out.append(lines if not out else lines[1:])
        return np.concatenate(out)


def _layers(finger: Finger, fine: float, size: float, receptor: Receptor, thin: float) -> tuple[Array, Array]:
    """Return the depths of the lines in the skin, from the fat outwards, and heights of those in the fat.

    Heights run from 0 at the bone to 1. Elements at the surface are no taller than `thin` [mm].
    """
    skin = finger.epidermis + finger.dermis
    thick = finger.pulp_thickness() - skin
    depth = _DEPTH * (skin + thick)
    of_bone = _SIZES.at_bone + _SIZES.from_bone * (skin + thick - depth) / finger.tip_radius
    of_ending = _SIZES.at_ending + _SIZES.from_ending * np.abs(depth - receptor.depth) / finger.tip_radius
    sizes = np.minimum(
        size * np.minimum(_SIZES.bulk, np.minimum(of_bone, of_ending)), _SIZES.aspect * (fine + _SIZES.growth * depth)
    )
    sizes = np.minimum(sizes, thin + _SIZES.from_fold * depth)
    near, far = receptor.depth - receptor.ending[0] / 2.0, receptor.depth + receptor.ending[0] / 2.0
    if receptor.ending[0] < _SIZES.point_across * finger.tip_radius:
        top, bottom = (0.0, finger.epidermis) if receptor.depth < finger.epidermis else (finger.epidermis, skin)
        above, below, largest = _around_point(depth, near, far, _SIZES.at_point * size)
        near, far = min(near, max(above, top)), max(far, min(below, bottom))
        sizes = np.minimum(sizes, largest)
    ends = _framed([0.0, finger.epidermis, skin, skin + thick], (near, far), finger)
    # a single element of any size between epidermis and ending is too stiff in shear
    least = [2 if end < near <= next_end and end > 0.0 else 1 for end, next_end in pairwise(ends[:-1])]
    row = _Row(depth, _cumulative_count(depth, sizes), ends, (*least, 2), 0.1)
    gaps = row.gaps()
    every = row.lines(gaps)
    lines, fat = every[: -gaps[-1]], every[-gaps[-1] - 1 :]
    return lines[::-1].copy(), (1.0 - (fat - skin) / thick)[::-1].copy()


def _around_point(place: Array, near: float, far: float, size: float) -> tuple[float, float, Array]:
    """Return the lines that frame an ending between `near` and `far`, and the largest element sizes (n,) [mm].

    Averages over whole elements smooth their errors. A point-like ending has no such average: it lies in the middle of
    an element of `size`, where strains are more accurate than at its ends. Elements grow from there.
    """
    middle, size = (near + far) / 2.0, max(far - near, size)
    largest = size + _SIZES.from_point * np.maximum(np.abs(place - middle) - size / 2.0, 0.0)
    return middle - size / 2.0, middle + size / 2.0, largest


def _framed(ends: Sequence[float], frame: Sequence[float], finger: Finger) -> tuple[float, ...]:
    """Return the `ends` in order, with those positions of the `frame` that leave room for an element between them."""
    out = list(ends)
    for place in frame:
        if min(abs(place - end) for end in out) > FINEST * finger.tip_radius:
            out.append(place)
    return tuple(sorted(out))
