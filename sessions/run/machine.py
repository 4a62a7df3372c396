"""The course of a session as a table of cases: state and event to state and commands. It does nothing itself."""

from dataclasses import replace

from msgspec import structs

from sessions.plan.plan import SessionPlan
from sessions.run import steps
from sessions.run.states import (
    Closing,
    Ended,
    Idle,
    Mounting,
    Paused,
    Place,
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
    return Idle(Place(plan, 0, (Progress(),) * len(plan.trials))), (steps.AskBegin(),)


def advance(state: State, event: steps.Event) -> Step:
    """Return the next state and the commands that enter it; an event that is not meant now is refused."""
    match state, event:
        case Ended(), _:
            return state, (_refusal(state, event),)
        case _, steps.Abort(reason):
            why = reason.strip() or "no reason given"
            return Ended(why, complete=False), (*_discard_commands(state, why), steps.EndSession(why, complete=False))
        case _, steps.Note(text):
            return state, () if text.strip() else (
                steps.Refuse("an empty note says nothing: write what is to be kept"),
            )
        case _, steps.Pause() | steps.Resume() | steps.RestOver():
            return _rest(state, event)
        case _, steps.Redo(reason) | steps.Skip(reason) if not reason.strip():
            return state, (steps.Refuse(f"say why: {type(event).__name__.lower()} needs a reason"),)
        case _, steps.Redo() | steps.UndoRedo():
            return _again(state, event)
        case _, steps.Skip(reason):
            return _leave_out(state, reason)
        case _, steps.ContactOnset() | steps.FingerLifted() | steps.Settled():
            return _follow_contact(state, event)
        case Scoring(), steps.Scored() | steps.MagnitudeEstimate() | steps.PairedChoice():
            return _take_answer(state, event)
        case _:
            return _went_on(state, event)


def resume_interrupted(state: State, reason: str) -> Step:
    """Return the state in which a session that was cut short goes on, and the commands that enter it.

    It goes on at the same trial. A take that was open is discarded for `reason`: nobody knows what came after its last
    reading. A pause or a rest is over. The second of two that are compared begins with the first again.
    """
    match state:
        case Idle():
            return state, (steps.AskBegin(),)
        case Closing():
            return state, (steps.AskFinish(),)
        case Ended():
            return state, ()
        case _:
            place, undone = _undo_pair(state.place, reason)
            return Mounting(place), (*_discard_commands(state, reason), *undone, *_asking_for(place, new_block=True))


def trial_in_hand(state: State) -> int | None:
    """Return the number of the trial a state belongs to; None before the first, after the last."""
    return None if isinstance(state, Idle | Closing | Ended) else state.place.trial.number


def _went_on(state: State, event: steps.Event) -> Step:
    match state, event:
        case Idle(place), steps.Begin():
            return Mounting(place), _asking_for(place, new_block=True)
        case Mounting(place), steps.StimulusMounted(code) if code == place.trial.stimulus.code:
            return _begin_take(place)
        case Mounting(place), steps.StimulusMounted(code):
            due_code = place.trial.stimulus.code
            return state, (steps.Refuse(f"trial {place.trial.number} needs the stimulus {due_code}, not {code}"),)
        case Taring(place), steps.Zeroed():
            return Ready(place), (_ask_stroke(place),)
        case Ready(place), steps.StrokeDone() if not place.plan.forces:
            return _stroke_over(place.at(place.index))
        case Closing(), steps.Finish():
            reason = "every trial is done"
            return Ended(reason, complete=True), (steps.EndSession(reason, complete=True),)
        case _:
            return state, (_refusal(state, event),)


def _follow_contact(state: State, event: steps.ContactOnset | steps.FingerLifted | steps.Settled) -> Step:
    match state, event:
        case Ready(place), steps.ContactOnset() if place.plan.forces:
            return Stroking(place.at(place.index)), ()
        case Stroking(place), steps.FingerLifted():
            return _stroke_over(place)
        case Scoring(place, touching=False, strokes=strokes), steps.ContactOnset() if place.plan.forces:
            return Scoring(place, touching=True, strokes=strokes + 1), _further_stroke(place, strokes + 1)
        case Scoring(place, touching=True, strokes=strokes), steps.FingerLifted():
            return Scoring(place, strokes=strokes), ()
        case Scoring(place, touching=False, strokes=strokes, settled=False), steps.Settled() if place.plan.forces:
            return Scoring(place, strokes=strokes, settled=True), ()
        case Settling(place, touching=False), steps.ContactOnset():
            return Settling(place, touching=True), (
                steps.Tell("the finger touches again: the take runs on until it is off"),
            )
        case Settling(place, touching=True), steps.FingerLifted():
            return Settling(place), ()
        case Settling(place, touching=False), steps.Settled():
            return _keep_take(place)
        case _:
            return state, (_refusal(state, event),)


def _take_answer(state: Scoring, answer: AnswerEvent) -> Step:
    """Take an answer; the take ends once the finger has been off for a moment, so that what follows it is recorded."""
    place = state.place
    wrong = answer_problem(answer, place.trial.answer)
    if wrong is not None:
        return state, (steps.Refuse(wrong),)
    if isinstance(answer, steps.PairedChoice):
        place = place.with_progress(replace(place.progress[place.index], choice=answer.choice))
    if state.settled or not place.plan.forces:
        return _keep_take(place)
    return Settling(place, touching=state.touching), ()


def _rest(state: State, event: steps.Pause | steps.Resume | steps.RestOver) -> Step:
    """Stop asking, and go on where it is safe: the stimulus is confirmed and the zero measured anew."""
    match state, event:
        case Scoring(place, strokes=strokes), steps.Pause():
            return Paused(place, scoring=True, strokes=strokes), ()
        case ((Mounting(place) | Taring(place) | Ready(place) | Stroking(place)), steps.Pause()):
            why = "a pause came before the stroke was done"
            return Paused(place, scoring=False), _discard_commands(state, why)
        case Paused(place, scoring=True, strokes=strokes), steps.Resume():
            return Scoring(place, strokes=strokes, settled=True), (_ask_answer(place),)
        case Paused(place), steps.Resume():
            before, undone = _undo_pair(place, "a pause parted the two stimuli")
            return Mounting(before), (*undone, steps.AskMount(before.trial))
        case Resting(place), steps.Resume() | steps.RestOver():
            return Mounting(place), _asking_for(place, new_block=place.trial == place.block.trials[0])
        case _:
            return state, (_refusal(state, event),)


def _again(state: State, event: steps.Redo | steps.UndoRedo) -> Step:
    """Repeat a trial, or undo that; a redo that discards no whole stroke cannot be undone."""
    if isinstance(event, steps.UndoRedo):
        return _redo_undone(state)
    after, commands = _repeat(state, event.reason)
    between_takes = isinstance(state, Scoring | Settling | Mounting | Resting | Closing)
    if between_takes and after != state and isinstance(after, Mounting | Taring | Ready):
        after = structs.replace(after, place=replace(after.place, before_redo=state))
    return after, commands


def _repeat(state: State, reason: str) -> Step:
    """Repeat the trial in hand, or the one before where none is in hand yet; the order after it stays as it was."""
    match state:
        case Taring(place) | Ready(place) | Stroking(place) | Scoring(place) | Settling(place):
            if place.trial.compared_with is not None:
                before, undone = _undo_pair(place, reason)
                return Mounting(before), (*_discard_commands(state, reason), *undone, steps.AskMount(before.trial))
            after, commands = _begin_take(place)
            return after, (*_discard_commands(state, reason), *commands)
        case Mounting(place) if place.take > 0:
            return state, (steps.Refuse(f"trial {place.trial.number} is about to be repeated already"),)
        case Mounting(place) | Resting(place) if place.index > 0:
            return _return_to(place.at(place.index - 1), reason)
        case Closing(place):
            return _return_to(place, reason)
        case _:
            return state, (_refusal(state, steps.Redo(reason)),)


def _redo_undone(state: State) -> Step:
    """Return to where the last redo came from: what it discarded is restored, what was left out is left out again."""
    match state:
        case Mounting(place) | Taring(place) | Ready(place) if place.before_redo is not None:
            before = place.before_redo
        case _:
            return state, (steps.Refuse("there is no redo to undo: it can be undone until the next stroke"),)
    assert not isinstance(before, Ended)
    then, trials, restores = before.place, place.plan.trials, list[steps.Command]()
    in_hand = then.index if isinstance(before, Scoring | Settling) else None
    for index in range(place.index, then.index + isinstance(before, Scoring | Settling | Closing)):
        was, takes, number = then.progress[index], place.progress[index].takes, trials[index].number
        if was.kept or index == in_hand:
            restores += (steps.RestoreTake(number, was.take), *([steps.KeepTake(number, was.take)] if was.kept else ()))
        else:
            restores.append(steps.LeaveOut(number, UNDONE))
        then = replace(then.at(index).with_progress(replace(was, takes=takes)), index=then.index)
    after, commands = _go_back(structs.replace(before, place=then))
    return after, (*_discard_commands(state, UNDONE), *restores, *commands)


def _go_back(before: State) -> Step:
    """Return to the state from which the trial was redone; the finger has been off since."""
    match before:
        case Scoring(place, strokes=strokes):
            return Scoring(place, strokes=strokes, settled=True), (_ask_answer(place),)
        case Settling(place):
            return _keep_take(place)
        case Resting(place):
            return before, (steps.AskRest(place.plan.rests.duration),)
        case Mounting(place):
            return before, (steps.AskMount(place.trial),)
        case _:
            return before, (steps.AskFinish(),)


def _leave_out(state: State, reason: str) -> Step:
    """Leave the trial in hand out and go on to the next."""
    match state:
        case Mounting(place) | Taring(place) | Ready(place) | Stroking(place) | Scoring(place) | Settling(place):
            why = f"skipped: {reason}"
            more: tuple[steps.Command, ...] = ()
            discards = _discard_commands(state, why)
            if place.first_of_two:
                place = place.at(place.index + 1)
                more = (steps.LeaveOut(place.trial.number, why),)
            after, commands = _next(place)
            return after, (*discards, *more, *commands)
        case _:
            return state, (_refusal(state, steps.Skip(reason)),)


def _begin_take(place: Place) -> Step:
    """Open the next take of the trial in hand, its stimulus being on."""
    place = place.with_take(place.progress[place.index].takes + 1)
    start_take = steps.StartTake(place.trial.number, place.take)
    if place.plan.forces:
        return Taring(place), (start_take, steps.MeasureZero())
    return Ready(place), (start_take, _ask_stroke(place))


def _stroke_over(place: Place) -> Step:
    """Ask for the answer; where none is due the take ends, once the finger has been off for a moment."""
    if place.trial.answer != "none":
        return Scoring(place), (_ask_answer(place),)
    return (Settling(place), ()) if place.plan.forces else _keep_take(place)


def _further_stroke(place: Place, strokes: int) -> tuple[steps.Command, ...]:
    limit = place.block.strokes_allowed
    if strokes <= limit:
        return ()
    return (steps.Tell(f"stroke {strokes} where {limit} may be made: it is recorded and will be flagged"),)


def _keep_take(place: Place) -> Step:
    keep = steps.KeepTake(place.trial.number, place.take)
    after, commands = _next(place.with_progress(replace(place.progress[place.index], kept=True)))
    return after, (keep, *commands)


def _return_to(place: Place, reason: str) -> Step:
    """Return to an earlier trial, whose kept take is discarded."""
    before, undone = _undo_pair(place, reason)
    return Mounting(before), (*_undo_commands(place, reason), *undone, steps.AskMount(before.trial))


def _undo_pair(place: Place, reason: str) -> tuple[Place, tuple[steps.Command, ...]]:
    """Return to the first of two that are compared, its take discarded; any other place stays as it is, not kept."""
    if place.trial.compared_with is None:
        return _without_kept_take(place), ()
    first = _without_kept_take(place).at(place.index - 1)
    return _without_kept_take(first), _undo_commands(first, reason)


def _undo_commands(place: Place, reason: str) -> tuple[steps.Command, ...]:
    """Return the command that discards the take that was kept of the trial in hand, where one was."""
    return (steps.DiscardTake(place.trial.number, place.take, reason),) if place.progress[place.index].kept else ()


def _without_kept_take(place: Place) -> Place:
    return place.with_take(place.take)


def _next(place: Place) -> Step:
    """Go on to the next trial, if there is one, or to the rest before it."""
    if place.last:
        return Closing(place.at(place.index)), (steps.AskFinish(),)
    after = place.successor()
    if after.rest_due:
        return Resting(after), (steps.AskRest(after.plan.rests.duration),)
    return Mounting(after), _asking_for(after, new_block=after.block.name != place.block.name)


def _asking_for(place: Place, *, new_block: bool) -> tuple[steps.Command, ...]:
    instruction = (steps.ShowInstruction(place.block),) if new_block else ()
    return (*instruction, steps.AskMount(place.trial))


def _ask_stroke(place: Place) -> steps.AskStroke:
    return steps.AskStroke(place.trial, place.block.strokes_allowed)


def _ask_answer(place: Place) -> steps.Command:
    trial, block = place.trial, place.block
    if trial.answer == "number":
        return steps.AskNumber(trial, block.question)
    if trial.answer == "choice":
        return steps.AskChoice(place.at(place.index - 1).trial, trial, block.question)
    return steps.AskScore(trial, block.scale_ends, block.ticks, block.question)


def _discard_commands(state: State, reason: str) -> tuple[steps.Command, ...]:
    """Return the command that discards the take that is open, where one is."""
    match state:
        case (
            Taring(place)
            | Ready(place)
            | Stroking(place)
            | Scoring(place)
            | Settling(place)
            | Paused(place, scoring=True)
        ):
            return (steps.DiscardTake(place.trial.number, place.take, reason),)
        case _:
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
    return steps.Refuse(f"{steps.WORDS[type(event)]} means nothing now: {situations[type(state)]}")
