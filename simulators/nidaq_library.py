"""The part of NI's library that a driver uses, with a simulated bench on the device's inputs, without NI's driver.

Names and behaviour follow the public package nidaqmx; the device's clock is wrong by 0.05 %.
"""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from drivers.clock import Clock
from simulators.bench import FT32831, Bench, calibration_file
from simulators.faults import Faults
from simulators.simulator import RunningSimulator, Simulator, stopwatch, unplug

ACTUAL = 1.0005  # rate of the device's clock over the requested one [-]
OVERFLOW = "The application is not able to keep up with the hardware acquisition.\n\nTask Name: _unnamedTask<0>"
_ABSENT = "Device identifier is invalid, or the device was removed.\n\nTask Name: _unnamedTask<0>"
_MODULES = ("nidaqmx", "nidaqmx.constants", "nidaqmx.system")


class DaqError(Exception):
    """The exception of NI's library."""


class SimulatedNidaqmx(ModuleType):
    """The library with one simulated device, Dev1. Its time and the bench's begin at its creation."""

    DaqError = DaqError

    def __init__(self, bench: Bench, clock: Clock, faults: Faults | None = None) -> None:
        super().__init__("nidaqmx")
        self.constants = SimpleNamespace(
            READ_ALL_AVAILABLE=-1,
            TerminalConfiguration=SimpleNamespace(DIFF="diff"),
            AcquisitionType=SimpleNamespace(CONTINUOUS="continuous"),
        )
        device = SimpleNamespace(name="Dev1", product_type="USB-6218", serial_num=0x1A2B3C, is_simulated=True)
        local = SimpleNamespace(devices=[device])
        self.system = SimpleNamespace(System=SimpleNamespace(local=lambda: local))
        self.bench = bench
        self.faults = faults or Faults()
        self.gauges = np.linalg.inv(FT32831)  # V per N or N mm
        self.open_tasks = 0
        self.starts: list[float] = []  # start times of acquisitions [s]
        self.range = (-10.0, 10.0)  # of the device, independent of the request [V]
        self.requests: list[tuple[Any, ...]] = []  # channels, terminals and limits
        self.now = stopwatch(clock)  # time of the device and the bench [s]
        self._previous_modules: dict[str, ModuleType] = {}

    def install(self) -> None:
        """Install it as the module `nidaqmx`."""
        self._previous_modules = {name: sys.modules[name] for name in _MODULES if name in sys.modules}
        sys.modules.update({name: self if "." not in name else ModuleType(name) for name in _MODULES})

    def remove(self) -> None:
        """Undo `install`."""
        for name in _MODULES:
            sys.modules.pop(name, None)
        sys.modules.update(self._previous_modules)

    def Task(self) -> "_Task":  # noqa: N802 - NI's name
        """Return a new acquisition."""
        return _Task(self)


class _Task:
    def __init__(self, library: SimulatedNidaqmx) -> None:
        self._library = library
        self._start_time: float | None = None
        self._delivered = 0
        self._last = np.zeros(6)
        library.open_tasks += 1
        self.ai_channels = SimpleNamespace(add_ai_voltage_chan=self._channels)
        self.timing = SimpleNamespace(cfg_samp_clk_timing=self._timing, samp_clk_rate=0.0)

    def _channels(self, name: str, terminal_config: str, min_val: float, max_val: float) -> SimpleNamespace:
        self._refuse_without_device()
        self._library.requests.append((name, terminal_config, min_val, max_val))
        low, high = self._library.range
        return SimpleNamespace(ai_min=low, ai_max=high, ai_term_cfg=terminal_config)

    def _timing(self, rate: float, **_: object) -> None:
        self.timing.samp_clk_rate = rate * ACTUAL

    def start(self) -> None:
        self._refuse_without_device()
        self._start_time, self._delivered = self._library.now(), 0
        self._library.starts.append(self._start_time)

    def stop(self) -> None:
        self._start_time = None

    def close(self) -> None:
        self._library.open_tasks -= 1

    def read(self, number_of_samples_per_channel: int) -> list[list[float]]:
        assert number_of_samples_per_channel == -1
        self._refuse_without_device()
        library, faults = self._library, self._library.faults
        if self._start_time is None or faults.active("lose", library.now()):
            raise DaqError(OVERFLOW)
        times, self._delivered = faults.due(self._start_time, library.now(), self.timing.samp_clk_rate, self._delivered)
        volts = faults.sensed_wrench(library.bench, times) @ library.gauges.T
        for time, six in zip(times.tolist(), volts, strict=True):
            if faults.active("stall", time):
                six[:] = self._last
            if faults.active("saturate", time):
                six[2] = 10.0
            self._last = six
        return volts.T.tolist()

    def _refuse_without_device(self) -> None:
        if any(self._library.faults.active(fault, self._library.now()) for fault in ("unplug", "reboot")):
            raise DaqError(_ABSENT)


def _start(bench: Bench, clock: Clock, faults: Faults, folder: Path) -> RunningSimulator:
    library = SimulatedNidaqmx(bench, clock, faults)
    library.install()
    uri = f"nidaq://Dev1?cal={calibration_file(folder, bench.serial)}"
    return RunningSimulator(uri, bench, library.now, unplug(faults), lambda: library.open_tasks, library.remove)


SIMULATOR = Simulator(
    "nidaq", _start, factor=1.0, tells=("lose", "saturate", "unplug", "reboot", "slow"), on_ports=False
)
