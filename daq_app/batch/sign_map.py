"""Signs of a response's slope on many fingers: single changes, a map, and fingers drawn at random.

A finger's answer is `sessions.prediction.surface_series`: how each quantity at the ending varies over the published
surfaces. Fingers are computed in parallel, and stored one by one if a file is given.
"""

import errno
import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, nullcontext, suppress
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from daq_app.batch.pool import Lost, by_cluster, by_processes
from daq_app.batch.sensitivity import Index, TooFewAnswers, sobol_indices
from drivers.arrays import Array
from sessions.file_access import json_object
from sessions.prediction import Kinematics
from sessions.prediction.surface_series import SERIES, Press, series_slopes
from sessions.recording.head import software_versions
from sessions.statistics.correlations import share_interval
from solver import Friction, Loading, Receptor, Scene, Solve

# Numbers drawn at random, with their ranges. Nobody measured these: fingers of a lab's subjects would be better.
# Thicknesses, bone and press scale with the tip radius or the series, so that every draw is a possible finger.
DESIGN: Mapping[str, tuple[float, float]] = {
    "tip radius [mm]": (4.0, 8.0),
    "epidermis by tip radius": (0.10, 0.20),
    "dermis by tip radius": (0.18, 0.32),
    "bone radius by tip radius": (0.20, 0.30),
    "contact angle [degrees]": (30.0, 60.0),
    "stiffness of epidermis by the published": (0.5, 2.0),
    "stiffness of dermis by the published": (0.5, 2.0),
    "stiffness of fat by the published": (0.5, 2.0),
    "Poisson's ratio of fat": (0.46, 0.495),
    "place of the receptor along the skin [mm]": (-1.0, 1.0),
    "depth of the receptor by the skin's": (0.5, 1.0),
    "depth of the press by the published": (0.75, 1.25),
}
RADII = tuple(np.arange(4.5, 8.01, 0.5).tolist())  # of the map [mm]
PLACES = tuple(np.arange(-2.0, 2.01, 0.25).tolist())  # of the map [mm]
_FORCE = 0.1  # of the change "pressed by one force" [N/mm]: 1.5 N on a finger 15 mm wide


@dataclass(frozen=True, slots=True)
class Trial:
    """One finger to solve."""

    finger: Scene
    press: Press = field(default_factory=Press)
    arcs: tuple[float, ...] = (0.0,)

    def key(self, versions: Mapping[str, str]) -> str:
        """Return the key of its answer: a hash of all inputs and of the `versions` that computed it."""
        return hashlib.sha256(json.dumps([asdict(self), versions], sort_keys=True, default=str).encode()).hexdigest()


# For each series the correlation with the index (r, q), then the change over the range of mu (r, q), both by place
Answer = Mapping[str, list[list[list[float | None]]]]


def published_finger(kinematics: Kinematics = "small") -> Scene:
    """Return the published finger."""
    return Scene(friction=Friction(0.0), loading=Loading(1.0), solve=Solve(kinematics))


def single_changes(kinematics: Kinematics) -> Mapping[str, Trial]:
    """Return fingers that differ from the published one in one respect, by the name of that change."""
    base = published_finger(kinematics)
    other_strain: Kinematics = "finite" if kinematics == "small" else "small"

    def finger(**changes: Any) -> Trial:  # noqa: ANN401  lengths and angles
        return Trial(replace(base, finger=replace(base.finger, **changes)))

    return {
        "as published": Trial(base),
        f"{other_strain} strain": Trial(published_finger(other_strain)),
        f"pressed by {_FORCE:g} N/mm": Trial(base, Press(force=_FORCE)),
        "receptor 1 mm proximal": Trial(base, arcs=(-1.0,)),
        "receptor 0.25 mm proximal": Trial(base, arcs=(-0.25,)),
        "receptor 0.25 mm distal": Trial(base, arcs=(0.25,)),
        "receptor 1 mm distal": Trial(base, arcs=(1.0,)),
        "tip radius 6 mm": finger(tip_radius=6.0),
        "tip radius 7 mm": finger(tip_radius=7.0),
        "contact angle 30°": finger(contact_angle=30.0),
        "fat half as stiff": Trial(_scale_stiffness(base, {"fat": 0.5})),
        "epidermis three times as stiff": Trial(_scale_stiffness(base, {"epidermis": 3.0})),
        "pressed a quarter less deep": Trial(base, Press(depth=0.75)),
    }


def map_trials(kinematics: Kinematics) -> Mapping[float, Trial]:
    """Return the published finger with other tip radii [mm], each with every receptor position of the map."""
    base = published_finger(kinematics)
    fingers = {radius: replace(base, finger=replace(base.finger, tip_radius=radius)) for radius in RADII}
    return {radius: Trial(finger, arcs=PLACES) for radius, finger in fingers.items()}


def sample_fingers(points: Array, kinematics: Kinematics) -> list[Trial]:
    """Return the fingers at points (n, numbers) of the design."""
    return [_finger(dict(zip(DESIGN, point, strict=True)), published_finger(kinematics)) for point in points.tolist()]


def _finger(sample: Mapping[str, float], base: Scene) -> Trial:
    radius, epidermis, dermis, bone, angle, *stiff, nu, position, depth, press = sample.values()
    finger = base.finger
    x, y = finger.bone_centre
    scaled = replace(
        finger,
        tip_radius=radius,
        epidermis=epidermis * radius,
        dermis=dermis * radius,
        bone_radius=bone * radius,
        bone_centre=(x * radius / finger.tip_radius, y * radius / finger.tip_radius),
        shaft_length=finger.shaft_length * radius / finger.tip_radius,
        contact_angle=angle,
    )
    scaled_scene = _scale_stiffness(base, dict(zip(("epidermis", "dermis", "fat"), stiff, strict=True)))
    fat = replace(scaled_scene.materials.fat, nu=nu)
    half = base.receptor.ending[0] / 2.0
    receptor_depth = half + depth * ((epidermis + dermis) * radius - 2.0 * half)
    scene = replace(
        scaled_scene,
        finger=scaled,
        materials=replace(scaled_scene.materials, fat=fat),
        receptor=Receptor(depth=receptor_depth, ending=base.receptor.ending),
    )
    return Trial(scene, Press(depth=press), (position,))


def _scale_stiffness(scene: Scene, factors: Mapping[str, float]) -> Scene:
    materials = scene.materials
    layers = {name: replace(materials.of(name), E=factor * materials.of(name).E) for name, factor in factors.items()}
    return replace(scene, materials=replace(materials, **layers))


def finger_answer(trial: Trial) -> Answer | str:
    """Return the answer of one finger, or the reason why it has none."""
    by_quantity = series_slopes(trial.finger, trial.press, trial.arcs)
    if isinstance(by_quantity, str):
        return by_quantity
    return {
        name: [[_plain(slope.with_index) for slope in slopes], [_plain(slope.change) for slope in slopes]]
        for name, slopes in by_quantity.items()
    }


def _plain(numbers: Array) -> list[float | None]:
    return [number if math.isfinite(number) else None for number in numbers.tolist()]


def answers_of(
    trials: Sequence[Trial],
    progress: Callable[[float], None],
    keep: Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
) -> list[Answer | str]:
    """Return the answer of each finger, from processes of this computer or a Dask cluster.

    Each answer is written to `keep`, for the next run. Raises SchedulerError, OSError, TooFewAnswers.
    """
    versions = software_versions()
    keys = [trial.key(versions) for trial in trials]
    by_key = _load_answers(keep)
    remaining = [number for number, key in enumerate(keys) if key not in by_key]
    count = len(trials) - len(remaining)
    if remaining:
        jobs = {keys[number]: (trials[number],) for number in remaining}
        far = scheduler is not None
        answers = by_cluster(finger_answer, jobs, scheduler) if far else by_processes(finger_answer, jobs, workers)
        log = nullcontext() if keep is None else keep.open("a", encoding="utf-8", buffering=1)
        with log as file, closing(answers):
            for key, answer in answers:
                if isinstance(answer, Lost):
                    raise TooFewAnswers(f"a finger has no answer: {answer}; run this again, with --keep from there")
                by_key[key] = answer
                if file is not None:
                    file.write("\n" + json.dumps({"key": key, "answer": answer}))
                count += 1
                progress(count / len(trials))
    return [by_key[key] for key in keys]


def _load_answers(keep: Path | None) -> dict[str, Any]:
    """Return the answers in a file, without a line that a crash cut short. Raises OSError."""
    content = keep.read_bytes().strip() if keep is not None and keep.exists() else b""
    if content and not content.startswith(b'{"key": "'):  # never append to another kind of file
        raise OSError(errno.EEXIST, "it does not hold answers", str(keep))
    answers: dict[str, Any] = {}
    for line in content.splitlines():
        with suppress(ValueError, KeyError):
            entry = json_object(line)
            answers[entry["key"]] = entry["answer"]
    return answers


def same_signs(answers: Sequence[Answer | str], as_published: Answer) -> Array:
    """Return for each quantity whether it keeps the published signs in both series (n, q): 1, 0, or nan (no answer)."""
    published = _signs(as_published)
    rows = [np.full(published.shape, np.nan) if isinstance(answer, str) else _signs(answer) for answer in answers]
    return np.array([np.where(np.isnan(row).any(axis=0), np.nan, (row == published).all(axis=0)) for row in rows])


def _signs(answer: Answer) -> Array:
    """Return the signs of the correlations with the index (series, q) at the first position; nan if unknown."""
    return np.sign(np.array([answer[name][0][0] for name in SERIES], np.float64))


def share(outcomes: Array) -> tuple[float, float, float] | None:
    """Return the share of ones among numbers (n,), nan left out, with its 95 % interval; None without numbers."""
    finite = outcomes[np.isfinite(outcomes)]
    return (mean := float(finite.mean()), *share_interval(mean, len(finite))) if len(finite) else None


def shares_by_thirds(outcomes: Array, values: Array) -> list[tuple[float, float, float | None]]:
    """Return the share of ones among `outcomes` (n,) in each third of the range of `values` (n,), with its ends.

    >>> shares_by_thirds(np.array([1.0, 1.0, 0.0]), np.array([0.0, 1.0, 3.0]))
    [(0.0, 1.0, 1.0), (1.0, 2.0, None), (2.0, 3.0, 0.0)]
    """
    low, high = float(values.min()), float(values.max())
    edges = [low + third * (high - low) / 3.0 for third in range(4)]
    third_of = np.clip(np.searchsorted(edges, values, side="left") - 1, 0, 2)
    shares = [share(outcomes[third_of == third]) for third in range(3)]
    return [(*pair, None if share is None else share[0]) for pair, share in zip(pairwise(edges), shares, strict=True)]


def slope_indices(
    answers: Sequence[Answer | str], series: str, quantity: int, seed: int
) -> tuple[tuple[Index, ...], int]:
    """Return the Sobol indices of a quantity's change over a series, and the number of fingers in complete blocks."""
    block = len(DESIGN) + 2
    changes = [None if isinstance(answer, str) else answer[series][1][0][quantity] for answer in answers]
    values = np.array(changes, np.float64).reshape(-1, block)  # nan for None
    complete_blocks = values[np.isfinite(values).all(axis=1)]
    if len(complete_blocks) < 2:
        return (), 0
    return sobol_indices(DESIGN, complete_blocks.ravel(), seed), complete_blocks.size
