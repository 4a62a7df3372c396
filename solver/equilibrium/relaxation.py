"""Bodies whose tissues relax (`materials.Prony`), step by step in time at small strain.

Of every term of a series the strain that has not yet relaxed is kept, h(t) = integral of exp(-(t - s)/tau) de/ds ds.
It is linear in the displacements, so it is kept as displacements of each element's nodes, and its stress is the
stiffness of the shear modulus times them. Within a step the strain grows evenly, for which the recursion is exact
(Taylor, Pister and Goudreau 1970; Simo and Hughes 1998, sec. 10.3):

    h(t + dt) = exp(-dt/tau) h(t) + kept(dt/tau) (e(t + dt) - e(t)),    kept(x) = (1 - exp(-x))/x.

A step is then elastic, with the moduli `Prony.within(dt)` and what is left of the past as a load. The SED is the energy
stored in all springs of the solid, G (1 - sum g) e:e + sum g G h:h + K/2 theta^2, e being the strain's deviator.
"""

from collections.abc import Callable, Sequence
from math import ceil

import numpy as np

from solver.arrays import Array
from solver.body.linear import CondensedLinear, LinearBody
from solver.body.receptor import Endings, patch_means
from solver.body.stiffness import Elastic, Probes
from solver.body.validation import check_body, check_driven, check_held, check_terms
from solver.constitutive.linear import Moduli, Prony, kept
from solver.equilibrium.load_path import PRESSING_STEPS, PRESSING_TIME, Aim, Way, course
from solver.equilibrium.newton import EquilibriumState, LoadState, Newton
from solver.mesh.mesh import Mesh
from solver.progress import Progress
from solver.scene.scene import Loading

KEPT = 4  # lengths of steps that a body is kept ready for, factors and all
RELAXED = 14.0  # times of the slowest tissue after which a body may count as relaxed: e^-14 is 8e-7
EQUAL_STEPS = 6  # steps of equal length while nothing but relaxation goes on, before they are doubled
STILL = 1e-6  # change of the SED over such steps from which on it counts as relaxed [-]
DOUBLINGS = 60  # of the steps at most


class RelaxingBody:
    """A held body and its past; e elements, m terms at most in any of its materials."""

    def __init__(self, mesh: Mesh, laws: Sequence[Prony], *, checked: bool = False) -> None:
        """Start at rest; `laws` by region. Raises BodyError and MeshError unless `checked`.

        It takes no dead loads.
        """
        if not checked:
            check_body(mesh, laws)
            check_terms(laws)
            check_driven(mesh)
            check_held(mesh)
        self.mesh, self._laws = mesh, laws
        count, most = len(mesh.elements), max(len(law.terms) for law in laws)
        self._g, self._tau = np.zeros((count, most)), np.ones((count, most))
        for number, law in enumerate(laws):
            for place, (g, tau) in enumerate(law.terms):
                self._g[mesh.region == number, place], self._tau[mesh.region == number, place] = g, tau
        shear = [Moduli(law.shear, -2.0 / 3.0 * law.shear) for law in laws]
        self.elastic = Elastic.of(mesh, shear)  # of the shear moduli alone, at once
        self._bulk = np.array([law.bulk for law in laws])[mesh.region]
        self._relaxed = Elastic.of(mesh, [law.relaxed for law in laws])
        self.displacement = np.zeros(mesh.nodes.shape)
        self._left = np.zeros((count, 18, most))  # h of each term, as displacements of the elements' nodes
        self._steps: dict[str, LinearBody] = {}
        self._next: tuple[Callable[[Array], Array], float] | None = None

    def rest(self) -> None:
        """Come to rest for another course; what was made ready for steps of the same lengths still serves."""
        self.displacement, self._left = np.zeros_like(self.displacement), np.zeros_like(self._left)
        self._steps, self._next = dict(self._steps), None

    def ready(self, step: float, prescribed: Array | None = None) -> CondensedLinear:
        """Return the body as its skin feels it at the end of a `step` [s], its past as a load.

        What is held is then displaced by `prescribed` (nodes, 2) [mm] relative to the drive.
        """
        form = self._form(step)
        past = self._past(step)
        load = -np.einsum("eij,ej->ei", self.elastic.stiffness, past)
        moved = np.zeros(self.mesh.nodes.shape)
        if prescribed is not None:
            moved[self.mesh.driven] = prescribed[self.mesh.driven]
            local = moved[self.mesh.elements].reshape(len(load), 18)
            load -= np.einsum("eij,ej->ei", form.elastic.stiffness, local)
        nodes = np.zeros(self.mesh.nodes.shape)
        np.add.at(nodes, self.mesh.elements, load.reshape(-1, 9, 2))
        nodes[self.mesh.driven] = 0.0
        body, recover = form.under(nodes)
        self._next = lambda u: recover(u) + moved, step
        return body

    def advance(self, u: Array) -> None:
        """Take the step that was made ready, which displaced the skin by `u` (k, 2) [mm]."""
        assert self._next is not None
        recover, step = self._next
        after = recover(u)
        grown = (after - self.displacement)[self.mesh.elements].reshape(len(self._left), 18)
        ages = step / self._tau
        self._left *= np.exp(-ages)[:, None, :]
        self._left += kept(ages)[:, None, :] * grown[:, :, None]
        self.displacement = after

    def forces(self) -> Array:
        """Return the forces (nodes, 2) that hold all nodes where they are [N/mm]."""
        local = self.displacement[self.mesh.elements].reshape(len(self._left), 18)
        inner = np.einsum("eij,ej->ei", self._relaxed.stiffness, local)
        inner += np.einsum("eij,ejm,em->ei", self.elastic.stiffness, self._left, self._g)
        out = np.zeros(self.mesh.nodes.shape)
        np.add.at(out, self.mesh.elements, inner.reshape(-1, 9, 2))
        return out

    def energy(self, probes: Probes) -> Array:
        """Return the stored energy density (p,) [MPa]."""
        element = probes.element
        local = self.displacement[self.mesh.elements[element]].reshape(len(element), 18)
        shear, long_term = self.elastic.shear[element], 1.0 - self._g[element].sum(axis=1)
        deviator, theta = self._strain(probes, local)
        out = shear * long_term * deviator + self._bulk[element] / 2.0 * theta**2
        for term in range(self._left.shape[2]):
            deviator, _ = self._strain(probes, self._left[element, :, term])
            out += shear * self._g[element, term] * deviator
        return out

    def stress(self, probes: Probes) -> Array:
        """Return the in-plane stress (p, 2, 2) [MPa], tension positive."""
        element = probes.element
        local = self.displacement[self.mesh.elements[element]].reshape(len(element), 18)
        springs = local * (1.0 - self._g[element].sum(axis=1))[:, None]
        springs += np.einsum("pim,pm->pi", self._left[element], self._g[element])
        gradient = np.einsum("pna,pnb->pab", springs.reshape(-1, 9, 2), probes.gradient)
        rows = np.einsum("pm,pmi->pi", probes.modes, self.elastic.dilatation[element])
        theta, volume = np.sum(rows * springs, axis=1), np.sum(rows * local, axis=1)
        shear = self.elastic.shear[element]
        mean = self._bulk[element] * volume - 2.0 / 3.0 * shear * theta
        return shear[:, None, None] * (gradient + np.swapaxes(gradient, 1, 2)) + mean[:, None, None] * np.eye(2)

    def average(self, endings: Endings) -> Array:
        """Return the stored energy averaged over each patch (r,) [MPa]; nan where there is no patch."""
        return patch_means(self.energy(endings.probes), endings.weights, endings.patch, endings.areas)

    def _strain(self, probes: Probes, local: Array) -> tuple[Array, Array]:
        """Return e:e of the strain's deviator and the volume strain (p,) for element displacements (p, 18)."""
        gradient = np.einsum("pna,pnb->pab", local.reshape(-1, 9, 2), probes.gradient)
        strain = (gradient + np.swapaxes(gradient, 1, 2)) / 2.0
        theta = np.einsum("pm,pmi,pi->p", probes.modes, self.elastic.dilatation[probes.element], local)
        return np.sum(strain * strain, axis=(1, 2)) - theta**2 / 3.0, theta

    def _past(self, step: float) -> Array:
        """Return the element displacements (e, 18) whose shear stress at once is what the past adds."""
        local = self.displacement[self.mesh.elements].reshape(len(self._left), 18)
        ages = step / self._tau
        left = np.einsum("eim,em->ei", self._left, self._g * np.exp(-ages))
        return left - local * np.sum(self._g * kept(ages), axis=1)[:, None]

    def _form(self, step: float) -> LinearBody:
        """Return the body as a length of step sees it [s]."""
        key = f"{step:.9e}"
        if key not in self._steps:
            while len(self._steps) >= KEPT:
                del self._steps[next(iter(self._steps))]  # the one asked for longest ago
            self._steps[key] = LinearBody.of(self.mesh, [law.within(step) for law in self._laws], checked=True)
        self._steps[key] = self._steps.pop(key)
        return self._steps[key]


class RelaxingWay(Way):
    """The course of a body that relaxes, with the SED of one ending and one point at every instant."""

    def __init__(
        self,
        body: RelaxingBody,
        friction: LoadState,
        loading: Loading,
        ending: Endings,
        point: Endings,
        first: float = PRESSING_TIME / PRESSING_STEPS,
    ) -> None:
        """Start at rest; `first` is the length of the first step [s]."""
        self.body = body
        self._ending, self._point, self._ready = ending, point, first
        super().__init__(Newton(body.ready(first)), friction, loading)
        self.sed: list[tuple[float, float]] = [(0.0, 0.0)]

    def found(self, before: EquilibriumState, aim: Aim) -> EquilibriumState:
        """Return the state at `aim`, and let the body come to it. Raises NotConverged."""
        step = aim.time - self.aim.time
        if step != self._ready:
            self.newton = Newton(self.body.ready(step))
        self._ready = 0.0  # what comes next has another past
        state = super().found(before, aim)
        self.body.advance(state.u)
        self.sed.append((float(self.body.average(self._ending)[0]), float(self.body.average(self._point)[0])))
        return state


def march_relaxing(
    way: RelaxingWay, loading: Loading, slowest: float, progress: Progress | None = None, times: float = 1.0
) -> None:
    """Press, slide or drag as `stepping.march` does, and go on until the `slowest` tissue [s] has relaxed.

    Raises as `stepping.march`.
    """
    course(way, loading, progress, times)
    speed = 0.0 if loading.dragged else loading.direction * loading.speed

    def go(step: float) -> None:
        way.go(Aim(way.aim.time + step, way.aim.press, way.aim.along + speed * step))

    wait(go, way.instants[-1].time - way.instants[-2].time, slowest, way.sed, times)


def wait(
    go: Callable[[float], None], step: float, slowest: float, sed: Sequence[tuple[float, float]], times: float
) -> None:
    """Go on in steps that double, the first of `step` [s], until all has relaxed.

    That is RELAXED times of the `slowest` tissue [s], and longer where the energy at the ending, the first of `sed`'s
    last, still moves: near a limit of sliding a body settles more slowly than any of its tissues.
    """
    waited = 0.0
    for _ in range(DOUBLINGS):
        before = sed[-1][0]
        for _ in range(ceil(EQUAL_STEPS * times)):
            go(step)
            waited += step
        if waited >= RELAXED * slowest and abs(sed[-1][0] - before) <= STILL * abs(sed[-1][0]):
            return
        step *= 2.0
