"""What the window knows and shows, message by message, without Qt and without a recorder."""

from dataclasses import replace

import pytest
from msgspec import structs
from session_messages import (
    BAD,
    BEGINNING,
    CLOSING,
    CODE,
    END,
    FIRST,
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
    health_report,
    log,
    status,
)

from daq_app.recorder import messages as m
from daq_app.window.state import (
    AppState,
    Dismissed,
    DrawingFailed,
    Judged,
    NewSession,
    Tick,
    TransducerHolders,
)
from daq_app.window.view import derive_view
from sessions.plan.plan import Visibility
from sessions.run import steps

CUT_SHORT = (*MOUNT, m.SessionEnded("recordings/P07", LOST, True))
RESUME = m.ResumeSession("recordings/P07")


@pytest.mark.parametrize(
    ("messages", "words", "label", "sends"),
    [
        (BEGINNING, "begin", "Begin", steps.Begin()),
        (MOUNT, f"Mount sample {CODE}", "Zero", steps.StimulusMounted(CODE)),
        (TARE, "Hands off", None, None),
        (READY, f"Subject strokes {CODE} once", None, None),
        (TOUCH, "being recorded", None, None),
        (SCORE, "scores sample", None, None),
        (PAUSED, "Paused", "Resume", steps.Resume()),
        (CLOSING, "Every trial is done", "End session", steps.Finish()),
        ((*CLOSING, m.SessionEnded("recordings/P07", END, False)), "Session ended", "New session", NewSession()),
        (CUT_SHORT, "cut short", "Resume session", RESUME),
    ],
)
def test_one_sentence_says_what_to_do_now_and_one_button_does_it(messages, words, label, sends):
    course = derive_view(after(*messages)).course
    assert words in course.headline
    assert (course.primary.label if course.primary else None) == label
    assert (course.primary.sends if course.primary else None) == sends


def test_the_way_of_the_stroke_is_shown_while_a_trial_is_in_hand_and_only_then():
    assert derive_view(after(*MOUNT)).course.direction == FIRST.direction
    assert "away from the subject" in derive_view(after(*MOUNT)).course.headline
    assert derive_view(after(*CLOSING)).course.direction == 0


def test_the_plan_shows_what_is_done_in_hand_and_coming():
    messages = (
        *SCORE,
        Judged(1, 1, GOOD),
        log("scored", 1, score=38.2),
        log("take_kept", 1, take=1),
        steps.AskMount(SECOND),
    )
    rows = derive_view(after(*messages)).course.rows
    assert [row.kind for row in rows[:4]] == ["block", "done", "current", "coming"]
    assert "µ 0.44" in rows[1].outcome
    assert "score 38" in rows[1].outcome
    assert len(rows) == 2 + 10


def test_a_skipped_and_an_unanswered_trial_are_told_apart():
    skip_messages = (*READY, log("skip", 1, reason="torn"), log("take_discarded", 1, take=1, reason="skipped: torn"))
    rows = derive_view(after(*skip_messages, steps.AskMount(SECOND))).course.rows
    assert (rows[1].kind, rows[1].outcome) == ("skipped", "skipped")
    no_answer = (*SCORE, log("scored", 1, score=None), log("take_kept", 1, take=1), steps.AskMount(SECOND))
    rows = derive_view(after(*no_answer)).course.rows
    assert (rows[1].kind, rows[1].outcome) == ("done", "no answer")


def test_a_redone_trial_loses_its_score_and_says_which_take_it_is():
    again = (
        *SCORE,
        log("redo", 1, reason="slipped"),
        log("take_discarded", 1, take=1, reason="slipped"),
        steps.StartTake(1, 2),
        steps.MeasureZero(),
    )
    state = after(*again)
    assert state.session.trials[0].answer is None
    row = derive_view(state).course.rows[1]
    assert (row.kind, row.outcome) == ("current", "take 2")


def test_a_flawed_stroke_is_redone_by_one_key_whose_reason_is_what_was_found():
    course = derive_view(after(*SCORE, Judged(1, 1, BAD))).course
    assert course.stroke.grade == "refused"
    assert "no steady window" in course.stroke.text
    assert course.buttons["redo"].sends == steps.Redo("no steady window")


def test_a_good_stroke_is_redone_only_with_a_reason_that_is_asked_for():
    course = derive_view(after(*SCORE, Judged(1, 1, GOOD))).course
    assert course.stroke.text == f"Stroke on {CODE} · steady 1.5 s · µ 0.44 · 21 mm/s · N fell 8 % · good"
    assert course.buttons["redo"].enabled
    assert course.buttons["redo"].sends is None


@pytest.mark.parametrize(("fell", "text"), [(0.004, "mm/s · good"), (-0.07, "N rose 7 % · good")])
def test_a_change_of_force_is_named_where_it_is_a_per_cent(fell, text):
    stroke = derive_view(after(*SCORE, Judged(1, 1, replace(GOOD, fell=fell)))).course.stroke
    assert stroke.text.endswith(text)


def test_what_was_found_of_a_take_that_was_done_again_meanwhile_is_not_shown():
    state = after(*SCORE, steps.StartTake(1, 2), Judged(1, 1, BAD))
    assert derive_view(state).course.stroke.grade == "none"


def test_onset_steady_window_and_lift_are_marked_in_device_time():
    state = after(*SCORE, Judged(1, 1, GOOD))
    assert [(mark.kind, mark.start, mark.stop) for mark in state.session.marks] == [
        ("onset", 1.5, 1.5),
        ("lift", 3.6, 3.6),
        ("steady", 2.0, 3.5),
    ]


def test_nothing_can_be_redone_before_the_first_trial_was_begun():
    assert not derive_view(after(*MOUNT)).course.buttons["redo"].enabled
    assert derive_view(after(*READY)).course.buttons["redo"].enabled


# ---- the lamp


def test_the_recording_lamp_is_fed_by_what_the_disk_acknowledged_and_by_nothing_else():
    state = after(Tick(100.0), *MOUNT)
    assert derive_view(state).lamp.grade == "off"
    state = after(status(1_000), state=state)
    assert derive_view(state).lamp.grade == "on"
    for second in range(1, 6):  # the state is still reported, but nothing more becomes safe
        state = after(Tick(100.0 + second), status(1_000), state=state)
    lamp = derive_view(state).lamp
    assert lamp.grade == "wrong"
    assert lamp.text == "NOT RECORDING 00:00:05"
    assert lamp.age == "saved 5.0 s ago"
    assert derive_view(after(status(2_000), state=state)).lamp.grade == "on"


def test_a_session_goes_on_in_the_folder_that_its_end_names():
    state = after(*MOUNT, m.SessionEnded("recordings/P07-rescued", LOST, True))
    assert derive_view(state).course.primary.sends == m.ResumeSession("recordings/P07-rescued")


def test_a_session_that_has_ended_shows_no_recording():
    state = after(*MOUNT, status(1_000), m.SessionEnded("recordings/P07", END, False), m.Sealing(""), m.Sealed(""))
    assert derive_view(state).lamp == replace(derive_view(state).lamp, grade="off", text="ended and sealed")


# ---- what is wrong


@pytest.mark.parametrize(
    ("messages", "grade", "words", "sends"),
    [
        ((m.LinkDown("no readings for 1 s"),), "wrong", "no readings for 1 s", None),
        ((*MOUNT, m.LinkDown("no readings for 1 s")), "wrong", "Readings are being lost", None),
        (
            (m.Failed("Connect", "nothing answers at 192.168.1.1"),),
            "look",
            "Nothing answers at 192.168.1.1.",
            Dismissed(),
        ),
        (
            (m.Device(INFO, None), health_report((0.0, 0.0, 1.2, 0.0, 0.0, 0.0, 0.9))),
            "wrong",
            "Fz",
            m.AcknowledgeOverloads(),
        ),
        ((*MOUNT, DrawingFailed("ValueError: x")), "look", "the recording continues", Dismissed()),
        ((*MOUNT, m.Gone(False, "the recorder has ended unexpectedly (signal 9)")), "wrong", "signal 9", None),
        ((*MOUNT, m.Failed("StartSession", "the disk is full", "RecordingError")), "wrong", "the disk is full", None),
        (CUT_SHORT, "wrong", "the cable was pulled", None),
    ],
)
def test_what_is_wrong_is_one_banner_with_what_can_be_done(messages, grade, words, sends):
    banner = derive_view(after(*messages)).banner
    assert banner.grade == grade
    assert words in banner.sentence
    assert banner.sends == sends


def test_a_disk_that_took_no_more_is_reported_with_what_is_safe_once():
    reason = "the disk took no more (database or disk is full); all that was measured is safe: free space, and resume"
    end = replace(LOST, cause="disk", reason=reason)
    banner = derive_view(after(*MOUNT, m.SessionEnded("recordings/P07", end, True))).banner
    assert banner.sentence == f"The session was cut short: {reason}."


def test_a_transducer_that_another_session_s_recorder_holds_is_refused_with_its_name_until_it_is_free():
    port, other = "serial-ft:///dev/ttyUSB0", "serial-ft:///dev/ttyUSB1"
    refusal = after(
        m.Device(INFO, None),
        m.Connect(port),
        m.NoDevice(),
        m.Failed("Connect", f"{port}: another program has it; end that program"),
    )
    assert (
        "another program has it" in derive_view(after(TransducerHolders({other: "P08"}), state=refusal)).banner.sentence
    )
    busy = after(TransducerHolders({port: "P07, begun at 14:30"}), state=refusal)
    sentence = derive_view(busy).banner.sentence
    assert sentence.startswith("The recorder of another session (P07, begun at 14:30) holds this transducer.")
    assert "after 10 s at most. Then connect again, or resume that session." in sentence
    free = derive_view(after(TransducerHolders({}), state=busy)).banner.sentence
    assert "let it go; connect again, or resume its session" in free
    assert derive_view(after(m.Connect(port), state=busy)).banner is None


def test_a_calm_bench_shows_no_banner():
    assert derive_view(after(*SCORE)).banner is None
    assert derive_view(AppState()).banner is None


def test_a_banner_of_a_lost_link_goes_when_the_same_transducer_is_back_and_stays_for_another():
    link_down = after(*MOUNT, m.LinkDown("silent"))
    assert derive_view(after(m.LinkBack(INFO, True), state=link_down)).banner is None
    other = replace(INFO, serial="FT2")
    assert "FT2" in derive_view(after(m.LinkBack(other, False), state=link_down)).banner.sentence


def test_a_transducer_that_was_lost_can_be_disconnected_for_another_once_no_session_runs():
    assert derive_view(after(*MOUNT, m.LinkDown("silent"))).bench.connect is None
    link_down = after(m.Device(INFO, None), m.LinkDown("silent"))
    assert derive_view(link_down).bench.connect == m.Disconnect()
    assert derive_view(after(m.NoDevice(), state=link_down)).bench.connect is None


def test_an_error_while_saving_ends_the_course_and_puts_the_lamp_to_wrong():
    view = derive_view(after(*MOUNT, m.Failed("StartSession", "the disk is full", "RecordingError")))
    assert view.lamp.grade == "wrong"
    assert view.course.primary.sends == NewSession()


def test_a_recorder_that_is_silent_in_a_session_is_said_to_be_silent():
    state = after(Tick(100.0), *MOUNT, status(1_000), Tick(105.0))
    assert "The recorder has not answered for 5 s" in derive_view(state).banner.sentence


@pytest.mark.parametrize("messages", [BEGINNING, MOUNT, TARE, READY, TOUCH, SCORE, PAUSED, CLOSING])
def test_nothing_the_subject_sees_gives_the_stimulus_away(messages):
    text = repr(derive_view(after(*messages)).subject)
    for trial in PLAN.trials:
        assert trial.stimulus.code not in text
    indices = {str(trial.stimulus.index) for trial in PLAN.trials} - {"0"}
    assert not any(word.strip("(),'") in indices for word in text.replace("=", " ").split())


def test_the_subject_gets_the_line_with_its_ends_when_it_is_time_to_score():
    subject = derive_view(after(*SCORE)).subject
    assert subject.kind == "line"
    assert subject.ends == ("low end", "high end")
    assert "stickiness" in subject.title
    assert derive_view(after(*READY)).subject.text == PLAN.blocks[0].instruction


def test_the_subject_sees_how_hard_it_presses_only_where_the_protocol_says_so():
    assert not derive_view(after(*READY)).subject.force
    plan = replace(PLAN, shown=Visibility(subject=("instruction", "forces")))
    messages = [structs.replace(r, plan=plan) if isinstance(r, m.SessionBegun) else r for r in READY]
    assert derive_view(after(*messages)).subject.force


def test_a_session_that_goes_on_shows_what_was_done_before():
    before = (
        log("take_started", 1, take=1),
        log("scored", 1, score=40.0),
        log("take_kept", 1, take=1),
        log("take_started", 2, take=1),
        log("take_discarded", 2, take=1, reason="cut short"),
    )
    beginning = m.SessionBegun("recordings/P07", PLAN, "people", None, 0, before)
    rows = derive_view(after(m.Device(INFO, None), beginning, steps.AskMount(SECOND))).course.rows
    assert [row.kind for row in rows[:4]] == ["block", "done", "current", "coming"]
    assert rows[1].outcome == "score 40"
