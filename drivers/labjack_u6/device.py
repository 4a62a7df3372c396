"""What is said to the LabJack U6 around a stream of six gauge voltages."""

import contextlib

from drivers.labjack_u6 import wire
from drivers.links import Link
from drivers.records import RecordDecoder
from drivers.scan_count import ScanCount
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

    def numbering(self, rate: float, factor: float) -> ScanCount:
        """Return what numbers the scans: the converter's own clock."""
        return ScanCount(rate, factor, wrap=_WRAP)

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
