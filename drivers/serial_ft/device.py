"""What is said to the stand-alone controller around a stream."""

import contextlib
import time

from drivers.links import Link
from drivers.pacing import Pacing
from drivers.records import RecordDecoder
from drivers.serial_ft import wire
from drivers.transducer import DeviceFault, LinkLost

# All in real seconds.
_SETTLED = 0.05  # of silence behind a prompt that show it is one, and no byte of a record
_BETWEEN = 0.02  # between two commands
_ANSWER = 0.6  # for the answer to a command
_BANNER = 6.0  # for all the controller says when it starts
_SILENT = 0.02  # behind the prompt after a stream
_END = 0.08  # for the prompt after a stream
_TRIES = 3


class ControllerConversation:
    """Prompts, settings and streams of one controller."""

    saturated = 0xFF  # any error digit means saturation or a sensor error: the values are invalid

    def __init__(self, *, binary: bool) -> None:
        """Take records as bytes, or as text."""
        self._binary = binary

    def decoder(self) -> RecordDecoder:
        """Return a decoder for the records asked for."""
        return wire.BinaryDecoder() if self._binary else wire.AsciiDecoder()

    def numbering(self, rate: float, factor: float) -> Pacing:
        """Return what numbers the stream: its records carry neither number nor time."""
        return Pacing(rate, factor)

    def begin(self, link: Link) -> bytes:
        """Set the controller up and let it stream; return what it streamed already. Raises LinkLost, DeviceFault."""
        if not prompted(link):
            raise LinkLost("the controller gives no prompt; check its power, the cable and the baud rate")
        output = wire.BINARY_OUTPUT if self._binary else wire.ASCII_OUTPUT
        for command in (output, *wire.SETTINGS):
            if not _said(link, command + wire.RETURN, _ANSWER, settled=False).rstrip().endswith(wire.PROMPT):
                raise LinkLost(f"the controller does not answer to {command.decode()}; switch it off and on")
        for _ in range(_TRIES):
            if wire.answered_record(_said(link, wire.ONE_RECORD + wire.RETURN, _ANSWER), binary=self._binary):
                break
        else:
            form = "binary" if self._binary else "ASCII"
            raise DeviceFault(
                f"the controller answers, but not with a record of six axes in {form} output; "
                "check that a transducer is connected to it, and try the other format"
            )
        return self._streaming(link)

    def end(self, link: Link) -> None:
        """Let the stream end: any carriage return does it."""
        with contextlib.suppress(LinkLost):  # whoever is gone streams no more
            link.send(wire.RETURN)
            deadline = time.monotonic() + _END
            heard = b""
            while time.monotonic() < deadline:
                data = link.receive(_SILENT)
                if data is None and heard.endswith(wire.PROMPT):
                    break
                heard = data or heard

    def _streaming(self, link: Link) -> bytes:
        """Ask for the stream, and return what follows the echo of the request."""
        link.send(wire.STREAM + wire.RETURN)
        heard = b""
        deadline = time.monotonic() + _ANSWER
        while time.monotonic() < deadline:
            heard += link.receive(_SETTLED) or b""
            _, echo, rest = heard.partition(wire.STREAM)
            _, line_end, first = rest.partition(b"\n")
            if echo and line_end:
                return first
        raise LinkLost("the controller does not begin to stream; switch it off and on")


def prompted(link: Link, tries: int = _TRIES, patience: float = 0.25) -> bool:
    """Tell whether a controller answers with its prompt; a stream it was sending ends by this."""
    return any(_said(link, wire.RETURN, patience).rstrip().endswith(wire.PROMPT) for _ in range(tries))


def banner(link: Link) -> str:
    """Start the controller afresh and return what it says then, for people.

    Raises DeviceFault when no prompt follows: a controller that lost its memory waits for a Y.
    """
    said = _said(link, wire.WARM_START, _BANNER)
    if not said.rstrip().endswith(wire.PROMPT):
        raise DeviceFault(
            "the controller started but gave no prompt; it may have lost its settings and wait for a Y: "
            "answer it from a terminal program once"
        )
    text = said.rstrip().removesuffix(wire.PROMPT).decode("ascii", "replace")
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _said(link: Link, request: bytes, patience: float, *, settled: bool = True) -> bytes:
    """Return what the controller says to `request`, up to a prompt, or within `patience`.

    With `settled` only a prompt that nothing follows is one: in a binary record its byte means something else.
    """
    link.receive(_BETWEEN)
    link.send(request)
    said = b""
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        data = link.receive(_SETTLED)
        said += data or b""
        if said.rstrip().endswith(wire.PROMPT) and (data is None or not settled):
            break
    return said
