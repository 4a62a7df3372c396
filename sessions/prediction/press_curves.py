"""Presses of a recording as force over displacement, for fits of a finger's stiffness."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.arrays import Array
from sessions.prediction.finger_fit import LoadingCurve
from sessions.prediction.relaxation_fit import HoldCurve
from sessions.recording import Recording
from sessions.strokes import AnalysisSettings, StrokeCurve
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.trial_analysis import TrialContext

LONGEST_GAP = 0.1  # of the log within a press [s]: a finger then moves less than one point's share
STANDS = 0.01  # distance from the greatest travel, relative to it, within which a stage is at rest [-]
SHORTEST_HOLD = 0.5  # least time at rest: the shortest press of the analysis [s]
LEAST_TRAVEL = 0.1  # least travel of a press; with less, the log is not of the bone [mm]


@dataclass(frozen=True, slots=True, eq=False)
class DisplacementLog:
    """Positions of the bone or the stage; n rows in order of time."""

    clock: str  # the clock of `instants`: "time_s" [s], "received_ns" [ns] or "sequence" of the readings
    instants: Array  # (n,) increasing
    displacement: Array  # (n,) positive into the finger, from any origin [mm]
    width: Array  # (n,) of the contact along the finger [mm]; nan where not measured


@dataclass(frozen=True, slots=True)
class PressCurves:
    """The presses covered by a log, and reasons for omitting others."""

    presses: tuple[LoadingCurve, ...]
    names: tuple[str, ...]  # of each press, for people
    holds: tuple[HoldCurve | None, ...]  # each press to the end of its hold; None where the stage is not at rest
    left_out: tuple[str, ...]  # a sentence each


def press_curves(recording: Recording, log: DisplacementLog, settings: AnalysisSettings) -> PressCurves:
    """Return the loading part of each press without a slide, in trials of every phase."""
    if recording.info is None:
        return PressCurves((), (), (), ("No forces were recorded.",))
    records = [record for record in recording.trials if record.take]
    trials = (
        [(record.trial, recording.readings(record.trial.number)) for record in records]
        if recording.plan.blocks
        else [(None, recording.readings())]
    )
    context = TrialContext(recording.plan, recording.info, settings)
    presses: list[tuple[LoadingCurve, str, HoldCurve | None]] = []
    left_out: list[str] = []
    for trial, block in trials:
        analysis = analyse_blocks([(trial, block)], context)
        clocks: Mapping[str, Array] = {
            "time_s": block.time,
            "received_ns": block.received_ns.astype(np.float64),
            "sequence": block.sequence.astype(np.float64),
        }
        for stroke in analysis.strokes:
            begin, stop = stroke.onset, np.inf if stroke.lift is None else stroke.lift
            if begin is None or not any(begin <= press.start <= stop for press in analysis.presses):
                continue
            assert stroke.curve is not None
            name = f"the press at {begin:.2f} s" + (f" of trial {trial.number}" if trial else "")
            times = np.interp(log.instants, clocks[log.clock], block.time, left=-np.inf, right=np.inf)
            rows = np.isfinite(times)
            times, displacement = times[rows], log.displacement[rows]
            loading = _loading(stroke.curve, begin, times, displacement, log.width[rows])
            if isinstance(loading, str):
                left_out.append(f"{name[0].upper()}{name[1:]} is left out: {loading}.")
            else:
                presses.append((loading, name, _hold(stroke.curve, begin, times, displacement)))
    curves, names, holds = zip(*presses, strict=True) if presses else ((), (), ())
    return PressCurves(curves, names, holds, tuple(left_out))


def _loading(curve: StrokeCurve, onset: float, times: Array, displacement: Array, width: Array) -> LoadingCurve | str:
    """Return the loading of a press from a log with rows at `times` (n,) [s], or the reason for its absence."""
    peak_time = float(curve.time[int(np.nanargmax(curve.normal))])
    inside = np.flatnonzero((times >= onset) & (times <= peak_time))
    if not len(times) or times[0] > onset or times[-1] < peak_time:
        return "the log does not follow it from its onset to its greatest force"
    log_times = times[max(inside[0] - 1, 0) : inside[-1] + 2] if len(inside) else times[:0]
    if not len(inside) or float(np.diff(log_times).max(initial=0.0)) > LONGEST_GAP:
        return f"the log has a gap of more than {LONGEST_GAP:g} s in it"
    loading = (curve.time >= onset) & (curve.time <= peak_time) & np.isfinite(curve.normal)
    travel = np.interp(curve.time[loading], times, displacement)
    force = curve.normal[loading]
    # Relaxation while the stage is at rest is no loading: the loading ends on arrival.
    count = int(np.argmax(travel >= travel.max() - 1e-3 * np.ptp(travel))) + 1
    travel, force = travel[:count], force[:count]
    if travel[-1] - travel[0] < LEAST_TRAVEL:
        return (
            f"the log moves by {travel[-1] - travel[0]:.2g} mm while the force grows, and less than {LEAST_TRAVEL:g} "
            "mm is no press: displacement must be positive into the finger, on the session's clock"
        )
    lengths = np.interp(curve.time[loading][:count], times, width)  # nan next to every row without one
    return LoadingCurve.of(travel, force, lengths)


def _hold(curve: StrokeCurve, onset: float, times: Array, displacement: Array) -> HoldCurve | None:
    """Return the readings of a press to the end of its hold; None where the stage is at rest too briefly."""
    inside = (curve.time >= onset) & (curve.time <= times[-1]) & np.isfinite(curve.normal)
    time, force = curve.time[inside], curve.normal[inside]
    travel = np.interp(time, times, displacement)
    plateau = np.flatnonzero(travel >= travel.max() - STANDS * np.ptp(travel))
    if time[plateau[-1]] - time[plateau[0]] < SHORTEST_HOLD:
        return None
    upto = slice(0, int(plateau[-1]) + 1)
    return HoldCurve(time[upto], travel[upto], force[upto])
