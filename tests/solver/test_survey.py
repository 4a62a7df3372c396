"""Surveys of error estimates: what is kept is not solved again, and a planted error is counted as one."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from solver.failures import SolveFailure
from solver.response.solution import solve_many
from solver.verification.estimates import Estimate
from solver.verification.random_scenes import FAMILIES, surface_set
from solver.verification.survey import answers, contrasts
from solver.verification.survey.__main__ import SURVEYS, main, rows
from solver.verification.survey.statistics import shares
from solver.verification.truth import NUMBERS


def estimate(value, error, doubt=0.0, tolerance=0.01):
    return Estimate("small", "random 7", NUMBERS[0], tolerance, 900, value, error, doubt)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_draws_the_same_scene_for_the_same_number_and_another_for_another(family):
    draw = FAMILIES[family]
    assert draw(3, "finite") == draw(3, "finite")
    assert draw(3, "finite") != draw(4, "finite")


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_the_surfaces_of_a_set_differ_in_friction_alone(kinematics):
    one, *others = surface_set(5, kinematics)
    assert len({scene.friction for scene in (one, *others)}) == 3
    assert {replace(scene, friction=one.friction) for scene in others} == {one}


def test_an_estimate_below_the_true_error_is_counted_and_named_as_the_worst():
    (line,) = shares([estimate(0.02, 0.01), estimate(0.001, 0.004), estimate(0.001, 0.004, doubt=0.002)])
    assert "above 1 of 2" in line
    assert "worst 4.00: 0.4 % estimated at 0.1 % in random 7" in line


def test_a_common_error_of_all_surfaces_falls_out_of_their_differences():
    true = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 3.5], [3.0, 6.0, 4.0]])
    assert contrasts.errors(true + 0.3, np.array([true, true, true])) == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)


def test_a_difference_that_is_off_is_told_by_the_range_and_not_where_the_truth_is_in_doubt():
    true = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 3.5], [3.0, 6.0, 4.0]])
    found, doubtful = true.copy(), true.copy()
    found[0, 0] += 0.2
    doubtful[0, 2] += 0.1
    off = contrasts.errors(found, np.array([true, true, doubtful]))
    assert off[:2] == pytest.approx([0.1, 0.0], abs=1e-15)
    assert np.isnan(off[2])


def test_a_survey_of_answers_holds_every_estimate_of_the_program_against_fine_meshes():
    row = answers.solve("published", 0, "small")
    (answer,) = solve_many([FAMILIES["published"](0, "small")])
    assert not isinstance(answer, SolveFailure)
    assert row.estimates[0].estimate == answer.error_estimate
    assert len(row.estimates) == 9
    assert all(one.above for one in row.estimates)


def test_what_a_file_keeps_is_not_solved_again(tmp_path, monkeypatch, capsys):
    keep = tmp_path / "kept.json"
    first = contrasts.Row("published", 0, "small", refusal="There is none.")
    survey = replace(SURVEYS["contrasts"], solve=lambda *_: first)
    assert list(rows(survey, [("published", 0, "small")], keep)) == [first]
    monkeypatch.setattr(sys, "argv", ["survey", "contrasts", "--scenes", "1", "--keep", str(keep)])
    main()
    assert capsys.readouterr().out == "set 0: There is none.\n"


def test_a_family_of_finite_strain_is_refused_at_small_strain_with_a_sentence(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["survey", "answers", "--family", "stiff"])
    with pytest.raises(SystemExit):
        main()
    assert "add --kinematics finite" in capsys.readouterr().err
