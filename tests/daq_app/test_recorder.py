"""The recorder's process, driven through its client."""

import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from desk import DEADLINE, PACE, SHORT, Desk

from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import (
    REPORTS,
    REQUESTS,
    Codec,
    Connect,
    Device,
    Failed,
    Gone,
    HealthReport,
    Live,
    NoDevice,
    People,
    ResumeSession,
    Sealed,
    SessionBegun,
    SessionEnded,
    StartSession,
    Stop,
    Tare,
    Tared,
)
from sessions.recording import LoggedEvent, Recording
from sessions.recording.schema import LIVE_FILE
from sessions.run.runner import Status
from sessions.run.steps import (
    AskMount,
    AskStroke,
    MeasureZero,
    Refuse,
    StimulusMounted,
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A bench session from connecting to sealing: a simulated hand strokes, people do the rest."""
    folder = tmp_path_factory.mktemp("recorder") / "whole"
    with Recorder.start(PACE) as recorder:
        desk = Desk(recorder)
        recorder.send(Tare())
        desk.until(Failed)
        recorder.send(Connect("sim:?seed=7"))
        desk.until(Device)
        listening = sockets_of(recorder.pid)
        recorder.send(Tare(2.0))
        desk.until(Tared)
        desk.until(Live)
        recorder.send(StartSession(SHORT, str(folder), People("simulated hand", 7)))
        desk.until(AskStroke)
        recorder.send(Tare())
        recorder.send(StimulusMounted("nonsense"))
        desk.until(Sealed)
        desk.until(HealthReport, 2)
    desk.until(Gone)
    return desk, Recording.open(folder), listening


def test_a_session_run_through_the_recorder_is_whole_and_sealed(whole):
    desk, recording, _ = whole
    assert recording.losses == recording.flaws == ()
    assert [record.score for record in recording.trials] == [trial.stimulus.index for trial in SHORT.trials]
    end = desk.of(SessionEnded)[0]
    assert (end.end.cause, end.end.complete, end.resumable) == ("finished", True, False)
    assert (recording.folder / "MANIFEST.json").exists()
    assert desk.of(Gone)[0].requested


def test_the_client_is_told_every_event_of_the_log_once_it_is_safe(whole):
    desk, recording, _ = whole
    assert tuple(desk.of(LoggedEvent)) == recording.events
    order = [report for report in desk.reports if isinstance(report, LoggedEvent | AskStroke | MeasureZero)]
    for before, after in itertools.pairwise(order):
        if isinstance(after, AskStroke):
            assert before.kind == "stroke_asked"


def test_the_lamp_is_fed_by_what_the_disk_has_acknowledged(whole):
    desk, recording, _ = whole
    statuses = desk.of(Status)
    assert statuses[-1].safe.readings <= len(recording.readings())
    assert max(status.safe.events for status in statuses) > 9 * len(SHORT.trials)
    assert all(status.safe.readings <= status.readings for status in statuses)


def test_every_reading_is_shown_live_as_it_is_recorded(whole):
    desk, recording, _ = whole
    live = [report for report in desk.of(Live) if report.stream == 2]
    sequence = np.concatenate([report.sequence for report in live])
    block = recording.readings()
    assert sum(report.left_out for report in live) == 0
    np.testing.assert_array_equal(sequence, block.sequence[: len(sequence)])
    assert len(sequence) > 0.99 * len(block)
    zero = np.array(live[-1].zero)
    assert zero.tolist() == [e for e in recording.events if e.kind == "zeroed"][-1].data["mean"]
    n = len(live[-1].wrench)
    wrench = recording.info.calibration.wrench(block.raw[len(sequence) - n : len(sequence)], zero)
    np.testing.assert_allclose(live[-1].wrench, wrench, rtol=0, atol=1e-9)


def test_the_bench_is_shown_before_and_after_a_session_with_its_own_zero(whole):
    desk, _, _ = whole
    assert {report.stream for report in desk.of(Live)} == {1, 2, 3}
    tare = desk.of(Tared)[0]
    assert tare.duration == pytest.approx(2.0, abs=0.006)  # a reading's step, by a counter good to 0.5 %
    assert tare.spread[2] == pytest.approx(4000, rel=0.4)  # simulated: 4 mN, in counts of 1 µN
    before = [report for report in desk.of(Live) if report.stream == 1 and report.zero == tare.mean]
    assert np.abs(np.concatenate([report.wrench[:, 2] for report in before])).max() < 0.05


def test_what_is_not_for_now_is_refused_with_a_sentence(whole):
    desk, _, _ = whole
    first, second = desk.of(Failed)
    assert (first.request, first.sentence[:24]) == ("Tare", "no transducer is connect")
    assert (second.request, second.sentence[:20]) == ("Tare", "a session is running")
    assert "a mounted stimulus is not possible now" in desk.of(Refuse)[0].sentence


@pytest.mark.skipif(not Path("/proc/net/udp").exists(), reason="looks sockets up where Linux tells of them")
def test_nothing_listens_but_the_simulated_box_on_loopback(whole):
    _, _, listening = whole
    assert listening
    assert {address for address in listening if not address.startswith("0100007F")} == set()
    with Recorder.start() as recorder:
        Desk(recorder).until(HealthReport)
        assert sockets_of(recorder.pid) == []


def sockets_of(pid):
    """Return the local addresses of a process's sockets, as Linux writes them."""
    if not Path("/proc/net/udp").exists():
        return []
    inodes = set()
    for link in Path(f"/proc/{pid}/fd").iterdir():
        try:
            target = str(link.readlink())
        except FileNotFoundError:  # a file that was closed since the folder was listed
            continue
        if target.startswith("socket:["):
            inodes.add(target[8:-1])
    addresses = []
    for table in ("tcp", "udp", "tcp6", "udp6"):
        path = Path(f"/proc/net/{table}")
        rows = path.read_text().splitlines()[1:] if path.exists() else []
        addresses += [row.split()[1] for row in rows if row.split()[9] in inodes]
    return addresses


def start_stroke(desk, folder, people="simulated hand"):
    """Have a session running, and return once its first stroke is felt."""
    desk.begin(folder, people)
    while desk.until(LoggedEvent).kind != "contact_onset":
        pass


def wait_for(folder, holds):
    deadline = time.monotonic() + DEADLINE
    while not holds(Recording.open(folder)):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_client_that_goes_leaves_a_session_recorded_until_the_lift_which_a_new_one_resumes(tmp_path):
    folder = tmp_path / "s"
    first = Recorder.start(PACE)
    start_stroke(Desk(first), folder)
    first.leave()
    wait_for(folder, lambda recording: recording.end is not None)
    before = Recording.open(folder)
    kinds = [event.kind for event in before.events]
    assert kinds[-2:] == ["take_discarded", "ended"]
    assert kinds.index("finger_lifted") > kinds.index("contact_onset")
    assert (before.end["cause"], before.end["complete"]) == ("client", False)
    assert len(before.readings()) == before.end["readings"]
    with Recorder.start(PACE) as second:
        desk = Desk(second)
        second.send(ResumeSession(str(folder)))  # device and people are those it began with
        report = desk.until(SessionBegun)
        assert report.events == before.events
        assert desk.until(AskMount).trial.number == 1
        second.send(Stop())
        assert desk.until(SessionEnded).end.cause == "stopped"
    after = Recording.open(folder)
    assert after.events[: len(before.events)] == before.events


def test_a_session_begun_after_one_that_was_resumed_has_readings_and_events_by_one_clock(tmp_path):
    first = Recorder.start(PACE)
    start_stroke(Desk(first), tmp_path / "s")
    first.leave()
    wait_for(tmp_path / "s", lambda recording: recording.end is not None)
    with Recorder.start(PACE) as second:
        desk = Desk(second)
        second.send(ResumeSession(str(tmp_path / "s")))
        desk.until(AskMount)
        second.send(Stop())
        desk.until(Sealed)
        second.send(StartSession(SHORT, str(tmp_path / "next"), People("simulated hand", 7)))
        desk.until(Sealed)
    recording = Recording.open(tmp_path / "next")
    received_ns = recording.readings().received_ns
    assert recording.events[0].time_ns <= received_ns[0]
    assert received_ns[-1] <= recording.events[-1].time_ns


@pytest.mark.skipif(os.name != "posix", reason="kill -9 needs POSIX")
def test_a_recorder_that_is_killed_has_lost_nothing_it_told_of_and_its_session_goes_on(tmp_path):
    folder = tmp_path / "s"
    with Recorder.start(PACE) as first:
        desk = Desk(first)
        start_stroke(desk, folder)
        with Recorder.start(PACE) as another:
            another.send(ResumeSession(str(folder)))
            sentence = Desk(another).until(Failed).sentence
            assert f"{folder / LIVE_FILE} is in use" in sentence
            assert "lifted, after 10 s at most: then try again" in sentence
        os.kill(first.pid, signal.SIGKILL)
        report = desk.until(Gone)
    assert not report.requested
    assert "signal 9" in report.sentence
    assert "resume the session" in report.sentence
    events = desk.of(LoggedEvent)
    before = Recording.open(folder)
    assert list(before.events[: len(events)]) == events
    assert len(before.readings()) >= max(status.safe.readings for status in desk.of(Status))
    with Recorder.start(PACE) as second:
        desk = Desk(second)
        second.send(ResumeSession(str(folder), people=People("simulated people", 7)))
        end = desk.until(SessionEnded)
        desk.until(Sealed)
    assert end.end.complete
    assert all(record.outcome == "scored" for record in Recording.open(folder).trials)


def test_a_client_that_fetches_nothing_holds_up_nothing(tmp_path):
    folder = tmp_path / "s"
    recorder = subprocess.Popen(
        [sys.executable, "-m", "daq_app.recorder", "20"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    codec = Codec(REQUESTS)
    recorder.stdin.write(codec.encode(Connect("sim:?seed=7")))
    recorder.stdin.write(codec.encode(StartSession(SHORT, str(folder), People("simulated people", 7))))
    recorder.stdin.flush()
    deadline = time.monotonic() + 2 * DEADLINE
    while not (folder / "MANIFEST.json").exists():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    recording = Recording.open(folder)
    assert recording.end["complete"]
    assert recording.losses == ()
    recorder.stdin.close()
    reports = list(Codec(REPORTS).read(recorder.stdout))
    recorder.stdout.close()
    assert recorder.wait() == 0
    assert tuple(report for report in reports if isinstance(report, LoggedEvent)) == recording.events
    live = [report for report in reports if isinstance(report, Live) and report.stream == 1]
    assert sum(len(report.sequence) for report in live) < len(recording.readings())


def test_a_stop_with_nothing_in_hand_changes_nothing_and_during_a_tare_ends_that():
    with Recorder.start() as recorder:
        desk = Desk(recorder)
        recorder.send(Stop())
        recorder.send(Connect("sim:?seed=7"))
        desk.until(Device)
        recorder.send(Tare(60.0))
        recorder.send(Stop())
        assert desk.until(Failed).sentence == "the zero was not measured: stopped by the user"
        desk.until(Live)


def test_a_stop_breaks_off_a_connection_that_does_not_come_about():
    with socket.create_server(("127.0.0.1", 0)) as silent, Recorder.start() as recorder:
        desk = Desk(recorder)
        recorder.send(Connect(f"net-ft://127.0.0.1?http={silent.getsockname()[1]}"))
        silent.settimeout(DEADLINE)
        caller, _ = silent.accept()  # it waits for an answer now
        recorder.send(Stop())
        failure = desk.until(Failed)
        caller.close()
    assert failure.request == "Connect"
    assert failure.sentence.endswith("stopped by the user")
    assert not desk.of(NoDevice)


def test_a_session_whose_folder_is_removed_stops_within_seconds_and_goes_on_in_the_folder_it_names(tmp_path):
    folder = tmp_path / "s"
    with Recorder.start(PACE) as recorder:
        desk = Desk(recorder)
        desk.begin(folder)
        desk.until(AskStroke)
        shutil.rmtree(folder)
        report = desk.until(SessionEnded)
        rescue_folder = Path(report.folder)
        assert rescue_folder == tmp_path / "s-rescued"
        assert (report.end.cause, report.resumable) == ("disk", True)
        assert str(rescue_folder) in report.end.reason
        assert desk.of(LoggedEvent) == list(Recording.open(rescue_folder).events)
        recorder.send(ResumeSession(str(rescue_folder)))
        desk.until(Sealed)
    assert {record.outcome for record in Recording.open(rescue_folder).trials} == {"scored"}
    assert not folder.exists()
