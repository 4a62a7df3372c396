"""The analysis of a whole recording: its strokes, their friction for the model, and every flaw."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import msgspec

from drivers.readings import ReadingBlock
from sessions.plan.plan import Trial
from sessions.recording import Recording
from sessions.recording.derived import complete
from sessions.strokes.bootstrap import StrokeIntervals, stroke_intervals
from sessions.strokes.decisions import OF_SESSION, Decision, DecisionError, Decisions, Value, read
from sessions.strokes.settings import AnalysisSettings, BootstrapSettings
from sessions.strokes.stroke import Flaw, FlawName, FrictionParameters, Stroke, friction_parameters
from sessions.strokes.trial_analysis import Press, Tilt, TrialContext, analyse_trial, strokes_for_model, tilt_of
from sessions.toml_file import SettingsError, from_table

Blocks = Iterable[tuple[Trial | None, ReadingBlock]]  # readings of trials, or of a recording without any (None)


@dataclass(frozen=True, slots=True)
class Analysis:
    """Results of the analysis of a recording."""

    simulated: bool
    strokes: tuple[Stroke, ...]  # in order of time
    friction: tuple[FrictionParameters, ...]  # one for each trial with a stroke; without trials one for each stroke
    flaws: tuple[Flaw, ...]
    filtered: str  # what was done to the forces, for people
    settings: AnalysisSettings
    decisions: tuple[Decision, ...] = ()  # of people, in force
    presses: tuple[Press, ...] = ()  # that measure the tilt of the face
    intervals: tuple[StrokeIntervals, ...] = ()  # of each stroke's numbers

    @property
    def tilt(self) -> Tilt | None:
        """Return the tilt of the face against the transducer; None without a press."""
        return tilt_of(self.presses, self.settings)

    @property
    def bootstrap(self) -> BootstrapSettings:
        """Return the settings of the intervals; the tilt is measured where there are enough presses."""
        settings, tilt = self.settings, self.tilt
        gain_error, cross_talk = settings.gain_uncertainty, settings.systematic.cross_talk
        prior = settings.systematic.tilt_prior
        bootstrap = BootstrapSettings(
            seed=settings.bootstrap_seed,
            gain_error=gain_error,
            gain_error_origin="assumed" if settings.gain_error is None else "set",
            cross_talk=gain_error if cross_talk is None else cross_talk,
            tilt_error=(prior, prior),
            confidence=settings.confidence,
            detector=settings.detector,
            climb=settings.climb,
        )
        if tilt is None or len(tilt.presses) < settings.press.press_fewest:  # the hand's own push is not known
            return bootstrap
        count, lean = len(tilt.presses), (tilt.lean[0] - settings.tilt[0], tilt.lean[1] - settings.tilt[1])
        return replace(
            bootstrap, tilt=lean, tilt_error=tilt.error, tilt_presses=count, tilt_origin=f"by {count} presses"
        )

    @property
    def flawed(self) -> bool:
        """Say whether anything was lost or is doubtful; a tilt without enough presses is only noted."""
        return any(flaw.name is not FlawName.TILT_ASSUMED for flaw in self.flaws)

    def to_dict(self) -> dict[str, Any]:
        """Return the analysis as plain data, None for withheld numbers, without curves."""
        return {
            **({"simulated": "SIMULATED"} if self.simulated else {}),
            "strokes": [stroke.to_dict() for stroke in self.strokes],
            "friction": [asdict(parameters) for parameters in self.friction],
            "flaws": [asdict(flaw) for flaw in self.flaws],
            "decisions": [decision.to_dict() for decision in self.decisions],
            "tilt": None if self.tilt is None else asdict(self.tilt),
            "filter": self.filtered,
            "interval": self.bootstrap.kind,
            "settings": self.settings.to_dict(),
            "settings_origin": "default" if self.settings == AnalysisSettings() else "set",
        }


def analyse(
    recording: Recording, settings: AnalysisSettings | None = None, decisions: Decisions | None = None
) -> Analysis:
    """Return the strokes of a recording: within each trial's valid take, or anywhere if there are no trials.

    Trials of practice and pre-evaluation are not part of the experiment: only their presses are used. `decisions`
    default to those in the session's folder. Raises RecordingError where their file cannot be read.
    """
    decisions = read(recording.folder) if decisions is None else decisions
    settings = settings or AnalysisSettings()
    if decisions.tilt is not None:
        settings = replace(settings, tilt=decisions.tilt)
    losses = [Flaw(FlawName.RECORDING, sentence, "doubtful") for sentence in (*recording.losses, *recording.flaws)]
    if recording.info is None:
        return Analysis(recording.simulated, (), (), tuple(losses), "no forces were recorded", settings)
    takes = [record.trial for record in recording.trials if record.take]
    main = [(trial, recording.readings(trial.number)) for trial in takes if trial.phase == "main"]
    warm_up = [(trial, recording.readings(trial.number)) for trial in takes if trial.phase != "main"]
    context = TrialContext(recording.plan, recording.info, settings, decisions)
    analysis = _without_intervals(main if recording.plan.blocks else [(None, recording.readings())], context)
    presses = _without_intervals(warm_up, context._replace(decisions=Decisions())).presses + analysis.presses
    analysis = replace(analysis, simulated=recording.simulated, presses=presses)
    return _with_intervals(replace(analysis, flaws=(*losses, *analysis.flaws, *_assumed_tilt_flaw(analysis))))


def analyse_blocks(blocks: Blocks, context: TrialContext) -> Analysis:
    """Return the strokes in the readings of trials."""
    return _with_intervals(_without_intervals(blocks, context))


def _without_intervals(blocks: Blocks, context: TrialContext) -> Analysis:
    """Return an analysis without intervals, which depend on all presses of a session."""
    plan, info, settings, decisions = context
    strokes: list[Stroke] = []
    friction: list[FrictionParameters] = []
    presses: list[Press] = []
    flaws = [Flaw(FlawName.DECISION, problem, "doubtful") for problem in decisions.problems]
    filtered = ""
    for trial, block in blocks:
        result = analyse_trial(trial, block, context)
        trial_number = None if trial is None else trial.number
        flaws += [
            replace(flaw, trial=trial_number, stroke=None if flaw.stroke is None else flaw.stroke + len(strokes))
            for flaw in result.flaws
        ]
        friction += [
            friction_parameters(stroke, len(strokes) + stroke.number - 1, trial, plan.contact_area)
            for stroke in strokes_for_model(result.strokes, trial, decisions)
        ]
        strokes += result.strokes
        presses += result.presses
        filtered = filtered or result.filtered
    flaws += _decisions_without_stroke(decisions, strokes)
    results = tuple(strokes), tuple(friction), tuple(flaws), filtered, settings, decisions.in_force, tuple(presses)
    return Analysis(info.simulated, *results)


def _with_intervals(analysis: Analysis) -> Analysis:
    bootstrap = analysis.bootstrap
    intervals = tuple(stroke_intervals(stroke, position, bootstrap) for position, stroke in enumerate(analysis.strokes))
    strokes = tuple(
        replace(stroke, mu_dynamic_interval=interval.mu_dynamic)
        for stroke, interval in zip(analysis.strokes, intervals, strict=True)
    )
    friction = tuple(
        replace(row, mu_interval=getattr(intervals[row.stroke], "mu_max" if row.rule == "maximum" else "mu_dynamic"))
        for row in analysis.friction
    )
    return replace(analysis, strokes=strokes, friction=friction, intervals=intervals)


def _assumed_tilt_flaw(analysis: Analysis) -> Iterable[Flaw]:
    """Yield a note where friction depends on a tilt that too few presses measure."""
    count, fewest = len(analysis.presses), analysis.settings.press.press_fewest
    if count < fewest and any(stroke.mu_dynamic is not None for stroke in analysis.strokes):
        prior = analysis.settings.systematic.tilt_prior
        too_few = {0: "No press has measured", 1: "One press is too few to measure"}
        sentence = (
            f"{too_few.get(count, f'{count} presses are too few to measure')} the tilt of the face: intervals of "
            f"friction assume a standard deviation of {prior:g}° about each axis. Press {fewest} times without sliding "
            "to narrow them."
        )
        yield Flaw(FlawName.TILT_ASSUMED, sentence, "note")


def _decisions_without_stroke(decisions: Decisions, strokes: Iterable[Stroke]) -> Iterable[Flaw]:
    """Yield a flaw for each decision about a stroke that does not exist, or that is left out."""
    is_kept: dict[tuple[int | None, Value], bool] = {(stroke.trial, stroke.number): stroke.kept for stroke in strokes}
    for decision in decisions.in_force:
        if decision.what in OF_SESSION:
            continue
        stroke = (decision.trial, decision.new if decision.what == "choice" else decision.stroke)
        if stroke not in is_kept or (decision.what == "choice" and not is_kept[stroke]):
            state = "left out, or not found" if stroke in is_kept else "not found"
            sentence = f"Stroke {stroke[1]} is {state}, so nothing is changed by {decision.sentence}."
            yield Flaw(FlawName.DECISION, sentence, "doubtful", trial=decision.trial)


def with_present(analysis: Analysis, decision: Decision) -> Decision:
    """Return a decision with the present value in `old`. Raises DecisionError where there is no such stroke."""
    if decision.undoes is not None:
        return decision
    if decision.what == "tilt":
        return replace(decision, old=analysis.settings.tilt)
    strokes = [stroke for stroke in analysis.strokes if stroke.trial == decision.trial]
    if decision.stroke is None:
        position = next((row.stroke for row in analysis.friction if row.trial == decision.trial), None)
        return replace(decision, old=None if position is None else analysis.strokes[position].number)
    for stroke in strokes:
        if stroke.number == decision.stroke:
            onset, end = stroke.onset, stroke.break_away
            stick = None if onset is None or end is None else (onset, end)
            return replace(decision, old=stick if decision.what == "stick" else getattr(stroke, decision.what))
    count = f"it has {len(strokes)}" if strokes else "none was found in it"
    raise DecisionError(f"there is no {decision.target_text}: {count}")


def preview(recording: Recording, decision: Decision, decisions: Decisions, present: Analysis) -> Analysis:
    """Return the analysis with one more decision; `present` is the analysis without it.

    Raises DecisionError where the decision is not possible or has no effect.
    """
    settings = replace(present.settings, tilt=(0.0, 0.0))  # the decisions set the tilt
    changed = analyse(recording, settings, decisions.with_line(decision))
    present_sentences = {flaw.sentence for flaw in present.flaws}
    for flaw in changed.flaws:
        if flaw.name is FlawName.DECISION and flaw.sentence not in present_sentences and decision.undoes is None:
            raise DecisionError(f"{flaw.sentence}{_extent(present, decision)}")
    return changed


def _extent(analysis: Analysis, decision: Decision) -> str:
    """Return a sentence with the ends of a decision's stroke; empty where they are not known."""
    for stroke in analysis.strokes:
        ends = stroke.onset, stroke.lift
        if (stroke.trial, stroke.number) == (decision.trial, decision.stroke) and None not in ends:
            return " The stroke lasts from {:.3f} to {:.3f} s.".format(*ends)
    return ""


# Settings missing in documents of older programs: the first four not drawn before 2026-11-23, the others not stored
# before 2026-11-25. Needed as long as such documents are read.
_NEWER = (
    *("cross_talk", "tilt", "tilt_error", "tilt_origin", "tilt_presses"),
    *("top_alike", "most_alike", "least_free", "climb_ends", "detector", "climb"),
    *("onset_fewest", "onset_most", "onset_steep", "onset_reach"),
)
_DEFAULTS = {name: getattr(BootstrapSettings(), name) for name in _NEWER}
_REPLACED = ("tilt_from_presses",)  # in documents from before 2026-11-25; `tilt_presses` replaces it


class _Intervals(msgspec.Struct):
    kind: str
    settings: dict[str, Any]  # checked below; older programs drew fewer
    strokes: tuple[StrokeIntervals, ...]


class _Settings(msgspec.Struct):
    settings: BootstrapSettings


class _Analysis(msgspec.Struct):
    """The parts of an analysis that the program itself reads."""

    made_by: dict[str, str]
    strokes: tuple[Stroke, ...]
    friction: tuple[FrictionParameters, ...]
    flaws: tuple[Flaw, ...]
    interval: str
    decisions: tuple[Decision, ...]
    bootstrap: _Intervals


def check_analysis(document: Mapping[str, Any]) -> None:
    """Raise ValueError, with place and expected value, where a document is not an analysis of this program."""
    analysis = complete(document, _Analysis)
    if len(analysis.bootstrap.strokes) != len(analysis.strokes):
        raise SettingsError("it has intervals of another number of strokes")
    unknown = [row.stroke for row in analysis.friction if not 0 <= row.stroke < len(analysis.strokes)]
    if unknown:
        raise SettingsError(f"it gives the friction of stroke {unknown[0]}, which it does not hold")
    complete({"settings": {**_DEFAULTS, **analysis.bootstrap.settings}}, _Settings)
    bootstrap_settings(analysis.bootstrap.settings)


def bootstrap_settings(stored: Mapping[str, Any]) -> BootstrapSettings:
    """Return the settings of stored intervals, with defaults for those of newer programs. Raises SettingsError."""
    current = {name: value for name, value in stored.items() if name not in _REPLACED}
    return from_table(current, BootstrapSettings, "bootstrap")
