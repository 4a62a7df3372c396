"""What the visits of a study say together: means, agreement, and how predictions go with scores. Plain data."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from sessions.prediction import SED, Quantity, shown_unit
from sessions.statistics import answers
from sessions.statistics.correlations import Relation, relation
from sessions.statistics.findings import (
    CARRY_OVER,
    DRIFT,
    FRICTION,
    INDEX,
    DescriptorFindings,
    Normalised,
    StudyFindings,
    SurfaceMean,
    found_flaws,
    found_friction,
    recovered,
)
from sessions.statistics.mixed_model import MixedModel, Spread, mixed_model, spreads
from sessions.statistics.multiverse import PathTrial, path_findings
from sessions.statistics.rivals import FIELDS, RESPONSES, RivalTrial, rivals_of_surfaces, rivals_within
from sessions.statistics.scales import MODELS, consistence, paired_scale
from sessions.statistics.scores import ScoreTable, mean_scores, reversed_subjects, score_matrix, surface_means
from sessions.statistics.visit import Exclusion, TrialRow, Visit, VisitOptions, decided, scores_of
from sessions.statistics.within_subjects import (
    agreement,
    differences,
    holm,
    repeated_correlation,
    standardised,
    within_means,
)


def pooled(
    visits: Sequence[Visit],
    failed: Sequence[tuple[str, str]] = (),
    exclusions: tuple[Exclusion, ...] = (),
    planted: Mapping[str, Any] | None = None,
    options: VisitOptions | None = None,
    quantity: Quantity = SED,
) -> StudyFindings:
    """Return what the visits say together; they count in the order of their names, whoever read them first.

    `options` is what was asked of each visit, `quantity` that response of the model which is held against scores.
    `planted` is what a synthetic study tells of itself: handed in, used for nothing but the comparison.
    """
    ordered = tuple(sorted(visits, key=lambda visit: visit.session))
    copies = _copies(ordered)
    counted = [visit for visit in ordered if visit.session not in copies]
    kept = [(v, row) for v in counted for row in v.rows if decided(exclusions, v.subject, row.descriptor) is None]
    tables = [scores_of(visit, [row for v, row in kept if v is visit]) for visit in counted]
    chosen = options or VisitOptions()
    descriptors = tuple(
        _descriptor(name, chosen, quantity, tables, [(v, row) for v, row in kept if row.descriptor == name])
        for name in dict.fromkeys(row.descriptor for _, row in kept)
    )
    descriptors = _with_holm(descriptors)
    return StudyFindings(
        simulated=_simulated(ordered),
        options=chosen,
        visits=ordered,
        failed=tuple(sorted(failed)),
        copies=tuple(copies.items()),
        excluded=exclusions,
        reversed=reversed_subjects(tables),
        descriptors=descriptors,
        effects=() if planted is None else recovered(descriptors, planted),
        friction=None if planted is None else found_friction(ordered, planted["strokes"]),
        flaws=() if planted is None else found_flaws(ordered, dict(failed), planted.get("spoilt", {})),
        synthetic=None if planted is None else planted.get("seed"),
        response=quantity.name,
    )


def _copies(visits: Sequence[Visit]) -> dict[str, str]:
    """Return the sessions that hold the recording of an earlier one once more, each with that one's name."""
    first: dict[str, str] = {}
    for visit in visits:
        if visit.sha256:
            first.setdefault(visit.sha256, visit.session)
    return {v.session: first[v.sha256] for v in visits if v.sha256 and first[v.sha256] != v.session}


def _with_holm(descriptors: Sequence[DescriptorFindings]) -> tuple[DescriptorFindings, ...]:
    ps = {one.descriptor: one.repeated.people_p for one in descriptors if one.repeated is not None}
    known = {descriptor: p for descriptor, p in ps.items() if p is not None}
    adjusted = dict(zip(known, holm(list(known.values())), strict=True))
    return tuple(replace(one, repeated_holm=adjusted.get(one.descriptor)) for one in descriptors)


def _simulated(visits: Sequence[Visit]) -> str:
    made_up = sum(bool(visit.simulated) for visit in visits)
    if not made_up:
        return ""
    return f"SIMULATED: {made_up} of the {len(visits)} sessions of this study are simulated"


def _descriptor(
    name: str,
    options: VisitOptions,
    quantity: Quantity,
    tables: Sequence[ScoreTable],
    trials: Sequence[tuple[Visit, TrialRow]],
) -> DescriptorFindings:
    indices = tuple(sorted({row.index for _, row in trials}))
    means = tuple(mean for mean in mean_scores(tables) if mean.descriptor == name)
    matrix = score_matrix(tables, name)
    surfaces = tuple(
        _surface(index, quantity.name, [(v, r) for v, r in trials if r.index == index]) for index in indices
    )
    level = standardised(matrix)
    answered = [(v, r, r.response(quantity.name), r.score) for v, r in trials]
    points = [(v.subject, r, x, score) for v, r, x, score in answered if x is not None and score is not None]
    scored = [(v.subject, r, r.score) for v, r in trials if r.score is not None]
    chosen = answers.choices(trials)
    scales = tuple(paired_scale(chosen, model) for model in MODELS) if chosen else ()
    compared = answers.constant_stimuli(trials)
    competing = [_rival_trial(subject, r, score) for subject, r, _, score in points]
    return DescriptorFindings(
        descriptor=name,
        indices=indices,
        scores=means,
        within=within_means(matrix),
        agreement=agreement(matrix),
        surfaces=surfaces,
        answers={subject: tuple(row.get(index) for index in indices) for subject, row in matrix.items()},
        points=tuple((subject, row.index, x, score) for subject, row, x, score in points),
        mean_relation=_related([(p[0], p[1].index, p[2], p[3]) for p in points]),
        repeated=repeated_correlation([p[0] for p in points], [p[2] for p in points], [p[3] for p in points]),
        repeated_holm=None,
        rivals=rivals_within(competing, quantity.label),
        rivals_of_means=rivals_of_surfaces(competing, quantity.label),
        without_subject=_without_subject([(p[0], p[2], p[3]) for p in points]),
        normalised=_normalised(level, [(p[0], p[1].index, p[2]) for p in points]),
        differences=differences(matrix),
        estimates=answers.estimates(trials, quantity.name),
        exponent=answers.exponent(trials),
        scales=scales,
        consistence=consistence(chosen),
        on_response=_model([(p[0], p[1], p[3]) for p in points], quantity, response_term(quantity)),
        on_index=_model(scored, quantity, INDEX),
        on_friction=_model([one for one in scored if one[1].mu is not None], quantity, INDEX, FRICTION),
        fingers=_fingers([(v.subject, row.index, row.mu) for v, row in trials if row.mu is not None]),
        paths=path_findings(
            [PathTrial(v.subject, row.index, row.score, row.rule, row.paths) for v, row in trials],
            options.prediction.kinematics,
            options.area,
            within=True,
        ),
        constant_stimuli=compared,
        latent=answers.latent_scales(trials, scales, compared),
    )


def _rival_trial(subject: str, row: TrialRow, score: float) -> RivalTrial:
    numbers = {name: getattr(row, attribute) for name, attribute in FIELDS.items()}
    numbers |= {label: row.response(name) for label, name in RESPONSES.items()}
    return RivalTrial(subject, row.index, score, {name: value for name, value in numbers.items() if value is not None})


def response_term(quantity: Quantity) -> str:
    """Return the name of a quantity in mixed models, with the unit in which people read it.

    >>> response_term(SED)
    'SED [kPa]'
    """
    return f"{quantity.label} [{shown_unit(quantity)[0]}]"


def _model(trials: Sequence[tuple[str, TrialRow, float]], quantity: Quantity, *what: str) -> MixedModel | str:
    """Return the mixed model of scores on `what`, drift and carry-over, or why there is none.

    Trials are subject, row and score. Subjects have slopes of their own on the first of `what`.
    """
    subjects, rows, scores = [one[0] for one in trials], [one[1] for one in trials], [one[2] for one in trials]
    if len(set(subjects)) < 3:
        own = "scores" if what == (INDEX,) else "scores and strokes of their own"
        return f"it takes three subjects with {own}, and there {_are(len(set(subjects)))}"
    columns = {
        INDEX: [row.index - 50.0 for row in rows],
        response_term(quantity): [shown_unit(quantity)[1] * (row.response(quantity.name) or 0.0) for row in rows],
        FRICTION: [row.mu or 0.0 for row in rows],
        DRIFT: [float(row.place) for row in rows],
        CARRY_OVER: [0.0 if row.before is None else row.before - 50.0 for row in rows],
    }
    order = [name for name in (DRIFT, CARRY_OVER) if np.ptp(columns[name]) > 0.0]
    return mixed_model(subjects, scores, {name: columns[name] for name in (*what, *order)}, slopes_differ=True)


def _are(n: int) -> str:
    return "is 1" if n == 1 else f"are {n or 'none'}"


def _fingers(trials: Sequence[tuple[str, int, float]]) -> Spread | None:
    """Return how far subjects' friction differs from one another, of trials' subject, index and mu."""
    indices = sorted({index for _, index, _ in trials})
    surfaces = [[float(index == one) for _, index, _ in trials] for one in indices[1:]]
    variances = spreads([subject for subject, _, _ in trials], [math.log(mu) for _, _, mu in trials], surfaces)
    return None if variances is None else variances.level


def _surface(index: int, quantity: str, trials: Sequence[tuple[Visit, TrialRow]]) -> SurfaceMean:
    """Return means over subjects, each subject's own repeats averaged first."""

    def over_subjects(value: Callable[[TrialRow], float | None]) -> answers.Average | None:
        return answers.average(answers.by_subject([(v.subject, value(row)) for v, row in trials]))

    response = over_subjects(lambda row: row.response(quantity))
    names = ("mu", "normal_force", "model_normal_force", "matching_depth")
    mu, normal, model, depth = (over_subjects(attrgetter(name)) for name in names)
    return SurfaceMean(index, 0 if response is None else response.n, mu, response, normal, model, depth)


def _related(points: Sequence[tuple[str, int, float, float]]) -> Relation | None:
    """Return how mean scores go with mean responses, of points that have both: subject, index, response and score."""
    responses = surface_means([(subject, index, x) for subject, index, x, _ in points])
    scores = surface_means([(subject, index, score) for subject, index, _, score in points])
    if responses is None or scores is None:
        return None
    return relation(list(responses.values()), list(scores.values()), list(responses))


def _without_subject(points: Sequence[tuple[str, float, float]]) -> tuple[tuple[str, float], ...]:
    """Return the correlation within subjects when each subject in turn is left out."""
    rows: list[tuple[str, float]] = []
    for subject in dict.fromkeys(point[0] for point in points):
        rest = [point for point in points if point[0] != subject]
        repeated = repeated_correlation(*zip(*rest, strict=True)) if rest else None
        if repeated is not None:
            rows.append((subject, repeated.r))
    return tuple(rows)


def _normalised(table: Mapping[str, Mapping[int, float]], points: Sequence[tuple[str, int, float]]) -> Normalised:
    """Return what scores say that were standardised; `points` are subject, index and response to its own stroke."""
    means = answers.averages(table)
    pairs = [(subject, i, x, table[subject][i]) for subject, i, x in points if i in table.get(subject, {})]
    within = repeated_correlation([p[0] for p in pairs], [p[2] for p in pairs], [p[3] for p in pairs])
    return Normalised(means, _related(pairs), within)
