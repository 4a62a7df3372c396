"""What the window knows and shows when recorder or transducer fail, and which trial is done again. No Qt."""

from dataclasses import replace

import pytest
import session_messages as script

from daq_app.recorder import messages as m
from daq_app.window.course_state import Judged
from daq_app.window.view import derive_view
from sessions.plan.protocols import plan, protocol
from sessions.run import steps

GONE = m.Gone(False, "the recorder has ended unexpectedly (signal 9)")
RESUME = m.ResumeSession("recordings/P07")
PAIRS = plan(protocol("paired-comparison"), "P07", 7, forces=False)

# ---- the recorder ends


@pytest.mark.parametrize(
    "messages",
    [script.BEGUN, script.MOUNT, script.TARE, script.READY, script.TOUCH, script.SCORE, script.PAUSED, script.CLOSING],
)
def test_a_recorder_that_ends_in_any_phase_leaves_a_session_that_one_key_resumes(messages):
    view = derive_view(script.after(*messages, GONE))
    assert view.course.primary.sends == RESUME
    assert view.banner.sends == RESUME
    assert "signal 9" in view.banner.sentence
    assert view.lamp.grade == "wrong"


@pytest.mark.parametrize("late", [steps.Scored(40.0), steps.Note("a door"), m.AcknowledgeOverloads(), m.Gone(True, "")])
def test_nothing_that_is_done_after_the_recorder_has_ended_takes_the_way_to_resume_away(late):
    view = derive_view(script.after(*script.SCORE, GONE, late))
    assert view.course.primary.sends == RESUME
    assert view.banner.sends == RESUME


@pytest.mark.parametrize("cut", [GONE, m.Failed("StartSession", "no room: free some", "RecordingError")])
def test_a_session_whose_sealing_was_cut_short_is_not_said_to_be_being_sealed(cut):
    sealing = script.after(
        *script.CLOSING, m.SessionEnded("recordings/P07", script.END, False), m.Sealing("recordings/P07")
    )
    assert derive_view(sealing).lamp.words == "ended, being sealed"
    view = derive_view(
        script.after(
            *script.CLOSING, m.SessionEnded("recordings/P07", script.END, False), m.Sealing("recordings/P07"), cut
        )
    )
    assert view.lamp.words == "ended, not sealed"
    assert ("daq-app resume --end recordings/P07" if cut is GONE else "No room: free some") in view.banner.sentence
    assert view.banner.sends != RESUME


def test_the_subject_is_asked_for_nothing_while_no_recorder_takes_the_answer():
    assert derive_view(script.after(*script.SCORE)).subject.asks
    subject = derive_view(script.after(*script.SCORE, GONE)).subject
    assert (subject.asks, subject.title) == (False, "Pause")


def test_a_resumption_that_fails_says_why_and_can_be_tried_again():
    failure = m.Failed("ResumeSession", "nothing answers at 192.168.1.1", "LinkLost")
    state = script.after(*script.SCORE, GONE, RESUME, m.Gone(True, ""))  # as the next recorder starts
    assert derive_view(state).banner is None
    view = derive_view(script.after(failure, state=state))
    assert "nothing answers at 192.168.1.1" in view.banner.sentence
    assert view.banner.sends == RESUME
    assert view.course.primary.sends == RESUME


def test_the_transducer_went_with_the_recorder_and_can_be_connected_anew():
    bench = derive_view(script.after(m.Device(script.INFO, None), GONE)).bench
    assert (bench.lamp, bench.name, bench.connect) == ("off", "no transducer", None)


def test_a_request_that_has_to_wait_for_the_end_of_the_session_does_not_end_it():
    twice = m.Failed("StartSession", "a session is running: StartSession has to wait for its end")
    view = derive_view(script.after(*script.MOUNT, twice))
    assert view.course.primary.label == "Zero"
    assert view.banner.grade == "look"


# ---- the cable is pulled

UNPLUGGED = (
    *script.SCORE,
    Judged(1, 1, script.GOOD),
    m.SessionEnded("recordings/P07", script.LOST, True),
    m.LinkDown("no readings"),
)


def test_no_mark_of_an_ended_session_is_drawn_on_the_clock_of_the_next_stream():
    assert script.after(*script.SCORE, Judged(1, 1, script.GOOD)).session.marks != ()
    for end in (script.LOST, script.END):
        state = script.after(
            *script.SCORE, m.SessionEnded("recordings/P07", end, end is script.LOST), m.LinkBack(script.INFO, True)
        )
        assert state.session.marks == ()
        assert script.after(Judged(1, 1, script.GOOD), state=state).session.marks == ()


def test_a_session_that_goes_on_begins_without_the_marks_of_the_stream_before():
    before = (script.log("take_started", 1, take=1), script.log("contact_onset", 1, time=1.5, noticed=1.51))
    begun = m.SessionBegun("recordings/P07", script.PLAN, "people", None, 0, 1.0, before)
    assert script.after(m.Device(script.INFO, None), begun).session.marks == ()


def test_the_banner_of_a_session_cut_short_blames_the_transducer_only_until_it_answers_again():
    state_after = script.after(*UNPLUGGED)
    assert "no readings" in derive_view(state_after).banner.sentence
    back = derive_view(script.after(m.LinkBack(script.INFO, True), state=state_after)).banner
    assert "no readings" not in back.sentence
    assert "answers again" in back.sentence
    assert back.sends == RESUME
    other = m.LinkBack(replace(script.INFO, serial="FT2"), False)
    assert "FT2" in derive_view(script.after(other, state=state_after)).banner.sentence


def test_a_session_that_its_transducer_ended_never_says_that_it_answers_before_it_does():
    assert "answers again" not in derive_view(script.after(*UNPLUGGED[:-1])).banner.sentence


# ---- what the subject reads


@pytest.mark.parametrize("messages", [script.MOUNT, script.TARE])
def test_the_subject_reads_what_to_do_on_the_surface_only_when_it_is_time_to_do_it(messages):
    subject = derive_view(script.after(*messages)).subject
    assert script.PLAN.blocks[0].instruction not in subject.text
    assert "off the surface" in subject.text
    assert script.PLAN.blocks[0].instruction in derive_view(script.after(*script.READY)).subject.text


# ---- which trial is done again

KEPT = (*script.SCORE, script.log("scored", 1, score=38.2), script.log("take_kept", 1, take=1))
LAST = script.PLAN.trials[-1]


@pytest.mark.parametrize(
    ("messages", "trial"),
    [
        (script.MOUNT, None),
        (script.TARE, script.PLAN.trials[0]),
        (script.SCORE, script.PLAN.trials[0]),
        ((*KEPT, steps.AskMount(script.SECOND)), script.PLAN.trials[0]),
        ((*KEPT, steps.AskMount(script.SECOND), steps.StartTake(2, 1), steps.MeasureZero()), script.SECOND),
        (
            (
                *script.READY,
                script.log("take_discarded", 1, take=1, reason="a pause"),
                steps.AskMount(script.PLAN.trials[0]),
            ),
            None,
        ),
        (script.CLOSING, LAST),
    ],
)
def test_redo_names_the_trial_it_discards(messages, trial):
    redo = derive_view(script.after(*messages)).course.redo
    assert redo.enabled == (trial is not None)
    if trial is not None:
        assert redo.label == f"Redo {trial.number}"
        assert f"trial {trial.number} ({trial.stimulus.code})" in redo.question


def test_redo_names_both_of_two_that_are_compared():
    first, second = PAIRS.trials[:2]
    begun = m.SessionBegun("recordings/P07", PAIRS, "people", None, 0, 1.0)
    state = script.after(begun, steps.AskMount(second), steps.StartTake(2, 1), steps.AskChoice(first, second, "Which?"))
    redo = derive_view(state).course.redo
    assert redo.label == "Redo 1–2"
    assert first.stimulus.code in redo.question
    assert second.stimulus.code in redo.question


def test_a_flaw_is_the_reason_to_redo_only_the_trial_it_was_found_in():
    flawed = (
        *script.SCORE,
        Judged(1, 1, script.BAD),
        script.log("take_kept", 1, take=1),
        steps.AskMount(script.SECOND),
    )
    assert derive_view(script.after(*flawed)).course.redo.sends == steps.Redo("no steady window")
    third = (
        *flawed,
        steps.StartTake(2, 1),
        script.log("take_kept", 2, take=1),
        steps.AskMount(script.PLAN.trials[2]),
    )
    redo = derive_view(script.after(*third)).course.redo
    assert (redo.label, redo.sends) == ("Redo 2", None)


def test_no_key_stands_for_no_answer_while_a_number_is_typed():
    assert derive_view(script.after(*script.SCORE)).course.no_answer.key == "0"
    number = script.after(*script.MOUNT, steps.AskNumber(script.PLAN.trials[0], "How sticky?"))
    assert derive_view(number).course.no_answer.key == ""
