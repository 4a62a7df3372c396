"""Where a stroke slides steadily, how fast and which way; and what forbids saying so."""

import numpy as np

from sessions.plan.plan import Frame
from sessions.strokes.flaws import FlawName
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.span import Span
from sessions.strokes.steady import FEWEST, Movement, block_means, displacement, movement, steady_window
from sessions.strokes.stroke_findings import COEFFICIENTS, DIRECTION, SPEED, Findings
from sessions.strokes.track import Track, mean_vector

_ROUNDING = 1e-9  # instants are told to the last bit, or rounded by people [s]


def slide(
    found: Findings,
    span: Span,
    track: Track,
    frame: Frame,
    settings: AnalysisSettings,
    decided: tuple[float, float] | None = None,
    whole: Track | None = None,
) -> slice | None:
    """Find the steady window and the speed in it; None, with the reason, where nothing slides steadily.

    A window that a person `decided` [s, device clock] is taken; what speaks against it is named. `whole` is the contact
    that turns cut the stroke out of.
    """
    window = None
    if decided is not None:
        window = _asked(track, decided)
    elif np.isfinite(track.speed).any():
        limit = settings.sliding_share * float(np.nanpercentile(track.speed, 90))
        with np.errstate(invalid="ignore"):
            sliding = np.where(track.speed >= limit, track.ratio, np.nan)
        window = steady_window(sliding, track.rate, len(track.time), settings)
    moved, trouble = _speed(span, track, window, frame, settings)
    if trouble is not None and decided is None:  # the centre of pressure does not tell when the finger slides
        window = steady_window(track.ratio, track.rate, len(track.time), settings)
        moved, trouble = _speed(span, track, window, frame, settings)
    at_rest = _rest(span, track, track if whole is None else whole, window, settings)
    if window is not None and at_rest is not None and decided is not None:
        found.flaw(at_rest[0], f"{at_rest[1]} The window was decided by a person: its numbers are given.", "doubtful")
        at_rest = None
    if window is None or at_rest is not None:
        name, sentence = at_rest or (
            (FlawName.NO_STEADY_SLIDING, "T/N holds steady over no long enough part of the stroke.")
            if decided is None
            else (FlawName.DECISION, "The window that was decided holds too few readings with a T/N.")
        )
        forbidden = (*COEFFICIENTS, *SPEED, *DIRECTION, "normal_force", "tangential_force")
        found.flaw(name, sentence, "refused", forbidden)
        return None
    found.numbers["steady"] = (float(track.time[window.start]), float(track.time[window.stop - 1]))
    if trouble is not None:
        found.flaw(trouble[0], trouble[1], "doubtful", SPEED)
    elif moved is not None:
        found.numbers |= {"speed": moved.speed, "speed_error": moved.error}
        _slide_onset(found, track, moved, settings)
    _direction(found, track, window, moved if trouble is None else None)
    if trouble is None and moved is not None:
        _side_load(found, track, window, moved, settings)
    return window


def _asked(track: Track, decided: tuple[float, float]) -> slice | None:
    """Return the readings between two instants; None where too few of them have a ratio."""
    start = int(np.searchsorted(track.time, decided[0] - _ROUNDING))
    stop = int(np.searchsorted(track.time, decided[1] + _ROUNDING, "right"))
    return slice(start, stop) if np.isfinite(track.ratio[start:stop]).sum() >= FEWEST else None


def _rest(
    span: Span, track: Track, whole: Track, window: slice | None, settings: AnalysisSettings
) -> tuple[FlawName, str] | None:
    """Say why nothing shows that the contact slides over a window, or None where it does."""
    if window is None:
        return None
    position = track.position[window]
    way = displacement(position)
    step = span.torque_step / float(np.nanmean(track.normal[window]))
    if np.isfinite(way):
        where = float(np.nanmedian(np.hypot(position[:, 0], position[:, 1])))
        if where > settings.farthest:
            return FlawName.UNITS_IMPLAUSIBLE, (
                f"The centre of pressure lies {where:.3g} mm from the axis, where no finger is: check the units of the "
                "torques and the face's height; nothing shows that the contact slides, so no friction is given."
            )
        if way > max(settings.shear, settings.shear_steps * step):
            return _rolled(track, whole, float(np.nanmean(track.ratio[window])), settings)
    moves = f"moves by {way:.2g} mm" if np.isfinite(way) else "is not known"
    return FlawName.NO_STEADY_SLIDING, (
        f"T/N holds steady for a while, but the centre of pressure {moves} meanwhile: nothing shows that the contact "
        "slides, and a ratio at rest is no coefficient of friction; torques in a wrong unit would look so too."
    )


def _rolled(track: Track, whole: Track, level: float, settings: AnalysisSettings) -> tuple[FlawName, str] | None:
    """Say that the centre of pressure moves no further than a finger rolls, or None where it does.

    It counts over the `whole` contact, turns included, and only where T/N lies about its `level` in the steady window:
    a contact slips nowhere below that.
    """
    with np.errstate(invalid="ignore"):
        at_level = np.abs(whole.ratio - level) <= 2.0 * settings.steady_spread * level
    places = block_means(np.where(at_level[:, None], whole.position, np.nan), track.rate, settings)
    way = float(np.hypot(*np.ptp(places, axis=0))) if len(places) else 0.0
    if way > settings.roll:
        return None
    return FlawName.ROLLED, (
        f"The centre of pressure moves by {way:.2g} mm while T/N holds, and a finger that rolls without slip moves it "
        f"by up to {settings.roll:g} mm: nothing shows a slide, so no friction is given; stroke further."
    )


def _speed(
    span: Span, track: Track, window: slice | None, frame: Frame, settings: AnalysisSettings
) -> tuple[Movement | None, tuple[FlawName, str] | None]:
    """Return the movement over a window, and what forbids taking it for a speed."""
    if window is None:
        return None, (FlawName.SPEED_NOT_MEASURABLE, "")
    moved = movement(track.time[window], track.position[window], track.rate, settings)
    return moved, _speed_trouble(span, track, window, moved, frame, settings)


def _speed_trouble(
    span: Span, track: Track, window: slice, moved: Movement | None, frame: Frame, settings: AnalysisSettings
) -> tuple[FlawName, str] | None:
    """Say why the centre of pressure gives no speed over a window, or None where it does."""
    name = FlawName.SPEED_NOT_MEASURABLE
    if moved is None:
        return name, "The centre of pressure is known at too few instants of the steady window for a speed."
    way = moved.speed * float(track.time[window.stop - 1] - track.time[window.start])
    step = span.torque_step / float(np.nanmean(track.normal[window]))
    if step > settings.speed_step * way:
        return name, f"The torques come in steps that move the centre of pressure by {step:.2g} mm: no speed is told."
    if moved.error > settings.speed_error * moved.speed:
        return name, f"The centre of pressure moves at {moved.speed:.2g} ± {moved.error:.2g} mm/s: no speed is told."
    if moved.explained < settings.speed_line:
        share = 100 * moved.explained
        return name, f"A straight line explains {share:.0f} % of the centre of pressure's movement: no speed is told."
    if frame.height_origin == "default":
        lever = movement(
            track.time[window], -track.wrench[window, :2] / track.normal[window, None], track.rate, settings
        )
        wrong = settings.height_doubt * (lever.speed if lever else 0.0)
        if wrong > settings.speed_error * moved.speed:
            return FlawName.HEIGHT_UNKNOWN, (
                f"Nobody stated the face's height: were it wrong by {settings.height_doubt:g} mm the speed of "
                f"{moved.speed:.3g} mm/s would change by {wrong:.2g} mm/s, so none is given."
            )
    return None


def _slide_onset(found: Findings, track: Track, moved: Movement, settings: AnalysisSettings) -> None:
    """Give the first instant from which the centre of pressure keeps a share of its steady speed."""
    start = int(np.searchsorted(track.time, float(found.numbers["steady"][0])))
    with np.errstate(invalid="ignore"):
        slow = ~(track.speed[: start + 1] >= settings.slide_share * moved.speed)
    last_slow = np.flatnonzero(slow)
    first = int(last_slow[-1]) + 1 if len(last_slow) else 0
    if first <= start:
        found.numbers["slide_onset"] = float(track.time[first])


def _side_load(found: Findings, track: Track, window: slice, moved: Movement, settings: AnalysisSettings) -> None:
    """Name a drag that does not lie along the movement: friction alone opposes it."""
    drag = mean_vector(track.wrench[window, :2])
    along = np.array(moved.along) / moved.speed
    across = float(abs(drag[0] * along[1] - drag[1] * along[0]))
    share = across / float(np.hypot(*drag))
    if share > settings.side_load:
        sentence = (
            f"{100 * share:.0f} % of the tangential force lies across the finger's movement: a load from the side, a "
            "face that leans, or axes that are turned; T/N holds it, and friction along the movement is less."
        )
        found.flaw(FlawName.SIDE_LOAD, sentence, "doubtful")


def _direction(found: Findings, track: Track, window: slice, moved: Movement | None) -> None:
    """Give the direction along x: from the movement, else from the drag, which points the way the finger moves."""
    drag = mean_vector(track.wrench[window, :2])
    by_drag = int(np.sign(drag[0])) if abs(drag[0]) >= 0.5 * np.hypot(*drag) else None
    by_movement = None
    if moved is not None and abs(moved.along[0]) >= 0.5 * moved.speed:
        by_movement = int(np.sign(moved.along[0]))
    if by_movement is not None and by_drag is not None and by_movement != by_drag:
        sentence = (
            "The centre of pressure moved one way and the drag points the other: the frame, its normal or its height "
            "is wrong, so neither speed nor direction is given."
        )
        found.flaw(FlawName.DIRECTION_DISAGREES, sentence, "doubtful", (*SPEED, *DIRECTION))
        return
    way = drag if moved is None else np.array(moved.along)
    found.numbers["heading"] = float(np.degrees(np.arctan2(way[1], way[0])))
    if by_movement is not None:
        found.numbers |= {"direction": by_movement, "direction_from": "centre of pressure"}
    elif by_drag is not None:
        found.numbers |= {"direction": by_drag, "direction_from": "tangential force"}
