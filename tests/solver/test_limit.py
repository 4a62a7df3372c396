"""Where settled sliding ends at finite strain."""

import numpy as np
import pytest

from solver.crossing import crosses_itself, least_stretch
from solver.limit import follow, largest_depth, largest_friction
from solver.newton import BY_FRICTION, Pull
from solver.sliding import settled
from tests.solver.finite_examples import finger

TOWARDS_TIP = -1  # the bone goes along +x, so the surface pulls the skin along -x


@pytest.mark.parametrize(("depth", "largest"), [(1.0, 0.987), (1.5, 0.609), (2.0, 0.373), (2.5, 0.233)])
def test_friction_has_the_limit_that_several_meshes_and_orders_of_another_code_found(depth, largest):
    newton, _, outline = finger(8, margin=3.0)
    branch = largest_friction(newton, Pull(depth, 0.0, np.inf, TOWARDS_TIP), outline)
    assert branch.limited
    assert branch.value == pytest.approx(largest, rel=0.03)
    assert not crosses_itself(newton.body.mesh.nodes[outline] + branch.last.u[outline])


@pytest.mark.parametrize(
    ("mu", "tau", "largest"),
    [
        (0.44, 0.015478, 1.85),
        pytest.param(0.48, 0.019038, 1.75, marks=pytest.mark.slow),
        pytest.param(0.64, 0.049998, 1.45, marks=pytest.mark.slow),
        (0.67, 0.05255, 1.43),
    ],
)
def test_depth_has_the_limit_that_another_code_found(mu, tau, largest):
    newton, _, outline = finger(8, margin=3.0)
    branch = largest_depth(newton, Pull(2.0, mu, tau, TOWARDS_TIP), outline)
    assert branch.limited
    assert branch.value == pytest.approx(largest, rel=0.03)


def test_a_branch_that_reaches_what_was_asked_for_is_the_direct_answer():
    newton, _, outline = finger(5)
    pull = Pull(1.0, 0.5, 0.03, TOWARDS_TIP)
    start = settled(newton, pull._replace(mu=0.0))
    branch = follow(newton, start, BY_FRICTION, pull.mu, outline)
    assert not branch.limited
    np.testing.assert_allclose(branch.last.u, settled(newton, pull).u, atol=1e-6)


def test_the_squeeze_of_a_line_is_its_shortest_pieces():
    line = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    assert least_stretch(line, np.array([[0.0, 0.0], [0.5, 0.0], [2.0, 0.0]])) == 0.5
