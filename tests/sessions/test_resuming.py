import dataclasses
import math
import os
import random
from datetime import datetime, timedelta
from functools import partial

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from killed_process import fork, kill, lines_of, read_reports, whole_session
from recordings import change, readings
from simulated_session import Session, resume
from stand_ins import INFO, ResumableClock
from walks import FORCES, steps, walks

from sessions.recording import LoggedEvent, Recording, RecordingError, SessionWriter
from sessions.recording.archive import problems, seal
from sessions.run.event_log import kind_of, line_of
from sessions.run.machine import advance, start
from sessions.run.resuming import (
    Seam,
    check_resumable,
    check_same_transducer,
    continue_clock,
    resumed_data,
    resumption,
)
from sessions.run.states import Ended
from sessions.run.steps import Abort, Refuse


def log_of(walk):
    """The log of a walk, as the runner writes it."""
    plan, events = walk
    lines = [("started", None, {})]
    for before, event, _, commands in steps(plan, events):
        if any(isinstance(command, Refuse) for command in commands):
            lines.append(("refused", None, {"event": kind_of(type(event)), "sentence": ""}))
            continue
        trial = None if not hasattr(before, "position") else before.position.trial.number
        lines.append((kind_of(type(event)), trial, msgspec.structs.asdict(event)))
        lines += [line for line in map(line_of, commands) if line is not None]
    return plan, [LoggedEvent(i, i, kind, trial, 0, data) for i, (kind, trial, data) in enumerate(lines, 1)]


def kept_takes(lines):
    """Trial and take of what counts, from the lines about takes alone."""
    takes = {}
    for kind, trial, data in lines:
        if kind == "take_kept":
            takes[trial] = data["take"]
        if kind == "take_discarded" and takes.get(trial) == data["take"]:
            del takes[trial]
    return takes


def open_takes(lines):
    takes = set()
    for kind, trial, data in lines:
        if kind == "take_started":
            takes.add((trial, data["take"]))
        if kind in ("take_kept", "take_discarded"):
            takes.discard((trial, data["take"]))
    return takes


@given(walk=walks())
@settings(max_examples=60, deadline=None)
def test_any_beginning_of_a_log_gives_a_state_that_can_be_ended_with_kept_trials_kept_and_no_take_open(walk):
    plan, events = log_of(walk)
    for length in range(len(events) + 1):
        lines = [(event.kind, event.trial, event.data) for event in events[:length]]
        at = resumption(plan, events[:length])
        if not isinstance(at.state, Ended):
            assert isinstance(advance(at.state, Abort("enough"))[0], Ended)
        after = [*lines, *at.due_lines]
        assert not open_takes(after)
        taken_back = {trial for kind, trial, _ in at.due_lines if kind == "take_discarded"}
        kept_before = kept_takes(lines)
        # A take that was kept is taken back only where the experimenter had already asked for it, or with the second of
        # two that are compared.
        alone = {second.compared_with for second in plan.trials if second.number not in kept_before}
        for trial, take in kept_before.items():
            may_be_discarded = trial in alone or events[length - 1].kind == "redo"
            assert kept_takes(after).get(trial) == take or (trial in taken_back and may_be_discarded)
        again = [*events[:length], *(LoggedEvent(0, 0, *line[:2], 0, line[2]) for line in at.due_lines)]
        assert resumption(plan, again).state == at.state
        assert resumption(plan, again).due_lines == ()


def test_a_log_in_which_something_does_not_follow_is_refused():
    plan, _ = start_plan()
    with pytest.raises(RecordingError, match="does not follow"):
        resumption(plan, [LoggedEvent(1, 1, "finish", None, 0, {})])


def start_plan():
    return FORCES, start(FORCES)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills a process of its own, which needs fork")
@pytest.mark.parametrize("kills", [3, pytest.param(8, marks=pytest.mark.slow)])
def test_a_killed_session_goes_on_at_the_same_trial_and_nothing_acknowledged_is_lost(tmp_path, kills):
    chance = random.Random(4)
    resumed_at = set()
    for run in range(kills):
        folder = tmp_path / str(run)
        process, reading = fork(partial(whole_session, folder))
        # Lines, not seconds: how busy the machine is decides nothing.
        first = lines_of(reading, chance.randrange(1, 120))
        kill(process)
        reports = [line for line in (*first, *read_reports(reading)) if len(line) == 2]
        safe = reports[-1] if reports else [0, 0]
        before = Recording.open(folder)
        if before.end is not None:
            continue
        readings = before.readings()
        assert (len(readings), len(before.events)) >= tuple(safe)
        kept_records = {record.trial.number: record for record in before.trials if record.take is not None}
        end, after = resume(folder)
        resumed_at.add(len(kept_records))
        assert end.complete
        assert after.events[: len(before.events)] == before.events
        assert after.readings().raw[: len(readings)].tobytes() == readings.raw.tobytes()
        assert [record.score for record in after.trials] == [t.stimulus.index for t in after.plan.trials]
        assert after.plan == before.plan
        for number, record in kept_records.items():
            assert after.trial(number) == record
        reasons = [take.discard_reason for record in after.trials for take in record.other_takes]
        assert set(reasons) <= {"the recording was cut short in the middle of it"}
        joint = after.readings()
        assert (joint.sequence[1:] - joint.sequence[:-1] == 1).all()
        assert (joint.time[1:] > joint.time[:-1]).all()
        assert after.losses == () or all("write-ahead log" in sentence for sentence in after.losses)
        seal(folder)
        assert problems(folder) == after.losses
    assert len(resumed_at) > kills / 3


def test_a_session_whose_transducer_was_lost_goes_on_as_often_as_it_is_lost(tmp_path):
    Session(tmp_path / "s", link_lost_after=1000).run()
    end, recording = resume(tmp_path / "s", link_lost_after=700)
    assert (end.cause, end.readings, len(recording.readings())) == ("device", 1700, 1700)
    end, recording = resume(tmp_path / "s")
    assert end.complete
    gap = [event.data for event in recording.events if event.kind == "resumed"]
    assert len(gap) == 2
    assert recording.losses == ()
    assert [record.score for record in recording.trials] == [t.stimulus.index for t in recording.plan.trials]


def test_a_session_on_time_that_moves_when_it_is_waited_on_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(ResumableClock, "factor", 0.0)
    Session(tmp_path / "s", link_lost_after=1000).run()
    with pytest.raises(RecordingError, match="ran on simulated time without a pace"):
        check_resumable(Recording.open(tmp_path / "s"))


def test_a_session_whose_last_event_is_damaged_is_not_resumed(tmp_path):
    Session(tmp_path / "s", link_lost_after=1000).run()
    change(tmp_path / "s", "UPDATE events SET crc32 = 7 WHERE number = (SELECT max(number) FROM events)")
    with pytest.raises(RecordingError, match="its log is damaged"):
        check_resumable(Recording.open(tmp_path / "s"))


def test_ended_and_sealed_sessions_are_refused(tmp_path):
    recording = Session(tmp_path / "s").run()
    with pytest.raises(RecordingError, match=r"has ended .*'daq-app resume .*s --end' seals it"):
        check_resumable(recording)
    seal(tmp_path / "s")
    with pytest.raises(RecordingError, match="is sealed"):
        SessionWriter.open(tmp_path / "s", ResumableClock())


def test_a_session_that_is_still_written_is_not_resumed(tmp_path):
    session = Session(tmp_path / "s")
    session.writer.event("started")
    with pytest.raises(RecordingError, match="in use"):
        SessionWriter.open(tmp_path / "s", ResumableClock())
    session.writer.close()


def test_another_transducer_or_another_rate_is_refused_with_a_sentence():
    check_same_transducer(INFO, INFO)
    with pytest.raises(RecordingError, match="serial number FT1, and this one has FT2"):
        check_same_transducer(INFO, dataclasses.replace(INFO, serial="FT2"))
    with pytest.raises(RecordingError, match="gives 100 readings a second, and gave 200"):
        check_same_transducer(INFO, dataclasses.replace(INFO, rate=100.0))
    check_same_transducer(None, None)
    for pair in ((INFO, None), (None, INFO)):
        with pytest.raises(RecordingError, match="began without a transducer, or is resumed without its own"):
            check_same_transducer(*pair)


def test_a_rate_that_can_only_be_measured_may_be_another_by_a_few_per_cent():
    controller = dataclasses.replace(INFO, rate=294.9, counter_rate=math.nan)
    check_same_transducer(controller, dataclasses.replace(controller, rate=296.7))  # two openings over a USB adapter
    with pytest.raises(RecordingError, match="gives 147 readings a second"):
        check_same_transducer(controller, dataclasses.replace(controller, rate=147.0))


@pytest.mark.parametrize("later", [timedelta(days=-9000), timedelta(seconds=1)])  # the session took five seconds
def test_a_wall_clock_set_back_leaves_the_gap_unknown_and_the_session_clock_forward(tmp_path, later):
    Session(tmp_path / "s", link_lost_after=1000).run()
    recording = Recording.open(tmp_path / "s")
    earlier = datetime.fromisoformat(recording.provenance["created_utc"]) + later
    clock, gap = continue_clock(recording, recording.last_block(), ResumableClock(7), earlier)
    assert gap["gap"] is None
    assert clock.now_ns() > recording.events[-1].time_ns


def test_the_time_that_opening_the_device_takes_is_no_part_of_the_next_gap(tmp_path):
    Session(tmp_path / "s", link_lost_after=1000).run()
    recording = Recording.open(tmp_path / "s")
    at = datetime.fromisoformat(recording.provenance["created_utc"]) + timedelta(minutes=10)
    clock, gap = continue_clock(recording, recording.last_block(), ResumableClock(7), at)
    resumed_ns = clock.now_ns()
    writer = SessionWriter.open(tmp_path / "s", clock)
    writer.event("resumed", data=resumed_data(gap, INFO, {}), time_ns=resumed_ns + 5_000_000_000)
    writer.close()
    recording = Recording.open(tmp_path / "s")
    clock, _ = continue_clock(recording, recording.last_block(), ResumableClock(7), at + timedelta(minutes=1))
    assert clock.now_ns() - resumed_ns == pytest.approx(60e9, abs=1e6)


def test_the_seam_alters_nothing_the_device_said(tmp_path):
    Session(tmp_path / "s", link_lost_after=1000).run()
    block = Recording.open(tmp_path / "s").last_block()
    joined = Seam(1000, 4.0).join(block)
    assert joined.raw.tobytes() == block.raw.tobytes()
    assert joined.counter.tolist() == block.counter.tolist()
    assert joined.sequence.tolist() == [number + 1000 for number in block.sequence.tolist()]


def test_readings_after_a_resumption_follow_those_before_by_number_and_by_the_session_clock():
    before = readings(40, 2, received_ns=5_000_000_000)  # numbers 40 and 41, the last at 0.205 s
    after = dataclasses.replace(readings(3, 2), received_ns=np.array([7_500_000_000, 7_600_000_000]))
    joined = Seam.between(before, after).join(after)
    assert joined.sequence.tolist() == [42, 43]
    assert joined.time.tolist() == pytest.approx([0.205 + 2.5, 0.21 + 2.5])
    assert Seam.between(before.between(0, 0), after).join(after).time.tolist() == after.time.tolist()
    early = dataclasses.replace(after, received_ns=np.zeros(2, np.int64))  # by a clock that ran backwards
    assert Seam.between(before, early).join(early).time[0] > before.time[1]
