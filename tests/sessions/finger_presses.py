"""Presses of fingers whose layers are known: forces from the solver itself, or by a power of depth."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from sessions.prediction.finger_fit import LoadingCurve
from sessions.prediction.press_model import DEGREE, REACH, PressModel
from solver import Friction, Loading, Material, Materials, Scene, Solve, solve_many

LAYERS = ("epidermis", "dermis", "fat")
PUBLISHED = np.array([0.136, 0.08, 0.034])  # [MPa], the paper's Table 3
SPREAD = float(np.log(2.0))  # standard deviation of each log stiffness in the prior
DEPTHS = np.geomspace(0.05, 1.8, 20)  # depths at which a simulated finger is solved [mm]


def published():
    return Scene(friction=Friction(0.0), loading=Loading(1.0))


def law(stiffness, mu=0.0, depths=DEPTHS):
    """Return N(depth) [N] of a finger with layers of a stiffness (3,) [MPa], as the solver has it."""
    layers = {name: Material(float(e), 0.48) for name, e in zip(LAYERS, stiffness, strict=True)}
    scenes = [
        replace(
            published(),
            materials=replace(Materials(), **layers),
            friction=Friction(mu),
            loading=Loading(float(depth), "none" if mu else "+x"),
            solve=Solve(tolerance=0.0005, evidence="quick"),
        )
        for depth in depths
    ]
    force = [15.0 * prediction.normal_force for prediction in solve_many(scenes)]
    line = CubicSpline(np.log(depths), np.log(force))
    return lambda depth: np.where(depth > 0.01, np.exp(line(np.log(np.maximum(depth, 0.01)))), 0.0)


POWER, BENT, LOUD, WIDER = 1.4, 0.15, 0.05, 0.3  # of depth; how contrasts change power, force and contact


def power_law_model(spread, error=1e-4):
    """Return a model in closed form: N = 0.05 d^(POWER + BENT u0) exp(LOUD u1) N/mm for contrasts u.

    The contact is 5 d^0.5 exp(WIDER u1) mm long.
    """
    depth = np.geomspace(0.05, 2.0, 9)
    orders = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    coefficients = np.zeros((len(orders), len(depth)))
    coefficients[orders.index((0, 0))] = np.log(0.05) + POWER * np.log(depth)
    coefficients[orders.index((1, 0))] = REACH * BENT * np.log(depth)
    coefficients[orders.index((0, 1))] = REACH * LOUD
    width = np.zeros((15, len(depth)))
    width[0] = np.log(5.0) + 0.5 * np.log(depth)
    width[1] = REACH * WIDER  # the second number: of order 1 in the second contrast
    return PressModel(published(), spread, depth, coefficients, width, 0.0, error, np.full(len(depth), 0.01))


def power_law(mean, contrast):
    """Return N(depth) [N] of that model for a mean log stiffness and contrasts (2,)."""
    return lambda depth: (
        15.0 * 0.05 * np.exp(mean + LOUD * contrast[1]) * np.maximum(depth, 1e-9) ** (POWER + BENT * contrast[0])
    )


def presses(force, noise, rng, count=3, points=16, deep=1.6):
    """Return presses, each touching elsewhere, with white noise of a share of the greatest force."""
    depth = np.linspace(0.05, deep, points)
    spread = noise * force(np.array(deep))
    touches = rng.uniform(0.5, 2.0, count)
    return [
        LoadingCurve(
            depth + at, force(depth) + spread * rng.standard_normal(points), at + 0.03, np.full(points, np.nan)
        )
        for at in touches
    ]
