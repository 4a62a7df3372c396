"""Every hard case ends in a balanced answer with its error, or in one sentence with its reason."""

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.hard_cases import cases, of_scene
from solver.failures import SolveFailure
from solver.scene import Finger, Friction, Loading, Material, Materials, Receptor, Scene, Solve
from solver.solution import answers

SUITE = {case.name: case for case in cases()}


@pytest.mark.parametrize("name", SUITE)
def test_a_hard_case_ends_in_a_true_answer_or_where_none_exists_in_a_sentence(name):
    case = SUITE[name]
    found = case.run()
    assert found.flaw == ""
    assert all(math.isfinite(number) for number in found.numbers)
    assert found.answered or not case.must_answer, found.told
    if not found.answered:
        assert found.told.endswith(".")
        assert "nan" not in found.told


def test_near_incompressibility_costs_no_more_linear_systems():
    def systems(nu):
        return SUITE[f"nu {nu}"].run().told.split("; ")[1]

    assert systems(0.4999999) == systems(0.4999) == systems(0.499) == systems(0.48)


young = st.floats(-2.5, 0.5).map(lambda power: 10**power)
poisson = st.sampled_from([0.0, 0.3, 0.45, 0.48, 0.499, 0.4999999])
tissue = st.builds(Material, young, poisson)


@settings(deadline=None, max_examples=12, derandomize=True)
@given(
    finger=st.fixed_dictionaries(
        {
            "tip_radius": st.floats(4.5, 8.0),
            "epidermis": st.floats(0.08, 0.9),
            "dermis": st.floats(0.08, 0.9),
            "bone_radius": st.floats(0.5, 1.5),
            "contact_angle": st.floats(15.0, 85.0),
        }
    ),
    tissues=st.tuples(tissue, tissue, tissue),
    depth=st.floats(-5.0, 0.3).map(lambda power: 10**power),
    mu=st.one_of(st.floats(0.0, 1.5), st.sampled_from([1e-9, 1000.0])),
    bound=st.sampled_from([None, None, 0.0, 1e-9, 0.003, 0.03, 1e9]),
    slide=st.sampled_from(["+x", "-x", "none"]),
    course=st.sampled_from(["steady", "steady", "history"]),
)
def test_any_scene_ends_in_an_answer_or_in_one_sentence(finger, tissues, depth, mu, bound, slide, course):
    outline = Finger(**finger)
    asked = Scene(
        finger=outline,
        materials=Materials(*tissues),
        friction=Friction(mu, bound),
        loading=Loading(depth, slide),
        receptor=Receptor(outline.epidermis + outline.dermis - 0.03, (0.05, 0.5)),
        solve=Solve(course=course),
    )
    (found,) = answers([asked])
    if isinstance(found, SolveFailure):
        assert str(found).endswith(".")
        assert "nan" not in str(found)
        json.dumps(found.to_dict(), allow_nan=False)
        assert mu > 0.5 or "round-off" in str(found), f"refused at mu {mu:g}: {found}"
        return
    json.dumps(found.to_dict(), allow_nan=False)
    assert found.sed_ending > 0.0
    assert 0.0 < found.error_estimate < math.inf
    assert found.normal_force > 0.0
    for name in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance"):
        assert found.audits[name] < 1e-4
    doubted = any("round-off" in told for told in found.warnings)
    for name in ("penetration", "tension", "cone_violation"):
        assert found.audits[name] < (1e-5 if doubted else 1e-7)


def test_a_case_that_fails_is_told_as_one():
    """The suite can find fault: an answer out of balance has a flaw."""
    found = of_scene(Scene(friction=Friction(2.0), loading=Loading(2.0, "+x")))
    assert not found.answered
    assert found.numbers == ()
