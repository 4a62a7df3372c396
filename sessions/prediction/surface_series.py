"""Responses to series of surfaces: their slopes on a finger, and their values in simulated strokes.

A series is the five published surfaces of one descriptor, stroked in its direction and pressed to its depth. A finger
is a scene whose friction and loading are ignored here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivers.arrays import Array
from sessions.strokes.stroke import digits
from solver import Friction, Loading, Scene, SceneError, Solve
from solver.quantities import NAMES
from solver.response.receptor_row import rough_responses
from solver.scene.published import SLIPPERINESS, STICKINESS, Surface, scene

SERIES: Mapping[str, tuple[Surface, ...]] = {"stickiness": STICKINESS, "slipperiness": SLIPPERINESS}
_SED = NAMES.index("sed")
_LEAST = 3  # surfaces with a settled state for a slope


@dataclass(frozen=True, slots=True)
class Press:
    """Load of the finger: a share of each series' own depth, or one force."""

    depth: float = 1.0  # of the published depth of the series [-]
    force: float | None = None  # [N/mm], in place of a depth


@dataclass(frozen=True, slots=True)
class Slopes:
    """The relation of each quantity at the ending to the surfaces of a series; nan where too few settle."""

    surfaces: int  # with a settled state
    with_index: Array  # (q,) correlation with the maker's index [-]
    change: Array  # (q,) of the line over the range of mu, relative to the mean size, with the slope's sign [-]


def series_slopes(
    finger: Scene, press: Press | None = None, arcs: Sequence[float] = (0.0,)
) -> Mapping[str, tuple[Slopes, ...]] | str:
    """Return the slopes of each series at receptors at arc positions [mm] along the skin, or why there are none.

    Settled sliding at the kinematics of `finger`. A surface without a settled state is left out of its series.
    """
    surfaces = [surface for series in SERIES.values() for surface in series]
    try:
        responses = rough_responses([_scene(finger, surface, press or Press()) for surface in surfaces], arcs)
    except SceneError as unfit:
        return str(unfit)
    slopes: dict[str, tuple[Slopes, ...]] = {}
    for name, series in SERIES.items():
        rows = [number for number, surface in enumerate(surfaces) if surface.descriptor == name]
        slopes[name] = tuple(_slopes(series, responses[rows, :, arc]) for arc in range(len(arcs)))
    return slopes


def other_signs(finger: Scene) -> list[str]:
    """Return a sentence for each series with opposite slopes of the SED on a finger and on the published one.

    Both at the kinematics of `finger`, pressed to the published depths; [] for the published finger itself.
    """
    base = Scene(friction=Friction(0.0), loading=Loading(1.0), solve=Solve(finger.solve.kinematics))
    model = replace(finger.finger, width=base.finger.width), finger.materials, finger.receptor
    if model == (base.finger, base.materials, base.receptor):
        return []
    slopes, base_slopes = series_slopes(finger), series_slopes(base)
    if isinstance(slopes, str) or isinstance(base_slopes, str):
        return []
    changes = {name: (float(slopes[name][0].change[_SED]), float(base_slopes[name][0].change[_SED])) for name in SERIES}
    return [
        f"Over the surfaces of {name} the SED {_change(mine)} as µ rises, at the published depth; on the published "
        f"finger it {_change(published)}. What the scores say of the model depends on the assumed finger."
        for name, (mine, published) in changes.items()
        if mine * published < 0.0
    ]


def _change(share: float) -> str:
    """Return a change relative to the mean in words.

    >>> _change(-0.042)
    'falls by 4 %'
    """
    return f"{'rises' if share > 0.0 else 'falls'} by {digits(100 * abs(share), 0)} %"


def _scene(finger: Scene, surface: Surface, press: Press) -> Scene:
    reference = scene(surface)
    depth = press.depth * reference.loading.depth if press.force is None else None
    loading = replace(reference.loading, indentation=depth, normal_force=press.force)
    steady = replace(finger.solve, course="steady")
    return replace(finger, friction=reference.friction, loading=loading, solve=steady)


def _slopes(series: Sequence[Surface], responses: Array) -> Slopes:
    """Return the slopes of responses (n, q) over the surfaces of a series."""
    finite = np.isfinite(responses).all(axis=1)
    count = int(finite.sum())
    none = np.full(responses.shape[1], np.nan)
    if count < _LEAST:
        return Slopes(count, none, none)
    values = responses[finite]
    mu = np.array([surface.mu for surface in series])[finite]
    index = np.array([float(surface.index) for surface in series])[finite]
    slope = (mu - mu.mean()) @ (values - values.mean(axis=0)) / np.sum((mu - mu.mean()) ** 2)
    change = slope * np.ptp(mu) / np.abs(values).mean(axis=0)
    return Slopes(count, np.corrcoef(index, values, rowvar=False)[0, 1:], change)


PERSON, _STROKE = 0.08, 0.05  # standard deviation of ln mu between people, and from stroke to stroke [-]
_PRESS = 0.2  # standard deviation of ln N from stroke to stroke [-]
AREA = 100.0  # of the contact [mm2]
USUAL_SPEED = 20.0  # [mm/s]
STIFFNESS = 1.2  # normal force over depth^1.5, as for a Hertz sphere: 3.4 N at 2 mm [N/mm^1.5]


@dataclass(frozen=True, slots=True)
class StudyDesign:
    """Strokes of each subject of a study: every surface at every depth."""

    mu: tuple[float, ...]  # of each surface
    force: tuple[float, ...]  # usual normal force in each trial, ordered by depth, then by surface [N]
    speed: tuple[float, ...]  # usual speed in each trial [mm/s]
    depths: tuple[float, ...] = (2.0,)  # [mm]

    @classmethod
    def even(cls, surfaces: int, depths: tuple[float, ...]) -> "StudyDesign":
        """Return a design whose friction is evenly spaced over the range of the published surfaces."""
        mu = np.linspace(0.24, 0.67, surfaces).tolist()
        force = tuple(STIFFNESS * depth**1.5 for depth in depths for _ in mu)
        return cls(tuple(mu), force, (USUAL_SPEED,) * len(force), depths)


def simulated_strokes(design: StudyDesign, people: int, draw: np.random.Generator) -> Mapping[str, Array]:
    """Return every quantity of each simulated stroke (people, surfaces within depths); nan without a state.

    Friction, its bound and the normal force vary by stroke; the model has the published finger.
    """
    shape = (people, len(design.mu) * len(design.depths))
    moist = PERSON * draw.standard_normal((people, 1)) + _STROKE * draw.standard_normal(shape)
    mu = np.tile(design.mu, len(design.depths)) * np.exp(moist)
    normal = np.array(design.force) * np.exp(_PRESS * draw.standard_normal(shape))
    tau = mu * normal / AREA
    base = scene(STICKINESS[0])
    steady = replace(base.solve, course="steady")
    depths = np.tile(np.repeat(design.depths, len(design.mu)), people)
    loadings = [replace(base.loading, indentation=depth) for depth in depths]
    scenes = [
        replace(base, friction=Friction(*friction), loading=loading, solve=steady)
        for *friction, loading in zip(mu.flat, tau.flat, loadings, strict=True)
    ]
    responses = rough_responses(scenes)[:, :, 0].reshape(*shape, len(NAMES))
    speed = np.array(design.speed) * np.exp(_STROKE * draw.standard_normal(shape))
    measured = {"mu": mu, "tau_max": tau, "N": normal, "speed": speed}
    return measured | {name: responses[:, :, number] for number, name in enumerate(NAMES)}
