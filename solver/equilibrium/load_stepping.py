"""Load states one after another: the only cut-back of the solver, courses of bodies, dead loads brought on in steps.

A dead load keeps its size and direction while the body deforms: `body.linear.edge_load` makes nodal forces of a
traction or a pressure per undeformed length of an edge.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from solver.arrays import Array
from solver.body.finite import FiniteBody
from solver.body.validation import check_loads
from solver.equilibrium.newton import EquilibriumState, LoadState, Newton
from solver.failures import Cancelled, NotConverged, followed_to
from solver.progress import report_progress


@dataclass(frozen=True, slots=True)
class StepControl:
    """How a load path is cut into steps; all are fractions of the path."""

    first: float = 1.0
    smallest: float = 2.0**-8  # a shorter step is refused
    growth: float = 1.0  # of the next step, after one that succeeded


Step = Callable[[float], None]
Refusal = Callable[[float, float, NotConverged], NotConverged]
WHOLE = StepControl()


def never() -> bool:
    """Return False: nothing asks the work to stop."""
    return False


def advance(
    step: Step,
    refusal: Refusal,
    control: StepControl = WHOLE,
    stop: Callable[[], bool] = never,
    exhausted: Callable[[], bool] = never,
) -> None:
    """Call `step` with growing fractions of the path up to 1, each the last that succeeded plus a step.

    `step` raises NotConverged where it fails, and leaves the state as it was. Where the next is too
    short, or the work is `exhausted`, this raises what `refusal` makes of the fraction reached, that step and the
    reason. Raises Cancelled where `stop` says so.
    """
    done, part = 0.0, control.first
    while done < 1.0:
        if stop():
            raise Cancelled
        aim = min(done + part, 1.0)
        try:
            step(aim)
        except NotConverged as reason:
            part /= 2.0
            if part < control.smallest or exhausted():
                raise refusal(done, part, reason) from reason
        else:
            done, part = aim, control.growth * part


def press_and_slide(
    depth: float, mu: float, tau: float, direction: int, press: int, slides: int, distance: float
) -> list[LoadState]:
    """Return the course of a bone driven `depth` [mm] down in `press` steps, then `distance` [mm] along in `slides`.

    `direction` is that of the bone, +1 along +x: the surface goes the other way.

    >>> [(p.depth, p.travel) for p in press_and_slide(1.0, 0.3, 0.02, +1, press=2, slides=2, distance=4.0)]
    [(0.5, 0.0), (1.0, 0.0), (1.0, -2.0), (1.0, -4.0)]
    """
    down = [LoadState(depth * (i + 1) / press, mu, tau) for i in range(press)]
    along = [LoadState(depth, mu, tau, travel=-direction * distance * (i + 1) / slides) for i in range(slides)]
    return down + along


def march(
    newton: Newton,
    course: Iterable[LoadState],
    start: EquilibriumState | None = None,
    tolerance: float = 1e-7,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[EquilibriumState]:
    """Yield the equilibrium at each load state of `course`, from undeformed or `start`; a failing step is cut in two.

    Backward Euler: within a step a point sticks where it was or slips from there. Raises NotConverged, saying where,
    Cancelled where `stop` says so, and ValueError for a load state that is none.
    """
    shape = EquilibriumState.undeformed(newton.condensed) if start is None else start
    for number, load in enumerate(loads := [load.checked() for load in course]):
        if len(loads) > 1:
            report_progress("pressing and sliding step by step", number / len(loads))
        begin = shape.load

        def step(part: float, begin: LoadState = begin, load: LoadState = load) -> None:
            nonlocal shape
            shape = newton.settle(shape, between(begin, load, part), tolerance)

        advance(step, lambda _done, _part, why: followed_to(shape.load.depth, shape.load.travel, why), stop=stop)
        yield shape


def between(begin: LoadState, end: LoadState, part: float) -> LoadState:
    """Return the load state `part` of the way along a step, whose friction is that of its end."""
    if part == 1.0:
        return end
    depth = begin.depth + part * (end.depth - begin.depth)
    return end._replace(depth=depth, travel=begin.travel + part * (end.travel - begin.travel))


def loaded(
    body: FiniteBody,
    loads: Array | None = None,
    prescribed: Array | None = None,
    load: LoadState | None = None,
    start: EquilibriumState | None = None,
    steps: int = 4,
) -> EquilibriumState:
    """Return the equilibrium under dead `loads` (nodes, 2) [N/mm], what is held displaced by `prescribed` [mm].

    `prescribed` (nodes, 2) is 0 where nothing holds. From undeformed, or from `start` (whose contact states are then
    the first guess), in `steps` equal parts; one that fails is halved. `load` (its default: no contact depth, no
    friction) stays the same meanwhile. The loads stay on the body for what follows. Raises BodyError for
    arrays of another shape, ValueError for a load on the centre of an element and for a load state that is none,
    NotConverged where no equilibrium is found.
    """
    newton, condensed = Newton(body.condensed), body.condensed
    check_loads(body.mesh, loads, prescribed)
    loads, prescribed = (None if given is None else np.asarray(given, np.float64) for given in (loads, prescribed))
    shape = EquilibriumState.undeformed(condensed) if start is None else start
    load = (shape.load if load is None else load).checked()
    shape = replace(shape, load=load)
    vector = np.zeros(body.size) if loads is None else _on_unknowns(body, loads)
    driven = body.mesh.driven
    held_at = shape.u[driven]
    moved = 0.0 if prescribed is None else prescribed[driven] - held_at
    before = condensed.load.copy()

    def step(part: float) -> None:
        nonlocal shape
        condensed.load[:] = before + part * (vector - before)
        u = shape.u.copy()
        u[driven] = held_at + part * moved
        shape = newton.settle(replace(shape, u=u), load)

    def refusal(done: float, _part: float, reason: NotConverged) -> NotConverged:
        return NotConverged(f"no equilibrium was found beyond {done:.3g} of the loads: {reason}")

    advance(step, refusal, StepControl(first=1.0 / steps))
    return shape


def _on_unknowns(body: FiniteBody, loads: Array) -> Array:
    """Return the loads (n,) in the order of the unknowns."""
    if loads[body.nodes[:, 8]].any():
        raise ValueError("a dead load on the centre of an element cannot be taken: put it on corners and mid-sides")
    out = np.zeros(body.size)
    free = body.unknown >= 0
    out[body.unknown[free]] = loads[body.nodes[:, :8]][free]
    return out
