"""What is said to the RS-485 transducer around a stream."""

import contextlib
import struct
import time

from drivers.digital_ft import wire
from drivers.links import Link
from drivers.pacing import Pacing
from drivers.records import RecordDecoder
from drivers.transducer import DeviceFault, LinkLost

# All in real seconds.
_ANSWER = 0.15  # for one answer
_REST = 0.4  # for the transducer to come to itself after a jam; a published driver waits 0.5 to 1 s
_END = 0.08  # for a jammed stream to fall silent
_SILENT = 0.02
_TRIES = 8


class DigitalConversation:
    """Requests, answers and streams of one transducer with one of its calibrations."""

    saturated = wire.STATUS_FLAG | wire.GAUGE_AT_END

    def __init__(self, number: int, stored: wire.StoredCalibration) -> None:
        """Take a transducer whose calibration `number`, 1 to 16, was read as `stored`."""
        self._number = number
        self._stored = stored

    def decoder(self) -> RecordDecoder:
        """Return a decoder for a stream about to begin."""
        return wire.StreamDecoder()

    def numbering(self, rate: float, factor: float) -> Pacing:
        """Return what numbers the stream: its records carry neither number nor time."""
        return Pacing(rate, factor)

    def begin(self, link: Link) -> bytes:
        """Put the calibration's gains and offsets in force, prove it, and let the transducer stream.

        Raises LinkLost when it does not answer, DeviceFault when another transducer does or it refuses.
        """
        hold(link)
        first = wire.calibration_address(self._number)
        stored = read(link, first, wire.CALIBRATION_SIZE)
        serial = stored[:8].split(b"\0")[0].decode("ascii", "replace").strip()
        expected = self._stored.calibration.serial
        if serial != expected:
            raise DeviceFault(f"transducer {serial or 'without a name'} answers where {expected} was; open it anew")
        wanted = self._stored.gains_and_offsets
        _done(link, wire.request(wire.UNLOCK, bytes([wire.UNLOCK_KEY])), "to be unlocked")
        _done(link, wire.write_registers(wire.GAINS_AND_OFFSETS, wanted), "its gains and offsets")
        _done(link, wire.request(wire.UNLOCK, bytes([wire.LOCK_KEY])), "to be locked")
        if read(link, wire.GAINS_AND_OFFSETS, len(wanted) // 2) != wanted:
            raise DeviceFault(
                "the transducer did not take the gains and offsets of its calibration; switch it off and on"
            )
        start, started = (wire.request(wire.START_STREAM, bytes([key])) for key in (wire.START_KEY, 1))
        heard = _heard(link, start, started)
        if started not in heard:
            raise LinkLost("the transducer does not begin to stream; switch it off and on")
        return heard.partition(started)[2]

    def end(self, link: Link) -> None:
        """Let the stream end by sending into it."""
        with contextlib.suppress(LinkLost):  # whoever is gone streams no more
            link.send(wire.JAM)
            deadline = time.monotonic() + _END
            while time.monotonic() < deadline and link.receive(_SILENT) is not None:
                pass


def hold(link: Link) -> None:
    """Bring the transducer to answer, ending a stream left over from before. Raises LinkLost when it does not."""
    for _ in range(_TRIES):
        if status(link) is not None:
            return
        if link.receive(_SILENT) is not None:
            link.send(wire.JAM)
        link.receive(_REST)
    raise LinkLost("the transducer does not answer; check its power, the cable, the baud rate and the parity")


def status(link: Link) -> int | None:
    """Return the status word, or None when there is no answer: it is not there, or it streams."""
    asked = wire.read_registers(wire.STATUS, 1)
    answer = wire.answer_in(_heard(link, asked, b""), asked)
    return struct.unpack(">H", answer)[0] if isinstance(answer, bytes) else None


def read(link: Link, first: int, count: int) -> bytes:
    """Return `count` registers from `first`, two bytes each. Raises LinkLost or DeviceFault."""
    read_so_far = b""
    while len(read_so_far) < 2 * count:
        done = len(read_so_far) // 2
        asked = wire.read_registers(first + done, min(count - done, wire.MOST_REGISTERS))
        read_so_far += _answer(link, asked, f"for register {first + done}")
    return read_so_far


def _done(link: Link, asked: bytes, what: str) -> None:
    """Carry out a request that is answered with success or a repetition of what was written."""
    answer = _answer(link, asked, what)
    if asked[1] == wire.UNLOCK and answer != b"\x01":
        raise DeviceFault(f"the transducer was asked {what} and refused; switch it off and on")


def _answer(link: Link, asked: bytes, what: str) -> bytes:
    """Return the answer to a request, asking three times. Raises LinkLost or DeviceFault when there is none."""
    for _ in range(3):
        answer = wire.answer_in(_heard(link, asked, b""), asked)
        if isinstance(answer, wire.Refused):
            raise DeviceFault(f"the transducer was asked {what} and refused: {answer.reason}")
        if answer is not None:
            return answer
    raise LinkLost(f"the transducer was asked {what} and did not answer; check the cable")


def _heard(link: Link, asked: bytes, expected: bytes) -> bytes:
    """Return what comes after a request, up to an answer to it, or to the bytes expected where there are some."""
    deadline = time.monotonic() + _ANSWER
    while link.receive(0.0) and time.monotonic() < deadline:
        pass  # left over from before
    link.send(asked)
    heard = b""
    deadline = time.monotonic() + _ANSWER
    while time.monotonic() < deadline:
        heard += link.receive(deadline - time.monotonic()) or b""
        if expected in heard if expected else wire.answer_in(heard, asked) is not None:
            break
    return heard
