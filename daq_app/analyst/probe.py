"""The value of a field at a place in the finger, along its skin, and along a line."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from daq_app.analyst.frame import FieldChoice, Frame, Parts
from daq_app.wording import tr, tr_noop

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Line = tuple[tuple[float, float], tuple[float, float]]  # its ends [mm]

TISSUES = tr_noop(("epidermis", "dermis", "fat", "bone"))  # by the number of their region in the mesh
POINTS = 201  # along a line: finer than any element it crosses
OUTSIDE = -1e-9  # least share of a corner: what lies on a side is in both triangles, whatever round-off says [-]


def corners_at(frame: Frame, parts: Parts, points: Array) -> tuple[Indices, Array]:
    """Return the triangle that holds each of `points` (p, 2) [mm] and the share of each of its corners (p, 3).

    The triangle is -1, and the shares are nan, outside of the tissue.
    """
    triangle, out = np.full(len(points), -1), np.full((len(points), 3), np.nan)
    corners = frame.nodes[parts.triangles]  # (t, 3, 2)
    low, high = corners.min(axis=1), corners.max(axis=1)
    some = np.flatnonzero(((low <= points.max(axis=0)) & (high >= points.min(axis=0))).all(axis=1))
    boxed = (low[some] <= points[:, None]) & (points[:, None] <= high[some])
    point, near = np.nonzero(boxed.all(axis=2))
    a, b, c = np.moveaxis(corners[some[near]], 1, 0)
    place = points[point]
    with np.errstate(invalid="ignore", divide="ignore"):  # a triangle without an area holds no place
        area = _cross(b - a, c - a)
        shares = np.column_stack([_cross(b - place, c - place) / area, _cross(c - place, a - place) / area])
    shares = np.column_stack([shares, 1.0 - shares.sum(axis=1)])
    inside = shares.min(axis=1, initial=np.inf) >= OUTSIDE
    triangle[point[inside]], out[point[inside]] = some[near[inside]], shares[inside]
    return triangle, out


def value_at(frame: Frame, parts: Parts, field: FieldChoice, points: Array) -> tuple[Array, Indices]:
    """Return a field at `points` (p, 2) [mm], nan outside of the tissue, and the triangles that hold them (p,)."""
    triangle, shares = corners_at(frame, parts, points)
    if not len(parts.triangles):
        return np.full(len(points), np.nan), triangle
    return np.sum(field.of(frame)[parts.triangles[triangle]] * shares, axis=1), triangle


def probe_words(frame: Frame, parts: Parts, field: FieldChoice, x: float, y: float) -> str:
    """Return what is at a place [mm]: the field with its unit, where it is, and the tissue."""
    where = f"x {x:.3f} mm, y {y:.3f} mm".replace("-", "−")
    values, triangles = value_at(frame, parts, field, np.array([[x, y]]))
    triangle = int(triangles[0])
    if triangle < 0:
        return tr("{where} · no tissue", where=where)
    tissue = tr(TISSUES[int(parts.region[triangle])])
    return f"{field.words(float(values[0]))} · {where} · {tissue}"


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
    values, _ = value_at(frame, parts, field, ends[0] + part[:, None] * (ends[1] - ends[0]))
    return part * float(np.hypot(*(ends[1] - ends[0]))), values


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
