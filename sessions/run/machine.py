"""The state machine of a session, without side effects: state and event to next state and commands."""

from dataclasses import replace

from msgspec import structs

from sessions.plan.plan import SessionPlan
from sessions.run import steps
from sessions.run.states import (
    Closing,
    Ended,
    Idle,
    Mounting,
    OpenTake,
    Paused,
    Position,
    Progress,
    Ready,
    Resting,
    Scoring,
    Settling,
    State,
    Stroking,
    Taring,
)
from sessions.run.steps import AnswerEvent, answer_problem

Step = tuple[State, tuple[steps.Command, ...]]

UNDONE = "the redo was undone"


def start(plan: SessionPlan) -> Step:
    """Return the state before a session begins, and the first commands. Raises ValueError for a plan without trials."""
    if not plan.trials:
        raise ValueError(f"the plan of {plan.subject} has no trials, so there is nothing to run")
    return Idle(Position(plan, 0, (Progress(),) * len(plan.trials))), (steps.AskBegin(),)


def advance(state: State, event: steps.Event, *, keep_answered: bool = True) -> Step:
    """Return the next state and the commands that enter it; an event that does not fit the state is refused.

    An abort discards the open take; with `keep_answered` a take that only waits for its end is kept.
    """
    match state, event:
        case Ended(), _:
            return state, (_refusal(state, event),)
        case _, steps.Abort(reason):
            cause = reason.strip() or "no reason given"
            answered = keep_answered and isinstance(state, Settling)
            takes = (_keep_command(state.position),) if answered else _discard_commands(state, cause)
            return Ended(cause, complete=False), (*takes, steps.EndSession(cause, complete=False))
        case _, steps.Note(text):
            return state, () if text.strip() else (steps.Refuse("an empty note is not stored: write a text"),)
        case _, steps.Pause() | steps.Resume() | steps.RestOver():
            return _pause_or_resume(state, event)
        case _, steps.Redo(reason) | steps.Skip(reason) if not reason.strip():
            return state, (steps.Refuse(f"say why: {type(event).__name__.lower()} needs a reason"),)
        case _, steps.Redo() | steps.UndoRedo():
            return _redo_or_undo(state, event)
        case _, steps.Skip(reason):
            return _leave_out(state, reason)
        case _, steps.ContactOnset() | steps.FingerLifted() | steps.Settled():
            return _follow_contact(state, event)
        case Scoring(), steps.Scored() | steps.MagnitudeEstimate() | steps.PairedChoice():
            return _take_answer(state, event)
        case _:
            return _advance_course(state, event)


def resume_interrupted(state: State, reason: str, *, keep_answered: bool = True) -> Step:
    """Return the state in which an interrupted session continues, and the commands that enter it.

    It continues at the same trial. An open take is discarded for `reason`: nobody knows what followed its last reading.
    With `keep_answered` a take whose stroke and answer are done is kept, and the session continues at the next trial. A
    pause or a rest is over. The second of two compared trials begins again with the first.
    """
    match state:
        case Settling(position) if keep_answered:
            state, (keep, *_) = _keep_take(position)
            resumed, commands = resume_interrupted(state, reason)
            return resumed, (keep, *commands)
        case Idle():
            return state, (steps.AskBegin(),)
        case Closing():
            return state, (steps.AskFinish(),)
        case Ended():
            return state, ()
        case _:
            position, undone = _undo_pair(state.position, reason)
            discards = _discard_commands(state, reason)
            return Mounting(position), (*discards, *undone, *_asking_for(position, new_block=True))


def trial_in_hand(state: State) -> int | None:
    """Return the number of the trial a state belongs to; None before the first, after the last."""
    return None if isinstance(state, Idle | Closing | Ended) else state.position.trial.number


def _advance_course(state: State, event: steps.Event) -> Step:
    match state, event:
        case Idle(position), steps.Begin():
            return Mounting(position), _asking_for(position, new_block=True)
        case Mounting(position), steps.StimulusMounted(code) if code == position.trial.stimulus.code:
            return _begin_take(position)
        case Mounting(position), steps.StimulusMounted(code):
            due_code = position.trial.stimulus.code
            return state, (steps.Refuse(f"trial {position.trial.number} needs the stimulus {due_code}, not {code}"),)
        case Taring(position), steps.Zeroed():
            return Ready(position), (_ask_stroke(position),)
        case Ready(position), steps.StrokeDone() if not position.plan.forces:
            return _stroke_over(position.at(position.index))
        case Closing(), steps.Finish():
            reason = "every trial is done"
            return Ended(reason, complete=True), (steps.EndSession(reason, complete=True),)
        case _:
            return state, (_refusal(state, event),)


def _follow_contact(state: State, event: steps.ContactOnset | steps.FingerLifted | steps.Settled) -> Step:
    match state, event:
        case Ready(position), steps.ContactOnset() if position.plan.forces:
            return Stroking(position.at(position.index)), ()
        case Stroking(position), steps.FingerLifted():
            return _stroke_over(position)
        case Scoring(position, touching=False, strokes=strokes), steps.ContactOnset() if position.plan.forces:
            number, limit = strokes + 1, position.block.strokes_allowed
            sentence = f"stroke {number} where {limit} may be made: it is recorded and will be flagged"
            return Scoring(position, touching=True, strokes=number), (steps.Tell(sentence),) if number > limit else ()
        case Scoring(position, touching=True, strokes=strokes), steps.FingerLifted():
            return Scoring(position, strokes=strokes), ()
        case Scoring(position, touching=False, strokes=strokes, settled=False), steps.Settled() if position.plan.forces:
            return Scoring(position, strokes=strokes, settled=True), ()
        case Settling(position, touching=False), steps.ContactOnset():
            return Settling(position, touching=True), (
                steps.Tell("the finger touches again: the take runs on until it is off"),
            )
        case Settling(position, touching=True), steps.FingerLifted():
            return Settling(position), ()
        case Settling(position, touching=False), steps.Settled():
            return _keep_take(position)
        case _:
            return state, (_refusal(state, event),)


def _take_answer(state: Scoring, answer: AnswerEvent) -> Step:
    """Take an answer; the take ends once the finger has been off for a moment, so that what follows it is recorded."""
    position = state.position
    problem = answer_problem(answer, position.trial.answer)
    if problem is not None:
        return state, (steps.Refuse(problem),)
    if isinstance(answer, steps.PairedChoice):
        position = position.with_progress(replace(position.progress[position.index], choice=answer.choice))
    if state.settled or not position.plan.forces:
        return _keep_take(position)
    return Settling(position, touching=state.touching), ()


def _pause_or_resume(state: State, event: steps.Pause | steps.Resume | steps.RestOver) -> Step:
    """Pause the session, or continue it: the stimulus is confirmed and the zero measured again."""
    match state, event:
        case Scoring(position, strokes=strokes), steps.Pause():
            return Paused(position, scoring=True, strokes=strokes), ()
        case ((Mounting(position) | Taring(position) | Ready(position) | Stroking(position)), steps.Pause()):
            reason = "a pause came before the stroke was done"
            return Paused(position, scoring=False), _discard_commands(state, reason)
        case Paused(position, scoring=True, strokes=strokes), steps.Resume():
            return Scoring(position, strokes=strokes, settled=True), (_ask_answer(position),)
        case Paused(position), steps.Resume():
            first, undone = _undo_pair(position, "a pause parted the two stimuli")
            return Mounting(first), (*undone, steps.AskMount(first.trial))
        case Resting(position), steps.Resume() | steps.RestOver():
            return Mounting(position), _asking_for(position, new_block=position.trial == position.block.trials[0])
        case _:
            return state, (_refusal(state, event),)


def _redo_or_undo(state: State, event: steps.Redo | steps.UndoRedo) -> Step:
    """Repeat a trial, or undo the last redo; a redo that discards no whole stroke cannot be undone."""
    if isinstance(event, steps.UndoRedo):
        return _redo_undone(state)
    next_state, commands = _repeat(state, event.reason)
    between_takes = isinstance(state, Scoring | Settling | Mounting | Resting | Closing)
    if between_takes and next_state != state and isinstance(next_state, Mounting | Taring | Ready):
        next_state = structs.replace(next_state, position=replace(next_state.position, before_redo=state))
    return next_state, commands


def _repeat(state: State, reason: str) -> Step:
    """Repeat the trial in hand, or the previous one before it begins; the later order is unchanged."""
    match state:
        case Taring(position) | Ready(position) | Stroking(position) | Scoring(position) | Settling(position):
            if position.trial.compared_with is not None:
                first, undone = _undo_pair(position, reason)
                return Mounting(first), (*_discard_commands(state, reason), *undone, steps.AskMount(first.trial))
            taring, commands = _begin_take(position)
            return taring, (*_discard_commands(state, reason), *commands)
        case Mounting(position) if position.take > 0:
            return state, (steps.Refuse(f"trial {position.trial.number} is about to be repeated already"),)
        case Mounting(position) | Resting(position) if position.index > 0:
            return _return_to(position.at(position.index - 1), reason)
        case Closing(position):
            return _return_to(position, reason)
        case _:
            return state, (_refusal(state, steps.Redo(reason)),)


def _redo_undone(state: State) -> Step:
    """Return to the state before the last redo: its discarded takes are restored, skipped trials are skipped again."""
    match state:
        case Mounting(position) | Taring(position) | Ready(position) if position.before_redo is not None:
            previous = position.before_redo
        case _:
            return state, (
                steps.Refuse("there is no redo to undo: that of a whole stroke can be undone until the next one"),
            )
    assert not isinstance(previous, Ended)
    restored, trials, restores = previous.position, position.plan.trials, list[steps.Command]()
    in_hand = restored.index if isinstance(previous, Scoring | Settling) else None
    for index in range(position.index, restored.index + isinstance(previous, Scoring | Settling | Closing)):
        progress, take_count, number = restored.progress[index], position.progress[index].takes, trials[index].number
        if progress.kept or index == in_hand:
            restores.append(steps.RestoreTake(number, progress.take))
            restores += [steps.KeepTake(number, progress.take)] if progress.kept else []
        else:
            restores.append(steps.LeaveOut(number, UNDONE))
        restored = replace(restored.at(index).with_progress(replace(progress, takes=take_count)), index=restored.index)
    next_state, commands = _return_before_redo(structs.replace(previous, position=restored))
    return next_state, (*_discard_commands(state, UNDONE), *restores, *commands)


def _return_before_redo(previous: State) -> Step:
    """Return to the state from which the trial was redone; the finger has been off since."""
    match previous:
        case Scoring(position, strokes=strokes):
            return Scoring(position, strokes=strokes, settled=True), (_ask_answer(position),)
        case Settling(position):
            return _keep_take(position)
        case Resting(position):
            return previous, (steps.AskRest(position.plan.rests.duration),)
        case Mounting(position):
            return previous, (steps.AskMount(position.trial),)
        case _:
            return previous, (steps.AskFinish(),)


def _leave_out(state: State, reason: str) -> Step:
    """Leave the trial in hand out and go on to the next."""
    if not isinstance(state, Mounting | OpenTake):
        return state, (_refusal(state, steps.Skip(reason)),)
    position, discard_reason = state.position, f"skipped: {reason}"
    commands = _discard_commands(state, discard_reason)
    if position.first_of_two:
        position = position.at(position.index + 1)
        commands = (*commands, steps.LeaveOut(position.trial.number, discard_reason))
    next_state, next_commands = _next(position)
    return next_state, (*commands, *next_commands)


def _begin_take(position: Position) -> Step:
    """Open the next take of the trial in hand, whose stimulus is mounted."""
    position = position.with_take(position.progress[position.index].takes + 1)
    start_take = steps.StartTake(position.trial.number, position.take)
    if position.plan.forces:
        return Taring(position), (start_take, steps.MeasureZero())
    return Ready(position), (start_take, _ask_stroke(position))


def _stroke_over(position: Position) -> Step:
    """Ask for the answer; if none is due, the take ends once the finger has been off for a moment."""
    if position.trial.answer != "none":
        return Scoring(position), (_ask_answer(position),)
    return (Settling(position), ()) if position.plan.forces else _keep_take(position)


def _keep_take(position: Position) -> Step:
    next_state, commands = _next(position.with_progress(replace(position.progress[position.index], kept=True)))
    return next_state, (_keep_command(position), *commands)


def _keep_command(position: Position) -> steps.Command:
    return steps.KeepTake(position.trial.number, position.take)


def _return_to(position: Position, reason: str) -> Step:
    """Return to an earlier trial, whose kept take is discarded."""
    first, undone = _undo_pair(position, reason)
    return Mounting(first), (*_undo_commands(position, reason), *undone, steps.AskMount(first.trial))


def _undo_pair(position: Position, reason: str) -> tuple[Position, tuple[steps.Command, ...]]:
    """Return to the first of two compared trials and discard its take; any other position is marked as not kept."""
    if position.trial.compared_with is None:
        return position.with_take(position.take), ()
    first = position.with_take(position.take).at(position.index - 1)
    return first.with_take(first.take), _undo_commands(first, reason)


def _undo_commands(position: Position, reason: str) -> tuple[steps.Command, ...]:
    """Return the command that discards the kept take of the trial in hand, if there is one."""
    has_kept_take = position.progress[position.index].kept
    return (steps.DiscardTake(position.trial.number, position.take, reason),) if has_kept_take else ()


def _next(position: Position) -> Step:
    """Go on to the next trial, if there is one, or to the rest before it."""
    if position.is_last:
        return Closing(position.at(position.index)), (steps.AskFinish(),)
    successor = position.successor()
    if successor.rest_due:
        return Resting(successor), (steps.AskRest(successor.plan.rests.duration),)
    return Mounting(successor), _asking_for(successor, new_block=successor.block.name != position.block.name)


def _asking_for(position: Position, *, new_block: bool) -> tuple[steps.Command, ...]:
    instruction = (steps.ShowInstruction(position.block),) if new_block else ()
    return (*instruction, steps.AskMount(position.trial))


def _ask_stroke(position: Position) -> steps.AskStroke:
    return steps.AskStroke(position.trial, position.block.strokes_allowed)


def _ask_answer(position: Position) -> steps.Command:
    trial, block = position.trial, position.block
    if trial.answer == "number":
        return steps.AskNumber(trial, block.question)
    if trial.answer == "choice":
        return steps.AskChoice(position.at(position.index - 1).trial, trial, block.question)
    return steps.AskScore(trial, block.scale_ends, block.ticks, block.question)


def _discard_commands(state: State, reason: str) -> tuple[steps.Command, ...]:
    """Return the command that discards the open take, if there is one."""
    if isinstance(state, OpenTake) or (isinstance(state, Paused) and state.scoring):
        return (steps.DiscardTake(state.position.trial.number, state.position.take, reason),)
    return ()


def _refusal(state: State, event: steps.Event) -> steps.Refuse:
    situations: dict[type[State], str] = {
        Idle: "the session has not begun",
        Mounting: "a stimulus is to be mounted",
        Taring: "the zero is being measured",
        Ready: "the subject is to stroke",
        Stroking: "the finger is touching",
        Scoring: "the subject is to answer",
        Settling: "the take ends when the finger has been off for a moment",
        Resting: "the subject rests",
        Paused: "the session is paused",
        Closing: "every trial is done",
        Ended: "the session has ended",
    }
    return steps.Refuse(f"{steps.EVENT_NAMES[type(event)]} is not possible now: {situations[type(state)]}")
