"""How short elements are where the free cut meets the bone, and what happens where that is too short."""

from dataclasses import replace

import pytest

from solver import Friction, Loading, Scene, Solve
from solver.accuracy import adaptivity as climbing
from solver.accuracy.adaptivity import coarse_solution, nested_solution, sized, sized_together, solution_on
from solver.mesh.mesher import AT_CUT, SHORT_AT_CUT


def dragged(mu, depth=1.0, slide="+x"):
    return Scene(friction=Friction(mu), loading=Loading(depth, slide), solve=Solve("finite"))


def going_on():
    return False


def rough(scene):
    return coarse_solution(scene, scene.loading.depth, 6.0, going_on)


@pytest.fixture(scope="module")
def easy():
    return nested_solution(dragged(0.6), 1.0, 6.0, going_on)


def test_elements_at_the_cut_are_the_shorter_the_less_the_rough_mesh_squeezes_tissue_there():
    feet = [rough(dragged(mu, depth)) for mu, depth in ((0.3, 1.0), (0.24, 2.0), (0.29, 2.0), (0.33, 2.0))]
    squeezed = [low.finger.least_at_cut(low.shape) for low in feet]
    lengths = [low.at_cut for low in feet]
    assert squeezed == sorted(squeezed, reverse=True)
    assert lengths == sorted(lengths)
    assert lengths[0] == SHORT_AT_CUT < lengths[1] < lengths[2] < lengths[3] <= AT_CUT
    assert rough(dragged(0.6, slide="-x")).at_cut is None


def test_surfaces_that_share_a_mesh_have_the_elements_of_the_most_squeezed_at_the_cut():
    feet = [rough(dragged(mu)) for mu in (0.3, 0.9)]
    assert feet[0].at_cut < feet[1].at_cut < AT_CUT
    first, second = sized_together(dragged(0.3), 6.0, feet)
    assert first.at_cut == second.at_cut == feet[1].at_cut
    assert sum(first.sharing.gaps) == sum(second.sharing.gaps)


def test_where_short_elements_lead_nowhere_usual_ones_do(easy, monkeypatch):
    monkeypatch.setattr(climbing, "nearby", lambda *_: None)
    back = solution_on(dragged(0.6), 6.0, easy.coarse, going_on)
    usual = solution_on(dragged(0.6), 6.0, replace(easy.coarse, at_cut=AT_CUT), going_on)
    assert sized(6.0, easy.coarse).at_cut == SHORT_AT_CUT < back.at_cut == AT_CUT
    assert back.finger.sed_ending(back.shape) == pytest.approx(usual.finger.sed_ending(usual.shape), rel=1e-12)
