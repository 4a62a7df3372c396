"""The prediction of one scene: results with error estimates, the model, audits, and the state."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np

from solver.arrays import Array, Indices
from solver.failures import SolveFailure
from solver.mesh import Mesh
from solver.mesh.mesher import FingerMesh
from solver.quantities import NAMES, QUANTITIES
from solver.scene import Scene

FORCES_AND_PLACES = 7  # results with an error estimate besides the quantities; they come first in `all_numbers`
COUNT = FORCES_AND_PLACES + len(NAMES)
ROW: Array = 0.25 * np.arange(-32.0, 25.0)  # arc positions of the row of receptors [mm]


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """Identical receptors at arc positions along the skin; the reference ending is the one at 0."""

    arc: Array  # (r,) from first touch, positive towards the tip, on the undeformed skin [mm]
    sed: Array  # (r,) SED averaged over each ending [MPa]; nan for one outside the finger
    error: Array  # (r,) error estimate of each, relative; nan where unknown


class Response(NamedTuple):
    """One quantity averaged over the ending, in the quantity's unit."""

    value: float
    error: float  # estimated; nan where unknown


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """The skin's nodes that may touch, in order from proximal to distal."""

    x: Array  # (k,) deformed position along the surface, 0 at the bone's first touch [mm]
    gap: Array  # (k,) height over the surface, 0 where it touches [mm]
    pressure: Array  # (k,) [MPa], 0 where the gap is open
    traction: Array  # (k,) tangential, of the surface on the skin along +x [MPa]
    state: tuple[str, ...]  # (k,) "open", "stick", "slip" or "cap"


@dataclass(frozen=True, slots=True, eq=False)
class SkinLine:
    """m points of the skin's surface, at which fields of a picture are interpolated."""

    arc: Array  # (m,) along the skin at rest, 0 over the reference ending, towards the tip [mm]
    nodes: Indices  # (m, 9) of the picture
    shape: Array  # (m, 9) shape functions there


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """The load path in time: pre-indentation over 1 s, then sliding. m instants."""

    time: Array  # (m,) [s]
    bone_x: Array  # (m,) travel of the bone along the surface [mm]
    bone_y: Array  # (m,) travel of the bone, negative into the surface [mm]
    sed_ending: Array  # (m,) [MPa]
    sed_point: Array  # (m,) [MPa]
    normal_force: Array  # (m,) [N/mm]
    tangential_force: Array  # (m,) drag opposing the slide [N/mm]
    contact_width: Array  # (m,) [mm]
    slipping: Array  # (m,) part of the touching skin nodes that slip [-]
    responses: Array  # (m, q) all quantities at the ending; nan for all but the SED where tissues relax


@dataclass(frozen=True, slots=True, eq=False)
class NestedNumbers:
    """The `all_numbers` of a scene on the nested mesh, which divides every element into four; SED first."""

    numbers: Array  # (COUNT,)
    edge_errors: Array  # (2, m, COUNT) bounds of the parts of errors that m edges of contact add, as `half_width` takes
    row: Array  # (r,) SED of the row of receptors [MPa]
    row_edge_errors: Array  # (2, m, r) such bounds for `row`
    excess: Array  # (COUNT,) of errors over `half_width`, where parts of the mesh cancel in the change
    relative_excess: float  # of the SED's error, which the results of all receptors are taken to have [-]
    shares: Array | None = None  # (a + b,) of each column and row of the mesh in the SED's error, where it is too large


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """The settled response of one scene, or the last state of its load path."""

    scene: Scene
    sed_ending: float  # SED averaged over the ending [MPa]
    sed_point: float  # SED at the ending's middle [MPa]
    normal_force: float  # of the surface on the finger along +y [N/mm]
    tangential_force: float  # drag opposing the slide [N/mm]
    contact_width: float  # from the first to the last touching point, along the surface [mm]
    indentation: float  # of the bone, given or computed for a given force [mm]
    shift: float | None  # of the bone along +x under a given drag [mm]; None where it slides or is only pressed
    error_estimate: float  # half width of the interval about sed_ending, relative [-]
    corrected_error: float  # half width of the interval about sed_ending_corrected, relative [-]
    dofs: int  # unknown displacements
    newton_iterations: int  # solutions of a linear system with trial contact states
    wall_s: float  # time of the solve: this scene's, and its part of the work shared by scenes solved together [s]
    setup_s: float  # mesh and tables; shared by scenes solved together [s]
    estimate_s: float  # time of the error estimate, not part of `wall_s` but shared in the same way [s]
    row: Row
    responses: Mapping[str, Response]  # every quantity of `solver.quantities` at the ending, by name
    model: Mapping[str, Any]  # assumptions, omitted effects, and the evidence on these
    audits: Mapping[str, float]  # checks; residuals relative unless their name says otherwise
    skin: Skin
    geometry: FingerMesh
    displacement: Array  # (nodes, 2) relative to the bone [mm]
    history: History | None = None
    evidence_s: float | None = None  # time of the solves for the evidence in `model` [s]; None: none was requested
    sed_point_error: float = 1.0  # estimated, of sed_point, relative [-]
    normal_force_error: float | None = None  # estimated, of normal_force, relative [-]; None: it was given
    tangential_force_error: float | None = None  # estimated, relative [-]; None: force was given; 0 without friction
    indentation_error: float | None = None  # estimated, of indentation, relative [-]; None: it was given
    shift_error: float | None = None  # estimated, of shift [mm]; None without a shift
    contact_width_error: float | None = None  # estimated, of contact_width, relative [-]
    nested: NestedNumbers | None = None  # on the nested mesh, for the error estimates; None where errors are unknown
    unknown: SolveFailure | None = None  # why errors are unknown; None where they are known
    warnings: tuple[str, ...] = field(default=())  # one sentence each

    @property
    def sed_ending_corrected(self) -> float:
        """SED averaged over the ending on the nested mesh [MPa], the best value; `sed_ending` where it has no state."""
        return self.sed_ending if self.nested is None else float(self.nested.numbers[0])

    @property
    def mesh(self) -> Mesh:
        """The mesh of the displacements."""
        return self.geometry.mesh

    def to_dict(self) -> dict[str, Any]:
        """Return the object that `daq-app solve --json` prints: plain numbers, lists and strings."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("history", "nested", "unknown")}
        plain: dict[str, Any] = {k: value for k, value in values.items() if isinstance(value, int | float | None)}
        if self.nested is None:  # errors are unknown
            plain |= {name: None for name in plain if name == "error_estimate" or name.endswith("_error")}
        plain["title"] = self.scene.title
        plain["sed_ending_corrected"] = None if self.nested is None else self.sed_ending_corrected
        plain["row"] = {name: _plain(getattr(self.row, name)) for name in ("arc", "sed", "error")}
        plain["responses"] = {
            quantity.name: {"unit": quantity.unit, "meaning": quantity.meaning, "value": value, "error": error}
            for quantity in QUANTITIES
            for value, error in [_plain(np.array(self.responses[quantity.name]))]
        }
        plain["model"] = dict(self.model)
        plain["audits"] = dict(self.audits)
        plain["warnings"] = list(self.warnings)
        if self.history is not None:
            course = {f.name: getattr(self.history, f.name).tolist() for f in fields(self.history)}
            columns = zip(NAMES, self.history.responses.T, strict=True)
            course["responses"] = {name: _plain(values) for name, values in columns}
            plain["time"], plain["bone_x"], plain["bone_y"] = (course.pop(k) for k in ("time", "bone_x", "bone_y"))
            plain["history"] = course
        return plain


def percent(part: float) -> str:
    """Return a part in per cent, rounded to two digits, or to a whole number from 99.5 % on.

    >>> percent(0.00432), percent(0.996), percent(1.42)
    ('0.43 %', '100 %', '142 %')
    """
    return f"{100.0 * part:.2g} %" if abs(part) < 0.995 else f"{100.0 * part:.0f} %"


def _plain(numbers: Array) -> list[float | None]:
    """Return an array as a list for JSON, with None for nan."""
    return [None if number != number else number for number in numbers.tolist()]


def drag(scene: Scene, along: float) -> float:
    """Return the drag opposing the slide [N/mm] for the surface's force `along` +x, its magnitude without a slide.

    It is 0, and never -0, without friction and for a prescribed drag of 0, where the force is round-off.
    """
    if scene.friction.frictionless or scene.tangential_force == 0.0:
        return 0.0
    return abs(along) if scene.loading.direction == 0 else 0.0 - scene.loading.direction * along
