"""The window's state of the current session, and its changes by each message."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, cast, get_args

from msgspec import Struct

from daq_app.recorder import messages as m
from daq_app.recorder.messages import Kind
from daq_app.wording import answer_text
from sessions.plan.plan import Block, SessionPlan, Trial
from sessions.recording import LoggedEvent
from sessions.recording.log import ANSWERS
from sessions.run import steps
from sessions.run.runner import SessionEnd, Status
from sessions.strokes import FrictionParameters
from sessions.strokes.stroke import Grade, Stroke

Phase = Literal[
    "idle", "resting", "mounting", "taring", "ready", "stroking", "scoring", "settling", "paused", "closing", "ended",
    "resuming",
]  # fmt: skip
REPORTED: frozenset[str] = frozenset(get_args(Phase)) - {"resuming"}  # phases that the recorder reports
IN_A_TRIAL = frozenset({"mounting", "taring", "ready", "stroking", "scoring", "settling"})
Outcome = Literal["coming", "done", "skipped"]
AFTER_LIFT = 1.0  # unloaded readings shown after a stroke, to show the return to zero [s]
PICTURE = {"N": (2, "N"), "T": (2, "N"), "mu": (2, ""), "speed": (0, "mm/s")}  # its rows, with digits and unit
_MARKS = 40  # marks kept for the plots: more than occur in a minute


class Remark(NamedTuple):
    """A flaw of a stroke."""

    grade: Grade
    text: str  # in few words
    sentence: str  # in full
    advice: str  # the remedy, one sentence; empty if another stroke does not help


@dataclass(frozen=True, slots=True)
class Quality:
    """The provisional quality of a stroke before it is scored. The analysis of the recording decides."""

    remarks: tuple[Remark, ...] = ()  # the worst first; none for a good stroke
    stroke: Stroke | None = None
    friction: FrictionParameters | None = None  # the model's input
    fell: float | None = None  # relative fall of N from the first to the last quarter of the steady window [-]

    @property
    def grade(self) -> Literal["good", "doubtful", "refused"]:
        """Return the grade of the worst remark; a note counts as doubtful."""
        if any(remark.grade == "refused" for remark in self.remarks):
            return "refused"
        return "doubtful" if self.remarks else "good"

    @property
    def texts(self) -> tuple[str, ...]:
        """Return the short texts of the remarks, each once."""
        return tuple(dict.fromkeys(remark.text for remark in self.remarks))

    @property
    def sentences(self) -> str:
        """Return the full sentences of the remarks."""
        return " ".join(remark.sentence for remark in self.remarks)


class Judged(Struct, frozen=True):
    """The quality of a stroke was judged."""

    trial: int
    take: int
    quality: Quality
    live: bool = True  # False: from before an interruption, with the times of an ended stream


@dataclass(frozen=True, slots=True)
class TrialState:
    """The progress of a trial."""

    trial: Trial
    outcome: Outcome = "coming"
    takes: int = 0
    answer: str | None = None  # in words; None: not asked yet
    quality: Quality | None = None
    discard_reason: str = ""  # why its previous take was discarded; empty: none was
    has_stimulus: bool = True  # False: later answers choose its stimulus
    earlier: tuple["TrialState", ...] = ()  # its state when each of its takes was discarded

    @property
    def code(self) -> str:
        """Return the label of its stimulus, or an ellipsis if that is not chosen yet."""
        return self.trial.stimulus.code if self.has_stimulus else "…"


@dataclass(frozen=True, slots=True)
class Mark:
    """An event in the readings, for the plots."""

    kind: Literal["onset", "lift", "steady"]
    start: float  # [s, device time]
    stop: float


def picture_end(marks: tuple[Mark, ...], newest: float) -> float:
    """Return the end of the time axis of a plot of the readings [s, device time].

    After a lift the plot stands still until the next onset.

    >>> picture_end((Mark("onset", 1.0, 1.0), Mark("lift", 3.0, 3.0)), 40.0)
    4.0
    >>> picture_end((Mark("lift", 3.0, 3.0), Mark("onset", 41.0, 41.0)), 42.0)
    42.0
    """
    last = max((mark for mark in marks if mark.kind != "steady"), key=lambda mark: mark.start, default=None)
    return newest if last is None or last.kind == "onset" else min(newest, last.start + AFTER_LIFT)


@dataclass(frozen=True, slots=True)
class SessionState:
    """The current session."""

    folder: str
    plan: SessionPlan
    people: Kind
    simulated: str | None
    trials: tuple[TrialState, ...]
    start: float  # when it first began, even if it was interrupted since [s]
    phase: Phase = "idle"
    since: float = 0.0  # when this phase began [s]
    before_pause: Phase = "idle"
    trial: int | None = None  # number of the current trial
    block: Block | None = None
    command: steps.Command | None = None  # the command that waits for an act
    notice: str | None = None  # the last message that needs no answer, or refuses one
    redone: tuple[int, ...] = ()  # numbers of the trials whose redo can still be undone
    judged_trial: int | None = None  # number of the trial whose stroke was judged last
    time_offset: float = 0.0  # from the times in the log to those of the displayed stream, after a resumption [s]
    marks: tuple[Mark, ...] = ()  # the latest, in the time of the session's stream; empty once it is over
    notes: tuple[str, ...] = ()
    status: Status | None = None
    saved_ns: int = 0  # time of the latest safe data [ns, session clock]
    saved_at: float | None = None  # when the window learned of it [s]
    end: SessionEnd | None = None
    resumable: bool = False
    fault: str | None = None  # why recording stopped without a written end
    sealing: Literal["no", "running", "cut short", "sealed"] = "no"

    @property
    def is_over(self) -> bool:
        """Say whether recording has stopped."""
        return self.end is not None or self.fault is not None

    def trial_state(self, number: int | None) -> TrialState | None:
        """Return the trial with that number, None if there is none."""
        return next((t for t in self.trials if t.trial.number == number), None)

    def with_trial(self, number: int | None, **changes: Any) -> "SessionState":  # noqa: ANN401  arguments of `replace`
        """Return the session with one trial changed."""
        trials = tuple(replace(t, **changes) if t.trial.number == number else t for t in self.trials)
        return replace(self, trials=trials)


def begin_session(message: m.SessionBegun, now: float) -> SessionState:
    """Return the state of a session that begins, or is resumed, at `now` [s]."""
    pairs = ((block, trial) for block in message.plan.blocks for trial in block.trials)
    trials = tuple(TrialState(trial, has_stimulus=trial.standard or not block.candidates) for block, trial in pairs)
    start = (message.events[0].time_ns - message.clock_offset_ns) * 1e-9 if message.events else now
    session = SessionState(message.folder, message.plan, message.people, message.simulated, trials, start, since=now)
    for event in message.events:
        session = _fold_event(session, event)
    return replace(session, marks=())  # they have the times of an ended stream


def session_after(session: SessionState, message: object, now: float) -> SessionState:
    """Return the session after a message received at `now` [s]; the same object if the message does not concern it."""
    changed = _fold_message(session, message, now)
    return changed if changed.phase == session.phase else replace(changed, since=now)


def _fold_message(session: SessionState, message: object, now: float) -> SessionState:
    match message:
        case LoggedEvent():
            return _fold_event(session, message)
        case Status():
            saved_at = now if message.safe.time_ns != session.saved_ns else session.saved_at
            phase = cast("Phase", message.state) if message.state in REPORTED else session.phase
            return replace(session, status=message, saved_ns=message.safe.time_ns, saved_at=saved_at, phase=phase)
        case Judged():
            return _judge(session, message)
        case m.Sealing():
            return replace(session, sealing="running")
        case m.Sealed():
            return replace(session, sealing="sealed")
        case _:
            return _fold_command(_fold_end(session, message), message)


def _fold_end(session: SessionState, message: object) -> SessionState:
    match message:
        case m.SessionEnded(folder, end, resumable):
            return replace(_ended_session(session), folder=folder, end=end, resumable=resumable)
        case m.Gone(requested, sentence) if not requested and not session.is_over:
            return replace(_ended_session(session), fault=sentence, resumable=True)
        case m.Gone(False) | m.Failed("ResumeSession") if session.phase == "resuming":
            return replace(session, phase="ended")
        case m.ResumeSession():
            return replace(session, phase="resuming", command=None)
        case m.Failed(kind=""):
            return session  # this request has to wait for the end of the session
        case m.Gone() | m.Failed("StartSession" | "ResumeSession") if session.sealing == "running":
            return replace(session, sealing="cut short")
        case m.Failed(request, sentence) if request in ("StartSession", "ResumeSession") and not session.is_over:
            return replace(_ended_session(session), fault=sentence)
        case _:
            return session


def _ended_session(session: SessionState) -> SessionState:
    """Return the session after recording has stopped, without marks, whose times belong to its stream."""
    return replace(session, phase="ended", command=None, marks=(), redone=())


def redo_targets(session: SessionState) -> tuple[TrialState, ...]:
    """Return the trials that a redo would discard now: one, a compared pair, or none."""
    if session.phase in IN_A_TRIAL - {"mounting"}:
        trial = session.trial_state(session.trial)
    elif session.phase == "closing":
        trial = session.trials[-1]
    else:  # before the first take of a trial, the previous trial
        current = session.trial_state(session.trial) if session.phase == "mounting" else None
        trial = session.trial_state(current.trial.number - 1) if current is not None and not current.takes else None
    if trial is None:
        return ()
    first = session.trial_state(trial.trial.compared_with)
    return (trial,) if first is None else (first, trial)


def _fold_command(session: SessionState, message: object) -> SessionState:
    """Return the session after a command, in the phase that waits for its answer."""
    match message:
        case steps.AskBegin():
            return replace(session, phase="idle", command=message)
        case steps.AskMount(trial):
            session = session.with_trial(trial.number, trial=trial, has_stimulus=True)
            return replace(session, phase="mounting", trial=trial.number, command=message, notice=None)
        case steps.MeasureZero():
            return replace(session, phase="taring", command=message, notice=None)
        case steps.AskStroke(trial):
            return replace(session, phase="ready", trial=trial.number, command=message, notice=None)
        case steps.AskScore(trial) | steps.AskNumber(trial) | steps.AskChoice(second=trial):
            return replace(session, phase="scoring", trial=trial.number, command=message)
        case steps.AskRest():
            return replace(session, phase="resting", trial=None, command=message, notice=None)
        case steps.AskFinish():
            return replace(session, phase="closing", trial=None, command=message, notice=None)
        case _:
            return _fold_notice(session, message)


def _fold_notice(session: SessionState, message: object) -> SessionState:
    match message:
        case steps.ShowInstruction(block):
            return replace(session, block=block)
        case steps.StartTake(trial, take):
            return session.with_trial(trial, takes=take, outcome="coming", quality=None)
        case steps.Tell(sentence) | steps.Refuse(sentence):
            return replace(session, notice=sentence)
        case steps.EndSession():
            return replace(session, phase="ended", command=None)
        case _:
            return session


def _fold_event(session: SessionState, event: LoggedEvent) -> SessionState:
    number, data = event.trial, event.data
    match event.kind:
        case "contact_onset":
            phase = "stroking" if session.phase == "ready" else session.phase
            return _add_mark(replace(session, phase=phase, redone=()), _instant(session, "onset", data))
        case "finger_lifted":
            return _add_mark(session, _instant(session, "lift", data))
        case "readings_joined":
            return replace(session, time_offset=data["time_offset"], marks=())
        case "pause":
            return replace(session, phase="paused", before_pause=session.phase)
        case "resume" if session.phase == "paused":
            return replace(session, phase=session.before_pause)
        case "note":
            return replace(session, notes=(*session.notes, str(data["text"])))
        case "redo" if session.phase not in ("taring", "ready"):
            trials = redo_targets(session) if session.phase != "stroking" else ()
            return replace(session, redone=tuple(state.trial.number for state in trials))
        case "undo_redo" | "stroke_done":
            return replace(session, redone=())
        case _:
            return _of_trial(session, number, event.kind, data)


def _of_trial(session: SessionState, number: int | None, kind: str, data: Mapping[str, Any]) -> SessionState:
    match kind:
        case "scored" | "number_given" | "chosen":
            outcome = "numbered" if kind == "number_given" else kind
            return session.with_trial(number, answer=answer_text(outcome, data[ANSWERS[kind]]))
        case "left_out":
            return session.with_trial(number, outcome="skipped")
        case "take_started":
            return session.with_trial(number, takes=data["take"], outcome="coming", has_stimulus=True)
        case "take_kept":
            return session.with_trial(number, outcome="done")
        case "take_discarded":
            return _discard(session, number, str(data["reason"]))
        case "take_restored":
            return _restore(session, number, data["take"])
        case "skip":
            return replace(session.with_trial(number, outcome="skipped"), redone=())
        case _:
            return session


def _discard(session: SessionState, number: int | None, reason: str) -> SessionState:
    state = session.trial_state(number)
    earlier = () if state is None else (*state.earlier, replace(state, earlier=()))
    outcome = "skipped" if reason.startswith("skipped: ") else "coming"
    return session.with_trial(number, outcome=outcome, answer=None, discard_reason=reason, earlier=earlier)


def _restore(session: SessionState, number: int | None, take: int) -> SessionState:
    """Return the session with a discarded take restored, with its answer and quality."""
    state = session.trial_state(number)
    discarded_states = () if state is None else state.earlier
    earlier = next((discarded for discarded in discarded_states if discarded.takes == take), None)
    if earlier is None:
        return session
    values = {name: getattr(earlier, name) for name in ("takes", "answer", "quality", "discard_reason")}
    return session.with_trial(number, outcome="coming", **values)


def _judge(session: SessionState, judgement: Judged) -> SessionState:
    """Return the session with the quality of a stroke; unchanged if that take has been repeated."""
    state, stroke = session.trial_state(judgement.trial), judgement.quality.stroke
    if state is None or state.takes != judgement.take:
        return session
    session = replace(session.with_trial(judgement.trial, quality=judgement.quality), judged_trial=judgement.trial)
    if stroke is None or stroke.steady is None or not judgement.live or session.is_over:
        return session
    return _add_mark(session, Mark("steady", *stroke.steady))


def _instant(session: SessionState, kind: Literal["onset", "lift"], data: Mapping[str, Any]) -> Mark:
    time = float(data["time"]) - session.time_offset
    return Mark(kind, time, time)


def _add_mark(session: SessionState, mark: Mark) -> SessionState:
    """Return the session with another mark; a new steady window replaces the earlier one that it overlaps."""
    marks = session.marks
    if mark.kind == "steady":
        marks = tuple(other for other in marks if other.kind != "steady" or other.stop < mark.start)
    return replace(session, marks=(*marks, mark)[-_MARKS:])
