"""Analysis of one trial: its strokes, and its presses, from which the tilt of the face is estimated.

A press along the face's normal n with the force N exerts -N n: the sideways force divided by N is the tilt of n. A
press that also pushes sideways looks the same. Presses of one hand share that push, so only several presses, or a
weight in place of a finger, distinguish face from hand.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drivers.arrays import Array, Mask
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan, Trial
from sessions.strokes.contacts import Contact, find_contacts, onset_threshold, split_at_reversals, split_at_valleys
from sessions.strokes.decisions import Decisions, StrokeDecisions
from sessions.strokes.settings import AnalysisSettings, Pair
from sessions.strokes.signal_quality import signal_quality
from sessions.strokes.sliding import block_means, displacement
from sessions.strokes.span import Span, StrokeZero, recorded_zero, span_of, track_of, zero_after, zero_for
from sessions.strokes.stroke import Flaw, FlawName, Stroke, significant
from sessions.strokes.stroke_measures import measure_stroke

ZERO_SETTING = "zero"  # of `TransducerInfo.settings`: whether the recording's own zero is stated to be true
ZERO_STATED = "as recorded, stated to be true"
RAW_WRENCH = "N, N mm"  # raw unit of readings that came as a wrench


class TrialContext(NamedTuple):
    """Inputs shared by all trials of an analysis."""

    plan: SessionPlan
    info: TransducerInfo
    settings: AnalysisSettings
    decisions: Decisions = Decisions()

    @property
    def zero_is_stated(self) -> bool:
        """Say whether somebody stated that the recording's own zero is true."""
        return self.info.settings.get(ZERO_SETTING) == ZERO_STATED


@dataclass(frozen=True, slots=True)
class Press:
    """A contact that presses without sliding."""

    trial: int | None
    start: float  # of the hold [s, device clock]
    stop: float
    lean: Pair  # of the face's normal towards +x and +y [degrees], if the press was straight
    error: Pair  # standard uncertainty from noise and zero [degrees]


@dataclass(frozen=True, slots=True)
class Tilt:
    """Tilt of the face's normal from the transducer's axis towards +x and +y."""

    lean: Pair  # [degrees]
    x_interval: Pair  # [degrees]
    y_interval: Pair
    presses: tuple[Press, ...]
    kind: str  # description of the intervals, for people

    @property
    def error(self) -> Pair:
        """Standard uncertainty [degrees] of the mean of at least two presses, from their scatter."""
        return _mean_error(self.presses)


class TrialAnalysis(NamedTuple):
    """Results of one trial; `stroke` of a flaw counts within the trial."""

    strokes: tuple[Stroke, ...] = ()
    flaws: tuple[Flaw, ...] = ()
    presses: tuple[Press, ...] = ()
    filtered: str = ""


def analyse_trial(trial: Trial | None, block: ReadingBlock, context: TrialContext) -> TrialAnalysis:
    """Find and measure the strokes in the readings of a trial, and the presses among them."""
    settings, fewest = context.settings, context.settings.detector.baseline_readings
    if len(block) < fewest:
        sentence = f"Only {len(block)} readings: too few for a stroke."
        return TrialAnalysis(flaws=(Flaw(FlawName.NO_STROKE, sentence, "refused"),))
    quality = signal_quality(block, context.info, settings)
    flaws = list(quality.flaws)
    usable, refused = int(quality.good.sum()), any(flaw.grade == "refused" for flaw in flaws)
    if usable < fewest and not refused:
        sentence = f"Only {usable} of {len(block)} readings can be used: too few for a stroke."
        flaws.append(Flaw(FlawName.NO_STROKE, sentence, "refused"))
    if usable < fewest or refused:
        return TrialAnalysis(flaws=tuple(flaws))
    span = span_of(block, quality, context.info.calibration, context.plan.frame, settings)
    zero = _common_zero(span, context)
    if zero is None:
        sentence = "No stretch is unloaded: without a zero the readings of this transducer show no contact."
        flaws.append(Flaw(FlawName.NO_UNLOADED_STRETCH, sentence, "refused"))
        return TrialAnalysis(flaws=tuple(flaws), filtered=span.filtered)
    pull = _pull(span, zero)
    if pull is not None:
        return TrialAnalysis(flaws=(*flaws, pull), filtered=span.filtered)
    pieces, idle, touch_flaws = _pieces(span, zero, context)
    result = _measure(pieces, idle, span, zero, trial, context)
    flaws += [*touch_flaws, *result.flaws, *_stroke_count(result.strokes, trial, context)]
    return result._replace(flaws=tuple(flaws))


def _common_zero(span: Span, context: TrialContext) -> StrokeZero | None:
    """Return the zero for detecting contacts; None where it is unknown."""
    if context.zero_is_stated:
        return recorded_zero(span, is_stated=True)
    first = zero_after(span, -np.inf)
    if first is not None:
        return StrokeZero(first.level, first.noise, first.noise[:3], 0.0, first.error)
    return recorded_zero(span, is_stated=False) if context.info.calibration.raw_unit == RAW_WRENCH else None


def _pull(span: Span, zero: StrokeZero) -> Flaw | None:
    """Return the flaw of a normal axis along which the forces pull rather than press."""
    axis, settings = span.frame.normal, span.settings
    low, high = np.percentile(zero.level[2] - span.wrench[:, 2], [0.5, 99.5])
    if -low <= max(settings.contact.pull_share * high, onset_threshold(float(zero.noise[2]), settings.detector)):
        return None
    sentence = (
        f"Along {axis} the recording reaches {significant(high, 3)} N pressing but {significant(-low, 3)} N pulling, "
        "and a finger does not pull: the normal axis is another one, or there is none; no stroke is reported."
    )
    return Flaw(FlawName.NORMAL_IMPLAUSIBLE, sentence, "refused")


def _pieces(span: Span, zero: StrokeZero, context: TrialContext) -> tuple[list[Contact], Mask, list[Flaw]]:
    """Return the contacts to measure, cut into strokes; the mask of unloaded readings (n,); and flaws."""
    settings = context.settings
    normal, smooth = zero.level[2] - span.wrench[:, 2], zero.level[2] - span.smooth[:, 2]
    noise = float(zero.noise[2])
    if zero.flaw is FlawName.NO_UNLOADED_STRETCH:
        noise = settings.contact.light_share * float(np.percentile(normal, 99.9)) / settings.detector.onset_noise
    idle = np.ones(len(span.time), np.bool_)
    pieces: list[Contact] = []
    for contact in find_contacts(span.time, normal, noise, settings):
        idle[contact.start : contact.stop] = False
        pieces += split_at_valleys(contact, span.time, smooth, settings)
    strokes: list[Contact] = []
    for piece in pieces:
        piece_zero = zero if context.zero_is_stated else zero_for(span, piece, idle)
        if piece_zero is None:
            strokes.append(piece)
            continue
        wrench, unsure = span.smooth - piece_zero.level, piece_zero.unsure[0]
        strokes += split_at_reversals(piece, span.time, wrench, unsure, settings)
    contacts, flaws = _worth_measuring(strokes, span, smooth)
    return contacts, idle, flaws


def _worth_measuring(pieces: list[Contact], span: Span, smooth: Array) -> tuple[list[Contact], list[Flaw]]:
    """Return the contacts without taps and light touches, and a flaw for each of these."""
    peaks = [float(np.nanmax(smooth[piece.start : piece.stop], initial=0.0)) for piece in pieces]
    greatest, limits = max(peaks, default=0.0), span.settings.contact
    margin = limits.gap_beside / span.rate
    contacts: list[Contact] = []
    flaws: list[Flaw] = []
    for piece, peak in zip(pieces, peaks, strict=True):
        start, stop = span.time[piece.start], span.time[piece.stop - 1]
        tapped = stop - start < limits.shortest_stroke
        if not tapped and peak >= limits.light_share * greatest:
            contacts.append(piece)
            continue
        gaps = (gap for gap in span.quality.gaps if abs(gap.stop - start) < margin or abs(gap.start - stop) < margin)
        if gap := next(gaps, None):
            sentence = (
                f"The contact from {start:.2f} to {stop:.2f} s goes on into readings that are not sound "
                f"({gap.cause}): its length is not known, so it is not measured."
            )
            flaws.append(Flaw(gap.cause, sentence, "doubtful"))
        else:
            label, name = ("tap", FlawName.TAP) if tapped else ("light touch", FlawName.LIGHT_TOUCH)
            sentence = f"A {label} from {start:.2f} to {stop:.2f} s, up to {significant(peak, 2)} N, is not a stroke."
            flaws.append(Flaw(name, sentence, "note"))
    return contacts, flaws


def _measure(
    pieces: list[Contact], idle: Mask, span: Span, zero: StrokeZero, trial: Trial | None, context: TrialContext
) -> TrialAnalysis:
    """Measure contacts, as detected or decided, each with its own zero unless one was stated."""
    number = None if trial is None else trial.number
    by_stroke = [context.decisions.of_stroke(number, index) for index in range(1, len(pieces) + 1)]
    flaws: list[Flaw] = []
    for index, decisions in enumerate(by_stroke):
        pieces[index], empty = _with_decided_ends(pieces[index], decisions, span)
        flaws += [] if empty is None else [replace(empty, stroke=index)]
        idle[pieces[index].start : pieces[index].stop] = False
    strokes: list[Stroke] = []
    presses: list[Press] = []
    for index, (piece, decisions) in enumerate(zip(pieces, by_stroke, strict=True)):
        own_zero = zero if context.zero_is_stated else zero_for(span, piece, idle)
        stroke_zero = own_zero or recorded_zero(span, is_stated=False)
        stroke, stroke_flaws = measure_stroke(span, piece, stroke_zero, context.plan, trial, index + 1, decisions)
        flaws += [replace(flaw, stroke=index) for flaw in stroke_flaws]
        strokes.append(stroke)
        if stroke.mu_dynamic is None and stroke_zero.flaw is not FlawName.NO_UNLOADED_STRETCH:
            press = press_of(span, piece, stroke_zero, number)
            presses += [] if press is None else [press]
    return TrialAnalysis(tuple(strokes), tuple(flaws), tuple(presses), span.filtered)


def _with_decided_ends(piece: Contact, decisions: StrokeDecisions, span: Span) -> tuple[Contact, Flaw | None]:
    """Return a contact with the decided onset and lift; unchanged, with a flaw, where they are not possible."""
    onset, lift = decisions.instant("onset"), decisions.instant("lift")
    start = piece.start if onset is None else int(np.searchsorted(span.time, onset))
    stop = piece.stop if lift is None else int(np.searchsorted(span.time, lift))
    problem = "No readings lie between the onset and the lift that were decided" if stop - start < 2 else ""
    for name, instant in (("onset", onset), ("lift", lift)):
        if instant is not None and not span.time[0] <= instant <= span.time[-1]:
            problem = f"The {name} that was decided lies outside of the readings around the stroke"
    if problem:
        return piece, Flaw(FlawName.DECISION, f"{problem}: onset and lift stay as they were found.", "doubtful")
    instants = piece.onset if onset is None else onset, piece.lift if lift is None else lift
    return replace(piece, start=start, stop=stop, onset=instants[0], lift=instants[1]), None


def _stroke_count(strokes: tuple[Stroke, ...], trial: Trial | None, context: TrialContext) -> Iterable[Flaw]:
    """Yield a flaw without a stroke, or more than the trial asks for."""
    if not strokes:
        yield Flaw(FlawName.NO_STROKE, "No contact is a stroke.", "refused")
    if trial is None or len(strokes) <= (limit := context.plan.stroke_limit(trial)):
        return
    task = "one" if limit == 1 else f"up to {limit}"
    model = next((stroke.number for stroke in strokes_for_model(strokes, trial, context.decisions)), None)
    gets = "none, as was decided" if model is None else "the first" if model == 1 else f"the one numbered {model}"
    turns = any(FlawName.TURNED in stroke.flaws for stroke in strokes)
    ways = " (each way of a finger that turned without lifting is one)" if turns else ""
    sentence = f"{len(strokes)} strokes{ways} in a trial that asks for {task}: the model uses {gets}."
    yield Flaw(FlawName.SECOND_STROKE, sentence, "doubtful")


def strokes_for_model(strokes: tuple[Stroke, ...], trial: Trial | None, decisions: Decisions) -> tuple[Stroke, ...]:
    """Return the strokes for the model: in a trial the decided one, else the first that is kept."""
    strokes = tuple(stroke for stroke in strokes if stroke.kept)
    if trial is None:
        return strokes
    choice = decisions.choice(trial.number)
    return tuple(stroke for stroke in strokes if choice is not None and stroke.number == choice.new) or strokes[:1]


def press_of(span: Span, contact: Contact, zero: StrokeZero, trial: int | None) -> Press | None:
    """Return the press in a contact; None where it slides, is too short, or has too much drag."""
    track, limits, settings = track_of(span, contact, zero), span.settings.press, span.settings
    peak = float(np.nanmax(track.normal, initial=0.0))
    if peak < settings.ratio.force_floor:
        return None
    high = np.flatnonzero(track.normal >= limits.press_held * peak)
    hold = slice(int(high[0]), int(high[-1]) + 1)
    start, stop = float(track.time[hold.start]), float(track.time[hold.stop - 1])
    if stop - start < limits.press_shortest or not displacement(track.position[hold]) <= limits.press_moves:
        return None
    blocks = block_means(np.column_stack([track.wrench[hold, :2], track.normal[hold]]), track.rate, settings)
    if len(blocks) < limits.press_fewest:
        return None
    ratio = -blocks[:, :2] / blocks[:, 2:]
    if np.hypot(*ratio.mean(axis=0)) > limits.press_ratio:
        return None
    scatter = ratio.std(axis=0, ddof=1) / np.sqrt(len(ratio))
    error_x, error_y = np.degrees(np.hypot(scatter, zero.error[:2] / float(blocks[:, 2].mean()))).tolist()
    # The tilt already corrected is added: the result is relative to the transducer.
    x, y = (np.degrees(np.arctan(ratio.mean(axis=0))) + settings.tilt).tolist()
    return Press(trial, start, stop, (x, y), (error_x, error_y))


def tilt_of(presses: Sequence[Press], settings: AnalysisSettings) -> Tilt | None:
    """Return the tilt measured by presses, with intervals; None without presses."""
    if not presses:
        return None
    from scipy.special import stdtrit  # slow to load, and neither window nor recorder needs it

    mean = np.array([press.lean for press in presses]).mean(axis=0)
    per_cent = f"{100 * settings.confidence:g} %"
    if len(presses) >= settings.press.press_fewest:
        half = stdtrit(len(presses) - 1, 0.5 + settings.confidence / 2) * np.array(_mean_error(presses))
        kind = f"{per_cent} t interval of the mean of {len(presses)} presses"
    else:
        errors = np.array([press.error for press in presses])
        half = stdtrit(np.inf, 0.5 + settings.confidence / 2) * np.sqrt((errors**2).sum(axis=0)) / len(presses)
        kind = (
            f"{per_cent} interval from noise and zero of {len(presses)} press{'es' if len(presses) > 1 else ''} alone: "
            "what the hand itself pushed sideways is not in it"
        )
    (x, y), (low_x, low_y), (high_x, high_y) = mean.tolist(), (mean - half).tolist(), (mean + half).tolist()
    return Tilt((x, y), (low_x, high_x), (low_y, high_y), tuple(presses), kind)


def _mean_error(presses: Sequence[Press]) -> Pair:
    x, y = np.array([press.lean for press in presses]).std(axis=0, ddof=1) / np.sqrt(len(presses))
    return float(x), float(y)
