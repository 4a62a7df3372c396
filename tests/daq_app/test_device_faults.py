"""What a session says of readings during a fault of the device or a jump of its counter, on a real run."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest
from hostile_devices import net_ft

from daq_app.cli.main import run
from daq_app.cli.verbs import devices
from daq_app.recorder.messages import HealthReport
from daq_app.simulation import wiring
from daq_app.simulation.wiring import connect
from daq_app.window.state import AppState, BenchState, fold
from daq_app.window.view_bench import bench_view
from daq_app.wording import COUNT_LABELS
from drivers.clock import RealClock
from drivers.transducer import COUNTS, Health
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Recording, SessionWriter, provenance
from sessions.run.runner import run_session
from simulators.faults import Fault, Faults
from simulators.net_ft_box import NetFtBox


class Nobody:
    """An operator who does nothing."""

    def show(self, command):
        """Take it."""

    def poll(self):
        """Say nothing."""
        return ()


@pytest.fixture
def record_faults(tmp_path, monkeypatch):
    """Return a function that records two seconds of a box on which this goes wrong, and the end of the session."""

    def record(*faults):
        monkeypatch.setattr(wiring, "NetFtBox", partial(NetFtBox, faults=Faults(faults)))
        clock, folder = RealClock(), tmp_path / "session"
        session_plan = plan(protocol("sensotact-friction"), "P01", 1)
        with connect("sim:?seed=3", clock) as bench:
            writer = SessionWriter.create(
                folder, session_plan, bench.transducer.info, provenance(clock), subject_simulated=True, clock=clock
            )
            until = clock.now_ns() + 2_500_000_000

            def stop():
                return ("stopped", "the test is over") if clock.now_ns() > until else None

            end = run_session(session_plan, writer, Nobody(), bench.transducer, stop=stop)
        return folder, end

    return record


def test_a_fault_of_the_device_is_named_in_health_events_and_by_verify(record_faults, capsys):
    folder, end = record_faults(Fault("status", 0.0, 1e6, status=0x80000100))
    words = "gauge excitation current too low"
    assert end.health.doubtful == end.health.flagged[words] == end.readings > 0
    recording = Recording.open(folder)
    first = next(event for event in recording.events if event.kind == "losses")
    assert words in first.data["flagged"]
    assert words in first.data["sentence"]
    block = recording.readings()
    assert np.all(block.status == 0x80000100), "recorded as the device sent it"
    assert (first.time_ns - int(block.received_ns[0])) * 1e-9 < 1.0
    assert run(["verify", str(folder), "--json"]) == 3
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert any(problem.startswith(f"device_fault: {len(block)} readings") and words in problem for problem in problems)


def test_a_session_in_which_the_units_change_ends_and_names_the_readings_in_doubt(record_faults, capsys):
    folder, end = record_faults(Fault("units", 1.0, 1e6, share=1e-6))
    assert end.cause == "device"
    assert "counts in other units than before" in end.reason
    assert end.health.off_units > 0
    assert run(["verify", str(folder), "--json"]) == 3
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert any(f"the last {end.health.off_units} readings" in problem for problem in problems)


OPEN = AppState(bench=BenchState(link="open"))


def test_the_window_names_a_fault_of_the_device():
    health = Health(received=200, doubtful=200, flagged={"gauge excitation current too low": 200})
    report = HealthReport(health, 200.0, (0.0,) * 7, (0.0,) * 7, 200)
    view = bench_view(fold(OPEN, report).bench, recording=True)
    assert view.lamp == "wrong"
    assert "gauge excitation current too low" in view.lamp_text
    assert ("doubtful", "200") in view.counters


def test_every_count_of_a_transducer_s_health_is_shown_in_words():
    assert set(COUNT_LABELS) == {"received", *COUNTS}
    report = HealthReport(Health(received=200, off_units=12), 200.0, (0.0,) * 7, (0.0,) * 7, 0)
    view = bench_view(fold(OPEN, report).bench, recording=True)
    assert view.lamp_text == "12 in other units"
    assert "_" not in "".join(name for name, _ in view.counters)


def test_a_probe_prints_the_counts_in_words(capsys, monkeypatch):
    monkeypatch.setattr(devices, "PROBED", 0.2)
    assert run(["devices", "probe", "sim:"]) == 0
    assert ", in other units 0, rate changes 0, lag " in capsys.readouterr().out


@pytest.mark.skipif(os.name != "posix", reason="signals reach a process otherwise on this system")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_within_a_second_while_its_transducer_sends_no_reading(number, tmp_path):
    device = net_ft(bytes(35))
    command = ["run", "sensotact-friction", "--device", device.uri, "--subject", "P01", "--headless", "--any-folder"]
    command += ["--out", str(tmp_path / "session")]
    child = subprocess.Popen([sys.executable, "-m", "daq_app", *command], stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        while not device.stream_request.wait(0.1):
            assert child.poll() is None, child.stderr.read()
        start = time.monotonic()
        child.send_signal(number)
        child.communicate(timeout=20)
        elapsed_s = time.monotonic() - start
    finally:
        child.kill()
        child.communicate()
        device.close()
    assert elapsed_s < 1.0
    assert child.returncode == 130
