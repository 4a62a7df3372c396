"""The analysis of a whole recording: its strokes, the friction the model gets of them, and every flaw."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.analysis.contacts import Contact, contacts, split_at_valleys
from sessions.analysis.flaws import Flaw, FlawName
from sessions.analysis.friction import FrictionParameters, friction_parameters
from sessions.analysis.measure import measured
from sessions.analysis.onset import Baseline, onset_threshold
from sessions.analysis.settings import AnalysisSettings
from sessions.analysis.soundness import soundness
from sessions.analysis.span import Span, ZeroInForce, recorded_zero, span_of, zero_for
from sessions.analysis.stroke import Stroke
from sessions.decisions import Decided, Decision, Decisions, read
from sessions.plan import SessionPlan, Trial

if TYPE_CHECKING:  # the runner imports the detector from here: it must not pay for the reader
    from sessions.recording.reader import Recording

ZERO_SETTING = "zero"  # of `TransducerInfo.settings`: who says that the recording's own zero is true
ZERO_STATED = "as recorded, stated to be true"
RAW_WRENCH = "N, N mm"  # raw unit of readings that came as a wrench


@dataclass(frozen=True, slots=True)
class Analysis:
    """What the readings of a recording say."""

    simulated: bool
    strokes: tuple[Stroke, ...]  # in order of time
    friction: tuple[FrictionParameters, ...]  # one for each trial with a stroke; without trials one for each stroke
    flaws: tuple[Flaw, ...]
    filtered: str  # what was done to the forces, for people
    settings: AnalysisSettings
    decisions: tuple[Decision, ...] = ()  # of people, in force

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, None where honesty allows no number; curves are left out."""
        return {
            **({"simulated": "SIMULATED"} if self.simulated else {}),
            "strokes": [stroke.to_dict() for stroke in self.strokes],
            "friction": [asdict(parameters) for parameters in self.friction],
            "flaws": [asdict(flaw) for flaw in self.flaws],
            "decisions": [decision.to_dict() for decision in self.decisions],
            "filter": self.filtered,
            "interval": self.settings.interval_kind,
            "settings": asdict(self.settings),
            "settings_origin": "default" if self.settings == AnalysisSettings() else "set",
        }


def analyse(
    recording: "Recording", settings: AnalysisSettings | None = None, decisions: Decisions | None = None
) -> Analysis:
    """Return the strokes of a recording: within each trial's valid take, or anywhere where it has no trials.

    Trials of practice and pre-evaluation are left out: they are no part of the experiment. `decisions` are those kept
    in the session's folder, unless others are given. Raises RecordingError where their file cannot be read.
    """
    chosen = settings or AnalysisSettings()
    decided = read(recording.folder) if decisions is None else decisions
    told = [Flaw(FlawName.RECORDING, sentence, "doubtful") for sentence in (*recording.losses, *recording.flaws)]
    if recording.info is None:
        return Analysis(recording.simulated, (), (), tuple(told), "no forces were recorded", chosen)
    parts: list[tuple[Trial | None, ReadingBlock]] = (
        [
            (record.trial, recording.readings(record.trial.number))
            for record in recording.trials
            if record.take and record.trial.phase == "main"
        ]
        if recording.plan.blocks
        else [(None, recording.readings())]
    )
    found = analyse_blocks(parts, recording.plan, recording.info, chosen, told, decided)
    return replace(found, simulated=recording.simulated)


def analyse_blocks(
    parts: Iterable[tuple[Trial | None, ReadingBlock]],
    plan: SessionPlan,
    info: TransducerInfo,
    settings: AnalysisSettings,
    told: Iterable[Flaw] = (),
    decisions: Decisions | None = None,
) -> Analysis:
    """Return the strokes in the readings of trials, or of a recording without any (trial None)."""
    decided = decisions or Decisions()
    strokes: list[Stroke] = []
    friction: list[FrictionParameters] = []
    flaws = [*told, *(Flaw(FlawName.DECISION, problem, "doubtful") for problem in decided.problems)]
    filtered = ""
    for trial, block in parts:
        found = _of_part(trial, block, plan, info, settings, decided)
        number = None if trial is None else trial.number
        flaws += [
            replace(flaw, trial=number, stroke=None if flaw.stroke is None else flaw.stroke + len(strokes))
            for flaw in found.flaws
        ]
        friction += [
            friction_parameters(stroke, len(strokes) + stroke.number - 1, trial, plan.contact_area)
            for stroke in _given(found.strokes, trial, decided)
        ]
        strokes += found.strokes
        filtered = filtered or found.filtered
    flaws += _without_stroke(decided, strokes)
    return Analysis(info.simulated, tuple(strokes), tuple(friction), tuple(flaws), filtered, settings, decided.in_force)


def _given(strokes: tuple[Stroke, ...], trial: Trial | None, decided: Decisions) -> tuple[Stroke, ...]:
    """Return the strokes of a part that the model gets: of a trial the one decided, or else the first that is kept."""
    kept = tuple(stroke for stroke in strokes if stroke.kept)
    choice = None if trial is None else decided.choice(trial.number)
    if choice is not None:
        chosen = tuple(stroke for stroke in kept if stroke.number == choice.new)
        kept = chosen or kept
    return kept if trial is None else kept[:1]


def _without_stroke(decided: Decisions, strokes: Iterable[Stroke]) -> list[Flaw]:
    """Name each decision that means no stroke that was found."""
    there = {(stroke.trial, stroke.number) for stroke in strokes}
    kept = {(stroke.trial, stroke.number) for stroke in strokes if stroke.kept}
    flaws: list[Flaw] = []
    for one in decided.in_force:
        meant = (one.trial, one.new if one.what == "choice" else one.stroke)
        if meant not in (kept if one.what == "choice" else there):
            what = "left out, or not found" if meant in there else "not found"
            sentence = f"Stroke {meant[1]} is {what}, so nothing is changed by {one.sentence}."
            flaws.append(Flaw(FlawName.DECISION, sentence, "doubtful", trial=one.trial))
    return flaws


@dataclass(frozen=True, slots=True)
class _Part:
    strokes: tuple[Stroke, ...]
    flaws: tuple[Flaw, ...]  # `stroke` counts within the part
    filtered: str


def _of_part(
    trial: Trial | None,
    block: ReadingBlock,
    plan: SessionPlan,
    info: TransducerInfo,
    settings: AnalysisSettings,
    decided: Decisions,
) -> _Part:
    if len(block) < settings.detector.baseline_readings:
        sentence = f"Only {len(block)} readings: too few for a stroke."
        return _Part((), (Flaw(FlawName.NO_STROKE, sentence, "refused"),), "")
    sound = soundness(block, info.calibration, settings)
    flaws = [Flaw(name, sentence, grade) for name, sentence, grade in sound.flaws]
    if sound.refused:
        return _Part((), tuple(flaws), "")
    span = span_of(block, sound, info.calibration, plan.frame, settings)
    found, more = _strokes(span, plan, info, settings, trial, decided)
    return _Part(found, (*flaws, *more), span.filtered)


def _strokes(
    span: Span,
    plan: SessionPlan,
    info: TransducerInfo,
    settings: AnalysisSettings,
    trial: Trial | None,
    decisions: Decisions,
) -> tuple[tuple[Stroke, ...], list[Flaw]]:
    """Find and measure the strokes of a span."""
    stated = info.settings.get(ZERO_SETTING) == ZERO_STATED
    fallback = recorded_zero(span, stated=stated) if stated or info.calibration.raw_unit == RAW_WRENCH else None
    first = span.windows.after(-np.inf, settings.zero_stretch)
    if stated and fallback is not None:
        general = fallback
    elif first is not None:
        general = ZeroInForce(first.level, first.noise, first.error, "", None, (0.0, 0.0), None)
    elif fallback is not None:
        general = fallback
    else:
        sentence = "No stretch is unloaded: without a zero the readings of this transducer show no contact."
        return (), [Flaw(FlawName.NO_UNLOADED_STRETCH, sentence, "refused")]
    normal = -(span.wrench[:, 2] - general.level[2])
    implausible = _normal_trouble(normal, float(general.noise[2]), plan.frame.normal, settings)
    if implausible is not None:
        return (), [implausible]
    unknown = general.flaw is FlawName.NO_UNLOADED_STRETCH
    threshold = settings.light_share * float(np.percentile(normal, 99.9))
    noise = threshold / settings.detector.onset_noise if unknown else float(general.noise[2])
    touching = contacts(span.time, normal, Baseline(0.0, noise), settings)
    smooth = -(span.smooth[:, 2] - general.level[2])
    pieces = [piece for contact in touching for piece in split_at_valleys(contact, span.time, smooth, settings)]
    idle = np.ones(len(span.time), np.bool_)
    for contact in touching:
        idle[contact.start : contact.stop] = False
    kept, flaws = _worth_measuring(pieces, span, smooth, settings)
    number = None if trial is None else trial.number
    decided = [decisions.of_stroke(number, at) for at in range(1, len(kept) + 1)]
    for at, (piece, one) in enumerate(zip(kept, decided, strict=True)):
        kept[at], unlike = _moved(piece, one, span)
        flaws += [] if unlike is None else [replace(unlike, stroke=at)]
        idle[kept[at].start : kept[at].stop] = False
    strokes: list[Stroke] = []
    for at, piece in enumerate(kept):
        zero = general if stated else zero_for(span, piece, idle, settings) or recorded_zero(span, stated=False)
        stroke, more = measured(span, piece, zero, plan.frame, plan.contact_area, settings, trial, at + 1, decided[at])
        flaws += [replace(flaw, stroke=len(strokes)) for flaw in more]
        strokes.append(stroke)
    if not strokes:
        flaws.append(Flaw(FlawName.NO_STROKE, "No contact is a stroke.", "refused"))
    allowed = 1 if trial is None else plan.strokes_allowed(trial)
    if trial is not None and len(strokes) > allowed:
        asked = "one" if allowed == 1 else f"up to {allowed}"
        model = next((stroke.number for stroke in _given(tuple(strokes), trial, decisions)), None)
        gets = "none, as was decided" if model is None else "the first" if model == 1 else f"the one numbered {model}"
        sentence = f"{len(strokes)} strokes in a trial that asks for {asked}: the model gets {gets}."
        flaws.append(Flaw(FlawName.SECOND_STROKE, sentence, "doubtful"))
    return tuple(strokes), flaws


def _moved(piece: Contact, decided: Decided, span: Span) -> tuple[Contact, Flaw | None]:
    """Return a contact with the onset and lift that were decided; as it is, with a flaw, where nothing is between."""
    onset, lift = decided.instant("onset"), decided.instant("lift")
    start = piece.start if onset is None else int(np.searchsorted(span.time, onset))
    stop = piece.stop if lift is None else int(np.searchsorted(span.time, lift))
    if stop - start < 2:
        sentence = "No readings lie between the onset and the lift that were decided: they stay as they were found."
        return piece, Flaw(FlawName.DECISION, sentence, "doubtful")
    ends = piece.onset if onset is None else onset, piece.lift if lift is None else lift
    return replace(piece, start=start, stop=stop, onset=ends[0], lift=ends[1]), None


def _normal_trouble(normal: np.ndarray[Any, Any], noise: float, axis: str, settings: AnalysisSettings) -> Flaw | None:
    """Refuse a normal axis along which the recording pulls rather than presses."""
    low, high = np.percentile(normal, [0.5, 99.5])
    if -low <= max(0.5 * high, onset_threshold(noise, settings.detector)):
        return None
    sentence = (
        f"Along {axis} the recording reaches {high:.3g} N pressing but {-low:.3g} N pulling, and a finger does not "
        "pull: the normal axis is another one, or there is none; no stroke is told."
    )
    return Flaw(FlawName.NORMAL_IMPLAUSIBLE, sentence, "refused")


def _worth_measuring(
    pieces: list[Contact], span: Span, smooth: np.ndarray[Any, Any], settings: AnalysisSettings
) -> tuple[list[Contact], list[Flaw]]:
    """Leave out taps and light touches, and name them."""
    peaks = [float(np.nanmax(smooth[piece.start : piece.stop], initial=0.0)) for piece in pieces]
    greatest = max(peaks, default=0.0)
    kept: list[Contact] = []
    flaws: list[Flaw] = []
    for piece, peak in zip(pieces, peaks, strict=True):
        start, stop = span.time[piece.start], span.time[piece.stop - 1]
        if stop - start >= settings.shortest_stroke and peak >= settings.light_share * greatest:
            kept.append(piece)
        else:
            sentence = f"A light or short touch from {start:.2f} to {stop:.2f} s, up to {peak:.2g} N, is no stroke."
            flaws.append(Flaw(FlawName.LIGHT_TOUCH, sentence, "note"))
    return kept, flaws
