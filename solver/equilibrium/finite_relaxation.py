"""Courses of tissues that relax at finite strain, step by step in time: a relaxed law, and the overstress of the past.

In the end only the relaxed law is left (`tissues.finite_laws`). The finger carries its own skin along the surface and
nothing flows through it, so that a settled slide stands still in the tissue and has relaxed wholly, whatever its speed.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from solver import _kernels as kernels
from solver._kernels import STICK
from solver.arrays import Array, Indices
from solver.body.finite import CondensedFinite, FiniteBody, FiniteProbes
from solver.body.finite_measures import deformation
from solver.body.tissues import relaxing_laws
from solver.body.validation import check_moduli, check_terms
from solver.constitutive import overstress
from solver.constitutive.linear import Prony
from solver.constitutive.overstress import Past
from solver.equilibrium import force_control as finite_forced
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.load_path import (
    DRAGGING_STEPS,
    DRAGGING_TIME,
    HALVINGS,
    LONG,
    PRESSING_STEPS,
    PRESSING_TIME,
    Aim,
)
from solver.equilibrium.newton import FiniteNewton, Given, Newton, Shape, lowered
from solver.equilibrium.relaxation import RELAXED, wait
from solver.failures import Cancelled, NotConverged, followed_to
from solver.progress import tell
from solver.scene import Scene

FIRST, LARGEST = 0.02, 0.1  # steps of a slide, by the indentation; each a fifth longer than the one before
GOOD, CLOSE = 1e-8, 1e-7  # tolerance of displacements [mm], and by the indentation where that is less


class CondensedRelaxing(CondensedFinite):
    """A body that relaxes, whose own laws are the relaxed ones."""

    def __init__(self, body: FiniteBody, laws: Sequence[Prony]) -> None:
        """Start at rest; `laws` by region, of which the terms and moduli at once are used. Raises BodyError."""
        super().__init__(body)
        check_moduli(body.mesh, laws)
        check_terms(laws)
        self.past = Past.at_rest(*_terms(laws, np.repeat(body.mesh.region, body.weight.shape[1])))
        self.tensor = np.zeros((*body.weight.shape, 4))

    def assemble(self, u: Array, pressure: Array) -> float:
        """Fill tangents and forces at a state and return the least det F."""
        least = super().assemble(u, pressure)
        if least > 0.0:
            self._add(u, anew=True)
        return least

    def resist(self, u: Array) -> float:
        """Fill the forces at a state for the tangent that is there and return the least det F."""
        least = super().resist(u)
        if least > 0.0:
            self._add(u, anew=False)
        return least

    def _add(self, u: Array, *, anew: bool) -> None:
        kernels.add_overstress(u, self.tensor, self.body.elements, self.system, anew)


class RelaxingNewton(FiniteNewton):
    """The iterations on a body that relaxes."""

    def __init__(self, body: FiniteBody, laws: Sequence[Prony]) -> None:
        """Start at rest; `laws` by region, of which the terms and moduli at once are used. Raises BodyError."""
        self.body = body
        self.finite = self.relaxing = CondensedRelaxing(body, laws)
        Newton.__init__(self, self.relaxing)

    def ready(self, step: float) -> None:
        """Prepare a step in time [s]."""
        body = self.relaxing
        body.tensor = body.past.over(step).reshape(body.tensor.shape)
        body.found = None

    def took(self, shape: Shape, step: float) -> None:
        """Remember the step that was made ready and led to `shape`."""
        body = self.relaxing
        body.past = body.past.after(deformation(self.body, shape.u).reshape(-1, 2, 2), step)

    def excess(self, shape: Shape) -> Array:
        """Return the forces (e, 18) of the overstress on the nodes of the elements at `shape`."""
        body = self.body
        stress = overstress.stress(self.relaxing.tensor, deformation(body, shape.u))
        gradient = np.stack([body.grad_x, body.grad_y], axis=-1)
        return np.einsum("eq,eqaA,eqiA->eia", body.weight, stress, gradient).reshape(len(body.nodes), 18)

    def excess_energy(self) -> float:
        """Return the energy [N mm per mm] that the terms hold at the last instant remembered."""
        return float(self.relaxing.past.energy() @ self.body.weight.ravel())


def _terms(laws: Sequence[Prony], region: Indices) -> tuple[Array, Array]:
    """Return g G and tau (p, m) of the terms at points in regions (p,)."""
    most = max(len(law.terms) for law in laws)
    shear, tau = np.zeros((len(region), most)), np.ones((len(region), most))
    for number, law in enumerate(laws):
        for place, (g, time) in enumerate(law.terms):
            shear[region == number, place], tau[region == number, place] = g * law.shear, time
    return shear, tau


class _Watched:
    """The energy of one patch of probes, with what its tissue still holds of the past."""

    def __init__(self, probes: FiniteProbes, body: FiniteBody, laws: Sequence[Prony]) -> None:
        self._probes, self._body = probes, body
        self._past = Past.at_rest(*_terms(laws, body.mesh.region[probes.element]))

    def follow(self, shape: Shape, step: float) -> float:
        """Return the average energy density [MPa] at `shape`, reached by a `step` [s]."""
        probes, body = self._probes, self._body
        local = shape.u[body.nodes[probes.element]]
        gradient = np.stack([probes.grad_x, probes.grad_y], axis=-1)
        self._past = self._past.after(np.eye(2) + np.einsum("pia,piA->paA", local, gradient), step)
        energy = probes.energy(body, shape.u) + self._past.energy()
        return float(energy @ probes.weights / probes.weights.sum())


class RelaxingCourse:
    """A course from first touch on: `shapes`, and at each of them `times` [s] and `sed` of ending and point [MPa]."""

    def __init__(
        self,
        scene: Scene,
        finger: FiniteFinger,
        stop: Callable[[], bool] = lambda: False,
        aims: Sequence[Aim] | None = None,
        times: float = 1.0,
    ) -> None:
        """March the whole course in `times` the usual steps, or to `aims` alone. Raises NotConverged, Cancelled."""
        self._laws = relaxing_laws(scene.materials)
        self.newton = RelaxingNewton(finger.newton.body, self._laws)
        self._watched = [_Watched(probes, self.newton.body, self._laws) for probes in (finger.ending, finger.point)]
        self._scene, self._stop, self._times = scene, stop, times
        self._aim, self._sense = Aim(0.0, 0.0, 0.0), 0
        mu, tau = float(scene.friction.mu), scene.friction.cap
        self.shapes = [finite_forced.untouched(self.newton, mu, tau)]
        self.times, self.sed = [0.0], [(0.0, 0.0)]
        if aims is None:
            self._march()
        else:
            for aim in aims:
                self._go(aim)
        del self.shapes[0], self.times[0], self.sed[0]

    def _march(self) -> None:
        loading, drag = self._scene.loading, self._scene.tangential_force
        force = self._scene.normal_force
        press = loading.depth if force is None else force
        count = round(PRESSING_STEPS * self._times)
        for number in range(1, count + 1):
            part = number / count
            tell("pressing step by step, since the tissues relax", part)
            self._go(Aim(PRESSING_TIME * part, press * part, 0.0))
        if drag is not None:
            pull = -loading.direction * drag
            count = round(DRAGGING_STEPS * self._times)
            for number in range(1, count + 1):
                part = number / count
                tell("dragging step by step, since the tissues relax", part)
                self._go(Aim(PRESSING_TIME + DRAGGING_TIME * part, press, pull * part))
        else:
            for direction in loading.directions:
                self._slide(direction * loading.speed)
        self._wait(0.0 if drag is not None else loading.direction * loading.speed)

    def _slide(self, speed: float) -> None:
        """Slide until every touching point slips. Raises NotConverged where some never do."""
        depth = self.shapes[-1].pull.depth
        step, distance = FIRST / self._times * depth, 0.0
        while distance < LONG * depth:
            tell("sliding step by step until nothing sticks, since the tissues relax", distance / (LONG * depth))
            self._go(Aim(self._aim.time + step / abs(speed), self._aim.press, self._aim.along + np.sign(speed) * step))
            distance += step
            step = min(1.2 * step, LARGEST / self._times * depth)
            if not (self.shapes[-1].state == STICK).any():
                return
        raise NotConverged(
            f"after {distance:.3g} mm of sliding some skin still stuck: no settled state was reached; ask for less "
            "friction or depth"
        )

    def _wait(self, speed: float) -> None:
        """Go on until all terms have relaxed."""
        self._sense = -int(np.sign(speed))  # by now all that touches slips, whatever comes to touch

        begun, longest = self.times[-1], RELAXED * self._scene.materials.longest_creep

        def go(step: float) -> None:
            part = min((self.times[-1] - begun) / longest, 1.0)
            tell("waiting step by step until the tissues have relaxed", part)
            self._go(Aim(self._aim.time + step, self._aim.press, self._aim.along + speed * step))

        wait(go, self.times[-1] - self.times[-2], self._scene.materials.longest_creep, self.sed, self._times)

    def _go(self, aim: Aim, halvings: int = HALVINGS) -> None:
        """Append the state at `aim`, in smaller steps where one of that size fails."""
        if self._stop():
            raise Cancelled
        step = aim.time - self._aim.time
        self.newton.ready(step)
        try:
            shape = self._found(aim)
        except NotConverged as reason:
            if halvings == 0:
                last = self.shapes[-1].pull
                raise followed_to(last.depth, last.travel, reason) from reason
            self._go(self._aim.towards(aim, 0.5), halvings - 1)
            self._go(aim, halvings - 1)
            return
        self.newton.took(shape, step)
        self.shapes.append(shape)
        self.times.append(aim.time)
        ending, point = (watched.follow(shape, step) for watched in self._watched)
        self.sed.append((ending, point))
        self._aim = aim

    def _found(self, aim: Aim) -> Shape:
        """Return the state at `aim`, coming from the last one."""
        last = self.shapes[-1]
        last = replace(last, pull=last.pull._replace(sense=self._sense))
        if self._scene.normal_force is None:
            good = min(GOOD, CLOSE * self._scene.loading.depth)
            return self.newton.settle(last, last.pull._replace(depth=aim.press, travel=-aim.along), good)
        given = Given(aim.press, aim.along) if self._scene.loading.dragged else Given(aim.press, None, -aim.along)
        return finite_forced.balanced(self.newton, lowered(self.newton.condensed, last), given)
