"""How the tissues of a finger relax, from presses that are held: part g and time tau of one Prony term.

All layers relax alike. The force is then the elastic one for the depth so far, less what has relaxed of it
(quasi-linear viscoelasticity: Fung 1993, Biomechanics, section 7.6):

N(t) = a [(1 - g) e(t) + g h(t)], dh/dt = de/dt - h / tau,

with e(t) the force of the finger that was fitted, whose size a is found anew, since a press is too slow to be elastic.
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
GRID_SIZE = 60  # values of each number in one round, between bounds that narrow from round to round
_ROUNDS = 5  # most rounds
_FINE = 12.0  # values of each number that carry the posterior at the end (inverse Simpson index)
TURNS, _AGREED = 8, 0.003  # most alternations of finger and relaxation, and the change of the part that ends them [-]
LEAST_PART = 0.01  # a part that may be less cannot be distinguished from none [-]
LARGEST_PART = 0.95  # a scene allows 0.99 [-]
_LONGEST = 10.0  # longest relaxation time tried, by the longest hold; the shortest is a block [-]
_FEWEST = 10  # fewest blocks beyond the unknown numbers


class HoldCurve(NamedTuple):
    """One press from its touch to the end of its hold: n readings."""

    time: Array  # (n,) [s]
    displacement: Array  # (n,) as the log has it [mm]
    force: Array  # (n,) normal [N]

    @property
    def fall(self) -> float:
        """By how much the force falls from its greatest to the end, in means over a block, by the greatest [-]."""
        force = _means(np.floor((self.time - self.time[0]) / BLOCK).astype(np.int64), self.force)
        return float(1.0 - force[-1] / force.max())

    def unrelaxed(self, part: float, tau: float) -> "HoldCurve":
        """Return the press with the forces that it would have had if nothing had relaxed since its touch."""
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
    """What is known of one Prony term that all layers share."""

    part: Interval  # g [-]
    time: Interval  # tau [s]
    at_once: float  # stiffness at once by that of the finger fitted as if it were elastic [-]
    sentence: str

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return msgspec.to_builtins(self)

    def relaxing(self, scene: Scene) -> Scene:
        """Return `scene` with layers that relax, as stiff at once as found; unchanged where the part may be none."""
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
    """Return the stiffnesses at once of a finger that relaxes, and how it does, from presses that are all held.

    A press is too slow to be elastic, and what relaxes on its way bends the force over depth. So both are found in
    turns: the relaxation for the finger, and the finger for forces without the relaxation. Raises
    FitError where no press is held.
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
    """Return how a finger relaxes in presses that are held.

    g is equally likely from 0 to 0.95 before, tau equally likely in its logarithm; a and the noise are integrated in
    closed form, as for the stiffness. Raises FitError where no press is held.
    """
    if not holds:
        raise FitError("No press is held: let the stage stand for half a second or more before it lifts.")
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
    """Return the log posterior (g, t) of parts (g,) and times (t,), and the stiffness at once that fits best (g, t).

    `elastic` are the forces (n,) of each press without relaxing, which the model knows but for an `error` [-].
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
    """Return bounds about the values (n,) that carry a weight."""
    carry = np.flatnonzero(weight > 1e-6 * weight.max())
    return float(values[max(carry[0] - 1, 0)]), float(values[min(carry[-1] + 1, len(values) - 1)])


def _interval(values: Array, weight: Array) -> tuple[float, float]:
    """Return the ends of a 95 % interval of values (n,) of a weight."""
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
