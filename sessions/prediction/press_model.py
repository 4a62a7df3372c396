"""The model's force of a press for any layer stiffnesses, interpolated between few solves.

At small strain N is linear in a common factor of all stiffnesses, so only depth and two contrasts between the three
layers remain. Over these log N is a polynomial through solved forces and their exact derivatives by each stiffness.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from scipy.interpolate import CubicSpline

from drivers.arrays import Array, Indices
from sessions.prediction.scenes import settled_predictions
from solver import Friction, Loading, Prediction, Scene, SceneError, Slide, Solve
from solver.progress import Progress, report_part
from solver.response.nearby import stiffness_shares

LAYERS = ("epidermis", "dermis", "fat")  # the bone is rigid
# Orthonormal contrasts of three log stiffnesses: skin's two layers, and both against the fat.
CONTRASTS = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])
REACH = 3.3  # largest contrast in deviations of the prior: 0.4 % of a two-dimensional normal law is beyond
DEGREE = 7  # of the polynomial; 6 misses solved forces by twice as much, 8 by as much as 7
RINGS = (1, 5, 8, 12)  # contrasts solved on circles: 26 forces and 52 slopes for the 36 coefficients of degree 7
DEGREE_OF_WIDTH = 4  # of the contact's length, whose derivatives are unknown: 15 coefficients
DEGREE_OF_FRICTION = 2  # of the friction's contribution to log N, 2 to 13 % over contrasts and depths
RINGS_OF_FRICTION = (1, 4, 5)  # 10 forces for the 6 coefficients of degree 2
DEPTHS = 9  # solved depths of a press; between them log N is a cubic spline of log depth
CHECK_DEPTHS = 4  # depths at which a fitted finger is solved
SHALLOWEST = 0.05  # relative to the deepest: shallower contacts have too few elements
_TOLERANCE = 0.0005  # of the SED: forces err by 0.04 %; at 0.1 % intervals contain a simulated finger too rarely


class FitError(Exception):
    """The finger cannot be fitted; the message says why and what to do."""


@dataclass(frozen=True, slots=True, eq=False)
class PressModel:
    """log N over depth and stiffness contrasts; k depths."""

    scene: Scene  # with the finger and the reference stiffnesses of the contrasts
    spread: float  # standard deviation of the prior of each log stiffness [-]
    depth: Array  # (k,) [mm]
    coefficients: Array  # (c, k) of log N [N/mm]
    width: Array  # (w, k) of the log of the contact's length along the finger [mm]
    mu: float  # friction of the surface that is pressed [-]
    error: float  # relative error of solved forces, by the solver's estimate, and of the polynomial [-]
    width_error: Array  # (k,) the same for the contact's length, coarse where it is short [-]

    def log_force(self, contrast: Array) -> Array:
        """Return log N (g, k) [N/mm] for `contrast` (g, 2) in deviations of the prior, at the reference stiffness."""
        return _basis(contrast, DEGREE)[0] @ self.coefficients

    def log_width(self, contrast: Array) -> Array:
        """Return the log of the contact's length (g, k) [mm]; independent of the mean log stiffness."""
        return _basis(contrast, DEGREE_OF_WIDTH)[0] @ self.width

    def force(self, stiffness: Array, depth: Array) -> Array:
        """Return N (n,) [N] of the whole finger with layer stiffnesses (3,) [MPa] at depths (n,) [mm]."""
        mean, contrast = self.contrasts(stiffness)
        log = self.log_force(contrast[None]) + mean + np.log(self.scene.finger.width)
        return at_depths(CubicSpline(np.log(self.depth), log, axis=1), depth[None])[0][0]

    def contrasts(self, stiffness: Array) -> tuple[float, Array]:
        """Return the mean log factor and the contrast (2,) of a `stiffness` (3,) [MPa]."""
        log = np.log(stiffness) - np.log([self.scene.materials.of(name).E for name in LAYERS])
        return float(log.mean()), CONTRASTS @ log / self.spread

    def stiffnesses(self, mean: Array, contrast: Array) -> Array:
        """Return each layer's stiffness (g, 3) [MPa] for mean log factors (g,) and contrasts (g, 2)."""
        reference = [self.scene.materials.of(name).E for name in LAYERS]
        return np.array(reference) * np.exp(mean[:, None] + self.spread * contrast @ CONTRASTS)

    def finger(self, stiffness: Array) -> Scene:
        """Return the scene with layer stiffnesses (3,) [MPa] at the presses' speed, without relaxation."""
        materials, moduli = self.scene.materials, zip(LAYERS, stiffness.tolist(), strict=True)
        layers = {name: replace(materials.of(name), E=modulus, prony=()) for name, modulus in moduli}
        return replace(self.scene, materials=replace(materials, **layers))


def press_model(
    scene: Scene, spread: float, deepest: float, mu: float = 0.0, progress: Progress | None = None
) -> PressModel:
    """Return the model of presses up to a depth [mm] of a scene's finger, on a surface of friction `mu`.

    `spread` is the prior's standard deviation of each log stiffness. Raises FitError without a solution, and Cancelled.
    """
    depth = np.geomspace(SHALLOWEST * deepest, deepest, DEPTHS)
    contrast = _design(RINGS)
    sticking = _design(RINGS_OF_FRICTION) if mu else np.empty((0, 2))
    count = len(contrast) + len(sticking)
    force, width, slope = (np.empty((len(contrast), *shape, DEPTHS)) for shape in ((), (), (2,)))
    errors: list[float] = []
    width_error = np.zeros(DEPTHS)
    blank = PressModel(scene, spread, depth, np.empty((0, 0)), np.empty((0, 0)), mu, 0.0, np.zeros(DEPTHS))
    for number, stiffness in enumerate(blank.stiffnesses(np.zeros(len(contrast)), contrast)):
        report_part(progress, number / count)
        presses = _solve_presses(blank.finger(stiffness), depth, 0.0)
        force[number] = np.log([press.normal_force for press in presses])
        shares = stiffness_shares(presses)[:, : len(LAYERS)]
        slope[number] = spread * CONTRASTS @ shares.T
        width[number] = np.log([press.contact_width for press in presses])
        errors += [press.normal_force_error or 0.0 for press in presses]
        width_error += np.array([press.contact_width_error or 0.0 for press in presses]) / len(contrast)
    basis = np.vstack(_basis(contrast, DEGREE))
    coefficients = _fit(basis, np.vstack([force, slope[:, 0], slope[:, 1]]))
    residual = basis[: len(contrast)] @ coefficients - force
    if mu:
        shape = np.empty((len(sticking), DEPTHS))
        for number, stiffness in enumerate(blank.stiffnesses(np.zeros(len(sticking)), sticking)):
            report_part(progress, (len(contrast) + number) / count)
            presses = _solve_presses(blank.finger(stiffness), depth, mu)
            shape[number] = np.log([press.normal_force for press in presses])
        shape -= _basis(sticking, DEGREE)[0] @ coefficients
        basis = _basis(sticking, DEGREE_OF_FRICTION)[0]
        friction = _fit(basis, shape)
        residual = np.vstack([residual, basis @ friction - shape])
        coefficients[_orders(DEGREE).sum(axis=1) <= DEGREE_OF_FRICTION] += friction
    error = float(np.hypot(np.mean(errors), np.sqrt(np.mean(residual**2))))
    basis = _basis(contrast, DEGREE_OF_WIDTH)[0]
    width_coefficients = _fit(basis, width)
    width_error = np.hypot(width_error, np.sqrt(np.mean((basis @ width_coefficients - width) ** 2, axis=0)))
    return replace(blank, coefficients=coefficients, width=width_coefficients, error=error, width_error=width_error)


class Check(NamedTuple):
    """Comparison of a fitted finger with direct solves."""

    deviation: float  # largest relative difference of fitted and solved forces [-]
    shares: Array  # (3,) d log N / d log E of each layer at the deepest press, without friction [-]


def check(model: PressModel, stiffness: Array, deepest: float) -> Check:
    """Solve presses to a depth [mm] with layer stiffnesses (3,) [MPa] and compare forces. Raises FitError."""
    finger = model.finger(stiffness)
    mean, contrast = model.contrasts(stiffness)
    upto = np.flatnonzero(model.depth <= deepest)[-CHECK_DEPTHS:]
    depth = model.depth[upto]
    fitted = model.log_force(contrast[None])[0, upto] + mean
    frictionless = _solve_presses(finger, depth, 0.0)
    sticking = _solve_presses(finger, depth, model.mu) if model.mu else frictionless
    deviation = np.abs(np.exp(fitted) / np.array([press.normal_force for press in sticking]) - 1.0)
    return Check(float(deviation.max()), stiffness_shares(frictionless[-1:])[0, : len(LAYERS)])


def at_depths(spline: CubicSpline, depth: Array) -> tuple[Array, Array]:
    """Return exp of a spline (g) of log depth at depths (g, n) [mm], and its derivative by depth.

    Beyond its knots the logarithm is extrapolated linearly: a power law.
    """
    depth = np.maximum(depth, 1e-9)  # above the skin there is no force
    knots, log = spline.x, np.log(depth)
    inside = np.clip(log, knots[0], knots[-1])
    piece = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, len(knots) - 2)
    cubic, square, line, constant = spline.c[:, piece, np.arange(len(depth))[:, None]]
    step = inside - knots[piece]
    slope = (3.0 * cubic * step + 2.0 * square) * step + line
    value = np.exp(((cubic * step + square) * step + line) * step + constant + slope * (log - inside))
    return value, value * slope / depth


def _solve_presses(finger: Scene, depth: Array, mu: float) -> Sequence[Prediction]:
    """Return presses with friction; without it those of a slide, which are the same states."""
    slide: Slide = "none" if mu else "+x"
    loads = [Loading(float(loading), slide) for loading in depth]
    solve_settings = Solve(tolerance=_TOLERANCE, evidence="quick")
    try:
        scenes = [replace(finger, friction=Friction(mu), loading=loading, solve=solve_settings) for loading in loads]
    except SceneError as unfit:
        raise FitError(f"The presses do not fit this finger: {unfit}") from unfit
    states = [loading for loading in settled_predictions(scenes) if loading is not None]
    if len(states) < len(scenes):
        raise FitError(
            f"The model has no press of {depth[-1]:.2f} mm on this finger: leave out presses that are so deep, or give "
            "the finger's own dimensions with --finger."
        )
    return states


def _design(rings: Sequence[int]) -> Array:
    """Return contrasts (g, 2) on rings with these numbers of points, at Chebyshev radii, in deviations."""
    radii = REACH * np.sin(np.linspace(0.0, np.pi / 2.0, len(rings)))
    points = [
        radius * np.array([np.cos(angle), np.sin(angle)])
        for number, (radius, count) in enumerate(zip(radii, rings, strict=True))
        for angle in 2.0 * np.pi * (np.arange(count) + 0.5 * (number % 2)) / count
    ]
    return np.array(points)


def _orders(degree: int) -> Indices:
    """Return the orders (c, 2) of the Chebyshev products up to a total degree."""
    return np.array([(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)])


def _fit(basis: Array, values: Array) -> Array:
    """Return the least-squares coefficients of `basis` for `values`."""
    return np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0], np.float64)


def _basis(contrast: Array, degree: int) -> tuple[Array, Array, Array]:
    """Return Chebyshev products (g, c) up to a total degree at contrasts (g, 2), and their derivatives by both."""
    value = [chebyshev.chebvander(contrast[:, axis] / REACH, degree) for axis in (0, 1)]
    derivative = np.zeros((degree + 1, degree + 1))
    for order in range(1, degree + 1):
        derivative[:degree, order] = np.asarray(chebyshev.chebder(np.eye(degree + 1)[order]), np.float64) / REACH
    slope = [values @ derivative for values in value]
    i, j = _orders(degree).T
    return value[0][:, i] * value[1][:, j], slope[0][:, i] * value[1][:, j], value[0][:, i] * slope[1][:, j]
