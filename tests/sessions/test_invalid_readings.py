"""Readings that the device marks as invalid, while a session runs: as in the analysis, they show no contact."""

import json
from dataclasses import replace

import numpy as np
import pytest
from recordings import change
from simulated_session import Session
from stand_ins import RATE, Hands

from sessions.recording import Recording
from sessions.recording.schema import event_crc
from sessions.run.replay import different_events, different_readings, replay
from sessions.run.runner import STOPPED_BY_USER, RunnerSettings
from sessions.run.steps import AskStroke, MeasureZero, Tell
from sessions.strokes import analyse

S = 1_000_000_000


def record(folder, *, dropouts, **settings):
    """Record two trials; each stroke lasts from 0.3 to 0.9 s after it is asked, `dropouts` count from there too."""

    class Spoiled(Hands):
        def stroke(self, now, newtons=2.0):
            super().stroke(now, newtons)
            self.transducer.dropouts += [(now + round(a * S), now + round(b * S)) for a, b in dropouts]

    session = Session(folder)
    session.hands = Spoiled(session.clock, session.transducer)
    session.transducer.read = drag(session.transducer.read)
    requests = []
    session.hands.instead[AskStroke] = requests.append
    recording = session.run(
        settings=RunnerSettings(**settings), stop=lambda: ("stopped", STOPPED_BY_USER) if len(requests) > 2 else None
    )
    return session, recording


def drag(read):
    """Return a `read` of which the other axes follow the force along z, with noise of their own."""
    noise = np.random.default_rng(1)

    def read_with_drag(timeout):
        block = read(timeout)
        sideways = np.outer(block.raw[:, 2], [-0.5, 0.1, 0.01, -0.02, 0.001]) + noise.normal(0.0, 4e3, (len(block), 5))
        raw = np.insert(np.where(block.status[:, None] == 0, sideways, 0.0), 2, block.raw[:, 2], axis=1)
        return replace(block, raw=np.round(raw))

    return read_with_drag


def times(recording, kind):
    return [event.data["time"] for event in recording.events if event.kind == kind]


def replay_differences(recording, tmp_path):
    copy = replay(recording, tmp_path / "again", None, lambda *_: None)
    return [*different_readings(recording, copy), *different_events(recording, copy)]


@pytest.mark.parametrize(
    ("dropout", "begin", "end"),
    [((0.5, 0.7), 0.3, 0.9), ((0.2, 0.5), 0.5, 0.9), ((0.7, 1.1), 0.3, 1.1)],
    ids=["within", "at the onset", "at the lift"],
)
def test_a_stroke_lasts_from_its_first_sound_reading_to_the_first_without_load_live_and_analysed(
    tmp_path, dropout, begin, end
):
    session, recording = record(tmp_path / "s", dropouts=[dropout])
    onsets, lifts = times(recording, "contact_onset"), times(recording, "finger_lifted")
    requests = [touch[0] / S - 0.3 - session.transducer.began_ns / S for touch in session.transducer.touches[:2]]
    assert onsets == pytest.approx([instant + begin for instant in requests], abs=2 / RATE)
    assert lifts == pytest.approx([instant + end for instant in requests], abs=2 / RATE)
    strokes = analyse(recording).strokes
    assert [stroke.onset for stroke in strokes] == pytest.approx(onsets, abs=2 / RATE)
    assert [stroke.lift for stroke in strokes] == pytest.approx(lifts, abs=2 / RATE)
    assert replay_differences(recording, tmp_path) == []


def test_a_recording_by_the_former_rule_is_replayed_by_it(tmp_path):
    _, recording = record(tmp_path / "s", dropouts=[(0.5, 0.7)], sound_only=False)
    onsets, lifts = times(recording, "contact_onset"), times(recording, "finger_lifted")
    assert [lift - onset for onset, lift in zip(onsets, lifts, strict=True)] == pytest.approx([0.2, 0.2], abs=2 / RATE)
    started = recording.events[0]
    data = json.dumps({"settings": {n: v for n, v in started.data["settings"].items() if n != "sound_only"}})
    change(recording.folder, "UPDATE events SET data = ?, crc32 = ? WHERE number = 1", (data, event_crc(started, data)))
    former = Recording.open(recording.folder)
    assert former.losses == recording.losses
    assert replay_differences(former, tmp_path) == ["event 1 (started).data.settings.sound_only is new"]


def test_invalid_readings_give_no_zero_and_the_sentence_names_the_cause(tmp_path):
    session = Session(tmp_path / "s")

    def spoil(_):
        session.transducer.dropouts = session.transducer.dropouts or [
            (session.clock.at_ns, session.clock.at_ns + 6 * S)
        ]

    session.hands.instead[MeasureZero] = spoil
    recording = session.run()
    zeroed = next(event for event in recording.events if event.kind == "zeroed")
    assert zeroed.time_ns > session.transducer.dropouts[0][1]
    sentence = next(command.sentence for command in session.hands.display if isinstance(command, Tell))
    assert sentence.startswith("the zero cannot be measured: most readings are invalid (unknown bit 0 (")
    assert replay_differences(recording, tmp_path) == []
