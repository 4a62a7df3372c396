"""The numbers of one stroke, and what forbids some of them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sessions.plan.plan import PROXIMAL_TO_DISTAL, SessionPlan, Trial
from sessions.strokes.break_away import break_away
from sessions.strokes.contacts import Contact
from sessions.strokes.decisions import StrokeDecisions
from sessions.strokes.flaws import Flaw, FlawName
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.sliding import slide
from sessions.strokes.span import Span, StrokeZero
from sessions.strokes.stick_slip import power_of_normal_force, stick_slip
from sessions.strokes.stroke import Stroke
from sessions.strokes.stroke_findings import COEFFICIENTS, DIRECTION, EVERYTHING, PEAKS, SPEED, Findings
from sessions.strokes.track import Track, curve_of, mean_vector, noise_of_ratio, track_of, unfiltered_forces

Array = NDArray[np.float64]

_SLIDES_BEFORE = "the contact slides before T/N stops climbing"
_NO_PEAK = "no static peak stands out"
_STICK_WITHOUT = (_NO_PEAK, FlawName.NO_STEADY_SLIDING, FlawName.RATIO_ABOVE_ONE)  # a stick phase needs none of these


def measure_stroke(
    span: Span,
    contact: Contact,
    zero: StrokeZero,
    plan: SessionPlan,
    settings: AnalysisSettings,
    trial: Trial | None = None,
    number: int = 1,
    decided: StrokeDecisions | None = None,
) -> tuple[Stroke, tuple[Flaw, ...]]:
    """Return a contact's stroke and its flaws; `plan` tells the face's frame and the area that tau_max is of.

    `number` is that of the stroke within its trial; what was `decided` of it goes before what is found.
    """
    found, frame, missed = Findings(), plan.frame, None
    decided = decided or StrokeDecisions({})
    track = track_of(span, contact, zero, frame.height, settings)
    _judge_ends(found, contact, track, settings)
    _judge_zero(found, zero, track)
    if zero.flaw is not FlawName.NO_UNLOADED_STRETCH:
        _judge_gaps(found, span, contact, settings)
        _judge_loads(found, track, plan.contact_area, settings)
        whole = None
        if contact.uncut is not None:
            first, last = contact.uncut
            whole = track_of(span, replace(contact, start=first, stop=last), zero, frame.height, settings)
        window = slide(found, span, track, frame, settings, decided.span("steady"), whole)
        _take_slide_onset(found, decided)
        if window is not None:
            missed = _stick_slip(found, span, contact, track, window, zero, plan.contact_area, settings)
            _friction(found, track, window)
            _static_peak(found, track, window, zero, settings, turned=contact.start in contact.reversals)
            _break_away(found, track, window, settings)
            _judge_way(found, track, window, settings)
        _take_decided(found, track, decided)
        _judge_drift(found, zero, settings)
    if trial is not None:
        _judge_task(found, trial)
    numbers = dict(found.allowed(EVERYTHING))
    stroke = Stroke(
        trial=None if trial is None else trial.number,
        onset=contact.onset if "onset" not in found.reasons else decided.instant("onset"),
        lift=contact.lift if "lift" not in found.reasons else decided.instant("lift"),
        readings=numbers.pop("readings") or 0,
        zero=zero.origin,
        zero_drift=None if zero.drift is None else float(np.linalg.norm(zero.drift[:3])),
        flaws=tuple(dict.fromkeys(str(flaw.name) for flaw in found.flaws)),
        reasons=dict(found.reasons),
        area_exponent=settings.area.exponent,
        number=number,
        kept=decided.kept,
        decided=decided.sentences,
        curve=curve_of(span, contact, zero, frame.height, settings, missed),
        **numbers,
    )
    return stroke, tuple(found.flaws)


def _judge_ends(found: Findings, contact: Contact, track: Track, settings: AnalysisSettings) -> None:
    if contact.onset is None:
        sentence = "The recording begins in contact: no onset, and what came before is not known."
        found.flaw(FlawName.BEGINS_IN_CONTACT, sentence, "doubtful")
    if contact.lift is None:
        found.flaw(FlawName.ENDS_IN_CONTACT, "The recording ends in contact: no lift.", "doubtful")
    if contact.valleys and len(contact.reversals) < 2:
        sentence = (
            "The force did not return to zero between this stroke and its neighbour: there it begins or ends where a "
            "fifth of its peak is left."
        )
        found.flaw(FlawName.NOT_LIFTED, sentence, "doubtful")
    if contact.reversals:
        sentence = (
            "The finger turned without lifting: this stroke begins or ends at the turn, where the drag changes its "
            "sign, and its neighbour goes the other way."
        )
        found.flaw(FlawName.TURNED, sentence, "note")
    peak = float(np.nanmax(track.normal, initial=0.0))
    risen = np.flatnonzero(track.normal >= settings.ratio.force_floor_share * peak)
    if contact.onset is not None and len(risen) and track.time[risen[0]] - contact.onset > settings.contact.slow_onset:
        sentence = (
            f"The force crept for {track.time[risen[0]] - contact.onset:.2f} s from leaving its zero to a fifth of its "
            "peak: the onset marks where it left, which may not be the touch."
        )
        found.flaw(FlawName.SLOW_ONSET, sentence, "doubtful")


def _judge_zero(found: Findings, zero: StrokeZero, track: Track) -> None:
    if zero.flaw is FlawName.NO_UNLOADED_STRETCH:
        sentence = (
            f"From {track.time[0]:.2f} to {track.time[-1]:.2f} s the recorded force lies beyond a fifth of its peak, "
            "but no stretch around is unloaded, so the zero is unknown: perhaps there is no contact at all, and no "
            "onset, lift, friction, force or speed is given."
        )
        found.flaw(zero.flaw, sentence, "refused", (*EVERYTHING, "onset", "lift"))
    elif zero.flaw is FlawName.ZERO_AFTER_CONTACT:
        sentence = "No stretch before this contact is unloaded: the zero was taken after it, and drift is not known."
        found.flaw(zero.flaw, sentence, "doubtful")


def _judge_gaps(found: Findings, span: Span, contact: Contact, settings: AnalysisSettings) -> None:
    """Withhold peaks that missing readings may hide."""
    first, last = span.time[contact.start], span.time[contact.stop - 1]
    if ((span.saturated_at >= first) & (span.saturated_at <= last)).any():
        sentence = "Readings of this stroke are saturated or come with a fault of the device: its peaks are not known."
        found.flaw(FlawName.SATURATED, sentence, "doubtful", PEAKS)
    inside = [gap for gap in span.quality.gaps if first <= gap.start and gap.stop <= last]
    widest = max(inside, key=lambda gap: gap.stop - gap.start, default=None)
    if widest is not None and widest.stop - widest.start > settings.contact.longest_gap + 1.0 / span.rate:
        sentence = (
            f"No sound readings from {widest.start:.2f} to {widest.stop:.2f} s of this stroke ({widest.cause}), which "
            "may hide its peaks."
        )
        found.flaw(widest.cause, sentence, "doubtful", PEAKS)
    wild = [gap for gap in inside if gap.cause is FlawName.WILD]
    if wild:
        sentence = (
            f"A wild reading at {wild[0].start:.2f} s of this stroke was left out: hold its numbers against its curve."
        )
        found.flaw(FlawName.WILD, sentence, "doubtful")


def _judge_loads(found: Findings, track: Track, contact_area: float, settings: AnalysisSettings) -> None:
    """Give the greatest forces, and say where they are implausible."""
    peak = float(np.nanmax(track.normal, initial=0.0))
    greatest = float(np.nanmax(track.tangential, initial=0.0))
    traction, area = _greatest_traction(track, track.tangential, contact_area, settings)
    found.numbers |= {
        "peak_normal": peak,
        "peak_tangential": greatest,
        "tau_max": traction,
        "contact_area": area,
    }
    found.numbers["mu_max"] = _greatest_ratio(track, track.floor, settings)
    if peak < settings.ratio.force_floor:
        sentence = (
            f"The normal force reaches {peak:.2g} N: below {settings.ratio.force_floor:g} N friction means nothing."
        )
        found.flaw(FlawName.TOO_LITTLE_FORCE, sentence, "refused", (*COEFFICIENTS, *SPEED, *DIRECTION))
    if peak > settings.contact.greatest_force:
        sentence = f"The normal force reaches {peak:.3g} N, which is no finger's: check the units of the forces."
        found.flaw(FlawName.UNITS_IMPLAUSIBLE, sentence, "doubtful")
    half = settings.ratio.light_half * peak
    with np.errstate(invalid="ignore"):
        light = (track.ratio > 1.0) & (track.normal < half)
        pressed = track.ratio[track.normal >= half]
    if light.any() and np.isfinite(pressed).any() and np.nanmedian(pressed) < 1.0:
        sentence = (
            f"T/N exceeds 1 while N is below half its peak ({peak:.3g} N), and not above: drift or a side load makes "
            "the ratio there; its maximum is that above half the peak."
        )
        found.flaw(FlawName.RATIO_ABOVE_ONE, sentence, "doubtful", ("mu_static",))
        found.numbers["mu_max"] = _greatest_ratio(track, half, settings)


def _greatest_traction(
    track: Track, tangential: Array, planned: float, settings: AnalysisSettings
) -> tuple[float | None, float | None]:
    """Return the greatest mean traction [MPa] and the area [mm2] it acts on; None where an area that grows has no N."""
    if settings.area.law == "fixed":
        return float(np.nanmax(tangential, initial=0.0)) / planned, planned
    with np.errstate(invalid="ignore"):
        pressed = np.flatnonzero(track.normal >= track.floor)
    if not len(pressed):
        return None, None
    areas = settings.area.area(track.normal[pressed], planned)
    tractions = tangential[pressed] / areas
    top = int(np.argmax(tractions))
    return float(tractions[top]), float(areas[top])


def _greatest_ratio(track: Track, floor: float, settings: AnalysisSettings) -> float | None:
    """Return the greatest T/N of forces averaged over a moving window, wherever N stays above `floor` [N] in it.

    Forces are averaged, not the ratio: noise then raises the maximum far less.
    """
    length = max(1, round(settings.filter.smoothing * track.rate))
    if len(track.time) < length:
        return None
    with np.errstate(invalid="ignore"):
        pressed = track.normal >= floor
    normal = np.where(pressed, track.normal, np.nan)
    box = np.ones(length) / length
    means = np.convolve(track.tangential, box, "valid") / np.convolve(normal, box, "valid")
    whole = (
        track.time[length - 1 :] - track.time[: len(track.time) - length + 1]
        < settings.zero.quiet_gap * length / track.rate
    )
    means = means[np.isfinite(means) & whole]
    return float(means.max()) if len(means) else None


def _friction(found: Findings, track: Track, window: slice) -> None:
    """Give the mean of T/N over the steady window, and of the forces."""
    held = track.ratio[window][np.isfinite(track.ratio[window])]
    mean = float(held.mean())
    if mean > 1.0:
        sentence = (
            f"T/N is {mean:.2f} in the steady window: a surface that sticks can make it so, but so do a clipped "
            "axis, a wrong gain or zero, or a face that leans."
        )
        found.flaw(FlawName.RATIO_ABOVE_ONE_THROUGHOUT, sentence, "doubtful")
    found.numbers |= {
        "mu_dynamic": mean,
        "mu_dynamic_sd": float(held.std(ddof=1)),
        "readings": len(held),
        "normal_force": float(np.nanmean(track.normal[window])),
        "tangential_force": float(np.nanmean(track.tangential[window])),
    }


def _stick_slip(
    found: Findings,
    span: Span,
    contact: Contact,
    track: Track,
    window: slice,
    zero: StrokeZero,
    planned: float,
    settings: AnalysisSettings,
) -> float | None:
    """Tell tau_max by the unfiltered force where the contact sticks and slips; return how far it may be missed [N]."""
    dragging, normal = unfiltered_forces(span, slice(contact.start, contact.stop), zero)
    with np.errstate(invalid="ignore"):
        ratio = np.where(normal >= track.floor, dragging / np.maximum(normal, track.floor), np.nan)
    level, pressing = float(np.nanmean(track.ratio[window])), float(np.nanmean(track.normal[window]))
    slips = stick_slip(track.time[window], ratio[window], noise_of_ratio(zero, level, pressing), settings)
    if slips is None:
        return None
    missed = slips.missed * pressing
    filtered, told = found.numbers["peak_tangential"], float(np.nanmax(dragging))
    traction, area = _greatest_traction(track, dragging, planned, settings)
    found.numbers |= {"tau_max": traction, "contact_area": area, "peak_tangential": told}
    sentence = (
        f"The contact sticks and slips at {slips.frequency:.2g} Hz: the greatest tangential force and tau_max are "
        f"those of unfiltered forces, {100 * (told / filtered - 1.0):.2g} % above the filtered ones; readings may miss "
        f"the crest by {100 * missed / told:.1g} %, and noise raises it."
    )
    found.flaw(FlawName.STICK_SLIP, sentence, "note")
    return missed


def _judge_drift(found: Findings, zero: StrokeZero, settings: AnalysisSettings) -> None:
    """Say how far a zero that moves may have changed mu, and withhold the numbers where that is too much."""
    sideways, pressing = zero.unsure
    tangential = found.numbers.get("tangential_force", found.numbers["peak_tangential"])
    normal = found.numbers.get("normal_force", found.numbers["peak_normal"])
    share = sideways / tangential + pressing / normal if tangential > 0.0 and normal > 0.0 else float("inf")
    if share <= settings.zero.drift_doubted:
        return
    refused = share > settings.zero.drift_refused
    sentence = (
        f"With nothing pressing, the forces around this stroke lie {sideways:.2g} N sideways and {pressing:.2g} N "
        f"along the normal from its zero: mu may be wrong by {100 * share:.0f} %"
        f"{', so no force, friction or speed is given' if refused else ''}."
    )
    found.flaw(FlawName.DRIFT, sentence, "refused" if refused else "doubtful", EVERYTHING if refused else ())


def _judge_task(found: Findings, trial: Trial) -> None:
    direction = found.allowed(("direction",))["direction"]
    if direction is not None and direction != trial.direction:
        asked = "proximal to distal" if trial.direction == PROXIMAL_TO_DISTAL else "distal to proximal"
        sentence = f"The finger moved the other way than the trial asks ({asked})."
        found.flaw(FlawName.WRONG_DIRECTION, sentence, "doubtful")


def _static_peak(
    found: Findings, track: Track, window: slice, zero: StrokeZero, settings: AnalysisSettings, *, turned: bool
) -> None:
    """Give the static peak where one stands out of what follows it by its noise and by a share.

    What follows is both the level just after it and the highest crest of the steady window, for a contact that sticks
    and slips peaks again and again. Both count as they would be under the peak's own normal force, as far as T/N may
    follow that. The filter overshoots a sudden change by 3.5 % of it, which is twice the level where the finger
    `turned`.
    """
    began = found.numbers.get("slide_onset", track.time[window.start])
    last = int(np.searchsorted(track.time, float(began + settings.ratio.static_late)))
    before = track.ratio[:last]
    found.reasons.setdefault("mu_static", _NO_PEAK)
    if not np.isfinite(before).any():
        return
    top = int(np.nanargmax(before))
    end = int(np.searchsorted(track.time, float(track.time[top] + settings.ratio.static_after)))
    length = max(1, round(settings.filter.block * track.rate))
    power = power_of_normal_force(track.normal[end:], track.ratio[end:], length, settings)
    with np.errstate(invalid="ignore"):
        alike = track.ratio * (track.normal[top] / track.normal) ** power  # as T/N would be under the peak's N
    level = float(np.nanmedian(alike[top : end + 1]))
    later = alike[max(end, window.start) : window.stop]
    crest = float(np.nanmax(later)) if np.isfinite(later).any() else level
    sd = noise_of_ratio(zero, level, float(track.normal[top]))
    share = settings.ratio.static_share * (2.0 if turned else 1.0)
    if before[top] - max(level, crest) > max(settings.ratio.static_noise * sd, share * level):
        found.numbers["mu_static"] = float(before[top])
        if found.reasons["mu_static"] == _NO_PEAK:
            del found.reasons["mu_static"]


def _break_away(found: Findings, track: Track, window: slice, settings: AnalysisSettings) -> None:
    """Give the end of the stick phase, unless the contact slides before it."""
    peaked = "mu_static" in found.numbers
    away = break_away(track.time[: window.stop], track.ratio[: window.stop], settings, peaked=peaked)
    found.numbers["break_away"] = away
    # The speed's filter may tell the onset of a slide early by half of its period.
    if away is not None and away > found.numbers.get("slide_onset", np.inf) + 0.5 / settings.filter.speed_cut_off:
        found.reasons["break_away"] = _SLIDES_BEFORE


def _take_slide_onset(found: Findings, decided: StrokeDecisions) -> None:
    """Give the instant from which the contact slides, where a person decided it."""
    onset = decided.instant("slide_onset")
    if onset is not None:
        found.numbers["slide_onset"] = onset


def _take_decided(found: Findings, track: Track, decided: StrokeDecisions) -> None:
    """Give the stick phase and the direction that a person decided."""
    stick = decided.span("stick")
    if stick is not None:
        inside = track.ratio[(track.time >= stick[0]) & (track.time <= stick[1])]
        inside = inside[np.isfinite(inside)]
        if len(inside):
            found.numbers |= {"mu_static": float(inside.max()), "break_away": stick[1]}
            if found.reasons.get("mu_static") in _STICK_WITHOUT:
                del found.reasons["mu_static"]
        else:
            sentence = "The stick phase that was decided holds no T/N: the force is too low there, or nothing touches."
            found.flaw(FlawName.DECISION, sentence, "doubtful", ("mu_static",))
    if decided.direction is not None:
        found.numbers |= {"direction": decided.direction, "direction_from": "decision"}
        for name in DIRECTION:
            found.reasons.pop(name, None)


def _judge_way(found: Findings, track: Track, window: slice, settings: AnalysisSettings) -> None:
    """Say where the tangential force turns: then there is no one direction, or this is not one stroke.

    A finger that rests has hardly a drag, and its noise points anywhere.
    """
    held = np.isfinite(track.ratio) & (
        track.tangential >= settings.slide.drag_share * np.nanmax(track.tangential, initial=0.0)
    )
    way = track.wrench[:, :2] / np.where(held, track.tangential, np.nan)[:, None]
    inside = float(np.linalg.norm(mean_vector(way[window])))
    overall = float(np.linalg.norm(mean_vector(way)))
    if inside < settings.slide.one_way:
        sentence = "The tangential force turns within the steady window: no one direction, no speed along it."
        found.flaw(FlawName.DIRECTION_TURNS, sentence, "doubtful", (*SPEED, *DIRECTION))
    elif overall < settings.slide.one_way:
        sentence = "The tangential force turns during the contact: speed and direction are those of the steady window."
        found.flaw(FlawName.DIRECTION_TURNS, sentence, "doubtful")
