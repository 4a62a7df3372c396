"""Sobol indices of a scene: against closed forms with a stand-in for the solver, and once with the solver itself."""

import json
from dataclasses import replace
from itertools import product
from operator import attrgetter

import pytest

from daq_app.batch.sensitivity import (
    Index,
    TooFewAnswers,
    check_design,
    constant_numbers,
    doubts,
    sensitivity,
    usual_design,
    with_values,
)
from daq_app.cli.main import run
from sessions.toml_file import SettingsError
from solver import Friction, Loading, NotConverged, Scene

SCENE = Scene(friction=Friction(0.4, 0.02), loading=Loading(1.0))
DESIGN = {"friction.mu": (0.2, 0.6), "loading.indentation": (0.5, 1.5)}


def quiet(_):
    return None


def test_of_a_sum_each_index_is_its_share_of_the_variance():
    # y = 3 mu + 2 d, uniform over 0.4 and 1: variances 9 * 0.16 / 12 and 4 / 12.
    indices, _ = sensitivity(
        SCENE, DESIGN, 1024, 0, quiet, lambda s: 3.0 * s.friction.mu + 2.0 * (s.loading.indentation or 0.0)
    )
    by_name = {index.name: index for index in indices}
    share = 9 * 0.16 / (9 * 0.16 + 4)
    assert [index.name for index in indices] == ["loading.indentation", "friction.mu"]
    assert by_name["friction.mu"].first == pytest.approx(share, abs=0.02)
    assert by_name["friction.mu"].total == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize("seed", [0, 3])
def test_one_seed_gives_one_answer_intervals_included(seed):
    first, second = (
        sensitivity(SCENE, DESIGN, 16, seed, quiet, lambda s: s.friction.mu + (s.loading.indentation or 0.0))[0]
        for _ in range(2)
    )
    assert first == second


def test_of_a_product_about_zero_nothing_acts_alone():
    middle = {"friction.mu": 0.4, "loading.indentation": 1.0}
    indices, _ = sensitivity(
        SCENE,
        DESIGN,
        1024,
        0,
        quiet,
        lambda s: (s.friction.mu - middle["friction.mu"]) * ((s.loading.indentation or 0.0) - 1.0),
    )
    assert all(abs(index.first) < 0.05 and index.total == pytest.approx(1.0, abs=0.05) for index in indices)


def test_a_range_to_one_side_and_an_impossible_share_are_named_with_the_samples_that_would_do():
    design = {"friction.mu": (0.4, 0.6), "loading.indentation": (0.5, 1.5)}
    sound, noisy = Index("a", 0, 1, 0.6, 0.1, 0.7, 0.1, False), Index("b", 0, 1, 0.4, 0.2, 0.3, 0.1, False)
    assert doubts([sound], 16) == ()
    (sentence,) = doubts([sound, noisy], 16)
    assert "b (" in sentence
    assert "about 256 would" in sentence  # a half interval of 0.2 is to become 0.05: sixteen times as many
    for wrong in (replace(sound, total=1.1), replace(sound, first=-0.1)):
        assert "a (" in doubts([wrong], 16)[0]
    indices, _ = sensitivity(SCENE, design, 64, 0, quiet, lambda s: s.friction.mu + (s.loading.indentation or 0.0))
    assert {index.name for index in indices if index.one_sided} == {"friction.mu"}
    assert "friction.mu" in doubts(indices, 64)[0]


def test_every_corner_of_the_usual_design_is_a_scene_that_may_be():
    design = usual_design(SCENE)
    for corner in product(*design.values()):
        with_values(SCENE, dict(zip(design, corner, strict=True)))
    for name, (low, high) in design.items():
        assert low <= attrgetter(name)(SCENE) <= high
        assert low < high


def test_what_a_design_leaves_as_it_is_is_named():
    usual = set(constant_numbers(SCENE, usual_design(SCENE)))
    assert {"finger.bone_centre", "finger.shaft_length", "materials.dermis.nu", "materials.epidermis.nu"} == usual
    assert "materials.fat.nu" in constant_numbers(SCENE, DESIGN)
    assert "friction.mu" not in constant_numbers(SCENE, DESIGN)


def test_values_reach_their_places_and_no_others():
    other = with_values(SCENE, {"friction.mu": 0.3, "materials.fat.E": 0.05})
    assert (other.friction.mu, other.friction.tau_max, other.materials.fat.E) == (0.3, 0.02, 0.05)
    assert other.finger == SCENE.finger


def test_a_scene_without_a_bound_varies_none():
    assert "friction.tau_max" in usual_design(SCENE)
    assert "friction.tau_max" not in usual_design(Scene(friction=Friction(0.4), loading=Loading(1.0)))


def test_what_cannot_be_varied_is_named():
    for wrong, what in (
        ({"finger.toe": [1, 2]}, "finger.toe"),
        ({"friction.mu": [0.5, 0.5]}, "friction.mu"),
        ({"friction.mu": [0.5, 10**400]}, r"friction.mu = \[0.5, 1000"),
        ({"friction.mu": [-1.0, 0.5]}, "design.toml: friction.mu = -1.0 is not allowed"),
        ({"finger.tip_radius": [4.0, 6.0]}, "design.toml: with finger.tip_radius = 4, finger.bone_centre = "),
    ):
        with pytest.raises(SettingsError, match=what):
            check_design(wrong, SCENE, "design.toml")


def test_scenes_without_an_answer_are_counted():
    def none(_):
        raise NotConverged("no")

    with pytest.raises(TooFewAnswers, match="8 of 8 scenes"):
        sensitivity(SCENE, DESIGN, 2, 0, quiet, none)


def test_the_solver_is_more_moved_by_depth_than_by_a_little_friction(tmp_path, capsys):
    scene, design = tmp_path / "scene.toml", tmp_path / "design.toml"
    scene.write_text("[friction]\nmu = 0.3\ntau_max = 0.02\n[loading]\nindentation = 1.0\nslide = '+x'\n")
    design.write_text("'friction.mu' = [0.29, 0.31]\n'loading.indentation' = [0.8, 1.2]\n")
    assert run(["sensitivity", str(scene), "--design", str(design), "--samples", "4", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["indices"][0]["name"] == "loading.indentation"
    assert document["design_origin"] == "set"
    assert run(["sensitivity", str(scene), "--samples", "5"]) == 2
    for words in (["--samples", "0"], ["--keep", "answers"], ["--quantity", "pressure"], ["--workers", "1"]):
        assert run(["sensitivity", str(scene), *words]) == 2
        assert f"{words[0]} " in capsys.readouterr().err
