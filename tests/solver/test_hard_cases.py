"""Every hard case ends in a balanced answer with its error, or in one sentence with its reason, in both kinematics."""

import json
import math

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from solver import (
    Finger,
    Friction,
    Loading,
    Material,
    Materials,
    Receptor,
    Scene,
    Solve,
    SolveFailure,
    solve,
    solve_many,
)
from solver.verification.hard_cases import TELLING, Case, HardCase, cases, judge, measure
from solver.verification.hard_cases.light import of_light_touch
from solver.verification.hard_cases.outcome import Outcome, of_scene
from solver.verification.request import Request

SUITE = {(case.kinematics, case.name): case for kind in ("small", "finite") for case in cases(kind)}


def case_param(case: Case):
    """`make test` runs those that tell most, `make test-long` all."""
    slow = case.slow or case.name not in TELLING
    return pytest.param(case, id=f"{case.kinematics}: {case.name}", marks=[pytest.mark.slow] if slow else [])


@pytest.mark.parametrize("case", [case_param(case) for case in SUITE.values()])
def test_a_hard_case_ends_as_it_must(case):
    neighbour = SUITE[case.kinematics, case.same_as].run() if case.same_as else None
    assert judge(case, neighbour).flaw == ""


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_what_has_to_answer_does_at_both_kinematics(kinematics):
    """A refusal counts only where no state exists: these exist."""
    must_answer = {name for (kind, name), case in SUITE.items() if kind == kinematics and case.must == "answer"}
    names = ["nu 0.4999999", "bone 1e10 times stiffer than fat", "a part 1e+10 times stiffer", "mu 0", "tau_max 0 MPa"]
    names += ["tau_max 1e+09 MPa", "depth 1e-06 mm without friction", "depth 2 mm without friction"]
    names += ["direction reversal", "elements distorted to 0.45 of an edge"]
    names += [f"angle {angle} degrees{way}" for angle in (30, 45, 60, 75) for way in ("", ", backwards")]
    assert set(names) <= must_answer


@pytest.mark.parametrize("kinematics", ["small", pytest.param("finite", marks=pytest.mark.slow)])
def test_near_incompressibility_costs_no_more_linear_systems(kinematics):
    def systems(nu):
        return int(SUITE[kinematics, f"nu {nu}"].run().summary.split("; ")[1].split()[0])

    usual_count = systems(0.48)
    assert all(systems(nu) <= usual_count + (0 if kinematics == "small" else 2) for nu in (0.499, 0.4999, 0.4999999))


def test_a_case_that_fails_is_reported_as_one():
    """The suite can find fault: a refusal where there must be an answer, and a number that is not its neighbour's."""
    refusal = of_scene(Scene(friction=Friction(2.0), loading=Loading(2.0, "+x")))
    assert not refusal.answered
    assert refusal.numbers == ()
    refused_case = Case("small", "refused", "answer", lambda: refusal)
    assert judge(refused_case).flaw == "no answer"
    neighbour, other_case = SUITE["small", "mu 0"].run(), SUITE["small", "mu 0.44"]
    distant_case = Case("small", "apart", "answer", other_case.run, "mu 0", 1e-3)
    assert judge(distant_case, neighbour).flaw.endswith("from mu 0, not 0.001")


def test_the_suite_compares_a_case_with_its_neighbour_wherever_that_stands(monkeypatch):
    first = Case("small", "nu 0.0", "answer", lambda: Outcome(True, (1.0,), "", ""), "last", 1e-3)
    last = Case("small", "last", "answer", lambda: Outcome(True, (2.0,), "", ""))
    monkeypatch.setattr(
        "solver.verification.hard_cases.cases", lambda kinematics: (first, last) if kinematics == "small" else ()
    )
    for quick in (True, False):  # a quick run leaves the neighbour's own row out
        rows = list(measure(Request(quick, math.inf)))
        assert next(row for row in rows if isinstance(row, HardCase)).flaw == "0.5 from last, not 0.001"


def test_a_touch_that_is_not_hertz_s_is_reported_as_one():
    # its contact is as wide as the epidermis is thick
    scene = Scene(friction=Friction(0.3), loading=Loading(0.1, "+x"))
    assert "from Hertz's" in of_light_touch(scene).flaw


young = st.floats(-2.5, 0.5).map(lambda power: 10**power)
poisson = st.sampled_from([0.0, 0.3, 0.45, 0.48, 0.499, 0.4999999])
tissue = st.builds(Material, young, poisson)
scene_parts = {
    "finger": st.fixed_dictionaries(
        {
            "tip_radius": st.floats(4.5, 8.0),
            "epidermis": st.floats(0.08, 0.9),
            "dermis": st.floats(0.08, 0.9),
            "bone_radius": st.floats(0.5, 1.5),
            "contact_angle": st.floats(15.0, 85.0),
        }
    ),
    "tissues": st.tuples(tissue, tissue, tissue),
    "depth": st.floats(-5.0, 0.3).map(lambda power: 10**power),
    "mu": st.one_of(st.floats(1e-12, 1.5), st.sampled_from([0.0, 1e-9, 1000.0])),
    "bound": st.sampled_from([None, None, 0.0, 1e-9, 0.003, 0.03, 1e9]),
    "slide": st.sampled_from(["+x", "-x", "none"]),
    "course": st.sampled_from(["steady", "steady", "history"]),
}


def solve_and_check(kinematics, finger, tissues, depth, mu, bound, slide, course):
    """Solve a scene and check all that must hold however it ends."""
    outline = Finger(**finger)
    scene = Scene(
        finger=outline,
        materials=Materials(*tissues),
        friction=Friction(mu, bound),
        loading=Loading(depth, slide),
        receptor=Receptor(outline.epidermis + outline.dermis - 0.03, (0.05, 0.5)),
        solve=Solve(kinematics, course),
    )
    (result,) = solve_many([scene])
    json.dumps(result.to_dict(), allow_nan=False)
    if isinstance(result, SolveFailure):
        assert str(result).endswith(".")
        assert "nan" not in str(result)
        return result
    assert result.sed_ending > 0.0
    assert 0.0 < result.error_estimate < math.inf
    assert result.normal_force > 0.0
    for name in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance"):
        assert result.audits.get(name, 0.0) < 1e-4
    in_doubt = any("round-off" in warning for warning in result.warnings)
    for name in ("penetration", "tension", "cone_violation"):
        assert result.audits[name] < (1e-4 if in_doubt else 1e-7)  # 1e-4: from where an answer is refused
    return result


@pytest.mark.slow
@settings(deadline=None, max_examples=12, derandomize=True, phases=[Phase.generate])
@given(**scene_parts)
def test_any_scene_at_small_strain_ends_in_an_answer_or_in_one_sentence(
    finger, tissues, depth, mu, bound, slide, course
):
    result = solve_and_check("small", finger, tissues, depth, mu, bound, slide, course)
    if isinstance(result, SolveFailure):
        assert mu > 0.5 or "round-off" in str(result), f"refused at mu {mu:g}: {result}"


@pytest.mark.slow
@settings(deadline=None, max_examples=40, derandomize=True, phases=[Phase.generate])
@given(**scene_parts)
def test_any_scene_at_finite_strain_ends_in_an_answer_or_in_one_sentence(
    finger, tissues, depth, mu, bound, slide, course
):
    solve_and_check("finite", finger, tissues, depth, mu, bound, slide, course)


def test_skin_that_round_off_pressed_through_the_surface_is_laid_on_it_again():
    soft = Materials(*(Material(modulus, 0.4999999) for modulus in (0.136, 0.08, 0.034)))
    prediction = solve(Scene(materials=soft, friction=Friction(1.0), loading=Loading(1e-5, "+x")))
    assert prediction.audits["penetration"] < 1e-7
    assert not any("too low" in warning for warning in prediction.warnings)
