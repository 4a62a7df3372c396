"""Surveys of error estimates: stored answers are not solved again, and each injected error counts."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from solver.failures import SolveFailure
from solver.response.solution import solve_many
from solver.verification.estimates import Estimate
from solver.verification.random_scenes import FAMILIES, random_scene, surface_set
from solver.verification.survey import HEADER, TOLERANCES, Row, apart, judgement, main, misses, rows, solve
from solver.verification.truth import TRUE_NUMBERS


def estimate(value, error, doubt=0.0, tolerance=0.01, **corrected):
    return Estimate("small", "axis 7", TRUE_NUMBERS[0], tolerance, 900, value, error, doubt, **corrected)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_draws_the_same_scene_for_the_same_number_and_another_for_another(family):
    assert random_scene(family, 3, "finite") == random_scene(family, 3, "finite")
    assert random_scene(family, 3, "finite") != random_scene(family, 4, "finite")


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_the_surfaces_of_a_set_differ_in_friction_alone(kinematics):
    first, *rest = surface_set(5, kinematics)
    assert len({scene.friction for scene in (first, *rest)}) == 3
    assert {replace(scene, friction=first.friction) for scene in rest} == {first}


def cells(*rows):
    return dict(zip(HEADER, judgement("axis", "small", rows), strict=True))


def test_an_estimate_below_the_true_error_is_counted_and_named_and_one_in_doubt_is_not():
    rows = [estimate(0.02, 0.01), estimate(0.001, 0.004), estimate(0.001, 0.004, doubt=0.002)]
    assert cells(*rows)["SED above"] == "50 %"
    assert list(misses(rows)) == ["axis 7, small strain, 1 %: error of the SED of the ending 0.004, estimate 0.001"]


def test_a_tolerance_that_is_said_to_be_met_and_is_not_counts_as_missed_unsaid():
    assert cells(estimate(0.009, 0.02), estimate(0.009, 0.003), estimate(0.02, 0.03))["missed unsaid"] == "1 of 2"
    assert cells(estimate(0.009, 0.02, warned=True), estimate(0.009, 0.003))["missed unsaid"] == "0 of 2"


def test_ratio_and_rank_are_those_of_estimates_by_errors():
    row = cells(estimate(0.02, 0.01), estimate(0.03, 0.02), estimate(0.12, 0.03))
    assert (row["ratio"], row["rank"]) == ("2.0", "1.00")
    assert cells(estimate(0.02, 0.01), estimate(0.03, 0.005), estimate(0.04, 0.001))["rank"] == "-1.00"


def test_a_corrected_value_counts_by_its_side_and_by_its_error():
    row = cells(
        estimate(0.02, 0.01, corrected=0.002, towards=True), estimate(0.02, 0.01, corrected=0.02, towards=False)
    )
    assert (row["sign"], row["corrected"]) == ("50 %", "1.10")


TRUTH = np.array([1.0, 2.0, 3.0])


def test_a_common_error_of_all_surfaces_falls_out_of_their_differences():
    assert apart(TRUTH + 0.3, np.array([TRUTH, TRUTH, TRUTH])) == pytest.approx((0.0, 0.0), abs=1e-15)


def test_a_difference_that_is_off_is_reported_by_the_range_and_so_is_the_doubt_of_the_truth():
    first = np.array([1.0, 0.0, 0.0])
    doubtful = TRUTH + 0.3 * first
    error, doubt = apart(TRUTH + 0.2 * first, np.array([TRUTH, TRUTH, doubtful]))
    assert error == pytest.approx(0.1 / 1.9, rel=1e-12)
    assert doubt == pytest.approx(0.2 / 1.9, rel=1e-12)


def test_a_survey_of_answers_holds_every_estimate_of_the_program_against_fine_meshes():
    row = solve("axis", 0, "small")
    (prediction,) = solve_many([random_scene("axis", 0, "small")])
    assert not isinstance(prediction, SolveFailure)
    sed, corrected, normal, drag, *receptors = [entry for entry in row.estimates if entry.tolerance == TOLERANCES[1]]
    assert (sed.estimate, corrected.estimate) == (prediction.error_estimate, prediction.corrected_error)
    assert all(entry.above for entry in (sed, corrected, normal, drag))
    error = prediction.row.error
    assert [entry.estimate for entry in receptors] == error[np.isfinite(error)].tolist()
    assert np.mean([entry.above for entry in receptors if entry.above is not None]) >= 0.97


def test_what_a_file_keeps_is_not_solved_again_and_stands_in_the_page(tmp_path, monkeypatch, capsys):
    keep, page = tmp_path / "kept.json", tmp_path / "page.md"
    entry = "| axis | finite | 9 | 90 % |"
    page.write_text(f"Before.\n<!-- judged: begin -->\n| axis | small | 0 |\n{entry}\n<!-- judged: end -->\nAfter.\n")
    first = Row("axis", 0, "small", (estimate(0.02, 0.01),))
    monkeypatch.setattr("solver.verification.survey.solve", lambda *_: first)
    assert list(rows([("axis", 0, "small")], keep)) == [first]
    monkeypatch.setattr(sys, "argv", ["survey", "--scenes", "1", "--keep", str(keep), "--page", str(page)])
    main()
    line = "| axis | small | 1 | 100 % |"
    assert line in capsys.readouterr().out
    lines = [row for row in page.read_text().splitlines() if row.startswith("| axis")]
    assert lines[0].startswith(line)
    assert lines[1:] == [entry]
    assert page.read_text().endswith("After.\n")
