"""The analysis of a whole recording: its strokes, the friction the model gets of them, and every flaw."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan, Trial
from sessions.strokes.bootstrap import StrokeIntervals, drawn_from, stroke_intervals
from sessions.strokes.contacts import Contact, contacts, split_at_reversals, split_at_valleys
from sessions.strokes.decisions import OF_SESSION, Decided, Decision, Decisions, read
from sessions.strokes.flaws import Flaw, FlawName
from sessions.strokes.friction import FrictionParameters, friction_parameters
from sessions.strokes.onset import Baseline, onset_threshold
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.signal_quality import signal_quality
from sessions.strokes.span import Span, ZeroInForce, recorded_zero, span_of, zero_for
from sessions.strokes.stroke import Stroke
from sessions.strokes.stroke_measures import measured
from sessions.strokes.tilt import Press, Tilt, press_of, tilt_of

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
    presses: tuple[Press, ...] = ()  # that tell how the face leans
    intervals: tuple[StrokeIntervals, ...] = ()  # of each stroke's numbers

    @property
    def tilt(self) -> Tilt | None:
        """Return how the face leans against the transducer; None where nothing pressed without sliding."""
        return tilt_of(self.presses, self.settings)

    @property
    def flawed(self) -> bool:
        """Say whether anything was lost or is doubtful; that no press tells the lean is only noted."""
        return any(flaw.name is not FlawName.TILT_ASSUMED for flaw in self.flaws)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, None where honesty allows no number; curves are left out."""
        return {
            **({"simulated": "SIMULATED"} if self.simulated else {}),
            "strokes": [stroke.to_dict() for stroke in self.strokes],
            "friction": [asdict(parameters) for parameters in self.friction],
            "flaws": [asdict(flaw) for flaw in self.flaws],
            "decisions": [decision.to_dict() for decision in self.decisions],
            "tilt": None if self.tilt is None else self.tilt.to_dict(),
            "filter": self.filtered,
            "interval": drawn_from(self.settings, self.tilt).kind,
            "settings": self.settings.to_dict(),
            "settings_origin": "default" if self.settings == AnalysisSettings() else "set",
        }


def analyse(
    recording: "Recording", settings: AnalysisSettings | None = None, decisions: Decisions | None = None
) -> Analysis:
    """Return the strokes of a recording: within each trial's valid take, or anywhere where it has no trials.

    Trials of practice and pre-evaluation are no part of the experiment: of them only presses are taken. `decisions` are
    those kept in the session's folder, unless others are given. Raises RecordingError where their file cannot be read.
    """
    decided = read(recording.folder) if decisions is None else decisions
    chosen = settings or AnalysisSettings()
    if decided.tilt is not None:
        chosen = replace(chosen, tilt=decided.tilt)
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
    aside = [
        (record.trial, recording.readings(record.trial.number))
        for record in recording.trials
        if record.take and record.trial.phase != "main"
    ]
    others = analyse_blocks(aside, recording.plan, recording.info, chosen).presses
    whole = replace(found, simulated=recording.simulated, presses=(*others, *found.presses))
    told = 0 if whole.tilt is None else len(whole.tilt.presses)
    if told < chosen.press.press_fewest and any(stroke.mu_dynamic is not None for stroke in whole.strokes):
        prior = chosen.systematic.tilt_prior
        sentence = (
            f"{told or 'No'} press{'es' if told > 1 else ''} cannot tell how the face leans: intervals of friction "
            f"allow for a standard deviation of {prior:g}° about each axis. Press {chosen.press.press_fewest} times "
            "without sliding to narrow them."
        )
        whole = replace(whole, flaws=(*whole.flaws, Flaw(FlawName.TILT_ASSUMED, sentence, "note")))
    return _with_intervals(whole) if others else whole


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
    presses: list[Press] = []
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
        presses += found.presses
        filtered = filtered or found.filtered
    flaws += _without_stroke(decided, strokes)
    return _with_intervals(
        Analysis(
            info.simulated,
            tuple(strokes),
            tuple(friction),
            tuple(flaws),
            filtered,
            settings,
            decided.in_force,
            tuple(presses),
        )
    )


def _with_intervals(analysis: Analysis) -> Analysis:
    """Return an analysis with the bootstrap intervals of its numbers."""
    drawn = drawn_from(analysis.settings, analysis.tilt)
    found = tuple(stroke_intervals(stroke, at, drawn) for at, stroke in enumerate(analysis.strokes))
    strokes = tuple(
        replace(stroke, mu_dynamic_interval=ends.mu_dynamic)
        for stroke, ends in zip(analysis.strokes, found, strict=True)
    )
    friction = tuple(
        replace(row, mu_interval=found[row.stroke].mu_max if row.rule == "maximum" else found[row.stroke].mu_dynamic)
        for row in analysis.friction
    )
    return replace(analysis, strokes=strokes, friction=friction, intervals=found)


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
        if one.what in OF_SESSION:
            continue
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
    presses: tuple[Press, ...] = ()


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
    sound = signal_quality(block, info, settings)
    flaws = [Flaw(name, sentence, grade) for name, sentence, grade in sound.flaws]
    if sound.refused:
        return _Part((), tuple(flaws), "")
    span = span_of(block, sound, info.calibration, plan.frame, settings)
    found, more, presses = _strokes(span, plan, info, settings, trial, decided)
    return _Part(found, (*flaws, *more), span.filtered, presses)


def _strokes(
    span: Span,
    plan: SessionPlan,
    info: TransducerInfo,
    settings: AnalysisSettings,
    trial: Trial | None,
    decisions: Decisions,
) -> tuple[tuple[Stroke, ...], list[Flaw], tuple[Press, ...]]:
    """Find and measure the strokes of a span, and the presses among them."""
    stated = info.settings.get(ZERO_SETTING) == ZERO_STATED
    general = _general_zero(span, info, settings, stated=stated)
    if general is None:
        sentence = "No stretch is unloaded: without a zero the readings of this transducer show no contact."
        return (), [Flaw(FlawName.NO_UNLOADED_STRETCH, sentence, "refused")], ()
    normal = -(span.wrench[:, 2] - general.level[2])
    implausible = _normal_trouble(normal, float(general.noise[2]), plan.frame.normal, settings)
    if implausible is not None:
        return (), [implausible], ()
    unknown = general.flaw is FlawName.NO_UNLOADED_STRETCH
    threshold = settings.contact.light_share * float(np.percentile(normal, 99.9))
    noise = threshold / settings.detector.onset_noise if unknown else float(general.noise[2])
    touching = contacts(span.time, normal, Baseline(0.0, noise), settings)
    smooth = -(span.smooth[:, 2] - general.level[2])
    pieces = [piece for contact in touching for piece in split_at_valleys(contact, span.time, smooth, settings)]
    idle = np.ones(len(span.time), np.bool_)
    for contact in touching:
        idle[contact.start : contact.stop] = False
    pieces = [
        one
        for piece in pieces
        for one in _ways(piece, span, general if stated else zero_for(span, piece, idle, settings), settings)
    ]
    kept, flaws = _worth_measuring(pieces, span, smooth, settings)
    number = None if trial is None else trial.number
    decided = [decisions.of_stroke(number, at) for at in range(1, len(kept) + 1)]
    for at, (piece, one) in enumerate(zip(kept, decided, strict=True)):
        kept[at], unlike = _moved(piece, one, span)
        flaws += [] if unlike is None else [replace(unlike, stroke=at)]
        idle[kept[at].start : kept[at].stop] = False
    strokes: list[Stroke] = []
    presses: list[Press] = []
    for at, piece in enumerate(kept):
        zero = general if stated else zero_for(span, piece, idle, settings) or recorded_zero(span, stated=False)
        stroke, more = measured(span, piece, zero, plan, settings, trial, at + 1, decided[at])
        flaws += [replace(flaw, stroke=len(strokes)) for flaw in more]
        strokes.append(stroke)
        if stroke.mu_dynamic is None and zero.flaw is not FlawName.NO_UNLOADED_STRETCH:
            press = press_of(span, piece, zero, plan.frame, number, settings)
            presses += [] if press is None else [press]
    flaws += _counted(tuple(strokes), trial, plan, decisions)
    return tuple(strokes), flaws, tuple(presses)


def _ways(piece: Contact, span: Span, zero: ZeroInForce | None, settings: AnalysisSettings) -> tuple[Contact, ...]:
    """Cut a contact where the finger turns, as far as its zero tells that."""
    if zero is None:
        return (piece,)
    return split_at_reversals(piece, span.time, span.smooth - zero.level, zero.unsure[0], settings)


def _general_zero(span: Span, info: TransducerInfo, settings: AnalysisSettings, *, stated: bool) -> ZeroInForce | None:
    """Return the zero that contacts are looked for with; None where nothing tells one."""
    if stated:
        return recorded_zero(span, stated=True)
    first = span.windows.after(-np.inf, settings.zero.zero_stretch)
    if first is not None:
        return ZeroInForce(first.level, first.noise, first.noise[:3], 0.0, first.error, "", None, (0.0, 0.0), None)
    return recorded_zero(span, stated=False) if info.calibration.raw_unit == RAW_WRENCH else None


def _counted(strokes: tuple[Stroke, ...], trial: Trial | None, plan: SessionPlan, decisions: Decisions) -> list[Flaw]:
    """Name it where there is no stroke, or more than the trial asks for."""
    if not strokes:
        return [Flaw(FlawName.NO_STROKE, "No contact is a stroke.", "refused")]
    allowed = 1 if trial is None else plan.strokes_allowed(trial)
    if trial is not None and len(strokes) > allowed:
        asked = "one" if allowed == 1 else f"up to {allowed}"
        model = next((stroke.number for stroke in _given(strokes, trial, decisions)), None)
        gets = "none, as was decided" if model is None else "the first" if model == 1 else f"the one numbered {model}"
        turned = any(FlawName.TURNED in stroke.flaws for stroke in strokes)
        ways = " (each way of a finger that turned without lifting is one)" if turned else ""
        sentence = f"{len(strokes)} strokes{ways} in a trial that asks for {asked}: the model gets {gets}."
        return [Flaw(FlawName.SECOND_STROKE, sentence, "doubtful")]
    return []


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
    near = settings.contact.gap_beside / span.rate
    kept: list[Contact] = []
    flaws: list[Flaw] = []
    for piece, peak in zip(pieces, peaks, strict=True):
        start, stop = span.time[piece.start], span.time[piece.stop - 1]
        if stop - start >= settings.contact.shortest_stroke and peak >= settings.contact.light_share * greatest:
            kept.append(piece)
            continue
        beside = [gap for gap in span.quality.gaps if abs(gap.stop - start) < near or abs(gap.start - stop) < near]
        if beside:
            sentence = (
                f"What presses from {start:.2f} to {stop:.2f} s goes on where readings are not sound "
                f"({beside[0].cause}): how long is not known, and nothing of it is measured."
            )
            flaws.append(Flaw(beside[0].cause, sentence, "doubtful"))
        else:
            tapped = stop - start < settings.contact.shortest_stroke
            what, name = ("tap", FlawName.TAP) if tapped else ("light touch", FlawName.LIGHT_TOUCH)
            sentence = f"A {what} from {start:.2f} to {stop:.2f} s, up to {peak:.2g} N, is no stroke."
            flaws.append(Flaw(name, sentence, "note"))
    return kept, flaws
