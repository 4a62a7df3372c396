"""The findings of a session as plain data, ready for any export."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sessions.plan.plan import SessionPlan
from sessions.prediction import BY_NAME, SED, Kinematics, SessionPrediction
from sessions.prediction.afferent import AfferentSettings, Firing
from sessions.prediction.stored import model_facts
from sessions.prediction.surface_series import other_signs
from sessions.recording.reader import Recording
from sessions.report import facts
from sessions.report.contents import Experiment, Fact, GroundTruth, Report
from sessions.report.facts import scene_file, session_commands
from sessions.report.trials import answers, course, fields, flaws, model_in_short, omissions, predictions, strokes
from sessions.report.wording import full_stop
from sessions.statistics.correlations import Relation, relation
from sessions.statistics.multiverse import PathTrial, Values, path_findings
from sessions.statistics.pooled import rival_values, subject_function
from sessions.statistics.rivals import RIVAL_NAMES, rivals_of_means
from sessions.statistics.scores import (
    ScoreTable,
    block_scores,
    by_key,
    distinct_sessions,
    mean_scores,
    reversed_subjects,
    score_matrix,
    score_table,
)
from sessions.statistics.visit import TrialRow, Visit, visit_from
from sessions.strokes import Analysis
from sessions.strokes.stroke import FIXED, AreaLaw


@dataclass(frozen=True, slots=True)
class Further:
    """Optional parts of a report, besides the prediction itself."""

    firing: Sequence[Firing] = ()  # of each trial with a time course
    afferent: tuple[Fact, ...] = ()  # the parameters that `firing` was computed with
    firing_settings: AfferentSettings | None = None  # settings of the firing; None: no firing requested
    response: str = SED.name  # the quantity at the ending that is compared with scores
    paths: Mapping[int, Values] | None = None  # trial -> that quantity along many paths of the analysis
    seal_differences: tuple[str, ...] = ()  # a sentence for each recording that differs from its seal
    unreadable: tuple[str, ...] = ()  # a sentence for each session of the study that cannot be read


def findings(
    recording: Recording,
    analysis: Analysis,
    prediction: SessionPrediction | None = None,
    scores: Sequence[ScoreTable] | None = None,
    ground_truth: Sequence[GroundTruth] | None = None,
    further: Further | None = None,
) -> Report:
    """Return the findings of a session.

    `scores` are the tables of further visits, of this subject or others, joined by subject code; the session's own
    scores are always included. `ground_truth` is what a simulator set in each trial; None for real sessions. `further`
    holds optional parts that take more solves.
    """
    plan, tables = recording.plan, distinct_sessions((score_table(recording), *(scores or ())))
    extras = further or Further()
    unscored = numbers_alone(recording, analysis, prediction, extras)
    other_sessions = [Path(table.session).name for table in tables[1:]]
    visit = visit_from(recording, analysis, prediction, extras.paths or {}, {})
    scored = any(table.scores for table in tables)
    return replace(
        unscored,
        title=f"{plan.protocol}, subject {plan.subject}" if plan.blocks else f"Recording {recording.folder.name}",
        head=_simulation_notice(recording, tables),
        seal_differences=extras.seal_differences,
        people=facts.people(recording, tables),
        apparatus=facts.apparatus(recording, analysis),
        excluded=(
            *map(full_stop, extras.unreadable),
            *facts.exclusion_sentences(recording, analysis, unscored.strokes),
        ),
        remarks=facts.remarks(recording, analysis, tables),
        flaws=flaws(analysis),
        experiments=experiments(
            plan,
            tables,
            visit,
            analysis.settings.area,
            extras.response,
            "small" if prediction is None else prediction.options.kinematics,
        ),
        course=course(recording),
        fields=fields(prediction),
        ground_truth=tuple(ground_truth or ()),
        sealed=visit.sealed if scored and unscored.predictions else "",
        modelled=tuple(Fact(*fact) for fact in model_facts(prediction)),
        left_out=omissions(prediction),
        other_signs=() if prediction is None else tuple(other_signs(prediction.finger)),
        reproduction=facts.reproduction_facts(recording, analysis),
        commands=session_commands(
            recording, analysis, prediction, extras.firing_settings, extras.paths, other_sessions, extras.response
        ),
        scene=scene_file(recording, prediction),
    )


def numbers_alone(
    recording: Recording, analysis: Analysis, prediction: SessionPrediction | None, extras: Further
) -> Report:
    """Return a report of strokes and predictions only, without scores, so the session may be blinded."""
    undone = {record.trial.number for record in recording.trials if record.outcome == "open"}
    return Report(
        session=recording.folder.name,
        strokes=strokes(recording, analysis),
        predictions=predictions(prediction, extras.firing, undone),
        answers=answers(recording),
        response=extras.response,
        model="" if prediction is None else model_in_short(prediction.options, analysis.settings.area),
        width=None if prediction is None else prediction.width,
        width_origin="" if prediction is None else prediction.width_origin,
        area=analysis.settings.area.sentence,
        interval_kind=analysis.bootstrap.kind,
        interval_kinds=dict(analysis.bootstrap.kinds),
        afferent=extras.afferent,
        afferent_quantity=SED.name if extras.firing_settings is None else extras.firing_settings.quantity,
    )


def _simulation_notice(recording: Recording, tables: Sequence[ScoreTable]) -> str:
    """Return the first line of every document on this session if any part was simulated, else ""."""
    if recording.simulated_sentence is not None:
        return recording.simulated_sentence
    simulated = sum(table.simulated for table in tables)
    verb = "is" if simulated == 1 else "are"
    return f"SIMULATED: {simulated} of the sessions whose scores are used here {verb} simulated" if simulated else ""


def experiments(
    plan: SessionPlan,
    tables: Sequence[ScoreTable],
    visit: Visit,
    law: AreaLaw = FIXED,
    response: str = SED.name,
    kinematics: Kinematics = "small",
) -> tuple[Experiment, ...]:
    """Return one experiment for each block; `visit` holds the trials with measurements and predictions.

    `response` names the model's quantity that is compared with scores and rivals, and the quantity of the visit's
    paths. `law` gives the contact area, and `kinematics` the strain, of all numbers except those of the paths.
    """
    label = BY_NAME[response].label
    falling = reversed_subjects(tables)
    blocks: list[Experiment] = []
    for block in plan.blocks:
        if block.phase != "main":
            continue
        trials = [row for row in visit.rows if row.block == block.name]
        descriptor = trials[0].descriptor
        indices = tuple(sorted({row.index for row in trials}))
        in_block = block_scores(tables, block.name, descriptor)
        means = tuple(mean for mean in mean_scores(in_block) if mean.index in indices)
        score_of = {mean.index: mean.mean for mean in means}
        rows = score_matrix(in_block, descriptor)
        own_scores = {i: score for i, score in rows.get(plan.subject, {}).items() if len(rows) > 1 and i in indices}
        series = _surface_series(trials)
        responses = series.get(label, {})
        along = [PathTrial("", row.index, score_of.get(row.index), row.rule, row.paths) for row in trials]
        blocks.append(
            Experiment(
                name=block.name,
                descriptor=descriptor,
                scale_ends=block.scale_ends,
                indices=indices,
                scores=means,
                answers={subject: tuple(map(row.get, indices)) for subject, row in rows.items()},
                score_relation=_relation(score_of, responses),
                index_relation=_relation({index: float(index) for index in indices}, responses),
                own_relation=_relation(own_scores, responses),
                own_scores=own_scores,
                rivals=rivals_of_means(score_of, series, label) if responses and score_of else (),
                response=response,
                paths=path_findings(along, kinematics, law, within=False),
                psychometric=subject_function([(visit, row) for row in trials]) if block.standard else None,
                other_answers=() if block.standard else _other_answers(trials),
                falling=tuple(subject for subject, name, _ in falling if name == descriptor),
            )
        )
    return tuple(blocks)


def _other_answers(trials: Sequence[TrialRow]) -> tuple[tuple[int, str, str], ...]:
    """Return trial, index judged and answer of each number, and of each choice with both indices."""
    numbers = [(row.trial, str(row.index), f"{row.estimate:g}") for row in trials if row.estimate is not None]
    choices = [
        (row.trial, f"{row.before}, then {row.index}", str(row.before if row.choice == "first" else row.index))
        for row in trials
        if row.choice is not None
    ]
    return (*numbers, *choices)


def _surface_series(trials: Sequence[TrialRow]) -> dict[str, dict[int, float]]:
    """Return the mean over repetitions of each quantity of the surfaces, by name (`rivals.RIVAL_NAMES`) and index."""
    values = by_key((name, (row.index, value)) for row in trials for name, value in rival_values(row).items())
    return {
        name: {index: float(np.mean(repeats)) for index, repeats in sorted(by_key(values.get(name, [])).items())}
        for name in RIVAL_NAMES
    }


def _relation(x: Mapping[int, float], responses: Mapping[int, float]) -> Relation | None:
    """Return the relation of responses to x, over the indices that have both; None without any."""
    indices = sorted(x.keys() & responses.keys())
    return relation([x[i] for i in indices], [responses[i] for i in indices], indices) if indices else None
