"""The driver on NI-DAQmx, handed a library that stands in for NI's, with the simulated bench behind it."""

import threading
import types

import numpy as np
import pytest

from drivers.address import parse_address
from drivers.clock import RealClock
from drivers.nidaq import device
from drivers.nidaq.device import identify_nidaq, open_nidaq
from drivers.readings import ReadingBlock
from drivers.transducer import SetupError
from simulators.bench import RATED, Bench
from simulators.gauges import FT32831

CAL = """<?xml version="1.0"?><FTSensor Serial="SIM00003" BodyStyle="Nano43" Family="DAQ" NumGages="6"
CalFileVersion="1.0"><Calibration PartNumber="SI-36-0.5" CalDate="12/14/2020" ForceUnits="N"
TorqueUnits="N-mm" DistUnits="mm" OutputMode="Ground Referenced Differential" OutputRange="20">{axes}
</Calibration></FTSensor>"""


class DaqError(Exception):
    """What NI's library raises."""


class StandIn(types.SimpleNamespace):
    """As much of NI's library as the driver uses; its clock gives 1000.5 Hz where 1000 is asked."""

    DaqError = DaqError

    def __init__(self, clock):
        constants = types.SimpleNamespace(
            READ_ALL_AVAILABLE=-1,
            TerminalConfiguration=types.SimpleNamespace(DIFF="diff"),
            AcquisitionType=types.SimpleNamespace(CONTINUOUS="continuous"),
        )
        device = types.SimpleNamespace(name="Dev1", product_type="USB-6218", serial_num=0x1A2B3C, is_simulated=True)
        local = types.SimpleNamespace(devices=[device])
        system = types.SimpleNamespace(System=types.SimpleNamespace(local=lambda: local))
        super().__init__(constants=constants, system=system)
        self.clock, self.bench, self.gauges = clock, Bench(3), np.linalg.inv(FT32831)
        self.open, self.asked, self.fail_after = 0, [], None

    def Task(self):  # noqa: N802 - NI's name
        return _Task(self)


class _Task:
    def __init__(self, library):
        self.library, self.begun, self.given = library, None, 0
        library.open += 1
        self.ai_channels = types.SimpleNamespace(add_ai_voltage_chan=self._channels)
        self.timing = types.SimpleNamespace(cfg_samp_clk_timing=self._timing, samp_clk_rate=None)

    def _channels(self, name, **limits):
        self.library.asked.append((name, limits["terminal_config"], limits["min_val"], limits["max_val"]))

    def _timing(self, rate, **_):
        self.timing.samp_clk_rate = rate * 1.0005

    def start(self):
        self.begun = self.library.clock.now_ns()

    def stop(self):
        self.begun = None

    def close(self):
        self.library.open -= 1

    def read(self, number_of_samples_per_channel):
        assert number_of_samples_per_channel == -1
        if self.library.fail_after is not None and self.given > self.library.fail_after:
            self.library.fail_after = None
            raise DaqError("Attempted to read samples that are no longer available.\n\nTask Name: _unnamedTask<0>")
        due = int((self.library.clock.now_ns() - self.begun) * 1e-9 * self.timing.samp_clk_rate)
        times = np.arange(self.given, due) / self.timing.samp_clk_rate
        self.given = due
        volts = self.library.bench.wrench(times) @ self.library.gauges.T
        return volts.T.tolist()


@pytest.fixture
def library(monkeypatch):
    before = set(threading.enumerate())
    stand_in = StandIn(RealClock())
    monkeypatch.setattr(device, "library", lambda: stand_in)
    yield stand_in
    assert stand_in.open == 0, "an acquisition was left open"
    assert set(threading.enumerate()) <= before, "a thread was left running"


@pytest.fixture
def address(tmp_path):
    axes = "".join(
        f'<Axis Name="{name}" values="{" ".join(map(repr, row))}" max="{rated}" scale="1"/>'
        for name, row, rated in zip(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), FT32831.tolist(), RATED, strict=True)
    )
    (tmp_path / "SIM.cal").write_text(CAL.format(axes=axes))
    return parse_address(f"nidaq://Dev1?cal={tmp_path / 'SIM.cal'}")


def readings(transducer, count):
    blocks = []
    while sum(map(len, blocks)) < count:
        blocks.append(transducer.read(0.1))
    transducer.stop()
    return ReadingBlock.joined([*blocks, transducer.read(0.0)])


def test_it_says_who_it_is_and_at_which_rate_it_was_set(library, address):
    info = open_nidaq(address, RealClock()).info
    assert info.simulated
    assert info.serial == "SIM00003"
    assert info.rate == pytest.approx(1000.5)
    assert "1A2B3C" in info.settings["converter"]
    assert library.asked == [("Dev1/ai0:5", "diff", -10.0, 10.0)]
    assert identify_nidaq(address, 1.0).model == info.model


def test_its_readings_are_the_planted_wrench_at_the_rate_read_back(library, address):
    transducer = open_nidaq(address, RealClock())
    transducer.start()
    block = readings(transducer, 300)
    transducer.close()
    assert block.sequence.tolist() == list(range(1, len(block) + 1))
    np.testing.assert_allclose(np.diff(block.time), 1.0 / 1000.5, rtol=1e-9)
    wrench = transducer.info.calibration.wrench(block.raw, np.zeros(6))
    np.testing.assert_allclose(wrench, library.bench.wrench(block.time), atol=1e-9)
    assert transducer.health.lost == transducer.health.saturated == 0


def test_an_overflow_in_the_library_is_a_gap_and_the_stream_goes_on(library, address):
    transducer = open_nidaq(address, RealClock())
    library.fail_after = 100
    transducer.start()
    block = readings(transducer, 400)
    health = transducer.health
    transducer.close()
    assert health.restarted == 1
    assert health.lost >= 1
    assert health.received + health.lost == block.sequence[-1]
    assert np.all(np.diff(block.time) > 0)


@pytest.mark.usefixtures("library")
def test_an_unknown_device_and_a_missing_library_are_told_in_one_sentence(address, monkeypatch):
    with pytest.raises(SetupError, match="there is no device dev7; NI-DAQmx knows Dev1"):
        open_nidaq(parse_address(address.uri.replace("Dev1", "Dev7")), RealClock())
    with pytest.raises(SetupError, match="write nidaq://Dev1"):
        open_nidaq(parse_address("nidaq://Dev1"), RealClock())
    monkeypatch.undo()
    monkeypatch.setitem(__import__("sys").modules, "nidaqmx.constants", None)
    with pytest.raises(SetupError, match="pip install"):
        open_nidaq(address, RealClock())
