"""What the drivers on serial lines do beyond what every driver does (test_driver_contract), over real ports."""

import os
import re
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driver_courses import retry_if_interrupted
from reading import read_until

from drivers import digital_ft as digital_ft_device
from drivers import serial_ft as serial_ft_device
from drivers.address import parse_address
from drivers.clock import Clock, PacedClock
from drivers.deadline import Deadline
from drivers.digital_ft import identify_digital_ft, open_digital_ft
from drivers.readings import ReadingBlock
from drivers.serial_ft import identify_serial_ft, open_serial_ft
from drivers.serial_link import port_of
from drivers.transducer import DeviceFault, LinkLost, SetupError
from simulators.bench import Bench
from simulators.digital_ft_box import DigitalFtBox
from simulators.faults import Fault, Faults
from simulators.serial_ft_box import SerialFtBox
from simulators.stroke import paper_surfaces

pytestmark = pytest.mark.skipif(os.name != "posix", reason="there are no pseudo-terminals on this system")

FACTOR = 2.0


@dataclass
class SimulatedDevice:
    """A simulated device: where it is, how to open it, what it feels, its clock, and how to switch it off."""

    uri: str
    open_function: Any
    identify_function: Any
    bench: Bench
    clock: Clock
    box: Any

    def open(self, options=""):
        return self.open_function(parse_address(self.uri + options), self.clock, Deadline.for_opening())

    def last_arrival(self, block):
        """When the last reading arrived, on the bench's clock."""
        return self.box.now() + (block.received_ns[-1] - self.clock.now_ns()) * 1e-9 if len(block) else 0.0

    def identify(self):
        return self.identify_function(parse_address(self.uri), Deadline(1.0))


def serial_ft(form="binary"):
    bench, clock = Bench(3), PacedClock(FACTOR)
    box = SerialFtBox(bench, clock, baud=115200 if form == "ascii" else 38400)
    box.start()
    return SimulatedDevice(f"{box.uri}&format={form}", open_serial_ft, identify_serial_ft, bench, clock, box)


def digital_ft(**settings):
    bench, clock = Bench(3), PacedClock(1.0)
    box = DigitalFtBox(bench, clock, **settings)
    box.start()
    return SimulatedDevice(box.uri, open_digital_ft, identify_digital_ft, bench, clock, box)


WIRES = {"serial-ft": serial_ft, "digital-ft": digital_ft}


def open_files():
    return len(list(Path("/dev/fd").iterdir()))


@pytest.fixture(params=WIRES)
def simulator(request, monkeypatch):
    """Return a function that starts the simulator. The stream is watched for its rate only as long as a test needs."""
    monkeypatch.setattr(serial_ft_device, "_MEASURED", 0.25)
    monkeypatch.setattr(digital_ft_device, "_MEASURED", 0.15)
    threads_before, files_before = set(threading.enumerate()), open_files()
    devices = []

    def start():
        devices.append(WIRES[request.param]())
        return devices[-1]

    yield start
    for device in devices:
        device.box.close()
    assert set(threading.enumerate()) <= threads_before, "a thread was left running"
    assert open_files() <= files_before, "a port was left open"


def readings(device, transducer, end):
    """Return what comes until so many seconds of the bench's time, and the rest after a stop."""
    return read_until(transducer, lambda: device.box.now() >= end)


FAULTS = {  # what a line without numbers and clock can show of each
    "shorten": lambda health: health.malformed > 0,
    "reboot": lambda health: health.restarted >= 1 and health.lost > 0,
}


@pytest.mark.parametrize("kind", FAULTS)
def test_a_controller_that_sends_text_survives_too(kind):
    device = serial_ft("ascii")
    try:
        check_survival(device, kind)
    finally:
        device.box.close()


def check_survival(device, kind):
    transducer = device.open()
    transducer.start()
    begin = device.box.now() + 0.3
    end = begin + (0.8 if kind == "reboot" else 0.4) * device.clock.factor
    share = 0.05 if kind == "shorten" else 1.0
    device.box.faults = Faults([Fault(kind, begin, end, share=share)], seed=1)
    block, deadline = ReadingBlock.empty(), end + 20.0 * device.clock.factor
    while (device.last_arrival(block) < end + 0.3) and device.box.now() < deadline:
        block = ReadingBlock.concatenate([block, transducer.read(0.1)])
    transducer.stop()
    block = ReadingBlock.concatenate([block, transducer.read(0.0)])
    health = transducer.health
    transducer.close()
    assert device.last_arrival(block) > end, "it did not go on after the fault"
    assert FAULTS[kind](health), health
    assert health.received == len(block)
    assert health.received + health.lost == block.sequence[-1]
    assert np.all(np.diff(block.sequence) >= 1)
    assert np.all(np.diff(block.time) > 0.0)
    # None of the formats can show every change of a byte, and the binary one of the controller not every loss either.
    wrench = transducer.info.calibration.wrench(block.raw[block.status == 0], np.zeros(6))
    wrong = int(np.count_nonzero((np.abs(wrench[:, :3]) > 0.1).any(axis=1) | (np.abs(wrench[:, 3:]) > 1.0).any(axis=1)))
    assert wrong <= (0.2 * health.malformed + 2 if kind == "shorten" else 0)


def test_a_stop_ends_even_a_device_that_is_being_brought_back(simulator):
    device = simulator()
    transducer = device.open()
    transducer.start()
    device.box.faults = Faults([Fault("reboot", 0.0, 1e9)])
    while len(transducer.read(0.5 * device.clock.factor)):
        pass
    transducer.close()
    assert transducer.health.received > 0


def test_the_baud_rate_of_a_controller_is_found_by_trying():
    clock = PacedClock(FACTOR)
    box = SerialFtBox(Bench(1), clock, baud=19200)
    box.start()
    try:
        uri = box.uri.replace("baud=19200&", "")

        transducers: list[Any] = []

        def run():
            while transducers:
                transducers.pop().close()
            transducers.append(open_serial_ft(parse_address(uri), clock, Deadline.for_opening()))
            return transducers[0]

        transducer = retry_if_interrupted(
            run, lambda candidate: candidate.info.rate == pytest.approx(19200 / 130, rel=0.05)
        )
        assert transducer.info.settings["baud"] == "19200, found by trying"
        assert transducer.info.rate == pytest.approx(19200 / 130, rel=0.05)
        with pytest.raises(LinkLost, match="tried 9600 baud"):
            open_serial_ft(parse_address(uri + "&baud=9600"), clock, Deadline.for_opening())
    finally:
        box.close()


def test_a_transducer_left_streaming_is_stopped_when_it_is_opened_and_left_alone_when_it_is_looked_for():
    device = digital_ft(streaming=True)
    try:
        with pytest.raises(LinkLost, match="it streams, and nobody reads"):
            device.identify()
        transducer = device.open()
        assert transducer.info.serial == "SIM00003"
        transducer.close()
    finally:
        device.box.close()


def test_an_empty_calibration_is_refused_by_its_number():
    device = digital_ft()
    try:
        with pytest.raises(SetupError, match="calibration 2 holds no serial number"):
            device.open("&calibration=2")
        with pytest.raises(SetupError, match="calibration=17"):
            device.open("&calibration=17")
    finally:
        device.box.close()


def test_another_transducer_on_the_same_line_is_not_read():
    device = digital_ft()
    transducer = device.open()
    other_box = DigitalFtBox(Bench(4), device.clock)
    other_box.start()
    try:
        path = Path(port_of(parse_address(device.uri)))
        path.unlink()
        path.symlink_to(Path(port_of(parse_address(other_box.uri))).readlink())
        with pytest.raises(DeviceFault, match="transducer SIM00004 answers where SIM00003 was"):
            transducer.start()
    finally:
        transducer.close()
        other_box.close()
        device.box.close()


def test_the_bias_of_a_controller_is_dropped_so_that_raw_stays_raw():
    device = serial_ft()
    device.bench.mount(paper_surfaces()["stickiness", 80])
    device.box._biases.append(np.full(6, 5.0))
    transducer = device.open()
    newtons, newton_metres = (float(re.search(rf"{name}=([\d.]+)", device.uri)[1]) for name in ("range_N", "range_Nm"))
    assert transducer.info.calibration.rated == pytest.approx([newtons] * 3 + [1000.0 * newton_metres] * 3)
    transducer.start()
    block = readings(device, transducer, device.box.now() + 0.5)
    transducer.close()
    device.box.close()
    assert np.abs(transducer.info.calibration.wrench(block.raw, np.zeros(6))[:, :3]).max() < 0.1
    assert "dropped" in transducer.info.settings["bias"]


def test_times_follow_the_bench_though_the_rate_is_half_a_percent_off():
    def run():
        device = digital_ft(rate_error=0.005)
        transducer = device.open()
        transducer.start()
        block = readings(device, transducer, device.box.now() + 2.0)
        transducer.close()
        device.box.close()
        return transducer, block

    # again where a busy machine lost readings, as a faulty driver always does
    transducer, block = retry_if_interrupted(run, lambda result: result[0].health.lost == 0)
    assert transducer.info.rate == 7000.0
    assert transducer.health.lost == 0
    half = len(block) // 2
    assert (block.time[-1] - block.time[half]) * 7035.0 == pytest.approx(len(block) - 1 - half, rel=0.01)
