"""The live model at finite strain: as far as its warm stepper reaches, and back again once the forces have eased."""

from solver import Scene
from solver.arrays import Array, Indices
from solver.equilibrium.finite_finger import FiniteFinger
from solver.mesh.mesher import Sizing
from solver.response.finite_picture import FinitePicture
from solver.response.finite_stepper import FiniteStepper
from solver.response.stepper import FINENESS, MARGIN

WARMING = 1e-3  # [N/mm]


class LiveFinite:
    """Follows one finger at finite strain; what it cannot follow is nan until the finger lifts or eases."""

    def __init__(self, scene: Scene, mu: float) -> None:
        """Mesh the finger of `scene`. Raises SceneError where it cannot be meshed."""
        finger = FiniteFinger.of(scene, Sizing(FINENESS["finite"], scene.loading.depth, margin=MARGIN["finite"]))
        self._stepper = FiniteStepper(finger, mu)
        self._drawn = FinitePicture.of(finger, scene)
        self._stepper.step(WARMING, 0.0)  # compiles, or loads what was compiled
        self._drawn.sed(self._stepper.shape)
        self._stepper.forget()

    @property
    def depth(self) -> float:
        """Indentation found [mm]."""
        return self._stepper.depth

    @property
    def rest(self) -> Array:
        """Return where the nodes that are drawn are while nothing touches (n, 2) [mm]."""
        return self._drawn.rest

    def step(self, normal: float, pull: float, mu: float, tau: float) -> float:
        """Return the SED at the ending [MPa] under forces [N/mm]; nan where they are beyond its reach."""
        self._stepper.mu, self._stepper.tau = mu, tau
        return self._stepper.step(normal, pull)

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        self._stepper.forget()

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa]."""
        return self._stepper.row()

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm], the surface being y = 0."""
        return self._stepper.outline()

    def drawn(self) -> tuple[Array, Indices, Array]:
        """Return nodes (n, 2) [mm], faces (f, 4) and their SED (f,) [MPa] as they are now."""
        shape = self._stepper.shape
        return self._drawn.nodes(shape), self._drawn.faces, self._drawn.sed(shape)
