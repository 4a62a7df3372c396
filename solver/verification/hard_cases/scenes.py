"""The hard cases that are scenes of the finger: name, scene, and required outcome."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

from solver.scene import Scene
from solver.scene.tables import USUAL_TOLERANCE, Finger, Friction, Loading, Material, Materials, Receptor, Slide, Solve
from solver.verification.hard_cases.light import RESOLVABLE, of_light_touch
from solver.verification.hard_cases.outcome import Outcome, of_scene
from solver.verification.methods import Kinematics

Must = Literal["answer", "answer or limit"]
ANSWER: Must = "answer"
EITHER: Must = "answer or limit"
SOFT = Material(0.034, 0.48)
BEYOND: dict[Kinematics, tuple[tuple[float, float], ...]] = {  # depth [mm] and mu near and beyond a limit
    "small": ((1.5, 1.4), (2.0, 1.3), (2.0, 2.0)),  # where the finger wedges itself in
    "finite": ((2.0, 0.37), (2.0, 0.38), (2.0, 0.44), (1.5, 0.62), (1.0, 2.0)),  # where the skin folds
}


@dataclass(frozen=True, slots=True)
class Case:
    """A named hard case and its required outcome."""

    kinematics: Kinematics
    name: str
    must: Must
    run: Callable[[], Outcome]
    same_as: str = ""  # a case of the same kinematics with the same first number
    within: float = 0.0  # relative
    slow: bool = False  # takes seconds rather than tenths


def hard_scenes(kinematics: Kinematics) -> Iterator[Case]:
    """Yield the scenes of the suite in one kinematics."""
    make = partial(_scene, kinematics)
    history = Solve(kinematics, "history")
    yield from _tissues(make)
    yield from _friction(make)
    for depth, mu in BEYOND[kinematics]:
        yield _case(f"mu {mu:g} at {depth:g} mm", make(mu, depth=depth), EITHER, slow=True)
    yield from _depths(make, small=kinematics == "small")
    for angle in (15.0, 30.0, 45.0, 60.0, 75.0, 85.0):
        must = ANSWER if 30.0 <= angle <= 75.0 else EITHER
        finger = Finger(contact_angle=angle)
        yield _case(f"angle {angle:g} degrees", make(0.44, 0.03, finger=finger), must)
        yield _case(f"angle {angle:g} degrees, backwards", make(0.44, 0.03, slide="-x", finger=finger), must)
    for name, epidermis, dermis in (
        ("epidermis of 0.05 mm", 0.05, 1.25),
        ("dermis of 0.05 mm", 0.75, 0.05),
        ("epidermis and dermis of 0.05 mm each", 0.05, 0.05),
    ):
        across = min(0.2, dermis)
        receptor = Receptor(depth=epidermis + dermis - across / 2, ending=(across, 1.0))
        thin = make(finger=Finger(epidermis=epidermis, dermis=dermis), receptor=receptor)
        yield _case(name, thin, ANSWER if kinematics == "small" else EITHER)
    yield _case("the whole course at nu 0.4999999", make(0.44, 0.005, materials=_of_nu(0.4999999), solve=history))
    back = make(0.44, 0.03, slide=("+x", "-x"), solve=history)
    yield _case("the whole course forth and back", back, same=("angle 45 degrees, backwards", 1e-8))


def _scene(
    kinematics: Kinematics,
    mu: float = 0.3,
    bound: float | None = None,
    depth: float = 1.5,
    slide: Slide | tuple[Literal["+x", "-x"], ...] = "+x",
    **parts: Any,  # noqa: ANN401  tables of a scene
) -> Scene:
    usual = Scene(friction=Friction(mu, bound), loading=Loading(depth, slide), solve=Solve(kinematics))
    return replace(usual, **parts)


def _case(
    name: str,
    scene: Scene,
    must: Must = ANSWER,
    same: tuple[str, float] = ("", 0.0),
    run: Callable[[Scene], Outcome] = of_scene,
    *,
    slow: bool = False,
) -> Case:
    return Case(scene.solve.kinematics, name, must, partial(run, scene), *same, slow)


def _of_nu(nu: float) -> Materials:
    return Materials(Material(0.136, nu), Material(0.08, nu), Material(0.034, nu))


def _tissues(make: Callable[..., Scene]) -> Iterator[Case]:
    for nu in (0.0, 0.3, 0.48, 0.499, 0.4999):
        yield _case(f"nu {nu}", make(materials=_of_nu(nu)))
    for nu in (0.49999, 0.499999, 0.4999999):
        yield _case(f"nu {nu}", make(materials=_of_nu(nu)), same=("nu 0.4999", 2e-3))
    yield _case("nu 0.4999999 at 1e-05 mm", make(depth=1e-5, materials=_of_nu(0.4999999)))
    rigid = replace(_of_nu(0.48), bone=Material(3.4e8, 0.3))
    for name, depth, same_as in (("", 1.5, "nu 0.48"), (" at 1e-05 mm", 1e-5, "depth 1e-05 mm")):
        scene = make(depth=depth, materials=rigid, finger=Finger(bone="meshed"))
        yield _case(f"bone 1e10 times stiffer than fat{name}", scene, same=(same_as, 2.0 * USUAL_TOLERANCE))
    stiff = Materials(Material(3.4e4, 0.48), SOFT, SOFT)
    yield _case("epidermis 1e6 times stiffer than fat", make(materials=stiff), EITHER, slow=True)


def _friction(make: Callable[..., Scene]) -> Iterator[Case]:
    yield _case("mu 0", make(0.0))
    yield _case("mu 1e-09", make(1e-9), same=("mu 0", 1e-6))
    yield _case("mu 0.44", make(0.44))
    for bound, same_as, within in ((0.0, "mu 0", 1e-9), (1e-9, "mu 0", 1e-5), (1e9, "mu 0.44", 1e-9)):
        name = "tau_max 0 MPa" if bound == 0.0 else f"tau_max {bound:.0e} MPa"
        yield _case(name, make(0.44, bound), same=(same_as, within))
    for mu in (10.0, 1000.0):
        yield _case(f"mu {mu:g} with a bound of 0.005 MPa", make(mu, 0.005))
    for mu in (10.0, 1000.0):
        yield _case(f"mu {mu:g} with a bound of 0.02 MPa, backwards", make(mu, 0.02, slide="-x"))


def _depths(make: Callable[..., Scene], *, small: bool) -> Iterator[Case]:
    for depth in (1e-6, 3e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0):
        yield _case(f"depth {depth:g} mm", make(depth=depth), run=of_light_touch if depth < RESOLVABLE else of_scene)
    yield _case("depth 2 mm", make(depth=2.0), ANSWER if small else EITHER)
    yield _case("depth 3 mm", make(depth=3.0), EITHER, slow=not small)
    for depth in (1e-6, 1e-3, 0.1, 2.0):
        run = of_light_touch if depth < RESOLVABLE else of_scene
        yield _case(f"depth {depth:g} mm without friction", make(0.0, depth=depth), run=run)
    yield _case("depth 3 mm without friction", make(0.0, depth=3.0), ANSWER if small else EITHER, slow=not small)
