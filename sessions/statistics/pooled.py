"""The findings of all visits of a study: means, agreement, and how scores correlate with predictions."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from sessions.prediction import SED, Quantity
from sessions.statistics import scales, within_subjects
from sessions.statistics.correlations import Relation, relation
from sessions.statistics.findings import (
    CARRY_OVER,
    DRIFT,
    FRICTION,
    INDEX,
    ConstantStimuli,
    DescriptorFindings,
    Estimates,
    NormalisedScores,
    StudyFindings,
    SurfaceMean,
    effect_recoveries,
    flaw_detections,
    friction_recovery,
)
from sessions.statistics.mixed_model import MixedModel, Spread, mixed_model, spreads
from sessions.statistics.multiverse import PathTrial, path_findings
from sessions.statistics.psychometric import Psychometric, function_of
from sessions.statistics.rivals import RESPONSES, STROKE_FIELDS, RivalTrial, rivals_of_surfaces, rivals_within
from sessions.statistics.scores import (
    Average,
    IntervalEstimate,
    ScoreTable,
    average,
    by_key,
    mean_scores,
    reversed_subjects,
    score_matrix,
    surface_means,
)
from sessions.statistics.visit import STILL_BLINDED, Exclusion, TrialRow, Visit, VisitOptions, exclusion_of, scores_of

Trials = Sequence[tuple[Visit, TrialRow]]
Points = Sequence[tuple[str, int, float, float]]  # subject, index, response to its own stroke, score


def pool_visits(
    visits: Sequence[Visit],
    failed: Sequence[tuple[str, str]] = (),
    exclusions: tuple[Exclusion, ...] = (),
    ground_truth: Mapping[str, Any] | None = None,
    options: VisitOptions | None = None,
    quantity: Quantity = SED,
) -> StudyFindings:
    """Return the pooled findings of all visits, sorted by name.

    `options` are those of each visit; `quantity` is the model's response that is compared with scores. `ground_truth`
    of a synthetic study is used for the comparison only.
    """
    in_order = tuple(sorted(visits, key=lambda visit: visit.session))
    same_content = by_key((visit.content_sha256, visit.session) for visit in in_order if visit.content_sha256)
    copies = {session: original for original, *repeats in same_content.values() for session in repeats}
    included = [
        (visit, [row for row in visit.rows if exclusion_of(exclusions, visit.subject, row.descriptor) is None])
        for visit in in_order
        if visit.session not in copies
    ]
    tables = [scores_of(visit, rows) for visit, rows in included]
    trials = by_key((row.descriptor, (visit, row)) for visit, rows in included for row in rows)
    options = options or VisitOptions()
    descriptors = _with_holm([_descriptor(name, options, quantity, tables, trials[name]) for name in trials])
    simulated = sum(bool(visit.simulated) for visit in in_order)
    sentence = f"SIMULATED: {simulated} of the {len(in_order)} sessions of this study are simulated"
    return StudyFindings(
        simulated=sentence if simulated else "",
        options=options,
        visits=in_order,
        failed=tuple(sorted(failure for failure in failed if failure[1] != STILL_BLINDED)),
        blinded=tuple(sorted(session for session, reason in failed if reason == STILL_BLINDED)),
        copies=tuple((visit.session, copies[visit.session]) for visit in in_order if visit.session in copies),
        excluded=exclusions,
        reversed=reversed_subjects(tables),
        descriptors=descriptors,
        effects=() if ground_truth is None else effect_recoveries(descriptors, ground_truth),
        friction=None if ground_truth is None else friction_recovery(in_order, ground_truth["strokes"]),
        flaws=() if ground_truth is None else flaw_detections(in_order, dict(failed), ground_truth.get("spoilt", {})),
        synthetic=None if ground_truth is None else ground_truth.get("seed"),
        response=quantity.name,
    )


def _with_holm(descriptors: Sequence[DescriptorFindings]) -> tuple[DescriptorFindings, ...]:
    within = {findings.descriptor: findings.repeated for findings in descriptors if findings.repeated is not None}
    p_values = {name: repeated.people_p for name, repeated in within.items() if repeated.people_p is not None}
    adjusted = dict(zip(p_values, within_subjects.holm(list(p_values.values())), strict=True))
    return tuple(replace(findings, repeated_holm=adjusted.get(findings.descriptor)) for findings in descriptors)


def _descriptor(
    name: str, options: VisitOptions, quantity: Quantity, tables: Sequence[ScoreTable], trials: Trials
) -> DescriptorFindings:
    by_index = by_key((row.index, (visit, row)) for visit, row in trials)
    indices = tuple(sorted(by_index))
    matrix = score_matrix(tables, name)
    rows = [(visit.subject, row, row.response(quantity.name), row.score) for visit, row in trials]
    score_rows = [(subject, row, score) for subject, row, _, score in rows if score is not None]
    points = [(subject, row, x, score) for subject, row, x, score in rows if x is not None and score is not None]
    number_points = tuple((subject, row.index, x, score) for subject, row, x, score in points)
    possible = [(subject, row.index, x, score) for subject, row, x, score in points if not row.doubt]
    pairs = choices(trials)
    paired = tuple(scales.paired_scale(pairs, model) for model in scales.MODELS) if pairs else ()
    comparisons = constant_stimuli(trials)
    rival_trials = [
        RivalTrial(subject, row.index, score, rival_values(row), row.block) for subject, row, _, score in points
    ]
    return DescriptorFindings(
        descriptor=name,
        indices=indices,
        scores=tuple(mean for mean in mean_scores(tables) if mean.descriptor == name),
        within=within_subjects.within_means(matrix),
        agreement=within_subjects.agreement(matrix),
        surfaces=tuple(_surface(index, quantity.name, by_index[index]) for index in indices),
        answers={subject: tuple(row.get(index) for index in indices) for subject, row in matrix.items()},
        points=number_points,
        point_blocks=tuple(row.block for _, row, _, _ in points),
        mean_relation=_relation(number_points),
        repeated=_correlation_within(number_points),
        repeated_possible=_correlation_within(possible),
        repeated_in_blocks=_within_blocks(points),
        repeated_holm=None,
        rivals=rivals_within(rival_trials, quantity.label),
        rivals_of_means=rivals_of_surfaces(rival_trials, quantity.label),
        without_subject=_without_subject(number_points),
        normalised=_normalise(within_subjects.z_scores(matrix), number_points),
        differences=within_subjects.differences(matrix),
        estimates=estimates(trials, quantity.name),
        exponent=exponent(trials),
        scales=paired,
        consistence=scales.consistence(pairs),
        on_response=_model(
            [(subject, row, score) for subject, row, _, score in points], quantity, response_term(quantity)
        ),
        on_index=_model(score_rows, quantity, INDEX),
        on_friction=_model([trial for trial in score_rows if trial[1].mu is not None], quantity, INDEX, FRICTION),
        fingers=_fingers([(visit.subject, row.index, row.mu) for visit, row in trials if row.mu is not None]),
        paths=path_findings(
            [PathTrial(visit.subject, row.index, row.score, row.rule, row.paths) for visit, row in trials],
            options.prediction.kinematics,
            options.area,
            within=True,
        ),
        doubtful=len(points) - len(possible),
        constant_stimuli=comparisons,
        latent=latent_scales(trials, paired, comparisons),
    )


def rival_values(row: TrialRow) -> dict[str, float]:
    """Return the quantities of a trial that its score may follow, by their names in `rivals.RIVAL_NAMES`."""
    numbers = {name: getattr(row, attribute) for name, attribute in STROKE_FIELDS.items()}
    numbers |= {label: row.response(name) for label, name in RESPONSES.items()}
    return {name: value for name, value in numbers.items() if value is not None}


def response_term(quantity: Quantity) -> str:
    """Return the name of a quantity in mixed models, with its shown unit.

    >>> response_term(SED)
    'SED [kPa]'
    """
    return f"{quantity.label} [{quantity.shown_unit[0]}]"


def _model(trials: Sequence[tuple[str, TrialRow, float]], quantity: Quantity, *terms: str) -> MixedModel | str:
    """Return the mixed model of scores on `terms`, drift and carry-over, or the reason for its absence.

    Trials are subject, row and score. Slopes on the first of `terms` vary between subjects.
    """
    count = len({subject for subject, _, _ in trials})
    if count < 3:
        requirement = f"scores and a predicted {quantity.label}"
        if INDEX in terms:
            requirement = "scores and a µ of their own" if FRICTION in terms else "scores"
        count_text = "there is 1" if count == 1 else f"there are {count or 'none'}"
        return f"it takes three subjects with {requirement}, and {count_text}"
    subjects, rows, scores = zip(*trials, strict=True)
    columns = {
        INDEX: [row.index - 50.0 for row in rows],
        response_term(quantity): [quantity.shown_unit[1] * (row.response(quantity.name) or 0.0) for row in rows],
        FRICTION: [row.mu or 0.0 for row in rows],
        DRIFT: [float(row.place) for row in rows],
        CARRY_OVER: [0.0 if row.before is None else row.before - 50.0 for row in rows],
    }
    order = [name for name in (DRIFT, CARRY_OVER) if np.ptp(columns[name]) > 0.0]
    return mixed_model(subjects, scores, {name: columns[name] for name in (*terms, *order)})


def _fingers(trials: Sequence[tuple[str, int, float]]) -> Spread | None:
    """Return the spread of log friction between subjects; trials are subject, index and mu."""
    indices = sorted({index for _, index, _ in trials})
    surfaces = [[float(index == surface) for _, index, _ in trials] for surface in indices[1:]]
    variances = spreads([subject for subject, _, _ in trials], [math.log(mu) for _, _, mu in trials], surfaces)
    return None if variances is None else variances.level


def _surface(index: int, quantity: str, trials: Trials) -> SurfaceMean:
    """Return means over subjects, each subject's repeats averaged first."""

    def over_subjects(value: Callable[[TrialRow], float | None]) -> Average | None:
        by_subject = by_key((visit.subject, number) for visit, row in trials if (number := value(row)) is not None)
        return average([float(np.mean(values)) for values in by_subject.values()])

    response = over_subjects(lambda row: row.response(quantity))
    names = ("mu", "normal_force", "model_normal_force", "matching_depth")
    mu, normal, model, depth = (over_subjects(attrgetter(name)) for name in names)
    return SurfaceMean(index, 0 if response is None else response.n, mu, response, normal, model, depth)


def _relation(points: Points) -> Relation | None:
    """Return the relation of mean scores to mean responses."""
    responses = surface_means([(subject, index, x) for subject, index, x, _ in points])
    scores = surface_means([(subject, index, score) for subject, index, _, score in points])
    if responses is None or scores is None:
        return None
    return relation(list(responses.values()), list(scores.values()), list(responses))


def _correlation_within(points: Sequence[tuple[str, int, float, float]]) -> within_subjects.RepeatedCorrelation | None:
    """Return the correlation of scores with responses within subjects."""
    subjects, _, responses, scores = zip(*points, strict=True) if points else ((), (), (), ())
    return within_subjects.repeated_correlation(subjects, responses, scores)


def _within_blocks(points: Sequence[tuple[str, TrialRow, float, float]]) -> within_subjects.RepeatedCorrelation | None:
    """Return the correlation within the blocks of each subject; None where each has a single one."""
    blocks = {(subject, row.block) for subject, row, _, _ in points}
    if len(blocks) == len({subject for subject, _ in blocks}):
        return None
    subjects, rows, responses, scores = zip(*points, strict=True)
    return within_subjects.repeated_correlation(subjects, responses, scores, [row.block for row in rows])


def _without_subject(points: Points) -> tuple[tuple[str, float], ...]:
    """Return the correlation within subjects when each subject in turn is left out."""
    subjects = dict.fromkeys(point[0] for point in points)
    rows = ((subject, _correlation_within([point for point in points if point[0] != subject])) for subject in subjects)
    return tuple((subject, repeated.r) for subject, repeated in rows if repeated is not None)


def _normalise(table: within_subjects.Table, points: Points) -> NormalisedScores:
    """Return statistics of standardised scores and the responses in `points`."""
    pairs = [(subject, i, x, table[subject][i]) for subject, i, x, _ in points if i in table.get(subject, {})]
    return NormalisedScores(_averages(table), _relation(pairs), _correlation_within(pairs))


def _averages(table: within_subjects.Table) -> dict[int, Average]:
    """Return the mean over subjects of each index."""
    by_index = by_key((index, number) for row in table.values() for index, number in row.items())
    return {index: mean for index, values in sorted(by_index.items()) if (mean := average(values)) is not None}


# Answers other than on a line: magnitude estimates, and choices of two.


def estimates(trials: Trials, quantity: str) -> Estimates | None:
    """Return the means of magnitude estimates and their relation to a quantity; None without estimates."""
    rows = [(visit.subject, row, row.estimate) for visit, row in trials if row.estimate is not None]
    if not rows:
        return None
    no_logarithm = _without_logarithm(trials)
    logs = [(subject, row, math.log(value)) for subject, row, value in rows if subject not in no_logarithm]
    table = {
        subject: {index: float(np.mean(values)) for index, values in by_key(pairs).items()}
        for subject, pairs in sorted(by_key((subject, (row.index, log)) for subject, row, log in logs).items())
    }
    points = [(subject, row.index, x, log) for subject, row, log in logs if (x := row.response(quantity)) is not None]
    left_out = tuple(sorted(no_logarithm))
    return Estimates(
        _averages(table), _averages(within_subjects.equal_moduli(table)), _correlation_within(points), left_out
    )


def _without_logarithm(trials: Trials) -> set[str]:
    """Return the subjects with an estimate not above 0. To drop that alone would make their least surfaces greater."""
    return {visit.subject for visit, row in trials if row.estimate is not None and row.estimate <= 0.0}


def exponent(trials: Trials) -> scales.Exponent | None:
    """Return Stevens' exponent of magnitude estimates on the µ of the same strokes; None without estimates."""
    if all(row.estimate is None for _, row in trials):
        return None
    no_logarithm = _without_logarithm(trials)
    complete = [
        (visit.subject, row.index, row.estimate, row.mu)
        for visit, row in trials
        if visit.subject not in no_logarithm and row.estimate is not None and row.mu is not None and row.mu > 0.0
    ]
    if not complete:
        reason = "no trial has both an estimate and a µ of its own stroke, by a subject whose estimates are all above 0"
        return scales.Exponent(0, 0, None, reason=reason)
    return scales.stevens_exponent(*zip(*complete, strict=True))


def choices(trials: Trials) -> list[scales.Choice]:
    """Return all choices between a trial's surface and the one stroked just before it, without a standard.

    Pairs with a standard have a psychometric function; they alone leave most scales unbounded.
    """
    return [
        scales.Choice(visit.subject, row.before, row.index, row.choice == "first")
        for visit, row in trials
        if row.choice is not None and row.before is not None and row.standard is None
    ]


def constant_stimuli(trials: Trials) -> ConstantStimuli | None:
    """Return the psychometric function of each subject who compared with a standard; None without one."""
    by_subject = by_key((visit.subject, (visit, row)) for visit, row in trials if row.standard is not None)
    functions = {
        subject: subject_function(answers)
        for subject, answers in sorted(by_subject.items())
        if any(row.choice for _, row in answers)
    }
    if not functions:
        return None
    pse = [function.pse.value for function in functions.values() if function.pse is not None]
    jnd = [math.log(jnd.value) for function in functions.values() if (jnd := function.jnd) is not None and jnd.value]
    return ConstantStimuli(functions, average(pse), average(jnd))


def subject_function(trials: Trials) -> Psychometric:
    """Return the psychometric function of one subject's trials with a standard."""
    friction = by_key(((visit.session, row.index), row.mu) for visit, row in trials if row.mu and row.mu > 0.0)
    answers = [
        (visit.session, row.standard, (row.before, row.index), row.choice)
        for visit, row in trials
        if row.standard is not None and row.choice is not None and row.before is not None
    ]
    return function_of(answers, friction)


def latent_scales(
    trials: Trials, paired: Sequence[scales.PairedScale], comparisons: ConstantStimuli | None
) -> Mapping[scales.Judgement, Mapping[int, IntervalEstimate]]:
    """Return the latent values of each surface by each kind of judgement that has any."""
    scores = [(visit.subject, row.index, row.score) for visit, row in trials if row.score is not None]
    estimates = [(visit.subject, row.index, row.estimate) for visit, row in trials if row.estimate is not None]
    no_logarithm = _without_logarithm(trials)
    logs = [(subject, i, math.log(estimate)) for subject, i, estimate in estimates if subject not in no_logarithm]
    jnd = None if comparisons is None else comparisons.jnd
    by_judgement: dict[scales.Judgement, Mapping[int, IntervalEstimate]] = {
        "scores": scales.latent_judgements(scores),
        "estimates": scales.latent_judgements(logs),
    }
    for scale in paired:
        if scale.model == "Thurstone V":
            by_judgement["choices"] = scale.values
    if jnd is not None and jnd.low is not None and jnd.high is not None:
        log_mu = by_key((row.index, math.log(row.mu)) for _, row in trials if row.standard is not None and row.mu)
        mean_mu = {index: math.exp(float(np.mean(logs))) for index, logs in sorted(log_mu.items())}
        by_judgement["comparisons"] = scales.latent_comparisons(mean_mu, (jnd.mean, jnd.low, jnd.high))
    return {judgement: values for judgement, values in by_judgement.items() if values}
