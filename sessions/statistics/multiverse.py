"""A multiverse: one recording analysed along many paths, all combinations of reasonable choices.

A study's conclusion should not depend on a choice that others would make differently (Steegen, Tuerlinckx, Gelman and
Vanpaemel 2016, Perspect. Psychol. Sci. 11:702). Friction is computed along each path, and contact is solved for each
friction, without interpolation.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Annotated

import numpy as np

from sessions.prediction import QUANTITIES, SED, Friction, Nearby, Prediction, Quantity, Scene, SessionPrediction
from sessions.prediction.options import Kinematics
from sessions.prediction.scenes import Progress, part_of, scenes_of, settled_predictions, slides
from sessions.recording import Recording
from sessions.statistics.correlations import pearson
from sessions.statistics.scores import by_key, surface_means
from sessions.statistics.within_subjects import repeated_correlation
from sessions.strokes import Analysis, FrictionParameters, analyse
from sessions.strokes.settings import AnalysisSettings, FilterSettings, Pair, SteadySettings, WindowRule
from sessions.strokes.stroke import FIXED, HERTZ_EXPONENT, AreaLaw, Meaning, Rule

Values = tuple[float | None, ...]  # of one quantity along each of `PATHS`, or only those at small strain

# The usual value of each choice comes first.
FILTERS: Mapping[str, float] = {"20 Hz": 20.0, "none": math.inf}
WINDOWS: Mapping[str, WindowRule] = {
    "least variance, widened": "widened",
    "least variance, half the slide": "least variance",
    "middle half of the slide": "middle half",
    "whole slide": "whole slide",
}
MUS: tuple[Rule, ...] = ("mean over steady window", "maximum")  # the usual one is the paper's for the descriptor
_AREAS: Mapping[str, tuple[AreaLaw, float]] = {  # law of the contact area, and its share of the planned one [-]
    "planned": (FIXED, 1.0),
    "half": (FIXED, 0.5),
    "twice": (FIXED, 2.0),
    "grows as N^2/3": (AreaLaw("hertz", HERTZ_EXPONENT), 1.0),
}
RECEPTORS = ("ending", "its middle")
SAME = 0.005  # correlations that differ by less are one result: pages print two decimals


@dataclass(frozen=True, slots=True)
class Path:
    """One combination of choices."""

    filter: str
    window: str
    mu: Rule
    area: str
    receptor: str
    kinematics: Kinematics

    def usual(self, rule: str, kinematics: str, law: AreaLaw = FIXED) -> bool:
        """Say whether this is the path of all other results, with mu by `rule` and tau_max by `law`."""
        usual = (next(iter(FILTERS)), next(iter(WINDOWS)), RECEPTORS[0], (law, 1.0))
        choices = (self.filter, self.window, self.receptor, _AREAS[self.area])
        return choices == usual and self.mu == rule and self.kinematics == kinematics


CHOICE_LABELS: Mapping[str, str] = {  # of the fields of a path
    "filter": "cut-off of the forces' filter",
    "window": "steady window",
    "mu": "µ of the model",
    "area": "contact area",
    "receptor": "response at the receptor",
    "kinematics": "strain of the model",
}

_FIRST = (next(iter(FILTERS)), next(iter(WINDOWS)), next(iter(_AREAS)))
_SMALL = tuple(Path(*choice, "small") for choice in product(FILTERS, WINDOWS, MUS, _AREAS, RECEPTORS))
# Finite strain takes many times as long, so it uses only the usual filter, window and area.
_USUAL = (path for path in _SMALL if (path.filter, path.window, path.area) == _FIRST)
PATHS = (*_SMALL, *(replace(path, kinematics="finite") for path in _USUAL))


def trial_paths(
    recording: Recording,
    prediction: SessionPrediction,
    progress: Progress | None = None,
    *,
    finite: bool = False,
    quantity: Quantity = SED,
) -> Mapping[int, Values]:
    """Return a settled quantity of each trial along each of `PATHS`; None where a path has none.

    `prediction` is the session's: paths start from its solutions, on its mesh. Without `finite` only paths at small
    strain, which come first, are followed. Direction and speed are those of the usual path, since neither is a choice.
    Raises as `predict` does.
    """
    paths = [path for path in PATHS if finite or path.kinematics == "small"]
    analyses = _analyses(recording)
    usual_friction = {friction.trial: friction for friction in next(iter(analyses.values())).friction}
    scenes: dict[Path, Mapping[int, Scene]] = {}  # for both receptors
    for path in paths:
        if path.receptor == RECEPTORS[0]:
            options = replace(prediction.options, course="steady", kinematics=path.kinematics)
            scenes[path] = scenes_of(_path_analysis(analyses, path, usual_friction), recording.plan, options)
    targets = dict.fromkeys(scene for by_trial in scenes.values() for scene in by_trial.values())
    predictions = [row.prediction for row in prediction.trials if row.prediction is not None]
    answers = _solve_scenes(tuple(targets), predictions, quantity, progress)
    trials = sorted({trial for by_trial in scenes.values() for trial in by_trial})

    def value(trial: int, path: Path) -> float | None:
        scene = scenes[replace(path, receptor=RECEPTORS[0])].get(trial)
        answer = None if scene is None else answers.get(scene)
        return None if answer is None else answer[RECEPTORS.index(path.receptor)]

    return {trial: tuple(value(trial, path) for path in paths) for trial in trials}


def _analyses(recording: Recording) -> Mapping[tuple[str, str, AreaLaw], Analysis]:
    """Return the analysis by filter, window and law of the area; laws other than the first for one window only."""
    planned, *laws = dict.fromkeys(law for law, _ in _AREAS.values())
    cases = [*product(FILTERS, WINDOWS, [planned]), *product(FILTERS, list(WINDOWS)[:1], laws)]

    def settings(filter_name: str, window: str, law: AreaLaw) -> AnalysisSettings:
        steady = SteadySettings(steady_rule=WINDOWS[window])
        return AnalysisSettings(filter=FilterSettings(cut_off=FILTERS[filter_name]), steady=steady, area=law)

    return {case: analyse(recording, settings(*case)) for case in cases}


def _path_analysis(
    analyses: Mapping[tuple[str, str, AreaLaw], Analysis],
    path: Path,
    usual: Mapping[int | None, FrictionParameters],
) -> Analysis:
    """Return the analysis with each trial's friction along a path; tau_max does not depend on the window."""
    (law, share), (window, *_) = _AREAS[path.area], WINDOWS
    analysis = analyses[path.filter, path.window, _AREAS[next(iter(_AREAS))][0]]
    bounds = analyses[path.filter, window, law].strokes
    friction: list[FrictionParameters] = []
    for parameters in analysis.friction:
        stroke, bound = analysis.strokes[parameters.stroke], bounds[parameters.stroke].tau_max
        mu = stroke.mu_max if path.mu == "maximum" else stroke.mu_dynamic
        tau_max = None if bound is None else bound / share
        base = usual.get(parameters.trial, parameters)
        friction.append(replace(parameters, mu=mu, tau_max=tau_max, direction=base.direction, speed=base.speed))
    return replace(analysis, friction=tuple(friction))


def _solve_scenes(
    scenes: Sequence[Scene], predictions: Sequence[Prediction], quantity: Quantity, progress: Progress | None
) -> Mapping[Scene, Pair | None]:
    """Return a quantity of each scene, over the ending and at its middle; None without a settled state.

    Scenes that differ only in friction are continued from a known solution on its mesh, or else from the solved scene
    of least friction; where that fails they are solved themselves.
    """
    in_order = sorted(scenes, key=lambda scene: (scene.friction.mu, scene.friction.tau_max or math.inf))
    by_setup = by_key((_setup(scene), scene) for scene in in_order)
    references = {setup: group[0] for setup, group in by_setup.items()}
    solutions = {setup: prediction for prediction in predictions if (setup := _setup(prediction.scene)) in references}
    unsolved = [setup for setup in references if setup not in solutions]
    answers = settled_predictions([references[setup] for setup in unsolved], part_of(progress, 0.0, 0.5))
    solutions |= {setup: answer for setup, answer in zip(unsolved, answers, strict=True) if answer is not None}
    pairs: dict[Scene, Pair | None] = {}
    for setup, slide in zip(solutions, slides(list(solutions.values()), part_of(progress, 0.5, 0.7)), strict=True):
        pairs |= _pairs(slide, by_setup[setup], quantity)
    missing = [scene for scene in scenes if scene not in pairs]
    answers = [answer for answer in settled_predictions(missing, part_of(progress, 0.7, 0.9)) if answer is not None]
    for answer, slide in zip(answers, slides(answers, part_of(progress, 0.9, 1.0)), strict=True):
        pairs |= _pairs(slide, [answer.scene], quantity)
    return pairs


def _pairs(slide: Nearby | None, scenes: Sequence[Scene], quantity: Quantity) -> Mapping[Scene, Pair]:
    """Return a quantity over the ending and at its middle of the scenes reached from a slide."""
    if slide is None:
        return {}
    pairs = slide.responses(scenes)[:, QUANTITIES.index(quantity)].tolist()
    return {scene: (ending, point) for scene, (ending, point) in zip(scenes, pairs, strict=True) if ending == ending}


def _setup(scene: Scene) -> Scene:
    """Return the settled frictionless scene, equal for scenes that differ in friction alone."""
    return replace(scene, friction=Friction(0.0), solve=replace(scene.solve, course="steady"))


@dataclass(frozen=True, slots=True)
class PathFinding:
    """Correlation of a predicted quantity with scores along one path. None with too few numbers."""

    path: Path
    usual: Annotated[bool, Meaning("", "yes for the path of all other results")]
    surfaces: Annotated[int, Meaning("", "with a score and a prediction on this path")]
    trials: Annotated[int, Meaning("", "with a score and a prediction on this path")]
    r: Annotated[float | None, Meaning("", "correlation of the mean prediction of each surface with its mean score")]
    within: Annotated[
        float | None, Meaning("", "repeated-measures correlation of each subject's own scores and predictions")
    ]
    low: Annotated[
        float | None, Meaning("", "lower end of its 95 % jackknife interval, for other subjects on the same surfaces")
    ]
    high: Annotated[float | None, Meaning("", "upper end")]


@dataclass(frozen=True, slots=True)
class PathTrial:
    """One trial's data for the paths."""

    subject: str
    index: int
    score: float | None
    rule: str  # the usual rule of mu
    values: Values


def path_findings(
    trials: Sequence[PathTrial], kinematics: str, law: AreaLaw = FIXED, *, within: bool
) -> tuple[PathFinding, ...]:
    """Return the correlation of predictions with scores along each path, also `within` subjects; () without paths.

    Where trials differ in their rule of mu no path is the usual one.
    """
    path_trials = [trial for trial in trials if trial.values]
    if not path_trials:
        return ()
    rules, path_count = {trial.rule for trial in path_trials}, min(len(trial.values) for trial in path_trials)
    return tuple(
        _finding(n, path, path_trials, usual=all(path.usual(rule, kinematics, law) for rule in rules), within=within)
        for n, path in enumerate(PATHS[:path_count])
    )


def _finding(number: int, path: Path, trials: Sequence[PathTrial], *, usual: bool, within: bool) -> PathFinding:
    values_here = [(trial, trial.values[number], trial.score) for trial in trials]
    points = [(trial, value, score) for trial, value, score in values_here if value is not None and score is not None]
    pairs = [(trial.subject, value, score) for trial, value, score in points]
    values = surface_means([(trial.subject, trial.index, value) for trial, value, _ in points]) or {}
    scores = surface_means([(trial.subject, trial.index, score) for trial, _, score in points]) or {}
    repeated = repeated_correlation(*zip(*pairs, strict=True)) if within and pairs else None
    low, high = (None, None) if repeated is None or repeated.people is None else repeated.people
    return PathFinding(
        path=path,
        usual=usual,
        surfaces=len({trial.index for trial, _, _ in points}),
        trials=len(points),
        r=pearson(list(values.values()), list(scores.values())),
        within=None if repeated is None else repeated.r,
        low=low,
        high=high,
    )


@dataclass(frozen=True, slots=True)
class FiveNumberSummary:
    """Extremes, quartiles and median of the correlations of some paths."""

    correlated: int  # paths with a correlation; the numbers below describe these
    distinct: int  # number of these that differ by more than `SAME`
    least: float
    lower: float  # quartile
    median: float
    upper: float  # quartile
    greatest: float


def correlations(findings: Iterable[PathFinding]) -> list[float | None]:
    """Return the correlation of each path: within subjects if any path has one, else of the means."""
    paths = list(findings)
    within = any(finding.within is not None for finding in paths)
    return [finding.within if within else finding.r for finding in paths]


def five_number_summary(values: Sequence[float | None]) -> FiveNumberSummary | None:
    """Return the five-number summary of correlations; None without any.

    >>> summary = five_number_summary([0.5, None, 0.7, 0.701])
    >>> summary.median, summary.correlated, summary.distinct
    (0.7, 3, 2)
    """
    numbers = sorted(value for value in values if value is not None)
    if not numbers:
        return None
    least, lower, median, upper, greatest = np.quantile(numbers, [0.0, 0.25, 0.5, 0.75, 1.0]).tolist()
    distinct = numbers[:1]
    for value in numbers:
        if value - distinct[-1] > SAME:
            distinct.append(value)
    return FiveNumberSummary(len(numbers), len(distinct), least, lower, median, upper, greatest)


def by_choice(findings: Sequence[PathFinding]) -> tuple[tuple[str, str, FiveNumberSummary | None, bool], ...]:
    """Return each choice's values with the five-number summary over their paths, and whether each is usual.

    Very different medians within a choice show that the choice matters.
    """
    values = correlations(findings)
    rows: list[tuple[str, str, FiveNumberSummary | None, bool]] = []
    for choice in CHOICE_LABELS:
        usual = {getattr(finding.path, choice) for finding in findings if finding.usual}
        for name in dict.fromkeys(getattr(finding.path, choice) for finding in findings):
            subset = [r for finding, r in zip(findings, values, strict=True) if getattr(finding.path, choice) == name]
            rows.append((choice, name, five_number_summary(subset), name in usual))
    return tuple(rows)
