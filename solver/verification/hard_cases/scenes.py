"""The hard cases that are scenes of the finger: name, scene, and what must happen."""

from dataclasses import dataclass
from typing import Literal

from solver.scene import Finger, Friction, Loading, Material, Materials, Receptor, Scene, Solve
from solver.verification.hard_cases.light import KNOWN
from solver.verification.methods import Kinematics

Must = Literal["answer", "answer or limit"]
ANSWER: Must = "answer"
EITHER: Must = "answer or limit"


@dataclass(frozen=True, slots=True)
class HardScene:
    """One scene and what must happen."""

    name: str
    scene: Scene
    must: Must
    same_as: str = ""  # a case whose SED this one's must be
    within: float = 0.0  # relative
    slow: bool = False  # seconds rather than tenths
    light: bool = False  # a touch so light that it must be Hertz's


def hard_scenes(kinematics: Kinematics) -> list[HardScene]:
    """Return the scenes of the suite in one of the two kinematics."""
    make = _Maker(kinematics)
    return [
        *_tissues(make),
        *_friction(make),
        *(_beyond_small(make) if kinematics == "small" else _beyond_finite(make)),
        *_depths(make),
        *_angles(make),
        *_layers(make),
        HardScene("the whole course at nu 0.4999999", make(0.44, 0.005, nu=0.4999999, history=True), ANSWER),
        HardScene(
            "the whole course forth and back",
            make(0.44, 0.03, history=True, back=True),
            ANSWER,
            "angle 45 degrees, backwards",
            1e-8,
        ),
    ]


class _Maker:
    """Makes scenes of one kinematics: mu 0.3 at 1.5 mm unless said otherwise."""

    def __init__(self, kinematics: Kinematics) -> None:
        self.kinematics: Kinematics = kinematics

    def __call__(
        self,
        mu: float = 0.3,
        bound: float | None = None,
        depth: float = 1.5,
        *,
        backward: bool = False,
        nu: float = 0.48,
        finger: Finger | None = None,
        materials: Materials | None = None,
        receptor: Receptor | None = None,
        history: bool = False,
        back: bool = False,
    ) -> Scene:
        tissues = materials or Materials(Material(0.136, nu), Material(0.08, nu), Material(0.034, nu))
        return Scene(
            finger=finger or Finger(),
            materials=tissues,
            friction=Friction(mu, bound),
            loading=Loading(depth, ("+x", "-x") if back else "-x" if backward else "+x"),
            receptor=receptor or Receptor(),
            solve=Solve(self.kinematics, "history" if history else "steady"),
        )


def _tissues(make: _Maker) -> list[HardScene]:
    plain = [HardScene(f"nu {nu}", make(nu=nu), ANSWER) for nu in (0.0, 0.3, 0.48, 0.499, 0.4999)]
    limit = [HardScene(f"nu {nu}", make(nu=nu), ANSWER, "nu 0.4999", 2e-3) for nu in (0.49999, 0.499999, 0.4999999)]
    soft = Material(0.034, 0.48)
    stiff = make(materials=Materials(Material(3.4e4, 0.48), soft, soft))
    rigid = Materials(Material(0.136, 0.48), Material(0.08, 0.48), soft, Material(3.4e8, 0.3))
    ratio, light = (make(depth=d, materials=rigid, finger=Finger(bone="meshed")) for d in (1.5, 1e-5))
    return [
        *plain,
        *limit,
        HardScene("nu 0.4999999 at 1e-05 mm", make(depth=1e-5, nu=0.4999999), ANSWER),
        HardScene("bone 1e10 times stiffer than fat", ratio, ANSWER, "nu 0.48", 1e-3),
        HardScene("bone 1e10 times stiffer than fat at 1e-05 mm", light, ANSWER, "depth 1e-05 mm", 1e-3),
        HardScene("epidermis 1e6 times stiffer than fat", stiff, EITHER, slow=True),
    ]


def _friction(make: _Maker) -> list[HardScene]:
    return [
        HardScene("mu 0", make(0.0), ANSWER),
        HardScene("mu 1e-09", make(1e-9), ANSWER, "mu 0", 1e-6),
        HardScene("mu 0.44", make(0.44), ANSWER),
        HardScene("tau_max 0 MPa", make(0.44, 0.0), ANSWER, "mu 0", 1e-9),
        HardScene("tau_max 1e-09 MPa", make(0.44, 1e-9), ANSWER, "mu 0", 1e-5),
        HardScene("tau_max 1e+09 MPa", make(0.44, 1e9), ANSWER, "mu 0.44", 1e-9),
        *(HardScene(f"mu {mu:g} with a bound of 0.005 MPa", make(mu, 0.005), ANSWER) for mu in (10.0, 1000.0)),
        *(
            HardScene(f"mu {mu:g} with a bound of 0.02 MPa, backwards", make(mu, 0.02, backward=True), ANSWER)
            for mu in (10.0, 1000.0)
        ),
    ]


def _beyond_small(make: _Maker) -> list[HardScene]:
    """Return scenes near and beyond the coefficient at which the finger wedges itself in."""
    pairs = ((1.5, 1.4), (2.0, 1.3), (2.0, 2.0))
    return [HardScene(f"mu {mu:g} at {depth:g} mm", make(mu, depth=depth), EITHER, slow=True) for depth, mu in pairs]


def _beyond_finite(make: _Maker) -> list[HardScene]:
    """Return scenes near and beyond the coefficient at which the skin behind the contact folds."""
    pairs = ((2.0, 0.37), (2.0, 0.38), (2.0, 0.44), (1.5, 0.62), (1.0, 2.0))
    return [HardScene(f"mu {mu:g} at {depth:g} mm", make(mu, depth=depth), EITHER, slow=True) for depth, mu in pairs]


def _depths(make: _Maker) -> list[HardScene]:
    small = make.kinematics == "small"
    shallow = (1e-6, 3e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0)
    return [
        *(HardScene(f"depth {d:g} mm", make(depth=d), ANSWER, light=d < KNOWN) for d in shallow),
        HardScene("depth 2 mm", make(depth=2.0), ANSWER if small else EITHER),
        HardScene("depth 3 mm", make(depth=3.0), EITHER, slow=not small),
        *(
            HardScene(f"depth {d:g} mm without friction", make(0.0, depth=d), ANSWER, light=d < KNOWN)
            for d in (1e-6, 1e-3, 0.1, 2.0)
        ),
        HardScene("depth 3 mm without friction", make(0.0, depth=3.0), ANSWER if small else EITHER, slow=not small),
    ]


def _angles(make: _Maker) -> list[HardScene]:
    return [
        HardScene(
            f"angle {angle:g} degrees{', backwards' if backward else ''}",
            make(0.44, 0.03, finger=Finger(contact_angle=angle), backward=backward),
            ANSWER if 30.0 <= angle <= 75.0 else EITHER,
        )
        for angle in (15.0, 30.0, 45.0, 60.0, 75.0, 85.0)
        for backward in (False, True)
    ]


def _layers(make: _Maker) -> list[HardScene]:
    thin = {
        "epidermis of 0.05 mm": (0.05, 1.25),
        "dermis of 0.05 mm": (0.75, 0.05),
        "epidermis and dermis of 0.05 mm each": (0.05, 0.05),
    }
    out: list[HardScene] = []
    for name, (epidermis, dermis) in thin.items():
        across = min(0.2, dermis)
        receptor = Receptor(depth=epidermis + dermis - across / 2, ending=(across, 1.0))
        finger = Finger(epidermis=epidermis, dermis=dermis)
        must = ANSWER if make.kinematics == "small" else EITHER
        out.append(HardScene(name, make(finger=finger, receptor=receptor), must))
    return out
