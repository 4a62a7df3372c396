"""Requests of the analyst's window, replies of its work, and the state after each message."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import msgspec
from msgspec import Struct

from daq_app.analyst.frame import FieldChoice, Film, Frame, Range, automatic_range
from daq_app.analyst.stroke import Edge, History, RawReadings
from daq_app.wording import tr, tr_noop
from sessions.prediction import SED
from sessions.report.contents import AnswerFinding, PredictionFinding, Report, StrokeFinding

Key = tuple[int | None, int | None]  # trial, and number of the stroke, of a predicted row


# ---- replies of the work


class Step(Struct, frozen=True):
    """Progress of the work."""

    fraction: float  # of the whole, 0 to 1
    activity: str
    remaining_s: float | None = None  # estimated time left [s]; None: unknown
    load_steps: int = 0  # of which `fraction` are done; 0: not in load steps


class ReportReady(Struct, frozen=True):
    """The present report on the session: its strokes alone, or the model's answers too."""

    stage: Literal["analysed", "predicted"]
    report: Report
    history: History = History()


class TrialAnswer(Struct, frozen=True, eq=False):
    """The model's answer to one trial."""

    finding: PredictionFinding
    finger: Frame | None  # in full slip; None if there is no answer


class SessionPicture(Struct, frozen=True):
    """A picture of the session; `png` is empty if there are no data for it."""

    name: str
    title: str
    png: bytes


class FingerHistory(Struct, frozen=True, eq=False):
    """The history of one trial's finger."""

    key: Key
    film: Film
    reason: str = ""  # why it ends before full slip; "" if it reaches it


class Excerpt(Struct, frozen=True, eq=False):
    """The recorded readings around one stroke."""

    stroke: int  # its number
    readings: RawReadings


class OtherSession(Struct, frozen=True, eq=False):
    """Another session, with the same analysis and prediction."""

    report: Report
    fingers: Mapping[Key, Frame] = msgspec.field(default_factory=dict[Key, Frame])  # in full slip


class Done(Struct, frozen=True):
    """A file is complete, or a decision is recorded, undone or redone and the numbers are up to date."""

    sentence: str


class Problem(Struct, frozen=True):
    """A request failed; the earlier state stays."""

    sentence: str


class Cancelled(Struct, frozen=True):
    """Somebody stopped the work; its earlier results stay."""


class Idle(Struct, frozen=True):
    """All requests are done."""


# ---- requests of the window


class Choose(Struct, frozen=True):
    """Somebody chose a trial, or a stroke of a recording without trials."""

    row: int


class Move(Struct, frozen=True):
    """Somebody moved an edge of a stroke's windows."""

    stroke: int  # its number
    edge: Edge
    time: float  # [s, device time]
    author: str  # a code, never a name
    reason: str


class Undo(Struct, frozen=True):
    """Undo the last decision, or with `redo` the last undo."""

    author: str
    redo: bool = False


class Respond(Struct, frozen=True):
    """Compare another quantity at the ending with the scores."""

    response: str  # one of `solver.quantities`


class Draw(Struct, frozen=True):
    """Draw a picture of the session."""

    name: str


class ShowHistory(Struct, frozen=True):
    """Draw the load path of one trial's finger."""

    key: Key


class ShowReadings(Struct, frozen=True):
    """Send the readings around one stroke."""

    stroke: int  # its number


class Compare(Struct, frozen=True):
    """Compare another session with this one."""

    folder: str


class Write(Struct, frozen=True):
    """Write a file: "report", one of `sessions.exchange.FORMATS`, or "picture NAME" with a name of `pictures`."""

    document: str
    path: str


class GoOn(Struct, frozen=True):
    """Continue the stopped work."""


class Stop(Struct, frozen=True):
    """Stop the current work."""


Ask = Choose | Move | Undo | Draw | ShowHistory | ShowReadings | Compare | Write | GoOn | Stop
Reply = (
    Step | ReportReady | TrialAnswer | SessionPicture | FingerHistory | Excerpt | OtherSession
    | Done | Problem | Cancelled | Idle
)  # fmt: skip
Message = Ask | Reply | Respond

Stage = Literal["opening", "analysed", "predicted"]
OPENING = Step(0.0, tr_noop("opening"))


@dataclass(frozen=True, slots=True)
class AnalystState:
    """The state of the analyst's window."""

    folder: Path
    stage: Stage = "opening"
    report: Report | None = None
    history: History = field(default_factory=History)
    version: int = 0  # of the report; pictures of earlier versions are out of date
    fingers: Mapping[Key, Frame] = field(default_factory=dict[Key, Frame])  # in full slip
    pictures: Mapping[str, SessionPicture] = field(default_factory=dict[str, SessionPicture])  # of this version
    film: FingerHistory | None = None  # the last one requested
    excerpt: Excerpt | None = None  # the last one requested
    comparison: OtherSession | None = None
    step: Step | None = OPENING  # None: no work
    outcome: str = ""  # how the last work ended
    halted: bool = False  # somebody stopped the model's answers
    row: int = 0  # the selected one
    response: str = SED.name  # the quantity at the ending that is compared with the scores

    @property
    def visible_film(self) -> FingerHistory | None:
        """Return the last history if it belongs to the chosen trial, else None."""
        row = selected_row(self)
        return self.film if row is not None and self.film is not None and self.film.key == row.key else None

    def common_range(self, choice: FieldChoice) -> Range:
        """Return the common colour range of all trials of the session and of a compared session."""
        compared_fingers = () if self.comparison is None else self.comparison.fingers.values()
        return automatic_range(choice, (*self.fingers.values(), *compared_fingers))


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the list: a stroke, a predicted trial without one, or an answer without recorded forces."""

    trial: int | None
    stroke: StrokeFinding | None
    prediction: PredictionFinding | None
    answer: AnswerFinding | None = None  # of the subject to the trial

    @property
    def key(self) -> Key:
        """Return the key of the model's answers to it."""
        return self.trial, None if self.stroke is None else self.stroke.number


def fold(state: AnalystState, message: Message) -> AnalystState:
    """Return the state after a message; earlier data stay until they are replaced."""
    match message:
        case ReportReady():
            return _on_report(state, message)
        case TrialAnswer():
            return _fold_answer(state, message)
        case SessionPicture():
            return replace(state, pictures={**state.pictures, message.name: message})
        case FingerHistory():
            return replace(state, film=message, outcome="")
        case Excerpt():
            return replace(state, excerpt=message)
        case Respond(response):
            return replace(state, response=response)
        case OtherSession():
            return replace(state, comparison=message, outcome="")
        case Step() | Idle() | Done() | Problem() | Cancelled():
            return _fold_progress(state, message)
        case _:
            return _on_request(state, message)


def _fold_progress(state: AnalystState, message: Step | Idle | Done | Problem | Cancelled) -> AnalystState:
    match message:
        case Step():
            return replace(state, step=message)
        case Idle():
            return replace(state, step=None)
        case Done(sentence):
            return replace(state, outcome=sentence)
        case Problem(sentence):
            return replace(state, step=None, outcome=sentence)
        case Cancelled():
            remark = "" if state.report is None else tr(" Finished results are kept.")
            outcome = tr("Stopped.{kept}", kept=remark)
            return replace(state, step=None, outcome=outcome, halted=state.stage != "predicted")


def _on_request(state: AnalystState, request: Ask) -> AnalystState:
    match request:
        case Choose(row):
            row = max(0, min(row, len(rows(state)) - 1))
            return state if row == state.row else replace(state, row=row, outcome="")  # the outcome is of another row
        case Write(document, path):
            return replace(state, step=Step(0.0, tr("writing {what} to {path}", what=document, path=path)), outcome="")
        case GoOn():
            return replace(state, step=Step(0.0, tr("predicting")), outcome="", halted=False)
        case Stop():
            return replace(state, step=Step(0.0, tr("stopping")))
        case ShowReadings():
            return state
        case _:
            return replace(state, step=Step(0.0, tr("working")), outcome="")


def rows(state: AnalystState) -> tuple[Row, ...]:
    """Return the list: strokes in order of time, and each trial without a stroke before those of later trials.

    A session with scores only has its answers in place of strokes.
    """
    report = state.report
    if report is None:
        return ()
    by_stroke = {prediction.stroke: prediction for prediction in report.predictions if prediction.stroke is not None}
    answers = {answer.trial: answer for answer in report.answers}
    table = [
        Row(stroke.trial, stroke, by_stroke.get(stroke.number), answers.get(stroke.trial or 0))
        for stroke in report.strokes
    ]
    for prediction in report.predictions:
        if prediction.stroke is None:
            later = (index for index, row in enumerate(table) if (row.trial or 0) > (prediction.trial or 0))
            answer = answers.get(prediction.trial or 0)
            table.insert(next(later, len(table)), Row(prediction.trial, None, prediction, answer))
    return tuple(table or (Row(answer.trial, None, None, answer) for answer in report.answers))


def selected_row(state: AnalystState) -> Row | None:
    """Return the selected row, or None."""
    table = rows(state)
    return table[state.row] if state.row < len(table) else None


def _on_report(state: AnalystState, message: ReportReady) -> AnalystState:
    """Take a report; answers to unchanged strokes stay until they are replaced."""
    report, previous = message.report, state.report
    fingers = state.fingers
    if message.stage == "analysed" and previous is not None:
        unchanged = {*map(_model_input, report.strokes)} & {*map(_model_input, previous.strokes)}
        numbers = {number for number, _ in unchanged}
        predictions = tuple(prediction for prediction in previous.predictions if prediction.stroke in numbers)
        report = replace(report, predictions=predictions)
        fingers = {key: finger for key, finger in fingers.items() if key[1] in numbers}
    changes = {"stage": message.stage, "history": message.history, "version": state.version + 1, "pictures": {}}
    return _keep_row(state, replace(state, report=report, fingers=fingers, **changes))


def _keep_row(previous: AnalystState, state: AnalystState) -> AnalystState:
    """Return the new state with the previously selected row, at its new position."""
    row, keys = selected_row(previous), [row.key for row in rows(state)]
    if row is not None and row.key in keys:
        return replace(state, row=keys.index(row.key))
    return replace(state, row=max(0, min(previous.row, len(keys) - 1)))


def _model_input(stroke: StrokeFinding) -> tuple[int, object]:
    """Return the number of a stroke, and its trial and friction, which are the model's inputs."""
    friction = (stroke.mu_dynamic, stroke.mu_max, stroke.tau_max, stroke.speed, stroke.direction, stroke.normal_force)
    return stroke.number, (stroke.trial, friction)


def _fold_answer(state: AnalystState, answer: TrialAnswer) -> AnalystState:
    report, finding = state.report, answer.finding
    if report is None:
        return state
    key = finding.trial, finding.stroke
    predictions = [other for other in report.predictions if (other.trial, other.stroke) != key]
    fingers = {present: finger for present, finger in state.fingers.items() if present != key}
    if answer.finger is not None:
        fingers[key] = answer.finger
    report = replace(report, predictions=(*predictions, finding))
    return _keep_row(state, replace(state, report=report, fingers=fingers))
