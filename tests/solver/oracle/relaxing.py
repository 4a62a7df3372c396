"""Forces and stresses of a body that relaxes, from what it remembers: for its closed forms."""

import numpy as np

from solver.body.linear import Elastic


def forces(body, laws):
    """Return the forces (nodes, 2) that hold all nodes where they are [N/mm]."""
    inner = Elastic.of(body.mesh, [law.long_term_moduli for law in laws]).forces(body.displacement[body.mesh.elements])
    inner += body.elastic.forces(np.einsum("ejm,em->ej", body._internal, body._g).reshape(-1, 9, 2))
    return body.mesh.assemble(inner)


def stress(body, probes):
    """Return the in-plane stress (p, 2, 2) [MPa], tension positive."""
    element = probes.element
    local = body.displacement[body.mesh.elements[element]].reshape(len(element), 18)
    springs = local * (1.0 - body._g[element].sum(axis=1))[:, None]
    springs += np.einsum("pim,pm->pi", body._internal[element], body._g[element])
    gradient = np.einsum("pna,pbn->pab", springs.reshape(-1, 9, 2), probes.gradient)
    rows = np.einsum("pm,pmi->pi", body.elastic.modes_at(probes), body.elastic.divergence[element])
    theta, volume = np.sum(rows * springs, axis=1), np.sum(rows * local, axis=1)
    shear = body.elastic.elements.shear[element]
    mean = body._bulk[element] * volume - 2.0 / 3.0 * shear * theta
    return shear[:, None, None] * (gradient + np.swapaxes(gradient, 1, 2)) + mean[:, None, None] * np.eye(2)
