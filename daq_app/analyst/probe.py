"""The value of a field at a place in the finger, along its skin, and along a line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq_app.analyst.field_list import FieldChoice
from daq_app.analyst.frame import Frame, Parts

Array = NDArray[np.float64]
Line = tuple[tuple[float, float], tuple[float, float]]  # its ends [mm]

TISSUES = ("epidermis", "dermis", "fat", "bone")  # by the number of their region in the mesh
POINTS = 201  # along a line: finer than any element it crosses
OUTSIDE = -1e-9  # least share of a corner: what lies on a side is in both triangles, whatever round-off says [-]


@dataclass(frozen=True, slots=True)
class Corners:
    """The triangle that holds a place."""

    triangle: int
    nodes: tuple[int, int, int]
    shares: tuple[float, float, float]  # of each corner; their sum is one


def corners_at(frame: Frame, parts: Parts, x: float, y: float) -> Corners | None:
    """Return the triangle that holds a place [mm], or None outside of the tissue."""
    if not len(parts.triangles):
        return None
    points = frame.nodes[parts.triangles]  # (t, 3, 2)
    low, high = points.min(axis=1), points.max(axis=1)
    near = np.flatnonzero((low[:, 0] <= x) & (x <= high[:, 0]) & (low[:, 1] <= y) & (y <= high[:, 1]))
    a, b, c = np.moveaxis(points[near], 1, 0)
    area = _cross(b - a, c - a)
    place = np.array([x, y])
    with np.errstate(invalid="ignore", divide="ignore"):  # a triangle without an area holds no place
        shares = np.column_stack([_cross(b - place, c - place), _cross(c - place, a - place)]) / area[:, None]
    shares = np.column_stack([shares, 1.0 - shares.sum(axis=1)])
    inside = np.flatnonzero(shares.min(axis=1) >= OUTSIDE)
    if not len(inside):
        return None
    triangle = int(near[inside[0]])
    nodes, parts_of = parts.triangles[triangle].tolist(), shares[inside[0]].tolist()
    return Corners(triangle, (nodes[0], nodes[1], nodes[2]), (parts_of[0], parts_of[1], parts_of[2]))


def probe_words(frame: Frame, parts: Parts, field: FieldChoice, x: float, y: float) -> str:
    """Return what is at a place [mm]: the field with its unit, where it is, and the tissue."""
    where = f"x {x:.3f} mm, y {y:.3f} mm".replace("-", "−")
    at = corners_at(frame, parts, x, y)
    if at is None:
        return f"{where} · no tissue"
    value = float(np.dot(field.of(frame)[list(at.nodes)], at.shares))
    tissue = TISSUES[int(parts.region[at.triangle])] if at.triangle < len(parts.region) else "tissue"
    return f"{field.words(value)} · {where} · {tissue}"


def along_skin(frame: Frame, parts: Parts, field: FieldChoice) -> tuple[Array, Array]:
    """Return the place on the skin at rest (m,) [mm], 0 over the receptor, and the field on the skin there (m,)."""
    skin = parts.skin
    if skin is None:
        return np.empty(0), np.empty(0)
    return skin.arc, np.sum(skin.shape * field.of(frame)[skin.nodes], axis=1)


def along_line(frame: Frame, parts: Parts, field: FieldChoice, line: Line) -> tuple[Array, Array]:
    """Return the distance from the first end (m,) [mm] and the field there (m,); nan where there is no tissue."""
    ends = np.array(line)
    part = np.linspace(0.0, 1.0, POINTS)
    values, out = field.of(frame), np.full(POINTS, np.nan)
    for i, (x, y) in enumerate((ends[0] + part[:, None] * (ends[1] - ends[0])).tolist()):
        at = corners_at(frame, parts, x, y)
        if at is not None:
            out[i] = np.dot(values[list(at.nodes)], at.shares)
    return part * float(np.hypot(*(ends[1] - ends[0]))), out


def read_out(unit: str, across: Array, at: float, curves: Sequence[tuple[str, str, Array]]) -> str:
    """Return the sample of `across` (m,) nearest to `at`, and the name, value and unit of each curve (m,) there.

    It is empty beyond the curves' ends. A value that is not known is a dash.

    >>> curves = [("N", "N", np.array([0.0, 1.5, 3.0])), ("µ", "", np.full(3, np.nan))]
    >>> read_out("s", np.array([0.0, 0.1, 0.2]), 0.12, curves)
    '0.100 s · N 1.5 N · µ –'
    """
    if not len(across) or not across[0] <= at <= across[-1]:
        return ""
    near = int(np.argmin(np.abs(across - at)))
    parts = [f"{across[near]:.3f} {unit}"]
    for name, of, values in curves:
        value = f"{values[near]:.4g} {of}" if np.isfinite(values[near]) else "–"
        parts.append(f"{name} {value}".strip())
    return " · ".join(parts).replace("-", "−")


def _cross(one: Array, other: Array) -> Array:
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
