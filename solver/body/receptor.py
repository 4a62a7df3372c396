"""The endings as patches of tissue: where their responses are probed, and with which weights they are averaged."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from solver._kernels import elements as element_loops
from solver.arrays import Array, Indices, Narrow, ProbeArrays
from solver.body.finite import FiniteBody
from solver.body.stiffness import Centred, Elastic, Probes
from solver.constitutive import log1p
from solver.mesh import GAUSS_3, Mesh, distinct
from solver.mesh.mesher import FingerMesh
from solver.quantities import QUANTITIES, LocalState
from solver.scene.tables import Receptor

_POINTS, _WEIGHTS = GAUSS_3
_ASIDE = 1e-7  # [mm]: a point on a line between elements is probed on both sides


@dataclass(frozen=True, slots=True, eq=False)
class Endings:
    """Probes of several patches: r of them, p probes in all."""

    probes: Probes
    weights: Array  # (p,) areas [mm2]
    patch: Indices  # (p,) number of the patch each probe belongs to
    count: int
    tangent: Array  # (p, 2) direction of the undeformed skin above each probe, towards the tip

    @property
    def areas(self) -> Array:
        """Area of each patch (r,) [mm2]; nan where there is no patch."""
        area = np.bincount(self.patch, self.weights, self.count)
        return np.where(area > 0.0, area, np.nan)


class Patches(Protocol):
    """Endings of one body, r of them."""

    def nodes(self) -> Indices:
        """Return the numbers of the nodes whose displacements count."""
        ...

    def average(self, displacement: Array) -> Array:
        """Return the SED averaged over each (r, ...) [MPa] for displacements (nodes, 2, ...); nan where no patch."""
        ...

    def responses(self, displacement: Array) -> Array:
        """Return every quantity averaged over each (q, r, ...) for displacements (nodes, 2, ...), even complex ones."""
        ...


@dataclass(frozen=True, eq=False)  # without slots: the energy forms are made when they are first needed
class LinearPatches:
    """Endings of an elastic body at small strain."""

    mesh: Mesh
    elastic: Elastic
    endings: Endings

    def nodes(self) -> Indices:
        """Do as `Patches` says."""
        return distinct(self.mesh.elements[distinct(self.endings.probes.element)])

    def average(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        element, patch, form = self._energy_forms
        local = displacement[self.mesh.elements[element]]
        local = (local - local[:, 8:]).reshape(len(local), 18, -1)  # moved as a whole, strains would drown in round-off
        energy = np.einsum("mic,mic->mc", local, form @ local)
        total, first = np.zeros((self.endings.count, energy.shape[1])), np.flatnonzero(np.diff(patch, prepend=-1))
        total[patch[first]] = np.add.reduceat(energy, first)
        return (total / self.endings.areas[:, None]).reshape(-1, *displacement.shape[2:])

    @cached_property
    def _energy_forms(self) -> tuple[Indices, Indices, Array]:
        """The parts of patches within one element (m,): element, patch, and the energy as a quadratic form (m, 18, 18).

        Each form is of the displacements of the element's nodes [N/mm per mm2].
        """
        probes, patch = self.endings.probes, self.endings.patch
        order = np.lexsort((probes.element, patch))
        element, patch = probes.element[order], patch[order]
        starts = (np.diff(element, prepend=-1) != 0) | (np.diff(patch, prepend=-1) != 0)
        part, first = np.cumsum(starts) - 1, np.flatnonzero(starts)
        place = np.arange(len(part)) - first[part]
        roots = np.zeros((len(first), int(place.max(initial=0)) + 1, 21))  # d/dx and d/dy of shape functions, modes
        sizes = np.sqrt(self.endings.weights[order])[:, None]
        roots[part, place, :18] = np.swapaxes(probes.gradient[order], 1, 2).reshape(-1, 18) * sizes
        roots[part, place, 18:] = probes.modes[order] * sizes
        sums = np.swapaxes(roots, 1, 2) @ roots
        xx, yx, yy, element = sums[:, :9, :9], sums[:, 9:18, :9], sums[:, 9:18, 9:18], element[first]
        form = np.empty((len(first), 9, 2, 9, 2))  # of eps:eps
        form[:, :, 0, :, 0], form[:, :, 0, :, 1] = xx + yy / 2.0, yx / 2.0
        form[:, :, 1, :, 0], form[:, :, 1, :, 1] = np.swapaxes(yx, 1, 2) / 2.0, yy + xx / 2.0
        theta = self.elastic.dilatation[element]
        volume = np.swapaxes(theta, 1, 2) @ sums[:, 18:, 18:] @ theta
        shear, lame = (modulus[element, None, None] for modulus in (self.elastic.shear, self.elastic.lame))
        # W = G eps:eps + lambda/2 theta^2
        return element, patch[first], shear * form.reshape(-1, 18, 18) + lame / 2.0 * volume

    def responses(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        state = self.endings.probes.state(self.mesh, self.elastic, displacement, self.endings.tangent)
        return np.stack([self._means(quantity.small(state)) for quantity in QUANTITIES])

    def _means(self, values: Array) -> Array:
        return patch_means(values, self.endings.weights, self.endings.patch, self.endings.areas)


@dataclass(frozen=True, slots=True, eq=False)
class FinitePatches:
    """Endings of a body at finite strain: p places inside elements, averaged with weights over r patches."""

    body: FiniteBody
    element: Narrow  # (p,)
    grad_x: Array  # (p, 9)
    grad_y: Array  # (p, 9)
    modes: Array  # (p, 3)
    weights: Array  # (p,) areas [mm2]
    patch: Indices  # (p,)
    areas: Array  # (r,) [mm2]; nan where there is no patch
    tangent: Array  # (p, 2) direction of the undeformed skin above each probe, towards the tip

    @staticmethod
    def of(body: FiniteBody, endings: Endings) -> "FinitePatches":
        """Carry the probes of `endings` over to `body`, element by element."""
        probes = endings.probes
        order = np.argsort(probes.element, kind="stable")
        element = probes.element[order]
        modes = (body.combination[element] @ probes.modes[order][:, :, None])[:, :, 0]
        gradient = probes.gradient[order]
        return FinitePatches(
            body,
            element.astype(np.int32),
            np.ascontiguousarray(gradient[..., 0]),
            np.ascontiguousarray(gradient[..., 1]),
            modes,
            endings.weights[order],
            endings.patch[order],
            endings.areas,
            endings.tangent[order],
        )

    def nodes(self) -> Indices:
        """Do as `Patches` says."""
        return distinct(self.body.mesh.elements[distinct(self.element)])

    def energy(self, displacement: Array) -> Array:
        """Return the SED (p, ...) [MPa] for displacements (nodes, 2, ...), ln J being each element's best fit of it."""
        if displacement.ndim > 2:
            every = [self.energy(np.ascontiguousarray(one)) for one in np.moveaxis(displacement, -1, 0)]
            return np.stack(every, axis=-1)
        out = np.empty(len(self.element))
        probes = ProbeArrays(self.element, self.grad_x, self.grad_y, self.modes)
        element_loops.energies(displacement, self.body.elements, probes, out)
        return out

    def deformation(self, displacement: Array) -> Array:
        """Return F (p, 2, 2) for displacements (nodes, 2)."""
        local = displacement[self.body.nodes[self.element]]
        gradient = np.stack([self.grad_x, self.grad_y], axis=-1)
        return np.eye(2) + np.einsum("pia,piA->paA", local, gradient)

    def average(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        return patch_means(self.energy(displacement), self.weights, self.patch, self.areas)

    def responses(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        state = self.state(displacement)
        values = (quantity.finite(state) for quantity in QUANTITIES)
        return np.stack([patch_means(each, self.weights, self.patch, self.areas) for each in values])

    def state(self, displacement: Array) -> LocalState:
        """Return what is known of the places for displacements (nodes, 2, ...): arrays (p, ...)."""
        body = self.body
        wide = (slice(None), *([None] * (displacement.ndim - 2)))
        held, place = np.unique(self.element, return_inverse=True)
        local = displacement[body.nodes[held]]  # (e, 9, 2, ...)
        log = _log_volume(body.grad_x[held], body.grad_y[held], local)
        fit = np.einsum("eq,eqm,eq...->em...", body.weight[held], body.modes[held], log)[place]
        gradient = [np.einsum("pi,pi...->p...", grad, local[place]) for grad in (self.grad_x, self.grad_y)]
        return LocalState(
            xx=gradient[0][:, 0],
            xy=gradient[1][:, 0],
            yx=gradient[0][:, 1],
            yy=gradient[1][:, 1],
            dilatation=np.einsum("pm,pm...->p...", self.modes, fit),
            shear=body.shear[self.element][wide],
            lame=body.lame[self.element][wide],
            stiffening=body.stiffening[self.element][wide],
            tangent=(self.tangent[:, 0][wide], self.tangent[:, 1][wide]),
        )


def _log_volume(grad_x: Array, grad_y: Array, local: Array) -> Array:
    """Return ln J (e, q, ...) at the quadrature points of elements for displacements of their nodes (e, 9, 2, ...)."""
    along_x, along_y = (np.einsum("eqi,eia...->aeq...", grad, local) for grad in (grad_x, grad_y))
    return log1p(along_x[0] + along_y[1] + along_x[0] * along_y[1] - along_x[1] * along_y[0])


def patch_means(values: Array, weights: Array, patch: Indices, areas: Array) -> Array:
    """Return values (p, ...) averaged over patches (r, ...) by weights (p,); `patch` (p,) says whose each is.

    `areas` (r,) are the sums of weights, nan where there is no patch.
    """
    wide = (slice(None), *([None] * (values.ndim - 1)))
    total = np.zeros((len(areas), *values.shape[1:]), values.dtype)
    np.add.at(total, patch, values * weights[wide])
    return total / areas[wide]


def endings(finger: FingerMesh, elements: Centred, receptor: Receptor, arcs: Array) -> Endings:
    """Return the patches of `receptor` at positions `arcs` (r,) [mm], integrated exactly over the pieces of elements.

    A patch reaches half the ending's length to both sides, measured along its own middle line.
    """
    across, along = receptor.ending
    outline = finger.outline
    depth_lines = distinct(np.concatenate([finger.depths, [receptor.depth - across / 2, receptor.depth + across / 2]]))
    inside = np.abs(depth_lines - receptor.depth) <= across / 2 * (1 + 1e-12)
    depth_lines = depth_lines[inside]
    low, high = (outline.along(arcs, receptor.depth, side * along / 2) for side in (-1.0, 1.0))
    reaches = (outline.palmar_cut + 1e-9 < low) & (high < outline.dorsal_cut - 1e-9)
    start, stop = np.maximum(low[:, None], finger.arcs[:-1]), np.minimum(high[:, None], finger.arcs[1:])
    patch, piece = np.nonzero((start < stop) & reaches[:, None])
    arc, arc_weight = _gauss(start[patch, piece], stop[patch, piece])
    depth, depth_weight = _gauss(depth_lines[:-1], depth_lines[1:])
    area = (arc_weight[:, None] * depth_weight).ravel()
    patch = np.repeat(patch, len(_POINTS) * len(depth))
    arc, depth = np.repeat(arc, len(depth)), np.tile(depth, len(arc))
    # a length on the tip's arc shrinks with the depth
    curved = (arc > outline.palmar) & (arc < outline.dorsal)
    area = area * np.where(curved, 1.0 - depth / outline.finger.tip_radius, 1.0)
    return Endings(_probes(finger, elements, arc, depth), area, patch, len(arcs), outline.tangent(arc))


def middle(finger: FingerMesh, elements: Centred, receptor: Receptor) -> Endings:
    """Return the point in the middle of the reference ending: the mean of its limits from the elements around it."""
    arc = _ASIDE * np.array([-1.0, 1.0, -1.0, 1.0])
    depth = receptor.depth + _ASIDE * np.array([-1.0, -1.0, 1.0, 1.0])
    probes, tangent = _probes(finger, elements, arc, depth), finger.outline.tangent(arc)
    return Endings(probes, np.full(4, 0.25), np.zeros(4, np.int64), 1, tangent)


def _gauss(start: Array, stop: Array) -> tuple[Array, Array]:
    """Return the Gauss points and weights (3 n,) of the intervals between `start` and `stop` (n,)."""
    half = (stop - start)[:, None] / 2.0
    return (start[:, None] + half * (1.0 + _POINTS)).ravel(), (half * _WEIGHTS).ravel()


def _probes(finger: FingerMesh, elements: Centred, arc: Array, depth: Array) -> Probes:
    """Find the elements that hold the places at `arc` and `depth` (p,) and the local coordinates in them."""
    station = np.clip(np.searchsorted(finger.arcs, arc) - 1, 0, len(finger.arcs) - 2)
    layer = np.clip(np.searchsorted(-finger.depths, -depth) - 1, 0, len(finger.depths) - 2)
    element = station * (finger.fat + len(finger.depths) - 1) + finger.fat + layer
    side, depth = _along_side(finger, arc, depth, station)
    out = (finger.depths[layer] - depth) / (finger.depths[layer] - finger.depths[layer + 1]) * 2.0 - 1.0
    return Probes.at(finger.mesh, elements, element, np.stack([out, side], axis=1))


def _along_side(finger: FingerMesh, arc: Array, depth: Array, station: Indices) -> tuple[Array, Array]:
    """Return the local coordinates (p,) along the skin of places, and the depths (p,) that elements know them by.

    The sides of an element run along normals of the skin, and its nodes lie at `depth` on them. Between these normals
    it follows the skin's arc by a parabola, which lies a little deeper than the arc: E(s) = (1 - s^2 (1 - cos a)) e_m +
    s sin a e_t at unit radius, with half its angle a, and e_m, e_t radial and tangential in its middle.
    """
    start, stop = finger.arcs[station], finger.arcs[station + 1]
    here, first, last = (finger.outline.angle(place) for place in (arc, start, stop))
    half, angle = (last - first) / 2.0, here - (first + last) / 2.0
    sine, rise = np.sin(half), 1.0 - np.cos(half)
    slope = np.tan(angle)
    straight = half == 0.0
    along = (2.0 * arc - start - stop) / (stop - start)
    side = np.where(
        straight, along, 2.0 * slope / np.where(straight, 1.0, sine + np.sqrt(sine**2 + 4.0 * slope**2 * rise))
    )
    radius = finger.outline.finger.tip_radius
    reach = np.cos(angle) * (1.0 - side**2 * rise) + np.sin(angle) * side * sine
    return side, np.where(straight, depth, radius - (radius - depth) / reach)
