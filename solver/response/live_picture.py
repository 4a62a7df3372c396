"""A live finger: its warm stepper, and the whole of it as a picture, with the energy that its elements hold."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np

from solver.arrays import Array, Indices
from solver.body.finite import FiniteBody, FinitePatches
from solver.body.receptor import Endings
from solver.body.stiffness import Elastic, Probes
from solver.equilibrium.expected_depth import expected_depth
from solver.equilibrium.finger import FiniteFinger, LinearFinger, settled_moduli
from solver.equilibrium.newton import EquilibriumState
from solver.mesh.mesh import Mesh
from solver.mesh.mesher import Sizing
from solver.response.stepper import Condensed, FiniteStepper, SmallStepper, Stepper
from solver.scene.scene import Scene

FINENESS = {"small": 4.0, "finite": 2.7}  # meshes on which the response is good to about 1 % of its peak
MARGIN = {"small": 4.0, "finite": 6.0}  # how far above the indentation undeformed skin is looked at for contact
# A nine-node element as four quadrilaterals, and the middle of each in its coordinates.
QUARTERS = np.array([[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]])
MIDDLES = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@dataclass(frozen=True, slots=True, eq=False)
class LivePicture(ABC):
    """A finger in quadrilaterals, four to an element."""

    faces: Indices  # (f, 4) nodes of the quadrilaterals
    rest: Array  # (n, 2) undeformed nodes [mm]

    @abstractmethod
    def nodes(self, state: EquilibriumState) -> Array:
        """Return where the nodes are (n, 2) [mm], the surface being y = 0."""

    @abstractmethod
    def sed(self, state: EquilibriumState) -> Array:
        """Return the SED in the middle of each face (f,) [MPa]."""


def _faces(mesh: Mesh) -> Indices:
    return mesh.elements[:, QUARTERS].reshape(-1, 4)


def _middles(mesh: Mesh) -> tuple[Indices, Array]:
    """Return the element (f,) and the local coordinates (f, 2) of the middle of each face."""
    count = len(mesh.elements)
    return np.repeat(np.arange(count), len(MIDDLES)), np.tile(MIDDLES, (count, 1))


@dataclass(frozen=True, slots=True, eq=False)
class SmallPicture(LivePicture):
    """A finger as the displacements (2 k,) of its skin see it: a picture costs two products."""

    _moved: Array  # (2 n, 2 k) displacements, x and y in turn [mm per mm]
    _strain: Array  # (3, f, 2 k) xx, yy and xy times root of 2 in the middle of each face [1/mm]
    _theta: Array  # (f, 2 k) volume strain there
    _shear: Array  # (f,) [MPa]
    _lame: Array  # (f,) [MPa]

    @classmethod
    def of(cls, finger: LinearFinger) -> Self:
        """Make the matrices of `finger`."""
        mesh, elastic = finger.geometry.mesh, finger.body.elastic
        everywhere = finger.body.every_step()  # (nodes, 2, 2 k)
        element, local = _middles(mesh)
        probes = Probes.at(mesh, elastic, element, local)
        strain = np.moveaxis(probes.strains(mesh, everywhere), 1, 0)
        return cls(
            _faces(mesh),
            mesh.nodes,
            np.ascontiguousarray(everywhere.reshape(2 * len(mesh.nodes), -1)),
            strain[:3],
            strain[3],
            elastic.shear[element],
            elastic.lame[element],
        )

    def nodes(self, state: EquilibriumState) -> Array:
        """Return where the nodes are (n, 2) [mm], the surface being y = 0."""
        return self.rest + (self._moved @ state.u.ravel()).reshape(-1, 2) - [0.0, state.load.depth]

    def sed(self, state: EquilibriumState) -> Array:
        """Return the SED in the middle of each face (f,) [MPa]."""
        skin = state.u.ravel()
        xx, yy, xy = self._strain @ skin
        theta = self._theta @ skin
        return self._shear * (xx**2 + yy**2 + xy**2) + self._lame / 2.0 * theta**2


@dataclass(frozen=True, slots=True, eq=False)
class FinitePicture(LivePicture):
    """A finger at finite strain."""

    _body: FiniteBody
    _at: FinitePatches

    @classmethod
    def of(cls, finger: FiniteFinger, scene: Scene) -> Self:
        """Place a probe in the middle of each face of the `finger` of `scene`."""
        body, mesh = finger.body, finger.geometry.mesh
        element, local = _middles(mesh)
        probes = Probes.at(mesh, Elastic.of(mesh, settled_moduli(scene.materials)), element, local)
        each = Endings(
            probes, np.ones(len(element)), np.arange(len(element)), len(element), np.tile([1.0, 0.0], (len(element), 1))
        )
        return cls(_faces(mesh), mesh.nodes, body, FinitePatches.of(body, each))

    def nodes(self, state: EquilibriumState) -> Array:
        """Return where the nodes are (n, 2) [mm], the surface being y = 0."""
        return self.rest + state.u - [0.0, state.load.depth]

    def sed(self, state: EquilibriumState) -> Array:
        """Return the SED in the middle of each face (f,) [MPa]."""
        return self._at.energy(state.u)


def stepper(scene: Scene) -> Stepper:
    """Return a stepper for the finger and the surface of `scene`, on a mesh made for its indentation or force.

    Forces that press much deeper lose the state. Raises SceneError where the finger cannot be meshed.
    """
    return stepper_and_picture(scene, picture=False)[0]


def stepper_and_picture(scene: Scene, *, picture: bool = True) -> tuple[Stepper, LivePicture | None]:
    """Return a stepper, and the picture of its finger where that is asked for. Raises as `stepper`."""
    kind = scene.solve.kinematics
    sizing = Sizing(FINENESS[kind], expected_depth(scene), margin=MARGIN[kind])
    mu, tau = float(scene.friction.mu), scene.friction.cap
    drawn: LivePicture | None = None
    if kind == "finite":
        finite = FiniteFinger.of(scene, sizing)
        drawn = FinitePicture.of(finite, scene) if picture else None
        follower: Stepper = FiniteStepper(finite, mu, tau)
    else:
        finger = LinearFinger.of(scene, sizing)
        drawn = SmallPicture.of(finger) if picture else None
        follower = SmallStepper(Condensed.of(finger), mu, tau)
    follower.step(1e-3, 0.0)  # compiles, or loads what was compiled
    if drawn is not None:
        drawn.sed(follower.state)
    follower.forget()
    return follower, drawn
