"""The tables of a scene: finger, materials, friction, loading, receptor, solve; each checks itself when made.

Field names are the keys of a scene file. Lengths are in mm, stresses in MPa, angles in degrees. In the finger's frame X
points distally along the finger axis, -Y is palmar, and the origin is the centre of the tip's arc.
"""

import math
import sys
from dataclasses import dataclass, fields
from typing import Any, Literal, cast

Slide = Literal["+x", "-x", "none"]
Law = Literal["hooke", "neo-hookean", "ogden"]
TISSUES = ("epidermis", "dermis", "fat", "bone")  # in the order of the mesh's regions
STIFFENING = 2.0, 14.0  # exponents of Ogden's law, from the neo-Hookean one; steeper laws give inconsistent results
SHALLOW = 1e-6  # least indentation [mm]: below it, round-off is as large as the response
MIN_FORCE = 1e-12  # least nonzero friction [-, MPa]: below it, round-off is as large as the drag
LAWS_OF = {"small": ("hooke",), "finite": ("neo-hookean", "ogden")}  # of each kinematics


class SceneError(ValueError):
    """A scene that cannot be run: the key, its value, and the allowed values."""

    def __init__(self, key: str, value: object, allowed: str) -> None:
        """Store the dotted `key`, its `value`, and a phrase for the `allowed` values."""
        super().__init__(key, value, allowed)  # all three, so that the error can be sent between processes
        self.key = key
        self.value = value
        self.allowed = allowed

    def __str__(self) -> str:
        return f"{self.key} = {self.value!r} is not allowed: {self.allowed}."


@dataclass(frozen=True, slots=True)
class Table:
    """A table of a scene. NumPy's numbers become Python's; lists and arrays become tuples."""

    def __post_init__(self) -> None:
        for f in fields(self):
            object.__setattr__(self, f.name, _plain(getattr(self, f.name)))


def _plain(value: Any) -> Any:  # noqa: ANN401 - of any type
    value = value.tolist() if hasattr(value, "tolist") else value
    return tuple(map(_plain, cast("list[Any]", value))) if isinstance(value, (list, tuple)) else value


def _row(value: object) -> tuple[object, ...]:
    """Return `value` if it is a tuple, else an empty tuple."""
    return cast("tuple[object, ...]", value) if isinstance(value, tuple) else ()


_LARGEST = sys.float_info.max


def _lies_within(value: object, low: float, high: float) -> bool:
    """Return whether `value` is a number in this range; nan, strings, True and False are not."""
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _are_two_within(values: object, low: float, high: float) -> bool:
    row = _row(values)
    return len(row) == 2 and all(_lies_within(value, low, high) for value in row)


def _within(key: str, value: object, low: float, high: float, unit: str = "", *, zero: bool = False) -> None:
    """Raise SceneError unless `value` is a number from `low` to `high`; with `zero`, the message allows 0 too."""
    if not _lies_within(value, low, high):
        allowed = f"it must {'be 0 or ' if zero else ''}lie between {low:g} and {high:g}{unit and ' ' + unit}"
        raise SceneError(key, value, allowed)


@dataclass(frozen=True, slots=True)
class Finger(Table):
    """Outline of the finger: a half-disc tip, straight edges back to the cut, two layers of skin, a bone."""

    tip_radius: float = 5.0  # of the skin's outline [mm]
    epidermis: float = 0.75  # thickness [mm]
    dermis: float = 1.25  # thickness [mm]
    shaft_length: float = 15.0  # from the centre of the tip's arc back to the cut [mm]
    bone_radius: float = 1.5  # [mm]
    bone_centre: tuple[float, float] = (-1.0, 0.75)  # centre of the bone's arc, finger frame [mm]
    contact_angle: float = 45.0  # between finger axis and surface, tip down [degrees]
    width: float = 15.0  # used only to convert forces in N to forces per mm [mm]; assumed
    bone: Literal["rigid", "meshed"] = "rigid"  # "meshed": with its own material, driven at its core
    cut: Literal["free", "driven"] = "free"  # "driven": the cut through the soft tissues moves with the bone
    nail_length: float = 0.0  # of a nail plate fixed to the bone, on the dorsal skin back from the tip's arc [mm]

    def __post_init__(self) -> None:
        """Check ranges, and that some fat lies between dermis and bone everywhere. Raises SceneError."""
        Table.__post_init__(self)
        _within("finger.tip_radius", self.tip_radius, 0.5, 50.0, "mm")
        for name in ("epidermis", "dermis"):
            _within(f"finger.{name}", getattr(self, name), 0.01 * self.tip_radius, 0.8 * self.tip_radius, "mm")
        _within("finger.shaft_length", self.shaft_length, self.tip_radius, 20.0 * self.tip_radius, "mm")
        _within("finger.bone_radius", self.bone_radius, 0.05 * self.tip_radius, 0.9 * self.tip_radius, "mm")
        if not _are_two_within(self.bone_centre, -_LARGEST, _LARGEST):
            raise SceneError("finger.bone_centre", self.bone_centre, "it must be two finite lengths in mm")
        _within("finger.bone_centre[0]", self.bone_centre[0], -0.8 * self.shaft_length, self.tip_radius, "mm")
        _within("finger.contact_angle", self.contact_angle, 10.0, 90.0, "degrees")
        _within("finger.width", self.width, 0.1, 1000.0, "mm")
        if self.bone not in ("rigid", "meshed"):
            raise SceneError("finger.bone", self.bone, 'it must be "rigid" or "meshed"')
        if self.cut not in ("free", "driven"):
            raise SceneError("finger.cut", self.cut, 'it must be "free" or "driven"')
        if self.nail_length != 0.0:
            _within("finger.nail_length", self.nail_length, 0.1 * self.tip_radius, 0.95 * self.shaft_length, "mm")
        least = 0.02 * self.tip_radius
        if not self.fat_thickness() >= least:
            raise SceneError(
                "finger.bone_centre",
                self.bone_centre,
                f"bone and dermis must leave at least {least:g} mm of fat between them, and they leave "
                f"{self.fat_thickness():.3g} mm",
            )

    def fat_thickness(self) -> float:
        """Return the least distance from bone to dermis [mm]; negative where the bone reaches through the fat.

        The reference finger's bone is nearest to the dermis along its dorsal edge:

        >>> Finger().fat_thickness()
        0.75
        """
        x, y = self.bone_centre
        return self.tip_radius - self.epidermis - self.dermis - math.hypot(max(x, 0.0), y) - self.bone_radius

    def pulp_thickness(self) -> float:
        """Return the distance from the point of first touch to the end of the bone [mm].

        >>> round(Finger().pulp_thickness(), 3)
        4.74
        """
        angle = math.radians(self.contact_angle)
        x, y = self.tip_radius * math.sin(angle), -self.tip_radius * math.cos(angle)
        return math.hypot(x - self.bone_centre[0], y - self.bone_centre[1]) - self.bone_radius

    def bone_depth(self) -> float:
        """Return the indentation at which the surface meets the bone [mm].

        It is less than the pulp's thickness where the bone does not lie right above the point of first touch.

        >>> round(Finger().bone_depth(), 3), round(Finger(bone_centre=(-6.0, 0.75), contact_angle=10.0).bone_depth(), 3)
        (4.737, 5.28)
        """
        angle = math.radians(self.contact_angle)
        x, y = self.bone_centre
        return self.tip_radius - x * math.sin(angle) + y * math.cos(angle) - self.bone_radius


@dataclass(frozen=True, slots=True)
class Relaxation(Table):
    """One term of a Prony series: a part of the shear modulus that relaxes with one time constant."""

    g: float  # part of the instantaneous modulus [-]
    tau: float  # relaxation time [s]


@dataclass(frozen=True, slots=True)
class Material(Table):
    """An isotropic tissue."""

    E: float  # instantaneous Young's modulus of the undeformed tissue [MPa]
    nu: float  # instantaneous Poisson's ratio [-]
    law: Law | None = None  # None: Hooke at small strain, neo-Hookean at finite strain
    stiffening: float | None = None  # exponent of Ogden's law [-]; None: the exponent of human skin
    prony: tuple[Relaxation, ...] = ()  # of the shear modulus; the bulk modulus does not relax

    def check(self, key: str) -> None:
        """Raise SceneError where a value is not allowed; `key` is the tissue's key in the scene."""
        _within(f"{key}.E", self.E, 1e-6, 1e12, "MPa")
        if not _lies_within(self.nu, 0.0, 0.4999999):
            high = _lies_within(self.nu, 0.0, math.inf)
            why = ", since at 0.5 a material has no strain energy of volume change to compute" if high else ""
            raise SceneError(f"{key}.nu", self.nu, f"it must lie between 0 and 0.4999999{why}")
        if self.law not in (None, "hooke", "neo-hookean", "ogden"):
            raise SceneError(f"{key}.law", self.law, 'it must be "hooke", "neo-hookean" or "ogden"')
        if self.stiffening is not None and self.law != "ogden":
            raise SceneError(f"{key}.stiffening", self.stiffening, 'it belongs to law = "ogden"')
        if self.stiffening is not None:
            _within(f"{key}.stiffening", self.stiffening, *STIFFENING)
        terms = _row(self.prony)
        if terms is not self.prony or not all(isinstance(term, Relaxation) for term in terms):
            raise SceneError(f"{key}.prony", self.prony, "give each term of the series as a Relaxation(g, tau)")
        for number, term in enumerate(self.prony):
            _within(f"{key}.prony[{number}].g", term.g, 0.0, 0.99)
            _within(f"{key}.prony[{number}].tau", term.tau, 1e-6, 1e6, "s")
        if not sum(term.g for term in self.prony) <= 0.99:
            raise SceneError(f"{key}.prony", [term.g for term in self.prony], "all g together must be at most 0.99")


@dataclass(frozen=True, slots=True)
class Materials:
    """The four tissues; defaults are the paper's Table 3 (after Maeno et al. 1998)."""

    epidermis: Material = Material(0.136, 0.48)
    dermis: Material = Material(0.08, 0.48)
    fat: Material = Material(0.034, 0.48)
    bone: Material = Material(200.0, 0.3)

    def __post_init__(self) -> None:
        """Check each tissue under its key. Raises SceneError."""
        for name in TISSUES:
            tissue = cast("object", self.of(name))
            if not isinstance(tissue, Material):
                raise SceneError(f"materials.{name}", tissue, "it must be a Material")
            tissue.check(f"materials.{name}")

    def of(self, name: str) -> Material:
        """Return the tissue called `name`, one of TISSUES."""
        return {"epidermis": self.epidermis, "dermis": self.dermis, "fat": self.fat, "bone": self.bone}[name]

    @property
    def by_region(self) -> tuple[Material, ...]:
        """The tissues in the order in which the mesh numbers its regions."""
        return tuple(self.of(name) for name in TISSUES)

    @property
    def longest_relaxation(self) -> float:
        """The longest relaxation time of any tissue [s], 0 where none relaxes."""
        return max((term.tau for tissue in self.by_region for term in tissue.prony), default=0.0)

    @property
    def longest_creep(self) -> float:
        """Longest retardation time of any tissue under a constant load [s].

        It is exactly tau / (1 - g) for one term (Zener's solid: Findley, Lai and Onaran 1976, chapter 5). For several
        terms, the longest tau divided by the long-term part is an upper bound.
        """
        series = [tissue.prony for tissue in self.by_region if tissue.prony]
        return max((max(t.tau for t in terms) / (1.0 - sum(t.g for t in terms)) for terms in series), default=0.0)

    @property
    def relax(self) -> bool:
        """Whether any tissue relaxes."""
        return self.longest_relaxation > 0.0


@dataclass(frozen=True, slots=True)
class Friction(Table):
    """Coulomb friction with a traction bound: the traction is at most min(mu p, tau_max)."""

    mu: float  # coefficient of friction [-]
    tau_max: float | None = None  # traction bound [MPa]; None: no bound

    def __post_init__(self) -> None:
        Table.__post_init__(self)
        if self.mu != 0.0:
            _within("friction.mu", self.mu, MIN_FORCE, 1000.0, zero=True)
        if self.tau_max is not None and self.tau_max != 0.0:
            _within("friction.tau_max", self.tau_max, MIN_FORCE, 1e12, "MPa", zero=True)

    @property
    def cap(self) -> float:
        """The traction bound [MPa], infinite without one."""
        return math.inf if self.tau_max is None else self.tau_max

    @property
    def frictionless(self) -> bool:
        """Whether no tangential force is possible."""
        return self.mu == 0.0 or self.cap == 0.0


@dataclass(frozen=True, slots=True)
class Loading(Table):
    """Motion of the bone: down within 1 s, by an indentation or a force, then along the surface.

    A drag can replace the slide to the settled state. It grows within 1 s after the press, and the shift of the bone is
    part of the solution.
    """

    indentation: float | None = None  # [mm]; None for a prescribed normal force
    slide: Slide | tuple[Literal["+x", "-x"], ...] = "+x"  # "+x": proximal to distal; several in sequence
    speed: float = 15.0  # [mm/s]; in an elastic finger it only scales time
    normal_force: float | None = None  # in place of the indentation
    tangential_force: float | None = None  # in place of a slide to the settled state: drag opposing the slide, positive
    force_unit: Literal["N/mm", "N"] = "N/mm"  # of both forces; "N": on the whole finger, to be divided by its width

    def __post_init__(self) -> None:
        """Check ranges, and that exactly one of depth and force is prescribed. Raises SceneError."""
        Table.__post_init__(self)
        if (self.indentation is None) == (self.normal_force is None):
            allowed = "give either an indentation or a normal force"
            raise SceneError("loading.indentation", self.indentation, allowed)
        if self.indentation is not None:
            _within("loading.indentation", self.indentation, SHALLOW, 200.0, "mm")
        if self.normal_force is not None:
            _within("loading.normal_force", self.normal_force, 1e-9, 1e6)
        if self.force_unit not in ("N/mm", "N"):
            raise SceneError("loading.force_unit", self.force_unit, 'it must be "N/mm" or "N"')
        legs = self.slide if isinstance(self.slide, tuple) else (self.slide,)
        single = ("+x", "-x", "none") if len(legs) == 1 else ("+x", "-x")
        if not legs or any(leg not in single for leg in legs):
            allowed = 'it must be "+x", "-x" or "none", or a list of "+x" and "-x"'
            raise SceneError("loading.slide", self.slide, allowed)
        _within("loading.speed", self.speed, 1e-6, 1e4, "mm/s")
        if self.tangential_force is not None:
            _within("loading.tangential_force", self.tangential_force, 0.0, 1e6)
            if self.indentation is not None:
                allowed = "it needs a normal force, not an indentation"
                raise SceneError("loading.tangential_force", self.tangential_force, allowed)
            if self.slide not in ("+x", "-x"):
                raise SceneError("loading.slide", self.slide, 'with a tangential force it must be "+x" or "-x"')

    @property
    def dragged(self) -> bool:
        """Whether a tangential force is given."""
        return self.tangential_force is not None

    @property
    def directions(self) -> tuple[int, ...]:
        """+1 for every slide along +x, -1 along -x, in their order; empty without a slide."""
        legs = self.slide if isinstance(self.slide, tuple) else (self.slide,)
        return tuple({"+x": 1, "-x": -1}[leg] for leg in legs if leg != "none")

    @property
    def direction(self) -> int:
        """+1 when the last slide is along +x, -1 along -x, 0 without a slide."""
        return self.directions[-1] if self.directions else 0

    @property
    def depth(self) -> float:
        """The prescribed indentation [mm]. Raises ValueError where a force is prescribed instead."""
        if self.indentation is None:
            raise ValueError("a force is given: the depth must be found first")
        return self.indentation


@dataclass(frozen=True, slots=True)
class Receptor(Table):
    """The nerve ending: a patch of tissue on the inward normal through the point of first touch."""

    depth: float = 1.9  # depth of its middle below the skin [mm]
    ending: tuple[float, float] = (0.2, 1.0)  # its size across and along the skin [mm]

    def __post_init__(self) -> None:
        Table.__post_init__(self)
        _within("receptor.depth", self.depth, 1e-3, 50.0, "mm")
        if not _are_two_within(self.ending, 1e-3, 20.0):
            raise SceneError("receptor.ending", self.ending, "it must be two lengths between 0.001 and 20 mm")


USUAL_TOLERANCE = 0.003  # a tenth of the SED's range over the published slippery surfaces, the smaller of both [-]


@dataclass(frozen=True, slots=True)
class Solve(Table):
    """Options of the solution.

    Evidence: "quick" follows from the solution, "estimated" also marches a load path for the residual overstress,
    "measured" solves the scene again in several ways.
    """

    kinematics: Literal["small", "finite"] = "small"  # small strain (the paper's), or finite strain
    course: Literal["steady", "history"] = "steady"  # "steady": the settled state alone; "history": the whole load path
    tolerance: float | None = None  # required relative error of the ending-averaged SED [-]; None: 0.3 %
    evidence: Literal["quick", "estimated", "measured"] = "estimated"  # of the size of omitted effects
    contrast_tolerance: float | None = None  # required error of SED differences between surfaces, over their range [-]

    @property
    def target(self) -> float | None:
        """Relative error of the ending-averaged SED to which the mesh is refined; None where only contrasts count."""
        usual = USUAL_TOLERANCE if self.contrast_tolerance is None else None
        return usual if self.tolerance is None else self.tolerance

    def __post_init__(self) -> None:
        Table.__post_init__(self)
        if self.kinematics not in ("small", "finite"):
            raise SceneError("solve.kinematics", self.kinematics, 'it must be "small" or "finite"')
        if self.course not in ("steady", "history"):
            raise SceneError("solve.course", self.course, 'it must be "steady" or "history"')
        if self.evidence not in ("quick", "estimated", "measured"):
            raise SceneError("solve.evidence", self.evidence, 'it must be "quick", "estimated" or "measured"')
        for name in ("tolerance", "contrast_tolerance"):
            if getattr(self, name) is not None:
                _within(f"solve.{name}", getattr(self, name), 1e-4, 0.5)
