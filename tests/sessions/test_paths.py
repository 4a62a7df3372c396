"""Many paths of the analysis: each is what it says, solves are shared without a change, the distribution is counted."""

from dataclasses import replace

import pytest
from report_session import record

from sessions.prediction import BY_NAME, PredictionOptions, predict
from sessions.prediction.scenes import scenes_of, settled_predictions
from sessions.recording import Recording
from sessions.statistics.multiverse import (
    PATHS,
    RECEPTORS,
    WINDOWS,
    PathTrial,
    by_choice,
    correlations,
    five_number_summary,
    path_findings,
    trial_paths,
)
from sessions.strokes import AnalysisSettings, analyse
from sessions.strokes.settings import SteadySettings

STEADY = PredictionOptions(course="steady")
SMALL = [path for path in PATHS if path.kinematics == "small"]


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder, _ = record(tmp_path_factory.mktemp("paths") / "P01", per_block=1)
    return Recording.open(folder)


@pytest.fixture(scope="module")
def analysis(recording):
    return analyse(recording)


@pytest.fixture(scope="module")
def prediction(recording, analysis):
    return predict(analysis, recording.plan, STEADY)


@pytest.fixture(scope="module")
def seds_along(recording, prediction):
    return trial_paths(recording, prediction)


def test_the_usual_path_comes_to_what_is_predicted_without_any_others(prediction, seds_along):
    for row in prediction.trials:
        (usual,) = [n for n, path in enumerate(SMALL) if path.usual(row.mu_rule, "small")]
        assert seds_along[row.trial][usual] == pytest.approx(row.sed, rel=1e-9)


def test_a_path_that_shared_its_solve_comes_to_what_its_own_solve_gives(recording, analysis, seds_along):
    trial = 1
    scene = scenes_of(analysis, recording.plan, STEADY)[trial]
    mu = scene.friction.mu
    areas = {"planned": 1.0, "half": 0.5, "twice": 2.0}
    alone = settled_predictions([replace(scene, friction=replace(scene.friction, tau_max=scene.friction.tau_max / a))
                     for a in areas.values()])  # fmt: skip
    (first,) = {path.filter for path in SMALL[:1]}
    for area, answer in zip(areas, alone, strict=True):
        for receptor, value in zip(RECEPTORS, (answer.sed_ending, answer.sed_point), strict=True):
            (n,) = [
                n
                for n, path in enumerate(SMALL)
                if (path.filter, path.window, path.mu) == (first, SMALL[0].window, "maximum")
                and (path.area, path.receptor) == (area, receptor)
            ]
            assert seds_along[trial][n] == pytest.approx(value, rel=1e-9), (mu, area)


def test_each_window_has_the_sed_of_the_mean_over_that_window(recording, analysis, seds_along):
    (deepest, scene), trial = scenes_of(analysis, recording.plan, STEADY).values(), 2  # slipperiness: the mean
    mus = [
        next(
            stroke.mu_dynamic
            for stroke in analyse(recording, AnalysisSettings(steady=SteadySettings(steady_rule=rule))).strokes
            if stroke.trial == 2
        )
        for rule in WINDOWS.values()
    ]
    assert len(set(mus)) > 2  # the whole of this slide is steady
    alone = settled_predictions([deepest, *(replace(scene, friction=replace(scene.friction, mu=mu)) for mu in mus)])[1:]
    for window, answer in zip(WINDOWS, alone, strict=True):
        (n,) = [n for n, path in enumerate(SMALL) if path == replace(SMALL[0], window=window)]
        assert seds_along[trial][n] == pytest.approx(answer.sed_ending, rel=1e-9)


def test_paths_of_another_quantity_come_to_what_the_model_predicts_of_it(recording, prediction):
    quantity = BY_NAME["shear_along_skin"]
    sheared = trial_paths(recording, prediction, quantity=quantity)
    for row in prediction.trials:
        (usual,) = [n for n, path in enumerate(SMALL) if path.usual(row.mu_rule, "small")]
        assert sheared[row.trial][usual] == pytest.approx(row.responses[quantity.name].value, rel=1e-9)


def test_finite_strain_is_left_out_unless_it_is_asked_for(seds_along):
    assert {len(seds) for seds in seds_along.values()} == {len(SMALL)}
    assert len(PATHS) > len(SMALL)


def turning_paths():
    """Three subjects, four surfaces: SED goes with the score, but at the ending's middle it goes against it."""
    trials = []
    for subject in ("A", "B", "C"):
        for index in (0, 20, 50, 100):
            ending, middle = 8.0 + 0.01 * index, 9.0 - 0.01 * index
            seds = tuple(ending if path.receptor == "ending" else middle for path in SMALL)
            trials.append(PathTrial(subject, index, float(index), "maximum", seds))
    return path_findings(trials, "small", within=True)


def test_the_choice_that_turns_the_correlation_is_seen_and_the_others_are_not():
    medians = {(choice, name): of.median for choice, name, of, _ in by_choice(turning_paths())}
    assert medians["receptor", "ending"] == pytest.approx(1.0)
    assert medians["receptor", "its middle"] == pytest.approx(-1.0)
    assert all(abs(m) < 1e-9 for (choice, _), m in medians.items() if choice not in ("receptor",))


def test_one_path_is_the_usual_one_and_the_distribution_counts_them_all():
    findings = turning_paths()
    (usual,) = [finding for finding in findings if finding.usual]
    assert usual.path.mu == "maximum"
    assert usual.r == pytest.approx(1.0)
    whole = five_number_summary(correlations(findings))
    assert (whole.correlated, whole.least, whole.greatest) == (len(SMALL), -1.0, 1.0)
    assert whole.distinct == 2  # of so many paths, one result for each receptor


def test_trials_of_two_rules_of_mu_have_no_usual_path():
    """A path takes one rule for all: strokes both ways, each by its own rule, are on none of them."""
    rules = ("maximum", "mean over steady window")
    trials = [PathTrial("A", n, float(n), rules[n % 2], tuple(8.0 + n for _ in SMALL)) for n in range(4)]
    assert not [finding for finding in path_findings(trials, "small", within=False) if finding.usual]


def test_a_path_that_leaves_too_few_surfaces_gives_no_correlation_and_is_counted():
    trials = [PathTrial("A", i, float(i), "maximum", (8.0 + i, *(None for _ in SMALL[1:]))) for i in (0, 20, 50)]
    findings = path_findings(trials, "small", within=False)
    assert [finding.surfaces for finding in findings[:2]] == [3, 0]
    assert five_number_summary(correlations(findings)).correlated == 1
