"""The driver on NI-DAQmx, handed a library that stands in for NI's, with the simulated bench behind it."""

import sys
import threading

import numpy as np
import pytest
from reading import read_until

from drivers.address import parse_address
from drivers.clock import RealClock
from drivers.deadline import Deadline
from drivers.nidaq import identify_nidaq, open_nidaq
from drivers.transducer import SetupError
from simulators.bench import Bench, calibration_file
from simulators.faults import Fault
from simulators.nidaq_library import SimulatedNidaqmx


@pytest.fixture
def library():
    before = set(threading.enumerate())
    stand_in = SimulatedNidaqmx(Bench(3), RealClock())
    stand_in.install()
    yield stand_in
    stand_in.remove()
    assert stand_in.open_tasks == 0, "an acquisition was left open"
    assert set(threading.enumerate()) <= before, "a thread was left running"


@pytest.fixture
def address(tmp_path):
    return parse_address(f"nidaq://Dev1?cal={calibration_file(tmp_path, 'SIM00003')}")


def readings(transducer, count):
    return read_until(transducer, lambda: transducer.health.received >= count)


def test_it_says_who_it_is_and_at_which_rate_it_was_set(library, address):
    info = open_nidaq(address, RealClock(), Deadline.for_opening()).info
    assert info.simulated
    assert info.serial == "SIM00003"
    assert info.rate == pytest.approx(1000.5)
    assert "1A2B3C" in info.settings["converter"]
    assert library.requests == [("Dev1/ai0:5", "diff", -10.0, 10.0)]
    assert info.settings["gauges"] == "six differential pairs from ai0 on, -10 to 10 V, as read back"
    assert identify_nidaq(address, Deadline(1.0)).model == info.model


def test_a_device_that_takes_another_range_than_asked_is_refused(library, address):
    library.range = (-5.0, 5.0)
    with pytest.raises(SetupError, match="-10 to 10 V was requested from Dev1, which set -5 to 5 V"):
        open_nidaq(address, RealClock(), Deadline.for_opening())


def test_its_readings_are_the_simulated_wrench_at_the_rate_read_back(library, address):
    transducer = open_nidaq(address, RealClock(), Deadline.for_opening())
    transducer.start()
    block = readings(transducer, 300)
    transducer.close()
    assert block.sequence.tolist() == list(range(1, len(block) + 1))
    np.testing.assert_allclose(np.diff(block.time), 1.0 / 1000.5, rtol=1e-9)
    wrench = transducer.info.calibration.wrench(block.raw, np.zeros(6))
    np.testing.assert_allclose(wrench, library.bench.wrench(library.starts[-1] + block.time), atol=1e-9)
    assert transducer.health.lost == transducer.health.saturated == 0


def test_an_overflow_in_the_library_is_a_gap_and_the_stream_goes_on(library, address):
    transducer = open_nidaq(address, RealClock(), Deadline.for_opening())
    library.faults.put(Fault("lose", library.now() + 0.1, library.now() + 0.15))
    transducer.start()
    block = readings(transducer, 400)
    health = transducer.health
    transducer.close()
    assert health.restarted >= 1
    assert health.lost >= 50
    assert health.received + health.lost == block.sequence[-1]
    assert np.all(np.diff(block.time) > 0)


def test_an_unknown_device_and_a_missing_library_are_reported_in_one_sentence(library, address, monkeypatch):
    with pytest.raises(SetupError, match="there is no device dev7; NI-DAQmx knows Dev1"):
        open_nidaq(parse_address(address.uri.replace("Dev1", "Dev7")), RealClock(), Deadline.for_opening())
    with pytest.raises(SetupError, match="write nidaq://Dev1"):
        open_nidaq(parse_address("nidaq://Dev1"), RealClock(), Deadline.for_opening())
    library.remove()
    monkeypatch.setitem(sys.modules, "nidaqmx.constants", None)
    with pytest.raises(SetupError, match="pip install"):
        open_nidaq(address, RealClock(), Deadline.for_opening())
