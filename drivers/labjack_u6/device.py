"""What is said to the LabJack U6 around a stream of six gauge voltages, and how its scans are numbered."""

import contextlib

import numpy as np
from numpy.typing import NDArray

from drivers.labjack_u6 import wire
from drivers.links import Link
from drivers.pacing import Paced
from drivers.records import RecordDecoder
from drivers.transducer import DeviceFault, LinkLost

_ANSWER = 1.0  # for an answer [real s], as in the maker's own driver
_WRAP = 256 * wire.SCANS  # scans after which the packet counter begins anew


class GaugeConversation:
    """Requests and streams of one converter. Each request is answered before anything else comes."""

    saturated = wire.SATURATED

    def __init__(self, serial: int, constants: wire.Constants, clock: wire.ScanClock) -> None:
        """Take the converter of that serial number, whose constants were read, to scan by `clock`."""
        self._serial = serial
        self._constants = constants
        self._scan_clock = clock

    def decoder(self) -> RecordDecoder:
        """Return a decoder for a stream about to begin."""
        return wire.StreamDecoder(self._constants)

    def numbering(self, rate: float, _factor: float, /) -> "ScanCount":
        """Return what numbers the scans: the converter's own clock."""
        return ScanCount(rate)

    def begin(self, link: Link) -> bytes:
        """End whatever streams, set the scans and let them come. Raises LinkLost or DeviceFault with the reason."""
        self.end(link)
        found = identity(link)
        if found.serial != self._serial:
            raise DeviceFault(f"converter {found.serial} answers where {self._serial} was; open it anew")
        wire.check_configured(_said(link, wire.configure_stream(self._scan_clock)))
        if code := wire.normal_error(_said(link, wire.START), 0xA9):
            raise DeviceFault(f"the converter does not stream: {wire.meaning(code)}; pull its plug and put it in again")
        return b""

    def end(self, link: Link) -> None:
        """Let the stream end and drop what it had still sent."""
        with contextlib.suppress(LinkLost):  # whoever is gone streams no more
            code = wire.normal_error(_said(link, wire.STOP), 0xB1)
            if code not in (0, wire.STREAM_IS_OFF):
                raise DeviceFault(f"the converter does not stop: {wire.meaning(code)}; pull its plug")
            while link.receive(0.002):
                pass


class ScanCount:
    """Numbers and times of scans by the converter's own clock: scan k is at k / rate.

    The host's clock only tells how long the converter was away, and whether the packet counter, which tells of losses
    by 8 bits, went round unseen.
    """

    def __init__(self, rate: float) -> None:
        """Expect `rate` scans in a second [Hz] of the session's clock."""
        self.lost = 0
        self._rate = rate
        self._sequence = 0
        self._behind: float | None = None  # arrival minus time of the last scan before [s]

    def take(self, damaged: NDArray[np.int64], received_ns: int) -> Paced:
        """Place n scans that arrived together, with those lost before each (n,)."""
        if not len(damaged):
            return _NONE
        sequence = self._sequence + np.cumsum(damaged + 1)
        behind = self._arrival_minus_time(int(sequence[-1]), received_ns)
        if self._behind is not None and damaged.any():
            rounds = max(round((behind - self._behind) * self._rate / _WRAP), 0)
            sequence += np.where(np.arange(len(damaged)) >= int(np.argmax(damaged > 0)), rounds * _WRAP, 0)
            behind -= rounds * _WRAP / self._rate
        self._behind = behind
        self.lost += int(sequence[-1]) - self._sequence - len(damaged)
        self._sequence = int(sequence[-1])
        return Paced(sequence, (sequence - 1) / self._rate)

    def release(self) -> Paced:
        """Place what was kept back: nothing ever is."""
        return _NONE

    def bridge(self, received_ns: int) -> None:
        """Let the stream, begun anew, go on at `received_ns` behind a gap of at least one scan."""
        if self._behind is not None:
            away = self._arrival_minus_time(self._sequence, received_ns) - self._behind
            missing = max(round(away * self._rate) - 1, 1)
            self._sequence += missing
            self.lost += missing

    def _arrival_minus_time(self, sequence: int, received_ns: int) -> float:
        return received_ns * 1e-9 - (sequence - 1) / self._rate


def identity(link: Link) -> wire.Identity:
    """Return who answers. Raises LinkLost or DeviceFault when nobody does."""
    return wire.parse_identity(_said(link, wire.read_identity()))


def constants(link: Link) -> wire.Constants:
    """Return the converter's own calibration. Raises LinkLost or DeviceFault when it has none."""
    return wire.parse_constants(_said(link, wire.read_memory(0)), _said(link, wire.read_memory(2)))


def _said(link: Link, request: bytes) -> bytes | None:
    """Return the answer to a request, or None."""
    link.send(request)
    return link.receive(_ANSWER)


_NONE = Paced(np.empty(0, np.int64), np.empty(0))
