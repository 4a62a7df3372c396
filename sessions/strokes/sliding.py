"""The steady slide of a stroke: its window, speed and direction, and the flaws that withhold them."""

from typing import NamedTuple

import numpy as np

from drivers.arrays import Array, Indices, Mask
from sessions.strokes.forces import mean_vector
from sessions.strokes.settings import AnalysisSettings, Pair, SteadySettings
from sessions.strokes.span import Span, Track
from sessions.strokes.stroke import COEFFICIENTS, DIRECTION, SPEED, Findings, FlawName, significant

_QUARTERS = 4
_ROUNDING = 1e-9  # instants of people may be rounded [s]


def steady_window(ratio: Array, rate: float, readings: int, settings: AnalysisSettings) -> slice | None:
    """Return the stretch over which T/N is steady, by the rule of the settings, or None.

    `ratio` (n,) [-] is nan where the finger does not slide or T/N is undefined; the stroke has `readings` readings.
    Steady: the standard deviation is below 10 % of the mean and no quarter's mean differs by more than 5 % (settings)
    beyond the scatter of few readings. Of the steady stretches half as long as the slide, the one of least variance is
    returned ("least variance"), or widened to the longest steady stretch that contains it ("widened"). "middle half"
    and "whole slide" require no steadiness.
    """
    rule = settings.steady
    shortest = max(rule.steady_share * readings, rule.steady_shortest * rate, rule.steady_readings)
    starts, stops, variance, steady = _stretches(ratio, shortest, rule)
    if not len(starts):
        return None
    length = stops - starts
    if rule.steady_rule in ("middle half", "whole slide"):
        longest = int(np.argmax(length))
        sliding = starts[longest] + np.flatnonzero(np.isfinite(ratio[starts[longest] : stops[longest]]))
        margin = len(sliding) // 4 if rule.steady_rule == "middle half" else 0
        return slice(int(sliding[margin]), int(sliding[-1 - margin]) + 1)
    if not steady.any():
        return None
    seed = max(rule.steady_seed * np.isfinite(ratio).sum(), shortest)
    best = _least_varying(length, variance, steady, seed, len(ratio) / (rule.steady_edges - 1))
    if rule.steady_rule == "least variance":
        return slice(int(starts[best]), int(stops[best]))
    wider = np.flatnonzero(steady & (starts <= starts[best]) & (stops >= stops[best]))
    best = wider[np.lexsort((variance[wider], -length[wider]))[0]]
    return _trim(ratio, slice(int(starts[best]), int(stops[best])), rule)


def _stretches(ratio: Array, shortest: float, rule: SteadySettings) -> tuple[Indices, Indices, Array, Mask]:
    """Return start, stop, variance of T/N and steadiness of each sliding stretch of a grid."""
    edges = np.unique(np.linspace(0, len(ratio), rule.steady_edges).round().astype(int))
    finite = np.isfinite(ratio)
    value = np.where(finite, ratio, 0.0)
    count, total, squares = (np.concatenate([[0.0], np.cumsum(terms)]) for terms in (finite, value, value**2))
    starts, stops = (edges[index] for index in np.triu_indices(len(edges), 1))
    valid = count[stops] - count[starts]
    usable = (stops - starts >= shortest) & (valid >= rule.steady_held * (stops - starts))
    starts, stops, valid = starts[usable], stops[usable], valid[usable]
    mean = (total[stops] - total[starts]) / valid
    variance = np.maximum((squares[stops] - squares[starts]) / valid - mean**2, 0.0)
    scatter = np.where(valid < _QUARTERS * rule.steady_readings, np.sqrt(_QUARTERS * variance / valid), 0.0)
    tolerance = rule.steady_trend * mean + rule.steady_scatter * scatter
    quarters = starts + (stops - starts) * np.arange(_QUARTERS + 1)[:, None] // _QUARTERS
    means = np.diff(total[quarters], axis=0) / np.maximum(np.diff(count[quarters], axis=0), 1.0)
    steady = (np.sqrt(variance) < rule.steady_spread * mean) & (np.abs(means - mean) <= tolerance).all(axis=0)
    return starts, stops, variance, steady


def _least_varying(length: Indices, variance: Array, steady: Mask, shortest: float, grid: float) -> int:
    """Return the index of the least varying steady stretch of about the `shortest` length, or the longest if shorter.

    Lengths within a step of the `grid` count as equal.
    """
    long_enough = length[steady & (length >= shortest)]
    least_length = int(long_enough.min()) if len(long_enough) else int(length[steady].max())
    candidates = np.flatnonzero(steady & (length >= least_length) & (length <= least_length + grid))
    return int(candidates[np.argmin(variance[candidates])])


def _trim(ratio: Array, window: slice, rule: SteadySettings) -> slice:
    """Return the window without ends that lie off its median: a quarter's mean hides the end of a ramp."""
    ratios = ratio[window]
    level = float(np.nanmedian(ratios))
    scatter = 1.4826 * float(np.nanmedian(np.abs(ratios - level)))
    inside = np.flatnonzero(np.abs(ratios - level) <= max(rule.steady_trend * level, rule.steady_scatter * scatter))
    return slice(window.start + int(inside[0]), window.start + int(inside[-1]) + 1)


class Movement(NamedTuple):
    """Straight movement over a window."""

    along: tuple[float, float]  # velocity along x and y [mm/s]
    speed: float  # [mm/s]
    error: float  # standard error of the speed [mm/s]
    explained: float  # share of the movement's variance that the straight line explains [-]


def movement(time: Array, position: Array, rate: float, settings: AnalysisSettings) -> Movement | None:
    """Return the regression of position (n, 2) [mm] on time (n,) [s] over block means; None where there are too few."""
    blocks = block_means(np.column_stack([time, position]), rate, settings)
    if len(blocks) < settings.filter.fewest_blocks:
        return None
    t = blocks[:, 0] - blocks[:, 0].mean()
    deviations = blocks[:, 1:] - blocks[:, 1:].mean(axis=0)
    spread = float(t @ t)
    slope = t @ deviations / spread
    residuals = deviations - t[:, None] * slope
    speed = float(np.hypot(*slope))
    # Only scatter along the path makes the speed uncertain.
    direction = slope / speed if speed > 0.0 else np.array([1.0, 0.0])
    error = float(np.sqrt(((residuals @ direction) ** 2).sum() / (len(blocks) - 2) / spread))
    variance = float((deviations**2).sum())
    explained = 1.0 - float((residuals**2).sum()) / variance if variance > 0.0 else 0.0
    return Movement((float(slope[0]), float(slope[1])), speed, error, explained)


def displacement(position: Array) -> float:
    """Return the movement of position (n, 2) [mm] from the first to the last fifth of its readings; nan if unknown."""
    finite = position[np.isfinite(position).all(axis=1)]
    fifth = max(1, len(finite) // 5)
    if len(finite) < 2 * fifth:
        return float("nan")
    return float(np.hypot(*(finite[-fifth:].mean(axis=0) - finite[:fifth].mean(axis=0))))


def block_means(values: Array, rate: float, settings: AnalysisSettings) -> Array:
    """Return the means (k, m) of values (n, m) over whole blocks, leaving out readings with nan."""
    finite = values[np.isfinite(values).all(axis=1)]
    length = max(1, round(settings.filter.block * rate))
    count = len(finite) // length
    return finite[: count * length].reshape(count, length, values.shape[1]).mean(axis=1)


def slide(findings: Findings, span: Span, track: Track, uncut: Track, interval: Pair | None) -> slice | None:
    """Return the steady window and record its speed; None, with a flaw, where nothing slides steadily.

    An `interval` [s, device clock] decided by a person is used as the window, with its flaws. `uncut` is the whole
    contact before reversals cut it, or the stroke itself.
    """
    window, settings = None, track.settings
    if interval is not None:
        start = int(np.searchsorted(track.time, interval[0] - _ROUNDING))
        stop = int(np.searchsorted(track.time, interval[1] + _ROUNDING, "right"))
        has_ratios = np.isfinite(track.ratio[start:stop]).sum() >= settings.steady.steady_readings
        window = slice(start, stop) if has_ratios else None
    elif np.isfinite(track.speed).any():
        limit = settings.slide.sliding_share * float(np.nanpercentile(track.speed, 90))
        sliding = np.where(track.speed >= limit, track.ratio, np.nan)
        window = steady_window(sliding, track.rate, len(track.time), settings)
    speed = _speed(span, track, window)
    if not isinstance(speed, Movement) and interval is None:  # the centre of pressure does not show the slide
        window = steady_window(track.ratio, track.rate, len(track.time), settings)
        speed = _speed(span, track, window)
    refusal = _refusal(span, track, uncut, window)
    if window is not None and refusal is not None and interval is not None:
        sentence = f"{refusal[1]} The window was decided by a person: its numbers are given."
        findings.flaw(refusal[0], sentence, "doubtful")
        refusal = None
    if window is None or refusal is not None:
        name, sentence = refusal or (
            (FlawName.NO_STEADY_SLIDING, "T/N holds steady over no long enough part of the stroke.")
            if interval is None
            else (FlawName.DECISION, "The window that was decided holds too few readings with a T/N.")
        )
        forbidden = (*COEFFICIENTS, *SPEED, *DIRECTION, "normal_force", "tangential_force")
        findings.flaw(name, sentence, "refused", forbidden)
        return None
    findings.numbers["steady"] = (float(track.time[window.start]), float(track.time[window.stop - 1]))
    if isinstance(speed, Movement):
        findings.numbers |= {"speed": speed.speed, "speed_error": speed.error}
        _slide_onset(findings, track, speed)
        _direction(findings, track, window, speed)
        _side_load(findings, track, window, speed)
    else:
        findings.flaw(*speed, "doubtful", SPEED)
        _direction(findings, track, window, None)
    return window


def _refusal(span: Span, track: Track, uncut: Track, window: slice | None) -> tuple[FlawName, str] | None:
    """Return the flaw of a window without evidence of a slide; None where there is evidence."""
    if window is None:
        return None
    position, limits = track.position[window], track.settings.slide
    distance = displacement(position)
    step = span.torque_step / float(np.nanmean(track.normal[window]))
    if np.isfinite(distance):
        radius = float(np.nanmedian(np.hypot(position[:, 0], position[:, 1])))
        if radius > limits.farthest:
            return FlawName.UNITS_IMPLAUSIBLE, (
                f"The centre of pressure lies {significant(radius, 3)} mm from the axis, where no finger is: check the "
                "units of the torques and the face's height; nothing shows that the contact slides, so no "
                "friction is given."
            )
        if distance > max(limits.shear, limits.shear_steps * step):
            return _roll_flaw(track, uncut, float(np.nanmean(track.ratio[window])))
    moves = f"moves by {significant(distance, 2)} mm" if np.isfinite(distance) else "is not known"
    return FlawName.NO_STEADY_SLIDING, (
        f"T/N holds steady for a while, but the centre of pressure {moves} meanwhile: nothing shows that the contact "
        "slides, and a ratio at rest is no coefficient of friction; torques in a wrong unit would look so too."
    )


def _roll_flaw(track: Track, uncut: Track, level: float) -> tuple[FlawName, str] | None:
    """Return the flaw of a centre of pressure that moves no further than by rolling; None where it moves further.

    The movement counts in the `uncut` contact where T/N is near its steady `level`: below it nothing slips.
    """
    settings = track.settings
    slipping = np.abs(uncut.ratio - level) <= 2.0 * settings.steady.steady_spread * level
    positions = block_means(np.where(slipping[:, None], uncut.position, np.nan), track.rate, settings)
    distance = float(np.hypot(*np.ptp(positions, axis=0))) if len(positions) else 0.0
    if distance > settings.slide.roll:
        return None
    return FlawName.ROLLED, (
        f"The centre of pressure moves by {distance:.2g} mm while T/N holds, and a finger that rolls without slip "
        f"moves it by up to {settings.slide.roll:g} mm: nothing shows a slide, so no friction is given; stroke further."
    )


def _speed(span: Span, track: Track, window: slice | None) -> Movement | tuple[FlawName, str]:
    """Return the movement over a window, or the flaw that withholds its speed."""
    name = FlawName.SPEED_NOT_MEASURABLE
    if window is None:
        return name, ""
    time, settings, limits = track.time[window], track.settings, track.settings.slide
    motion = movement(time, track.position[window], track.rate, settings)
    if motion is None:
        return name, "The centre of pressure is known at too few instants of the steady window for a speed."
    step = span.torque_step / float(np.nanmean(track.normal[window]))
    reason = ""
    if step > limits.speed_step * (motion.speed * float(time[-1] - time[0])):
        reason = f"The torques come in steps that move the centre of pressure by {step:.2g} mm"
    elif motion.error > limits.speed_error * motion.speed:
        reason = f"The centre of pressure moves at {significant(motion.speed, 2)} ± {significant(motion.error, 2)} mm/s"
    elif motion.explained < limits.speed_line:
        reason = f"A straight line explains {100 * motion.explained:.0f} % of the centre of pressure's movement"
    if reason:
        return name, f"{reason}: no speed is given."
    if span.frame.height_origin == "default":
        arm = -track.wrench[window, :2] / track.normal[window, None]
        lever = movement(time, arm, track.rate, settings)
        height_error = limits.height_doubt * (lever.speed if lever else 0.0)
        if height_error > limits.speed_error * motion.speed:
            return FlawName.HEIGHT_UNKNOWN, (
                f"Nobody stated the face's height: were it wrong by {limits.height_doubt:g} mm the speed of "
                f"{motion.speed:.3g} mm/s would change by {height_error:.2g} mm/s, so none is given."
            )
    return motion


def _slide_onset(findings: Findings, track: Track, motion: Movement) -> None:
    """Record the first instant from which the centre of pressure keeps a share of its steady speed."""
    start = int(np.searchsorted(track.time, float(findings.numbers["steady"][0])))
    slow = ~(track.speed[: start + 1] >= track.settings.slide.slide_share * motion.speed)
    onset = int(np.flatnonzero(slow)[-1]) + 1 if slow.any() else 0
    if onset <= start:
        findings.numbers["slide_onset"] = float(track.time[onset])


def slide_onset_draws(
    time: Array, speed: Array, least_speed: Array, noise: Array, draw: np.random.Generator
) -> Array | None:
    """Return draws of the slide's onset (repeats,) [s]; None where the speed is unknown.

    `speed` (n,) [mm/s] at `time` (n,) [s] covers the contact's onset to the steady window. `least_speed` is the speed
    at which the slide has begun, `noise` the error of the measured speed (repeats,) [mm/s]. Where the first known speed
    exceeds that, the slide may have begun at any earlier instant.
    """
    slow = np.flatnonzero(~np.isfinite(speed))
    start = int(slow[-1]) + 1 if len(slow) else 0
    if len(speed) - start < 2:
        return None
    least = np.minimum.accumulate(speed[start:][::-1])[::-1]  # the least speed from each instant on
    onsets = np.interp(least_speed - noise, least, time[start:])
    return np.where(least_speed - noise < least[0], draw.uniform(time[0], time[start], len(least_speed)), onsets)


def _side_load(findings: Findings, track: Track, window: slice, motion: Movement) -> None:
    """Record a flaw for a drag across the movement: friction alone acts along it."""
    drag = mean_vector(track.wrench[window, :2])
    along = np.array(motion.along) / motion.speed
    across = float(abs(drag[0] * along[1] - drag[1] * along[0]))
    share = across / float(np.hypot(*drag))
    if share > track.settings.slide.side_load:
        sentence = (
            f"{100 * share:.0f} % of the tangential force lies across the finger's movement: a load from the side, a "
            "face that leans, or axes that are turned; T/N holds it, and friction along the movement is less."
        )
        findings.flaw(FlawName.SIDE_LOAD, sentence, "doubtful")


def _direction(findings: Findings, track: Track, window: slice, motion: Movement | None) -> None:
    """Record the direction along x: from the movement, else from the drag, which points along the movement."""
    drag, share = mean_vector(track.wrench[window, :2]), track.settings.slide.along_share
    drag_sign = int(np.sign(drag[0])) if abs(drag[0]) >= share * np.hypot(*drag) else None
    movement_sign = None
    if motion is not None and abs(motion.along[0]) >= share * motion.speed:
        movement_sign = int(np.sign(motion.along[0]))
    if movement_sign is not None and drag_sign is not None and movement_sign != drag_sign:
        sentence = (
            "The centre of pressure moved one way and the drag points the other: the frame, its normal or its height "
            "is wrong, so neither speed nor direction is given."
        )
        findings.flaw(FlawName.DIRECTION_DISAGREES, sentence, "doubtful", (*SPEED, *DIRECTION))
        return
    heading = drag if motion is None else np.array(motion.along)
    findings.numbers["heading"] = float(np.degrees(np.arctan2(heading[1], heading[0])))
    if movement_sign is not None:
        findings.numbers |= {"direction": movement_sign, "direction_from": "centre of pressure"}
    elif drag_sign is not None:
        findings.numbers |= {"direction": drag_sign, "direction_from": "tangential force"}
