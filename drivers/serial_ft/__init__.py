"""The stand-alone controller: identification, rate, and the exchange around a stream."""

import contextlib
import math
import time
from dataclasses import dataclass

import numpy as np

from drivers.address import Address, AddressError, Driver, check_form, prefix_failures
from drivers.calibration import Calibration
from drivers.clock import Clock
from drivers.clock_recovery import GAP, ClockRecovery
from drivers.deadline import Deadline, Link
from drivers.readings import RecordDecoder
from drivers.serial_ft import wire
from drivers.serial_link import SerialLink, port_of
from drivers.streaming import StreamingTransducer, measured_rate
from drivers.transducer import DeviceFault, LinkLost, TransducerInfo

# All in real seconds.
_SETTLED = 0.05  # of silence after a prompt that distinguish it from a byte of a record
_BETWEEN = 0.02  # between two commands
_ANSWER = 0.6  # for the answer to a command
_PROMPT = 0.2  # for its prompt
_BANNER = 6.0  # for the controller's start-up text
_SILENT = 0.02  # after the prompt that ends a stream
_END = 0.08  # for the prompt after a stream
_TRIES = 3
_BAUDS = (38400, 9600, 115200, 19200, 57600, 4800)  # tried in this order; published drivers disagree on the usual one
_MEASURED = 0.6  # measurement of the stream's rate [real s]
_OPTIONS = frozenset({"baud", "format", "counts_per_N", "counts_per_Nm", "range_N", "range_Nm", "serial", "simulated"})


@dataclass(frozen=True, slots=True)
class _Target:
    address: Address
    port: str
    bauds: tuple[int, ...]
    binary: bool
    calibration: Calibration


def open_serial_ft(address: Address, clock: Clock, deadline: Deadline) -> StreamingTransducer:
    """Return the controller at `address`, set up, its rate measured. Raises SetupError, LinkLost or DeviceFault."""
    target = _target_of(address)
    conversation = _ControllerConversation(binary=target.binary)
    with prefix_failures(address):
        link, baud = _find_controller(target, deadline)
        with contextlib.closing(link):
            reply = banner(deadline.bound(link))
            rate = measured_rate(link, conversation, clock, _MEASURED, deadline)
    info = _info(target, baud, reply, rate)
    return StreamingTransducer(info, lambda _: SerialLink(target.port, baud), conversation, clock, opening=deadline)


def identify_serial_ft(address: Address, deadline: Deadline) -> TransducerInfo:
    """Return the controller's info, changing no setting (an earlier stream is ended)."""
    target = _target_of(address)
    with prefix_failures(address):
        link, baud = _find_controller(target, deadline)
    link.close()
    return _info(target, baud, "", math.nan)


def _find_controller(target: _Target, deadline: Deadline) -> tuple[SerialLink, int]:
    """Return an open line on which a controller answers, and its baud rate."""
    bauds: list[int] = []
    for baud in target.bauds:
        if deadline.remaining <= 0.0:
            break
        bauds.append(baud)
        with contextlib.ExitStack() as stack:
            link = stack.enter_context(contextlib.closing(SerialLink(target.port, baud)))
            try:
                if has_prompt(deadline.bound(link), tries=2):
                    stack.pop_all()  # leaves the line open
                    return link, baud
            except LinkLost:
                if deadline.remaining > 0.0:
                    raise
    rates = ", ".join(map(str, bauds))
    raise LinkLost(f"no controller answers (tried {rates} baud); check its power, the cable and the baud rate")


def _info(target: _Target, baud: int, reply: str, rate: float) -> TransducerInfo:
    simulated = "SIMULATED" in reply.upper() or "simulated" in target.address.options
    settings = {
        "baud": f"{baud}, {'as the address says' if len(target.bauds) == 1 else 'found by trying'}",
        "output": "binary, without checksum" if target.binary else "ASCII, without checksum",
        "bias": "all biases of the controller dropped when a stream begins",
        "filter": "no moving average; set, answered with a prompt, and not to be read back",
        "units": "counts per N and N-m as the address says; the controller cannot be asked",
        "time": "host arrival at the measured rate; the controller has no clock or record number, "
        f"and a loss shorter than {GAP:g} s that leaves no broken bytes is not noticed",
    }
    if reply:
        settings |= {"banner": reply, "rate": "measured at opening; the controller cannot be asked"}
    return TransducerInfo(
        uri=target.address.uri,
        driver="serial-ft",
        model="SIMULATED F/T Controller" if simulated else "F/T Controller",
        serial=target.calibration.serial,
        simulated=simulated,
        rate=rate,
        counter_rate=math.nan,
        calibration=target.calibration,
        settings=settings,
        status=wire.STATUS_BITS,
    )


def _target_of(address: Address) -> _Target:
    check_form(address, "serial-ft:///dev/ttyUSB0", _OPTIONS)
    port = port_of(address)
    form = address.word("format", ("binary", "ascii"))
    baud = address.number("baud", 0, 300, 921600)
    counts = [address.positive(option) for option in ("counts_per_N", "counts_per_Nm")]
    if not np.all(np.isfinite(counts)):
        raise AddressError(
            f"{address.uri}: the controller cannot tell its units; add ?counts_per_N=...&counts_per_Nm=... "
            "as they stand in the calibration sheet"
        )
    calibration = Calibration(
        address.options.get("serial", ""),
        "counts",
        np.diag(np.repeat([1.0 / counts[0], 1000.0 / counts[1]], 3)),
        np.repeat([address.positive("range_N"), 1000.0 * address.positive("range_Nm")], 3),
        "counts per unit as the address says",
    )
    return _Target(address, port, (baud,) if baud else _BAUDS, form == "binary", calibration)


@dataclass(eq=False)
class _ControllerConversation:
    binary: bool
    numbering = ClockRecovery

    def decoder(self) -> RecordDecoder:
        return wire.BinaryDecoder() if self.binary else wire.AsciiDecoder()

    def begin(self, link: Link) -> bytes:
        """Set up the controller and start the stream; return its first bytes. Raises LinkLost, DeviceFault."""
        if not has_prompt(link):
            raise LinkLost("the controller gives no prompt; check its power, the cable and the baud rate")
        output = wire.BINARY_OUTPUT if self.binary else wire.ASCII_OUTPUT
        for command in (output, *wire.SETTINGS):
            if not _reply(link, command + wire.RETURN, _ANSWER, settled=False).rstrip().endswith(wire.PROMPT):
                raise LinkLost(f"the controller does not answer to {command.decode()}; switch it off and on")
        for _ in range(_TRIES):
            if wire.answered_record(_reply(link, wire.ONE_RECORD + wire.RETURN, _ANSWER), binary=self.binary):
                break
        else:
            form = "binary" if self.binary else "ASCII"
            raise DeviceFault(
                f"the controller answers, but not with a record of six axes in {form} output; "
                "check that a transducer is connected to it, and try the other format"
            )
        return self._start_stream(link)

    def end(self, link: Link) -> None:
        """End the stream, by a carriage return."""
        link.send(wire.RETURN)
        deadline = time.monotonic() + _END
        response = b""
        while time.monotonic() < deadline:
            data = link.receive(_SILENT)
            if data is None and response.endswith(wire.PROMPT):
                break
            response = data or response

    def _start_stream(self, link: Link) -> bytes:
        """Start the stream, and return the bytes after the echo of the request."""
        link.send(wire.STREAM + wire.RETURN)
        response = b""
        deadline = time.monotonic() + _ANSWER
        while time.monotonic() < deadline:
            response += link.receive(_SETTLED) or b""
            _, echo, after_echo = response.partition(wire.STREAM)
            _, line_end, first = after_echo.partition(b"\n")
            if echo and line_end:
                return first
        raise LinkLost("the controller does not begin to stream; switch it off and on")


def has_prompt(link: Link, tries: int = _TRIES) -> bool:
    """Say whether a controller answers with its prompt; this ends any stream."""
    return any(_reply(link, wire.RETURN, _PROMPT).rstrip().endswith(wire.PROMPT) for _ in range(tries))


def banner(link: Link) -> str:
    """Restart the controller and return its start-up text, for people.

    Raises DeviceFault when no prompt follows: a controller that lost its memory waits for a Y.
    """
    reply = _reply(link, wire.WARM_START, _BANNER)
    if not reply.rstrip().endswith(wire.PROMPT):
        raise DeviceFault(
            "the controller started but gave no prompt; it may have lost its settings and wait for a Y: "
            "answer it from a terminal program once"
        )
    text = reply.rstrip().removesuffix(wire.PROMPT).decode("ascii", "replace")
    return " ".join("".join(character if character.isprintable() else " " for character in text).split())


def _reply(link: Link, request: bytes, patience: float, *, settled: bool = True) -> bytes:
    """Return the controller's reply to `request`, up to a prompt or for `patience` [s].

    With `settled` only a prompt followed by silence counts: its byte may occur in a binary record.
    """
    link.receive(_BETWEEN)
    link.send(request)
    reply = b""
    deadline = time.monotonic() + patience
    while True:
        expired = time.monotonic() >= deadline
        data = link.receive(_SETTLED)  # one more time even if this computer was busy until now
        reply += data or b""
        if expired or (reply.rstrip().endswith(wire.PROMPT) and (data is None or not settled)):
            return reply


DRIVER = Driver("serial-ft", open_serial_ft, identify_serial_ft, serial_line=True)
