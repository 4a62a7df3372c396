"""Seeded random scenes, for whatever must hold in all of them: error estimates above all."""

import math

import numpy as np

from solver.scene import Finger, Friction, Loading, Material, Materials, Scene, Solve
from solver.verification.methods import Kinematics


def random_scene(number: int, kinematics: Kinematics = "small") -> Scene:
    """Return the scene of this number, always the same.

    Indentation 0.5 to 2 mm, mu 0 to 0.7, contact angle 30 to 75 degrees, the stiffness of each tissue within 30 % of
    the published one, both directions; every other scene with a bound of 0.003 to 0.06 MPa on its traction.
    """
    rng = np.random.default_rng([2026, number])
    base = Materials()
    softer = rng.uniform(0.7, 1.3, 3).tolist()
    tissues = (base.epidermis, base.dermis, base.fat)
    depth, mu, angle = rng.uniform(0.5, 2.0), rng.uniform(0.0, 0.7), rng.uniform(30.0, 75.0)
    slide = "+x" if rng.random() < 0.5 else "-x"
    bound = math.exp(rng.uniform(math.log(0.003), math.log(0.06))) if number % 2 else None
    return Scene(
        title=f"random {number}",
        finger=Finger(contact_angle=float(angle)),
        materials=Materials(*(Material(t.E * s, t.nu) for t, s in zip(tissues, softer, strict=True))),
        friction=Friction(float(mu), bound),
        loading=Loading(float(depth), slide),
        solve=Solve(kinematics),
    )
