"""A transducer that streams records without full numbers: thread, times, losses, reconnection."""

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
_LUMP = 2048  # bytes in one read from which the computer was busy and more may be waiting
_FIRST = 3.0  # until a device that never sent a record is given up, after its start-up time
_QUIET = 0.3  # time without a complete record after which the device is asked to stream again
_SILENCE = 5.0  # time without a complete record after which it is given up
_LOOKS = 12  # most measurements of a rate, until one agrees with the earlier ones
_ALIKE = 0.03  # relative difference below which rates are equal [-]
_BACK_OFF = (0.05, 0.1, 0.2, 0.4)  # between attempts to reconnect; the last one repeats


class Conversation(Protocol):
    """The exchange over one kind of line around a stream."""

    def begin(self, link: Link) -> bytes:
        """Start the stream from any state of the device; return its first bytes.

        Raises LinkLost without an answer, DeviceFault, with the reason, when it must not be read.
        """

    def end(self, link: Link) -> None:
        """End the stream within 0.1 s. Raises LinkLost when the device is gone."""

    @property
    def decoder(self) -> Callable[[], RecordDecoder]:
        """Factory of decoders, one for each stream."""

    @property
    def numbering(self) -> Callable[[float, float], ClockRecovery | ScanCount]:
        """Factory of a stream's numbering from its rate [Hz] and the factor of its clock to real time."""


def measured_rate(
    link: Link, conversation: Conversation, clock: Clock, seconds: float, deadline: Deadline, nominal: float = math.nan
) -> float:
    """Return the rate of records on the session's clock [Hz], from `seconds` of streaming [real s].

    Good to a few per cent. If the rate is not `nominal`, and the last half of the time disagrees with all before it,
    the computer may have been busy: measurement continues, up to the deadline. Raises LinkLost with hardly any records,
    and the errors of `conversation.begin`.
    """
    decoder = conversation.decoder()
    arrivals: list[tuple[int, int]] = []  # number of records so far, and arrival of the last one [ns]
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
    """One device at the end of a line that is opened at each start. A thread takes and decodes its bytes.

    Number and time of each record come from the conversation's numbering; `counter` is the number. Missing numbers show
    losses, including the time of an unplugged line or a device that was off.
    """

    longest_wait = TICK

    def __init__(
        self, info: TransducerInfo, connect: Connect, conversation: Conversation, clock: Clock, *, opening: Deadline
    ) -> None:
        """Take an identified device with `info.rate` [Hz] known to a few per cent, opened within `opening`."""
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
        self._held_back: list[tuple[Records, int]] = []  # held back by the numbering
        self._restarted = 0
        self._malformed_before = 0  # by earlier decoders
        self._decoder = self._conversation.decoder()
        self._ever = False  # a record has arrived
        self._last_arrival = time.monotonic()  # of the last one

    def run(self) -> None:
        """Start the stream, take records, and reconnect after a loss."""
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
        """Stream over one opening of the line until a stop. Raises LinkLost when no more records arrive."""
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
        """Decode arriving bytes. A pause of the device is waited out up to a limit."""
        quiet = (_QUIET if self._ever else _FIRST) + 4.0 * self._period
        silence, last_look = 0.0, time.monotonic()
        while True:
            received_ns = self.clock.now_ns()
            records = decoder.feed(data) if data else None
            now = time.monotonic()
            silence += min(now - last_look, TICK + _GATHER)  # beyond that this computer was busy: records may wait
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
        """Hand over a block of all arrivals that the numbering has placed."""
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
