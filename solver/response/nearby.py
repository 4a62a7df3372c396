"""Slides near a predicted one, on its mesh and from its state, and derivatives with respect to friction and load.

A nearby slide costs a few small systems, and most of the mesh error cancels in its difference from the prediction. A
derivative takes one more solve of the last system at fixed contact states, and is exact until a state changes. At a
kink, where a node is about to change its state, it is one-sided.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from solver._kernels import SHEAR_LIMITED, SLIP, STICK
from solver._kernels.contact_system import assemble_contact_system, bounded_length, tributary
from solver.arrays import Array, ContactStates, SkinPosition
from solver.body import Patches
from solver.body.finite import IMAGINARY
from solver.contact import STATE_NAMES, ForceLoad, LoadState
from solver.continuation import jumped_branch
from solver.continuation.existence import is_sound
from solver.equilibrium import BY_DEPTH, BY_FRICTION, EquilibriumState, Newton, Termination, load_arguments
from solver.equilibrium.finger import KINDS, Finger, FiniteFinger, LinearFinger
from solver.equilibrium.load_stepping import slide_from_guess, sliding_load, solve_full_slip, solve_under_forces
from solver.failures import NotConverged
from solver.prediction import Prediction, Skin
from solver.quantities import NAMES, SED
from solver.scene import Scene
from solver.scene.tables import TISSUES

_MU, TAU_MAX, _DEPTH = range(3)


class Gradient(NamedTuple):
    """The derivatives of one result with respect to each parameter."""

    mu: float  # coefficient of friction [-]
    tau_max: float  # traction bound [MPa]; 0 where nothing slips at the bound
    indentation: float | None  # [mm]; None where a force presses the finger
    normal_force: float | None  # [N/mm]; None where a depth is given


@dataclass(frozen=True, slots=True)
class Derivatives:
    """The derivatives of the results of full slip."""

    sed: Gradient  # averaged over the ending [MPa]
    normal: Gradient  # force of the surface on the finger along +y [N/mm]
    tangential: Gradient  # drag opposing the slide [N/mm]
    indentation: Gradient  # [mm]
    responses: Mapping[str, Gradient]  # of every quantity at the ending, by name


def _derivatives(rows: Sequence[Gradient]) -> Derivatives:
    """Return the derivatives of every quantity, of both forces and of the indentation."""
    by_name = dict(zip(NAMES, rows, strict=False))
    return Derivatives(by_name[SED.name], *rows[len(NAMES) :], responses=by_name)


def skin_derivatives(newton: Newton, state: EquilibriumState) -> Array:
    """Return the derivatives (2 k, 3) of a slide's skin with respect to mu, tau_max and depth, at fixed contact states.

    Raises ValueError for a state that is not full slip, and for one without a tangent, at a limit.
    """
    load, size = state.load, len(state.state)
    if load.sense == 0 or (state.state == STICK).any():
        raise ValueError("a state with sticking points depends on its load path, which its tangent does not know")
    if not newton.linearise(state, newton.skin_x):
        raise ValueError("the state has no tangent")
    x = np.ascontiguousarray(state.skin_positions(newton.condensed)[:, 0])
    position = SkinPosition(x, np.zeros(size), x)  # on the surface, with sticking nodes at their anchors
    system = newton.system
    bounded_length(x, newton.skin, system.length)
    count = assemble_contact_system(
        newton.arrays(), newton.skin, ContactStates(state.state, state.sense, state.reaction), load_arguments(load),
        position, system,
    )  # fmt: skip
    free, right_sides = system.free[:count], np.zeros((count, 3))
    right_sides[:, _MU], right_sides[:, _DEPTH] = system.right[:count, BY_FRICTION], system.right[:count, BY_DEPTH]
    node, along = np.divmod(free, 2)
    at_bound = (state.state[node] == SHEAR_LIMITED) & (along == 0)
    right_sides[:, TAU_MAX] = np.where(at_bound, state.sense[node] * system.length[node], 0.0)
    out = np.zeros((2 * size, 3))
    out[:, _DEPTH] = newton.steps[:, BY_DEPTH]
    out[free] = np.linalg.solve(system.matrix[: count * count].reshape(count, count), right_sides)
    return out


def stiffness_derivatives(finger: LinearFinger, state: EquilibriumState) -> Array:
    """Return d log N / d log E (r,) of the normal force N of a frictionless press, E being each tissue's stiffness.

    Regions are in the order of the mesh; a rigid bone has 0. With displacements u, their derivative w with respect to
    depth and the stiffness K of one tissue, dN / d log E = w K u: without friction the contact forces work on w only
    through the depth. The sum is 1, since N is linear in all stiffnesses together. Raises ValueError with friction.
    """
    if state.load.mu != 0.0:
        raise ValueError("with friction the normal force is no derivative of an energy")
    mesh = finger.geometry.mesh
    by_depth = finger.body.recover_increments(skin_derivatives(finger.newton, state)[:, _DEPTH, None])[:, :, 0]
    forces = finger.body.elastic.forces(mesh.local(finger.displacement(state)))
    work = np.sum(mesh.local(by_depth) * forces, axis=(1, 2))
    return np.bincount(mesh.region, work, minlength=len(TISSUES)) / float(state.normal.sum())


def response_derivatives(endings: Patches, displacement: Array, steps: Array) -> Array:
    """Return the derivatives of responses (q, r, c) at a `displacement` (nodes, 2) along `steps` (nodes, 2, c).

    They are complex-step derivatives (Squire and Trapp 1998, SIAM Rev. 40, 110), exact to round-off.
    """
    perturbed = cast("Array", displacement[:, :, None] + 1j * IMAGINARY * steps)
    return endings.responses(perturbed).imag / IMAGINARY


_TOLERANCE = 1e-9  # tolerance of displacements [-], far below the effect of any measurable difference of friction
_STATE_NUMBERS = {name: state for state, name in STATE_NAMES.items()}


@dataclass(frozen=True, slots=True, eq=False)
class Nearby:
    """Full slip of a scene, and of scenes near it."""

    scene: Scene
    state: EquilibriumState
    finger: Finger[Any]

    def derivatives(self) -> Derivatives:
        """Return the derivatives of the slide from the tangent at convergence, under a given depth or force.

        Raises ValueError where points stick, because such a state depends on its load path, and where it has no
        tangent.
        """
        finger, state = self.finger, self.state
        skin = skin_derivatives(finger.newton, state)
        along, up = finger.newton.force_changes(skin)
        increments = finger.body.recover_increments(skin)
        ending = response_derivatives(finger.ending, finger.displacement(state), increments)[:, 0]
        drag = -(self.scene.loading.direction or 1) * along  # opposes the slide
        rows = np.array([*ending, up, drag, [0.0, 0.0, 1.0]]) + 0.0  # never -0
        if self.scene.normal_force is None:
            return _derivatives([Gradient(mu, tau, depth, None) for mu, tau, depth in rows.tolist()])
        rows[:, 2] /= up[2]  # the depth changes so that the force stays
        rows[:, :2] -= rows[:, 2:] * up[:2]
        derivatives = _derivatives([Gradient(mu, tau, None, force) for mu, tau, force in rows.tolist()])
        return replace(derivatives, normal=Gradient(0.0, 0.0, None, 1.0))

    def seds(self, scenes: Sequence[Scene]) -> Array:
        """Return the SED (n, 2) [MPa] of scenes, as `responses` does."""
        return self.responses(scenes)[:, 0]

    def responses(self, scenes: Sequence[Scene]) -> Array:
        """Return every quantity (n, q, 2) of scenes that differ from this one in friction, depth or force alone.

        The last axis is the average over the ending, and its midpoint; nan where full slip was not found.
        """
        out = np.full((len(scenes), len(NAMES), 2), np.nan)
        near: dict[int, EquilibriumState] = {}
        for number, scene in enumerate(scenes):
            with suppress(NotConverged):
                slide = self._slide(scene)
                # where new contact includes an end of the skin, skin beyond it may touch too
                if not (slide.touching & ~self.state.touching)[[0, -1]].any() and self._on_branch(slide):
                    near[number] = slide
        if near:
            out[list(near)] = self.finger.ending_and_middle(list(near.values()))
        return out

    def _slide(self, scene: Scene) -> EquilibriumState:
        """Return full slip of a scene, started from this state. Raises NotConverged."""
        if isinstance(self.finger, LinearFinger):
            return _small_slide(self.finger, scene, self.state.state)
        newton, state = self.finger.newton, self.state
        load = state.load._replace(mu=float(scene.friction.mu), tau=scene.friction.cap)
        if scene.normal_force is None:
            return solve_full_slip(newton, load._replace(depth=scene.loading.depth), state, _TOLERANCE)
        force = ForceLoad(scene.normal_force, None)
        return solve_under_forces(newton, replace(state, load=load), force, Termination(_TOLERANCE))

    def _on_branch(self, near: EquilibriumState) -> bool:
        """Return whether a state at finite strain lies on the branch of this one, as far as this mesh resolves it."""
        if not isinstance(self.finger, FiniteFinger):
            return True
        beyond = near.load.mu > self.state.load.mu or near.load.depth > self.state.load.depth
        if beyond and not is_sound(self.finger, near):  # the skin may have folded
            return False
        return not jumped_branch(self.finger, self.state, near)


def nearby(predictions: Sequence[Prediction]) -> Iterator[Nearby | None]:
    """Yield the slide of each prediction.

    Yields None where the finger is only pressed or held by a drag, so that its state depends on its load path, and
    where the state is not recovered.
    """
    finger: Finger[Any] | None = None
    for prediction in predictions:
        scene = prediction.scene
        if scene.loading.direction == 0 or scene.loading.dragged:
            yield None
            continue
        if finger is None or isinstance(finger, FiniteFinger) or finger.geometry is not prediction.geometry:
            finger = KINDS[scene.solve.kinematics].on(scene, prediction.geometry)
        try:
            if isinstance(finger, FiniteFinger):
                yield Nearby(scene, _recover_slide(finger, prediction), finger)
            elif isinstance(finger, LinearFinger):
                yield Nearby(scene, _small_slide(finger, scene, contact_states(prediction.skin)), finger)
        except NotConverged:
            yield None


def stiffness_shares(predictions: Sequence[Prediction]) -> Array:
    """Return d log N / d log E (n, 4) by tissue of frictionless slides at small strain.

    Raises ValueError for other predictions, and where a state is not recovered.
    """
    prediction: list[Array] = []
    for slide in nearby(predictions):
        if slide is None or not isinstance(slide.finger, LinearFinger):
            raise ValueError("no press at small strain that slides without friction")
        prediction.append(stiffness_derivatives(slide.finger, slide.state))
    return np.array(prediction)


def contact_states(skin: Skin) -> NDArray[np.int64]:
    """Return the contact states (k,) of sliding skin, with slip in place of stick."""
    return np.array([SLIP if state == "stick" else _STATE_NUMBERS[state] for state in skin.state])


def _small_slide(finger: LinearFinger, scene: Scene, guess: NDArray[np.integer]) -> EquilibriumState:
    """Return full slip of a scene from a guess of its contact states. Raises ContactLost."""
    return slide_from_guess(finger.newton, sliding_load(scene), guess, scene.normal_force)


def _recover_slide(finger: FiniteFinger, prediction: Prediction) -> EquilibriumState:
    """Return full slip of `prediction` at finite strain. Raises NotConverged where it is not recovered."""
    scene, skin, sense = prediction.scene, prediction.skin, -prediction.scene.loading.direction
    length = np.empty(len(skin.x))
    tributary(skin.x, finger.body.middle, length)
    load = LoadState(prediction.indentation, float(scene.friction.mu), scene.friction.cap, sense)
    state = contact_states(skin).astype(np.int32)
    reaction = np.stack([skin.traction, skin.pressure], axis=1) * length[:, None]
    modes, senses = finger.body.pressure(prediction.displacement), np.full(len(state), sense, np.int32)
    return finger.newton.solve(EquilibriumState(prediction.displacement, modes, state, senses, reaction, load, 0), load)
