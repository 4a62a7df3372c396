"""A transducer that streams records without full numbers: thread, times, loss, return. A `Conversation` runs it."""

import contextlib
import math
import time
from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np

from drivers.clock import Clock
from drivers.clock_recovery import ClockRecovery, Placement, ScanCount, rate_of_least_late, rate_words
from drivers.deadline import CONNECTING, ENDING, TICK, Connect, Deadline, Link
from drivers.readings import ReadingBlock, RecordDecoder, Records
from drivers.threaded import ThreadedTransducer
from drivers.transducer import Health, LinkLost, SetupError, TransducerInfo

# All in real seconds.
_GATHER = 0.002  # at fast rates, time in which bytes gather before they are read
_LUMP = 2048  # bytes at once from which the computer was busy, and more may be waiting
_FIRST = 3.0  # until a device that never sent a record is given up, beyond its start-up time
_QUIET = 0.3  # time without a complete record after which the device is asked to stream again
_SILENCE = 5.0  # time without a complete record after which it is given up
_LOOKS = 12  # at a rate that is to be measured, until one says what those before it did
_ALIKE = 0.03  # relative difference below which rates are equal [-]
_BACK_OFF = (0.05, 0.1, 0.2, 0.4)  # between attempts to bring it back; the last one repeats


class Conversation(Protocol):
    """The exchange over one kind of line around a stream."""

    def begin(self, link: Link) -> bytes:
        """Bring the device to stream, whatever it was doing; return what it streamed already.

        Raises LinkLost when it does not answer, DeviceFault when it must not be read: the message says why.
        """

    def end(self, link: Link) -> None:
        """Bring the stream to an end within 0.1 s. Raises LinkLost when the device is gone, and streams no more."""

    @property
    def decoder(self) -> Callable[[], RecordDecoder]:
        """What makes a decoder for a stream about to begin."""

    @property
    def numbering(self) -> Callable[[float, float], ClockRecovery | ScanCount]:
        """What makes the numbering of a stream, of its rate [Hz] and how many times as fast as real its clock runs."""


def measured_rate(
    link: Link, conversation: Conversation, clock: Clock, seconds: float, deadline: Deadline, nominal: float = math.nan
) -> float:
    """Return how many records a second of the session's clock come [Hz], from `seconds` of streaming [real s].

    Good to a few per cent. Where it is not the rate `nominal`, and the last half of the time says another than all
    before it, the computer may have been busy: the stream is watched for longer, up to the deadline. Raises LinkLost
    when hardly any records come, and what `conversation.begin` raises.
    """
    decoder = conversation.decoder()
    arrivals: list[tuple[int, int]] = []  # how many records so far, and when the last of them came [ns]
    rate, count = math.nan, 0
    try:
        data: bytes | None = conversation.begin(deadline.bound(link))
        for look in range(_LOOKS):
            limit, earlier = deadline.within(seconds / 2.0), len(arrivals)
            while True:
                more = len(decoder.feed(data).status) if data else 0
                if more:
                    count += more
                    arrivals.append((count, clock.now_ns()))
                data = link.receive(TICK)
                if limit.remaining <= 0.0:
                    break
            previous_rate, latest, rate = rate, rate_of_least_late(arrivals[earlier:]), rate_of_least_late(arrivals)
            alike = look and (abs(rate / nominal - 1.0) < _ALIKE or abs(latest / previous_rate - 1.0) < _ALIKE)
            if alike or deadline.remaining <= 0.0:
                break
    finally:
        _end_stream(conversation, link)
    if math.isnan(rate):
        raise LinkLost("it sends no readings when asked to stream; switch it off and on, and check the cable")
    return rate


def _end_stream(conversation: Conversation, link: Link) -> None:
    with contextlib.suppress(LinkLost):
        conversation.end(Deadline(ENDING).bound(link))


class StreamingTransducer(ThreadedTransducer):
    """One device at the end of a line that is opened at each start. A thread takes and decodes what comes.

    Number and time of each record come from the conversation's numbering. `counter` is the number. A loss is named by
    missing numbers; so is the time in which the line was pulled or the device was off.
    """

    longest_wait = TICK

    def __init__(
        self, info: TransducerInfo, connect: Connect, conversation: Conversation, clock: Clock, *, opening: Deadline
    ) -> None:
        """Take an identified device whose `info.rate` [Hz] is known within a few per cent, opened by `opening`."""
        super().__init__(info, clock, opening)
        self._connect = connect
        self._conversation = conversation
        self._period = 1.0 / info.rate / clock.factor  # between two records [real s]
        self._gather = _GATHER if self._period < _GATHER else 0.0
        self.reset()

    @property
    def health(self) -> Health:
        """Totals since start. `restarted` counts how often the stream was lost and came back."""
        with self.lock:
            self.digest()
            watch = self._numbering.watch
            return self.totals(
                lost=self._numbering.lost,
                malformed=self._malformed_before + self._decoder.malformed,
                restarted=self._restarted,
                off_rate=watch.changes,
                rate_words=rate_words("readings come", watch.rate, watch.nominal) if watch.changes else "",
            )

    def has_come(self) -> bool:
        return self._ever

    def never_came(self, seconds: float) -> str:
        count = self.health.malformed
        description = f"{count} broken records and no reading" if count else "no reading"
        return f"{self.info.uri} sent {description} within {seconds:.1f} s; check its power, the cable and the address"

    def reset(self) -> None:
        super().reset()
        self._pending: deque[tuple[Records | None, int]] = deque()  # and arrival [ns]; None: the stream restarted
        self._numbering = self._conversation.numbering(self.info.rate, self.clock.factor)
        self._held_back: list[tuple[Records, int]] = []  # that the numbering keeps back
        self._restarted = 0
        self._malformed_before = 0  # by decoders that have had their day
        self._decoder = self._conversation.decoder()
        self._ever = False  # a record has come
        self._last_arrival = time.monotonic()  # when the last one did

    def run(self) -> None:
        """Bring the device to stream, take what comes, and bring it back when it is lost."""
        tries = 0
        while not self.stopping.is_set():
            try:
                self._stream()
            except (LinkLost, SetupError):
                silent = time.monotonic() - self._last_arrival
                if not self._ever or silent > _SILENCE + 4.0 * self._period:
                    raise
                tries = 0 if silent < 2.0 * _QUIET else tries + 1
                self.stopping.wait(_BACK_OFF[min(tries, len(_BACK_OFF) - 1)])

    def _stream(self) -> None:
        """Stream over one opening of the line until asked to stop. Raises LinkLost when no records come any more."""
        limit = Deadline(CONNECTING, self.stopping) if self._ever else self.begin_by
        link = self._connect(limit)
        try:
            first = self._conversation.begin(limit.bound(link))
            if self._ever:
                self._pending.append((None, self.clock.now_ns()))
            with self.lock:
                self._malformed_before += self._decoder.malformed
                self._decoder = self._conversation.decoder()
            try:
                self._listen(link, self._decoder, first)
            finally:
                _end_stream(self._conversation, link)
        finally:
            link.close()

    def _listen(self, link: Link, decoder: RecordDecoder, data: bytes | None) -> None:
        """Decode what comes. A pause of the device is waited out as long as it may be one."""
        quiet = (_QUIET if self._ever else _FIRST) + 4.0 * self._period
        silence, last_look = 0.0, time.monotonic()
        while True:
            received_ns = self.clock.now_ns()
            records = decoder.feed(data) if data else None
            now = time.monotonic()
            silence += min(now - last_look, TICK + _GATHER)  # beyond that this computer was busy, and records may wait
            last_look = now
            if records is not None and len(records.status):
                self._pending.append((records, received_ns))
                self._last_arrival, self._ever = now, True
                silence, quiet = 0.0, _QUIET + 4.0 * self._period
                if not self.news.is_set():
                    self.news.set()
            if self.stopping.is_set():
                return
            if silence > quiet:
                since = now - self._last_arrival
                raise LinkLost(f"{self.info.uri} has sent no reading for {since:.1f} s; check its power and cable")
            if self._gather and data and len(data) < _LUMP:
                time.sleep(self._gather)
            data = link.receive(TICK)

    def digest(self, *, end: bool = False) -> None:
        while self._pending:
            records, received_ns = self._pending.popleft()
            if records is None:
                self._hand_on(self._numbering.release())
                self._numbering.bridge(received_ns)
                self._restarted += 1
            else:
                self._held_back.append((records, received_ns))
                self._hand_on(self._numbering.take(records.damaged, received_ns))
        if end:
            self._hand_on(self._numbering.release())

    def _hand_on(self, placement: Placement) -> None:
        """Return a block of all arrivals that the numbering has placed."""
        if not len(placement.sequence):
            return
        batches, received_ns = zip(*self._held_back, strict=True)
        self._held_back = []
        self.hand_over(
            ReadingBlock(
                sequence=placement.sequence,
                counter=placement.sequence,
                status=np.concatenate([records.status for records in batches]),
                time=placement.time,
                received_ns=np.repeat(np.array(received_ns, np.int64), [len(records.status) for records in batches]),
                raw=np.concatenate([records.raw for records in batches]),
            )
        )
