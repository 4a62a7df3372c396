"""What a live view asks of a warm stepper, and how one is made for a scene: forces in, the state and its SED out."""

from typing import Protocol

from solver.arrays import Array
from solver.equilibrium.expected_depth import expected_depth
from solver.mesh.mesher import Sizing
from solver.scene import Scene

FINENESS = {"small": 4.0, "finite": 2.7}  # meshes on which the response is good to about 1 % of its peak
MARGIN = {"small": 4.0, "finite": 6.0}  # how far above the indentation undeformed skin is looked at for contact


class Stepper(Protocol):
    """Follows one finger on one surface, reading by reading; holds the last state and memory of fixed size.

    >>> from solver.scene.published import SLIPPERINESS, scene
    >>> follows = stepper(scene(SLIPPERINESS[0]))
    >>> sed = [follows.step(0.001 * n, -0.0002 * n) for n in range(1, 50)]
    >>> 0.0 < sed[0] < sed[-1], bool(0.5 < follows.depth < 1.5)
    (True, True)
    """

    mu: float  # coefficient of friction, taken anew with every reading [-]
    tau: float  # traction bound, likewise [MPa]

    @property
    def depth(self) -> float:
        """Indentation found [mm]."""
        ...

    @property
    def travel(self) -> float:
        """How far the bone has moved along +x while something stuck [mm]; sliding, which forces do not tell, adds 0."""
        ...

    def step(self, normal: float, tangential: float) -> float:
        """Take one reading and return the SED averaged over the ending [MPa]; nan where no state can be told of.

        `normal` [N/mm] presses the finger, `tangential` [N/mm] is the surface's pull on it along +x. At small strain
        the next reading starts afresh from the untouched finger; at finite strain, where that is in vain, the first
        after the force has eased.
        """
        ...

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa], at `receptor.ROW`; nan beyond the finger."""
        ...

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""
        ...

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        ...


def stepper(scene: Scene) -> Stepper:
    """Return a stepper for the finger and the surface of `scene`, on a mesh made for its indentation or force.

    Forces that press much deeper lose the state. Raises SceneError where the finger cannot be meshed.
    """
    kind = scene.solve.kinematics
    sizing = Sizing(FINENESS[kind], expected_depth(scene), margin=MARGIN[kind])
    mu, tau = float(scene.friction.mu), scene.friction.cap
    # Imported here: only what is asked for is loaded, compiled loops of the other kinematics are not.
    if kind == "finite":
        from solver.equilibrium.finite_finger import FiniteFinger
        from solver.response.finite_stepper import FiniteStepper

        return FiniteStepper(FiniteFinger.of(scene, sizing), mu, tau)
    from solver.equilibrium.finger import FingerModel
    from solver.response.small_stepper import Condensed, SmallStepper

    follower = SmallStepper(Condensed.of(FingerModel.of(scene, sizing)), mu, tau)
    follower.step(1e-3, 0.0)  # compiles, or loads what was compiled
    follower.forget()
    return follower
