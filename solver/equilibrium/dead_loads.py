"""Dead loads and prescribed displacements on a body at finite strain, brought on in steps.

A dead load keeps its size and direction while the body deforms: `body.edge_load` makes nodal forces of a traction or a
pressure per undeformed length of an edge.
"""

from dataclasses import replace

import numpy as np

from solver.arrays import Array
from solver.body.validation import check_loads
from solver.equilibrium.load_stepping import StepControl, advance
from solver.equilibrium.newton import EquilibriumState, FiniteNewton, LoadState
from solver.failures import NotConverged


def loaded(
    newton: FiniteNewton,
    loads: Array | None = None,
    prescribed: Array | None = None,
    load: LoadState | None = None,
    start: EquilibriumState | None = None,
    steps: int = 4,
) -> EquilibriumState:
    """Return the equilibrium under dead `loads` (nodes, 2) [N/mm], what is held displaced by `prescribed` [mm].

    `prescribed` (nodes, 2) is 0 where nothing holds. From undeformed, or from `start` (whose contact states are then
    the first guess), in `steps` equal parts; one that fails is halved. `load` (its default: no contact depth, no
    friction) stays the same meanwhile. The loads stay on `newton` for what follows. Raises BodyError for arrays of
    another shape, ValueError for a load on the centre of an element and for a load state that is none, NotConverged
    where no equilibrium is found.
    """
    body = newton.body
    check_loads(body.mesh, loads, prescribed)
    loads, prescribed = (None if given is None else np.asarray(given, np.float64) for given in (loads, prescribed))
    shape = EquilibriumState.undeformed(body) if start is None else start
    load = (shape.load if load is None else load).checked()
    shape = replace(shape, load=load)
    vector = np.zeros(body.size) if loads is None else _on_unknowns(newton, loads)
    driven = body.mesh.driven
    held_at = shape.u[driven]
    moved = 0.0 if prescribed is None else prescribed[driven] - held_at
    before = newton.finite.load.copy()

    def step(part: float) -> None:
        nonlocal shape
        newton.finite.load[:] = before + part * (vector - before)
        u = shape.u.copy()
        u[driven] = held_at + part * moved
        shape = newton.settle(replace(shape, u=u), load)

    def refusal(done: float, _part: float, reason: NotConverged) -> NotConverged:
        return NotConverged(f"no equilibrium was found beyond {done:.3g} of the loads: {reason}")

    advance(step, refusal, StepControl(first=1.0 / steps))
    return shape


def _on_unknowns(newton: FiniteNewton, loads: Array) -> Array:
    """Return the loads (n,) in the order of the unknowns."""
    body = newton.body
    if loads[body.nodes[:, 8]].any():
        raise ValueError("a dead load on the centre of an element cannot be taken: put it on corners and mid-sides")
    out = np.zeros(body.size)
    free = body.unknown >= 0
    out[body.unknown[free]] = loads[body.nodes[:, :8]][free]
    return out
