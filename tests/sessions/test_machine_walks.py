"""What holds in any session, whatever is done in whatever order."""

from hypothesis import given, settings
from walks import next_event, steps, walks

from sessions.run.machine import advance, start
from sessions.run.states import Closing, Ended, Ready, Settling, Stroking, Taring
from sessions.run.steps import (
    Abort,
    AskMount,
    DiscardTake,
    KeepTake,
    LeaveOut,
    Note,
    Redo,
    Refuse,
    RestoreTake,
    StartTake,
    UndoRedo,
)


@given(walk=walks())
@settings(max_examples=200)
def test_from_any_state_any_event_is_meant_or_refused_with_a_sentence(walk):
    for before, event, state, commands in steps(*walk):
        refusals = [command for command in commands if isinstance(command, Refuse)]
        if refusals:
            assert state == before
            assert commands == tuple(refusals)
            assert len(refusals[0].sentence.split()) > 3
        else:
            assert state != before or commands or isinstance(event, Note)


@given(walk=walks())
def test_the_same_plan_and_events_give_the_same_session(walk):
    assert steps(*walk) == steps(*walk)


@given(walk=walks())
@settings(max_examples=200)
def test_no_walk_brings_the_order_into_disorder_or_confuses_takes(walk):
    kept_takes, open_take, started, discarded, mounted, left_out = {}, None, set(), set(), {}, set()
    for _, _, state, commands in steps(*walk):
        for command in commands:
            match command:
                case StartTake(trial, take):
                    assert open_take is None
                    assert (trial, take - 1) in started or take == 1
                    assert (trial, take) not in started
                    started.add((trial, take))
                    open_take = (trial, take)
                case KeepTake(trial, take):
                    assert open_take == (trial, take)
                    assert trial not in kept_takes
                    kept_takes[trial], open_take = take, None
                case DiscardTake(trial, take):
                    assert (trial, take) == open_take or kept_takes.pop(trial) == take
                    discarded.add((trial, take))
                    open_take = None
                case RestoreTake(trial, take):
                    assert open_take is None
                    assert (trial, take) in discarded
                    open_take = (trial, take)
                case AskMount(trial):
                    mounted.setdefault(trial.number)
                case LeaveOut(trial):
                    left_out.add(trial)
        if isinstance(state, Closing):
            assert open_take is None
    reached = max(mounted, default=0)
    assert set(range(1, reached + 1)) <= {*mounted, *left_out}
    in_order = [number for number in mounted if number not in left_out]
    assert in_order == sorted(in_order)


@given(walk=walks())
def test_every_walk_can_be_completed_and_can_be_aborted(walk):
    plan, events = walk
    state = ([start(plan)[0]] + [step[2] for step in steps(plan, events)])[-1]
    if not isinstance(state, Ended):
        assert isinstance(advance(state, Abort("enough"))[0], Ended)
    for _ in range(100):
        if isinstance(state, Ended):
            break
        state, _ = advance(state, next_event(state))
    assert isinstance(state, Ended)


@given(walk=walks())
@settings(max_examples=200)
def test_a_redo_that_is_undone_leaves_every_trial_as_it_was(walk):
    for before, event, state, _ in steps(*walk):
        if not isinstance(event, Redo) or state == before:
            continue
        after, commands = advance(state, UndoRedo())
        if isinstance(commands[0], Refuse):
            assert isinstance(before, Taring | Ready | Stroking)
            continue
        if isinstance(before, Taring | Ready):
            assert before.position.before_redo is not None
            before = before.position.before_redo
        kept_takes = {number: trial.take for number, trial in enumerate(before.position.progress) if trial.kept}
        if isinstance(before, Settling):
            kept_takes[before.position.index] = before.position.take
        assert {n: trial.take for n, trial in enumerate(after.position.progress) if trial.kept} == kept_takes
        assert all(a.takes >= b.takes for a, b in zip(after.position.progress, state.position.progress, strict=True))
        if not isinstance(before, Settling):
            assert (type(after), after.position.index) == (type(before), before.position.index)
