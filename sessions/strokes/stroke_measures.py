"""The numbers of one stroke, and the flaws that withhold them."""

import numpy as np

from drivers.arrays import Array
from sessions.plan.plan import PROXIMAL_TO_DISTAL, SessionPlan, Trial
from sessions.strokes.contacts import Contact
from sessions.strokes.decisions import StrokeDecisions
from sessions.strokes.forces import mean_vector
from sessions.strokes.settings import ZeroSettings
from sessions.strokes.sliding import slide
from sessions.strokes.span import Span, StrokeZero, Track, curve_of, noise_of_ratio, track_of, unfiltered_forces
from sessions.strokes.stick import break_away, power_of_normal_force, stick_slip
from sessions.strokes.stroke import (
    COEFFICIENTS,
    DIRECTION,
    EVERYTHING,
    PEAKS,
    SPEED,
    Findings,
    Flaw,
    FlawName,
    Stroke,
    significant,
)

_SLIDES_BEFORE = "the contact slides before T/N stops climbing"
_NO_PEAK = "no static peak stands out"
_STICK_WITHOUT = (_NO_PEAK, FlawName.NO_STEADY_SLIDING, FlawName.RATIO_ABOVE_ONE)  # a decided stick phase lifts these


def measure_stroke(
    span: Span,
    contact: Contact,
    zero: StrokeZero,
    plan: SessionPlan,
    trial: Trial | None,
    number: int,
    decisions: StrokeDecisions,
) -> tuple[Stroke, tuple[Flaw, ...]]:
    """Return a contact's stroke and its flaws; `plan` gives the contact area for tau_max.

    `number` counts strokes within the trial; a person's `decisions` override the analysis.
    """
    findings, crest_gap = Findings(), None
    track = track_of(span, contact, zero)
    _judge_ends(findings, contact, track)
    _judge_zero(findings, zero, track)
    if zero.flaw is not FlawName.NO_UNLOADED_STRETCH:
        _judge_gaps(findings, span, contact)
        _judge_loads(findings, track, plan.contact_area)
        uncut = track if contact.uncut is None else track_of(span, contact.uncut, zero)
        window = slide(findings, span, track, uncut, decisions.value("steady"))
        _decide_slide_onset(findings, track, decisions)
        if window is not None:
            crest_gap = _stick_slip(findings, span, contact, track, window, zero, plan.contact_area)
            _friction(findings, track, window)
            _static_peak(findings, track, window, zero, turns=contact.start in contact.reversals)
            _break_away(findings, track, window)
            _judge_direction(findings, track, window)
        _apply_decisions(findings, track, decisions)
        _judge_drift(findings, zero, track.settings.zero)
    numbers = {name: None if name in findings.reasons else findings.numbers.get(name) for name in EVERYTHING}
    if trial is not None and numbers["direction"] not in (None, trial.direction):
        course = "proximal to distal" if trial.direction == PROXIMAL_TO_DISTAL else "distal to proximal"
        sentence = f"The finger moved the other way than the trial asks ({course})."
        findings.flaw(FlawName.WRONG_DIRECTION, sentence, "doubtful")
    stroke = Stroke(
        trial=None if trial is None else trial.number,
        onset=contact.onset if "onset" not in findings.reasons else decisions.instant("onset"),
        lift=contact.lift if "lift" not in findings.reasons else decisions.instant("lift"),
        readings=numbers.pop("readings") or 0,
        zero=zero.origin,
        zero_drift=None if zero.drift is None else float(np.linalg.norm(zero.drift[:3])),
        flaws=tuple(dict.fromkeys(str(flaw.name) for flaw in findings.flaws)),
        reasons=dict(findings.reasons),
        area_exponent=track.settings.area.exponent,
        number=number,
        kept=decisions.value("kept") is not False,
        decided={name: decision.sentence for name, decision in decisions.by_name.items()},
        curve=curve_of(span, contact, zero, crest_gap),
        **numbers,
    )
    return stroke, tuple(findings.flaws)


def _judge_ends(findings: Findings, contact: Contact, track: Track) -> None:
    if contact.onset is None:
        sentence = "The recording begins in contact: no onset, and what came before is not known."
        findings.flaw(FlawName.BEGINS_IN_CONTACT, sentence, "doubtful")
    if contact.lift is None:
        findings.flaw(FlawName.ENDS_IN_CONTACT, "The recording ends in contact: no lift.", "doubtful")
    if contact.valleys and len(contact.reversals) < 2:
        sentence = (
            "The force did not return to zero between this stroke and its neighbour: there it begins or ends where a "
            "fifth of its peak is left."
        )
        findings.flaw(FlawName.NOT_LIFTED, sentence, "doubtful")
    if contact.reversals:
        sentence = (
            "The finger turned without lifting: this stroke begins or ends at the turn, where the drag changes its "
            "sign, and its neighbour goes the other way."
        )
        findings.flaw(FlawName.TURNED, sentence, "note")
    peak = float(np.nanmax(track.normal, initial=0.0))
    in_contact = np.flatnonzero(track.normal >= track.settings.ratio.force_floor_share * peak)
    crept = float(track.time[in_contact[0]]) - contact.onset if contact.onset is not None and len(in_contact) else 0.0
    if crept > track.settings.contact.slow_onset:
        sentence = (
            f"The force crept for {crept:.2f} s from leaving its zero to a fifth of its peak: the onset marks where it "
            "left, which may not be the touch."
        )
        findings.flaw(FlawName.SLOW_ONSET, sentence, "doubtful")


def _judge_zero(findings: Findings, zero: StrokeZero, track: Track) -> None:
    if zero.flaw is FlawName.NO_UNLOADED_STRETCH:
        sentence = (
            f"From {track.time[0]:.2f} to {track.time[-1]:.2f} s the recorded force lies beyond a fifth of its peak, "
            "but no stretch around is unloaded, so the zero is unknown: perhaps there is no contact at all, and no "
            "onset, lift, friction, force or speed is given."
        )
        findings.flaw(zero.flaw, sentence, "refused", (*EVERYTHING, "onset", "lift"))
    elif zero.flaw is FlawName.ZERO_AFTER_CONTACT:
        sentence = "No stretch before this contact is unloaded: the zero was taken after it, and drift is not known."
        findings.flaw(zero.flaw, sentence, "doubtful")


def _judge_gaps(findings: Findings, span: Span, contact: Contact) -> None:
    """Withhold peaks that missing readings may hide."""
    start, stop = span.time[contact.start], span.time[contact.stop - 1]
    if ((span.saturation_times >= start) & (span.saturation_times <= stop)).any():
        sentence = "Readings of this stroke are saturated or come with a fault of the device: its peaks are not known."
        findings.flaw(FlawName.SATURATED, sentence, "doubtful", PEAKS)
    inside = [gap for gap in span.quality.gaps if start <= gap.start and gap.stop <= stop]
    widest = max(inside, key=lambda gap: gap.stop - gap.start, default=None)
    if widest is not None and widest.stop - widest.start > span.settings.contact.longest_gap + 1.0 / span.rate:
        sentence = (
            f"No sound readings from {widest.start:.2f} to {widest.stop:.2f} s of this stroke ({widest.cause}), which "
            "may hide its peaks."
        )
        findings.flaw(widest.cause, sentence, "doubtful", PEAKS)
    wild = [gap for gap in inside if gap.cause is FlawName.WILD]
    if wild:
        instant = f"at {wild[0].start:.2f} s of this stroke"
        sentence = f"A wild reading {instant} was left out: compare its numbers with its curve."
        findings.flaw(FlawName.WILD, sentence, "doubtful")


def _judge_loads(findings: Findings, track: Track, planned_area: float) -> None:
    """Record the greatest forces, and flaws where they are implausible."""
    peak, settings = float(np.nanmax(track.normal, initial=0.0)), track.settings
    greatest = float(np.nanmax(track.tangential, initial=0.0))
    traction, area = _greatest_traction(track, track.tangential, planned_area)
    findings.numbers |= {"peak_normal": peak, "peak_tangential": greatest, "tau_max": traction, "contact_area": area}
    findings.numbers["mu_max"] = _greatest_ratio(track, track.floor)
    if peak < settings.ratio.force_floor:
        sentence = (
            f"The normal force reaches {peak:.2g} N: below {settings.ratio.force_floor:g} N friction means nothing."
        )
        findings.flaw(FlawName.TOO_LITTLE_FORCE, sentence, "refused", (*COEFFICIENTS, *SPEED, *DIRECTION))
    if peak > settings.contact.greatest_force:
        reached = f"The normal force reaches {significant(peak, 3)} N"
        sentence = f"{reached}, more than a finger presses: check the units of the forces."
        findings.flaw(FlawName.UNITS_IMPLAUSIBLE, sentence, "doubtful")
    half = settings.ratio.light_half * peak
    is_light = (track.ratio > 1.0) & (track.normal < half)
    ratios = track.ratio[track.normal >= half]
    if is_light.any() and np.isfinite(ratios).any() and np.nanmedian(ratios) < 1.0:
        sentence = (
            f"T/N exceeds 1 while N is below half its peak ({significant(peak, 3)} N), and not above: drift or a side "
            "load makes the ratio there; its maximum is that above half the peak."
        )
        findings.flaw(FlawName.RATIO_ABOVE_ONE, sentence, "doubtful", ("mu_static",))
        findings.numbers["mu_max"] = _greatest_ratio(track, half)


def _greatest_traction(track: Track, tangential: Array, planned_area: float) -> tuple[float | None, float | None]:
    """Return the greatest mean traction [MPa] and the area [mm2] it acts on; None where a growing area has no N."""
    law = track.settings.area
    if law.law == "fixed":
        return float(np.nanmax(tangential, initial=0.0)) / planned_area, planned_area
    in_contact = np.flatnonzero(track.normal >= track.floor)
    if not len(in_contact):
        return None, None
    areas = law.area(track.normal[in_contact], planned_area)
    tractions = tangential[in_contact] / areas
    top = int(np.argmax(tractions))
    return float(tractions[top]), float(areas[top])


def _greatest_ratio(track: Track, floor: float) -> float | None:
    """Return the greatest T/N of forces averaged over a moving window, where N stays above `floor` [N].

    Forces are averaged, not the ratio: noise then raises the maximum far less.
    """
    settings = track.settings
    length = max(1, round(settings.filter.smoothing * track.rate))
    if len(track.time) < length:
        return None
    normal = np.where(track.normal >= floor, track.normal, np.nan)
    box = np.ones(length) / length
    means = np.convolve(track.tangential, box, "valid") / np.convolve(normal, box, "valid")
    durations = track.time[length - 1 :] - track.time[: len(track.time) - length + 1]
    means = means[np.isfinite(means) & (durations < settings.zero.quiet_gap * length / track.rate)]
    return float(means.max()) if len(means) else None


def _friction(findings: Findings, track: Track, window: slice) -> None:
    """Record the means of T/N and of the forces over the steady window."""
    values = track.ratio[window][np.isfinite(track.ratio[window])]
    mean = float(values.mean())
    if mean > 1.0:
        sentence = (
            f"T/N is {mean:.2f} in the steady window: a surface that sticks can make it so, but so do a clipped "
            "axis, a wrong gain or zero, or a face that leans."
        )
        findings.flaw(FlawName.RATIO_ABOVE_ONE_THROUGHOUT, sentence, "doubtful")
    findings.numbers |= {
        "mu_dynamic": mean,
        "mu_dynamic_sd": float(values.std(ddof=1)),
        "readings": len(values),
        "normal_force": float(np.nanmean(track.normal[window])),
        "tangential_force": float(np.nanmean(track.tangential[window])),
    }


def _stick_slip(
    findings: Findings, span: Span, contact: Contact, track: Track, window: slice, zero: StrokeZero, planned_area: float
) -> float | None:
    """In stick-slip, take tau_max from the unfiltered force, and return how far readings may miss it [N]."""
    drag, normal = unfiltered_forces(span, slice(contact.start, contact.stop), zero)
    ratio = np.where(normal >= track.floor, drag / np.maximum(normal, track.floor), np.nan)
    level, load = float(np.nanmean(track.ratio[window])), float(np.nanmean(track.normal[window]))
    slips = stick_slip(track.time[window], ratio[window], noise_of_ratio(zero, level, load), track.settings)
    if slips is None:
        return None
    crest_gap = slips.crest_gap * load
    filtered, unfiltered = findings.numbers["peak_tangential"], float(np.nanmax(drag))
    traction, area = _greatest_traction(track, drag, planned_area)
    findings.numbers |= {"tau_max": traction, "contact_area": area, "peak_tangential": unfiltered}
    percent_above = 100 * (unfiltered / filtered - 1.0)
    sentence = (
        f"The contact sticks and slips at {slips.frequency:.2g} Hz: the greatest tangential force and tau_max are "
        f"those of unfiltered forces, {percent_above:.2g} % above the filtered ones; readings may miss "
        f"the crest by {100 * crest_gap / unfiltered:.1g} %, and noise raises it."
    )
    findings.flaw(FlawName.STICK_SLIP, sentence, "note")
    return crest_gap


def _judge_drift(findings: Findings, zero: StrokeZero, limits: ZeroSettings) -> None:
    """Record a flaw where drift of the zero may have changed mu, and withhold the numbers if by too much."""
    sideways, upright = zero.unsure
    tangential = findings.numbers.get("tangential_force", findings.numbers["peak_tangential"])
    normal = findings.numbers.get("normal_force", findings.numbers["peak_normal"])
    share = sideways / tangential + upright / normal if tangential > 0.0 and normal > 0.0 else float("inf")
    if share <= limits.drift_doubted:
        return
    refused = share > limits.drift_refused
    sentence = (
        f"With nothing pressing, the forces around this stroke lie {significant(sideways, 2)} N sideways and "
        f"{significant(upright, 2)} N along the normal from its zero: mu may be wrong by {100 * share:.0f} %"
        f"{', so no force, friction or speed is given' if refused else ''}."
    )
    findings.flaw(FlawName.DRIFT, sentence, "refused" if refused else "doubtful", EVERYTHING if refused else ())


def _decide_slide_onset(findings: Findings, track: Track, decisions: StrokeDecisions) -> None:
    """Set the slide onset that a person decided, unless it lies outside the contact."""
    onset = decisions.instant("slide_onset")
    if onset is not None and track.time[0] <= onset <= track.time[-1]:
        findings.numbers["slide_onset"] = onset
    elif onset is not None:
        sentence = "The slide onset that was decided lies outside of the contact: it stays as it was found."
        findings.flaw(FlawName.DECISION, sentence, "doubtful")


def _static_peak(findings: Findings, track: Track, window: slice, zero: StrokeZero, *, turns: bool) -> None:
    """Record the static peak where it exceeds the level after it by its noise and by a share.

    The level is both the one just after the peak and the highest crest of the steady window, since stick-slip peaks
    repeatedly. Both are scaled to the peak's normal force, as far as T/N may follow N. The filter overshoots a sudden
    change, of twice the level where the finger `turns`, by 3.5 %.
    """
    settings, began = track.settings, findings.numbers.get("slide_onset", track.time[window.start])
    latest = int(np.searchsorted(track.time, float(began + settings.ratio.static_late)))
    ratios = track.ratio[:latest]
    findings.reasons.setdefault("mu_static", _NO_PEAK)
    if not np.isfinite(ratios).any():
        return
    peak = int(np.nanargmax(ratios))
    settled = int(np.searchsorted(track.time, float(track.time[peak] + settings.ratio.static_after)))
    power = power_of_normal_force(track.normal[settled:], track.ratio[settled:], track.rate, settings)
    with np.errstate(invalid="ignore"):
        comparable = track.ratio * (track.normal[peak] / track.normal) ** power  # as T/N would be under the peak's N
    level = float(np.nanmedian(comparable[peak : settled + 1]))
    slide_ratios = comparable[max(settled, window.start) : window.stop]
    crest = float(np.nanmax(slide_ratios)) if np.isfinite(slide_ratios).any() else level
    sd = noise_of_ratio(zero, level, float(track.normal[peak]))
    share = settings.ratio.static_share * (2.0 if turns else 1.0)
    if ratios[peak] - max(level, crest) > max(settings.ratio.static_noise * sd, share * level):
        findings.numbers["mu_static"] = float(ratios[peak])
        if findings.reasons["mu_static"] == _NO_PEAK:
            del findings.reasons["mu_static"]


def _break_away(findings: Findings, track: Track, window: slice) -> None:
    """Record the end of the stick phase, unless the contact slides before it."""
    peaked = "mu_static" in findings.numbers
    instant = break_away(track.time[: window.stop], track.ratio[: window.stop], track.settings, peaked=peaked)
    findings.numbers["break_away"] = instant
    tolerance = 0.5 / track.settings.filter.speed_cut_off  # half a period: the filter may shift a slide's onset by that
    if instant is not None and instant > findings.numbers.get("slide_onset", np.inf) + tolerance:
        findings.reasons["break_away"] = _SLIDES_BEFORE


def _apply_decisions(findings: Findings, track: Track, decisions: StrokeDecisions) -> None:
    """Set the stick phase and the direction decided by a person."""
    stick = decisions.value("stick")
    if stick is not None:
        inside = track.ratio[(track.time >= stick[0]) & (track.time <= stick[1])]
        inside = inside[np.isfinite(inside)]
        if len(inside):
            findings.numbers |= {"mu_static": float(inside.max()), "break_away": stick[1]}
            if findings.reasons.get("mu_static") in _STICK_WITHOUT:
                del findings.reasons["mu_static"]
        else:
            sentence = "The stick phase that was decided holds no T/N: the force is too low there, or nothing touches."
            findings.flaw(FlawName.DECISION, sentence, "doubtful", ("mu_static",))
    if (direction := decisions.value("direction")) is not None:
        findings.numbers |= {"direction": direction, "direction_from": "decision"}
        for name in DIRECTION:
            findings.reasons.pop(name, None)


def _judge_direction(findings: Findings, track: Track, window: slice) -> None:
    """Record a flaw where the tangential force turns: there is no single direction, or not a single stroke.

    A finger at rest has almost no drag, and noise has any direction.
    """
    limits, greatest = track.settings.slide, np.nanmax(track.tangential, initial=0.0)
    in_drag = np.isfinite(track.ratio) & (track.tangential >= limits.drag_share * greatest)
    directions = track.wrench[:, :2] / np.where(in_drag, track.tangential, np.nan)[:, None]
    inside = float(np.linalg.norm(mean_vector(directions[window])))
    overall = float(np.linalg.norm(mean_vector(directions)))
    if inside < limits.one_way:
        sentence = "The tangential force turns within the steady window: no one direction, no speed along it."
        findings.flaw(FlawName.DIRECTION_TURNS, sentence, "doubtful", (*SPEED, *DIRECTION))
    elif overall < limits.one_way:
        sentence = "The tangential force turns during the contact: speed and direction are those of the steady window."
        findings.flaw(FlawName.DIRECTION_TURNS, sentence, "doubtful")
