"""Scene: all input of one run of the solver, frozen and checked when made.

Each table (`scene.tables`) checks itself. This module checks combinations of tables, and derives other scenes from one.
"""

import math
from dataclasses import dataclass, field, fields, replace
from typing import cast

from solver.scene.tables import (
    LAWS_OF,
    TISSUES,
    Finger,
    Friction,
    Loading,
    Material,
    Materials,
    Receptor,
    SceneError,
    Slide,
    Solve,
)

STIFFNESSES = 1e10  # largest ratio of two tissues' stiffnesses: beyond it, round-off swamps the softer one


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """One run of the solver. Friction and loading have no sensible default."""

    title: str = ""
    finger: Finger = field(default_factory=Finger)
    materials: Materials = field(default_factory=Materials)
    friction: Friction
    loading: Loading
    receptor: Receptor = field(default_factory=Receptor)
    solve: Solve = field(default_factory=Solve)

    def __post_init__(self) -> None:
        """Check the types of the tables, and their combinations. Raises SceneError."""
        for table in fields(self)[1:]:
            kind, value = cast("type", table.type), getattr(self, table.name)
            if not isinstance(value, kind):
                raise SceneError(table.name, value, f"it must be a {kind.__name__}")
        self._check_laws()
        self._check_stiffnesses()
        skin = self.finger.epidermis + self.finger.dermis
        half = self.receptor.ending[0] / 2.0
        if not half < self.receptor.depth < self.finger.tip_radius - half:
            raise SceneError("receptor.depth", self.receptor.depth, "the ending must lie between skin and finger axis")
        if self.receptor.depth + half > skin + 1e-9:
            raise SceneError("receptor.depth", self.receptor.depth, f"the ending must end within {skin:g} mm of skin")
        along, angle = self.receptor.ending[1], math.radians(self.finger.contact_angle)
        room = 2.0 * (self.finger.shaft_length + (self.finger.tip_radius - self.receptor.depth) * angle)
        if not along < 0.999 * room:
            allowed = f"along the skin it must end before the cut, and stay below {0.999 * room:.3g} mm"
            raise SceneError("receptor.ending", self.receptor.ending, allowed)
        room = self.finger.bone_depth()
        if self.loading.indentation is not None and self.loading.indentation >= room:
            allowed = f"it must stay below the {room:.3g} mm at which the surface meets the bone"
            raise SceneError("loading.indentation", self.loading.indentation, allowed)
        drag, push = self.loading.tangential_force, self.loading.normal_force
        if drag is not None and push is not None and drag > self.friction.mu * push * (1.0 + 1e-12):
            allowed = f"friction carries at most mu times the normal force, {self.friction.mu * push:.4g}"
            raise SceneError("loading.tangential_force", drag, allowed)

    def _check_stiffnesses(self) -> None:
        softest = min(tissue.E for tissue in self.meshed_tissues)
        for name in TISSUES[: len(self.meshed_tissues)]:
            if not STIFFNESSES * softest * (1.0 + 1e-9) >= self.materials.of(name).E:
                allowed = f"it must be at most {STIFFNESSES:g} times that of the softest tissue, {softest:g} MPa"
                raise SceneError(f"materials.{name}.E", self.materials.of(name).E, allowed)

    def _check_laws(self) -> None:
        kinematics = self.solve.kinematics
        for name in TISSUES:
            tissue = self.materials.of(name)
            if tissue.law is not None and tissue.law not in LAWS_OF[kinematics]:
                has = " or ".join(f'"{law}"' for law in LAWS_OF[kinematics])
                allowed = f'with solve.kinematics = "{kinematics}" it must be {has}'
                raise SceneError(f"materials.{name}.law", tissue.law, allowed)
        if self.finger.bone == "rigid" and self.materials.bone.prony:
            allowed = 'a rigid bone does not relax: leave it out, or set finger.bone = "meshed"'
            raise SceneError("materials.bone.prony", [(t.g, t.tau) for t in self.materials.bone.prony], allowed)

    @property
    def meshed_tissues(self) -> tuple[Material, ...]:
        """The tissues with elements: all but a rigid bone."""
        return self.materials.by_region if self.finger.bone == "meshed" else self.materials.by_region[:-1]

    @property
    def normal_force(self) -> float | None:
        """The prescribed normal force [N/mm], None where a depth is prescribed."""
        return self._per_mm(self.loading.normal_force)

    @property
    def loading_group(self) -> tuple[float, float, str]:
        """Depth [mm], normal force [N/mm] and slide, which similar scenes share."""
        return self.loading.indentation or 0.0, self.normal_force or 0.0, str(self.loading.slide)

    @property
    def viscoelastic(self) -> bool:
        """Whether the load path is marched in time while the tissues relax."""
        return self.materials.relax and self.solve.course == "history"

    @property
    def tangential_force(self) -> float | None:
        """The prescribed drag, opposing the slide [N/mm], None where the bone slides to the settled state."""
        return self._per_mm(self.loading.tangential_force)

    def _per_mm(self, force: float | None) -> float | None:
        return force / self.finger.width if force is not None and self.loading.force_unit == "N" else force

    @property
    def loading_per_mm(self) -> Loading:
        """The loading with its forces in N/mm."""
        forces = {"normal_force": self.normal_force, "tangential_force": self.tangential_force}
        return replace(self.loading, **forces, force_unit="N/mm")

    def frictionless_press(self, depth: float) -> "Scene":
        """Return the scene of the finger pressed to a `depth` [mm] without friction; meshes depend on it alone."""
        frictionless = replace(self, title="", friction=Friction(0.0), loading=Loading(depth))
        return replace(frictionless, solve=Solve(self.solve.kinematics))

    def without_drag(self) -> "Scene":
        """Return the scene with a slide in place of a prescribed drag."""
        return replace(self, loading=replace(self.loading, tangential_force=None))

    def earlier_slides(self) -> tuple["Scene", ...]:
        """Return the scene of a settled slide in each direction before the last one that differs from it."""
        opposite = set(self.loading.directions[:-1]) - {self.loading.direction}
        way: dict[int, Slide] = {1: "+x", -1: "-x"}
        solve = replace(self.solve, course="steady")
        return tuple(replace(self, loading=replace(self.loading, slide=way[d]), solve=solve) for d in opposite)

    def press_only(self) -> "Scene":
        """Return the scene up to the end of the press."""
        loading = replace(self.loading, slide="none", tangential_force=None)
        return replace(self, loading=loading, solve=replace(self.solve, course="steady"))

    def driven(self, depth: float) -> "Scene":
        """Return the scene with its bone driven to `depth` [mm], in place of a prescribed normal force."""
        loading = self.loading
        if loading.indentation is not None:
            return self
        return replace(self, loading=Loading(depth, "none" if loading.dragged else loading.slide, loading.speed))
