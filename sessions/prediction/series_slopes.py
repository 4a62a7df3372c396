"""Whether a response rises or falls over a series of surfaces, and on which fingers: the sign of the model's answer.

A series is the five published surfaces of one descriptor, stroked in its direction and pressed to its depth. A finger
is a scene whose own friction and loading do not matter here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solver import Friction, Loading, Scene, SceneError, Solve
from solver.quantities import NAMES
from solver.response.receptor_row import rough_responses
from solver.scene.published import SLIPPERINESS, STICKINESS, Surface
from solver.scene.published import scene as published

Array = NDArray[np.float64]

SERIES: Mapping[str, tuple[Surface, ...]] = {"stickiness": STICKINESS, "slipperiness": SLIPPERINESS}
SED = NAMES.index("sed")
LEAST = 3  # surfaces with a settled state that a slope is taken of


@dataclass(frozen=True, slots=True)
class Press:
    """How the finger is pressed: to a share of each series' own depth, or by one force."""

    depth: float = 1.0  # of the published depth of the series [-]
    force: float | None = None  # [N/mm], in place of a depth


@dataclass(frozen=True, slots=True)
class Slopes:
    """How every quantity at the ending goes with the surfaces of one series. nan where too few have an answer."""

    surfaces: int  # with a settled state
    with_mu: Array  # (q,) correlation with the coefficient of friction [-]
    with_index: Array  # (q,) correlation with the maker's index [-]
    change: Array  # (q,) by the least-squares line over the range of mu, by the mean size; its sign is the slope's [-]


def series_slopes(
    finger: Scene, press: Press | None = None, arcs: Sequence[float] = (0.0,)
) -> Mapping[str, tuple[Slopes, ...]] | str:
    """Return for each series the slopes at receptors at arc positions [mm] along the skin, or why there are none.

    Settled sliding at the kinematics of `finger`. A surface without a settled state is left out of its series.
    """
    surfaces = [surface for series in SERIES.values() for surface in series]
    try:
        responses = rough_responses([_scene(finger, surface, press or Press()) for surface in surfaces], arcs)
    except SceneError as unfit:
        return str(unfit)
    out: dict[str, tuple[Slopes, ...]] = {}
    for name, series in SERIES.items():
        rows = [number for number, surface in enumerate(surfaces) if surface.descriptor == name]
        out[name] = tuple(_slopes(series, responses[rows, :, place]) for place in range(len(arcs)))
    return out


def other_signs(finger: Scene) -> list[str]:
    """Return a sentence for each series over which the SED goes another way on a finger than on the published one.

    Both at the kinematics of `finger`, pressed to the published depths; [] for the published finger itself.
    """
    base = Scene(friction=Friction(0.0), loading=Loading(1.0), solve=Solve(finger.solve.kinematics))
    own = replace(finger.finger, width=base.finger.width), finger.materials, finger.receptor
    if own == (base.finger, base.materials, base.receptor):
        return []
    here, there = series_slopes(finger), series_slopes(base)
    if isinstance(here, str) or isinstance(there, str):
        return []
    changes = {name: (float(here[name][0].change[SED]), float(there[name][0].change[SED])) for name in SERIES}
    return [
        f"On this finger the SED goes the other way with µ than on the published one, over its surfaces of {name}: by "
        f"{100 * mine:+.0f} % and {100 * published:+.0f} % of the mean from the least to the greatest µ, at the "
        "published depth. What the scores say of the model hangs on the finger that is assumed.".replace("-", "−")
        for name, (mine, published) in changes.items()
        if mine * published < 0.0
    ]


def _scene(finger: Scene, surface: Surface, press: Press) -> Scene:
    of_surface = published(surface)
    loading = of_surface.loading
    if press.force is not None:
        loading = replace(loading, indentation=None, normal_force=press.force)
    else:
        loading = replace(loading, indentation=press.depth * loading.depth)
    settled = replace(finger.solve, course="steady")
    return replace(finger, friction=of_surface.friction, loading=loading, solve=settled)


def _slopes(series: Sequence[Surface], responses: Array) -> Slopes:
    """Return the slopes of responses (n, q) over the surfaces of a series."""
    known = np.isfinite(responses).all(axis=1)
    count = int(known.sum())
    none = np.full(responses.shape[1], np.nan)
    if count < LEAST:
        return Slopes(count, none, none, none)
    values = responses[known]
    mu, index = (np.array(column)[known] for column in zip(*((s.mu, float(s.index)) for s in series), strict=True))
    slope = (mu - mu.mean()) @ (values - values.mean(axis=0)) / np.sum((mu - mu.mean()) ** 2)
    change = slope * np.ptp(mu) / np.abs(values).mean(axis=0)
    return Slopes(count, _correlation(mu, values), _correlation(index, values), change)


def _correlation(x: Array, values: Array) -> Array:
    """Return Pearson's correlation of x (n,) with each column of values (n, q)."""
    apart, off = x - x.mean(), values - values.mean(axis=0)
    return apart @ off / np.sqrt(np.sum(apart**2) * np.sum(off**2, axis=0))
