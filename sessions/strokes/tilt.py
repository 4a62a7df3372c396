"""How the stimulus's face leans against the transducer, estimated from presses that do not slide.

Whoever presses along the face's normal n with the force N exerts -N n: what stands sideways over N is how far n leans.
A press that pushes sideways by itself looks the same. Presses of one hand lean alike, so only several presses, or a
weight in place of a finger, tell the face from the hand.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sessions.plan.plan import Frame
from sessions.strokes.contacts import Contact
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.sliding import block_means, displacement
from sessions.strokes.span import Span, StrokeZero, track_of

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Press:
    """A contact that pressed and did not slide."""

    trial: int | None
    start: float  # of the hold [s, device clock]
    stop: float
    lean: Pair  # of the face's normal towards +x and +y [degrees], if it pressed straight down
    error: Pair  # standard uncertainty from noise and zero [degrees]


@dataclass(frozen=True, slots=True)
class Tilt:
    """How far the face's normal leans from the transducer's axis towards +x and +y."""

    lean: Pair  # [degrees]
    x_interval: Pair  # [degrees]
    y_interval: Pair
    presses: tuple[Press, ...]
    kind: str  # what the intervals hold, for people

    @property
    def error(self) -> Pair:
        """The standard uncertainty [degrees] of the mean of two presses or more, from how they scatter."""
        return _mean_error(self.presses)


def press_of(
    span: Span, contact: Contact, zero: StrokeZero, frame: Frame, trial: int | None, settings: AnalysisSettings
) -> Press | None:
    """Return the press in a contact; None where it slides, is short, or drags more than a press does."""
    track = track_of(span, contact, zero, frame.height, settings)
    peak = float(np.nanmax(track.normal, initial=0.0))
    if peak < settings.ratio.force_floor:
        return None
    with np.errstate(invalid="ignore"):
        pressed = np.flatnonzero(track.normal >= settings.press.press_held * peak)
    hold = slice(int(pressed[0]), int(pressed[-1]) + 1)
    lasted = float(track.time[hold.stop - 1] - track.time[hold.start])
    distance = displacement(track.position[hold])
    if lasted < settings.press.press_shortest or not distance <= settings.press.press_moves:
        return None
    values = np.column_stack([track.wrench[hold, :2], track.normal[hold]])
    blocks = block_means(values, track.rate, settings)
    if len(blocks) < settings.press.press_fewest:
        return None
    ratio = -blocks[:, :2] / blocks[:, 2:]
    if np.hypot(*ratio.mean(axis=0)) > settings.press.press_ratio:
        return None
    scatter = ratio.std(axis=0, ddof=1) / np.sqrt(len(ratio))
    error = np.degrees(np.hypot(scatter, zero.error[:2] / float(blocks[:, 2].mean())))
    lean = np.degrees(np.arctan(ratio.mean(axis=0)))
    start, stop = float(track.time[hold.start]), float(track.time[hold.stop - 1])
    # What was levelled before counts too: the lean is that against the transducer.
    return Press(
        trial,
        start,
        stop,
        (float(lean[0]) + settings.tilt[0], float(lean[1]) + settings.tilt[1]),
        (float(error[0]), float(error[1])),
    )


def _mean_error(presses: Sequence[Press]) -> Pair:
    x, y = np.array([press.lean for press in presses]).std(axis=0, ddof=1) / np.sqrt(len(presses))
    return float(x), float(y)


def tilt_of(presses: Sequence[Press], settings: AnalysisSettings) -> Tilt | None:
    """Return the tilt that presses tell, with intervals; None without any."""
    if not presses:
        return None
    from scipy.special import stdtrit  # slow to load, and neither window nor recorder has need of it

    leans = np.array([press.lean for press in presses])
    mean = leans.mean(axis=0)
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
