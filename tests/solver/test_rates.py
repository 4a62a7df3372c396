"""Mean rates of the responses: closed forms on artificial courses, and how they scale with the speed of the slide."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Material, Materials, Relaxation, Scene, Solve, solve
from solver.equilibrium.finger import KINDS
from solver.equilibrium.load_path import march_scene
from solver.prediction import History
from solver.quantities import NAMES
from solver.response import history
from solver.response.rates import course_errors, course_numbers, rates

RELAXING = Scene(
    friction=Friction(0.3),
    loading=Loading(0.8, "+x"),
    materials=Materials(dermis=Material(0.08, 0.48, prony=(Relaxation(0.3, 0.5),))),
)


def course(time, bone_x, slipping, response):
    zeros = np.zeros(len(time))
    values = np.outer(response, np.arange(1.0, len(NAMES) + 1.0))
    return History(np.array(time), np.array(bone_x), *[zeros] * 6, np.array(slipping), values)


def test_parts_end_where_the_bone_begins_to_move_and_where_all_slips():
    # Pressed to 4 in 1 s, back to 1 in 0.5 s until all slips, then to 2 in 2 s.
    time, bone_x = [0.5, 1.0, 1.25, 1.5, 3.5], [0.0, 0.0, 0.1, 0.2, 1.0]
    mean_rates = rates(course(time, bone_x, [0.0, 0.0, 0.5, 1.0, 1.0], [2.0, 4.0, 2.0, 1.0, 2.0]))
    for number, name in enumerate(NAMES, 1):
        assert mean_rates[name] == pytest.approx((4.0 * number, -6.0 * number, 0.5 * number))


def test_a_course_without_a_part_has_no_rate_there():
    press_only = rates(course([0.5, 1.0], [0.0, 0.0], [0.0, 0.0], [1.0, 2.0]))["sed"]
    assert press_only.press == 2.0
    assert np.isnan(press_only[1:]).all()
    sticking = rates(course([1.0, 2.0], [0.0, 0.3], [0.0, 0.4], [1.0, 2.0]))["sed"]
    assert (sticking.press, sticking.break_away) == (1.0, 1.0)
    assert np.isnan(sticking.slide)


@pytest.mark.parametrize("kinematics", ["small", pytest.param("finite", marks=pytest.mark.slow)])
def test_the_press_before_a_drag_ends_after_its_second_although_the_bone_moves_along_the_surface(kinematics):
    drag = Loading(slide="+x", normal_force=0.05, tangential_force=0.01)
    scene = Scene(friction=Friction(0.5), loading=drag, solve=Solve(kinematics, "history", 0.1, "quick"))
    course = solve(scene).history
    press_end = int(np.flatnonzero(course.time == 1.0)[0])
    assert course.bone_x[press_end] != 0.0
    sed_rates = rates(course)["sed"]
    assert sed_rates.press == pytest.approx(course.sed_ending[press_end])
    assert sed_rates.break_away == pytest.approx(course.sed_ending[-1] - course.sed_ending[press_end])


@pytest.mark.parametrize("kinematics", ["small", pytest.param("finite", marks=pytest.mark.slow)])
def test_twice_as_fast_a_slide_breaks_away_twice_as_fast_and_its_end_is_the_prediction(kinematics):
    scene = Scene(friction=Friction(0.3), loading=Loading(1.0, "-x", 10.0), solve=Solve(kinematics, "history"))
    predictions = [solve(replace(scene, loading=replace(scene.loading, speed=speed))) for speed in (10.0, 20.0)]
    slow, fast = (rates(prediction.history) for prediction in predictions)
    for name in NAMES:
        assert fast[name].press == pytest.approx(slow[name].press, rel=1e-9)
        assert fast[name].break_away == pytest.approx(2.0 * slow[name].break_away, rel=1e-6)
    ends = predictions[0].history.responses[-1]
    assert ends == pytest.approx([predictions[0].responses[name].value for name in NAMES], rel=1e-6)


def test_where_tissues_relax_the_sed_alone_has_a_course():
    mean_rates = rates(solve(replace(RELAXING, solve=Solve("small", "history"))).history)
    assert np.isfinite(mean_rates["sed"]).all()
    assert np.isnan(mean_rates["pressure"]).all()


@pytest.mark.parametrize("kinematics", ["small", pytest.param("finite", marks=pytest.mark.slow)])
@pytest.mark.parametrize("slide", ["-x", "none"])
def test_errors_at_the_ends_of_press_and_break_away_and_of_rates_lie_above_the_true_ones(kinematics, slide):
    settings = Solve(kinematics, "history", evidence="quick")
    scene = Scene(friction=Friction(0.3), loading=Loading(1.0, slide, 10.0), solve=settings)
    prediction = solve(scene)
    sizing = replace(prediction.geometry.sizing, fineness=16.0 if kinematics == "small" else 10.0)
    fine = KINDS[kinematics].of(scene, sizing)
    truth = course_numbers(history(scene, fine, march_scene(scene, fine, 4.0)))
    numbers, errors = course_numbers(prediction.history), course_errors(prediction)
    finite = np.isfinite(truth.value)
    assert np.array_equal(finite, np.isfinite(errors.value))
    assert np.array_equal(finite[:, 0], [True, slide != "none", slide != "none"])
    assert np.mean((np.abs(numbers.value - truth.value) <= errors.value)[finite]) >= 0.95
    assert np.all(errors.value[0, :4] < 0.05 * np.abs(numbers.value[0, :4]))
    parts = np.isfinite(truth.rate)
    assert np.mean((np.abs(numbers.rate - truth.rate) <= errors.rate)[parts]) >= 0.95


def test_where_tissues_relax_the_errors_of_a_course_are_those_of_its_sed_and_forces():
    errors = course_errors(solve(replace(RELAXING, solve=Solve("small", "history", 0.02, "quick"))))
    assert np.all(np.isfinite(errors.value[:, :6]))
    assert np.all(errors.value[:, 0] > 0.0)
    assert np.isnan(errors.value[:, 6:]).all()
