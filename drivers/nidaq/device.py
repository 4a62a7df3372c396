"""Six gauges on a data-acquisition device of National Instruments, through its maker's library, which is handed in.

The library (`nidaqmx`, an optional extra) brings its own codec: volts come as numbers. It times the readings by the
device's clock and numbers nothing; when its buffer overflows it ends the acquisition, which begins anew behind a gap.
"""

import time
from typing import Any

import numpy as np

from drivers.links import Link
from drivers.records import RecordDecoder, Records
from drivers.scan_count import ScanCount
from drivers.transducer import LinkLost, SetupError

GAUGES = 6
LIMIT = 9.9  # of a gauge's voltage [V]; a converter of 16 bits clips slightly outside of 10 V
SATURATED = 0x3F00  # status: bit 8 + i says that gauge i is at its limit
_BUFFER = 10.0  # readings that the library keeps for a computer that is late [s]
_NAP = 0.005  # between two looks for readings [real s]


class TaskLink:
    """One acquisition as a link: what is received are volts of whole readings, as bytes of float64."""

    def __init__(self, library: Any, device: str, rate: float) -> None:  # noqa: ANN401 - nidaqmx is not always there
        """Acquire the six differential pairs from ai0 on, at `rate` [Hz]. Raises SetupError when the device refuses."""
        self._library = library
        self._where = device
        self._task: Any = None
        try:
            self._task = library.Task()
            self._task.ai_channels.add_ai_voltage_chan(
                f"{device}/ai0:{GAUGES - 1}",
                terminal_config=library.constants.TerminalConfiguration.DIFF,
                min_val=-10.0,
                max_val=10.0,
            )
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
        """Begin or end the acquisition: b"start" or b"stop". Raises LinkLost when the device is gone."""
        try:
            self._task.start() if data == b"start" else self._task.stop()
        except self._library.DaqError as error:
            raise LinkLost(f"{self._where}: {_sentence(error)}") from None

    def receive(self, timeout: float) -> bytes | None:
        """Return what has arrived, or None when nothing came within `timeout` real seconds."""
        deadline = time.monotonic() + timeout
        while True:
            try:
                volts = self._task.read(number_of_samples_per_channel=self._library.constants.READ_ALL_AVAILABLE)
            except self._library.DaqError as error:
                raise LinkLost(f"{self._where}: {_sentence(error)}") from None
            readings = np.asarray(volts, np.float64).reshape(GAUGES, -1).T
            if len(readings):
                return readings.tobytes()
            if time.monotonic() >= deadline:
                return None
            time.sleep(_NAP)

    def close(self) -> None:
        """Give the device back. Harmless when repeated."""
        if self._task is not None:
            task, self._task = self._task, None
            task.close()


class VoltsDecoder:
    """Turns volts into records; nothing is ever broken or numbered."""

    malformed = 0

    def feed(self, data: bytes) -> Records:
        """Take whole readings as bytes of float64 and return them with the status of their gauges."""
        volts = np.frombuffer(data, np.float64).reshape(-1, GAUGES)
        status = ((np.abs(volts) >= LIMIT) * (1 << np.arange(8, 8 + GAUGES))).sum(axis=1)
        return Records(volts, status.astype(np.int64), np.zeros(len(volts), np.int64))


class TaskConversation:
    """Begins and ends acquisitions."""

    saturated = SATURATED

    def decoder(self) -> RecordDecoder:
        """Return a decoder for a stream about to begin."""
        return VoltsDecoder()

    def numbering(self, rate: float, factor: float) -> ScanCount:
        """Return what numbers the readings: the device's own clock."""
        return ScanCount(rate, factor)

    def begin(self, link: Link) -> bytes:
        """Let readings come."""
        link.send(b"start")
        return b""

    def end(self, link: Link) -> None:
        """Let them end."""
        link.send(b"stop")


def _sentence(error: Exception) -> str:
    """Return the first line of the library's explanation."""
    lines = str(error).splitlines()
    return (lines[0] if lines else type(error).__name__).rstrip(".")
