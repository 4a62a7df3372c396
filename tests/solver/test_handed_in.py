from dataclasses import replace

import numpy as np
import pytest

from solver.body import Body
from solver.finite_body import FiniteBody
from solver.friction import FrictionLaw
from solver.grid import MeshError
from solver.handed_in import BodyError
from solver.hyperelastic import NeoHooke
from solver.materials import Hooke
from solver.shapes import block

MESH = block(np.linspace(-1.0, 1.0, 3), np.linspace(0.0, 1.0, 3))
ONE = block(np.array([-1.0, 1.0]), np.array([0.0, 1.0]))
NOT_HELD = replace(MESH, held=np.empty(0, np.int64))
NAN = np.full(MESH.nodes.shape, np.nan)
TISSUE = [Hooke(0.08, 0.48)]


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Body.of(NOT_HELD, TISSUE), "nothing holds the body"),
        (lambda: Body.of(MESH, TISSUE, NAN), "row 0 of loads is not finite"),
        (lambda: Body.of(MESH, TISSUE, NAN[:3]), "loads has the shape"),
        (lambda: Body.of(MESH, TISSUE, None, np.zeros((1, 2))), "prescribed has the shape"),
        (lambda: Body.of(MESH, [Hooke(0.08, 0.5)]), "nu = 0.5"),
        (lambda: FiniteBody.of(MESH, [NeoHooke(0.08, 0.5)]), "nu = 0.5"),
        (lambda: Body.of(MESH, [Hooke(-0.08, 0.3)]), "E must be above 0"),
        (lambda: Body.of(replace(MESH, region=MESH.region + 1), TISSUE), "region 1 of the mesh has no material"),
        (lambda: Body.of(replace(MESH, nodes=NAN), TISSUE), "node 0 of the mesh has no finite position"),
        (lambda: Body.of(replace(MESH, skin=MESH.skin + 10**6), TISSUE), "mesh.skin names a node that is not there"),
        (lambda: Body.of(replace(MESH, skin=MESH.skin[:-1]), TISSUE), "mesh.skin has 4 nodes"),
        (lambda: Body.of(replace(MESH, skin=MESH.skin[::-1]), TISSUE), "are no free side of an element"),
        (lambda: Body.of(replace(MESH, skin=MESH.skin[1:4]), TISSUE), "are no free side of an element"),
        (lambda: Body.of(replace(MESH, skin=MESH.elements[0][[3, 6, 2]]), TISSUE), "are no free side of an element"),
        (lambda: Body.of(replace(MESH, skin=MESH.elements[0][[2, 6, 3]]), TISSUE), "are no free side of an element"),
        (lambda: FiniteBody.of(replace(MESH, skin=MESH.skin[:4]), [NeoHooke(0.08, 0.48)]), "mesh.skin has 4 nodes"),
        (lambda: Body.of(replace(ONE, skin=ONE.elements[0][[0, 4, 1, 5, 2, 6, 3, 7, 0]]), TISSUE), "a node twice"),
        (lambda: FrictionLaw(-0.3, np.inf), "mu = -0.3"),
        (lambda: FrictionLaw(np.nan, np.inf), "mu = nan"),
        (lambda: FrictionLaw(0.3, np.nan), "tau_max = nan"),
    ],
)
def test_a_body_that_cannot_be_solved_is_refused_at_the_door_in_one_sentence(make, told):
    with pytest.raises((BodyError, ValueError), match=told):
        make()


def test_an_element_turned_inside_out_is_refused_at_the_door():
    nodes = MESH.nodes * np.array([-1.0, 1.0])
    for make in (lambda mesh: Body.of(mesh, TISSUE), lambda mesh: FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)])):
        with pytest.raises(MeshError, match="folded"):
            make(replace(MESH, nodes=nodes))
