"""The findings of a session as plain data, ready for any export."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sessions.plan.plan import Block, SessionPlan
from sessions.prediction import BY_NAME, SED, SessionPrediction
from sessions.prediction.afferent import AfferentSettings, Firing
from sessions.prediction.sealed_predictions import NUMBERS, sealed_sentence
from sessions.prediction.stored import model_facts
from sessions.prediction.surface_series import other_signs
from sessions.recording.head import software_versions
from sessions.recording.reader import Recording
from sessions.report import facts
from sessions.report.contents import (
    Experiment,
    Fact,
    GroundTruth,
    PredictionFinding,
    Report,
    StrokeFinding,
    same_fields,
)
from sessions.report.facts import scene_file, session_commands
from sessions.report.trials import course, fields, flaws, model_in_short, omissions, predictions, strokes
from sessions.report.wording import full_stop
from sessions.statistics.correlations import Relation, relation
from sessions.statistics.multiverse import PathTrial, Values, path_findings
from sessions.statistics.psychometric import Psychometric, function_of
from sessions.statistics.rivals import FIELDS, MODEL, MODEL_MU, NAMES, RESPONSES, rivals_of_means
from sessions.statistics.scores import ScoreTable, by_key, distinct_sessions, mean_scores, score_matrix, score_table
from sessions.strokes import Analysis
from sessions.strokes.stroke import FIXED, AreaLaw, rule_for


@dataclass(frozen=True, slots=True)
class Further:
    """What a report can hold beside the prediction itself."""

    firing: Sequence[Firing] = ()  # of each trial with a course
    afferent: tuple[Fact, ...] = ()  # the parameters that `firing` was computed with
    firing_settings: AfferentSettings | None = None  # the same as they are asked for; None: no firing was asked for
    response: str = SED.name  # the quantity at the ending that is held against scores
    paths: Mapping[int, Values] | None = None  # trial -> that quantity along many paths of the analysis
    unreadable: tuple[str, ...] = ()  # a sentence for each session of the study that cannot be read


def findings(
    recording: Recording,
    analysis: Analysis,
    prediction: SessionPrediction | None = None,
    scores: Sequence[ScoreTable] | None = None,
    planted: Sequence[GroundTruth] | None = None,
    further: Further | None = None,
) -> Report:
    """Return the findings of a session.

    `scores` are the tables of further visits, of this subject or others, joined by subject code; the session's own
    scores are always among them. `planted` is what a simulator planted, trial by trial; None for real sessions.
    `further` is what took more solves, or was asked for.
    """
    plan, tables = recording.plan, distinct_sessions((score_table(recording), *(scores or ())))
    more = further or Further()
    alone = numbers_alone(recording, analysis, prediction, more)
    stroke_findings, predicted = alone.strokes, alone.predictions
    head = _head(recording, tables)
    other_sessions = [Path(table.session).name for table in tables[1:]]
    numbers = quantities(predicted, stroke_findings)
    judged = experiments(plan, tables, numbers, more.paths, analysis.settings.area, more.response)
    return replace(
        alone,
        title=f"{plan.protocol}, subject {plan.subject}" if plan.blocks else f"Recording {recording.folder.name}",
        simulated=bool(head),
        head=head,
        versions=tuple(Fact(name, version) for name, version in software_versions().items()),
        people=facts.people(recording, tables),
        apparatus=facts.apparatus(recording, analysis),
        excluded=(
            *map(full_stop, more.unreadable),
            *facts.exclusion_sentences(recording, analysis, stroke_findings, tables),
        ),
        remarks=facts.remarks(recording, analysis, tables),
        flaws=flaws(analysis),
        experiments=with_psychometric(judged, recording, analysis),
        course=course(recording),
        fields=fields(prediction),
        planted=tuple(planted or ()),
        sealed=_seal_sentence(recording, tables, predicted),
        modelled=tuple(Fact(*fact) for fact in model_facts(prediction)),
        left_out=omissions(prediction),
        other_signs=() if prediction is None else tuple(other_signs(prediction.finger)),
        again=facts.again(recording, analysis),
        commands=session_commands(
            recording, analysis, prediction, more.firing_settings, more.paths, other_sessions, more.response
        ),
        scene=scene_file(recording, prediction),
    )


def numbers_alone(
    recording: Recording, analysis: Analysis, prediction: SessionPrediction | None, more: Further
) -> Report:
    """Return a report of strokes and predictions alone: nothing is held against scores, so it may be blinded."""
    undone = {record.trial.number for record in recording.trials if record.outcome == "open"}
    return Report(
        session=recording.folder.name,
        strokes=strokes(recording, analysis),
        predictions=predictions(prediction, more.firing, undone),
        response=more.response,
        model="" if prediction is None else model_in_short(prediction.options, analysis.settings.area),
        width=None if prediction is None else prediction.width,
        width_origin="" if prediction is None else prediction.width_origin,
        interval_kind=analysis.bootstrap.kind,
        interval_kinds=dict(analysis.bootstrap.kinds),
        afferent=more.afferent,
        afferent_quantity=SED.name if more.firing_settings is None else more.firing_settings.quantity,
    )


def _seal_sentence(recording: Recording, tables: Sequence[ScoreTable], predicted: Sequence[PredictionFinding]) -> str:
    if not predicted or not any(table.scores for table in tables):
        return ""
    return sealed_sentence(recording, [{name: getattr(row, name) for name in NUMBERS} for row in predicted])


def _head(recording: Recording, tables: Sequence[ScoreTable]) -> str:
    """Return the first line of everything made of this session when any of it was simulated, else ""."""
    if recording.simulated_sentence is not None:
        return recording.simulated_sentence
    simulated = sum(table.simulated for table in tables)
    are = "is" if simulated == 1 else "are"
    return f"SIMULATED: {simulated} of the sessions whose scores are used here {are} simulated" if simulated else ""


Quantities = Mapping[str, Mapping[tuple[str, int], float]]  # name in `NAMES` -> block and index -> number


def quantities(predictions: Sequence[PredictionFinding], strokes: Sequence[StrokeFinding]) -> Quantities:
    """Return each quantity by block and index, the mean over repetitions: the model's, and of the strokes it got."""
    by_number = {stroke.number: stroke for stroke in strokes}

    def numbers(one: PredictionFinding) -> dict[str, float | None]:
        stroke = by_number.get(one.stroke or 0)
        own = {name: getattr(one if name == MODEL_MU else stroke, FIELDS[name], None) for name in FIELDS}
        responses = {label: one.responses[name].value for label, name in RESPONSES.items() if name in one.responses}
        return own | responses | {MODEL: one.sed}

    rows = [(one.experiment, one.index, numbers(one)) for one in predictions if one.index is not None]

    def means(name: str) -> dict[tuple[str, int], float]:
        values = by_key(((block, i), value) for block, i, own in rows if (value := own.get(name)) is not None)
        return {key: float(np.mean(repetitions)) for key, repetitions in values.items()}

    return {name: means(name) for name in NAMES}


def with_psychometric(
    experiments: Sequence[Experiment], recording: Recording, analysis: Analysis
) -> tuple[Experiment, ...]:
    """Return the experiments, those of blocks with a standard with the subject's psychometric function."""
    blocks = {block.name: block for block in recording.plan.blocks if block.standard is not None}
    return tuple(
        replace(one, psychometric=_psychometric(blocks[one.name], recording, analysis)) if one.name in blocks else one
        for one in experiments
    )


def _psychometric(block: Block, recording: Recording, analysis: Analysis) -> Psychometric:
    index = {trial.number: trial.stimulus.known_index for trial in block.trials}
    standard = next(index[trial.number] for trial in block.trials if trial.standard)
    friction = by_key(
        (("", index[one.trial]), one.mu)
        for one in analysis.friction
        if one.trial in index and one.mu is not None and one.mu > 0.0
    )
    answers = [
        ("", standard, (index[first], index[record.trial.number]), record.choice)
        for record in recording.trials
        if record.choice is not None and record.trial.number in index
        for first in [record.trial.compared_with]
        if first is not None
    ]
    return function_of(answers, friction)


def experiments(
    plan: SessionPlan,
    tables: Sequence[ScoreTable],
    numbers: Quantities,
    paths: Mapping[int, Values] | None = None,
    law: AreaLaw = FIXED,
    response: str = SED.name,
) -> tuple[Experiment, ...]:
    """Return one experiment a block; `numbers` are the `quantities` of its surfaces.

    `response` names the quantity of the model that is held against scores and rivals. `paths` holds that of each
    trial along many paths of the analysis, where they were asked for, and `law` the contact area by which every other
    number was given.
    """
    label = BY_NAME[response].label
    judged: list[Experiment] = []
    for block in plan.blocks:
        if block.phase != "main":
            continue
        descriptor = block.trials[0].stimulus.descriptor
        indices = tuple(sorted({trial.stimulus.known_index for trial in block.trials}))
        means = tuple(one for one in mean_scores(tables) if one.descriptor == descriptor and one.index in indices)
        score_of = {mean.index: mean.mean for mean in means}
        rows = score_matrix(tables, descriptor)
        own = {i: score for i, score in rows.get(plan.subject, {}).items() if len(rows) > 1 and i in indices}
        series = {
            name: {index: values[block.name, index] for index in indices if (block.name, index) in values}
            for name, values in numbers.items()
        }
        predicted = series.get(label, {})
        along = [
            PathTrial("", index, score_of.get(index), rule_for(trial), (paths or {}).get(trial.number, ()))
            for trial in block.trials
            for index in [trial.stimulus.known_index]
        ]
        judged.append(
            Experiment(
                **same_fields(block, Experiment),
                descriptor=descriptor,
                indices=indices,
                scores=means,
                answers={subject: tuple(map(row.get, indices)) for subject, row in rows.items()},
                score_relation=_relation(score_of, predicted),
                index_relation=_relation({index: float(index) for index in indices}, predicted),
                own_relation=_relation(own, predicted),
                own_scores=own,
                rivals=rivals_of_means(score_of, series, label) if predicted and score_of else (),
                response=response,
                paths=path_findings(along, "small", law, within=False),
            )
        )
    return tuple(judged)


def _relation(x: Mapping[int, float], responses: Mapping[int, float]) -> Relation | None:
    """Return how responses go with x, over the indices that have both; None where there is none."""
    shared = [index for index in sorted(x) if index in responses]
    if not shared:
        return None
    return relation([x[index] for index in shared], [responses[index] for index in shared], shared)
