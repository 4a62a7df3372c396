"""What becomes of an answer on the tablet: sent once, acknowledged when safe, never lost, never taken for another."""

import json

import pytest
from session_messages import BEGINNING, FIRST, PLAN, SCORE, after, log

from daq_app.tablet.dialogue import Act, Dialogue, Page, Stored, decode, event_of
from daq_app.window.subject import subject_view
from sessions.run import steps

ACTS = [[1000.0, "press", 20.0, "touch"], [1500.0, "drag", 60.0, "touch"], [1600.0, "release", None, "touch"]]


def answer_given(key, acts=ACTS):
    return decode(json.dumps({"type": "given", "key": key, "acts": acts, "sent": 2000.0}))


class Tablet:
    """A dialogue with what it has sent."""

    def __init__(self):
        self.messages = []
        self.dialogue = Dialogue(self.messages.append)

    def show(self, *messages):
        session = after(*messages).session
        self.dialogue.show(subject_view(session), session, str, mirrored=False)
        return next(message for message in reversed(self.messages) if isinstance(message, Page))

    def give(self, key):
        return self.dialogue.take(answer_given(key), lambda at: at * 1e-3)


def test_a_page_is_sent_once_and_tells_nothing_of_the_stimulus():
    tablet = Tablet()
    page = tablet.show(*SCORE)
    tablet.show(*SCORE)
    assert len(tablet.messages) == 1
    assert (page.view.kind, page.view.ends) == ("line", ("low end", "high end"))
    text = repr(page).replace(page.key, "")
    assert not any(trial.stimulus.code in text for trial in PLAN.trials)


def test_an_answer_goes_to_the_recorder_once_and_is_acknowledged_when_it_is_safe():
    tablet = Tablet()
    key = tablet.show(*SCORE).key
    answer = tablet.give(key)
    assert answer == steps.Scored(60.0, ((1.0, 20.0), (1.5, 60.0)), 1.0, 0, PLAN.answering_hand, "touch")
    assert tablet.give(key) is None  # the tablet asks again: it has heard of nothing yet
    assert not [message for message in tablet.messages if isinstance(message, Stored)]
    tablet.show(*SCORE, log("scored", 1, score=60.0))
    assert tablet.messages.count(Stored(key)) == 1
    assert tablet.give(key) is None  # its acknowledgement got lost: it is sent again
    assert tablet.messages.count(Stored(key)) == 2


@pytest.mark.parametrize("crosses", [True, False])
def test_an_answer_that_a_pause_crosses_or_meets_waits_on_the_tablet_until_its_question_is_asked_again(crosses):
    tablet = Tablet()
    key = tablet.show(*SCORE).key
    if crosses:
        assert tablet.give(key) is not None  # the recorder, paused by then, refuses it
    tablet.show(*SCORE, log("pause", 1))
    assert tablet.give(key) is None
    assert not [message for message in tablet.messages if isinstance(message, Stored)]
    assert tablet.show(*SCORE, log("pause", 1), log("resume", 1)).key == key
    assert isinstance(tablet.give(key), steps.Scored)


def test_an_answer_that_comes_too_late_is_written_down_as_a_note():
    tablet = Tablet()
    key = tablet.show(*SCORE).key
    tablet.show(*SCORE, log("take_discarded", 1, reason="redo"), steps.StartTake(1, 2), steps.AskStroke(FIRST))
    note = tablet.give(key)
    assert isinstance(note, steps.Note)
    assert "60.0" in note.text
    assert key in note.text
    assert Stored(key) in tablet.messages


def test_an_answer_that_a_redo_crosses_is_acknowledged_and_written_down_as_a_note():
    tablet = Tablet()
    key = tablet.show(*SCORE).key
    assert isinstance(tablet.give(key), steps.Scored)
    tablet.show(*SCORE, log("take_discarded", 1, reason="redo"), steps.AskMount(FIRST))
    assert isinstance(tablet.give(key), steps.Note)
    assert tablet.messages.count(Stored(key)) == 1


def test_an_answer_waits_on_the_tablet_while_no_session_runs():
    tablet = Tablet()
    key = tablet.show(*SCORE).key
    tablet.dialogue.show(subject_view(None), None, str, mirrored=False)
    assert tablet.give(key) is None
    assert not [message for message in tablet.messages if isinstance(message, Stored)]
    tablet.show(*BEGINNING)
    assert isinstance(tablet.give(key), steps.Note)


def test_an_answer_of_another_kind_than_asked_for_is_no_answer():
    tablet = Tablet()
    key = tablet.show(*SCORE).key
    other = decode(json.dumps({"type": "given", "key": key, "acts": [[1.0, "choose", "first", "touch"]], "sent": 2.0}))
    assert isinstance(tablet.dialogue.take(other, float), steps.Note)


@pytest.mark.parametrize(
    ("acts", "expected"),
    [
        (
            [(1.0, "press", 150.0, "pen"), (2.0, "release", None, "pen"), (3.0, "press", 40.04, "pen")],
            steps.Scored(40.0, ((1.0, 100.0), (3.0, 40.04)), 1.0, 1, None, "pen"),
        ),
        (
            [(1.0, "step", 1.0, "keyboard"), (1.5, "step", -10.0, "keyboard")],
            steps.Scored(40.0, ((1.0, 50.0), (1.5, 40.0)), 1.0, 0, None, "keyboard"),
        ),
        (
            [(1.0, "number", 1.0, "keyboard"), (2.0, "number", 12.5, "keyboard")],
            steps.MagnitudeEstimate(12.5, 1.0, 0, None, "keyboard"),
        ),
        (
            [(1.0, "choose", "second", "touch"), (2.0, "choose", "first", "touch")],
            steps.PairedChoice("first", 1.0, 1, None, "touch"),
        ),
    ],
)
def test_acts_make_the_answer_that_the_same_acts_make_in_the_window(acts, expected):
    assert event_of([Act(*act) for act in acts], lambda at: at, None) == expected
