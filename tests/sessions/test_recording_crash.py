"""A recording whose writer is killed, or whose disk is full: nothing that was acknowledged is lost."""

import os
import random
from functools import partial
from io import BytesIO

import numpy as np
import pytest
from killed_process import fork, kill_later, read_reports, whole_session
from recordings import new_writer, readings
from simulated_session import Session

from sessions.recording import Recording, RecordingError
from sessions.recording.recovery import log_tail

resource = pytest.importorskip("resource", reason="limits a file's size, which needs POSIX")
pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="kills a process of its own, which needs fork")


@pytest.mark.parametrize("kills", [5, pytest.param(20, marks=pytest.mark.slow)])
def test_nothing_acknowledged_is_lost_when_the_writer_is_killed_and_when_its_log_is_cut_as_well(tmp_path, kills):
    chance = random.Random(1)
    most_safe = 0
    for run in range(kills):
        folder = tmp_path / str(run)

        def write(report, folder=folder):
            writer = new_writer(folder)
            for i in range(100_000):
                writer.readings(readings(50 * i, 50))
                if i % 3 == 0:
                    writer.event("scored", 1, {"score": float(i)})
                safe = writer.acknowledged
                report(safe.readings, safe.events)

        process, reading = fork(write)
        reports = kill_later(process, reading, chance.randrange(-1, 60), chance.uniform(0.0, 0.005))
        safe_readings, safe_events = (reports or [[0, 0]])[-1]
        most_safe = max(most_safe, safe_readings)
        if safe_events == 0 and not (folder / "session.sqlite").exists():
            continue
        try:
            recording = Recording.open(folder)
        except RecordingError:
            assert safe_events == 0
            continue
        block = recording.readings()
        assert len(block) >= safe_readings
        np.testing.assert_array_equal(block.raw, readings(0, len(block)).raw)
        assert len(recording.events) >= safe_events
        assert [event.data["score"] for event in recording.events] == [3.0 * i for i in range(len(recording.events))]

        log = folder / "session.sqlite-wal"
        if log.exists():
            content = log.read_bytes()
            log.write_bytes(content[: len(content) - min(chance.randrange(1, 200_000), len(content))])
            if log_tail(BytesIO(log.read_bytes())).commits == 0 and (folder / "session.sqlite").stat().st_size < 8192:
                continue  # the cut reached back to before the tables were there
            remainder = Recording.open(folder)
            sequence = remainder.readings().sequence.tolist()
            assert sequence == list(range(len(sequence)))
    assert most_safe > 0


@pytest.mark.parametrize("kills", [3, pytest.param(12, marks=pytest.mark.slow)])
def test_a_session_killed_at_any_moment_leaves_a_beginning_of_the_whole_session(tmp_path, kills):
    whole = Session(tmp_path / "whole").run()
    chance = random.Random(2)
    lengths = set()
    for run in range(kills):
        folder = tmp_path / str(run)
        process, reading = fork(partial(whole_session, folder))
        reports = kill_later(process, reading, chance.randrange(-1, len(whole.events)), chance.uniform(0.0, 0.005))
        safe = [line for line in reports if len(line) == 2]
        recording = Recording.open(folder)
        events = recording.events
        lengths.add(len(events))
        assert events == whole.events[: len(events)]
        block = recording.readings()
        assert block.raw.tobytes() == whole.readings().raw[: len(block)].tobytes()
        if safe:
            assert (len(block), len(events)) >= tuple(safe[-1])
        for record, original in zip(recording.trials, whole.trials, strict=True):
            assert record.score in (None, original.score)
    assert len(lengths) > kills / 3


def test_a_full_disk_gives_one_sentence_and_all_that_was_acknowledged_can_be_read(tmp_path):
    folder = tmp_path / "s"

    def write(report):
        resource.setrlimit(resource.RLIMIT_FSIZE, (600_000, 600_000))
        writer = new_writer(folder)
        try:
            for i in range(100_000):
                writer.readings(readings(50 * i, 50))
                safe = writer.commit()
                report(safe.readings)
        except RecordingError as error:
            report(str(error))
            writer.close()

    process, reading = fork(write)
    os.waitpid(process, 0)
    *safe, (sentence,) = read_reports(reading)
    (acknowledged,) = safe[-1]
    assert acknowledged > 500
    assert f"the first {acknowledged} readings and 0 events are safe; check the disk and its cable" in sentence
    recording = Recording.open(folder)
    assert recording.readings().sequence.tolist()[:acknowledged] == list(range(acknowledged))
    assert recording.losses[-1].startswith("the session has no end")


def test_a_disk_that_is_full_from_the_beginning_is_told_so_and_no_folder_is_left(tmp_path):
    def write(report):
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        try:
            new_writer(tmp_path / "s")
        except RecordingError as error:
            report(str(error))

    process, reading = fork(write)
    os.waitpid(process, 0)
    ((sentence,),) = read_reports(reading)
    assert "cannot be begun" in sentence
    assert list(tmp_path.iterdir()) == []
