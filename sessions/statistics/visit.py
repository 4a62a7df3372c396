"""One session's contribution to a study: rows of trials with score, friction and prediction, and excluded subjects.

Decisions to exclude a subject are in a file in the folder of the sessions.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from sessions.plan.plan import Blinded, Block
from sessions.prediction import BY_NAME, SED, PredictionOptions, SessionPrediction, TrialPrediction, predict
from sessions.prediction.scenes import doubt_of
from sessions.prediction.sealed_predictions import SEAL_NUMBERS, sealed_sentence
from sessions.prediction.stored import Number, model_facts
from sessions.prediction.uncertainty import with_intervals
from sessions.recording import Recording
from sessions.recording.derived import gain_error_set, reveal
from sessions.recording.log import TrialRecord
from sessions.recording.manifest import content_sha256, file_sha256
from sessions.recording.schema import LIVE_FILE
from sessions.statistics.multiverse import Values, trial_paths
from sessions.statistics.scores import Score, ScoreTable
from sessions.strokes import Analysis, AnalysisSettings, FrictionParameters, analyse
from sessions.strokes.stroke import FIXED, AreaLaw, Meaning
from sessions.toml_file import check, load_toml

EXCLUSIONS = "exclusions.toml"


@dataclass(frozen=True, slots=True)
class Exclusion:
    """One decision: all visits of a subject are excluded, or its scores and strokes on one descriptor."""

    subject: str
    why: str
    who: str
    descriptor: str = ""  # "" for all

    def __post_init__(self) -> None:
        for key, content in (("subject", "a subject's code"), ("why", "the reason"), ("who", "who decided it")):
            check(bool(getattr(self, key).strip()), key, getattr(self, key), f"{content}, not empty")


@dataclass(frozen=True, slots=True)
class Exclusions:
    """Content of `EXCLUSIONS`."""

    exclude: tuple[Exclusion, ...] = ()


def exclusions_in(folder: Path) -> tuple[Exclusion, ...]:
    """Return the decisions stored in a study's folder, none without a file. Raises SettingsError."""
    path = folder / EXCLUSIONS
    return load_toml(path, Exclusions).exclude if path.is_file() else ()


def exclusion_of(exclusions: tuple[Exclusion, ...], subject: str, descriptor: str) -> Exclusion | None:
    """Return the decision that excludes a subject's trials on a descriptor, None without one."""
    of_subject = (exclusion for exclusion in exclusions if exclusion.subject == subject)
    return next((exclusion for exclusion in of_subject if exclusion.descriptor in ("", descriptor)), None)


FORM = 14  # version of rows; stored rows of another version are computed again
STILL_BLINDED = "still blinded, and is not counted until 'daq-app unblind' opens the key"
NO_INTERVAL = "intervals of the SED were not requested"


@dataclass(frozen=True, slots=True)
class VisitOptions:
    """Options for the analysis of each session of a study."""

    prediction: PredictionOptions = field(default_factory=lambda: PredictionOptions(intervals=True))
    area: AreaLaw = FIXED  # for tau_max; paths have their own areas
    # Whether to follow many paths, and at which strain: see `sessions.statistics.multiverse`
    paths: Literal["none", "small", "finite"] = "none"
    gain_error: float | None = None  # of each axis of every transducer [-]; None: the value set for each session
    quantity: str = SED.name  # of the paths


@dataclass(frozen=True, slots=True)
class TrialRow:
    """One trial, each field with its unit and meaning in tables. None where missing; `why` says why there is no SED."""

    trial: Annotated[int, Meaning("", "number of the trial in its session, from 1")]
    block: Annotated[str, Meaning("", "name of its block")]
    descriptor: Annotated[str, Meaning("", "what was judged")]
    index: Annotated[int, Meaning("", "its maker's number of the surface on the descriptor, 0 to 100")]
    code: Annotated[str, Meaning("", "label on the back of the surface")]
    direction: Annotated[int, Meaning("", "planned: 1 from proximal to distal, -1 back")]
    repetition: Annotated[int, Meaning("", "how often this surface has been presented in the block, from 1")]
    place: Annotated[int, Meaning("", "trials of the block before this one")]
    before: Annotated[int | None, Meaning("", "index stroked just before in the same block; empty for the first")]
    outcome: Annotated[str, Meaning("", "how the trial ended")]
    score: Annotated[Number, Meaning("", "answer on the line, 0 to 100")]
    estimate: Annotated[Number, Meaning("", "number on the subject's own scale, where numbers were asked for")] = None
    choice: Annotated[str | None, Meaning("", "the subject's answer where two were compared: first or second")] = None
    standard: Annotated[
        int | None,
        Meaning("", "index of the surface that all others of the block are compared with; empty where there is none"),
    ] = None
    rule: Annotated[str, Meaning("", "which mu the model used: maximum, or mean over the steady window")] = ""
    mu: Annotated[Number, Meaning("", "coefficient of friction that the model used")] = None
    mu_low: Annotated[Number, Meaning("", "lower end of its 95 % bootstrap interval")] = None
    mu_high: Annotated[Number, Meaning("", "upper end")] = None
    mu_dynamic: Annotated[Number, Meaning("", "mean of T/N over the steady window")] = None
    mu_static: Annotated[Number, Meaning("", "T/N at a static peak; empty where none stands out")] = None
    tau_max: Annotated[
        Number, Meaning("MPa", "greatest tangential force over the contact area: the traction bound")
    ] = None
    tau_max_low: Annotated[Number, Meaning("MPa", "lower end of its 95 % bootstrap interval")] = None
    tau_max_high: Annotated[Number, Meaning("MPa", "upper end")] = None
    speed: Annotated[Number, Meaning("mm/s", "of the centre of pressure over the steady window")] = None
    speed_low: Annotated[Number, Meaning("mm/s", "lower end of its 95 % bootstrap interval")] = None
    speed_high: Annotated[Number, Meaning("mm/s", "upper end")] = None
    normal_force: Annotated[Number, Meaning("N", "measured, mean over the steady window")] = None
    normal_force_low: Annotated[Number, Meaning("N", "lower end of its 95 % bootstrap interval")] = None
    normal_force_high: Annotated[Number, Meaning("N", "upper end")] = None
    sed: Annotated[Number, Meaning("MPa", "predicted strain-energy density, averaged over the ending")] = None
    sed_low: Annotated[
        Number, Meaning("MPa", "lower end of the 95 % interval that the uncertainty of friction alone makes")
    ] = None
    sed_high: Annotated[Number, Meaning("MPa", "upper end")] = None
    sed_interval: Annotated[str, Meaning("", "how that interval was computed, or why there is none")] = ""
    error_estimate: Annotated[Number, Meaning("", "of sed, from its mesh, relative")] = None
    tangential_force: Annotated[Number, Meaning("N", "measured, mean over the steady window")] = None
    responses: Mapping[str, float] = field(default_factory=dict[str, float])  # each quantity at the ending, by name
    contact_area: Annotated[Number, Meaning("mm2", "by which tau_max was computed")] = None
    indentation: Annotated[Number, Meaning("mm", "depth to which the model was pressed")] = None
    model_normal_force: Annotated[
        Number, Meaning("N", "of the model, pressed to the planned depth, times the finger's width")
    ] = None
    model_normal_force_error: Annotated[Number, Meaning("", "its relative error, estimated by the solver")] = None
    matching_depth: Annotated[
        Number, Meaning("mm", "depth at which the model would press as hard as the subject did")
    ] = None
    flaws: Annotated[
        tuple[str, ...], Meaning("", "names of the flaws graded doubtful or worse, with blanks between")
    ] = ()
    why: Annotated[str, Meaning("", "why there is no SED")] = ""
    doubt: Annotated[str, Meaning("", "why no finger can be in the state of the model; empty where one can")] = ""
    paths: Values = ()  # a quantity along each of `sessions.statistics.multiverse.PATHS`, where requested

    def response(self, quantity: str) -> float | None:
        """Return the model's quantity of that name [MPa or -]; None without a prediction."""
        return self.sed if quantity == SED.name else self.responses.get(quantity)


@dataclass(frozen=True, slots=True)
class Visit:
    """One session's contribution to a study."""

    session: str  # its folder's name
    subject: str
    protocol: str
    simulated: str  # the first sentence of every document made from it; "" for a real session
    forces: bool
    complete: bool
    rows: tuple[TrialRow, ...]
    losses: tuple[str, ...]
    made_by: Mapping[str, str]  # versions of software
    sha256: str = ""  # of its `session.sqlite`
    content_sha256: str = ""  # of its plan, readings and events: the same in every copy and import
    sealed: str = ""  # whether predictions were sealed before scores, "" without predictions
    decisions: tuple[str, ...] = ()  # of people about its strokes, in force
    calibration: str = ""  # uncertainty of the calibration in its intervals, set or assumed
    model: tuple[tuple[str, str, str], ...] = ()  # facts about the model: name, value, remark


def visit_of(recording: Recording, options: VisitOptions, made_by: Mapping[str, str]) -> Visit:
    """Return a session's visit: analysed, and with predictions where it has forces.

    Raises Blinded while the stimuli's key is sealed, RecordingError where the session cannot be read.
    """
    recording = reveal(recording)
    if recording.plan.blinded:
        raise Blinded(STILL_BLINDED)
    gain_error = gain_error_set(recording.folder) if options.gain_error is None else options.gain_error
    analysis = analyse(recording, AnalysisSettings(area=options.area, gain_error=gain_error))
    prediction = None
    if recording.plan.forces:
        prediction = with_intervals(predict(analysis, recording.plan, options.prediction), both_ways=False)
    paths: Mapping[int, Values] = {}
    if options.paths != "none" and prediction is not None:
        paths = trial_paths(recording, prediction, finite=options.paths == "finite", quantity=BY_NAME[options.quantity])
    return visit_from(recording, analysis, prediction, paths, made_by)


def visit_from(
    recording: Recording,
    analysis: Analysis,
    prediction: SessionPrediction | None,
    paths: Mapping[int, Values],
    made_by: Mapping[str, str],
) -> Visit:
    """Return the visit of an analysed session; `paths` holds a quantity of each trial along many paths.

    Raises Blinded while the stimuli's key is sealed.
    """
    records = {record.trial.number: record for record in recording.trials}
    rows = tuple(
        replace(_row(block, position, records[trial.number], analysis, prediction), paths=paths.get(trial.number, ()))
        for block in recording.plan.blocks
        if block.phase == "main"
        for position, trial in enumerate(block.trials)
    )
    numbers = [{name: getattr(row, name) for name in SEAL_NUMBERS} for row in (prediction.trials if prediction else ())]
    end_record = recording.end
    return Visit(
        session=recording.folder.name,
        subject=recording.plan.subject,
        protocol=recording.plan.protocol,
        simulated=recording.simulated_sentence or "",
        forces=recording.plan.forces,
        complete=end_record is not None and bool(end_record.get("complete")),
        rows=rows,
        losses=(*recording.losses, *recording.flaws),
        made_by=dict(made_by),
        sha256=file_sha256(recording.folder / LIVE_FILE),
        content_sha256=content_sha256(recording),
        sealed="" if prediction is None else sealed_sentence(recording, numbers),
        decisions=tuple(decision.sentence for decision in analysis.decisions),
        calibration=analysis.bootstrap.calibration,
        model=tuple(fact for fact in model_facts(prediction) if fact[0] != "audits"),
    )


def scores_of(visit: Visit, rows: Sequence[TrialRow]) -> ScoreTable:
    """Return the scores in some rows of a visit."""
    scores = tuple(
        Score(visit.subject, row.descriptor, row.index, row.score, row.block) for row in rows if row.score is not None
    )
    return ScoreTable(visit.session, visit.subject, bool(visit.simulated), scores)


def _row(
    block: Block, position: int, record: TrialRecord, analysis: Analysis, prediction: SessionPrediction | None
) -> TrialRow:
    trial = record.trial
    flaw_names = (str(flaw.name) for flaw in analysis.flaws if flaw.trial == trial.number and flaw.grade != "note")
    friction = next((stroke for stroke in analysis.friction if stroke.trial == trial.number), None)
    predictions = () if prediction is None else prediction.trials
    answer = next((answer for answer in predictions if answer.trial == trial.number), None)
    columns: dict[str, Any]
    if friction is not None:
        columns = _friction_columns(friction, analysis) | ({} if answer is None else _prediction_columns(answer))
    elif record.outcome == "open":
        columns = {"why": "The trial was not done."}
    else:
        columns = {"why": "The visit recorded no forces." if answer is None else answer.reasons.get("sed", "")}
    return TrialRow(
        trial=trial.number,
        block=block.name,
        descriptor=trial.stimulus.descriptor,
        index=trial.stimulus.known_index,
        code=trial.stimulus.code,
        direction=trial.direction,
        repetition=trial.repetition,
        place=position,
        before=block.trials[position - 1].stimulus.known_index if position else None,
        outcome=record.outcome,
        score=record.score,
        estimate=record.number,
        choice=record.choice,
        standard=None if block.standard is None else block.standard.known_index,
        flaws=tuple(dict.fromkeys(flaw_names)),
        **columns,
    )


def _friction_columns(friction: FrictionParameters, analysis: Analysis) -> dict[str, Any]:
    stroke, intervals = analysis.strokes[friction.stroke], analysis.intervals[friction.stroke]
    columns: dict[str, Any] = {
        "rule": friction.rule,
        "mu_dynamic": stroke.mu_dynamic,
        "mu_static": stroke.mu_static,
        "tangential_force": stroke.tangential_force,
        "contact_area": friction.contact_area,
    }
    for name, value, ends in (
        ("mu", friction.mu, intervals.mu_max if friction.rule == "maximum" else intervals.mu_dynamic),
        ("tau_max", friction.tau_max, intervals.tau_max),
        ("speed", friction.speed, intervals.speed),
        ("normal_force", stroke.normal_force, intervals.normal_force),
    ):
        low, high = (None, None) if value is None or ends is None else ends
        columns |= {name: value, f"{name}_low": low, f"{name}_high": high}
    return columns


def _prediction_columns(answer: TrialPrediction) -> dict[str, Any]:
    interval = answer.interval
    return {
        "sed": answer.sed,
        "sed_low": None if interval is None else interval.low,
        "sed_high": None if interval is None else interval.high,
        "sed_interval": NO_INTERVAL if interval is None else interval.reason or f"by {interval.method}",
        "error_estimate": answer.error_estimate,
        "responses": {name: response.value for name, response in answer.responses.items()},
        "indentation": answer.indentation,
        "model_normal_force": answer.normal_force,
        "model_normal_force_error": answer.normal_force_error,
        "matching_depth": answer.matching_depth,
        "why": answer.reasons.get("sed", ""),
        "doubt": "" if answer.prediction is None else doubt_of(answer.prediction),
    }
