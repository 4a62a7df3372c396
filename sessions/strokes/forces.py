"""Forces at the stimulus's face: the wrench in the face frame, its zero-phase filter, ratio and centre of pressure.

The filter is SciPy's compiled loop, loaded without the rest of `scipy.signal`, whose import takes ten times as long as
the analysis of a session. `scipy.signal` itself is used where a SciPy has another layout.
"""

from dataclasses import dataclass
from functools import cache
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.arrays import Array
from sessions.plan.plan import Frame


def low_pass(values: Array, cut_off: float, rate: float, padding: int) -> Array:
    """Return values (n, k) through a second-order Butterworth low-pass, forwards and then backwards.

    One pass is 3 dB down at `cut_off` [Hz], by the bilinear transform for readings at `rate` [Hz]. Both ends are
    extended by `padding` < n readings, by odd reflection; the filter starts in its steady state for the first of them.
    """
    warped = float(np.tan(np.pi * cut_off / rate))
    denominator = 1.0 + np.sqrt(2.0) * warped + warped * warped
    gain = warped * warped / denominator
    a1, a2 = 2.0 * (warped * warped - 1.0) / denominator, (1.0 - np.sqrt(2.0) * warped + warped * warped) / denominator
    sections = np.array([[gain, 2.0 * gain, gain, 1.0, a1, a2]])
    kernel = _compiled_filter()
    if kernel is None:
        from scipy import signal

        return signal.sosfiltfilt(sections, values, axis=0, padlen=padding)
    lead, trail = 2.0 * values[:1] - values[padding:0:-1], 2.0 * values[-1:] - values[-2 : -padding - 2 : -1]
    rows = np.ascontiguousarray(np.concatenate([lead, values, trail]).T)  # (k, n + 2 padding), filtered in place
    state = np.array([1.0 - gain, gain - a2])  # the filter's state after constant input
    for _ in range(2):
        kernel(sections, rows, (rows[:, :1] * state)[:, None, :])
        rows = np.ascontiguousarray(rows[:, ::-1])
    return rows.T[padding : len(rows[0]) - padding]


@cache
def _compiled_filter() -> Any:  # noqa: ANN401 - compiled, without types
    """Return the loop of `scipy.signal.sosfilt`, None where this SciPy has it elsewhere."""
    package = find_spec("scipy")
    folder = Path(package.origin).parent / "signal" if package is not None and package.origin else Path()
    spec = PathFinder.find_spec("scipy.signal._sosfilt", [str(folder)])
    if spec is None or spec.loader is None:
        return None
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except ImportError:  # a SciPy that must first locate its libraries
        return None
    return getattr(module, "_sosfilt", None)


def peaks(values: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the positions (p,) of local maxima of values (n,), and their prominences (p,).

    A flat top counts once, at its middle. Prominence is above the higher of the minima before a higher top or end.
    """
    firsts = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    lasts = np.append(firsts[1:], len(values)) - 1
    level = values[firsts]
    tops = 1 + np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:]))
    positions = (firsts[tops] + lasts[tops]) // 2

    def base(neighbours: Array, peak: float) -> float:
        higher = np.flatnonzero(neighbours > peak)
        return float(neighbours[: higher[0] if len(higher) else None].min())

    bases = [max(base(values[top::step], float(values[top])) for step in (-1, 1)) for top in positions.tolist()]
    return positions, values[positions] - np.array(bases)


_AXES = {"x": 0, "y": 1, "z": 2}
# -3 dB of a second-order Butterworth run forwards and backwards is at the -3 dB frequency of one pass divided by this.
_TWO_PASSES = (np.sqrt(2.0) - 1.0) ** -0.25


@dataclass(frozen=True, slots=True)
class Filter:
    """A zero-phase low-pass Butterworth filter: second order, forwards and backwards."""

    cut_off: float  # -3 dB of both passes together [Hz]
    shortest_segment: int  # readings; fewer have no filtered value

    @property
    def sentence(self) -> str:
        """Description of the filter, for people."""
        return (
            "zero-phase Butterworth low-pass, second order forwards and backwards, -3 dB of both passes together at "
            f"{self.cut_off:g} Hz; forces were filtered before the ratio was formed, and never across a gap"
        )

    def apply(self, values: Array, rate: float, segments: list[slice]) -> Array:
        """Return values (n, k) filtered within each segment [positions]; nan outside them and in the shortest ones."""
        filtered = np.full_like(values, np.nan)
        # The bilinear transform warps frequencies by the tangent: the factor applies to warped ones.
        design = rate / np.pi * np.arctan(_TWO_PASSES * np.tan(np.pi * self.cut_off / rate))
        for segment in segments:
            length = segment.stop - segment.start
            if length >= self.shortest_segment:
                padding = min(length - 1, int(np.ceil(3.0 * rate / self.cut_off)))
                filtered[segment] = low_pass(values[segment], design, rate, padding)
        return filtered

    def fits(self, rate: float) -> bool:
        """Say whether readings at `rate` [Hz] are dense enough for the filter."""
        return rate >= 2.5 * self.cut_off * _TWO_PASSES


def in_face_frame(wrench: Array, frame: Frame) -> Array:
    """Return the wrench (n, 6) [N, N mm] rotated so that +z points out of the face; pressing is Fz < 0.

    "-z" changes nothing; "-x" and "-y" permute the axes cyclically (x y z -> y z x, z x y); a "+" normal then rotates
    by 180 degrees about the new x axis. All of these are rotations, so torques rotate with the forces.

    >>> in_face_frame(np.array([[1.0, 2, 3, 4, 5, 6]]), Frame(normal="+z"))
    array([[ 1., -2., -3.,  4., -5., -6.]])
    """
    axis = _AXES[frame.normal[1]]
    order = [(axis + 1) % 3, (axis + 2) % 3, axis]
    signs = np.array([1.0, 1.0, 1.0] if frame.normal[0] == "-" else [1.0, -1.0, -1.0])
    return np.hstack([wrench[:, order] * signs, wrench[:, [3 + i for i in order]] * signs])


def level(wrench: Array, lean: tuple[float, float]) -> Array:
    """Return a wrench (n, 6) of the face frame rotated so that +z is the normal of a tilted face; `lean` [degrees].

    The smallest such rotation; torques rotate with the forces.

    >>> (level(np.array([[-1.0, 0, 0, 0, 0, 0]]), (90.0, 0.0)).round(9) + 0.0).tolist()
    [[0.0, 0.0, -1.0, 0.0, 0.0, 0.0]]
    """
    if lean == (0.0, 0.0):
        return wrench
    x, y = np.radians(lean)
    angle = float(np.hypot(x, y))
    axis = np.array([y, -x, 0.0]) / angle  # rotates the normal back to z
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    rotation = np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew
    return np.hstack([wrench[:, :3] @ rotation.T, wrench[:, 3:] @ rotation.T])


def normal_force(wrench: Array, frame: Frame) -> Array:
    """Return the normal force (n,) [N], positive when pressing, of a wrench (n, 6) as the transducer gives it."""
    return wrench[:, _AXES[frame.normal[1]]] * (1.0 if frame.normal[0] == "+" else -1.0)


def centre_of_pressure(wrench: Array, height: float) -> Array:
    """Return the centre of pressure on the face (n, 2) [mm]: x = (Ty - h Fx)/N, y = -(Tx + h Fy)/N.

    `wrench` (n, 6) is zeroed and in the face frame, `height` [mm] is the face's height above the transducer's origin.
    nan where nothing presses.

    >>> centre_of_pressure(np.array([[0.0, 0, -2, -6, 8, 0]]), 20.0)
    array([[4., 3.]])
    """
    normal = -wrench[:, 2]
    load = np.where(normal > 0.0, normal, np.nan)
    x = (wrench[:, 4] - height * wrench[:, 0]) / load
    y = -(wrench[:, 3] + height * wrench[:, 1]) / load
    return np.column_stack([x, y])


def friction_ratio(wrench: Array, floor: float) -> Array:
    """Return T/N (n,) [-] of a zeroed wrench (n, 6) in the face frame; nan where N is below `floor` [N]."""
    normal = -wrench[:, 2]
    load = np.where(normal >= floor, normal, np.nan)
    return np.hypot(wrench[:, 0], wrench[:, 1]) / load


def mean_vector(vectors: Array) -> Array:
    """Return the mean (k,) of vectors (n, k), leaving out nan; nan without any."""
    finite = vectors[np.isfinite(vectors).all(axis=1)]
    return np.asarray(finite.mean(axis=0) if len(finite) else np.full(vectors.shape[1], np.nan), np.float64)
