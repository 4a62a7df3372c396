"""Skin that is stiff, or stiffens, carries the drag to the cut: its numbers are told with what is known of them."""

from dataclasses import replace

import pytest

from solver import solution
from solver.failures import NoSteadyState, NotConverged
from solver.prediction import Prediction
from solver.scene import Friction, Loading, Materials, Scene, Solve
from solver.solution import solve


def stiffening(mu, tolerance=None):
    usual = Materials()
    skin = {name: replace(usual.of(name), law="ogden") for name in ("epidermis", "dermis")}
    return Scene(
        materials=replace(usual, **skin),
        friction=Friction(mu),
        loading=Loading(2.0, "+x"),
        solve=Solve("finite", "steady", tolerance, "quick"),
    )


def test_an_answer_that_a_finer_mesh_does_not_find_is_told_as_the_coarser_has_it_with_a_sentence(monkeypatch):
    whole = solution._on_mesh
    meshes = []

    def lost(scenes, depth, fineness, *rest):
        meshes.append(fineness)
        return whole(scenes, depth, fineness, *rest) if len(meshes) == 1 else [NotConverged("lost")] * len(scenes)

    scene = stiffening(0.3, 0.01)
    monkeypatch.setattr(solution, "_on_mesh", lost)
    monkeypatch.setattr(solution, "_misses", lambda answer, _: not isinstance(answer, NotConverged))
    found = solve(scene)
    assert len(meshes) == 2
    monkeypatch.undo()
    alone = whole([scene], 2.0, meshes[0], None, None, False)[0]
    assert (found.sed_ending, found.error_estimate) == (alone.sed_ending, alone.error_estimate)
    assert any("finer mesh did not find" in told for told in found.warnings)


def test_a_tolerance_so_strict_that_its_first_mesh_finds_nothing_does_not_lose_the_answer_of_a_coarser_one(monkeypatch):
    whole = solution._on_mesh

    def lost(scenes, depth, fineness, *rest, **more):
        return whole(scenes, depth, fineness, *rest, **more) if fineness <= 7 else [NotConverged("lost")] * len(scenes)

    monkeypatch.setattr(solution, "_on_mesh", lost)
    found = solve(stiffening(0.3, 0.001))
    assert found.error_estimate > 0.001
    assert any("finer mesh did not find" in told for told in found.warnings)


def test_a_state_that_a_finer_mesh_puts_beyond_its_limit_is_refused_and_the_refusal_names_the_doubt(monkeypatch):
    whole = solution._on_mesh

    def refused(scenes, depth, fineness, *rest, **more):
        beyond = NoSteadyState("beyond", limit_mu=0.299)
        return whole(scenes, depth, fineness, *rest, **more) if fineness <= 7 else [beyond] * len(scenes)

    monkeypatch.setattr(solution, "_on_mesh", refused)
    monkeypatch.setattr(solution, "_misses", lambda answer, _: isinstance(answer, Prediction))
    with pytest.raises(NoSteadyState, match=r"^Beyond\. A coarser mesh still has a settled state") as told:
        solve(stiffening(0.3, 0.01))
    assert told.value.limit_mu == 0.299


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "truth"), [(0.35, 3.171e-3), (0.45, 2.3676e-3), (0.48, 2.548e-3)])
def test_estimates_of_stiffening_skin_cover_what_meshes_of_14_to_28_tend_to(mu, truth):
    found = solve(stiffening(mu))
    assert abs(found.sed_ending / truth - 1.0) <= found.error_estimate
