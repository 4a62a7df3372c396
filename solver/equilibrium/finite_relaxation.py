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
from solver.body.finite import CondensedFinite, FiniteBody, FinitePatches
from solver.body.validation import check_moduli, check_terms
from solver.constitutive import overstress
from solver.constitutive.linear import Prony
from solver.constitutive.overstress import Past
from solver.equilibrium.finger import FiniteFinger, relaxing_laws
from solver.equilibrium.load_path import DRAGGING_STEPS, LONG, PRESSING_STEPS, Aim, Way, press_and_drag
from solver.equilibrium.load_stepping import never
from solver.equilibrium.loads import load_of
from solver.equilibrium.newton import EquilibriumState, Newton
from solver.equilibrium.relaxation import RELAXED, wait
from solver.failures import NotConverged
from solver.progress import report_progress
from solver.scene.scene import Loading, Scene

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

    def ready(self, step: float) -> None:
        """Prepare a step in time [s]."""
        self.tensor = self.past.over(step).reshape(self.tensor.shape)
        self.found = None

    def took(self, u: Array, step: float) -> None:
        """Remember the step that was made ready and led to displacements `u` (nodes, 2)."""
        self.past = self.past.after(self.body.deformation(u).reshape(-1, 2, 2), step)

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

    def excess(self, u: Array) -> Array:
        """Return the forces (e, 18) of the overstress on the nodes of the elements at displacements `u` (nodes, 2)."""
        body = self.body
        stress = overstress.stress(self.tensor, body.deformation(u))
        gradient = np.stack([body.grad_x, body.grad_y], axis=-1)
        return np.einsum("eq,eqaA,eqiA->eia", body.weight, stress, gradient).reshape(len(body.nodes), 18)

    def stored(self, u: Array, reaction: Array) -> float:
        """Return the energy stored at `u`, with what the terms hold at the last instant remembered."""
        return super().stored(u, reaction) + float(self.past.energy() @ self.body.weight.ravel())


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

    def __init__(self, probes: FinitePatches, body: FiniteBody, laws: Sequence[Prony]) -> None:
        self._probes, self._body = probes, body
        self._past = Past.at_rest(*_terms(laws, body.mesh.region[probes.element]))

    def follow(self, shape: EquilibriumState, step: float) -> float:
        """Return the average energy density [MPa] at `shape`, reached by a `step` [s]."""
        probes, body = self._probes, self._body
        local = shape.u[body.nodes[probes.element]]
        gradient = np.stack([probes.grad_x, probes.grad_y], axis=-1)
        self._past = self._past.after(np.eye(2) + np.einsum("pia,piA->paA", local, gradient), step)
        energy = probes.energy(shape.u) + self._past.energy()
        return float(energy @ probes.weights / probes.weights.sum())


class RelaxingCourse(Way):
    """A course from first touch on: its `instants`, and `sed` of ending and point at each of them [MPa]."""

    def __init__(
        self,
        scene: Scene,
        finger: FiniteFinger,
        stop: Callable[[], bool] = never,
        aims: Sequence[Aim] | None = None,
        times: float = 1.0,
    ) -> None:
        """March the whole course in `times` the usual steps, or to `aims` alone. Raises NotConverged, Cancelled."""
        laws, loading = relaxing_laws(scene.materials), scene.loading_per_mm
        self.relaxing = CondensedRelaxing(finger.body, laws)
        good = GOOD if scene.normal_force is not None else min(GOOD, CLOSE * loading.depth)
        super().__init__(Newton(self.relaxing), load_of(scene), loading, good, stop)
        self._watched = [_Watched(probes, self.relaxing.body, laws) for probes in (finger.ending, finger.point)]
        self._longest, self._times, self._sense = scene.materials.longest_creep, times, 0
        self.sed: list[tuple[float, float]] = []
        if aims is None:
            self._march(loading)
        else:
            for aim in aims:
                self.go(aim)

    def found(self, before: EquilibriumState, aim: Aim) -> EquilibriumState:
        """Return the state at `aim`, and let the body come to it. Raises NotConverged."""
        step = aim.time - self.aim.time
        self.relaxing.ready(step)
        shape = super().found(replace(before, load=before.load._replace(sense=self._sense)), aim)
        self.relaxing.took(shape.u, step)
        ending, point = (watched.follow(shape, step) for watched in self._watched)
        self.sed.append((ending, point))
        return shape

    def _march(self, loading: Loading) -> None:
        def report(part: float) -> None:
            report_progress("pressing and dragging step by step, since the tissues relax", part)

        press_and_drag(self, loading, report, round(PRESSING_STEPS * self._times), round(DRAGGING_STEPS * self._times))
        if not loading.dragged:
            for direction in loading.directions:
                self._slide(direction * loading.speed)
        self._wait(0.0 if loading.dragged else loading.direction * loading.speed)

    def _slide(self, speed: float) -> None:
        """Slide until every touching point slips. Raises NotConverged where some never do."""
        depth = self.instants[-1].depth
        step, distance = FIRST / self._times * depth, 0.0
        while distance < LONG * depth:
            report_progress(
                "sliding step by step until nothing sticks, since the tissues relax", distance / (LONG * depth)
            )
            self.go(Aim(self.aim.time + step / abs(speed), self.aim.press, self.aim.along + np.sign(speed) * step))
            distance += step
            step = min(1.2 * step, LARGEST / self._times * depth)
            if not (self.instants[-1].state.state == STICK).any():
                return
        raise NotConverged(
            f"after {distance:.3g} mm of sliding some skin still stuck: no settled state was reached; ask for less "
            "friction or depth"
        )

    def _wait(self, speed: float) -> None:
        """Go on until all terms have relaxed."""
        self._sense = -int(np.sign(speed))  # by now all that touches slips, whatever comes to touch
        begun, longest = self.aim.time, RELAXED * self._longest

        def go(step: float) -> None:
            part = min((self.aim.time - begun) / longest, 1.0)
            report_progress("waiting step by step until the tissues have relaxed", part)
            self.go(Aim(self.aim.time + step, self.aim.press, self.aim.along + speed * step))

        wait(go, self.instants[-1].time - self.instants[-2].time, self._longest, self.sed, self._times)
