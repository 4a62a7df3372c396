"""Bodies whose tissues relax (`constitutive.Prony`), step by step in time.

At small strain each term of a series has an internal variable, the strain that has not yet relaxed: h(t) = integral of
exp(-(t - s)/tau) de/ds ds. It is linear in the displacements, and is stored as displacements of each element's nodes.
The recursion is exact for a strain that grows linearly within a step (Taylor, Pister and Goudreau 1970; Simo and
Hughes 1998, sec. 10.3):

    h(t + dt) = exp(-dt/tau) h(t) + kept(dt/tau) (e(t + dt) - e(t)),    kept(x) = (1 - exp(-x))/x.

A step is then elastic, with the moduli `Prony.within(dt)` and the stress of the internal variables as a load. The SED
is the energy stored in all springs of the solid, G (1 - sum g) e:e + sum g G h:h + K/2 theta^2, with the strain
deviator e.

At finite strain the stress is that of a relaxed law plus an overstress (`constitutive.Past`), which decays to zero. A
finger carries its skin along the surface. In settled sliding the tissue is therefore at rest and fully relaxed at any
speed.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Protocol

import numpy as np

from solver._kernels import elements as element_loops
from solver.arrays import Array, Indices
from solver.body import CondensedLinear, Endings, Probes
from solver.body.finite import CondensedFinite, FiniteBody, FinitePatches
from solver.body.linear import Elastic, LinearBody
from solver.body.validation import check_body, check_driven, check_held, check_moduli, check_terms
from solver.constitutive import Moduli, Past, Prony, mean_decay, overstress
from solver.equilibrium import EquilibriumState, Newton
from solver.mesh import Mesh

STEP_LENGTHS = 4  # step lengths for which factors are kept


class Tissue(Protocol):
    """Relaxing tissues of a finger, and the endings at which their energy is computed."""

    def ready(self, step: float) -> Newton:
        """Prepare a time step [s] and return Newton's method on the body of that step."""

    def commit(self, state: EquilibriumState, step: float) -> Array:
        """Take the prepared step to `state`; return the energy stored at each ending (r,) [MPa]."""


class RelaxingBody:
    """A held body at small strain with e elements, and internal variables for up to m terms of a series."""

    def __init__(self, mesh: Mesh, laws: Sequence[Prony], *, checked: bool = False) -> None:
        """Start at rest, without dead loads; `laws` by region. Raises BodyError and MeshError unless `checked`."""
        if not checked:
            check_body(mesh, laws)
            check_terms(laws)
            check_driven(mesh)
            check_held(mesh)
        self.mesh = mesh
        self._g, self._tau = _terms(laws, mesh.region)
        shear = [Moduli(law.shear, -2.0 / 3.0 * law.shear) for law in laws]
        self.elastic = Elastic.of(mesh, shear)  # of the instantaneous shear moduli alone
        self._bulk = np.array([law.bulk for law in laws])[mesh.region]
        self.displacement = np.zeros(mesh.nodes.shape)
        # h of each term, as displacements of the elements' nodes
        self._internal = np.zeros((len(mesh.elements), 18, self._g.shape[1]))
        self._next: tuple[Callable[[Array], Array], float] | None = None

        @lru_cache(maxsize=STEP_LENGTHS)
        def elastic_body(step: float) -> LinearBody:
            return LinearBody.of(mesh, [law.within(step) for law in laws], checked=True)

        self._elastic_body = elastic_body

    def reset(self) -> None:
        """Return to rest for another load path; a copy of the body shares the factors of its step lengths."""
        self.displacement, self._internal = np.zeros_like(self.displacement), np.zeros_like(self._internal)
        self._next = None

    def ready(self, step: float, prescribed: Array | None = None) -> CondensedLinear:
        """Return the condensed body at the end of a `step` [s], with the stress of its past as a load.

        At that instant held nodes are displaced by `prescribed` (nodes, 2) [mm] relative to the drive.
        """
        form = self._elastic_body(float(f"{step:.9e}"))  # steps that differ by round-off share factors
        past = self._past(step)
        load = -self.elastic.forces(past.reshape(-1, 9, 2))
        motion = np.zeros(self.mesh.nodes.shape)
        if prescribed is not None:
            motion[self.mesh.driven] = prescribed[self.mesh.driven]
            load -= form.elastic.forces(self.mesh.local(motion))
        nodes = self.mesh.assemble(load)
        nodes[self.mesh.driven] = 0.0
        body, recover = form.with_loads(nodes)
        self._next = lambda u: recover(u) + motion, step
        return body

    def advance(self, u: Array) -> None:
        """Take the prepared step to displacements `u` (k, 2) of the skin [mm]."""
        assert self._next is not None
        recover, step = self._next
        after = recover(u)
        growth = self.mesh.local(after - self.displacement).reshape(len(self._internal), 18)
        ages = step / self._tau
        self._internal *= np.exp(-ages)[:, None, :]
        self._internal += mean_decay(ages)[:, None, :] * growth[:, :, None]
        self.displacement = after

    def energy(self, probes: Probes) -> Array:
        """Return the stored energy density (p,) [MPa]."""
        element = probes.element
        local = self.mesh.local(self.displacement, element).reshape(-1, 18)
        shear, long_term = self.elastic.elements.shear[element], 1.0 - self._g[element].sum(axis=1)
        rows = self.elastic.modes_at(probes)[:, None] @ self.elastic.divergence[element]
        deviator, theta = self._strain(probes, rows, local)
        out = shear * long_term * deviator + self._bulk[element] / 2.0 * theta**2
        for term in range(self._internal.shape[2]):
            deviator, _ = self._strain(probes, rows, self._internal[element, :, term])
            out += shear * self._g[element, term] * deviator
        return out

    def _strain(self, probes: Probes, rows: Array, local: Array) -> tuple[Array, Array]:
        """Return e:e of the strain deviator and the volume strain (p,) for element displacements `local` (p, 18).

        `rows` (p, 1, 18) map displacements to the volume strain.
        """
        gradient = probes.gradient @ local.reshape(-1, 9, 2)
        strain = (gradient + np.swapaxes(gradient, 1, 2)) / 2.0
        theta = (rows @ local[:, :, None])[:, 0, 0]
        return np.sum(strain * strain, axis=(1, 2)) - theta**2 / 3.0, theta

    def _past(self, step: float) -> Array:
        """Return the element displacements (e, 18) whose instantaneous shear stress equals that of the past."""
        local = self.mesh.local(self.displacement).reshape(-1, 18)
        ages = step / self._tau
        internal = np.einsum("eim,em->ei", self._internal, self._g * np.exp(-ages))
        return internal - local * np.sum(self._g * mean_decay(ages), axis=1)[:, None]


class CondensedRelaxing(CondensedFinite):
    """A relaxing body at finite strain; the laws of its elements are the relaxed ones."""

    equilibrium: Array | None

    def __init__(self, body: FiniteBody, laws: Sequence[Prony]) -> None:
        """Start at rest; terms and instantaneous moduli come from `laws` by region. Raises BodyError."""
        super().__init__(body, relaxes=True)
        check_moduli(body.mesh, laws)
        check_terms(laws)
        self.past = _at_rest(laws, np.repeat(body.mesh.region, body.elements.weight.shape[1]))
        self.tensor = np.zeros((*body.elements.weight.shape, 4))

    def ready(self, step: float) -> None:
        """Prepare a time step [s]."""
        self.tensor = self.past.over(step).reshape(self.tensor.shape)
        self.equilibrium = None

    def commit(self, u: Array, step: float) -> None:
        """Take the prepared step to displacements `u` (nodes, 2)."""
        self.past = self.past.after(self.body.deformation(u).reshape(-1, 2, 2), step)

    def assemble(self, u: Array, pressure: Array | None) -> float:
        """Fill tangents and forces with the overstress, as `CondensedFinite` does; return the smallest det F."""
        more = self.system.overstress_force, self.system.overstress_tangent
        element_loops.overstress(u, self.tensor, self.body.elements, *more, np.empty((4, 9)))
        return super().assemble(u, pressure)

    def excess(self, u: Array) -> Array:
        """Return the nodal forces (e, 18) of the overstress at displacements `u` (nodes, 2)."""
        body = self.body
        stress = overstress(self.tensor, body.deformation(u))
        gradient = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1)
        return np.einsum("eq,eqaA,eqiA->eia", body.elements.weight, stress, gradient).reshape(
            len(body.elements.nodes), 18
        )

    def stored_energy(self, u: Array, reaction: Array) -> float:
        """Return the energy stored at `u`, including the overstress's at the last committed instant [N mm per mm]."""
        return super().stored_energy(u, reaction) + float(self.past.energy() @ self.body.elements.weight.ravel())


def _terms(laws: Sequence[Prony], region: Indices) -> tuple[Array, Array]:
    """Return g and tau (p, m) of the terms at points in regions (p,)."""
    most = max(len(law.terms) for law in laws)
    g, tau = np.zeros((len(region), most)), np.ones((len(region), most))
    for number, law in enumerate(laws):
        for place, term in enumerate(law.terms):
            g[region == number, place], tau[region == number, place] = term
    return g, tau


def _at_rest(laws: Sequence[Prony], region: Indices) -> Past:
    """Return the past of undeformed points in regions (p,)."""
    g, tau = _terms(laws, region)
    return Past.at_rest(g * np.array([law.shear for law in laws])[region, None], tau)


class LinearTissue:
    """Relaxing tissues at small strain."""

    def __init__(self, body: RelaxingBody, endings: Endings) -> None:
        self._body, self._endings = body, endings

    def ready(self, step: float) -> Newton:
        """Prepare a time step [s] and return Newton's method on its elastic body."""
        return Newton(self._body.ready(step))

    def commit(self, state: EquilibriumState, step: float) -> Array:  # noqa: ARG002 - `ready` has stored it
        """Take the prepared step to `state`; return the energy stored at each ending (r,) [MPa]."""
        self._body.advance(state.u)
        return self._endings.means(self._body.energy(self._endings.probes))


class FiniteTissue:
    """Relaxing tissues at finite strain, and the past at the endings."""

    def __init__(self, body: FiniteBody, laws: Sequence[Prony], patches: FinitePatches) -> None:
        self._relaxing, self._patches = CondensedRelaxing(body, laws), patches
        self._newton = Newton(self._relaxing)
        self._past = _at_rest(laws, body.mesh.region[patches.endings.probes.element])

    def ready(self, step: float) -> Newton:
        """Prepare a time step [s] and return Newton's method on the relaxing body."""
        self._relaxing.ready(step)
        return self._newton

    def commit(self, state: EquilibriumState, step: float) -> Array:
        """Take the prepared step to `state`; return the energy stored at each ending (r,) [MPa]."""
        self._relaxing.commit(state.u, step)
        self._past = self._past.after(self._patches.deformation(state.u), step)
        return self._patches.endings.means(self._patches.energy(state.u) + self._past.energy())
