from simulated_session import PAPER, Session, once
from stand_ins import Hands, ResumableClock

from sessions.plan.protocols.planning import VisitSetting, plan
from sessions.recording import Recording, SessionWriter, provenance
from sessions.run.event_log import event_of
from sessions.run.runner import run_session
from sessions.run.steps import AskScore, Scored

ANSWER = Scored(31.5, ((4.25, 60.0), (4.75, 31.5)), 4.25, 1, "left", "pen")


def test_every_position_of_an_answer_its_first_touch_corrections_hand_and_device_are_recorded(tmp_path):
    recording = Session(tmp_path / "s", instead={AskScore: once(ANSWER)}).run()
    score_event = next(event for event in recording.events if event.kind == "scored")
    assert score_event.data["positions"] == [[4.25, 60.0], [4.75, 31.5]]
    assert event_of(score_event) == ANSWER
    assert recording.trials[0].score == 31.5


def test_what_a_terminal_cannot_tell_of_an_answer_is_empty_and_not_invented(tmp_path):
    recording = Session(tmp_path / "s").run()
    score_event = next(event for event in recording.events if event.kind == "scored")
    fields = {name: value for name, value in score_event.data.items() if name != "score"}
    assert fields == {"positions": [], "first_touch": None, "corrections": None, "hand": None, "input_device": None}


def test_the_plan_keeps_both_hands_and_leaves_them_open_where_nobody_stated_them(tmp_path):
    assert plan(PAPER, "S01", 3).stroking_hand is None
    paper_plan = plan(PAPER, "S01", 3, forces=False, setting=VisitSetting(stroking_hand="right", answering_hand="left"))
    clock = ResumableClock()
    writer = SessionWriter.create(tmp_path / "s", paper_plan, None, provenance(clock), clock=clock)
    run_session(paper_plan, writer, Hands(clock), None)
    assert Recording.open(tmp_path / "s").plan == paper_plan
