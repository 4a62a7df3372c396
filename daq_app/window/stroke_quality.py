"""Quality of the last stroke while its stimulus is still mounted: the analysis of a take, in a separate process."""

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path

import numpy as np

from daq_app.child_process import give_way, process_pool
from daq_app.recorder import messages as m
from daq_app.window.course_state import Judged, Quality, Remark
from daq_app.window.live_feed import LiveFeed
from daq_app.window.state import AppState, DrawingFailed
from daq_app.wording import tr, tr_noop
from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan, Trial
from sessions.recording import LoggedEvent, Recording
from sessions.run import steps
from sessions.strokes import AnalysisSettings, FlawName
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.stroke import Stroke
from sessions.strokes.trial_analysis import TrialContext

KEEP_OFF = tr_noop("Keep the finger off until the stroke.")
AFTER = 0.35  # unloaded readings after a lift that belong to a stroke [s]
FELL = 0.5  # relative fall of the normal force over the steady window above which it is reported [-]

# Short texts of flaws that an experimenter can correct, and the correction as an imperative.
# Other flaws show their own sentence. Where there is no correction, the advice is another stroke.
_FLAWS: Mapping[FlawName, tuple[str, str]] = {
    FlawName.NO_STROKE: tr_noop(("no stroke was found", "Stroke once, firmly, and lift.")),
    FlawName.NO_STEADY_SLIDING: tr_noop(("no steady window", "Slide further, at one speed.")),
    FlawName.ROLLED: tr_noop(("too short a way: the finger may only roll", "Slide further, not roll.")),
    FlawName.SECOND_STROKE: tr_noop(("second stroke", "Stroke once, then lift.")),
    FlawName.WRONG_DIRECTION: tr_noop(("wrong direction", "Stroke the way the arrow points.")),
    FlawName.TOO_LITTLE_FORCE: tr_noop(("pressed too lightly", "Press harder.")),
    FlawName.NO_UNLOADED_STRETCH: (tr_noop("no unloaded stretch before the stroke"), KEEP_OFF),
    FlawName.BEGINS_IN_CONTACT: (tr_noop("the finger touched before the stroke"), KEEP_OFF),
    FlawName.ENDS_IN_CONTACT: tr_noop(("the finger had not left", "Lift the finger at the end.")),
    FlawName.NOT_LIFTED: tr_noop(("the finger was not lifted between strokes", "Lift the finger between strokes.")),
    FlawName.DIRECTION_TURNS: tr_noop(("the direction turned", "Stroke straight, one way.")),
    FlawName.SATURATED: tr_noop(("the transducer was overloaded", "Press less, and check the transducer.")),
    FlawName.DEVICE_FAULT: tr_noop(("the transducer reported a fault", "Check the transducer first.")),
    FlawName.LOST_READINGS: (tr_noop("readings were lost"), ""),
    FlawName.DRIFT: tr_noop(("the zero drifted", "Zero again, hands off.")),
    FlawName.FROZEN: tr_noop(("the readings froze", "Connect the transducer again first.")),
    FlawName.DEAD: tr_noop(("the transducer is dead", "Connect the transducer again first.")),
}
LEAVING = tr_noop("pressed less than half as hard at the end")
PRESS_ON = tr_noop("Keep pressing until the end.")


def stroke_quality(block: ReadingBlock, plan: SessionPlan, info: TransducerInfo, trial: Trial) -> Quality:
    """Return the quality of the stroke in the readings of one take, by the same analysis as for a recording."""
    analysis = analyse_blocks([(trial, block)], TrialContext(plan, info, AnalysisSettings()))
    stroke = analysis.strokes[0] if analysis.strokes else None
    flaws = sorted(analysis.flaws, key=lambda flaw: ("refused", "doubtful", "note").index(flaw.grade))
    notable = [flaw for flaw in flaws if flaw.grade != "note" or flaw.name in _FLAWS]
    short = {flaw.name: _FLAWS.get(flaw.name, (flaw.name.value.replace("_", " "), "")) for flaw in notable}
    remarks = [Remark(flaw.grade, short[flaw.name][0], flaw.sentence, short[flaw.name][1]) for flaw in notable]
    if stroke is None:
        worst, *milder = remarks or [Remark("refused", _FLAWS[FlawName.NO_STROKE][0], "", "")]
        advice = worst.advice or _FLAWS[FlawName.NO_STROKE][1]
        return Quality((worst._replace(grade="refused", advice=advice), *milder))
    fell = _fell(stroke)
    if fell is not None and fell >= FELL:
        share = 100 * (1 - fell)
        at_length = tr("The normal force fell to {share:.0f} % before the end: the finger was leaving.", share=share)
        refusals = sum(remark.grade == "refused" for remark in remarks)
        remarks.insert(refusals, Remark("doubtful", LEAVING, at_length, PRESS_ON))
    return Quality(tuple(remarks), stroke, analysis.friction[0], fell)


def live_quality(block: ReadingBlock, plan: SessionPlan, info: TransducerInfo, trial: Trial, take: int) -> Judged:
    """Return the quality of the current stroke."""
    return Judged(trial.number, take, stroke_quality(block, plan, info, trial))


def recorded_quality(folder: str, number: int) -> Judged | None:
    """Return the quality of a trial's stroke from before an interruption; None if none of its takes counts."""
    recording = Recording.open(Path(folder))
    record = recording.trial(number)
    if recording.info is None or record.take is None:
        return None
    quality = stroke_quality(recording.readings(number), recording.plan, recording.info, record.trial)
    return Judged(number, record.take.number, quality, live=False)


def in_newtons(info: TransducerInfo) -> TransducerInfo:
    """Return the info of a transducer whose raw numbers are wrenches, for readings already in newtons."""
    calibration = info.calibration
    as_wrench = Calibration(calibration.serial, "N, N mm", np.eye(6), calibration.rated, calibration.source)
    return replace(info, calibration=as_wrench)


def _fell(stroke: Stroke) -> float | None:
    """Return the relative fall of N from the first to the last quarter of the steady window; None without one."""
    if stroke.steady is None or stroke.curve is None:
        return None
    time, normal = stroke.curve.time, stroke.curve.normal
    normal = normal[(time >= stroke.steady[0]) & (time <= stroke.steady[1]) & np.isfinite(normal)]
    if not len(normal):
        return None
    quarter = max(len(normal) // 4, 1)
    return float(1.0 - np.median(normal[-quarter:]) / np.median(normal[:quarter]))


class Judge:
    """Follows the takes, and reports the quality of each stroke."""

    def __init__(self, send: Callable[[Judged | DrawingFailed], None]) -> None:
        """Report through `send`, from another thread."""
        self._send = send
        self._worker: ProcessPoolExecutor | None = None
        self._take: tuple[int, int] | None = None  # current trial and take
        self._offset = 0.0  # from the times in the log to those of the stream [s]
        self._due: float | None = None  # when the take is to be judged [s, device time]

    def prepare(self) -> ProcessPoolExecutor:
        """Start the process before the first stroke needs it, and return it."""
        if self._worker is None:
            self._worker = process_pool(1)
            self._worker.submit(_stand_by)
        return self._worker

    def close(self) -> None:
        """End the process and wait for it: an interpreter that exits earlier may write to a closed pipe."""
        if self._worker is not None:
            self._worker.shutdown(cancel_futures=True)

    def follow(self, report: m.Report, feed: LiveFeed) -> None:
        """Follow the session: a take begins, the finger lifts."""
        match report:
            case steps.StartTake(trial, take):
                self._take, self._due = (trial, take), None
                feed.take_begins()
            case LoggedEvent(kind="finger_lifted", data=data):
                self._due = float(data["time"]) - self._offset + AFTER
            case LoggedEvent(kind="readings_joined", data=data):
                self._offset = float(data["time_offset"])
            case m.SessionBegun(folder=folder, events=events):
                self._offset, self._due = 0.0, None
                for number in dict.fromkeys(event.trial for event in events if event.kind == "take_kept"):
                    self._submit(recorded_quality, folder, number)
            case LoggedEvent(kind="contact_onset"):
                self._due = None

    def look(self, feed: LiveFeed, state: AppState) -> None:
        """Have the take judged once enough readings have arrived after the lift."""
        newest, session, info = feed.trace.newest, state.session, state.bench.info
        if self._due is None or newest is None or newest < self._due:
            return
        self._due = None
        if session is None or info is None or self._take is None:
            return
        number, take = self._take
        trial = session.trial_state(number)
        block = feed.take()
        if trial is None or not len(block):
            return
        self._submit(live_quality, block, session.plan, in_newtons(info), trial.trial, take)

    def _submit(self, work: Callable[..., Judged | None], *arguments: object) -> None:
        """Run work in the process, and report its result."""
        try:
            future = self.prepare().submit(work, *arguments)
        except BrokenProcessPool:  # it ended while idle
            self._worker = None
            future = self.prepare().submit(work, *arguments)
        future.add_done_callback(self._report_quality)

    def _report_quality(self, answer: "Future[Judged | None]") -> None:
        if answer.cancelled():
            return
        if error := answer.exception():
            self._worker = None  # the next stroke starts another
            name = type(error).__name__
            self._send(DrawingFailed(tr("a stroke was not examined: {name} {error}", name=name, error=error)))
        elif (judgement := answer.result()) is not None:
            self._send(judgement)


def _stand_by() -> None:
    """Lower the process's priority; unpickling this function has loaded the analysis."""
    give_way()
