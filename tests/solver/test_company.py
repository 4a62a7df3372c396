"""Scenes solved together, in any order and in several threads, have the answers that they have alone."""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from solver import Friction, Loading, NoSteadyState, NotConverged, Scene, Solve, solve, solve_many
from solver.continuation.small_states import expected_depth
from solver.response.finite_answers import FiniteMeshing

QUICK = Solve(evidence="quick")


def sliding(mu, slide="+x", depth=1.5, **settings):
    return Scene(friction=Friction(mu), loading=Loading(depth, slide), solve=replace(QUICK, **settings))


def test_every_mesh_gives_its_answers_to_the_watch_by_the_positions_of_their_scenes():
    scenes, calls = [sliding(0.3, tolerance=0.5), sliding(0.6, "-x", tolerance=0.001)], []
    answers = solve_many(scenes, watch=lambda number, answer, *_: calls.append((number, answer)))
    assert [number for number, _ in calls].count(1) > 1
    assert all(answer.scene is scenes[number] for number, answer in calls)
    last = dict(calls)
    assert [last[number].sed_ending for number in (0, 1)] == [answer.sed_ending for answer in answers]


def test_a_scene_without_a_tolerance_is_solved_to_the_usual_one_beside_any_other():
    usual, loose = sliding(0.3), sliding(0.3, "-x", tolerance=0.5)
    alone = [solve(scene) for scene in (usual, loose)]
    for number, prediction in enumerate(solve_many(scene for scene in (usual, loose))):
        assert prediction.dofs == alone[number].dofs
        assert prediction.sed_ending == pytest.approx(alone[number].sed_ending, rel=1e-12)
    assert alone[0].error_estimate <= 0.003 < alone[1].error_estimate


@pytest.mark.parametrize("reverse", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_history_is_marched_on_the_mesh_that_its_settled_state_needs_whatever_the_others_need(reverse):
    strict, wedged = (sliding(mu, way, course="history", tolerance=1.8e-4) for mu, way in ((0.3, "+x"), (2.5, "-x")))
    alone = solve(strict)
    assert alone.error_estimate <= 1.8e-4
    answers = solve_many((wedged, strict) if reverse else (strict, wedged))
    prediction, failure = answers[::-1] if reverse else answers
    assert isinstance(failure, NoSteadyState)
    assert prediction.dofs == alone.dofs
    assert prediction.sed_ending == pytest.approx(alone.sed_ending, rel=1e-12)


def test_under_steep_friction_a_mesh_that_is_tried_at_last_says_that_it_misses_the_tolerance(monkeypatch):
    scene = Scene(friction=Friction(3.0, 0.004), loading=Loading(1.0, "+x"), solve=Solve("finite", evidence="quick"))
    coarse_prediction = solve(replace(scene, solve=replace(scene.solve, tolerance=0.5)))
    strict = replace(scene, solve=replace(scene.solve, tolerance=1e-4))

    refined = replace(coarse_prediction, scene=strict)
    failure = NotConverged("lost")
    monkeypatch.setattr(FiniteMeshing, "answers", lambda *args: {0: refined if args[2] == 4.0 * 1.2 else failure})
    prediction = solve(strict)
    assert prediction.error_estimate > 1e-4
    assert any("above the tolerance" in warning for warning in prediction.warnings)


def test_at_finite_strain_a_scene_under_a_force_has_the_mesh_that_it_has_alone_beside_a_deeper_one():
    light, deep = (
        Scene(friction=Friction(0.2), loading=loading, solve=Solve("finite", evidence="quick"))
        for loading in (Loading(normal_force=0.05), Loading(2.0))
    )
    prediction = solve_many((deep, light))[1]
    assert prediction.sed_ending == pytest.approx(solve(light).sed_ending, rel=1e-12)


def test_threads_find_the_depths_under_forces_that_one_thread_finds():
    surfaces = [
        Scene(friction=Friction(mu), loading=Loading(normal_force=force)) for mu in (0.1, 0.7) for force in (0.05, 0.2)
    ]
    expected = [expected_depth(surface) for surface in surfaces]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(4) as threads:
            depths = list(threads.map(expected_depth, 150 * surfaces))
    finally:
        sys.setswitchinterval(interval)
    assert depths == 150 * expected
