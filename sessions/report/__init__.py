"""The findings of a session as plain data, ready for any export."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sessions.prediction import SED, SessionPrediction
from sessions.prediction.afferent import AfferentSettings, Firing
from sessions.prediction.sealed_predictions import NUMBERS, sealed_sentence
from sessions.prediction.series_slopes import other_signs
from sessions.recording.head import software_versions
from sessions.recording.reader import Recording
from sessions.report import facts
from sessions.report.contents import Fact, Planted, PredictionFinding, Report
from sessions.report.experiments import experiments, quantities, with_psychometric
from sessions.report.facts import scene_file, session_commands
from sessions.report.predictions import fields, left_out, model_in_short, modelled, predictions
from sessions.report.strokes import course, flaws, strokes
from sessions.statistics.multiverse import Values
from sessions.statistics.scores import ScoreTable, joined, score_table
from sessions.strokes import Analysis


@dataclass(frozen=True, slots=True)
class Further:
    """What a report can hold beside the prediction itself."""

    firing: Sequence[Firing] = ()  # of each trial with a course
    afferent: tuple[Fact, ...] = ()  # the parameters that `firing` was computed with
    firing_settings: AfferentSettings | None = None  # the same as they are asked for; None: no firing was asked for
    response: str = SED.name  # the quantity at the ending that is held against scores
    paths: Mapping[int, Values] | None = None  # trial -> that quantity along many paths of the analysis


def findings(
    recording: Recording,
    analysis: Analysis,
    prediction: SessionPrediction | None = None,
    scores: Sequence[ScoreTable] | None = None,
    planted: Sequence[Planted] | None = None,
    further: Further | None = None,
) -> Report:
    """Return the findings of a session.

    `scores` are the tables of further visits, of this subject or others, joined by subject code; the session's own
    scores are always among them. `planted` is what a simulator planted, trial by trial; None for real sessions.
    `further` is what took more solves, or was asked for.
    """
    tables = joined((score_table(recording), *(scores or ())))
    stroke_findings = strokes(recording, analysis)
    more = further or Further()
    undone = {record.trial.number for record in recording.trials if record.outcome == "open"}
    predicted = predictions(prediction, more.firing, undone)
    head = _head(recording, tables)
    other_sessions = [Path(table.session).name for table in tables[1:]]
    numbers = quantities(predicted, stroke_findings)
    judged = experiments(recording.plan, tables, numbers, more.paths, analysis.settings.area, more.response)
    return Report(
        title=_title(recording),
        session=recording.folder.name,
        simulated=bool(head),
        head=head,
        versions=tuple(Fact(name, version) for name, version in software_versions().items()),
        people=facts.people(recording, tables),
        apparatus=facts.apparatus(recording, analysis),
        excluded=facts.excluded(recording, analysis, stroke_findings, tables),
        remarks=facts.remarks(recording, analysis, tables),
        flaws=flaws(analysis),
        experiments=with_psychometric(judged, recording, analysis),
        course=course(recording),
        strokes=stroke_findings,
        predictions=predicted,
        fields=fields(prediction),
        planted=tuple(planted or ()),
        sealed=_sealed(recording, tables, predicted),
        response=more.response,
        model="" if prediction is None else model_in_short(prediction.options, analysis.settings.area),
        modelled=modelled(prediction),
        left_out=left_out(prediction),
        other_signs=() if prediction is None else tuple(other_signs(prediction.finger)),
        again=facts.again(recording, analysis),
        commands=session_commands(
            recording, analysis, prediction, more.firing_settings, more.paths, other_sessions, more.response
        ),
        scene=scene_file(recording, prediction),
        width=None if prediction is None else prediction.width,
        interval_kind=analysis.bootstrap.kind,
        interval_kinds=dict(analysis.bootstrap.kinds),
        afferent=more.afferent,
        afferent_quantity=SED.name if more.firing_settings is None else more.firing_settings.quantity,
    )


def _sealed(recording: Recording, tables: Sequence[ScoreTable], predicted: Sequence[PredictionFinding]) -> str:
    if not predicted or not any(table.scores for table in tables):
        return ""
    return sealed_sentence(recording, [{name: getattr(row, name) for name in NUMBERS} for row in predicted])


def _title(recording: Recording) -> str:
    if not recording.plan.blocks:
        return f"Recording {recording.folder.name}"
    return f"{recording.plan.protocol}, subject {recording.plan.subject}"


def _head(recording: Recording, tables: Sequence[ScoreTable]) -> str:
    """Return the first line of everything made of this session when any of it was simulated, else ""."""
    if recording.simulated_sentence is not None:
        return recording.simulated_sentence
    simulated = sum(table.simulated for table in tables)
    return f"SIMULATED: {simulated} of the sessions whose scores are used here are simulated" if simulated else ""
