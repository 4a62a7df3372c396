"""The course of a session as a table of cases: state and event to state and commands. It does nothing itself."""

from sessions.plan import SessionPlan
from sessions.steps import (
    Abort,
    AskBegin,
    AskFinish,
    AskMount,
    AskScore,
    AskStroke,
    Begin,
    Closing,
    Command,
    ContactOnset,
    DiscardTake,
    Ended,
    EndSession,
    Event,
    FingerLifted,
    Finish,
    Idle,
    KeepTake,
    MeasureZero,
    Mounting,
    Pause,
    Paused,
    Place,
    Progress,
    Ready,
    Redo,
    Refuse,
    Resume,
    Scored,
    Scoring,
    ShowInstruction,
    Skip,
    StartTake,
    State,
    StimulusMounted,
    StrokeDone,
    Stroking,
    Taring,
    Tell,
    Zeroed,
)

Step = tuple[State, tuple[Command, ...]]


def start(plan: SessionPlan) -> Step:
    """Return the state a session is in before it begins, and the first commands.

    Raises ValueError for a plan without trials: an imported recording is not run.
    """
    if not plan.trials:
        raise ValueError(f"the plan of {plan.subject} has no trials, so there is nothing to run")
    return Idle(Place(plan, 0, (Progress(),) * len(plan.trials))), (AskBegin(),)


def advance(state: State, event: Event) -> Step:
    """Return the next state and the commands that enter it; an event that is not meant now is refused."""
    match state, event:
        case Ended(), _:
            return state, (_refusal(state, event),)
        case _, Abort(reason):
            why = reason.strip() or "no reason given"
            return Ended(why, complete=False), (*_discarding(state, why), EndSession(why, complete=False))
        case _, Pause() | Resume():
            return _resting(state, event)
        case _, Redo(reason) | Skip(reason) if not reason.strip():
            return state, (Refuse(f"say why: {type(event).__name__.lower()} needs a reason"),)
        case _, Redo(reason):
            return _again(state, reason)
        case _, Skip(reason):
            return _left_out(state, reason)
        case _, ContactOnset() | FingerLifted():
            return _touched(state, event)
        case _:
            return _went_on(state, event)


def interrupted(state: State, reason: str) -> Step:
    """Return the state in which a session that was cut short goes on, and the commands that enter it.

    It goes on at the same trial. A take that was open is discarded for `reason`: nobody knows what came after its last
    reading. A pause is over.
    """
    match state:
        case Idle():
            return state, (AskBegin(),)
        case Closing():
            return state, (AskFinish(),)
        case Ended():
            return state, ()
        case _:
            place = state.place
            return Mounting(place), (*_discarding(state, reason), *_asking_for(place, new_block=True))


def trial_in_hand(state: State) -> int | None:
    """Return the number of the trial a state belongs to; None before the first, after the last."""
    return None if isinstance(state, Idle | Closing | Ended) else state.place.trial.number


def _went_on(state: State, event: Event) -> Step:
    """Follow the plan."""
    match state, event:
        case Idle(place), Begin():
            return Mounting(place), _asking_for(place, new_block=True)
        case Mounting(place), StimulusMounted(code) if code == place.trial.stimulus.code:
            return _take_begun(place)
        case Mounting(place), StimulusMounted(code):
            wanted = place.trial.stimulus.code
            return state, (Refuse(f"trial {place.trial.number} needs the stimulus {wanted}, not {code}"),)
        case Taring(place), Zeroed():
            return Ready(place), (AskStroke(place.trial),)
        case Ready(place), StrokeDone() if not place.plan.forces:
            return _to_be_scored(place)
        case Scoring(place), Scored(score) if score is None or 0 <= score <= 100:
            kept = KeepTake(place.trial.number, place.take)
            after, commands = _next(place.with_progress(Progress(place.take, kept=True)))
            return after, (kept, *commands)
        case Scoring(), Scored(score):
            return state, (Refuse(f"a score lies between 0 and 100; {score:g} does not"),)
        case Closing(), Finish():
            reason = "every trial is done"
            return Ended(reason, complete=True), (EndSession(reason, complete=True),)
        case _:
            return state, (_refusal(state, event),)


def _touched(state: State, event: ContactOnset | FingerLifted) -> Step:
    """Follow the finger, where a transducer tells of it."""
    match state, event:
        case Ready(place), ContactOnset() if place.plan.forces:
            return Stroking(place), ()
        case Stroking(place), FingerLifted():
            return _to_be_scored(place)
        case Scoring(place, touching=False), ContactOnset() if place.plan.forces:
            return Scoring(place, touching=True), (Tell("a further stroke: it is recorded and will be flagged"),)
        case Scoring(place, touching=True), FingerLifted():
            return Scoring(place), ()
        case _:
            return state, (_refusal(state, event),)


def _resting(state: State, event: Pause | Resume) -> Step:
    """Stop asking, and go on where it is safe: the stimulus is confirmed and the zero measured anew."""
    match state, event:
        case Scoring(place), Pause():
            return Paused(place, scoring=True), ()
        case ((Mounting(place) | Taring(place) | Ready(place) | Stroking(place)), Pause()):
            return Paused(place, scoring=False), _discarding(state, "a pause came before the stroke was done")
        case Paused(place, scoring=True), Resume():
            return _to_be_scored(place)
        case Paused(place), Resume():
            return Mounting(place), (AskMount(place.trial),)
        case _:
            return state, (_refusal(state, event),)


def _again(state: State, reason: str) -> Step:
    """Repeat the trial in hand, or the one before where none is in hand yet; the order after it stays as it was."""
    match state:
        case Taring(place) | Ready(place) | Stroking(place) | Scoring(place):
            after, commands = _take_begun(place)
            return after, (*_discarding(state, reason), *commands)
        case Mounting(place) if place.take > 0:
            return state, (Refuse(f"trial {place.trial.number} is about to be repeated already"),)
        case Mounting(place) if place.index > 0:
            return _taken_up(place.at(place.index - 1), reason)
        case Closing(place):
            return _taken_up(place, reason)
        case _:
            return state, (_refusal(state, Redo(reason)),)


def _left_out(state: State, reason: str) -> Step:
    """Leave the trial in hand out and go on to the next."""
    match state:
        case Mounting(place) | Taring(place) | Ready(place) | Stroking(place) | Scoring(place):
            after, commands = _next(place)
            return after, (*_discarding(state, f"skipped: {reason}"), *commands)
        case _:
            return state, (_refusal(state, Skip(reason)),)


def _take_begun(place: Place) -> Step:
    """Open the next take of the trial in hand, its stimulus being on."""
    place = place.with_progress(Progress(place.take + 1))
    begun = StartTake(place.trial.number, place.take)
    if place.plan.forces:
        return Taring(place), (begun, MeasureZero())
    return Ready(place), (begun, AskStroke(place.trial))


def _taken_up(place: Place, reason: str) -> Step:
    """Return to a trial that was done or left out."""
    progress = place.progress[place.index]
    kept = (DiscardTake(place.trial.number, place.take, reason),) if progress.kept else ()
    return Mounting(place.with_progress(Progress(progress.takes))), (*kept, AskMount(place.trial))


def _to_be_scored(place: Place) -> Step:
    return Scoring(place), (AskScore(place.trial, place.block.scale_ends),)


def _next(place: Place) -> Step:
    """Go on to the next trial, if there is one."""
    if place.last:
        return Closing(place), (AskFinish(),)
    after = place.at(place.index + 1)
    return Mounting(after), _asking_for(after, new_block=after.block != place.block)


def _asking_for(place: Place, *, new_block: bool) -> tuple[Command, ...]:
    instruction = (ShowInstruction(place.block),) if new_block else ()
    return (*instruction, AskMount(place.trial))


def _discarding(state: State, reason: str) -> tuple[Command, ...]:
    """Return the command that discards the take that is open, where one is."""
    match state:
        case Taring(place) | Ready(place) | Stroking(place) | Scoring(place) | Paused(place, scoring=True):
            return (DiscardTake(place.trial.number, place.take, reason),)
        case _:
            return ()


def _refusal(state: State, event: Event) -> Refuse:
    """Say what came, and what is waited for."""
    waiting: dict[type[State], str] = {
        Idle: "the session has not begun",
        Mounting: "a stimulus is to be mounted",
        Taring: "the zero is being measured",
        Ready: "the subject is to stroke",
        Stroking: "the finger is touching",
        Scoring: "the subject is to score",
        Paused: "the session is paused",
        Closing: "every trial is done",
        Ended: "the session has ended",
    }
    return Refuse(f"{WORDS[type(event)]} means nothing now: {waiting[type(state)]}")


WORDS: dict[type[Event], str] = {
    Abort: "abort",
    Begin: "begin",
    StimulusMounted: "a mounted stimulus",
    Zeroed: "a measured zero",
    ContactOnset: "a touch",
    FingerLifted: "a lift",
    StrokeDone: "a stroke reported by hand",
    Scored: "a score",
    Redo: "redo",
    Skip: "skip",
    Pause: "pause",
    Resume: "resume",
    Finish: "finish",
}
