"""Numbers derived from a session: computed, kept in its folder, and computed again to verify them."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from daq_app.console import Console, WrongValue
from sessions.file_access import as_type
from sessions.plan.plan import SessionPlan
from sessions.plan.study import StudyError, is_study
from sessions.prediction import PredictionOptions, Progress, SessionPrediction, part_of, predict
from sessions.prediction.afferent import AfferentSettings, firing_document
from sessions.prediction.stored import check_prediction, with_present_names
from sessions.prediction.uncertainty import with_alternatives, with_intervals
from sessions.recording import Recording, RecordingError
from sessions.recording.derived import (
    differences,
    explain_differences,
    first_sentences,
    force_visit,
    gain_error_set,
    load_derived,
    parse_gain_error,
    reveal,
    sessions_of,
    set_gain_error,
    store_derived,
)
from sessions.recording.head import software_versions
from sessions.strokes import Analysis, AnalysisSettings, analyse
from sessions.strokes.analysis import bootstrap_settings, check_analysis
from sessions.strokes.bootstrap import intervals_document, stroke_intervals
from sessions.strokes.decisions import Decision, Decisions
from sessions.strokes.settings import BootstrapSettings
from sessions.strokes.stroke import AreaLaw
from sessions.toml_file import SettingsError, from_table

ANALYSIS = "analysis.json"
PREDICTION = "prediction.json"
_VERBS = {ANALYSIS: "analyse", PREDICTION: "predict"}  # verbs that compute them
_SETTINGS = {  # settings that a person may have chosen
    ANALYSIS: "law of the contact area and seed of the intervals",
    PREDICTION: "options and afferent of the prediction",
}
_RANK = ("none", "small", "both").index  # of variants


def analyse_session(
    recording: Recording,
    console: Console,
    area: AreaLaw | None = None,
    *,
    seed: int | None = None,
    gain_error: float | None = None,
) -> Analysis:
    """Return the analysis of a session, with tau_max by a law of the area, and keep it in the session's folder.

    `seed` is that of its intervals; `gain_error` is the standard uncertainty of each axis's gain [-]. By default area
    and seed are those of the stored analysis, and the gain's error is the one last set, so that a verb without these
    options keeps earlier settings. Raises RecordingError if the gain's error is damaged.
    """
    previous = _read_or_empty(recording, ANALYSIS, console)
    if gain_error is None:
        gain_error = gain_error_set(recording.folder)
    else:
        _keep(console, set_gain_error, recording.folder, gain_error)
    settings = settings_of(previous)
    seed = settings.bootstrap_seed if seed is None else seed
    settings = AnalysisSettings(area=area or settings.area, gain_error=gain_error, bootstrap_seed=seed)
    analysis = analyse(recording, settings)
    _keep(console, store_derived, recording.folder, ANALYSIS, analysis_document(analysis))
    return analysis


def stored_settings(recording: Recording) -> AnalysisSettings:
    """Return the settings last chosen for a session. Raises RecordingError if a file that holds them is damaged."""
    document = stored_document(recording.folder, ANALYSIS) or {}
    return replace(settings_of(document), gain_error=gain_error_set(recording.folder))


def outdated_prediction(recording: Recording, now: AnalysisSettings) -> str | None:
    """Return a sentence if the kept prediction has another law of the area, calibration error or seed; else None."""
    previous = _read_or_empty(recording, PREDICTION)
    if not previous:
        return None
    settings = settings_of(previous)
    reasons = ["another law of the contact area"] if settings.area != now.area else []
    reasons += ["another calibration error"] if settings.gain_error != now.gain_error else []
    reasons += ["another seed of the intervals"] if settings.bootstrap_seed != now.bootstrap_seed else []
    if not reasons:
        return None
    return f"{PREDICTION} was made with {' and '.join(reasons)}: 'daq-app predict' computes it again"


def stored_options(recording: Recording, variants: Literal["none", "small", "both"] = "none") -> PredictionOptions:
    """Return the options of the kept prediction, or the defaults, with at least these `variants`."""
    previous = _read_or_empty(recording, PREDICTION)
    options = from_table(previous.get("options", {}), PredictionOptions, PREDICTION)
    return replace(options, variants=max(options.variants, variants, key=_RANK))


def stored_afferent(recording: Recording) -> AfferentSettings | None:
    """Return the afferent's parameters kept with the prediction; None if none were kept."""
    return _afferent_of(_read_or_empty(recording, PREDICTION))


def _afferent_of(document: Mapping[str, Any]) -> AfferentSettings | None:
    """Return the afferent's parameters in a stored prediction; None if it has none. Raises SettingsError."""
    afferent: Mapping[str, Any] | None = document.get("afferent")
    return None if afferent is None else from_table(afferent.get("settings") or {}, AfferentSettings, PREDICTION)


def stored_document(folder: Path, name: str) -> dict[str, Any] | None:
    """Return the analysis or prediction kept in a session's folder; None if there is none.

    Raises RecordingError if it is damaged; the message says what it holds, or which verb computes it again.
    """
    verb = _VERBS[name]
    try:
        document = load_derived(folder, name)
        if document is not None:
            document = document if name == ANALYSIS else with_present_names(document)
            (check_analysis if name == ANALYSIS else check_prediction)(document)
            settings_of(document)
            _afferent_of(document)
    except RecordingError as damaged:
        sentence = str(damaged).replace("make it anew from the recording", f"'daq-app {verb}' computes it again")
        raise RecordingError(sentence) from damaged
    except (ValueError, AttributeError, TypeError) as damaged:
        usual = "its parts are not of the kinds that this program writes"
        reason = damaged if isinstance(damaged, ValueError) else usual
        raise RecordingError(f"{folder / name} is damaged ({reason}); 'daq-app {verb}' computes it again") from damaged
    return document


def _read_or_empty(recording: Recording, name: str, console: Console | None = None) -> Mapping[str, Any]:
    """Return a stored document; empty if there is none, or a damaged one.

    Callers that compute it again pass a `console`, which reports settings lost in a damaged one.
    """
    try:
        return stored_document(recording.folder, name) or {}
    except RecordingError as damaged:
        if console is not None:
            console.lose(f"{damaged}; the {_SETTINGS[name]} are now the default ones")
        return {}


def predict_session(
    recording: Recording,
    analysis: Analysis,
    console: Console,
    options: PredictionOptions,
    afferent: AfferentSettings | None = None,
) -> SessionPrediction:
    """Return the model's prediction for a session, and keep it in the session's folder.

    The firing of an `afferent` is kept with it; by default with the parameters kept before. Other parts that were
    kept before and are not computed again are named. Raises as `predict` does.
    """
    prediction = _predict(analysis, recording.plan, options, console.reporter("predicting"))
    previous = _read_or_empty(recording, PREDICTION, console)
    document = _with_firing(prediction, afferent or _afferent_of(previous))
    lost = _dropped_parts(previous, prediction.options)
    if _keep(console, store_derived, recording.folder, PREDICTION, document) and lost:
        console.note(f"{PREDICTION} no longer holds: {', '.join(lost)}")
    return prediction


def _with_firing(prediction: SessionPrediction, afferent: AfferentSettings | None) -> dict[str, Any]:
    firing = {} if afferent is None else {"afferent": firing_document(prediction, afferent)}
    return {**prediction.to_dict(), **firing}


def _dropped_parts(previous: Mapping[str, Any], now: PredictionOptions) -> list[str]:
    """Return the parts of a stored prediction that new options leave out, each with the option that requests it."""
    options = from_table(previous.get("options", {}), PredictionOptions, PREDICTION)
    lost = ["intervals of the SED (--intervals)"] if options.intervals and not now.intervals else []
    if previous and _RANK(options.variants) > _RANK(now.variants):
        lost.append(f"the variants side by side (--variants {options.variants})")
    return lost


def repeat(
    name: str, document: Mapping[str, Any], recording: Recording, decisions: Decisions, plan_of: Recording | None = None
) -> dict[str, Any]:
    """Compute an analysis or a prediction again, with the settings, options and blindness of its `document`.

    The plan is that of `plan_of` if `recording` is a replay of it. Raises SettingsError for a damaged document.
    """
    if name == ANALYSIS:
        bootstrap_table: Mapping[str, Any] = document.get("bootstrap") or {}
        bootstrap = bootstrap_settings(bootstrap_table.get("settings") or {}) if "bootstrap" in document else None
        return analysis_document(analyse(recording, settings_of(document), decisions), bootstrap)
    options = from_table(document.get("options", {}), PredictionOptions, PREDICTION)
    stimuli: list[Mapping[str, Any]] = [row.get("stimulus") or {} for row in document.get("trials", ())]
    blind = all(stimulus.get("index") is None for stimulus in stimuli)
    original = plan_of or recording
    plan = (original if blind else reveal(original)).plan
    prediction = _predict(analyse(recording, settings_of(document), decisions), plan, options, lambda _: True)
    return with_present_names(_with_firing(prediction, _afferent_of(document)))


def changes(name: str, document: Mapping[str, Any], fresh: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each number of a document that changed when computed again, with possible reasons."""
    sentences = first_sentences(list(differences(document, json.loads(json.dumps(fresh)), name)))
    if not sentences:
        return []
    reason = explain_differences(name, document, software_versions())
    return [*sentences, f"{reason}; 'daq-app {_VERBS[name]}' computes it again"]


def _predict(
    analysis: Analysis, plan: SessionPlan, options: PredictionOptions, progress: Progress
) -> SessionPrediction:
    """Return the prediction with all parts that its options request."""
    stages = 1 + options.intervals + (options.variants != "none")

    def stage_progress(number: int) -> Progress | None:
        return part_of(progress, number / stages, (number + 1) / stages)

    prediction = predict(analysis, plan, options, stage_progress(0))
    if options.intervals:
        prediction = with_intervals(prediction, stage_progress(1))
    return with_alternatives(prediction, stage_progress(stages - 1))


def analysis_document(analysis: Analysis, bootstrap: BootstrapSettings | None = None) -> dict[str, Any]:
    """Return an analysis in its stored form, with intervals, drawn again for another `bootstrap`."""
    settings, intervals = analysis.bootstrap, analysis.intervals
    if bootstrap is not None and bootstrap != settings:
        settings = bootstrap
        intervals = tuple(stroke_intervals(stroke, index, settings) for index, stroke in enumerate(analysis.strokes))
    return {**analysis.to_dict(), "bootstrap": intervals_document(settings, intervals)}


def settings_of(document: Mapping[str, Any]) -> AnalysisSettings:
    """Return the settings to repeat a stored analysis, or the one under a stored prediction.

    Only the area's law, the calibration's error and the intervals' seed can be set. Raises SettingsError.
    """
    settings: Mapping[str, Any] = document.get("settings") or document
    area = from_table(settings.get("area") or {}, AreaLaw, "area")
    seed = settings.get("bootstrap_seed", 0)
    if not isinstance(seed, int) or seed < 0:
        raise SettingsError(f"bootstrap_seed = {seed!r} is not allowed: a whole number from 0 on")
    return AnalysisSettings(area=area, gain_error=parse_gain_error(settings.get("gain_error")), bootstrap_seed=seed)


def is_current(document: Mapping[str, Any], decisions: Decisions) -> bool:
    """Say whether a stored document was made with the decisions that are in force now."""
    now = json.loads(json.dumps([decision.to_dict() for decision in decisions.in_force]))
    return document.get("decisions", []) == now


def stale_sentence(name: str, document: Mapping[str, Any], decisions: Decisions) -> str | None:
    """Return a sentence if a stored document was made with other decisions than those in force now, else None."""
    sentence = f"{name} was made under other decisions than those in force: compute it again"
    return None if is_current(document, decisions) else sentence


def decisions_of(document: Mapping[str, Any], now: Decisions) -> Decisions:
    """Return the decisions that a stored document was made with, and the problems of those `now`.

    Raises SettingsError if they are damaged.
    """
    try:
        return Decisions(as_type(document.get("decisions", []), tuple[Decision, ...]), now.problems)
    except ValueError as error:
        raise SettingsError(f"the decisions stored with it are damaged: {error}") from error


def open_visit(
    path: Path, subject: str | None, console: Console
) -> tuple[Recording, tuple[Recording, ...], tuple[str, ...]]:
    """Return a session, or a visit to a study with its other sessions, and a sentence for each that cannot be read.

    Raises RecordingError, StudyError, WrongValue.
    """
    if is_study(path):
        if subject is None:
            raise WrongValue(f"{path} is a study: choose the subject with --subject")
        sessions, unreadable = sessions_of(path)
        console.note(*unreadable)
        visit = force_visit(sessions, subject)
        if visit is None:
            raise StudyError(
                f"{subject} has no visit with forces in {path}: run one with --device, or give another code"
            )
        return visit, tuple(session for session in sessions if session is not visit), unreadable
    recording = reveal(Recording.open(path))
    if subject not in (None, recording.plan.subject):
        raise WrongValue(f"--subject {subject} is not allowed: {path} is a session of {recording.plan.subject}")
    return recording, (), ()


def _keep(console: Console, store: Callable[..., object], *facts: object) -> bool:
    """Store facts in a session's folder and return True; report a folder that cannot be written and return False."""
    try:
        store(*facts)
    except RecordingError as error:
        console.lose(f"not saved: {error}")
        return False
    return True
