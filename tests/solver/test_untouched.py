"""Partial slip under dead loads, from the state before first touch."""

from dataclasses import replace

import numpy as np
import pytest

from solver._kernels import STICK
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import Hooke
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState, Newton
from solver.mesh import grid_mesh

RADIUS, YOUNG, NU, MU = 5.0, 0.08, 0.4999, 0.3  # nearly incompressible: normal and shear do not couple
LOAD = 0.0005  # [N/mm]
WIDE, HIGH = 16.0, 16.0  # [mm], against half a millimetre that touches
FOOT, PAD = 0, 1


def graded(end):
    """Lines from 0 to `end` [mm], close to one another at first."""
    lines = [0.0]
    while lines[-1] < end:
        lines.append(lines[-1] + max(0.02, 0.3 * (lines[-1] - 0.2)))
    with_middles = np.empty(2 * len(lines) - 1)
    with_middles[::2] = np.array(lines) * end / lines[-1]
    with_middles[1::2] = (with_middles[2::2] + with_middles[:-2:2]) / 2.0
    return with_middles


def round_foot(part, *, held):
    """A block with a round foot, pressed by LOAD and dragged by `part` mu LOAD along +x, and its dead loads.

    It hangs from a soft pad, whose top is held or not. Couples on its sides keep it from turning.
    """
    right, up = graded(WIDE / 2), graded(HIGH)
    x, y = np.r_[-right[:0:-1], right], np.r_[up, HIGH + 0.5, HIGH + 1.0][::-1]
    foot = RADIUS - np.sqrt(RADIUS**2 - np.minimum(abs(x), 2.0) ** 2)
    points = np.empty((len(x), len(y), 2))
    points[..., 0] = x[:, None]
    points[..., 1] = y + foot[:, None] * np.maximum(1.0 - y / HIGH, 0.0)
    number = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    region = np.r_[PAD, np.full(len(y) // 2 - 1, FOOT)]
    mesh = grid_mesh(points, region, slice(0, len(x)), number[:, 0] if held else number[:0, 0])
    drag = part * MU * LOAD
    loads = edge_load(mesh, number[:, 2], np.tile([drag / WIDE, -LOAD / WIDE], (len(x), 1)))
    for side, sign in ((0, -1.0), (-1, 1.0)):
        force = edge_load(mesh, number[side, 2:], np.tile([0.0, 1.0], (len(y) - 2, 1)))
        loads += sign * drag * HIGH / WIDE * force / force.sum()
    return mesh, loads


@pytest.mark.parametrize("part", [0.25, 0.5, 0.75])
@pytest.mark.parametrize("held", [False, True])
def test_dead_loads_below_the_friction_limit_leave_the_stick_zone_of_cattaneo_and_mindlin(held, part):
    """Stick for |x| < c, c/a = sqrt(1 - Q/(mu P)); q(0) = mu p0 (1 - c/a) (Johnson 1985, ch. 7).

    P and Q are what the surface feels: of a body that is held, the pad carries some of its loads.
    """
    mesh, loads = round_foot(part, held=held)
    free = () if held else ("x", "y", "turn")
    body = LinearBody.of(mesh, [Hooke(YOUNG, NU), Hooke(1e-5, 0.3)], loads, free=free).condensed
    state = Newton(body).solve(EquilibriumState.undeformed(body), LoadState(0.0, MU))
    load, drag = state.normal.sum(), -state.tangential.sum()
    assert load == pytest.approx(LOAD, rel=0.01 if held else 1e-9)
    assert drag == pytest.approx(part * MU * LOAD, rel=0.01 if held else 1e-9)
    half_width = np.sqrt(4.0 * load * RADIUS * (1.0 - NU**2) / (np.pi * YOUNG))
    peak, stick_ratio = 2.0 * load / (np.pi * half_width), np.sqrt(1.0 - drag / (MU * load))
    x = mesh.nodes[mesh.skin, 0]
    assert np.ptp(x[state.state == STICK]) / 2.0 == pytest.approx(half_width * stick_ratio, abs=0.01)  # half an element
    traction = -(state.tangential / body.fixed_length)[abs(x) < 0.03].mean()
    assert traction == pytest.approx(MU * peak * (1.0 - stick_ratio), rel=0.02)


def test_skin_that_dead_loads_leave_clear_of_the_surface_sticks_where_they_have_put_it():
    mesh, loads = round_foot(0.5, held=True)
    body = LinearBody.of(mesh, [Hooke(YOUNG, NU), Hooke(1e-4, 0.3)], loads).condensed
    start_depth = -2.0  # mm: the loads lower the foot by a third of one
    start = replace(EquilibriumState.undeformed(body), u=body.free_displacement(), load=LoadState(start_depth, MU))
    assert (start.skin_positions(body)[:, 1] - start_depth).min() > 0.0
    state = Newton(body).solve(start, LoadState(0.0, MU))
    assert state.normal.sum() > 0.9 * LOAD
    assert abs(state.tangential.sum()) < 0.05 * MU * LOAD  # the pad carries the drag
