"""The recorder's transducer: opening, streaming between sessions, loss and reconnection."""

import time
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from daq_app.recorder.device_history import remember_zero
from daq_app.recorder.display import Display, six
from daq_app.recorder.messages import Device, Failed, LinkBack, LinkDown, NoDevice, Report, Tared
from daq_app.simulation.wiring import Connection, connect
from drivers.clock import Clock
from drivers.readings import ReadingBlock
from drivers.transducer import DeviceFault, Health, LinkLost, SetupError, Transducer, TransducerInfo, WrappedTransducer
from sessions.recording import RecordingError
from sessions.run.interruptions import interruptions
from sessions.run.resuming import check_same_transducer
from sessions.strokes.contacts import is_quiet
from sessions.strokes.settings import DetectorSettings

TRY_AGAIN = 1.0  # between two attempts to reach a lost transducer [real s]
GLANCE = 0.01  # between two polls while no session is running [real s]


class NotNow(Exception):
    """A request is not possible now; the message says why and what to do."""


_FAILURES = (LinkLost, DeviceFault, SetupError, RecordingError, NotNow)


@contextmanager
def _breakable(uri: str) -> Generator[None]:
    """Let a stop interrupt waiting for a device. Raises NotNow if one did."""
    try:
        with interruptions() as interrupted, interrupted.raise_at_once():
            yield
    except KeyboardInterrupt:
        raise NotNow(f"{uri} was not connected: stopped by the user") from None


class Tap(WrappedTransducer):
    """A transducer whose readings are shown on their way into a session, and shifted to the session's clock."""

    def __init__(self, inner: Transducer, display: Display, clock_offset_ns: int) -> None:
        """Show the readings of `inner` on `display`; the session's clock is ahead by `clock_offset_ns` [ns]."""
        super().__init__(inner)
        self._display = display
        self._clock_offset_ns = clock_offset_ns

    def start(self) -> None:
        """Begin to stream."""
        self._display.stream_began()
        super().start()

    def read(self, timeout: float) -> ReadingBlock:
        """Show and return the next readings."""
        block = super().read(timeout)
        block = replace(block, received_ns=block.received_ns + self._clock_offset_ns)
        self._display.take(block)
        return block


class Bench:
    """At most one transducer. Its readings are shown between sessions; a session takes it by `lend`."""

    def __init__(self, clock: Clock, display: Display, send: Callable[[Report], None]) -> None:
        self._clock = clock
        self._display = display
        self._send = send
        self._stack = ExitStack()
        self.connected: Connection | None = None  # the open one
        self.uri: str | None = None  # of the transducer, as requested
        self._lost_info: TransducerInfo | None = None  # of the lost transducer
        self._retry_time = 0.0  # of the next attempt [real s]
        self._tare: _Tare | None = None
        self._streaming = False  # to the display only

    @property
    def health(self) -> Health:
        """Return the transducer's totals; empty if no transducer is open."""
        return Health() if self.connected is None else self.connected.transducer.health

    def connect(self, uri: str, *, streaming: bool = True) -> None:
        """Open the transducer at `uri` in place of any other, and if `streaming` begin to show its readings.

        Raises what opening and starting raise, and NotNow if a stop interrupted it; then none is open.
        """
        self.disconnect()
        try:
            with _breakable(uri):
                self._open(uri)
                if streaming:
                    self._start()
        except BaseException:
            self._close()
            self.uri = None
            raise
        assert self.connected is not None
        info = replace(self.connected.transducer.info, uri=uri)  # a simulated one has a different address inside
        self._send(Device(info, self.connected.frame))

    @contextmanager
    def instead(self, uri: str) -> Generator[None]:
        """Hold the transducer at `uri` open in the context; on failure there or in opening, reconnect the former one.

        A former one at another place is closed only after the one at `uri` has answered. Raises the failure.
        """
        former = self.uri if self.connected is not None else None
        try:
            if uri != former:
                if former is not None and uri.partition("?")[0] != former.partition("?")[0]:
                    with _breakable(uri), connect(uri, self._clock):
                        pass
                self.connect(uri, streaming=False)
            yield
        except _FAILURES as error:
            if former is None or self.uri == former:
                raise
            try:
                self.connect(former)
                outcome = "is connected again"
            except _FAILURES as failure:
                outcome = f"was disconnected and cannot be connected again: {failure}"
            raise type(error)(f"{error}; {former} {outcome}") from None

    def disconnect(self) -> None:
        """Close the transducer."""
        uri = self.uri
        self._close()
        self._display.forget()
        self.uri = self._lost_info = None
        if uri is not None:
            self._send(NoDevice())

    def begin_tare(self, duration: float) -> None:
        """Begin to measure the zero. Raises NotNow if nothing streams."""
        if self.connected is None:
            raise NotNow("no transducer is connected whose zero could be measured; connect one")
        if not 0.1 <= duration <= 60.0:
            raise NotNow(f"a zero is measured over 0.1 to 60 s, not {duration:g} s")
        self._tare = _Tare(duration)

    def end_tare(self, reason: str) -> None:
        """Cancel a running tare."""
        if self._tare is not None:
            self._tare = None
            self._send(Failed("Tare", f"the zero was not measured: {reason}", "NotNow"))

    def stream(self) -> None:
        """Begin to show readings, unless they are shown already. Raises NotNow if a stop interrupted it."""
        if self.connected is not None and not self._streaming:
            try:
                with _breakable(self.connected.transducer.info.uri):
                    self._start()
            except (LinkLost, DeviceFault, SetupError) as error:
                self.lose(str(error))
            except NotNow:
                self.disconnect()
                raise

    def lend(self, clock_offset_ns: int) -> Tap | None:
        """Return the idle transducer for a session whose clock is ahead by an offset; None if none is open."""
        self.end_tare("a session began; zero again after it")
        if self.connected is None:
            return None
        self.connected.transducer.stop()
        self._streaming = False
        return Tap(self.connected.transducer, self._display, clock_offset_ns)

    def look(self) -> None:
        """Take new readings, or try to reach a lost transducer again. Raises NotNow if a tare is refused."""
        time.sleep(GLANCE)
        if self.connected is None:
            self._look_for_it()
            return
        try:
            block = self.connected.transducer.read(0.0)
        except (LinkLost, DeviceFault) as error:
            self.lose(str(error))
            return
        if not len(block):
            return
        self._display.take(block)
        if self._tare is not None and self._tare.feed(block):
            tare, self._tare = self._tare, None
            zero = tare.result(self.connected.transducer.info)
            self._display.set_zero(zero.mean)
            remember_zero(self.connected.transducer.info, zero.mean, zero.spread)
            self._send(zero)

    def _start(self) -> None:
        assert self.connected is not None
        self._display.stream_began()
        self._streaming = True
        self.connected.transducer.start()

    def _open(self, uri: str) -> None:
        self.connected, self.uri = self._stack.enter_context(connect(uri, self._clock)), uri
        self._display.device(self.connected.transducer.info)

    def _close(self) -> None:
        self.end_tare("the transducer is no longer connected")
        self.connected = None
        self._streaming = False
        self._display.device(None)
        self._stack.close()

    def lose(self, sentence: str) -> None:
        """Close a transducer that fell silent, to be tried again later."""
        if self.connected is not None:
            self._lost_info = self.connected.transducer.info
            self._close()
            self._retry_time = time.monotonic() + TRY_AGAIN
            self._send(LinkDown(sentence))

    def _look_for_it(self) -> None:
        if self.uri is None or time.monotonic() < self._retry_time:
            return
        self._retry_time = time.monotonic() + TRY_AGAIN
        try:
            with _breakable(self.uri):
                self._open(self.uri)
        except (LinkLost, DeviceFault, SetupError, NotNow):
            return
        assert self.connected is not None
        info = self.connected.transducer.info
        try:
            check_same_transducer(self._lost_info, info)
            is_same = True
        except RecordingError:
            is_same = False
            self._display.forget()
        self._send(LinkBack(info, is_same))
        self.stream()


class _Tare:
    """A stretch of readings that may become a zero."""

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._blocks: list[ReadingBlock] = []

    def feed(self, block: ReadingBlock) -> bool:
        """Add readings and say whether they suffice."""
        self._blocks.append(block)
        return float(block.time[-1]) - float(self._blocks[0].time[0]) >= self._duration

    def result(self, info: TransducerInfo) -> Tared:
        """Return the zero. Raises NotNow if the load changed."""
        block = ReadingBlock.concatenate(self._blocks)
        # Readings come in lumps; use only the requested duration.
        stretch = block.between(0, int(np.count_nonzero(block.time <= block.time[0] + self._duration)))
        wrench = info.calibration.wrench(stretch.raw, np.zeros(6))
        settings = DetectorSettings()
        forces: list[Any] = [wrench[:, axis].tolist() for axis in range(3)]
        if len(stretch) < settings.baseline_readings or not all(is_quiet(force, settings) for force in forces):
            raise NotNow("the zero was not measured: something moved or touched; take hands off and zero again")
        mean, spread = six(stretch.raw.mean(axis=0)), six(stretch.raw.std(axis=0, ddof=1))
        return Tared(mean, spread, len(stretch), float(stretch.time[-1] - stretch.time[0]))
