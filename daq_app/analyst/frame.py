"""One state of the model's finger: its arrays and fields, its place in a picture, and values at points and lines."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from daq_app.wording import step_above, tr, tr_noop
from drivers.arrays import Array, Indices
from solver.prediction import Skin, SkinLine
from solver.quantities import FIELDS

Phase = Literal["pressing", "sticking", "slipping in part", "sliding"]

_TOP = 0.97  # share of the corners' values below the end of the colour scale
_STEPS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
Box = tuple[float, float, float, float]  # left, right, below, above [mm]
Range = tuple[float, float]
FIELD_ERRORS = tr_noop(
    "Fields, at every place: no estimate of the mesh's or the model's error. The SED over the finger has both."
)
_UNITS = {"MPa": ("kPa", 1000.0)}  # the unit shown, and the factor
Line = tuple[tuple[float, float], tuple[float, float]]  # its ends [mm]

_TISSUES = tr_noop(("epidermis", "dermis", "fat", "bone"))  # by the number of their region in the mesh
_POINTS = 201  # along a line: finer than any element it crosses
OUTSIDE = -1e-9  # least share of a corner: round-off must not exclude a point on a side [-]


@dataclass(frozen=True, slots=True, eq=False)
class FrameMesh:
    """Connectivity of the nodes of a frame."""

    triangles: Indices  # (t, 3)
    elements: Indices  # (e, 8) along the sides of each element of the mesh
    region: Indices  # (t,) number of the material of each triangle
    skin: SkinLine | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A finger to scale [mm]: the surface is y = 0, the finger above it."""

    mesh: FrameMesh
    nodes: Array  # (n, 2) deformed
    values: Mapping[str, Array]  # (n,) each field by its name in `solver.quantities` [MPa or -]; displacement [mm]
    outlines: Mapping[str, Array]  # deformed borders of layers by name, each (m, 2)
    patch: Array  # (m, 2) outline of the ending
    contact: Skin
    row: Array  # (r,) SED of the receptors at `solver.prediction.ROW` [MPa]; nan if there is none


@dataclass(frozen=True, slots=True)
class Instant:
    """Numbers of a state on the load path."""

    time: float  # [s]
    depth: float  # of the bone [mm]
    travel: float  # of the bone along the surface [mm]
    sed: float  # averaged over the ending [MPa]
    sticking: int  # points that stick
    slipping: int  # points that slip

    @property
    def phase(self) -> Phase:
        """Return the phase of the finger's movement.

        >>> Instant(1.2, 2.0, 0.3, 0.008, sticking=3, slipping=9).phase
        'slipping in part'
        """
        if self.travel == 0.0:
            return "pressing"
        if not self.slipping:
            return "sticking"
        return "slipping in part" if self.sticking else "sliding"


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """A finger from first contact to full slip, or to its last equilibrium if there is no full slip."""

    frames: tuple[Frame, ...]
    instants: tuple[Instant, ...]
    lost: tuple[float, float] | None = None  # most compressed point of the last equilibrium [mm], without full slip


def visible(nodes: Array, triangles: Indices, box: Box) -> Indices:
    """Return the triangles (t, 3) on nodes (n, 2) whose bounding boxes overlap a box."""
    left, right, below, above = box
    x, y = nodes[triangles, 0], nodes[triangles, 1]
    inside = (x.max(axis=1) >= left) & (x.min(axis=1) <= right) & (y.max(axis=1) >= below) & (y.min(axis=1) <= above)
    return triangles[inside]


def halve_triangles(nodes: Array, sed: Array, triangles: Indices) -> tuple[Array, Array, Indices]:
    """Divide each triangle (t, 3) into four at the midpoints of its sides, where the SED is the mean of the ends.

    >>> corners = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]])
    >>> _, sed, four = halve_triangles(corners, np.array([0.0, 2.0, 4.0]), np.array([[0, 1, 2]]))
    >>> sed[four].mean(axis=1).tolist()
    [1.0, 2.0, 3.0, 2.0]
    """
    sides = np.stack([triangles, triangles[:, [1, 2, 0]]], axis=2).reshape(-1, 2)
    ab, bc, ca = len(nodes) + np.arange(len(sides)).reshape(-1, 3).T
    a, b, c = triangles.T
    four = np.stack([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]).transpose(2, 0, 1).reshape(-1, 3)
    nodes, sed = (np.concatenate([values, values[sides].mean(axis=1)]) for values in (nodes, sed))
    return nodes, sed, four


@dataclass(frozen=True, slots=True)
class View:
    """A point [mm], its position on the screen, and the scale. Pixels count downwards."""

    x: float  # [mm]
    y: float  # [mm]
    screen_x: float  # [pixel]
    screen_y: float  # [pixel]
    per_mm: float  # [pixel/mm]

    @staticmethod
    def fit(box: Box, left: float, top: float, width: float, height: float) -> "View":
        """Return the view that fits `box` at the bottom of a rectangle of the screen [pixel]."""
        x0, x1, y0, y1 = box
        per_mm = min(width / (x1 - x0), height / (y1 - y0))
        return View((x0 + x1) / 2.0, y0, left + width / 2.0, top + height, per_mm)

    def to_screen(self, points: Array) -> Array:
        """Return the screen positions (n, 2) [pixel] of points (n, 2) [mm]."""
        return np.array([self.screen_x, self.screen_y]) + (points - [self.x, self.y]) * [self.per_mm, -self.per_mm]

    def from_screen(self, screen_x: float, screen_y: float) -> tuple[float, float]:
        """Return the point [mm] at a pixel."""
        return self.x + (screen_x - self.screen_x) / self.per_mm, self.y - (screen_y - self.screen_y) / self.per_mm

    def visible(self, left: float, top: float, width: float, height: float) -> Box:
        """Return the box [mm] that a rectangle of the screen shows."""
        (x0, y1), (x1, y0) = self.from_screen(left, top), self.from_screen(left + width, top + height)
        return x0, x1, y0, y1


@dataclass(frozen=True, slots=True)
class FieldChoice:
    """A field in its displayed unit."""

    name: str  # among the values of a frame
    label: str
    unit: str  # "kPa", "mm", or "-" for a strain
    factor: float  # from the solver's unit to this one
    signed: bool

    def values_of(self, frame: Frame) -> Array:
        """Return the field at the nodes of a frame (n,), in its displayed unit; nan if the frame has none."""
        values = frame.values.get(self.name)
        return np.full(len(frame.nodes), np.nan) if values is None else self.factor * values

    def text(self, value: float) -> str:
        """Return a value with its unit."""
        return f"{tr(self.label)} {value:.4g} {self.unit}".removesuffix(" -").replace(" -", " −")

    @property
    def axis(self) -> str:
        """Return its label on an axis."""
        return f"{tr(self.label)} [{self.unit}]"


FIELD_CHOICES = (
    *(FieldChoice(row.name, row.label, *_UNITS.get(row.unit, (row.unit, 1.0)), row.signed) for row in FIELDS),
    FieldChoice("displacement", tr_noop("displacement from the bone"), "mm", 1.0, signed=False),
)


def automatic_range(field: FieldChoice, frames: Iterable[Frame]) -> Range:
    """Return the colour range of frames, with few nodes beyond it and zero at the middle for a signed field."""
    tops = [0.0]
    for frame in frames:
        values = np.abs(field.values_of(frame))
        finite = values[np.isfinite(values)]
        if len(finite):
            tops.append(float(np.quantile(finite, _TOP)))
    high = step_above(max(tops), _STEPS) or 1.0
    return (-high if field.signed else 0.0), high


def corners_at(frame: Frame, points: Array) -> tuple[Indices, Array]:
    """Return the triangle that holds each of `points` (p, 2) [mm] and the share of each of its corners (p, 3).

    The triangle is -1, and the shares are nan, outside of the tissue.
    """
    triangle, corner_shares = np.full(len(points), -1), np.full((len(points), 3), np.nan)
    corners = frame.nodes[frame.mesh.triangles]  # (t, 3, 2)
    low, high = corners.min(axis=1), corners.max(axis=1)
    some = np.flatnonzero(((low <= points.max(axis=0)) & (high >= points.min(axis=0))).all(axis=1))
    boxed = (low[some] <= points[:, None]) & (points[:, None] <= high[some])
    point, near = np.nonzero(boxed.all(axis=2))
    a, b, c = np.moveaxis(corners[some[near]], 1, 0)
    position = points[point]
    with np.errstate(invalid="ignore", divide="ignore"):  # a triangle without area contains no point
        area = _cross(b - a, c - a)
        shares = np.column_stack([_cross(b - position, c - position) / area, _cross(c - position, a - position) / area])
    shares = np.column_stack([shares, 1.0 - shares.sum(axis=1)])
    inside = shares.min(axis=1, initial=np.inf) >= OUTSIDE
    triangle[point[inside]], corner_shares[point[inside]] = some[near[inside]], shares[inside]
    return triangle, corner_shares


def value_at(frame: Frame, field: FieldChoice, points: Array) -> tuple[Array, Indices]:
    """Return a field at `points` (p, 2) [mm], nan outside of the tissue, and the triangles that hold them (p,)."""
    triangle, shares = corners_at(frame, points)
    if not len(frame.mesh.triangles):
        return np.full(len(points), np.nan), triangle
    return np.sum(field.values_of(frame)[frame.mesh.triangles[triangle]] * shares, axis=1), triangle


def probe_text(frame: Frame, field: FieldChoice, x: float, y: float) -> str:
    """Return the text about a point [mm]: the field with its unit, the position, and the tissue."""
    position_text = f"x {x:.3f} mm, y {y:.3f} mm".replace("-", "−")
    (value,), (triangle,) = value_at(frame, field, np.array([[x, y]]))
    if triangle < 0:
        return tr("{where} · no tissue", where=position_text)
    return f"{field.text(value)} · {position_text} · {tr(_TISSUES[frame.mesh.region[triangle]])}"


def along_skin(frame: Frame, field: FieldChoice) -> tuple[Array, Array]:
    """Return the undeformed skin coordinate (m,) [mm], 0 over the receptor, and the field on the skin there (m,)."""
    skin = frame.mesh.skin
    if skin is None:
        return np.empty(0), np.empty(0)
    return skin.arc, np.sum(skin.shape * field.values_of(frame)[skin.nodes], axis=1)


def along_line(frame: Frame, field: FieldChoice, line: Line) -> tuple[Array, Array]:
    """Return the distance from the first end (m,) [mm] and the field there (m,), nan outside of the tissue."""
    endpoints = np.array(line)
    fraction = np.linspace(0.0, 1.0, _POINTS)
    values, _ = value_at(frame, field, endpoints[0] + fraction[:, None] * (endpoints[1] - endpoints[0]))
    return fraction * float(np.hypot(*(endpoints[1] - endpoints[0]))), values


def read_out(unit: str, across: Array, position: float, curves: Sequence[tuple[str, str, Array]]) -> str:
    """Return the sample of `across` (m,) nearest to `position`, and the name, value and unit of each curve (m,) there.

    It is empty beyond the curves' ends. An unknown value is a dash.

    >>> curves = [("N", "N", np.array([0.0, 1.5, 3.0])), ("µ", "", np.full(3, np.nan))]
    >>> read_out("s", np.array([0.0, 0.1, 0.2]), 0.12, curves)
    '0.100 s · N 1.5 N · µ –'
    """
    if not len(across) or not across[0] <= position <= across[-1]:
        return ""
    near = int(np.argmin(np.abs(across - position)))
    texts = [f"{across[near]:.3f} {unit}"]
    for name, value_unit, values in curves:
        value = f"{values[near]:.4g} {value_unit}" if np.isfinite(values[near]) else "–"
        texts.append(f"{name} {value}".strip())
    return " · ".join(texts).replace("-", "−")


def _cross(first: Array, second: Array) -> Array:
    return first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
