"""Prediction: what one run of the solver found, with the audits that vouch for it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from solver.arrays import Array
from solver.mesh import Mesh
from solver.mesh.mesher import FingerMesh
from solver.scene import Scene

ROW: Array = 0.25 * np.arange(-32.0, 25.0)  # arc positions of the row of receptors [mm]


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """The same ending at arc positions along the skin, the reference ending being the one at 0."""

    arc: Array  # (r,) from first touch, positive towards the tip, on the undeformed skin [mm]
    sed: Array  # (r,) SED averaged over each ending [MPa]; nan where the finger ends before it


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """The skin's nodes that may touch, in order from proximal to distal."""

    x: Array  # (k,) deformed position along the surface, bone's first touch at 0 [mm]
    gap: Array  # (k,) height over the surface, 0 where it touches [mm]
    pressure: Array  # (k,) [MPa], 0 where the gap is open
    traction: Array  # (k,) tangential, of the surface on the skin along +x [MPa]
    state: tuple[str, ...]  # (k,) "open", "stick", "slip" or "cap"


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """The course in time: pre-indentation over 1 s, then sliding. m instants."""

    time: Array  # (m,) [s]
    bone_x: Array  # (m,) travel of the bone along the surface [mm]
    bone_y: Array  # (m,) travel of the bone, negative into the surface [mm]
    sed_ending: Array  # (m,) [MPa]
    sed_point: Array  # (m,) [MPa]
    normal_force: Array  # (m,) [N/mm]
    tangential_force: Array  # (m,) drag opposing the slide [N/mm]
    contact_width: Array  # (m,) [mm]
    slipping: Array  # (m,) part of the touching skin nodes that slip [-]


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """The settled response of one scene, or the last state of its course."""

    scene: Scene
    sed_ending: float  # SED averaged over the ending [MPa]
    sed_point: float  # SED at the ending's middle [MPa]
    normal_force: float  # of the surface on the finger along +y [N/mm]
    tangential_force: float  # drag opposing the slide [N/mm]
    contact_width: float  # from the first to the last touching point, along the surface [mm]
    indentation: float  # of the bone, asked for or found under a given force [mm]
    shift: float | None  # of the bone along +x, found under a given drag [mm]; None where it slides or is only pressed
    error_estimate: float  # of sed_ending, relative [-]
    dofs: int  # unknown displacements
    newton_iterations: int  # solutions of a linear system with trial contact states
    wall_s: float  # the solve alone: this scene's, and its part of what scenes solved together share [s]
    setup_s: float  # mesh and tables; shared by scenes solved together [s]
    estimate_s: float  # what the error estimate took beside the solve, likewise [s]
    row: Row
    model: Mapping[str, Any]  # what was modelled, what was left out, and the evidence that it could be
    audits: Mapping[str, float]  # checks; residuals relative unless their name says otherwise
    skin: Skin
    geometry: FingerMesh
    displacement: Array  # (nodes, 2) relative to the bone [mm]
    history: History | None = None
    evidence_s: float | None = None  # what marching and measuring the evidence in `model` took [s]; None: nothing was
    normal_force_error: float | None = None  # estimated, of normal_force, relative [-]; None: it was given
    tangential_force_error: float | None = None  # likewise of tangential_force; 0 where there is no friction
    indentation_error: float | None = None  # likewise of indentation; None where that was given
    shift_error: float | None = None  # estimated, of shift [mm]; None where there is none
    contact_width_error: float | None = None  # estimated, of contact_width, relative [-]
    error_stays: float = 0.0  # part of error_estimate that meshes of all finenesses have in common
    beside: Array = field(default_factory=lambda: np.empty((0, 4)))  # SED, forces, indentation on m other meshes (m, 4)
    warnings: tuple[str, ...] = field(default=())  # one sentence each

    @property
    def mesh(self) -> Mesh:
        """The mesh that the displacements are of."""
        return self.geometry.mesh

    def to_dict(self) -> dict[str, Any]:
        """Return what `daq-app solve --json` prints: plain numbers, lists and strings."""
        plain: dict[str, Any] = {
            name: getattr(self, name)
            for name in (
                "sed_ending",
                "sed_point",
                "normal_force",
                "tangential_force",
                "contact_width",
                "indentation",
                "shift",
                "error_estimate",
                "normal_force_error",
                "tangential_force_error",
                "indentation_error",
                "shift_error",
                "contact_width_error",
                "dofs",
                "newton_iterations",
                "wall_s",
                "setup_s",
                "estimate_s",
                "evidence_s",
            )
        }
        plain["title"] = self.scene.title
        plain["row"] = {"arc": self.row.arc.tolist(), "sed": [None if s != s else s for s in self.row.sed.tolist()]}
        plain["model"] = dict(self.model)
        plain["audits"] = dict(self.audits)
        plain["warnings"] = list(self.warnings)
        if self.history is not None:
            course = {f.name: getattr(self.history, f.name).tolist() for f in fields(self.history)}
            plain["time"], plain["bone_x"], plain["bone_y"] = (course.pop(k) for k in ("time", "bone_x", "bone_y"))
            plain["history"] = course
        return plain


def drag(scene: Scene, along: float) -> float:
    """Return the drag opposing the slide [N/mm] for the surface's force `along` +x on it, without a slide its size.

    0 where nothing rubs and where a drag of none is given, that force being round-off then; never -0.
    """
    if scene.friction.mu == 0.0 or scene.friction.cap == 0.0 or scene.tangential_force == 0.0:
        return 0.0
    return abs(along) if scene.loading.direction == 0 else 0.0 - scene.loading.direction * along
