"""Six gauges on a data-acquisition device of National Instruments, by its maker's library.

The library (`nidaqmx`, an optional extra) has its own codec: volts arrive as numbers. It times readings by the device's
clock without numbering them. When its buffer overflows it ends the acquisition, which restarts after a gap.
"""

import importlib
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivers.address import Address, AddressError, Driver, check_form
from drivers.calibration_file import read_calibration_file
from drivers.clock import Clock
from drivers.clock_recovery import ScanCount
from drivers.deadline import Deadline, Link
from drivers.readings import Records
from drivers.streaming import StreamingTransducer
from drivers.transducer import LinkLost, SetupError, StatusTable, TransducerInfo, bit

_GAUGES = 6
RANGE = 10.0  # [V]
_LIMIT = 9.9  # of a gauge's voltage [V]; a 16-bit converter clips slightly above 10 V
# Bit 8 + i of a status says that gauge i is at its limit.
_STATUS_BITS = StatusTable(
    tuple(bit(8 + gauge, f"gauge {gauge} at its limit", "saturated") for gauge in range(_GAUGES))
)
_BUFFER = 10.0  # buffer of the library for a late computer [s]
_NAP = 0.005  # between two polls for readings [real s]
_OPTIONS = frozenset({"cal", "rate"})
_EXAMPLE = "nidaq://Dev1?cal=FILE"
_DEFAULT_RATE = 1000  # [Hz]
LOWEST_RATE, HIGHEST_RATE = 1, 100_000  # [Hz]; six gauges share 1 MS/s of NI's X series, and 250 kS/s of USB-621x


def library() -> Any:  # noqa: ANN401 - optional
    """Return NI's library. Raises SetupError with installation advice."""
    try:
        importlib.import_module("nidaqmx.constants")
        importlib.import_module("nidaqmx.system")
        return importlib.import_module("nidaqmx")
    except ImportError:
        raise SetupError(
            "nidaq:// needs NI's library: pip install 'daq-app[nidaq]', and the NI-DAQmx driver from NI"
        ) from None


def open_nidaq(address: Address, clock: Clock, deadline: Deadline) -> StreamingTransducer:
    """Return the transducer at `address`, not streaming. Raises SetupError with the reason."""
    check_form(address, _EXAMPLE, _OPTIONS)
    api = library()
    device, info = _device_info(api, address)
    rate = address.number("rate", _DEFAULT_RATE, LOWEST_RATE, HIGHEST_RATE)
    link = _TaskLink(api, device, rate)
    link.close()
    return StreamingTransducer(
        replace(info, rate=link.rate, counter_rate=link.rate, settings={**info.settings, "gauges": link.gauges}),
        lambda _: _TaskLink(api, device, rate),
        _TaskConversation(),
        clock,
        opening=deadline,
    )


def identify_nidaq(address: Address, _deadline: Deadline) -> TransducerInfo:
    """Return the transducer's info without acquiring data. Raises SetupError with the reason."""
    check_form(address, _EXAMPLE, _OPTIONS)
    return _device_info(library(), address)[1]


def _device_info(api: Any, address: Address) -> tuple[str, TransducerInfo]:  # noqa: ANN401
    """Return the device's name in NI-DAQmx, and the info of its transducer."""
    file = address.options.get("cal")
    if file is None:
        raise AddressError(f"{address.uri}: write {_EXAMPLE}, with the transducer's own .cal file")
    calibration = read_calibration_file(Path(file))
    try:
        devices = {device.name.lower(): device for device in api.system.System.local().devices}
    except Exception as error:  # noqa: BLE001 - without NI's driver the library raises errors of several kinds
        raise SetupError(f"{address.uri}: NI-DAQmx does not answer ({error}); install its driver from NI") from None
    device = devices.get(address.host.lower())
    if device is None:
        names = ", ".join(sorted(device.name for device in devices.values())) or "none"
        raise SetupError(f"{address.uri}: there is no device {address.host}; NI-DAQmx knows {names}")
    info = TransducerInfo(
        uri=address.uri,
        driver="nidaq",
        model=f"{calibration.body} {calibration.part_number} on NI {device.product_type}",
        serial=calibration.calibration.serial,
        simulated=bool(device.is_simulated) or "SIMULATED" in calibration.part_number.upper(),
        rate=float("nan"),
        counter_rate=float("nan"),
        calibration=calibration.calibration,
        status=_STATUS_BITS,
        settings={
            "converter": f"{device.product_type}, serial number {device.serial_num:X}",
            "calibration": f"{calibration.calibration.source}, SHA-256 {calibration.sha256}",
            "gauges": "six differential pairs from ai0 on, +-10 V",
            "bias": "none in the device",
            "filter": "none",
            "time": "the device's own clock; gauges of one reading may be converted one after the other",
        },
    )
    return str(device.name), info


class _TaskLink:
    """One acquisition as a link: it receives volts of whole readings, as bytes of float64."""

    def __init__(self, library: Any, device: str, rate: float) -> None:  # noqa: ANN401 - nidaqmx is optional
        """Acquire the six differential pairs from ai0 on, at `rate` [Hz]. Raises SetupError when the device refuses."""
        self._library = library
        self._device = device
        self._task: Any = None
        try:
            self._task = library.Task()
            differential = library.constants.TerminalConfiguration.DIFF
            channels = self._task.ai_channels.add_ai_voltage_chan(
                f"{device}/ai0:{_GAUGES - 1}", terminal_config=differential, min_val=-RANGE, max_val=RANGE
            )
            low, high = float(channels.ai_min), float(channels.ai_max)
            if low > -RANGE or high < RANGE or channels.ai_term_cfg != differential:
                self.close()
                raise SetupError(
                    f"-{RANGE:g} to {RANGE:g} V was requested from {device}, which set {low:g} to {high:g} V, "
                    f"{channels.ai_term_cfg}; use a device with six differential inputs of that range"
                )
            self.gauges = f"six differential pairs from ai0 on, {low:g} to {high:g} V, as read back"
            self._task.timing.cfg_samp_clk_timing(
                rate,
                sample_mode=library.constants.AcquisitionType.CONTINUOUS,
                samps_per_chan=max(round(_BUFFER * rate), 1000),
            )
            self.rate = float(self._task.timing.samp_clk_rate)  # as read back [Hz]
        except library.DaqError as error:
            self.close()
            raise SetupError(f"{device} cannot be set: {_sentence(error)}") from None

    def send(self, data: bytes) -> None:
        """Start or stop the acquisition: b"start" or b"stop". Raises LinkLost when the device is gone."""
        try:
            self._task.start() if data == b"start" else self._task.stop()
        except self._library.DaqError as error:
            raise LinkLost(f"{self._device}: {_sentence(error)}") from None

    def receive(self, timeout: float) -> bytes | None:
        deadline = time.monotonic() + timeout
        while True:
            try:
                volts = self._task.read(number_of_samples_per_channel=self._library.constants.READ_ALL_AVAILABLE)
            except self._library.DaqError as error:
                raise LinkLost(f"{self._device}: {_sentence(error)}") from None
            readings = np.asarray(volts, np.float64).reshape(_GAUGES, -1).T
            if len(readings):
                return readings.tobytes()
            if time.monotonic() >= deadline:
                return None
            time.sleep(_NAP)

    def close(self) -> None:
        if self._task is not None:
            task, self._task = self._task, None
            task.close()


class _VoltsDecoder:
    """Turns volts into records, which are never broken and have no numbers."""

    malformed = 0

    def feed(self, data: bytes) -> Records:
        """Take whole readings as bytes of float64 and return them with their gauges' status."""
        volts = np.frombuffer(data, np.float64).reshape(-1, _GAUGES)
        status = ((np.abs(volts) >= _LIMIT) * (1 << np.arange(8, 8 + _GAUGES))).sum(axis=1)
        return Records(volts, status.astype(np.int64), np.zeros(len(volts), np.int64))


class _TaskConversation:
    decoder = _VoltsDecoder
    numbering = ScanCount

    def begin(self, link: Link) -> bytes:
        link.send(b"start")
        return b""

    def end(self, link: Link) -> None:
        link.send(b"stop")


def _sentence(error: Exception) -> str:
    lines = str(error).splitlines()
    return (lines[0] if lines else type(error).__name__).rstrip(".")


DRIVER = Driver("nidaq", open_nidaq, identify_nidaq)
