"""Meshes are refined where the error of the ending's SED comes from."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Finger, Friction, Loading, NoSteadyState, Scene, Solve, solve, solve_many
from solver._kernels import STICK
from solver.accuracy import adaptivity
from solver.accuracy.adaptivity import ADJOINTS, MAX_UNKNOWNS, NestedGrid, adjoints, refine_lines
from solver.contact import ForceLoad
from solver.continuation import finite_states
from solver.continuation.small_states import WIDE_MARGIN, settled_state
from solver.equilibrium import Newton
from solver.equilibrium.finger import KINDS, LinearFinger
from solver.mesh.mesher import Sizing
from solver.response import solution
from solver.scene.published import scenes

SLIDES = {
    "slip": Scene(friction=Friction(0.4), loading=Loading(1.5, "+x")),
    "slip at a bound": Scene(friction=Friction(0.6, 0.01), loading=Loading(1.5, "-x")),
    "stick": Scene(friction=Friction(0.5), loading=Loading(1.5)),
}
COARSE = Sizing(4.0, 1.5, margin=WIDE_MARGIN)


def sed(finger, scene):
    return finger.ending_and_middle([settled_state(scene, finger)])[0, 0, 0]


def results_under(finger, state, load, forces):
    """Return the results with an adjoint under a nodal `load`, at the contact states of `state`."""
    newton = finger.newton
    x = state.skin_positions(newton.condensed)[:, 0].copy()
    if isinstance(finger, LinearFinger):
        body, recover = finger.body.with_loads(load)
        newton = Newton(body)
        newton.linearise(state, x, 0, forces)
        after = newton.correct(state, lambda _: x)[0]
        return np.array([finger.sed_ending(recover(after.u)), *after.force[::-1], after.load.depth])
    number, (element, corner) = (
        finger.body.plan.unknown,
        np.argwhere(load.any(axis=1)[finger.geometry.mesh.elements])[0],
    )
    newton.condensed.load[number[element].reshape(8, 2)[corner]] = load[load.any(axis=1)][0]
    moved = state
    for _ in range(4):
        newton.linearise(moved, x, 0, forces)
        moved = replace(newton.correct(moved, lambda _: x)[0], state=state.state, sense=state.sense)
    newton.condensed.load[:] = 0.0
    return finger.all_numbers([moved])[0, :ADJOINTS]


@pytest.mark.parametrize("control", ["depth", "normal force", "both forces"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scene", SLIDES.values(), ids=SLIDES)
def test_the_adjoints_say_what_a_force_inside_the_finger_changes(scene, kind, control):
    scene = replace(scene, friction=replace(scene.friction, mu=0.3), solve=Solve(kind))
    finger = KINDS[kind].of(scene, COARSE)
    state = settled_state(scene, finger) if kind == "small" else finite_states.settled_state(finger, scene)
    drag = float(state.reaction[:, 0].sum()) if control == "both forces" and STICK in state.state else None
    forces = None if control == "depth" else ForceLoad(float(state.normal.sum()), drag, state.load.travel)
    dual = adjoints(finger, finger.displacement(state), state, forces)
    mesh, step = finger.geometry.mesh, 1e-6
    inner_nodes = np.setdiff1d(mesh.elements[:, :8], np.concatenate([mesh.skin, mesh.held]))
    for node in np.random.default_rng(1).choice(inner_nodes, 3, replace=False):
        for along in (0, 1):
            load = np.zeros(mesh.nodes.shape)
            load[node, along] = step
            low, high = (results_under(finger, state, side * load, forces) for side in (-1.0, 1.0))
            scale = np.abs(dual).max(axis=(0, 1))
            assert np.all(np.abs((high - low) / (2.0 * step) - dual[node, along]) <= 1e-4 * scale + 1e-8)


@pytest.mark.parametrize("place", [-1.0, 8.0])
def test_four_columns_made_one_have_a_far_larger_part_of_the_error(place):
    scene = SLIDES["slip"]
    lines = LinearFinger.of(scene, replace(COARSE, fineness=8.0)).geometry.lines
    line = int(np.searchsorted(lines.arcs, place))
    wide_lines = replace(lines, arcs=(*lines.arcs[: line - 1], *lines.arcs[line + 2 :]))

    def column_errors(lines):
        finger = LinearFinger.of(scene, replace(COARSE, fineness=lines, halved=True))
        state = settled_state(scene, finger)
        return np.abs(NestedGrid.of(finger).parts(finger.displacement(state), state)[0][:, 0])

    fine_errors, wide_errors = column_errors(lines), column_errors(wide_lines)
    assert wide_errors[line - 2] > 4.0 * fine_errors[line - 2 : line + 2].sum()
    assert wide_errors.sum() - wide_errors[line - 2] < 1.5 * fine_errors.sum()


def test_dividing_what_has_the_largest_part_changes_the_sed_most():
    scene = scenes()[4]
    sizing = Sizing(4.0, 2.0, margin=WIDE_MARGIN)
    finger = LinearFinger.of(scene, replace(sizing, halved=True))
    state = settled_state(scene, finger)
    parts = np.abs(np.concatenate(NestedGrid.of(finger).parts(finger.displacement(state), state)[:2])[:, 0])
    lines = finger.geometry.lines
    before = sed(LinearFinger.of(scene, sizing), scene)

    def change(gap):
        halves = np.ones(len(parts), np.int64)
        halves[gap] = 2
        finer_lines = lines.divide(*np.split(halves, [len(lines.arcs) - 1]))
        return abs(sed(LinearFinger.of(scene, replace(sizing, fineness=finer_lines)), scene) - before)

    changes = np.array([change(gap) for gap in range(len(parts))])
    largest = np.argsort(parts)[-4:]
    assert changes[largest].sum() > 0.6 * changes.sum()


def test_refined_lines_contain_the_old_ones_and_no_more_than_a_mesh_may_have():
    mesh = LinearFinger.of(SLIDES["slip"], COARSE).geometry
    gaps = len(mesh.lines.arcs) - 1 + mesh.lines.rows
    few, many = (refine_lines(mesh, np.full(gaps, error)) for error in (1e-6, 1e6))
    halves = refine_lines(mesh, None)
    for lines in (few, many, halves):
        assert set(mesh.lines.arcs) < set(lines.arcs)
        assert np.all(np.diff(lines.arcs) > 0.0)
        assert np.all(np.diff(lines.skin) < 0.0)
        assert LinearFinger.of(SLIDES["slip"], replace(COARSE, fineness=lines)).body.mesh.dofs <= MAX_UNKNOWNS
    assert len(few.arcs) < len(many.arcs)
    assert len(halves.arcs) == 2 * len(mesh.lines.arcs) - 1


def test_a_contact_narrower_than_its_smallest_elements_is_solved_on_one_mesh():
    scene, dofs = Scene(friction=Friction(0.3), loading=Loading(1e-5, "+x"), solve=Solve(evidence="quick")), []
    prediction = solve(scene, rough=lambda rough: dofs.append(rough.dofs))
    assert dofs == [prediction.dofs]
    assert prediction.error_estimate > 0.01


def test_refinement_comes_to_an_end(monkeypatch):
    monkeypatch.setattr(adaptivity, "MAX_UNKNOWNS", 4000)
    scene, dofs = scenes()[9], []
    strict_scene = replace(scene, solve=replace(scene.solve, tolerance=1e-4, evidence="quick"))
    prediction = solve(strict_scene, rough=lambda rough: dofs.append(rough.dofs))
    assert prediction.error_estimate > 1e-4
    assert any("above the tolerance" in warning for warning in prediction.warnings)
    assert dofs[:-1] == sorted(set(dofs))  # the last is the answer, before its evidence
    assert dofs[-1] <= 4000
    # elements so small that none may be divided
    monkeypatch.setattr(adaptivity, "FINEST", 1.0)
    lines = prediction.geometry.lines
    assert refine_lines(prediction.geometry, np.full(len(lines.arcs) - 1 + lines.rows, 1e9)) is None


def test_a_surface_that_has_no_answer_does_not_keep_the_others_from_an_end(monkeypatch):
    monkeypatch.setattr(adaptivity, "MAX_UNKNOWNS", 3000)
    settings = Solve("finite", contrast_tolerance=0.0005)
    surfaces = [Scene(friction=Friction(mu), loading=Loading(2.0, "+x"), solve=settings) for mu in (0.2, 0.25, 0.9)]
    rounds = []
    finer = solution._finer
    monkeypatch.setattr(solution, "_finer", lambda *arguments: rounds.append(finer(*arguments)) or rounds[-1])
    *answers, failure = solve_many(surfaces)
    assert isinstance(failure, NoSteadyState)
    assert all(answer.dofs > 2000 for answer in answers)
    assert not rounds[-1]
    assert len(rounds) < 5


def test_a_tolerance_is_met_with_few_unknowns():
    scene = scenes()[9]
    prediction = solve(replace(scene, solve=replace(scene.solve, tolerance=0.0005)))
    even_finger = LinearFinger.of(scene, Sizing(8.0, 2.0, margin=WIDE_MARGIN))
    fine_sed = sed(LinearFinger.of(scene, Sizing(26.0, 2.0, margin=WIDE_MARGIN)), scene)
    assert prediction.error_estimate <= 0.0005
    assert prediction.dofs < even_finger.body.mesh.dofs  # with elements half as large as the first mesh's
    assert abs(prediction.sed_ending / fine_sed - 1.0) < 0.0005


def test_at_finite_strain_a_tolerance_is_met_on_lines_that_were_added():
    scene = Scene(friction=Friction(0.3), loading=Loading(1.5, "+x"), solve=Solve("finite", tolerance=0.002))
    strict = solve(scene)
    usual = solve(replace(scene, solve=Solve("finite")))
    assert strict.error_estimate <= 0.002
    assert min(strict.wall_s, strict.setup_s, strict.estimate_s) > 0.0
    assert abs(strict.sed_ending / usual.sed_ending_corrected - 1.0) < 0.002 + usual.error_estimate


@pytest.mark.parametrize(("cut", "singular"), [("free", [True, False]), ("driven", [False, True])])  # at bone, at skin
def test_a_corner_of_the_mesh_is_singular_between_a_held_and_a_free_side(cut, singular):
    scene = Scene(friction=Friction(0.3), loading=Loading(1.0), finger=Finger(cut=cut))
    grid = NestedGrid.of(LinearFinger.of(scene, Sizing(4.0, 1.0, halved=True)))
    assert grid.singular_corners().tolist() == [singular, singular]
