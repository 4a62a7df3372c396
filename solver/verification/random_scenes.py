"""Seeded random scenes: a set and a number always give the same scene, in either kinematics.

| set | scenes |
| --- | --- |
| axis | a published surface with one random value of finger, tissues, friction, loading or receptor |
| fingers | all lengths within 30 % of the published ones, or, in every other scene, random (tip radius 3.5 to 8 mm) |
| extreme | tissues 1e-3 to 1e6 times as stiff as fat, layers of 2 to 60 % of the tip |
| edge | a receptor in the epidermis beneath an edge of contact |
| bounds | a traction bound of 1 to 10 kPa |
| forces | a prescribed normal force, in half of the scenes also a drag |
| courses | a slide that reverses, a press with friction, or a history of relaxing tissues |
| deep | a press by 50 to 80 % of the tissue between skin and bone |
| stiff | skin 8 to 100 times as stiff as fat, or at finite strain Ogden's law with an exponent of 3 to 14 |
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from solver.scene import Scene
from solver.scene.published import scenes
from solver.scene.tables import Finger, Friction, Loading, Material, Materials, Receptor, Relaxation, SceneError, Solve
from solver.verification.methods import Kinematics

CLOSE = 0.06  # largest difference of coefficients from the first one, in every other set of surfaces
Draw = np.random.Generator


def random_scene(family: str, number: int, kinematics: Kinematics) -> Scene:
    """Return a scene of one of the `FAMILIES`."""
    draw = np.random.default_rng([number, *family.encode()])
    while True:
        try:
            sample = FAMILIES[family](draw, number, kinematics)
        except SceneError:  # impossible outline, or no room for the receptor
            continue
        return replace(sample, title=f"{family} {number}", solve=replace(sample.solve, kinematics=kinematics))


def _common(draw: Draw, most: float = 0.7) -> Scene:
    """Return the published finger with random angle, stiffnesses and load; half of the scenes have a bound."""
    bound = None if draw.random() < 0.5 else _by_logarithm(draw, 0.003, 0.06)
    return Scene(
        finger=Finger(contact_angle=draw.uniform(30.0, 75.0)),
        materials=_tissues(draw),
        friction=Friction(draw.uniform(0.02, most), bound),
        loading=Loading(draw.uniform(0.5, 2.0), _slide(draw)),
    )


def _axis(draw: Draw, number: int, _: Kinematics) -> Scene:
    base = scenes()[number % 10]
    finger, tissues, rubs, loads = base.finger, base.materials, base.friction, base.loading

    def with_tissue(name: str) -> Materials:
        tissue = tissues.of(name)
        neighbour = Material(tissue.E * _by_logarithm(draw, 0.4, 2.5), draw.uniform(0.3, 0.499))
        return replace(tissues, **{name: neighbour})

    changes: Sequence[Callable[[], dict[str, Any]]] = (
        lambda: {"loading": replace(loads, indentation=draw.uniform(0.2, 2.2))},
        lambda: {"friction": replace(rubs, mu=draw.uniform(0.0, 0.7))},
        lambda: {"friction": replace(rubs, tau_max=_by_logarithm(draw, 1e-3, 0.1))},
        lambda: {"finger": replace(finger, contact_angle=draw.uniform(25.0, 80.0))},
        lambda: {"materials": with_tissue("epidermis")},
        lambda: {"materials": with_tissue("dermis")},
        lambda: {"materials": with_tissue("fat")},
        lambda: {"receptor": Receptor(draw.uniform(0.3, 1.85))},
        lambda: {"receptor": Receptor(ending=(draw.uniform(0.05, 0.2), draw.uniform(0.2, 3.0)))},
        lambda: {"finger": replace(finger, tip_radius=draw.uniform(4.5, 8.0))},
        lambda: {"finger": replace(finger, epidermis=draw.uniform(0.4, 1.0)), "receptor": Receptor(1.4)},
        lambda: {"finger": replace(finger, shaft_length=draw.uniform(8.0, 25.0))},
        lambda: {"finger": replace(finger, bone_radius=draw.uniform(0.8, 2.0))},
    )
    return replace(base, **changes[int(draw.integers(len(changes)))]())


def _fingers(draw: Draw, number: int, _: Kinematics) -> Scene:
    scene, usual = _common(draw), Finger()
    part = draw.uniform(0.7, 1.3, 7)
    names = ("tip_radius", "epidermis", "dermis", "shaft_length", "bone_radius")
    lengths: dict[str, Any] = {name: float(getattr(usual, name) * p) for name, p in zip(names, part, strict=False)}
    if number % 2:
        wide = {"tip_radius": (3.5, 8.0), "epidermis": (0.3, 1.2), "dermis": (0.5, 1.8), "bone_radius": (0.8, 2.0)}
        lengths |= {name: float(draw.uniform(*ends)) for name, ends in wide.items()}
    growth = lengths["tip_radius"] / usual.tip_radius
    x, y = usual.bone_centre
    centre = (float(x * part[5]) * growth, float(y * part[6]) * growth)
    skin = lengths["epidermis"] + lengths["dermis"]
    return replace(
        scene,
        finger=replace(scene.finger, bone_centre=centre, **lengths),
        receptor=Receptor(draw.uniform(0.5, 0.9) * skin, (0.1 * skin, draw.uniform(0.5, 2.0))),
        loading=replace(scene.loading, indentation=scene.loading.depth * growth),
    )


def _extreme(draw: Draw, _: int, __: Kinematics) -> Scene:
    epidermis, dermis = (_by_logarithm(draw, 0.02, 0.6) * 5.0 for _ in range(2))
    bone, angle = draw.uniform(0.3, 1.5), draw.uniform(30.0, 75.0)
    finger = Finger(5.0, epidermis, dermis, bone_radius=bone, bone_centre=(-1.0, 0.0), contact_angle=angle)
    fat, skin = Materials().fat, epidermis + dermis
    stiff = [Material(fat.E * _by_logarithm(draw, 1e-3, 1e6), 0.48) for _ in range(2)]
    return Scene(
        finger=finger,
        materials=Materials(stiff[0], stiff[1], fat),
        friction=Friction(draw.uniform(0.0, 0.6)),
        loading=Loading(draw.uniform(0.03, 0.3) * finger.pulp_thickness(), _slide(draw)),
        receptor=Receptor(draw.uniform(0.1, 0.9) * skin, (0.05 * skin, draw.uniform(0.3, 1.5))),
    )


def _edge(draw: Draw, _: int, __: Kinematics) -> Scene:
    scene = _common(draw)
    along = _by_logarithm(draw, 0.3, 3.0)
    depth = draw.uniform(0.5, 2.0) * (along / 2.0) ** 2 / (2.0 * scene.finger.tip_radius)  # ends near the ending's ends
    receptor = Receptor(draw.uniform(0.1, 0.7), (0.05, along))
    return replace(scene, receptor=receptor, loading=replace(scene.loading, indentation=depth))


def _bounds(draw: Draw, _: int, __: Kinematics) -> Scene:
    return replace(_common(draw), friction=Friction(draw.uniform(0.15, 0.8), _by_logarithm(draw, 1e-3, 1e-2)))


def _forces(draw: Draw, number: int, _: Kinematics) -> Scene:
    scene = _common(draw, 0.6)
    force = _by_logarithm(draw, 0.01, 0.15)
    friction = Friction(scene.friction.mu)
    drag = draw.uniform(0.2, 0.9) * friction.mu * force if number % 2 else None
    loading = Loading(slide=scene.loading.slide, normal_force=force, tangential_force=drag)
    return replace(scene, friction=friction, loading=loading)


def _courses(draw: Draw, number: int, _: Kinematics) -> Scene:
    scene = _common(draw, 0.6)
    loading = replace(scene.loading, slide=(("+x", "-x"), "none", scene.loading.slide)[number % 3])
    scene = replace(scene, loading=loading)
    if number % 3 < 2:
        return scene
    prony = (Relaxation(draw.uniform(0.1, 0.5), _by_logarithm(draw, 0.03, 3.0)),)
    materials = scene.materials
    tissues = Materials(
        *(replace(tissue, prony=prony) for tissue in (materials.epidermis, materials.dermis, materials.fat))
    )
    return replace(scene, materials=tissues, solve=Solve(course="history"))


def _stiff(draw: Draw, number: int, kinematics: Kinematics) -> Scene:
    usual = Materials()
    if number % 2 or kinematics == "small":
        skin = [Material(usual.fat.E * _by_logarithm(draw, 8.0, 100.0), 0.48) for _ in range(2)]
    else:
        exponent = draw.uniform(3.0, 14.0)
        skin = [replace(tissue, law="ogden", stiffening=exponent) for tissue in (usual.epidermis, usual.dermis)]
    scene = replace(_common(draw, 0.5), solve=Solve(kinematics), materials=Materials(skin[0], skin[1], usual.fat))
    return replace(scene, friction=Friction(scene.friction.mu))


def _deep(draw: Draw, _: int, __: Kinematics) -> Scene:
    scene = _common(draw)
    depth = draw.uniform(0.5, 0.8) * scene.finger.pulp_thickness()
    return replace(
        scene,
        friction=replace(scene.friction, mu=_by_logarithm(draw, 0.01, 0.3)),
        loading=replace(scene.loading, indentation=depth),
    )


FAMILIES: Mapping[str, Callable[[Draw, int, Kinematics], Scene]] = {
    draw.__name__[1:]: draw for draw in (_axis, _fingers, _extreme, _edge, _bounds, _forces, _courses, _deep, _stiff)
}


def surface_set(number: int, kinematics: Kinematics) -> list[Scene]:
    """Return three surfaces on one finger, at one indentation and in one direction.

    Their mu is 0.05 to 0.6, in every other set within 0.06 of the first. Half have a bound of 0.004 to 0.05 MPa.
    """
    draw = np.random.default_rng([number, 71])
    base = replace(_common(draw), title=f"surfaces {number}", solve=Solve(kinematics))
    first = draw.uniform(0.05, 0.6)
    near = (max(first - CLOSE, 0.02), first + CLOSE) if number % 2 else (0.05, 0.6)
    mus = [first, *draw.uniform(*near, 2).tolist()]
    bounds = [None if draw.random() < 0.5 else _by_logarithm(draw, 0.004, 0.05) for _ in mus]
    return [replace(base, friction=Friction(mu, bound)) for mu, bound in zip(mus, bounds, strict=True)]


def _tissues(draw: Draw) -> Materials:
    usual = Materials()
    return Materials(
        *(Material(t.E * draw.uniform(0.7, 1.3), 0.48) for t in (usual.epidermis, usual.dermis, usual.fat))
    )


def _by_logarithm(draw: Draw, low: float, high: float) -> float:
    return math.exp(draw.uniform(math.log(low), math.log(high)))


def _slide(draw: Draw) -> Literal["+x", "-x"]:
    return "+x" if draw.random() < 0.5 else "-x"
