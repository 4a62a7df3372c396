"""Posterior of the stiffness of a subject's own finger, from presses with recorded force and depth.

Each layer's log stiffness has a normal prior about the published one; noise of the force is Gaussian of unknown size
(Jeffreys' prior). The touch of the stage is unknown too, for each press. Given the two contrasts between layers, the
rest is almost linear and integrated in closed form (Laplace; Student's t for unknown noise: Gelman et al. 2013,
Bayesian Data Analysis, sections 3.2 and 14.2). The two remaining dimensions are integrated on a grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgspec
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.special import ndtri, softmax

from drivers.arrays import Array
from sessions.prediction.press_model import CONTRASTS, LAYERS, REACH, FitError, PressModel, at_depths
from solver import Scene

_POINTS = 16  # of one press, means over equal parts of its travel: noise of single readings is no error of the model
CHI_SQUARED = 3.841  # 95 % of chi squared with one degree of freedom
# The shares are shifts of interval ends by halving and doubling, relative to the width, over twelve simulated fingers.
_DRAWS = 20_000  # of the posterior: 0.2 % in the median
_FEWEST = 6  # points of depth and force beyond the unknowns; fewer hardly estimate the noise
_GRID = 25  # contrasts along each axis: 0.5 % with 49, 2 % with 13 in the median
_ROUNDS, SETTLED = 12, 1e-5  # of the search for touches: 0.2 % at most; it ends when sums of squares fall by less
_FINE = 200.0  # nodes that carry the posterior (inverse Simpson index), else the grid is refined: no shift
CLOSER = 4  # most refinements of a grid
QUANTILES = (0.025, 0.975)
NARROW = 0.8  # of the prior's width: a narrower interval shows that presses inform about a layer


class LoadingCurve(NamedTuple):
    """The loading part of one press: n points."""

    displacement: Array  # (n,) of the stage or bone, positive into the finger [mm]
    force: Array  # (n,) normal [N]
    touch: float  # displacement at which the force leaves its zero [mm]
    width: Array  # (n,) length of the contact along the finger [mm]; nan where not measured
    readings: int = 0  # behind the points

    @staticmethod
    def of(displacement: Array, force: Array, width: Array) -> "LoadingCurve":
        """Return means of readings (m,) over equal parts of their travel, one for each point of a curve."""
        edges: Array = np.linspace(float(displacement[0]), float(displacement[-1]), _POINTS + 1)
        part = np.clip(np.searchsorted(edges, displacement, side="right") - 1, 0, _POINTS - 1)
        count = np.bincount(part, minlength=_POINTS)
        filled = count > 0
        means = [np.bincount(part, values, _POINTS)[filled] / count[filled] for values in (displacement, force, width)]
        return LoadingCurve(means[0], means[1], float(displacement[0]), means[2], len(displacement))


@dataclass(frozen=True, slots=True)
class Interval:
    """A number with the ends of its 95 % interval; None where the data do not bound it within the model's range."""

    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class LayerFit:
    """Estimates of one layer's stiffness [MPa]."""

    name: str
    stiffness: Interval  # at the maximum of the posterior, with its 95 % credible interval
    profile: Interval  # at the maximum of the likelihood, with the 95 % interval of its profile
    prior: Interval
    ratio: float  # of the credible interval to the prior's, of log stiffness [-]
    sentence: str


@dataclass(frozen=True, slots=True, eq=False)
class FingerFit:
    """The posterior of a finger's stiffnesses."""

    scene: Scene  # with the finger at the maximum of the posterior
    layers: tuple[LayerFit, ...]
    overall: Interval  # force relative to that of published stiffnesses, geometric mean over the depths pressed [-]
    touch: tuple[float, ...]  # displacement at the touch of each press [mm]
    noise: float  # standard deviation of the points' forces [N]
    widths: int  # points with a measured contact length
    points: int
    deepest: float  # [mm]
    draws: Array  # (m, 3) of the posterior of the stiffnesses [MPa]

    def to_dict(self) -> dict[str, Any]:
        """Return the fit as plain data, without draws."""
        names = ("layers", "overall", "touch", "noise", "points", "widths", "deepest")
        return {name: msgspec.to_builtins(getattr(self, name)) for name in names}


class _Grid(NamedTuple):
    """Fits at g contrasts."""

    contrast: Array  # (g, 2) in deviations of the prior
    mean: Array  # (g,) best mean log factor of the stiffnesses
    touch: Array  # (g, presses) [mm]
    misfit: Array  # (g,) of the forces, sum of squares [N2]
    variance: Array  # (g,) of the mean, relative to the noise's variance [1/N2]
    fits: Array  # (g,) log likelihood
    weight: Array  # (g,) of the posterior, with sum 1
    likelihood: Array  # (g,) the same without the prior
    step: float  # greatest distance between neighbours, in deviations


class Likelihood:
    """Likelihood of a finger given presses and a model of them."""

    def __init__(self, model: PressModel, presses: Sequence[LoadingCurve]) -> None:
        """Raise FitError where presses are too few."""
        self.model = model
        self.force, self.displacement, width = (
            np.concatenate([getattr(press, name) for press in presses]) for name in ("force", "displacement", "width")
        )
        self.press = np.repeat(np.arange(len(presses)), [len(press.force) for press in presses])
        self.presses = self.press == np.arange(len(presses))[:, None]
        self.dof = len(self.force) - 1 - len(presses)
        if self.dof < _FEWEST:
            raise FitError(
                f"{len(self.force)} points of {len(presses)} presses are too few: press deeper, slower, or more often."
            )
        # The model's own error does not shrink with the noise.
        self.floor = len(self.force) * float(np.mean((model.error * self.force) ** 2))
        self.wide = np.flatnonzero(np.isfinite(width))
        self.width = width[self.wide]
        depth = self.displacement - np.array([press.touch for press in presses])[self.press]
        width_error = np.interp(depth[self.wide], model.depth, model.width_error)
        self.width_floor = float(np.sum((width_error * self.width) ** 2))

    def grid(self, contrast: Array, step: float, start: Array) -> _Grid:
        """Return best means and touches at contrasts (g, 2), `step` apart, from touches `start` (presses,) [mm]."""
        forces = self.model.log_force(contrast) + np.log(self.model.scene.finger.width)
        spline = CubicSpline(np.log(self.model.depth), forces, axis=1)
        touch = np.tile(start, (len(contrast), 1))
        mean, misfit, residual, jacobian = self._linear(spline, touch)
        damping = np.full(len(contrast), 1e-3)
        for _ in range(_ROUNDS):  # Levenberg-Marquardt for all contrasts together
            trial_touch = touch + _steps(jacobian, residual, damping)[:, 1:]
            trial = self._linear(spline, trial_touch)
            better = trial[1] < misfit
            gain = float(np.max(np.where(better, misfit - trial[1], 0.0) / (misfit + self.floor)))
            for array, update in zip((touch, mean, misfit, residual, jacobian), (trial_touch, *trial), strict=True):
                array[better] = update[better]
            damping = np.where(better, damping / 5.0, damping * 5.0)
            if gain < SETTLED:
                break
        normal = np.swapaxes(jacobian, 1, 2) @ jacobian
        variance = np.asarray(np.linalg.inv(normal)[:, 0, 0], np.float64)
        prior = (contrast**2).sum(axis=1) + 3.0 * (mean / self.model.spread) ** 2
        fits = -(self.dof * np.log(misfit + self.floor) + self._width_deviance(contrast, touch)) / 2.0
        log_posterior = fits - (prior + np.linalg.slogdet(normal)[1]) / 2.0
        return _Grid(contrast, mean, touch, misfit, variance, fits, softmax(log_posterior), softmax(fits), step)

    def _linear(self, spline: CubicSpline, touch: Array) -> tuple[Array, Array, Array, Array]:
        """Return the best mean (g,) at touches, its misfit (g,), residual (g, n) and Jacobian (g, n, 1 + presses)."""
        shape, slope = at_depths(spline, self.displacement - touch[:, self.press])
        factor = np.maximum((shape @ self.force) / np.maximum((shape**2).sum(axis=1), 1e-30), 1e-6)
        force = factor[:, None] * shape
        touch_slope = (-factor[:, None] * slope)[:, :, None] * self.presses.T
        residual = force - self.force
        return np.log(factor), (residual**2).sum(axis=1), residual, np.dstack([force, touch_slope])

    def _width_deviance(self, contrast: Array, touch: Array) -> Array:
        """Return minus twice the log likelihood (g,) of the contacts' lengths, 0 without any."""
        if not len(self.wide):
            return np.zeros(len(contrast))
        spline = CubicSpline(np.log(self.model.depth), self.model.log_width(contrast), axis=1)
        width, _ = at_depths(spline, self.displacement[self.wide] - touch[:, self.press[self.wide]])
        misfit = ((width - self.width) ** 2).sum(axis=1) + self.width_floor
        return np.asarray(len(self.wide) * np.log(misfit), np.float64)

    def maximum(self, grid: _Grid) -> tuple[Array, Array, float]:
        """Return contrast (2,), touches and mean of the posterior's maximum."""
        best = int(np.argmax(grid.weight))
        sigma = float(np.sqrt((grid.misfit[best] + self.floor) / self.dof))
        start = np.concatenate([grid.contrast[best], [grid.mean[best]], grid.touch[best]])
        width_deviance = float(self._width_deviance(grid.contrast[best][None], grid.touch[best][None])[0])
        width_sigma = float(np.exp(width_deviance / max(len(self.wide), 1) / 2.0)) / max(len(self.wide), 1) ** 0.5
        scale = np.concatenate([np.full(len(self.force), sigma), np.full(len(self.wide), width_sigma), np.ones(3)])

        knots, width = np.log(self.model.depth), np.log(self.model.scene.finger.width)

        def residual(numbers: Array) -> Array:
            """Return residuals of forces, contacts and prior, each over its standard deviation."""
            depth, contrast = self.displacement - numbers[3:][self.press], numbers[None, :2]
            logs = (
                (self.model.log_force(contrast) + width + numbers[2], depth),
                (self.model.log_width(contrast), depth[self.wide]),
            )
            values = [at_depths(CubicSpline(knots, log, axis=1), depths[None])[0][0] for log, depths in logs]
            prior = numbers[:3] * [1.0, 1.0, np.sqrt(3.0) / self.model.spread]
            return np.concatenate([values[0] - self.force, values[1] - self.width, prior]) / scale

        optimum = least_squares(residual, start, "3-point", x_scale="jac").x
        return optimum[:2], optimum[3:], float(optimum[2])

    def profile(self, grids: Sequence[_Grid], layer: int) -> Interval:
        """Return a layer's maximum-likelihood log factor (0: published) with the 95 % interval of its profile."""
        contrast, mean, misfit, variance, fits = (
            np.concatenate([getattr(grid, name) for grid in grids]) for name in _Grid._fields[:6] if name != "touch"
        )
        step = np.concatenate([np.full(len(grid.mean), grid.step) for grid in grids])
        log = mean + self.model.spread * contrast @ CONTRASTS[:, layer]
        # Likelihood-ratio interval: the deviance may exceed its minimum by CHI_SQUARED, at each contrast by the rest.
        margin = CHI_SQUARED - 2.0 * (fits.max() - fits)
        half_width = np.sqrt(variance * (misfit + self.floor) * np.expm1(np.maximum(margin, 0.0) / self.dof))
        half = np.where(margin >= 0.0, half_width, -np.inf)
        extremes = [int((log - half).argmin()), int((log + half).argmax())]
        rim = np.hypot(*contrast[extremes].T) + 1.5 * step[extremes] > REACH
        low, high = float((log - half)[extremes[0]]), float((log + half)[extremes[1]])
        return Interval(float(log[fits.argmax()]), None if rim[0] else low, None if rim[1] else high)


def fit(model: PressModel, presses: Sequence[LoadingCurve], gain_error: float = 0.0, seed: int = 0) -> FingerFit:
    """Return the posterior of a finger's stiffnesses, given presses.

    `gain_error` is the force's standard uncertainty [-], `seed` the seed of draws. Raises FitError for too few points.
    """
    likelihood = Likelihood(model, presses)
    touches = np.array([press.touch for press in presses])
    coarse = likelihood.grid(*_nodes(np.zeros(2), REACH * np.eye(2)), touches)
    fine = _closer(likelihood, coarse, "weight")
    grids = [coarse, fine, _closer(likelihood, coarse, "likelihood")]
    contrast, touch, mean = likelihood.maximum(fine)
    rng = np.random.default_rng(seed)
    rows = rng.choice(len(fine.weight), _DRAWS, p=fine.weight)
    scale = np.sqrt((fine.misfit + likelihood.floor) / likelihood.dof * fine.variance)
    means = fine.mean[rows] + scale[rows] * rng.standard_t(likelihood.dof, _DRAWS)
    means += gain_error * rng.standard_normal(_DRAWS)
    best = model.stiffnesses(np.array([mean]), contrast[None])[0]
    draws = model.stiffnesses(means, fine.contrast[rows])
    depth = likelihood.displacement - touch[likelihood.press]
    inside = (model.depth >= depth.min()) & (model.depth <= depth.max())
    inside[np.argmin(np.abs(model.depth - np.median(depth)))] = True
    relative = (model.log_force(np.vstack([contrast, fine.contrast])) - model.log_force(np.zeros((1, 2))))[:, inside]
    ratio = relative.mean(axis=1)
    low, high = np.exp(np.quantile(means + ratio[1:][rows], QUANTILES))
    return FingerFit(
        scene=model.finger(best),
        layers=tuple(_layer(likelihood, grids, number, best, draws) for number in range(len(LAYERS))),
        overall=Interval(float(np.exp(mean + ratio[0])), float(low), float(high)),
        touch=tuple(touch.tolist()),
        noise=float(np.sqrt(fine.misfit.min() / likelihood.dof)),
        points=len(likelihood.force),
        widths=len(likelihood.width),
        deepest=float(depth.max()),
        draws=draws,
    )


def _layer(likelihood: Likelihood, grids: Sequence[_Grid], number: int, best: Array, draws: Array) -> LayerFit:
    """Return the estimates of one layer, with a sentence."""
    name, spread = LAYERS[number], likelihood.model.spread
    published = likelihood.model.scene.materials.of(name).E
    low, high = np.quantile(draws[:, number], QUANTILES).tolist()
    half = float(ndtri(QUANTILES[1])) * spread
    ratio = float(np.log(high / low)) / (2.0 * half)
    share = f"its 95 % interval is {100 * ratio:.0f} % as wide as the prior's, on the scale of logarithms"
    sentence = (
        f"The presses narrow the stiffness of the {name}: {share}."
        if ratio < NARROW
        else f"The presses cannot tell the stiffness of the {name} from that of the other layers: {share}."
    )
    profile = likelihood.profile(grids, number)
    ends = (None if log is None else published * float(np.exp(log)) for log in (profile.low, profile.high))
    profile_interval = Interval(published * float(np.exp(profile.value)), *ends)
    prior = Interval(published, published * float(np.exp(-half)), published * float(np.exp(half)))
    return LayerFit(name, Interval(float(best[number]), low, high), profile_interval, prior, ratio, sentence)


def _nodes(centre: Array, axes: Array) -> tuple[Array, float]:
    """Return the contrasts (g, 2) of a grid within the model's reach, and their step; `axes` (2, 2) are half widths."""
    line: Array = np.linspace(-1.0, 1.0, _GRID)
    nodes = centre + np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2) @ axes
    step = float(np.hypot(*axes.T).max()) * 2.0 / (_GRID - 1)
    return nodes[(nodes**2).sum(axis=1) <= REACH**2], step


def _closer(likelihood: Likelihood, grid: _Grid, name: str) -> _Grid:
    """Return a grid along the principal axes of the weights `name`, refined until enough nodes carry weight."""
    for _ in range(CLOSER):
        weight: Array = getattr(grid, name)
        if 1.0 / float((weight**2).sum()) >= _FINE:
            break
        carry = weight > 1e-4 * weight.max()
        nodes = grid.contrast[carry]
        centre = np.average(nodes, axis=0, weights=weight[carry])
        spread = (nodes - centre).T @ ((nodes - centre) * weight[carry, None]) / weight[carry].sum()
        axes = np.linalg.eigh(spread)[1].T
        coordinates = (nodes - centre) @ axes.T
        low, high = coordinates.min(axis=0) - grid.step, coordinates.max(axis=0) + grid.step
        middle, half = (low + high) / 2.0 @ axes, (high - low) / 2.0
        grid = likelihood.grid(*_nodes(centre + middle, half[:, None] * axes), grid.touch[int(weight.argmax())])
    return grid


def _steps(jacobian: Array, residual: Array, damping: Array) -> Array:
    """Return the damped steps (g, p) that reduce residuals (g, n), each parameter on its own scale."""
    transposed = np.swapaxes(jacobian, 1, 2)
    normal = transposed @ jacobian
    diagonal = np.einsum("gii->gi", normal)
    diagonal *= 1.0 + damping[:, None]
    diagonal += 1e-12 * diagonal.max(axis=1, keepdims=True)
    return np.asarray(np.linalg.solve(normal, -(transposed @ residual[:, :, None]))[:, :, 0], np.float64)
