"""What the window knows and shows when recorder or transducer fail, and which trial is done again. No Qt."""

from dataclasses import replace

import pytest
from session_messages import (
    BAD,
    BEGINNING,
    CLOSING,
    END,
    GOOD,
    INFO,
    LOST,
    MOUNT,
    PAUSED,
    PLAN,
    READY,
    SCORE,
    SECOND,
    TARE,
    TOUCH,
    after,
    log,
    status,
)

from daq_app.recorder import messages as m
from daq_app.window.course_state import Judged
from daq_app.window.state import Tick
from daq_app.window.subject import owner
from daq_app.window.view import derive_view
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.run import steps

NO_RECORDER = m.Gone(False, "the recorder has ended unexpectedly (signal 9)")
RESUME = m.ResumeSession("recordings/P07")
PAIRS = plan(protocol("paired-comparison"), "P07", 7, forces=False)

# ---- the recorder ends


@pytest.mark.parametrize("messages", [BEGINNING, MOUNT, TARE, READY, TOUCH, SCORE, PAUSED, CLOSING])
def test_a_recorder_that_ends_in_any_phase_leaves_a_session_that_one_key_resumes(messages):
    view = derive_view(after(*messages, NO_RECORDER))
    assert view.course.primary.sends == RESUME
    assert view.banner.sends is None  # one thing to press is enough
    assert "signal 9" in view.banner.sentence
    assert view.lamp.grade == "wrong"


@pytest.mark.parametrize("late", [steps.Scored(40.0), steps.Note("a door"), m.AcknowledgeOverloads(), m.Gone(True, "")])
def test_nothing_that_is_done_after_the_recorder_has_ended_takes_the_way_to_resume_away(late):
    view = derive_view(after(*SCORE, NO_RECORDER, late))
    assert view.course.primary.sends == RESUME


@pytest.mark.parametrize("cut", [NO_RECORDER, m.Failed("StartSession", "no room: free some", "RecordingError")])
def test_a_session_whose_sealing_was_cut_short_is_not_said_to_be_being_sealed(cut):
    sealing = after(*CLOSING, m.SessionEnded("recordings/P07", END, False), m.Sealing("recordings/P07"))
    assert derive_view(sealing).lamp.text == "ended, being sealed"
    view = derive_view(after(*CLOSING, m.SessionEnded("recordings/P07", END, False), m.Sealing("recordings/P07"), cut))
    assert view.lamp.text == "ended, not sealed"
    remedy = "daq-app resume --end recordings/P07" if cut is NO_RECORDER else "No room: free some"
    assert remedy in view.banner.sentence
    assert view.course.primary.sends != RESUME


def test_the_subject_is_asked_for_nothing_while_no_recorder_takes_the_answer():
    assert derive_view(after(*SCORE)).subject.asks
    subject = derive_view(after(*SCORE, NO_RECORDER)).subject
    assert (subject.asks, subject.title) == (False, "Pause")


def test_a_resumption_that_fails_says_why_and_can_be_tried_again():
    failure = m.Failed("ResumeSession", "nothing answers at 192.168.1.1", "LinkLost")
    state = after(*SCORE, NO_RECORDER, RESUME, m.Gone(True, ""))  # as the next recorder starts
    assert derive_view(state).banner is None
    view = derive_view(after(failure, state=state))
    assert "nothing answers at 192.168.1.1" in view.banner.sentence
    assert view.course.primary.sends == RESUME


def test_a_session_of_another_day_that_is_not_taken_up_again_is_named_as_such():
    failure = m.Failed("ResumeSession", "nothing answers at 192.168.1.1; sim: is connected again", "LinkLost")
    banner = derive_view(after(failure)).banner
    assert banner.sentence == f"The session was not resumed: {failure.sentence}."
    assert banner.grade == "look"


def test_the_transducer_went_with_the_recorder_and_can_be_connected_anew():
    bench = derive_view(after(m.Device(INFO, None), NO_RECORDER)).bench
    assert (bench.lamp, bench.name, bench.connect) == ("off", "no transducer", None)


def test_a_request_that_has_to_wait_for_the_end_of_the_session_does_not_end_it():
    twice = m.Failed("StartSession", "a session is running: StartSession has to wait for its end")
    view = derive_view(after(*MOUNT, twice))
    assert view.course.primary.label == "Zero"
    assert view.banner.grade == "look"


# ---- the cable is pulled

UNPLUGGED = (*SCORE, Judged(1, 1, GOOD), m.SessionEnded("recordings/P07", LOST, True), m.LinkDown("no readings"))


def test_no_mark_of_an_ended_session_is_drawn_on_the_clock_of_the_next_stream():
    assert after(*SCORE, Judged(1, 1, GOOD)).session.marks != ()
    for end in (LOST, END):
        state = after(*SCORE, m.SessionEnded("recordings/P07", end, end is LOST), m.LinkBack(INFO, True))
        assert state.session.marks == ()
        assert after(Judged(1, 1, GOOD), state=state).session.marks == ()


def test_the_recording_clock_of_a_session_that_goes_on_says_the_time_since_the_session_began():
    before = (replace(log("started"), time_ns=40_000_000_000), replace(log("pause"), time_ns=52_000_000_000))
    # The session's clock was at 40 s when the session began, and is at 100 + 600 s as it goes on.
    beginning = m.SessionBegun("recordings/P07", PLAN, "people", None, 600_000_000_000, before)
    state = after(Tick(100.0), m.Device(INFO, None), beginning, status(1_000), Tick(101.0))
    assert derive_view(state).lamp.text == "recording 00:11:01"
    assert derive_view(state).course.timer == "0:01"


def test_a_session_that_goes_on_begins_without_the_marks_of_the_stream_before():
    before = (log("take_started", 1, take=1), log("contact_onset", 1, time=1.5, noticed=1.51))
    beginning = m.SessionBegun("recordings/P07", PLAN, "people", None, 0, before)
    assert after(m.Device(INFO, None), beginning).session.marks == ()


def test_the_banner_of_a_session_cut_short_blames_the_transducer_only_until_it_answers_again():
    state_after = after(*UNPLUGGED)
    assert "no readings" in derive_view(state_after).banner.sentence
    back = derive_view(after(m.LinkBack(INFO, True), state=state_after)).banner
    assert "no readings" not in back.sentence
    assert "answers again" in back.sentence
    other = m.LinkBack(replace(INFO, serial="FT2"), False)
    assert "FT2" in derive_view(after(other, state=state_after)).banner.sentence


def test_a_session_that_its_transducer_ended_never_says_that_it_answers_before_it_does():
    assert "answers again" not in derive_view(after(*UNPLUGGED[:-1])).banner.sentence


# ---- what the subject reads


@pytest.mark.parametrize("messages", [MOUNT, TARE])
def test_the_subject_reads_what_to_do_on_the_surface_only_when_it_is_time_to_do_it(messages):
    subject = derive_view(after(*messages)).subject
    assert PLAN.blocks[0].instruction not in subject.text
    assert "off the surface" in subject.text
    assert PLAN.blocks[0].instruction in derive_view(after(*READY)).subject.text


# ---- which trial is done again

TAKE_KEPT = (*SCORE, log("scored", 1, score=38.2), log("take_kept", 1, take=1))
LAST = PLAN.trials[-1]


@pytest.mark.parametrize(
    ("messages", "trial"),
    [
        (MOUNT, None),
        (TARE, PLAN.trials[0]),
        (SCORE, PLAN.trials[0]),
        ((*TAKE_KEPT, steps.AskMount(SECOND)), PLAN.trials[0]),
        ((*TAKE_KEPT, steps.AskMount(SECOND), steps.StartTake(2, 1), steps.MeasureZero()), SECOND),
        ((*READY, log("take_discarded", 1, take=1, reason="a pause"), steps.AskMount(PLAN.trials[0])), None),
        (CLOSING, LAST),
    ],
)
def test_redo_names_the_trial_it_discards(messages, trial):
    redo = derive_view(after(*messages)).course.buttons["redo"]
    assert redo.enabled == (trial is not None)
    if trial is not None:
        assert redo.label == f"Redo {trial.number}"
        assert f"trial {trial.number} ({trial.stimulus.code})" in redo.question


def test_redo_names_both_of_two_that_are_compared():
    first, second = PAIRS.trials[:2]
    beginning = m.SessionBegun("recordings/P07", PAIRS, "people", None, 0)
    state = after(beginning, steps.AskMount(second), steps.StartTake(2, 1), steps.AskChoice(first, second, "Which?"))
    redo = derive_view(state).course.buttons["redo"]
    assert redo.label == "Redo 1–2"
    assert first.stimulus.code in redo.question
    assert second.stimulus.code in redo.question


def test_a_flaw_is_the_reason_to_redo_only_the_trial_it_was_found_in():
    messages = (*SCORE, Judged(1, 1, BAD), log("take_kept", 1, take=1), steps.AskMount(SECOND))
    assert derive_view(after(*messages)).course.buttons["redo"].sends == steps.Redo("no steady window")
    third = (*messages, steps.StartTake(2, 1), log("take_kept", 2, take=1), steps.AskMount(PLAN.trials[2]))
    redo = derive_view(after(*third)).course.buttons["redo"]
    assert (redo.label, redo.sends) == ("Redo 2", None)


def test_no_key_stands_for_no_answer_while_an_answer_is_typed_in_digits():
    assert derive_view(after(*SCORE)).course.buttons["no answer"].key == "0"
    for question in (steps.AskNumber(PLAN.trials[0], "How sticky?"), steps.AskChoice(*PLAN.trials[:2], "Which?")):
        assert derive_view(after(*MOUNT, question)).course.buttons["no answer"].key == ""
    assert owner("0", "choice", typing=False) == "answer"  # beside 1 and 2 on a keypad


def test_the_banner_of_a_request_that_failed_goes_when_it_is_made_again_and_not_with_another_one():
    state = after(m.Failed("Connect", "nothing answers at 192.168.1.1", "LinkLost"))
    assert derive_view(after(m.Tare(), state=state)).banner.sentence == "Nothing answers at 192.168.1.1."
    assert derive_view(after(m.Connect("net-ft://10.0.0.9"), state=state)).banner is None
