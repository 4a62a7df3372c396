"""Everything the analyst's window knows, message by message."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from daq_app.analyst import messages as m
from daq_app.analyst.frame import Finger
from daq_app.wording import tr, tr_noop
from sessions.prediction import SED
from sessions.report.contents import PredictionFinding, Report, StrokeFinding

Stage = Literal["opening", "analysed", "predicted"]
OPENING = m.Step(0.0, tr_noop("opening"))


@dataclass(frozen=True, slots=True)
class AnalystState:
    """Everything the window knows."""

    folder: Path
    stage: Stage = "opening"
    report: Report | None = None
    history: m.History = field(default_factory=m.History)
    version: int = 0  # of the report; pictures drawn of an earlier one are out of date
    fingers: Mapping[m.Key, Finger] = field(default_factory=dict[m.Key, Finger])
    drawn: Mapping[str, m.Drawn] = field(default_factory=dict[str, m.Drawn])  # of this version, by name
    film: m.Filmed | None = None  # the last that was asked for
    read: m.Read | None = None  # likewise
    compared: m.Compared | None = None
    step: m.Step | None = OPENING  # None: nothing is being done
    outcome: str = ""  # how the last work ended
    halted: bool = False  # somebody stopped the model's answers
    row: int = 0  # that is chosen
    response: str = SED.name  # the quantity at the ending that is held against the scores


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the list: a stroke, or a predicted trial without one."""

    trial: int | None
    stroke: StrokeFinding | None
    prediction: PredictionFinding | None

    @property
    def key(self) -> m.Key:
        """What the model's answers of it are found by."""
        return self.trial, None if self.stroke is None else self.stroke.number


def fold(state: AnalystState, message: m.Message) -> AnalystState:
    """Return the state after a message; what was known stays until it is known anew."""
    match message:
        case m.ReportReady():
            return _on_report(state, message)
        case m.Answered():
            return _answered(state, message)
        case m.Drawn():
            return replace(state, drawn={**state.drawn, message.name: message})
        case m.Filmed():
            return replace(state, film=message, outcome="")
        case m.Read():
            return replace(state, read=message)
        case m.Respond(response):
            return replace(state, response=response)
        case m.Compared():
            return replace(state, compared=message, outcome="")
        case m.Step() | m.Idle() | m.Done() | m.Problem() | m.Cancelled():
            return _gone_on(state, message)
        case _:
            return _on_request(state, message)


def _gone_on(state: AnalystState, said: m.Step | m.Idle | m.Done | m.Problem | m.Cancelled) -> AnalystState:
    match said:
        case m.Step():
            return replace(state, step=said)
        case m.Idle():
            return replace(state, step=None)
        case m.Done(sentence):
            return replace(state, outcome=sentence)
        case m.Problem(sentence):
            return replace(state, step=None, outcome=sentence)
        case m.Cancelled():
            kept = "" if state.report is None else tr(" What was done before is kept.")
            return replace(state, step=None, outcome=tr("Stopped.{kept}", kept=kept), halted=state.stage != "predicted")


def _on_request(state: AnalystState, request: m.Ask) -> AnalystState:
    match request:
        case m.Choose(row):
            row = max(0, min(row, len(rows(state)) - 1))
            return state if row == state.row else replace(state, row=row, outcome="")  # which was of the one before
        case m.Write(what, path):
            return replace(state, step=m.Step(0.0, tr("writing {what} to {path}", what=what, path=path)), outcome="")
        case m.GoOn():
            return replace(state, step=m.Step(0.0, tr("predicting")), outcome="", halted=False)
        case m.Stop():
            return replace(state, step=m.Step(0.0, tr("stopping")))
        case m.ShowReadings():
            return state
        case _:
            return replace(state, step=m.Step(0.0, tr("working")), outcome="")


def rows(state: AnalystState) -> tuple[Row, ...]:
    """Return the list: every stroke in order of time, then trials that have a prediction or a reason but no stroke."""
    report = state.report
    if report is None:
        return ()
    by_stroke = {p.stroke: p for p in report.predictions if p.stroke is not None}
    listed = [Row(s.trial, s, by_stroke.get(s.number)) for s in report.strokes]
    without = [Row(p.trial, None, p) for p in report.predictions if p.stroke is None]
    return (*listed, *without)


def chosen(state: AnalystState) -> Row | None:
    """Return the chosen line; None where there is none."""
    listed = rows(state)
    return listed[state.row] if state.row < len(listed) else None


def _on_report(state: AnalystState, message: m.ReportReady) -> AnalystState:
    """Take a report; answers to strokes that did not change since stay until they are given anew."""
    report, before = message.report, state.report
    fingers = state.fingers
    if message.stage == "analysed" and before is not None:
        same = {_measured(stroke) for stroke in report.strokes} & {_measured(stroke) for stroke in before.strokes}
        numbers = {number for number, _ in same}
        kept = tuple(p for p in before.predictions if p.stroke in numbers)
        report = replace(report, predictions=kept)
        fingers = {key: finger for key, finger in fingers.items() if key[1] in numbers}
    version, history = state.version + 1, message.history
    after = replace(
        state, stage=message.stage, report=report, history=history, version=version, fingers=fingers, drawn={}
    )
    return replace(after, row=max(0, min(state.row, len(rows(after)) - 1)))


def _measured(stroke: StrokeFinding) -> tuple[int, object]:
    """Return what the model is given of a stroke, and which it is."""
    friction = (stroke.mu_dynamic, stroke.mu_max, stroke.tau_max, stroke.speed, stroke.direction, stroke.normal_force)
    return stroke.number, (stroke.trial, friction)


def _answered(state: AnalystState, answered: m.Answered) -> AnalystState:
    report, finding = state.report, answered.finding
    if report is None:
        return state
    rest = tuple(p for p in report.predictions if (p.trial, p.stroke) != (finding.trial, finding.stroke))
    fingers = {key: finger for key, finger in state.fingers.items() if key != (finding.trial, finding.stroke)}
    if answered.finger is not None:
        fingers[finding.trial, finding.stroke] = answered.finger
    return replace(state, report=replace(report, predictions=(*rest, finding)), fingers=fingers)
