"""Relaxation of a finger's tissues from held presses: part g and time tau of one Prony term.

All layers relax equally. The force is then the elastic one for the present depth, less its relaxed part (quasi-linear
viscoelasticity: Fung 1993, Biomechanics, section 7.6):

N(t) = a [(1 - g) e(t) + g h(t)], dh/dt = de/dt - h / tau,

with e(t) the force of the fitted finger, whose scale a is fitted again, since a press is too slow to be elastic.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import msgspec
import numpy as np

from drivers.arrays import Array, Indices
from sessions.prediction.finger_fit import QUANTILES, FingerFit, Interval, LoadingCurve, fit
from sessions.prediction.press_model import LAYERS, FitError, PressModel
from solver import Relaxation, Scene

BLOCK = 0.05  # averaging time of the forces compared: about the correlation time of a filter at 20 Hz [s]
GRID_SIZE = 60  # values of each parameter in one round; bounds narrow between rounds
_ROUNDS = 5  # most rounds
_FINE = 12.0  # values of each parameter that carry the final posterior (inverse Simpson index)
TURNS, _AGREED = 8, 0.003  # most alternations of finger and relaxation, and the change of g that ends them [-]
LEAST_PART = 0.01  # a g that may be smaller is indistinguishable from 0 [-]
LARGEST_PART = 0.95  # a scene allows 0.99 [-]
_LONGEST = 10.0  # longest relaxation time relative to the longest hold; the shortest is a block [-]
_FEWEST = 10  # fewest blocks beyond the unknowns


class HoldCurve(NamedTuple):
    """One press from its touch to the end of its hold: n readings."""

    time: Array  # (n,) [s]
    displacement: Array  # (n,) from the log [mm]
    force: Array  # (n,) normal [N]

    @property
    def fall(self) -> float:
        """Relative fall of the force from its greatest block mean to the last [-]."""
        force = _means(np.floor((self.time - self.time[0]) / BLOCK).astype(np.int64), self.force)
        return float(1.0 - force[-1] / force.max())

    def unrelaxed(self, part: float, tau: float) -> "HoldCurve":
        """Return the press with the forces it would have without relaxation since its touch."""
        forces = np.empty(len(self.force))
        forces[0] = memory = self.force[0]
        for index in range(1, len(forces)):
            step = float(self.time[index] - self.time[index - 1]) / tau
            decay, growth = np.exp(-step), -np.expm1(-step) / step
            elastic = self.force[index] - part * (decay * memory - growth * forces[index - 1])
            forces[index] = elastic / (1.0 - part + part * growth)
            memory = decay * memory + growth * (forces[index] - forces[index - 1])
        return self._replace(force=forces)


@dataclass(frozen=True, slots=True)
class RelaxationFit:
    """Estimates of one Prony term shared by all layers."""

    part: Interval  # g [-]
    time: Interval  # tau [s]
    at_once: float  # instantaneous stiffness relative to that of the elastic fit [-]
    sentence: str

    def to_dict(self) -> dict[str, Any]:
        """Return the fit as plain data."""
        return msgspec.to_builtins(self)

    def relaxing(self, scene: Scene) -> Scene:
        """Return `scene` with relaxing layers of the fitted instantaneous stiffness; unchanged where g may be 0."""
        if _may_be_none(self.part):
            return scene
        term = (Relaxation(self.part.value, self.time.value),)
        layers = {name: scene.materials.of(name) for name in LAYERS}
        prony_layers = {name: replace(layer, E=layer.E * self.at_once, prony=term) for name, layer in layers.items()}
        return replace(scene, materials=replace(scene.materials, **prony_layers))


def relaxing_fit(
    model: PressModel,
    presses: Sequence[LoadingCurve],
    holds: Sequence[HoldCurve],
    gain_error: float = 0.0,
    seed: int = 0,
) -> tuple[FingerFit, RelaxationFit]:
    """Return instantaneous stiffnesses and relaxation of a finger, from presses that are all held.

    A press is too slow to be elastic, and relaxation during loading bends the force over depth. So both are fitted in
    turns: the relaxation for the finger, and the finger for forces without relaxation. Raises FitError where no press
    is held.
    """
    finger_fit = fit(model, presses, gain_error, seed)
    rate = relaxation(model, finger_fit, holds)
    for _ in range(TURNS):
        previous = rate.part.value
        unrelaxed: list[LoadingCurve] = []
        for press, hold in zip(presses, holds, strict=True):
            force = hold.unrelaxed(rate.part.value, rate.time.value).force[: press.readings]
            curve = LoadingCurve.of(hold.displacement[: press.readings], force, np.zeros(press.readings))
            unrelaxed.append(press._replace(force=curve.force))
        finger_fit = fit(model, unrelaxed, gain_error, seed)
        rate = relaxation(model, finger_fit, holds)
        if abs(rate.part.value - previous) < _AGREED:
            break
    return finger_fit, rate


def relaxation(model: PressModel, finger_fit: FingerFit, holds: Sequence[HoldCurve]) -> RelaxationFit:
    """Return the relaxation of a finger in held presses.

    The prior is uniform in g from 0 to 0.95 and in the logarithm of tau; a and the noise are integrated in
    closed form, as for the stiffness. Raises FitError where no press is held.
    """
    if not holds:
        raise FitError("No press is held: hold the stage still for half a second or more before it lifts.")
    stiffness = np.array([finger_fit.scene.materials.of(name).E for name in LAYERS])
    elastic = [
        model.force(stiffness, hold.displacement - touch) for hold, touch in zip(holds, finger_fit.touch, strict=True)
    ]
    limits = (0.0, LARGEST_PART), (BLOCK, _LONGEST * max(float(np.ptp(hold.time)) for hold in holds))
    bounds, rounds = limits, 0
    while True:
        rounds += 1
        part_grid: Array = np.linspace(*bounds[0], GRID_SIZE)
        time_grid = np.geomspace(*bounds[1], GRID_SIZE)
        log_posterior, at_once = _posterior(holds, elastic, part_grid, time_grid, model.error)
        weight = np.exp(log_posterior - log_posterior.max())
        marginal: tuple[Array, Array] = (weight.sum(axis=1), weight.sum(axis=0))
        if rounds == _ROUNDS or min(float(sums.sum() ** 2 / (sums**2).sum()) for sums in marginal) >= _FINE:
            break
        bounds = _about(part_grid, marginal[0]), _about(time_grid, marginal[1])
    best = np.unravel_index(int(log_posterior.argmax()), log_posterior.shape)
    low, high = _interval(part_grid, marginal[0])
    part = Interval(float(part_grid[best[0]]), low, None if high >= LARGEST_PART else high)
    low, high = _interval(time_grid, marginal[1])
    shortest, longest = limits[1][0] * (1.0 + 1e-6), limits[1][1] / (1.0 + 1e-6)
    time = Interval(float(time_grid[best[1]]), None if low <= shortest else low, None if high >= longest else high)
    return RelaxationFit(part, time, float(at_once[best]), _sentence(part, time))


def _posterior(
    holds: Sequence[HoldCurve], elastic: Sequence[Array], parts: Array, times: Array, error: float
) -> tuple[Array, Array]:
    """Return the log posterior (g, t) of parts (g,) and times (t,), and the best instantaneous stiffness (g, t).

    `elastic` are each press's forces (n,) without relaxation, with a relative `error` of the model [-].
    """
    misfit, spread, size = np.zeros((3, len(parts), len(times)))
    count = 0
    for hold, unrelaxed in zip(holds, elastic, strict=True):
        block = np.floor((hold.time - hold.time[0]) / BLOCK).astype(np.int64)
        columns = (hold.force, unrelaxed, _decay(hold.time, unrelaxed, times))
        force, base, memory = (_means(block, column) for column in columns)
        shape = base[:, None, None] + parts[:, None] * (memory - base[:, None])[:, None, :]  # (n, g, t)
        square = (shape**2).sum(axis=0)
        factor = np.einsum("n,ngt->gt", force, shape) / square
        misfit += ((factor * shape - force[:, None, None]) ** 2).sum(axis=0) + float(np.sum((error * force) ** 2))
        spread += np.log(square)
        size += np.log(factor) / len(holds)
        count += len(force)
    dof = count - len(holds)
    if dof < _FEWEST:
        raise FitError(f"Presses are held for {count * BLOCK:.2g} s in all, which is too short: hold them longer.")
    return -(dof * np.log(misfit) + spread) / 2.0, np.exp(size)


def _decay(time: Array, elastic: Array, times: Array) -> Array:
    """Return h (n, t) for an elastic force (n,) linear between instants, exactly (Taylor, Pister and Goudreau 1970)."""
    memory = np.zeros((len(time), len(times)))
    memory[0] = elastic[0]
    for index in range(1, len(time)):
        step = (time[index] - time[index - 1]) / times
        rise = elastic[index] - elastic[index - 1]
        memory[index] = np.exp(-step) * memory[index - 1] - np.expm1(-step) / step * rise
    return memory


def _means(block: Indices, values: Array) -> Array:
    """Return the means (b, ...) of values (n, ...) over blocks numbered (n,) in order."""
    firsts = np.flatnonzero(np.diff(block, prepend=-1))
    counts = np.diff(np.append(firsts, len(block)))
    return (np.add.reduceat(values, firsts, axis=0).T / counts).T


def _about(values: Array, weight: Array) -> tuple[float, float]:
    """Return bounds of the values (n,) with non-negligible weight."""
    carry = np.flatnonzero(weight > 1e-6 * weight.max())
    return float(values[max(carry[0] - 1, 0)]), float(values[min(carry[-1] + 1, len(values) - 1)])


def _interval(values: Array, weight: Array) -> tuple[float, float]:
    """Return the ends of the 95 % interval of weighted values (n,)."""
    sums = np.cumsum(weight) / weight.sum()
    low, high = (float(values[int(np.searchsorted(sums, share))]) for share in QUANTILES)
    return low, high


def _may_be_none(part: Interval) -> bool:
    return part.low is not None and part.low < LEAST_PART


def _sentence(part: Interval, time: Interval) -> str:
    if _may_be_none(part):
        return "The holds do not show that the finger relaxes: the part that does may be none."
    if time.high is None or part.high is None:
        return "The finger still relaxes when the holds end: hold longer to know how far and for how long it goes on."
    if time.low is None:
        return "The finger has relaxed before readings can follow it: the time is an upper bound alone."
    return (
        f"After the hold {100 * (1.0 - part.value):.0f} % of the stiffness at once is left; the rest goes with "
        f"{time.value:.2g} s."
    )
