"""The course of a session, case by case; `test_machine_walks` goes through it at random."""

import pytest
from walks import CODES, FIRST, FORCES, NUMBERS, PAIRS, RESTFUL, SCORES, plan_of

from sessions.plan.plan import Frame, Rests, SessionPlan
from sessions.run.machine import advance, resume_interrupted, start, trial_in_hand
from sessions.run.states import Ended, Mounting, Resting, Scoring, Settling, Stroking, Taring
from sessions.run.steps import (
    Abort,
    AskBegin,
    AskChoice,
    AskFinish,
    AskMount,
    AskNumber,
    AskRest,
    AskScore,
    AskStroke,
    Begin,
    ContactOnset,
    DiscardTake,
    EndSession,
    FingerLifted,
    Finish,
    KeepTake,
    LeaveOut,
    MagnitudeEstimate,
    MeasureZero,
    Note,
    PairedChoice,
    Pause,
    Redo,
    Refuse,
    RestoreTake,
    RestOver,
    Resume,
    Scored,
    Settled,
    ShowInstruction,
    Skip,
    StartTake,
    StimulusMounted,
    StrokeDone,
    Tell,
    UndoRedo,
    Zeroed,
)


def after(plan, *events):
    """State and last commands when `events` follow one another, none of them refused."""
    state, commands = start(plan)
    for event in events:
        state, commands = advance(state, event)
        assert not any(isinstance(command, Refuse) for command in commands), (event, commands)
    return state, commands


def commands_after(plan, *events):
    return after(plan, *events)[1]


def mount(trial=0):
    return StimulusMounted(CODES[trial])


STROKE = (ContactOnset(), FingerLifted())


def do_trial(trial=0, score=50.0):
    return (mount(trial), Zeroed(), *STROKE, Settled(), Scored(score))


def put_on(plan, number):
    return StimulusMounted(plan.trials[number - 1].stimulus.code)


def stroke(plan, number):
    if plan.forces:
        return (put_on(plan, number), Zeroed(), *STROKE, Settled())
    return (put_on(plan, number), StrokeDone())


# ---- the course as it is meant


def test_a_session_waits_for_the_experimenter_and_then_reads_the_first_instruction():
    assert start(FORCES)[1] == (AskBegin(),)
    state, commands = after(FORCES, Begin())
    assert isinstance(state, Mounting)
    assert commands == (ShowInstruction(FORCES.blocks[0]), AskMount(FIRST))


def test_a_trial_with_forces_goes_mount_zero_stroke_score():
    assert commands_after(FORCES, Begin(), mount()) == (StartTake(1, 1), MeasureZero())
    assert commands_after(FORCES, Begin(), mount(), Zeroed()) == (AskStroke(FIRST),)
    assert isinstance(after(FORCES, Begin(), mount(), Zeroed(), ContactOnset())[0], Stroking)
    state, commands = after(FORCES, Begin(), mount(), Zeroed(), *STROKE)
    assert isinstance(state, Scoring)
    assert commands == (AskScore(FIRST, FORCES.blocks[0].scale_ends),)
    commands = commands_after(FORCES, Begin(), *do_trial())
    assert commands == (KeepTake(1, 1), AskMount(FORCES.trials[1]))


def test_a_trial_without_forces_has_no_zero_and_its_stroke_is_reported():
    assert commands_after(SCORES, Begin(), mount()) == (StartTake(1, 1), AskStroke(SCORES.trials[0]))
    commands = commands_after(SCORES, Begin(), mount(), StrokeDone(), Scored(None))
    assert commands == (KeepTake(1, 1), AskMount(SCORES.trials[1]))


def test_a_new_block_begins_with_its_instruction():
    five = [event for trial in range(5) for event in do_trial(trial)]
    assert commands_after(FORCES, Begin(), *five)[1:] == (ShowInstruction(FORCES.blocks[1]), AskMount(FORCES.trials[5]))


def test_a_whole_session_visits_every_trial_once_in_the_plans_order_and_ends_complete():
    state, commands = start(FORCES)
    kept_trials = []
    for event in (Begin(), *(event for trial in range(10) for event in do_trial(trial)), Finish()):
        state, commands = advance(state, event)
        kept_trials += [command.trial for command in commands if isinstance(command, KeepTake)]
    assert kept_trials == list(range(1, 11))
    assert state == Ended("every trial is done", complete=True)
    assert commands == (EndSession("every trial is done", complete=True),)


def test_the_last_trial_can_be_repeated_before_the_session_is_ended():
    all_done = (Begin(), *(event for trial in range(10) for event in do_trial(trial)))
    assert commands_after(FORCES, *all_done) == (KeepTake(10, 1), AskFinish())
    commands = commands_after(FORCES, *all_done, Redo("finger slipped off"))
    assert commands == (DiscardTake(10, 1, "finger slipped off"), AskMount(FORCES.trials[9]))
    state, commands = after(FORCES, *all_done, Redo("finger slipped off"), *do_trial(9), Finish())
    assert state == Ended("every trial is done", complete=True)


# ---- what is refused


def test_the_wrong_stimulus_is_refused_by_its_label():
    state, _ = after(FORCES, Begin())
    same, (refusal,) = advance(state, StimulusMounted(CODES[1]))
    assert same == state
    assert refusal == Refuse(f"trial 1 needs the stimulus {CODES[0]}, not {CODES[1]}")


@pytest.mark.parametrize("score", [-0.1, 100.1, float("nan"), float("inf")])
def test_a_score_off_the_line_is_refused(score):
    state, _ = after(FORCES, Begin(), mount(), Zeroed(), *STROKE)
    same, (refusal,) = advance(state, Scored(score))
    assert same == state
    assert refusal.sentence.startswith("a score lies between 0 and 100")


@pytest.mark.parametrize("event", [Redo(" "), Skip("")])
def test_redo_and_skip_without_a_reason_are_refused(event):
    state, _ = after(FORCES, Begin(), mount())
    assert advance(state, event)[0] == state
    assert "needs a reason" in advance(state, event)[1][0].sentence


def test_a_plan_without_trials_is_not_run():
    with pytest.raises(ValueError, match="nothing to run"):
        start(SessionPlan("imported", "S01", 0, "none", (), True, Frame()))


def test_a_transducers_events_mean_nothing_in_a_visit_without_one_and_the_other_way_round():
    state, _ = after(SCORES, Begin(), mount())
    assert isinstance(advance(state, ContactOnset())[1][0], Refuse)
    state, _ = after(FORCES, Begin(), mount(), Zeroed())
    assert isinstance(advance(state, StrokeDone())[1][0], Refuse)


# ---- redo, skip, pause, abort


@pytest.mark.parametrize(
    "so_far",
    [(), (Zeroed(),), (Zeroed(), STROKE[0]), (Zeroed(), *STROKE), (Zeroed(), *STROKE, Scored(3.0))],
)
def test_redo_discards_the_take_and_opens_another_of_the_same_trial(so_far):
    state, commands = after(FORCES, Begin(), mount(), *so_far, Redo("sneezed"))
    assert commands == (DiscardTake(1, 1, "sneezed"), StartTake(1, 2), MeasureZero())
    assert isinstance(state, Taring)
    assert trial_in_hand(state) == 1


def test_redo_just_before_a_trial_repeats_the_one_before_and_the_order_goes_on_as_planned():
    commands = commands_after(FORCES, Begin(), *do_trial(0), *do_trial(1), Redo("wrong finger"))
    assert commands == (DiscardTake(2, 1, "wrong finger"), AskMount(FORCES.trials[1]))
    commands = commands_after(FORCES, Begin(), *do_trial(0), *do_trial(1), Redo("wrong finger"), *do_trial(1))
    assert commands == (KeepTake(2, 2), AskMount(FORCES.trials[2]))


def test_pressing_redo_twice_does_not_reach_further_back():
    state, _ = after(FORCES, Begin(), *do_trial(0), *do_trial(1), Redo("wrong finger"))
    same, (refusal,) = advance(state, Redo("wrong finger"))
    assert same == state
    assert refusal == Refuse("trial 2 is about to be repeated already")


def test_a_redo_is_undone_until_the_next_stroke_and_the_answer_is_asked_for_again():
    so_far = (Begin(), mount(), Zeroed(), *STROKE, Redo("mistaken"))
    undone = (DiscardTake(1, 2, "the redo was undone"), RestoreTake(1, 1))
    for more in ((), (Zeroed(),)):
        state, commands = after(FORCES, *so_far, *more, UndoRedo())
        assert commands[:-1] == undone
        assert isinstance(commands[-1], AskScore)
        assert isinstance(state, Scoring)
    assert commands_after(FORCES, *so_far, UndoRedo(), Scored(3.0))[0] == KeepTake(1, 1)
    assert commands_after(FORCES, *so_far, UndoRedo(), Redo("after all"))[:2] == (
        DiscardTake(1, 1, "after all"),
        StartTake(1, 3),
    )
    (refusal,) = advance(after(FORCES, *so_far, Zeroed(), *STROKE)[0], UndoRedo())[1]
    assert refusal == Refuse("there is no redo to undo: that of a whole stroke can be undone until the next one")


def test_undoing_the_redo_of_a_trial_that_was_done_restores_it_and_of_one_that_was_skipped_leaves_it_out():
    commands = commands_after(FORCES, Begin(), *do_trial(0), *do_trial(1), Redo("mistaken"), UndoRedo())
    assert commands == (RestoreTake(2, 1), KeepTake(2, 1), AskMount(FORCES.trials[2]))
    skipped = (Begin(), mount(), Skip("surface dirty"), Redo("cleaned"), mount(), UndoRedo())
    assert commands_after(FORCES, *skipped) == (
        DiscardTake(1, 2, "the redo was undone"),
        LeaveOut(1, "the redo was undone"),
        AskMount(FORCES.trials[1]),
    )


def test_a_skipped_trial_can_be_taken_up_again():
    commands = commands_after(FORCES, Begin(), mount(), Skip("surface dirty"))
    assert commands == (DiscardTake(1, 1, "skipped: surface dirty"), AskMount(FORCES.trials[1]))
    commands = commands_after(FORCES, Begin(), mount(), Skip("surface dirty"), Redo("cleaned"))
    assert commands == (AskMount(FIRST),)


def test_a_pause_before_the_stroke_is_done_discards_the_take_and_mounts_anew():
    commands = commands_after(FORCES, Begin(), mount(), Zeroed(), Pause())
    assert [type(command) for command in commands] == [DiscardTake]
    commands = commands_after(FORCES, Begin(), mount(), Zeroed(), Pause(), Resume())
    assert commands == (AskMount(FIRST),)
    assert commands_after(FORCES, Begin(), mount(), Zeroed(), Pause(), Resume(), mount())[0] == StartTake(1, 2)


def test_a_pause_before_the_score_keeps_the_stroke_and_asks_again():
    state, commands = after(FORCES, Begin(), mount(), Zeroed(), *STROKE, Pause(), Resume())
    assert isinstance(state, Scoring)
    assert [type(command) for command in commands] == [AskScore]


def test_a_further_stroke_before_the_score_is_reported_and_the_take_stays():
    commands = commands_after(FORCES, Begin(), mount(), Zeroed(), *STROKE, ContactOnset())
    assert [type(command) for command in commands] == [Tell]
    commands = commands_after(FORCES, Begin(), mount(), Zeroed(), *STROKE, *STROKE, Scored(1.0), Settled())
    assert commands[0] == KeepTake(1, 1)


def test_strokes_that_are_allowed_are_taken_in_silence_and_the_next_is_reported():
    plan = plan_of(["line"], strokes_allowed=2)
    so_far = (Begin(), put_on(plan, 1), Zeroed())
    assert commands_after(plan, *so_far) == (AskStroke(plan.trials[0], 2),)
    assert commands_after(plan, *so_far, *STROKE, ContactOnset()) == ()
    assert [type(c) for c in commands_after(plan, *so_far, *STROKE, *STROKE, ContactOnset())] == [Tell]
    # A pause before the answer does not begin to count anew.
    state, _ = after(plan, *so_far, *STROKE, *STROKE, Pause(), Resume())
    assert state.strokes == 2


# ---- a take begins before contact and ends after lift


def test_a_score_given_before_the_finger_has_been_off_for_a_moment_is_taken_and_the_take_runs_on():
    state, commands = after(FORCES, Begin(), mount(), Zeroed(), *STROKE, Scored(40.0))
    assert isinstance(state, Settling)
    assert commands == ()
    commands = commands_after(FORCES, Begin(), mount(), Zeroed(), *STROKE, Scored(40.0), Settled())
    assert commands == (KeepTake(1, 1), AskMount(FORCES.trials[1]))


def test_a_take_never_ends_while_the_finger_touches():
    so_far = (Begin(), mount(), Zeroed(), *STROKE, ContactOnset(), Scored(40.0))
    state, _ = after(FORCES, *so_far)
    assert state.touching
    assert isinstance(advance(state, Settled())[1][0], Refuse)
    assert commands_after(FORCES, *so_far, FingerLifted(), Settled())[0] == KeepTake(1, 1)


# ---- rests


def test_a_rest_comes_after_as_many_trials_as_the_plan_says_and_ends_by_clock_or_experimenter():
    so_far = (Begin(), *stroke(RESTFUL, 1), Scored(1.0), *stroke(RESTFUL, 2), Scored(2.0))
    state, commands = after(RESTFUL, *so_far)
    assert isinstance(state, Resting)
    assert commands == (KeepTake(2, 1), AskRest(30.0))
    for end in (Resume(), RestOver()):
        assert commands_after(RESTFUL, *so_far, end) == (AskMount(RESTFUL.trials[2]),)
    assert commands_after(RESTFUL, *so_far, Redo("moved"))[-1] == AskMount(RESTFUL.trials[1])


def test_a_rest_between_blocks_comes_before_the_instruction_of_the_next():
    plan = SessionPlan(**{f: getattr(FORCES, f) for f in FORCES.__slots__} | {"rests": Rests(between_blocks=True)})
    five = [event for trial in range(5) for event in do_trial(trial)]
    assert commands_after(plan, Begin(), *five)[1:] == (AskRest(None),)
    assert commands_after(plan, Begin(), *five, Resume()) == (ShowInstruction(plan.blocks[1]), AskMount(plan.trials[5]))


# ---- numbers and choices


def test_a_number_is_asked_for_and_must_be_above_nought():
    state, commands = after(NUMBERS, Begin(), *stroke(NUMBERS, 1))
    assert commands == (AskNumber(NUMBERS.trials[0], "Which?"),)
    for wrong in (0.0, -1.0, float("inf"), float("nan")):
        assert "above 0" in advance(state, MagnitudeEstimate(wrong))[1][0].sentence
    assert advance(state, MagnitudeEstimate(1700.0))[1][0] == KeepTake(1, 1)
    assert advance(state, MagnitudeEstimate(None))[1][0] == KeepTake(1, 1)


def test_an_answer_of_another_kind_is_refused_by_what_is_asked_for():
    state, _ = after(NUMBERS, Begin(), *stroke(NUMBERS, 1))
    assert advance(state, Scored(50.0))[1] == (Refuse("this trial asks for a number, not for a score"),)


def test_two_are_presented_one_after_the_other_and_then_one_is_chosen():
    first, second = PAIRS.trials[:2]
    commands = commands_after(PAIRS, Begin(), *stroke(PAIRS, 1))
    assert commands == (KeepTake(1, 1), AskMount(second))
    commands = commands_after(PAIRS, Begin(), *stroke(PAIRS, 1), *stroke(PAIRS, 2)[:-1])
    assert commands == (AskChoice(first, second, "Which?"),)
    commands = commands_after(PAIRS, Begin(), *stroke(PAIRS, 1), *stroke(PAIRS, 2), PairedChoice("second"))
    assert commands == (KeepTake(2, 1), AskMount(PAIRS.trials[2]))


def test_a_pair_is_repeated_as_a_pair():
    first, second = stroke(PAIRS, 1), stroke(PAIRS, 2)
    back = (DiscardTake(2, 1, "slip"), DiscardTake(1, 1, "slip"), AskMount(PAIRS.trials[0]))
    assert commands_after(PAIRS, Begin(), *first, *second, Redo("slip")) == back
    assert commands_after(PAIRS, Begin(), *first, *second, PairedChoice("first"), Redo("slip")) == back
    state, _ = after(
        PAIRS, Begin(), *first, *second, PairedChoice("first"), Redo("slip"), *first, *second, PairedChoice("first")
    )
    assert trial_in_hand(state) == 3


def test_a_pair_is_left_out_as_a_pair():
    commands = commands_after(PAIRS, Begin(), Skip("dirty"))
    assert commands == (LeaveOut(2, "skipped: dirty"), AskMount(PAIRS.trials[2]))


def test_a_pause_or_a_crash_between_the_two_of_a_pair_presents_both_again():
    so_far = (Begin(), *stroke(PAIRS, 1), put_on(PAIRS, 2))
    commands = commands_after(PAIRS, *so_far, Pause(), Resume())
    assert commands == (DiscardTake(1, 1, "a pause parted the two stimuli"), AskMount(PAIRS.trials[0]))
    _, commands = resume_interrupted(after(PAIRS, *so_far)[0], "cut short")
    assert commands[:2] == (DiscardTake(2, 1, "cut short"), DiscardTake(1, 1, "cut short"))
    assert commands[-1] == AskMount(PAIRS.trials[0])


# ---- notes


def test_a_note_changes_nothing_and_an_empty_one_is_refused():
    state, _ = after(FORCES, Begin(), mount())
    assert advance(state, Note("the subject yawned")) == (state, ())
    assert isinstance(advance(state, Note(" "))[1][0], Refuse)


def test_abort_names_its_reason_and_discards_the_open_take():
    state, commands = after(FORCES, Begin(), mount(), Abort("fire alarm"))
    assert commands == (DiscardTake(1, 1, "fire alarm"), EndSession("fire alarm", complete=False))
    assert state == Ended("fire alarm", complete=False)


def test_an_abort_or_a_crash_keeps_the_take_of_an_answered_stroke():
    so_far = (Begin(), mount(), Zeroed(), *STROKE, Scored(40.0))
    assert commands_after(FORCES, *so_far, Abort("ill")) == (KeepTake(1, 1), EndSession("ill", complete=False))
    state, commands = resume_interrupted(after(FORCES, *so_far)[0], "cut short")
    assert commands[0] == KeepTake(1, 1)
    assert trial_in_hand(state) == 2
    assert isinstance(state, Mounting)
    assert not any(isinstance(command, DiscardTake) for command in commands)


def test_a_crash_after_the_answered_stroke_of_the_last_trial_leaves_only_the_end_to_ask_for():
    events = [event for trial in range(len(FORCES.trials)) for event in do_trial(trial)]
    state, _ = after(FORCES, Begin(), *events[:-2], Scored(40.0))
    assert resume_interrupted(state, "cut short")[1] == (KeepTake(len(FORCES.trials), 1), AskFinish())
