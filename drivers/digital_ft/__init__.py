"""The RS-485 transducer: identification, and the exchange around a stream."""

import contextlib
import math
import struct
import time
from dataclasses import dataclass
from functools import partial

from drivers.address import Address, Driver, check_form, prefix_failures
from drivers.clock import Clock
from drivers.clock_recovery import GAP, ClockRecovery
from drivers.deadline import Deadline, Link
from drivers.digital_ft import wire
from drivers.readings import RecordDecoder
from drivers.serial_link import Parity, SerialLink, port_of
from drivers.streaming import StreamingTransducer, measured_rate
from drivers.transducer import DeviceFault, LinkLost, SetupError, TransducerInfo

# All in real seconds.
_ANSWER = 0.15  # for one answer
_PATIENCE = (1.0, 2.0, 4.0, 8.0)  # times that, for repetitions of one request
_REST = 0.4  # for the transducer to recover after a jam; a published driver waits 0.5 to 1 s
_END = 0.08  # for a jammed stream to fall silent
_SILENT = 0.02
_TRIES = 4  # with a rest after each, within the time for opening
_MEASURED = 0.5  # measurement of the stream's rate [real s]
_AS_STATED = 0.03  # relative difference below which a measured rate counts as the stated one [-]
_OPTIONS = frozenset({"baud", "parity", "calibration"})


@dataclass(frozen=True, slots=True)
class _Target:
    address: Address
    port: str
    baud: int
    parity: Parity
    number: int  # of the calibration, 1 to 16


def open_digital_ft(address: Address, clock: Clock, deadline: Deadline) -> StreamingTransducer:
    """Return the transducer at `address`, calibrated, not streaming. Raises SetupError, LinkLost or DeviceFault."""
    target = _target_of(address)
    with prefix_failures(address), contextlib.closing(_line(target, deadline)) as link:
        bound = deadline.bound(link)
        word = hold(bound)
        stored = _read_calibration(target, bound)
        conversation = _DigitalConversation(target.number, stored)
        rate = measured_rate(link, conversation, clock, _MEASURED, deadline, wire.STREAM_RATE)
    info = _info(target, stored, word, rate)
    return StreamingTransducer(info, partial(_line, target), conversation, clock, opening=deadline)


def identify_digital_ft(address: Address, deadline: Deadline) -> TransducerInfo:
    """Return the transducer's info, changing nothing: an earlier stream continues. An answer takes 0.2 s at most."""
    target = _target_of(address)
    with prefix_failures(address), contextlib.closing(deadline.bound(_line(target, deadline))) as link:
        word = status_word(link)
        if word is None:
            streams = link.receive(0.05) is not None
            raise LinkLost("it streams, and nobody reads; open it to end that" if streams else "no transducer answers")
        return _info(target, _read_calibration(target, link), word, math.nan)


def _line(target: _Target, _deadline: Deadline) -> SerialLink:
    return SerialLink(target.port, target.baud, target.parity)


def _read_calibration(target: _Target, link: Link) -> wire.StoredCalibration:
    registers = read(link, wire.calibration_address(target.number), wire.CALIBRATION_SIZE)
    try:
        return wire.parse_calibration(registers)
    except SetupError as error:
        raise SetupError(f"{target.address.uri}: calibration {target.number} {error}") from None


def _info(target: _Target, calibration: wire.StoredCalibration, status: int | None, rate: float) -> TransducerInfo:
    as_stated = math.isnan(rate) or abs(rate / wire.STREAM_RATE - 1.0) < _AS_STATED
    day = calibration.calibrated or "on a day not stated"
    settings = {
        "line": f"{target.baud} baud, 8 data bits, parity {target.parity}, 1 stop bit",
        "calibration": f"number {target.number}, {calibration.part_number}, calibrated {day}",
        "gauge gains and offsets": calibration.gains_and_offsets.hex(" ", 2),
        "bias": "none in the transducer",
        "filter": "none",
        "time": "host arrival at the stated rate; packets carry no clock or number, "
        f"and a loss shorter than {GAP:g} s that leaves no broken bytes is not noticed",
    }
    if status is not None:
        settings["status at opening"] = "; ".join(wire.status_words(status)) or "healthy"
    if not math.isnan(rate):
        origin = "as stated by the maker to 0.5 %" if as_stated else "as measured, not as stated by the maker"
        settings["rate"] = f"{origin}; {rate:.0f} Hz measured at opening"
    return TransducerInfo(
        uri=target.address.uri,
        driver="digital-ft",
        model=f"Digital F/T {calibration.part_number}".strip(),
        serial=calibration.calibration.serial,
        simulated="SIMULATED" in calibration.part_number.upper(),
        rate=wire.STREAM_RATE if as_stated else rate,
        counter_rate=math.nan,
        calibration=calibration.calibration,
        settings=settings,
        status=wire.STATUS_BITS,
    )


def _target_of(address: Address) -> _Target:
    check_form(address, "digital-ft:///dev/ttyUSB0", _OPTIONS)
    return _Target(
        address,
        port_of(address),
        address.number("baud", 1_250_000, 300, 4_000_000),
        address.word("parity", ("even", "none")),
        address.number("calibration", 1, 1, wire.CALIBRATIONS),
    )


@dataclass(eq=False)
class _DigitalConversation:
    """The exchange with one transducer that uses one of its calibrations."""

    number: int  # of the calibration, 1 to 16
    stored: wire.StoredCalibration  # as read
    word: int = 0  # the status word, which can only be read while nothing streams
    numbering = ClockRecovery

    def decoder(self) -> RecordDecoder:
        return wire.StreamDecoder(self.word)

    def begin(self, link: Link) -> bytes:
        """Apply the calibration's gains and offsets, verify them, and start the stream.

        Raises LinkLost without an answer, DeviceFault when another transducer answers or it refuses.
        """
        self.word = hold(link)
        stored = read(link, wire.calibration_address(self.number), wire.CALIBRATION_SIZE)
        serial = stored[:8].split(b"\0")[0].decode("ascii", "replace").strip()
        own_serial = self.stored.calibration.serial
        if serial != own_serial:
            raise DeviceFault(f"transducer {serial or 'without a name'} answers where {own_serial} was; open it anew")
        gains_and_offsets = self.stored.gains_and_offsets
        _carry_out(link, wire.request(wire.UNLOCK, bytes([wire.UNLOCK_KEY])), "to be unlocked")
        _carry_out(link, wire.write_registers(wire.GAINS_AND_OFFSETS, gains_and_offsets), "its gains and offsets")
        _carry_out(link, wire.request(wire.UNLOCK, bytes([wire.LOCK_KEY])), "to be locked")
        if read(link, wire.GAINS_AND_OFFSETS, len(gains_and_offsets) // 2) != gains_and_offsets:
            raise DeviceFault(
                "the transducer did not take the gains and offsets of its calibration; switch it off and on"
            )
        start, reply = (wire.request(wire.START_STREAM, bytes([key])) for key in (wire.START_KEY, 1))
        response = _response(link, start, reply, _PATIENCE[-1] * _ANSWER)
        if reply not in response:
            raise LinkLost("the transducer does not begin to stream; switch it off and on")
        return response.partition(reply)[2]

    def end(self, link: Link) -> None:
        link.send(wire.JAM)
        deadline = time.monotonic() + _END
        while time.monotonic() < deadline and link.receive(_SILENT) is not None:
            pass


def hold(link: Link) -> int:
    """Return the status word, after ending an earlier stream. Raises LinkLost without an answer."""
    for _ in range(_TRIES):
        if (word := status_word(link)) is not None:
            return word
        if link.receive(_SILENT) is not None:
            link.send(wire.JAM)
        link.receive(_REST)
    raise LinkLost("the transducer does not answer; check its power, the cable, the baud rate and the parity")


def status_word(link: Link) -> int | None:
    """Return the status word, or None without an answer: the transducer is absent, or streams."""
    request = wire.read_registers(wire.STATUS, 1)
    answer = wire.answer_in(_response(link, request, b""), request)
    return struct.unpack(">H", answer)[0] if isinstance(answer, bytes) else None


def read(link: Link, first: int, count: int) -> bytes:
    """Return `count` registers from `first`, two bytes each. Raises LinkLost or DeviceFault."""
    read_so_far = b""
    while len(read_so_far) < 2 * count:
        offset = len(read_so_far) // 2
        request = wire.read_registers(first + offset, min(count - offset, wire.MOST_REGISTERS))
        read_so_far += _answer(link, request, f"for register {first + offset}")
    return read_so_far


def _carry_out(link: Link, request: bytes, action: str) -> None:
    """Carry out a request whose answer states success or repeats the registers written."""
    answer = _answer(link, request, action)
    if request[1] == wire.UNLOCK and answer != b"\x01":
        raise DeviceFault(f"the transducer was asked {action} and refused; switch it off and on")


def _answer(link: Link, request: bytes, action: str) -> bytes:
    """Return the answer to a request, which is repeated without an answer. Raises LinkLost or DeviceFault."""
    for times in _PATIENCE:
        answer = wire.answer_in(_response(link, request, b"", times * _ANSWER), request)
        if times > 1.0:  # answers do not name their request: a second answer must not count for the next one
            while link.receive(_ANSWER) is not None:
                pass
        if isinstance(answer, str):
            raise DeviceFault(f"the transducer was asked {action} and refused: {answer}")
        if answer is not None:
            return answer
    raise LinkLost(f"the transducer was asked {action} and did not answer; check the cable")


def _response(link: Link, request: bytes, expected: bytes, patience: float = _ANSWER) -> bytes:
    """Return the bytes after a request, up to its answer, or up to the bytes `expected` if any."""
    deadline = time.monotonic() + _ANSWER
    while link.receive(0.0) and time.monotonic() < deadline:
        pass  # left over from before
    link.send(request)
    response = b""
    deadline = time.monotonic() + patience
    while True:
        remaining_s = deadline - time.monotonic()
        response += link.receive(max(remaining_s, 0.0)) or b""  # even if this computer was busy until now
        if remaining_s <= 0.0 or (expected in response if expected else wire.answer_in(response, request) is not None):
            return response


DRIVER = Driver("digital-ft", open_digital_ft, identify_digital_ft, serial_line=True)
