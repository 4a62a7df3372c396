"""Seeded random scenes: a family and a number draw the same scene always.

| family | scenes |
| --- | --- |
| published | depth 0.5 to 2 mm, mu 0 to 0.7, angle 30 to 75 degrees, stiffness within 30 %, bounds in half of them |
| bounded | the same at finite strain, with mu of 0.15 at least and a bound of 0.003 to 0.012 MPa |
| fingers | the published family on fingers with another outline, receptor and bone |
| steep | depth 0.01 to 2 mm, mu 1.2 to 1000, a bound of 0.002 to 0.02 MPa, evenly by their logarithms |
| stiff | epidermis and dermis 8 to 100 times as stiff as fat, or Ogden's law with an exponent of 3 to 14 |
| point | the published family with an ending of 0.001 to 0.1 by 0.001 to 0.2 mm anywhere in the skin |
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from solver.scene.scene import Finger, Friction, Loading, Material, Materials, Receptor, Scene, SceneError, Solve
from solver.verification.methods import Kinematics

CLOSE = 0.06  # of every other set of surfaces, how far the coefficients lie from the first at most


def random_scene(number: int, kinematics: Kinematics = "small") -> Scene:
    """Return a scene of the published finger; every other one has a bound of 0.003 to 0.06 MPa on its traction."""
    draw = np.random.default_rng([2026, number])
    usual = Materials()
    softer = draw.uniform(0.7, 1.3, 3).tolist()
    tissues = (usual.epidermis, usual.dermis, usual.fat)
    depth, mu, angle = draw.uniform(0.5, 2.0), draw.uniform(0.0, 0.7), draw.uniform(30.0, 75.0)
    slide = _slide(draw)
    bound = _by_logarithm(draw, 0.003, 0.06) if number % 2 else None
    return Scene(
        title=f"random {number}",
        finger=Finger(contact_angle=float(angle)),
        materials=Materials(*(Material(t.E * s, t.nu) for t, s in zip(tissues, softer, strict=True))),
        friction=Friction(float(mu), bound),
        loading=Loading(float(depth), slide),
        solve=Solve(kinematics),
    )


def _finite_scene(number: int, *, bounded: bool) -> Scene:
    """Return a scene at finite strain; half of them have a bound of 0.005 to 0.05 MPa, which acts in few."""
    draw = np.random.default_rng([number, 28])
    tissues = _tissues(draw)
    found = Scene(
        title=f"random {number}",
        finger=Finger(contact_angle=draw.uniform(30.0, 75.0)),
        materials=tissues,
        friction=Friction(draw.uniform(0.0, 0.7), None if draw.random() < 0.5 else draw.uniform(0.005, 0.05)),
        loading=Loading(draw.uniform(0.5, 2.0), _slide(draw), 20.0),
        solve=Solve("finite"),
    )
    bound = _by_logarithm(draw, 0.003, 0.012)
    return replace(found, friction=Friction(max(found.friction.mu, 0.15), bound)) if bounded else found


def _published(number: int, kinematics: Kinematics) -> Scene:
    return random_scene(number) if kinematics == "small" else _finite_scene(number, bounded=False)


def _fingers(number: int, kinematics: Kinematics) -> Scene:
    """Return a scene on another finger: lengths within 30 % of the published ones, or drawn freely in every other pair.

    Freely means tip radius 3.5 to 8 mm, epidermis 0.3 to 1.2, dermis 0.5 to 1.8 and bone radius 0.8 to 2. Indentation
    and bone grow with the tip. Outlines that are none are drawn again.
    """
    scene = _published(number, kinematics)
    draw = np.random.default_rng([2027, number])
    usual = Finger()
    while True:
        part = draw.uniform(0.7, 1.3, 7)
        names = ("tip_radius", "epidermis", "dermis", "shaft_length", "bone_radius")
        lengths = {name: float(getattr(usual, name) * p) for name, p in zip(names, part, strict=False)}
        if number % 4 > 1:
            wide = {"tip_radius": (3.5, 8.0), "epidermis": (0.3, 1.2), "dermis": (0.5, 1.8), "bone_radius": (0.8, 2.0)}
            lengths |= {name: float(draw.uniform(*ends)) for name, ends in wide.items()}
        growth = lengths["tip_radius"] / usual.tip_radius
        x, y = usual.bone_centre
        centre = (float(x * part[5]) * growth, float(y * part[6]) * growth)
        skin = lengths["epidermis"] + lengths["dermis"]
        try:
            return replace(
                scene,
                finger=replace(usual, contact_angle=scene.finger.contact_angle, bone_centre=centre, **lengths),
                receptor=Receptor(float(draw.uniform(0.5, 0.9)) * skin, (0.1 * skin, float(draw.uniform(0.5, 2.0)))),
                loading=replace(scene.loading, indentation=scene.loading.depth * growth),
            )
        except SceneError:
            continue


def _steep(number: int, kinematics: Kinematics) -> Scene:
    draw = np.random.default_rng([number, 99])
    depth, mu, bound = (_by_logarithm(draw, *ends) for ends in ((0.01, 2.0), (1.2, 1e3), (2e-3, 2e-2)))
    return Scene(
        title=f"random {number}",
        friction=Friction(mu, bound),
        loading=Loading(depth, _slide(draw)),
        solve=Solve(kinematics),
    )


def _stiff(number: int, kinematics: Kinematics) -> Scene:
    draw = np.random.default_rng([number, 98])
    usual = Materials()
    if number % 2:
        skin = [Material(usual.fat.E * _by_logarithm(draw, 8.0, 100.0), 0.48) for _ in range(2)]
    else:
        exponent = float(draw.uniform(3.0, 14.0))
        skin = [replace(one, law="ogden", stiffening=exponent) for one in (usual.epidermis, usual.dermis)]
    return Scene(
        title=f"random {number}",
        finger=Finger(contact_angle=float(draw.uniform(30.0, 75.0))),
        materials=replace(usual, epidermis=skin[0], dermis=skin[1]),
        friction=Friction(float(draw.uniform(0.1, 0.5))),
        loading=Loading(float(draw.uniform(1.0, 2.0)), _slide(draw)),
        solve=Solve(kinematics),
    )


def _point(number: int, kinematics: Kinematics) -> Scene:
    draw = np.random.default_rng([number, 97])
    usual = random_scene(number, kinematics)
    across, along = (_by_logarithm(draw, *ends) for ends in ((1e-3, 0.1), (1e-3, 0.2)))
    skin = usual.finger.epidermis + usual.finger.dermis
    depth = float(draw.uniform(0.6 * across, skin - 0.6 * across))
    friction = usual.friction if kinematics == "small" else replace(usual.friction, mu=usual.friction.mu / 2.0)
    return replace(usual, receptor=Receptor(depth, (across, along)), friction=friction)


FAMILIES: Mapping[str, Callable[[int, Kinematics], Scene]] = {
    "published": _published,
    "bounded": lambda number, _: _finite_scene(number, bounded=True),
    "fingers": _fingers,
    "steep": _steep,
    "stiff": _stiff,
    "point": _point,
}
HARD = ("bounded", "steep", "stiff", "point")  # where a plain mesh is not good enough for a truth


def surface_set(number: int, kinematics: Kinematics) -> list[Scene]:
    """Return three surfaces on one finger, at one indentation and in one direction.

    Their mu is 0.05 to 0.7 (finite strain: 0.6), in every other set within 0.06 of the first. Each has even odds of a
    bound of 0.004 to 0.05 MPa.
    """
    draw = np.random.default_rng([number, 71 if kinematics == "small" else 72])
    tissues = _tissues(draw)
    most = 0.7 if kinematics == "small" else 0.6
    first = draw.uniform(0.05, most)
    if number % 2:
        mus = [first, *(min(max(first + draw.uniform(-CLOSE, CLOSE), 0.02), most) for _ in range(2))]
    else:
        mus = [draw.uniform(0.05, most) for _ in range(3)]
    bounds = [None if draw.random() < 0.5 else _by_logarithm(draw, 0.004, 0.05) for _ in range(3)]
    base = Scene(
        finger=Finger(contact_angle=draw.uniform(30.0, 75.0)),
        materials=tissues,
        loading=Loading(draw.uniform(0.5, 2.0), _slide(draw)),
        friction=Friction(0.0),
        solve=Solve(kinematics),
    )
    return [replace(base, friction=Friction(float(mu), bound)) for mu, bound in zip(mus, bounds, strict=True)]


def _tissues(draw: np.random.Generator) -> Materials:
    usual = Materials()
    return Materials(
        *(Material(t.E * draw.uniform(0.7, 1.3), 0.48) for t in (usual.epidermis, usual.dermis, usual.fat))
    )


def _by_logarithm(draw: np.random.Generator, low: float, high: float) -> float:
    return math.exp(draw.uniform(math.log(low), math.log(high)))


def _slide(draw: np.random.Generator) -> Literal["+x", "-x"]:
    return "+x" if draw.random() < 0.5 else "-x"
