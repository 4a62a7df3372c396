"""A score belongs to its stroke: an end right after the answer keeps the take, whoever ends the session."""

import json

import pytest
from recordings import change, rows
from simulated_session import Session, resume

from sessions.recording import Recording
from sessions.recording.schema import event_crc
from sessions.run.replay import different_events, different_readings, replay
from sessions.run.runner import STOPPED_BY_USER, RunnerSettings
from sessions.run.steps import Abort, AskScore, Scored

ENDS = {"client": ("client", "the window is gone"), "stopped": ("stopped", STOPPED_BY_USER)}


def record(folder, cause, **settings):
    """Record a session that ends as soon as its first score came, less than half a second after the lift."""
    session = Session(folder)
    session.hands.instead[AskScore] = lambda _: [Scored(40.0)] + [Abort("ill")] * (cause == "aborted")

    def stop():
        return ENDS[cause] if cause in ENDS and rows(folder, "SELECT 1 FROM events WHERE kind = 'scored'") else None

    return session.run(stop=stop, settings=RunnerSettings(**settings))


def replay_differences(recording, tmp_path):
    copy = replay(recording, tmp_path / "again", None, lambda *_: None)
    return [*different_readings(recording, copy), *different_events(recording, copy)]


def assert_kept(recording):
    assert not any(event.kind == "settled" for event in recording.events if event.trial == 1)
    record = recording.trials[0]
    assert (record.outcome, record.score, record.take.number, record.other_takes) == ("scored", 40.0, 1, ())


@pytest.mark.parametrize("cause", ["client", "stopped", "aborted"])
def test_a_score_right_before_the_end_of_the_session_counts(cause, tmp_path):
    recording = record(tmp_path / "s", cause)
    assert (recording.end["cause"], recording.end["complete"]) == (cause, False)
    assert_kept(recording)
    assert replay_differences(recording, tmp_path) == []


@pytest.mark.parametrize("killed", [False, True])
def test_a_session_that_lost_its_client_or_was_killed_right_after_a_score_goes_on_at_the_next_trial(killed, tmp_path):
    record(tmp_path / "s", "client")
    if killed:
        change(tmp_path / "s", "DELETE FROM events WHERE kind IN ('take_kept', 'ended')")
    end, recording = resume(tmp_path / "s")
    assert end.complete
    assert_kept(recording)
    assert all(record.take.number == 1 and not record.other_takes for record in recording.trials)
    assert replay_differences(recording, tmp_path) == []


def test_a_session_by_the_former_rule_repeats_the_trial_and_is_replayed_so(tmp_path):
    recording = record(tmp_path / "s", "client", keep_answered=False)
    assert recording.trials[0].outcome == "open"
    data = {"settings": {n: v for n, v in recording.events[0].data["settings"].items() if n != "keep_answered"}}
    text = json.dumps(data)
    crc = event_crc(recording.events[0], text)
    change(tmp_path / "s", "UPDATE events SET data = ?, crc32 = ? WHERE number = 1", (text, crc))
    end, recording = resume(tmp_path / "s")
    assert end.complete
    assert (recording.trials[0].outcome, recording.trials[0].take.number) == ("scored", 2)
    assert replay_differences(Recording.open(tmp_path / "s"), tmp_path) == [
        "event 1 (started).data.settings.keep_answered is new"
    ]
