"""Sensitivity of the SED to a scene's numbers: Sobol indices over a design (Saltelli 2010, by SALib)."""

import importlib
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from drivers.arrays import Array
from sessions.file_access import as_type
from sessions.toml_file import SettingsError, toml_value
from solver import Scene, SolveFailure, solve
from solver.scene.tables import TISSUES, SceneError

Design = Mapping[str, tuple[float, float]]  # dotted key of the scene file -> least and greatest value

# Least and greatest value relative to the scene's own. Skin is only thickened and the ending only raised, because it
# must stay within the skin and the usual one ends at its inner side. Bone is only thinned, to leave some fat below it.
USUAL: Mapping[str, tuple[float, float]] = {
    "finger.tip_radius": (0.97, 1.1),
    "finger.epidermis": (1.0, 1.2),
    "finger.dermis": (1.0, 1.2),
    "finger.bone_radius": (0.85, 1.0),
    "materials.epidermis.E": (0.7, 1.3),
    "materials.dermis.E": (0.7, 1.3),
    "materials.fat.E": (0.7, 1.3),
    "loading.indentation": (0.9, 1.1),
    "receptor.depth": (0.9, 1.0),
    "friction.mu": (0.9, 1.1),
    "friction.tau_max": (0.7, 1.3),
}
_NARROW = 0.05  # half-width of an index's interval that is narrow enough for ordering [-]
ANGLE, ANGLE_SPAN = "finger.contact_angle", 5.0  # [degrees]
FATS_NU, NU_SPAN, NU_MOST = "materials.fat.nu", 0.0195, 0.4999  # the usual 0.48 could equally be nearly one half


@dataclass(frozen=True, slots=True)
class Index:
    """The influence of one number on the SED over its range in the design."""

    name: str
    low: float
    high: float
    first: float  # share of the variance due to it alone
    first_error: float  # half of its 95 % bootstrap interval
    total: float  # including its interactions
    total_error: float
    one_sided: bool  # the range does not extend to both sides of the scene's own value


class TooFewAnswers(Exception):
    """Some scenes of the design have no answer; the message says how many, and what to do."""


def usual_design(scene: Scene) -> dict[str, tuple[float, float]]:
    """Return the design around a scene; values that the scene leaves out are not varied."""
    values = {name: _value(scene, name) for name in USUAL}
    design = {name: (USUAL[name][0] * value, USUAL[name][1] * value) for name, value in values.items() if value}
    angle = scene.finger.contact_angle
    design[ANGLE] = (max(angle - ANGLE_SPAN, 10.0), min(angle + ANGLE_SPAN, 90.0))
    nu = scene.materials.fat.nu
    if nu < NU_MOST:
        design[FATS_NU] = (max(nu - NU_SPAN, 0.0), min(nu + NU_SPAN, NU_MOST))
    return design


def constant_numbers(scene: Scene, design: Design) -> tuple[str, ...]:
    """Return the numbers of geometry, stiffness, load and friction that a design does not vary."""
    bone = scene.finger.bone == "meshed"
    names = [f"finger.{field.name}" for field in fields(scene.finger)]
    names += [f"materials.{tissue}.{name}" for tissue in TISSUES if tissue != "bone" or bone for name in ("E", "nu")]
    names += [f"{table}.{field.name}" for table in ("loading", "friction") for field in fields(getattr(scene, table))]
    numbers = [name for name in names if _value(scene, name) and name not in ("finger.width", "loading.speed")]
    return tuple(name for name in [*numbers, "finger.bone_centre", "receptor.depth"] if name not in design)


def check_design(design: Mapping[str, Any], scene: Scene, file: str) -> dict[str, tuple[float, float]]:
    """Return a design read from a file. Raises SettingsError for a key or a range that cannot be varied."""
    ranges: dict[str, tuple[float, float]] = {}
    for name, span in design.items():
        if _value(scene, name) is None:
            raise SettingsError(f"{file}: {name} is not a number of this scene; use a dotted key such as friction.mu")
        try:
            low, high = as_type(span, tuple[float, float])
        except ValueError:
            low = high = math.nan
        if not -math.inf < low < high < math.inf:
            form = "[least, greatest], least below greatest"
            raise SettingsError(f"{file}: {name} = {toml_value(span)} is not allowed: {form}")
        for limit in (low, high):
            try:
                with_values(scene, {name: limit})
            except SceneError as error:
                place = "" if str(error).startswith(name) else f"with {name} = {limit:g}, "
                raise SettingsError(f"{file}: {place}{error}") from error
        ranges[name] = (low, high)
    if len(ranges) < 2:
        raise SettingsError(f"{file}: a design needs two numbers at least")
    return ranges


def _sed_of(scene: Scene) -> float:
    return solve(replace(scene, solve=replace(scene.solve, course="steady", evidence="quick"))).sed_ending


def sensitivity(
    scene: Scene,
    design: Design,
    samples: int,
    seed: int,
    progress: Callable[[float], None],
    sed: Callable[[Scene], float] = _sed_of,
) -> tuple[tuple[Index, ...], Array]:
    """Return the index of each number, greatest total first, and the SEDs (samples * (numbers + 2),) [MPa].

    `samples` is a power of two. `sed` computes one scene, by default with the solver. Raises TooFewAnswers if a
    scene of the design has no answer, SceneError if a range exceeds the limits of a scene.
    """
    points = saltelli_points(design, samples, seed)
    scenes = [with_values(scene, dict(zip(design, point, strict=True))) for point in points.tolist()]
    responses = np.empty(len(points))
    failures: list[str] = []
    for i, sample in enumerate(scenes):
        try:
            responses[i] = sed(sample)
        except SolveFailure as failure:
            failures.append(" ".join(str(failure).split()))
        progress((i + 1) / len(points))
    if failures:
        raise TooFewAnswers(
            f"{len(failures)} of {len(points)} scenes of the design have no settled state; narrow its ranges "
            f"(the first: {failures[0]})"
        )
    one_sided = {name for name, (low, high) in design.items() if not low < (_value(scene, name) or 0.0) < high}
    return sobol_indices(design, responses, seed, one_sided), responses


def saltelli_points(design: Design, samples: int, seed: int) -> Array:
    """Return the points (samples * (numbers + 2), numbers) of a design; `samples` is a power of two."""
    draw: Any = importlib.import_module("SALib.sample.sobol")  # slow to load
    return draw.sample(_problem(design), samples, calc_second_order=False, seed=seed)


def sobol_indices(design: Design, answers: Array, seed: int, one_sided: Collection[str] = ()) -> tuple[Index, ...]:
    """Return the index of each number of a design, greatest total first, from `answers` at its `saltelli_points`."""
    analyse: Any = importlib.import_module("SALib.analyze.sobol")
    settings = {"calc_second_order": False, "seed": seed + 1, "num_resamples": 200}  # SALib treats 0 as no seed
    result: Any = analyse.analyze(_problem(design), answers, **settings)
    columns = zip(design, *(result[name].tolist() for name in ("S1", "S1_conf", "ST", "ST_conf")), strict=True)
    indices = [Index(name, *design[name], *values, one_sided=name in one_sided) for name, *values in columns]
    return tuple(sorted(indices, key=lambda index: -index.total))


def _problem(design: Design) -> dict[str, Any]:
    return {"num_vars": len(design), "names": list(design), "bounds": [list(span) for span in design.values()]}


def doubts(indices: Sequence[Index], samples: int) -> tuple[str, ...]:
    """Return the doubts about indices from this number of samples: one-sided ranges, impossible shares."""
    sentences: list[str] = []
    one_sided = [index.name for index in indices if index.one_sided]
    if one_sided:
        sentences.append(
            f"Varied to one side of the scene's own value only: {', '.join(one_sided)}; their shares, and those of all "
            "others, are of these ranges."
        )
    # Impossible as shares of a variance, so noise. A comparison with nan is false.
    wrong = [i.name for i in indices if i.first < 0.0 or i.total > 1.0 or i.first > i.total]
    if wrong:
        widest = max(max(index.first_error, index.total_error) for index in indices)
        enough = 2 ** math.ceil(math.log2(max(samples * (widest / _NARROW) ** 2, 2.0 * samples)))
        sentences.append(
            f"Noise of too few samples: {', '.join(wrong)} (a share below 0 or above 1, or alone "
            f"above that with others). As intervals narrow with the root of the samples, about {enough} would bring "
            f"each to ±{_NARROW:g}."
        )
    return tuple(sentences)


def with_values(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with the values at dotted keys. Raises SceneError if one is out of its range."""
    branches: dict[str, dict[str, float]] = {}
    changes: dict[str, Any] = {}
    for name, value in values.items():
        first, _, subkey = name.partition(".")
        if subkey:
            branches.setdefault(first, {})[subkey] = value
        else:
            changes[first] = value
    for name, inside in branches.items():
        changes[name] = with_values(getattr(scene, name), inside)
    return replace(scene, **changes)


def _value(scene: Scene, name: str) -> float | None:
    """Return the number at a dotted key, None if there is none."""
    value: Any = asdict(scene)
    try:
        for key in name.split("."):
            value = value[key]
    except (KeyError, TypeError):
        return None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
