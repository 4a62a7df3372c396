from dataclasses import fields, replace

import numpy as np
import pytest

from solver import Material
from solver.body.finite import FiniteBody
from solver.body.linear import LinearBody, edge_load
from solver.body.validation import BodyError
from solver.constitutive import Hooke, NeoHooke, Ogden, Prony
from solver.contact import ForceLoad, FrictionLaw, LoadState
from solver.continuation.finite_states import solve_dead_load
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.load_stepping import march, solve_full_slip
from solver.equilibrium.relaxation import CondensedRelaxing, RelaxingBody
from solver.mesh import Mesh, MeshError, block

MESH = block(np.linspace(-1.0, 1.0, 3), np.linspace(0.0, 1.0, 3))
QUAD = block(np.array([-1.0, 1.0]), np.array([0.0, 1.0]))
NOT_HELD = replace(MESH, held=np.empty(0, np.int64))
NAN = np.full(MESH.nodes.shape, np.nan)
STRAY = replace(MESH, nodes=np.append(MESH.nodes, [[9.0, 9.0]], axis=0))
NONE = np.empty(0, np.int64)
TISSUE, SKIN = [Hooke(0.08, 0.48)], [NeoHooke(0.08, 0.48)]


linear = LinearBody.of


def relaxing_law(g, tau):
    return Prony(0.08, 0.48, ((g, tau),))


def as_other_program_gives(mesh, integers, floats):
    """The mesh as another program may give it: numbers of other widths, every second one of a longer array."""
    parts = {f.name: getattr(mesh, f.name) for f in fields(mesh)}
    nodes = np.repeat(parts.pop("nodes").astype(floats), 2, axis=0)[::2]
    return Mesh(nodes, **{name: np.repeat(part.astype(integers), 2, axis=0)[::2] for name, part in parts.items()})


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: linear(NOT_HELD, TISSUE), "nothing holds the body"),
        (lambda: linear(MESH, TISSUE, NAN), "row 0 of loads is not finite"),
        (lambda: linear(MESH, TISSUE, NAN[:3]), "loads has the shape"),
        (lambda: linear(MESH, TISSUE, None, np.zeros((1, 2))), "prescribed has the shape"),
        (lambda: linear(MESH, [Hooke(0.08, 0.5)]), "nu = 0.5"),
        (lambda: FiniteBody.of(MESH, [NeoHooke(0.08, 0.5)]), "nu = 0.5"),
        (lambda: linear(MESH, [Material(0.08, 0.48)]), "give one of solver.constitutive"),
        (lambda: linear(NOT_HELD, TISSUE, free=("Y",)), "free names the motion 'Y'"),
        (lambda: linear(replace(MESH, held=np.full(2, MESH.held[0])), TISSUE), "leaves the body a motion"),
        (lambda: linear(replace(MESH, skin=NONE, held=np.full(2, MESH.held[0])), TISSUE), "leaves the body a motion"),
        (lambda: linear(replace(MESH, held_y=MESH.elements[0, 8:]), TISSUE), "is the centre of element 0"),
        (lambda: FiniteBody.of(replace(MESH, held=MESH.elements[1, 8:]), SKIN), "is the centre of element 1"),
        (lambda: linear(replace(STRAY, held=np.array([*MESH.held, 25])), TISSUE), "node 25 is held and belongs to no"),
        (lambda: edge_load(MESH, MESH.skin[:4], np.ones((4, 2))), "the chain has 4 nodes"),
        (lambda: edge_load(MESH, MESH.skin, np.ones((4, 2))), "5 nodes and 4 tractions"),
        (lambda: linear(STRAY, TISSUE, np.ones((26, 2))), "loads pull at node 25, which belongs to no element"),
        (lambda: linear(MESH, [Hooke(-0.08, 0.3)]), "E must be above 0"),
        (lambda: linear(replace(MESH, region=MESH.region + 1), TISSUE), "region 1 of the mesh has no material"),
        (lambda: linear(replace(MESH, nodes=NAN), TISSUE), "node 0 of the mesh has no finite position"),
        (
            lambda: LinearBody.of(replace(MESH, skin=MESH.skin + 10**6), TISSUE),
            "mesh.skin names a node that does not exist",
        ),
        (lambda: linear(replace(MESH, skin=MESH.skin[:-1]), TISSUE), "mesh.skin has 4 nodes"),
        (lambda: linear(replace(MESH, skin=MESH.skin[::-1]), TISSUE), "are no free side of an element"),
        (lambda: linear(replace(MESH, skin=MESH.skin[1:4]), TISSUE), "are no free side of an element"),
        (
            lambda: LinearBody.of(replace(MESH, skin=MESH.elements[0][[3, 6, 2]]), TISSUE),
            "are no free side of an element",
        ),
        (
            lambda: LinearBody.of(replace(MESH, skin=MESH.elements[0][[2, 6, 3]]), TISSUE),
            "are no free side of an element",
        ),
        (lambda: FiniteBody.of(replace(MESH, skin=MESH.skin[:4]), [NeoHooke(0.08, 0.48)]), "mesh.skin has 4 nodes"),
        (
            lambda: LinearBody.of(replace(QUAD, skin=QUAD.elements[0][[0, 4, 1, 5, 2, 6, 3, 7, 0]]), TISSUE),
            "a node twice",
        ),
        (
            lambda: LinearBody.of(replace(MESH, region=MESH.region.astype(float)), TISSUE),
            "mesh.region is made of float64",
        ),
        (lambda: linear(replace(MESH, held=MESH.held[:, None]), TISSUE), "mesh.held has the shape"),
        (lambda: linear(replace(MESH, elements=MESH.elements[:, :8]), TISSUE), "nine nodes of each"),
        (
            lambda: LinearBody.of(replace(MESH, elements=MESH.elements[:0], region=MESH.region[:0]), TISSUE),
            "of one at least",
        ),
        (lambda: linear(replace(MESH, nodes=np.c_[MESH.nodes, MESH.nodes[:, 0]]), TISSUE), "every node x and y"),
        (lambda: linear(replace(MESH, nodes=MESH.nodes.astype(str)), TISSUE), "every node x and y"),
        (lambda: linear(MESH, TISSUE, MESH.nodes.astype(str)), "must be numbers"),
        (lambda: FiniteBody.of(MESH, TISSUE), "no law of finite strain"),
        (lambda: FiniteBody.of(MESH, [Ogden(0.08, 0.48, 0.0)]), "exponent 0; it must lie between 2 and 14"),
        (lambda: FiniteBody.of(MESH, [Ogden(0.08, 0.48, 50.0)]), "exponent 50; it must"),
        (lambda: FiniteBody.of(MESH, [Ogden(0.08, 0.48, np.nan)]), "exponent nan; it must"),
        (lambda: RelaxingBody(replace(MESH, nodes=NAN), [relaxing_law(0.3, 1.0)]), "node 0 of the mesh"),
        (lambda: RelaxingBody(NOT_HELD, [relaxing_law(0.3, 1.0)]), "nothing holds the body"),
        (lambda: RelaxingBody(MESH, [Prony(0.08, 0.5)]), "nu = 0.5"),
        (lambda: RelaxingBody(replace(MESH, region=MESH.region + 1), [relaxing_law(0.3, 1.0)]), "has no material"),
        (lambda: RelaxingBody(MESH, [relaxing_law(1.2, 1.0)]), "terms that cannot relax"),
        (lambda: RelaxingBody(MESH, [relaxing_law(-0.1, 1.0)]), "terms that cannot relax"),
        (lambda: RelaxingBody(MESH, [relaxing_law(0.3, -1.0)]), "terms that cannot relax"),
        (lambda: CondensedRelaxing(FiniteBody.of(MESH, SKIN), [relaxing_law(0.3, np.nan)]), "terms that cannot relax"),
        (
            lambda: solve_full_slip(Newton(FiniteBody.of(MESH, SKIN).condensed), LoadState(0.1, -1.0, sense=-1)),
            "mu = -1.0",
        ),
        (
            lambda: solve_full_slip(Newton(FiniteBody.of(MESH, SKIN).condensed), LoadState(0.1, 0.3, -1.0, sense=-1)),
            "tau_max = -1.0",
        ),
        (
            lambda: solve_full_slip(Newton(FiniteBody.of(MESH, SKIN).condensed), LoadState(np.nan, 0.3, sense=-1)),
            "depth = nan",
        ),
        (
            lambda: solve_full_slip(Newton(FiniteBody.of(MESH, SKIN).condensed), LoadState(0.1, 0.3, sense=2)),
            "sense = 2",
        ),
        (lambda: next(march(Newton(FiniteBody.of(MESH, SKIN).condensed), [LoadState(np.inf, 0.3)])), "depth = inf"),
        (
            lambda: next(march(Newton(FiniteBody.of(MESH, SKIN).condensed), [LoadState(0.1, 0.3, travel=np.nan)])),
            "travel = nan",
        ),
        (lambda: solve_dead_load(FiniteBody.of(MESH, SKIN), load=LoadState(0.0, -0.3)), "mu = -0.3"),
        (lambda: EquilibriumState.undeformed(FiniteBody.of(MESH, SKIN).condensed, LoadState(0.0, -0.3)), "mu = -0.3"),
        (lambda: ForceLoad(0.1, np.nan).validate(), "tangential = nan"),
        (
            lambda: solve_full_slip(Newton(LinearBody.of(MESH, TISSUE).condensed), LoadState(np.nan, 0.3, sense=1)),
            "depth = nan",
        ),
        (lambda: solve_full_slip(Newton(LinearBody.of(MESH, TISSUE).condensed), LoadState(0.1, 0.3)), "sense = 0"),
        (lambda: FrictionLaw(-0.3, np.inf), "mu = -0.3"),
        (lambda: FrictionLaw(np.nan, np.inf), "mu = nan"),
        (lambda: FrictionLaw(0.3, np.nan), "tau_max = nan"),
    ],
)
def test_a_body_that_cannot_be_solved_is_refused_at_the_door_in_one_sentence(make, sentence):
    with pytest.raises((BodyError, ValueError), match=sentence):
        make()


def test_a_mesh_keeps_its_places_when_the_array_they_came_from_changes():
    nodes = MESH.nodes.copy()
    mesh = replace(MESH, nodes=nodes)
    nodes *= 2.0
    np.testing.assert_array_equal(mesh.nodes, MESH.nodes)
    with pytest.raises(ValueError, match="read-only"):
        mesh.nodes[0] = 0.0


def test_held_unknowns_and_nodes_of_no_element_are_no_unknowns():
    assert MESH.dofs == 2 * (25 - 5)
    assert STRAY.dofs == MESH.dofs
    assert replace(MESH, held_x=MESH.skin[:1]).dofs == MESH.dofs - 1


def test_an_element_turned_inside_out_is_refused_at_the_door():
    nodes = MESH.nodes * np.array([-1.0, 1.0])
    for build in (lambda mesh: linear(mesh, TISSUE), lambda mesh: FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)])):
        with pytest.raises(MeshError, match="folded"):
            build(replace(MESH, nodes=nodes))


@pytest.mark.parametrize("integers", [np.uint8, np.int16, np.int32, np.uint64, np.int64])
@pytest.mark.parametrize("floats", [np.float32, np.float64])
def test_a_mesh_of_numbers_of_any_width_gives_the_forces_of_the_closed_form(integers, floats):
    # a block of 2 x 1 mm on the flat, its top lowered by rollers: Hooke's E/(1 - nu^2) times the strain, and the
    # neo-Hookean nominal stress at a stretch of 0.9 whose sides are free, 0.012098 MPa
    top, middle = MESH.held, np.flatnonzero(MESH.nodes[:, 0] == 0.0)
    rolls = replace(MESH, held=top[:0], held_y=top, held_x=middle)
    mesh = as_other_program_gives(rolls, integers, floats)
    state = solve_full_slip(Newton(LinearBody.of(mesh, TISSUE).condensed), LoadState(np.float32(0.125), 0, sense=1))
    assert state.force[1] == pytest.approx(2.0 * 0.125 * 0.08 / (1.0 - 0.48**2), rel=1e-6)
    force = solve_full_slip(Newton(FiniteBody.of(mesh, SKIN).condensed), LoadState(0.1, 0, sense=1)).force
    assert force[1] == pytest.approx(2.0 * 0.012098, rel=1e-4)


def test_pulls_and_forces_of_whole_numbers_reach_the_loops_as_the_floats_they_are_made_for():
    assert [type(number) for number in LoadState(1, 0, 2, np.int64(-1), np.float32(3.0)).validate()] == [
        *(float, float, float, int, float)
    ]
    assert ForceLoad(1, None, 2).validate() == (1.0, None, 2.0)
    assert type(FrictionLaw(1, 2).mu) is float
    loads = np.zeros(MESH.nodes.shape, np.int32)
    loads[MESH.skin[2], 1] = 1  # on the middle of the foot
    body, float_body = (LinearBody.of(MESH, TISSUE, pull, MESH.nodes * 0.0) for pull in (loads, loads.astype(float)))
    assert np.array_equal(body.condensed.load, float_body.condensed.load)
    assert body.condensed.free_displacement()[2, 1] > 0.0
