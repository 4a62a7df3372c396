"""Where settled sliding ends at small strain: under a given force, at a depth, and on the way to the last slide."""

import pytest

from solver import Friction, Loading, NoSteadyState, Scene, Solve, solve

COARSE = 0.005  # tolerance whose mesh knows limits to 3 %
LIFTED = "The drag lifts the bone"


def pressed_scene(force, mu, slide="+x", tau_max=None, course="steady"):
    return Scene(
        friction=Friction(mu, tau_max),
        loading=Loading(None, slide, normal_force=force),
        solve=Solve("small", course, COARSE),
    )


def driven_scene(depth, mu, slide="+x", tau_max=None, course="steady"):
    return Scene(friction=Friction(mu, tau_max), loading=Loading(depth, slide), solve=Solve("small", course, COARSE))


def refusal_of(scene):
    with pytest.raises(NoSteadyState) as failure:
        solve(scene)
    return failure.value


def test_where_a_drag_lifts_the_bone_the_slide_is_found_as_the_course_finds_it_and_is_reported():
    prediction = solve(pressed_scene(0.1, 1.5, course="history"))
    # the expected depth is that of a mesh of four times as many elements
    assert prediction.indentation == pytest.approx(0.229, rel=prediction.indentation_error)
    assert prediction.indentation_error < 0.05
    assert prediction.audits["course_against_direct"] < 1e-9
    assert any(LIFTED in warning for warning in prediction.warnings)
    # at the same depth there is a slide with less force too, and that is where a finger driven there ends
    by_depth = solve(driven_scene(prediction.indentation, 1.5))
    assert by_depth.normal_force < 0.5 * prediction.normal_force


def test_a_drag_that_does_not_lift_the_bone_is_not_reported():
    assert not any(LIFTED in warning for warning in solve(pressed_scene(0.03, 1.5)).warnings)


@pytest.mark.slow
def test_under_a_force_a_refusal_tells_the_largest_friction_force_and_depth_and_they_hold_to_3_percent():
    refusal = refusal_of(pressed_scene(0.1, 2.0))
    assert refusal.limit_mu == pytest.approx(1.675, rel=0.01)  # where the depth falls to 0, on twice as fine a mesh
    assert solve(pressed_scene(0.1, 0.97 * refusal.limit_mu)).normal_force == pytest.approx(0.1, rel=1e-9)
    assert solve(pressed_scene(0.97 * refusal.limit_normal_force, 2.0)).indentation > 0.0
    assert solve(driven_scene(0.97 * refusal.limit_indentation, 2.0)).normal_force > 0.0
    assert refusal.to_dict()["error"]["limit_normal_force"] == refusal.limit_normal_force


def test_a_given_force_that_drags_skin_at_the_bound_up_to_an_edge_has_its_estimate():
    prediction = solve(pressed_scene(0.1, 2.0, "+x", 0.03))
    assert prediction.normal_force == pytest.approx(0.1, rel=1e-9)
    assert 0.0 < prediction.error_estimate <= COARSE


@pytest.mark.slow
@pytest.mark.parametrize("tau_max", [None, 0.03])
@pytest.mark.parametrize("slide", ["+x", "-x"])
@pytest.mark.parametrize("mu", [0.8, 1.3, 2.0, 3.0])
@pytest.mark.parametrize("force", [0.02, 0.1, 0.3])
def test_every_force_ends_in_an_answer_or_in_limits_that_hold(force, mu, slide, tau_max):
    """Limits of friction and force hold to 3 %, of depth to 4 %; a bound may leave no limit of force or depth."""

    def at_limits(refusal, part):
        yield pressed_scene(force, (1.0 + 0.03 * part) * refusal.limit_mu, slide, tau_max)
        if refusal.limit_normal_force is not None:
            yield pressed_scene((1.0 + 0.03 * part) * refusal.limit_normal_force, mu, slide, tau_max)
        if refusal.limit_indentation is not None:
            yield driven_scene((1.0 + 0.04 * part) * refusal.limit_indentation, mu, slide, tau_max)

    try:
        prediction = solve(pressed_scene(force, mu, slide, tau_max))
    except NoSteadyState as failure:
        refusal = failure
    else:
        assert prediction.normal_force == pytest.approx(force, rel=1e-9)
        return
    for possible in at_limits(refusal, -1.0):
        solve(possible)
    refusals = [refusal_of(scene) for scene in at_limits(refusal, 1.0)]
    assert tau_max is not None or len(refusals) == 3


@pytest.mark.slow
def test_a_slide_that_settles_late_near_the_limit_is_gone_to_its_end():
    prediction = solve(driven_scene(2.0, 1.25, course="history"))
    assert prediction.history.bone_x[-1] > 25 * 2.0
    assert prediction.audits["course_against_direct"] < 1e-9


@pytest.mark.slow
def test_an_earlier_slide_without_a_settled_state_is_refused_with_its_limits_where_the_course_is_asked_for():
    refusal = refusal_of(driven_scene(2.0, 1.25, ("-x", "+x"), course="history"))
    assert "along -x" in str(refusal)
    assert refusal.limit_mu == pytest.approx(1.2, rel=0.03)
    assert refusal.limit_indentation == pytest.approx(1.81, rel=0.03)


@pytest.mark.slow
def test_an_earlier_slide_without_a_settled_state_is_reported_where_the_last_one_alone_is_solved():
    prediction = solve(driven_scene(2.0, 1.25, ("-x", "+x")))
    (warning,) = (text for text in prediction.warnings if "A slide before this one" in text)
    assert "along -x at 2 mm" in warning


@pytest.mark.slow
def test_at_finite_strain_an_earlier_slide_whose_skin_folds_is_reported():
    scene = Scene(friction=Friction(0.67), loading=Loading(2.0, ("+x", "-x")), solve=Solve("finite", "steady", COARSE))
    assert any("the skin behind the contact folds" in warning for warning in solve(scene).warnings)


def test_slides_that_all_settle_need_no_warning():
    assert not any("A slide before" in warning for warning in solve(driven_scene(1.0, 0.4, ("+x", "-x"))).warnings)


@pytest.mark.parametrize("bound", [0.9, 9e9])
def test_a_slide_that_would_carry_skin_farther_than_the_finger_is_long_is_refused(bound):
    with pytest.raises(NoSteadyState, match="farther than the finger is long"):
        solve(Scene(friction=Friction(5.0, bound), loading=Loading(1.5, "+x")))
