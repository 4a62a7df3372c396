"""The analysis of a whole recording: its strokes, the friction the model gets of them, and every flaw."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan, Trial
from sessions.strokes.bootstrap import StrokeIntervals, stroke_intervals
from sessions.strokes.bootstrap_settings import BootstrapSettings
from sessions.strokes.contacts import Contact, find_contacts, split_at_reversals, split_at_valleys
from sessions.strokes.decisions import OF_SESSION, Decision, Decisions, StrokeDecisions, Value, read
from sessions.strokes.flaws import Flaw, FlawName
from sessions.strokes.friction import FrictionParameters, friction_parameters
from sessions.strokes.onset import Baseline, onset_threshold
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.signal_quality import signal_quality
from sessions.strokes.span import Span, StrokeZero, recorded_zero, span_of, zero_for
from sessions.strokes.stroke import Stroke
from sessions.strokes.stroke_measures import measure_stroke
from sessions.strokes.tilt import Press, Tilt, press_of, tilt_of

if TYPE_CHECKING:  # the runner imports the detector from here: it must not pay for the reader
    from sessions.recording.reader import Recording

ZERO_SETTING = "zero"  # of `TransducerInfo.settings`: who says that the recording's own zero is true
ZERO_STATED = "as recorded, stated to be true"
RAW_WRENCH = "N, N mm"  # raw unit of readings that came as a wrench

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Blocks = Iterable[tuple[Trial | None, ReadingBlock]]  # readings of trials, or of a recording without any (None)


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
    def bootstrap(self) -> BootstrapSettings:
        """Return what the intervals are drawn from."""
        return BootstrapSettings.of(self.settings, self.tilt)

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
            "tilt": None if self.tilt is None else asdict(self.tilt),
            "filter": self.filtered,
            "interval": self.bootstrap.kind,
            "settings": self.settings.to_dict(),
            "settings_origin": "default" if self.settings == AnalysisSettings() else "set",
        }


class _Context(NamedTuple):
    """What all trials of an analysis share."""

    plan: SessionPlan
    info: TransducerInfo
    settings: AnalysisSettings
    decisions: Decisions

    @property
    def zero_is_stated(self) -> bool:
        """Say whether somebody stated that the recording's own zero is true."""
        return self.info.settings.get(ZERO_SETTING) == ZERO_STATED


def analyse(
    recording: "Recording", settings: AnalysisSettings | None = None, decisions: Decisions | None = None
) -> Analysis:
    """Return the strokes of a recording: within each trial's valid take, or anywhere where it has no trials.

    Trials of practice and pre-evaluation are no part of the experiment: of them only presses are taken. `decisions` are
    those kept in the session's folder, unless others are given. Raises RecordingError where their file cannot be read.
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
    context = _Context(recording.plan, recording.info, settings, decisions)
    analysis = _without_intervals(main if recording.plan.blocks else [(None, recording.readings())], context, losses)
    presses = _without_intervals(warm_up, context._replace(decisions=Decisions()), ()).presses + analysis.presses
    analysis = replace(analysis, simulated=recording.simulated, presses=presses)
    return _with_intervals(replace(analysis, flaws=(*analysis.flaws, *_tilt_assumed(analysis))))


def analyse_blocks(
    parts: Blocks,
    plan: SessionPlan,
    info: TransducerInfo,
    settings: AnalysisSettings,
    flaws: Iterable[Flaw] = (),
    decisions: Decisions | None = None,
) -> Analysis:
    """Return the strokes in the readings of trials; `flaws` of the recording come before those that are found."""
    return _with_intervals(_without_intervals(parts, _Context(plan, info, settings, decisions or Decisions()), flaws))


def _without_intervals(parts: Blocks, context: _Context, flaws_before: Iterable[Flaw]) -> Analysis:
    """Return an analysis whose intervals are not drawn yet: they depend on all presses of a session."""
    plan, info, settings, decisions = context
    strokes: list[Stroke] = []
    friction: list[FrictionParameters] = []
    presses: list[Press] = []
    flaws = [*flaws_before, *(Flaw(FlawName.DECISION, problem, "doubtful") for problem in decisions.problems)]
    filtered = ""
    for trial, block in parts:
        part = _analyse_block(trial, block, context)
        number = None if trial is None else trial.number
        flaws += [
            replace(flaw, trial=number, stroke=None if flaw.stroke is None else flaw.stroke + len(strokes))
            for flaw in part.flaws
        ]
        friction += [
            friction_parameters(stroke, len(strokes) + stroke.number - 1, trial, plan.contact_area)
            for stroke in _for_model(part.strokes, trial, decisions)
        ]
        strokes += part.strokes
        presses += part.presses
        filtered = filtered or part.filtered
    flaws += _decisions_without_stroke(decisions, strokes)
    results = tuple(strokes), tuple(friction), tuple(flaws), filtered, settings, decisions.in_force, tuple(presses)
    return Analysis(info.simulated, *results)


def _with_intervals(analysis: Analysis) -> Analysis:
    bootstrap = analysis.bootstrap
    intervals = tuple(stroke_intervals(stroke, at, bootstrap) for at, stroke in enumerate(analysis.strokes))
    strokes = tuple(
        replace(stroke, mu_dynamic_interval=interval.mu_dynamic)
        for stroke, interval in zip(analysis.strokes, intervals, strict=True)
    )
    friction = tuple(
        replace(row, mu_interval=getattr(intervals[row.stroke], "mu_max" if row.rule == "maximum" else "mu_dynamic"))
        for row in analysis.friction
    )
    return replace(analysis, strokes=strokes, friction=friction, intervals=intervals)


def _tilt_assumed(analysis: Analysis) -> Iterable[Flaw]:
    """Yield the note that too few presses measure the tilt, where friction depends on it."""
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


def _for_model(strokes: tuple[Stroke, ...], trial: Trial | None, decisions: Decisions) -> tuple[Stroke, ...]:
    """Return the strokes of a part that the model gets: of a trial the one decided, or else the first that is kept."""
    kept = tuple(stroke for stroke in strokes if stroke.kept)
    if trial is None:
        return kept
    choice = decisions.choice(trial.number)
    return tuple(one for one in kept if choice is not None and one.number == choice.new) or kept[:1]


def _decisions_without_stroke(decisions: Decisions, strokes: Iterable[Stroke]) -> Iterable[Flaw]:
    """Yield a flaw for each decision about a stroke that does not exist, or that is left out."""
    kept: dict[tuple[int | None, Value], bool] = {(one.trial, one.number): one.kept for one in strokes}
    for one in decisions.in_force:
        if one.what in OF_SESSION:
            continue
        stroke = (one.trial, one.new if one.what == "choice" else one.stroke)
        if stroke not in kept or (one.what == "choice" and not kept[stroke]):
            what = "left out, or not found" if stroke in kept else "not found"
            sentence = f"Stroke {stroke[1]} is {what}, so nothing is changed by {one.sentence}."
            yield Flaw(FlawName.DECISION, sentence, "doubtful", trial=one.trial)


class _Part(NamedTuple):
    """What one trial's readings say; `stroke` of a flaw counts within the trial."""

    strokes: tuple[Stroke, ...] = ()
    flaws: tuple[Flaw, ...] = ()
    presses: tuple[Press, ...] = ()
    filtered: str = ""


def _analyse_block(trial: Trial | None, block: ReadingBlock, context: _Context) -> _Part:
    """Find and measure the strokes in the readings of a trial, and the presses among them."""
    settings = context.settings
    if len(block) < settings.detector.baseline_readings:
        sentence = f"Only {len(block)} readings: too few for a stroke."
        return _Part(flaws=(Flaw(FlawName.NO_STROKE, sentence, "refused"),))
    quality = signal_quality(block, context.info, settings)
    flaws = [Flaw(name, sentence, grade) for name, sentence, grade in quality.flaws]
    if quality.refused:
        return _Part(flaws=tuple(flaws))
    span = span_of(block, quality, context.info.calibration, context.plan.frame, settings)
    zero = _common_zero(span, context)
    if zero is None:
        sentence = "No stretch is unloaded: without a zero the readings of this transducer show no contact."
        return _Part(flaws=(*flaws, Flaw(FlawName.NO_UNLOADED_STRETCH, sentence, "refused")), filtered=span.filtered)
    pull = _pull(span, zero, context)
    if pull is not None:
        return _Part(flaws=(*flaws, pull), filtered=span.filtered)
    pieces, idle, more = _pieces(span, zero, context)
    part = _measure(pieces, idle, span, zero, trial, context)
    flaws += [*more, *part.flaws, *_stroke_count(part.strokes, trial, context)]
    return part._replace(flaws=tuple(flaws))


def _common_zero(span: Span, context: _Context) -> StrokeZero | None:
    """Return the zero by which contacts are found; None where nothing tells one."""
    if context.zero_is_stated:
        return recorded_zero(span, stated=True)
    first = span.windows.after(-np.inf, context.settings.zero.zero_stretch)
    if first is not None:
        return StrokeZero(first.level, first.noise, first.noise[:3], 0.0, first.error, "", None, (0.0, 0.0), None)
    return recorded_zero(span, stated=False) if context.info.calibration.raw_unit == RAW_WRENCH else None


def _pull(span: Span, zero: StrokeZero, context: _Context) -> Flaw | None:
    """Return the flaw of a normal axis along which the recording pulls rather than presses."""
    axis, settings = context.plan.frame.normal, context.settings
    low, high = np.percentile(zero.level[2] - span.wrench[:, 2], [0.5, 99.5])
    if -low <= max(settings.contact.pull_share * high, onset_threshold(float(zero.noise[2]), settings.detector)):
        return None
    sentence = (
        f"Along {axis} the recording reaches {high:.3g} N pressing but {-low:.3g} N pulling, and a finger does not "
        "pull: the normal axis is another one, or there is none; no stroke is reported."
    )
    return Flaw(FlawName.NORMAL_IMPLAUSIBLE, sentence, "refused")


def _pieces(span: Span, zero: StrokeZero, context: _Context) -> tuple[list[Contact], Mask, list[Flaw]]:
    """Return the contacts worth measuring, cut into strokes; readings (n,) in which nothing touches; and flaws."""
    settings = context.settings
    normal, smooth = zero.level[2] - span.wrench[:, 2], zero.level[2] - span.smooth[:, 2]
    noise = float(zero.noise[2])
    if zero.flaw is FlawName.NO_UNLOADED_STRETCH:
        threshold = settings.contact.light_share * float(np.percentile(normal, 99.9))
        noise = threshold / settings.detector.onset_noise
    idle = np.ones(len(span.time), np.bool_)
    pieces: list[Contact] = []
    for contact in find_contacts(span.time, normal, Baseline(0.0, noise), settings):
        idle[contact.start : contact.stop] = False
        pieces += split_at_valleys(contact, span.time, smooth, settings)
    strokes: list[Contact] = []
    for piece in pieces:
        own = zero if context.zero_is_stated else zero_for(span, piece, idle, settings)
        strokes += (
            (piece,)
            if own is None
            else split_at_reversals(piece, span.time, span.smooth - own.level, own.unsure[0], settings)
        )
    kept, flaws = _worth_measuring(strokes, span, smooth, settings)
    return kept, idle, flaws


def _measure(
    pieces: list[Contact], idle: Mask, span: Span, zero: StrokeZero, trial: Trial | None, context: _Context
) -> _Part:
    """Measure contacts as they were found or decided, each from its own zero unless one was stated."""
    settings, plan = context.settings, context.plan
    number = None if trial is None else trial.number
    decided = [context.decisions.of_stroke(number, at) for at in range(1, len(pieces) + 1)]
    flaws: list[Flaw] = []
    idle = idle.copy()
    for at, decisions in enumerate(decided):
        pieces[at], empty = _with_decided_ends(pieces[at], decisions, span)
        flaws += [] if empty is None else [replace(empty, stroke=at)]
        idle[pieces[at].start : pieces[at].stop] = False
    strokes: list[Stroke] = []
    presses: list[Press] = []
    for at, (piece, decisions) in enumerate(zip(pieces, decided, strict=True)):
        own = zero
        if not context.zero_is_stated:
            own = zero_for(span, piece, idle, settings) or recorded_zero(span, stated=False)
        stroke, more = measure_stroke(span, piece, own, plan, settings, trial, at + 1, decisions)
        flaws += [replace(flaw, stroke=at) for flaw in more]
        strokes.append(stroke)
        if stroke.mu_dynamic is None and own.flaw is not FlawName.NO_UNLOADED_STRETCH:
            press = press_of(span, piece, own, plan.frame, number, settings)
            presses += [] if press is None else [press]
    return _Part(tuple(strokes), tuple(flaws), tuple(presses), span.filtered)


def _stroke_count(strokes: tuple[Stroke, ...], trial: Trial | None, context: _Context) -> Iterable[Flaw]:
    """Yield a flaw where there is no stroke, or more than the trial asks for."""
    if not strokes:
        yield Flaw(FlawName.NO_STROKE, "No contact is a stroke.", "refused")
    if trial is None or len(strokes) <= (allowed := context.plan.strokes_allowed(trial)):
        return
    task = "one" if allowed == 1 else f"up to {allowed}"
    model = next((stroke.number for stroke in _for_model(strokes, trial, context.decisions)), None)
    gets = "none, as was decided" if model is None else "the first" if model == 1 else f"the one numbered {model}"
    turned = any(FlawName.TURNED in stroke.flaws for stroke in strokes)
    ways = " (each way of a finger that turned without lifting is one)" if turned else ""
    sentence = f"{len(strokes)} strokes{ways} in a trial that asks for {task}: the model uses {gets}."
    yield Flaw(FlawName.SECOND_STROKE, sentence, "doubtful")


def _with_decided_ends(piece: Contact, decisions: StrokeDecisions, span: Span) -> tuple[Contact, Flaw | None]:
    """Return a contact with the onset and lift that were decided; as it is, with a flaw, where nothing is between."""
    onset, lift = decisions.instant("onset"), decisions.instant("lift")
    start = piece.start if onset is None else int(np.searchsorted(span.time, onset))
    stop = piece.stop if lift is None else int(np.searchsorted(span.time, lift))
    if stop - start < 2:
        sentence = "No readings lie between the onset and the lift that were decided: they stay as they were found."
        return piece, Flaw(FlawName.DECISION, sentence, "doubtful")
    ends = piece.onset if onset is None else onset, piece.lift if lift is None else lift
    return replace(piece, start=start, stop=stop, onset=ends[0], lift=ends[1]), None


def _worth_measuring(
    pieces: list[Contact], span: Span, smooth: Array, settings: AnalysisSettings
) -> tuple[list[Contact], list[Flaw]]:
    """Return the contacts without taps and light touches, and a flaw for each of these."""
    peaks = [float(np.nanmax(smooth[piece.start : piece.stop], initial=0.0)) for piece in pieces]
    greatest = max(peaks, default=0.0)
    near = settings.contact.gap_beside / span.rate
    kept: list[Contact] = []
    flaws: list[Flaw] = []
    for piece, peak in zip(pieces, peaks, strict=True):
        start, stop = span.time[piece.start], span.time[piece.stop - 1]
        tapped = stop - start < settings.contact.shortest_stroke
        if not tapped and peak >= settings.contact.light_share * greatest:
            kept.append(piece)
            continue
        gaps = [gap for gap in span.quality.gaps if abs(gap.stop - start) < near or abs(gap.start - stop) < near]
        if gaps:
            sentence = (
                f"The contact from {start:.2f} to {stop:.2f} s goes on into readings that are not sound "
                f"({gaps[0].cause}): its length is not known, so it is not measured."
            )
            flaws.append(Flaw(gaps[0].cause, sentence, "doubtful"))
        else:
            what, name = ("tap", FlawName.TAP) if tapped else ("light touch", FlawName.LIGHT_TOUCH)
            sentence = f"A {what} from {start:.2f} to {stop:.2f} s, up to {peak:.2g} N, is not a stroke."
            flaws.append(Flaw(name, sentence, "note"))
    return kept, flaws
