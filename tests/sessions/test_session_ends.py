"""Every end of a session is written with its reason, and keeps what had come."""

import os
import signal
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import pytest
from recordings import record_session
from simulated_session import Session, once

from drivers.transducer import SetupError
from sessions.recording import Recording, RecordingError
from sessions.recording.archive import seal
from sessions.run.steps import Abort, AskMount, AskScore, AskStroke, MeasureZero


def assert_ended(recording, reason, cause):
    assert recording.events[-1].kind == "ended"
    assert recording.events[-1].data["reason"] == reason
    assert recording.events[-1].data["cause"] == cause
    assert recording.losses == ()


COMMANDS = [AskMount, MeasureZero, AskStroke, AskScore]


@pytest.mark.parametrize("at", COMMANDS)
def test_an_abort_in_any_state_ends_the_session_with_its_reason(tmp_path, at):
    session = Session(tmp_path / "s", instead={at: once(Abort("fire alarm"))})
    assert_ended(session.run(), "fire alarm", "aborted")
    assert not session.end.complete
    assert not session.transducer.streaming


@pytest.mark.parametrize("at", COMMANDS)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_termination_in_any_state_end_the_session_and_keep_all_of_it(tmp_path, at, number):
    session = Session(tmp_path / "s")
    before = signal.getsignal(number)

    def interrupt(_):
        os.kill(os.getpid(), number)
        session.heard_ns = session.clock.at_ns

    session.hands.instead[at] = interrupt
    recording = session.run()
    assert_ended(recording, "stopped by the user", "stopped")
    assert len(recording.readings()) == session.transducer.sent
    assert recording.events[-1].time_ns - session.heard_ns < 200_000_000
    assert signal.getsignal(number) == before


def test_a_stop_request_is_answered_within_a_fifth_of_a_second_of_session_time(tmp_path):
    session = Session(tmp_path / "s")
    stop_ns = session.clock.at_ns + 3_123_000_000
    recording = session.run(stop=lambda: ("stopped", "stopped by the user") if session.clock.at_ns >= stop_ns else None)
    assert_ended(recording, "stopped by the user", "stopped")
    assert recording.events[-1].time_ns - stop_ns < 200_000_000


def test_ctrl_c_while_a_device_does_not_answer_is_heard_at_once(tmp_path):
    session = Session(tmp_path / "s")
    session.transducer.start = lambda: os.kill(os.getpid(), signal.SIGINT)
    session.transducer.began_ns = session.clock.at_ns
    assert_ended(session.run(), "stopped by the user", "stopped")


def test_a_device_that_refuses_to_start_ends_the_session_with_what_it_says(tmp_path):
    session = Session(tmp_path / "s")

    def refuse():
        raise SetupError("it is streaming already; stop it before starting it again")

    session.transducer.start = refuse
    session.transducer.began_ns = session.clock.at_ns
    assert_ended(session.run(), "it is streaming already; stop it before starting it again", "device")
    assert session.end.readings == 0


def test_a_lost_link_ends_the_session_and_keeps_what_had_come(tmp_path):
    session = Session(tmp_path / "s", link_lost_after=1000)
    recording = session.run()
    assert_ended(recording, "the cable was pulled", "device")
    assert len(recording.readings()) == 1000
    assert recording.trials[0].outcome == "scored"


def test_an_error_in_the_operators_program_is_written_down_and_raised(tmp_path):
    def fail(_):
        raise RuntimeError("no screen")

    session = Session(tmp_path / "s", instead={AskStroke: fail})
    with pytest.raises(RuntimeError, match="no screen"):
        session.run()
    assert_ended(Recording.open(session.folder), "RuntimeError: no screen", "program")


def test_an_interrupted_take_is_kept_as_one_that_does_not_count(tmp_path):
    recording = Session(tmp_path / "s", instead={AskScore: once(Abort("ill"))}).run()
    record = recording.trials[0]
    assert (record.outcome, record.take) == ("open", None)
    assert record.other_takes[0].discard_reason == "ill"


def test_a_session_whose_end_cannot_be_written_lets_go_of_its_file(tmp_path):
    session = Session(tmp_path / "s")
    write = session.writer.event

    def full(kind, *arguments, **options):
        if kind == "ended":
            raise RecordingError("the disk took no more")
        return write(kind, *arguments, **options)

    session.writer.event = full
    with pytest.raises(RecordingError, match="the disk took no more"):
        session.run()
    seal(tmp_path / "s")  # refused while anybody has it open
    assert Recording.open(tmp_path / "s").end is None


def test_a_session_that_ends_while_it_is_opened_is_read(tmp_path):
    folder = record_session(tmp_path / "s", blocks=2)
    log, over = folder / "session.sqlite-wal", Event()

    def toggle():  # as the recorder begins and ends: SQLite removes the log when its last connection closes
        while not over.is_set():
            log.write_bytes(bytes(32))
            log.unlink(missing_ok=True)

    with ThreadPoolExecutor(1) as pool:
        pool.submit(toggle)
        try:
            counts = {len(Recording.open(folder).readings()) for _ in range(100)}
        finally:
            over.set()
    assert counts == {200}
