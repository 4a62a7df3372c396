"""A transducer that plays a recording: sequence, device counter, status and raw values as recorded."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from drivers.clock import Clock
from drivers.readings import ReadingBlock
from drivers.transducer import Health, LinkLost, SetupError, TransducerInfo
from sessions.recording.log import health_of
from sessions.recording.reader import Recording


class RecordedReadings:
    """Recorded readings in order, read and handed over in parts."""

    def __init__(self, blocks: Iterator[ReadingBlock]) -> None:
        self._blocks = filter(len, blocks)
        self._queue: list[ReadingBlock] = []
        self.position = 0  # number of readings handed over

    def blocks_up_to(self, position: int | None) -> Iterator[ReadingBlock]:
        """Yield the next readings until `position` were handed over, or all are (None: all)."""
        while (position is None or self.position < position) and self._look():
            first = self._queue[0]
            yield self._take(len(first) if position is None else min(len(first), position - self.position))

    def up_to(self, position: int | None) -> ReadingBlock:
        """Return the readings of `blocks_up_to` in one block."""
        return ReadingBlock.concatenate(list(self.blocks_up_to(position)))

    def take_until(self, instant_ns: int) -> ReadingBlock:
        """Return the next readings, up to the first received after `instant_ns` [ns]."""
        blocks: list[ReadingBlock] = []
        while self._look():
            late = self._queue[0].received_ns > instant_ns
            count = int(np.argmax(late)) if late.any() else len(late)
            if count:
                blocks.append(self._take(count))
            if late.any():
                break
        return ReadingBlock.concatenate(blocks)

    def next_received_ns(self) -> int | None:
        """Return the instant at which the next reading was received [ns]; None after the last."""
        return int(self._queue[0].received_ns[0]) if self._look() else None

    def _look(self) -> bool:
        """Fetch the next block if needed, and say whether there is one."""
        if not self._queue:
            self._queue += islice(self._blocks, 1)
        return bool(self._queue)

    def _take(self, count: int) -> ReadingBlock:
        block = self._queue.pop()
        if count < len(block):
            self._queue.append(block.between(count, len(block)))
        self.position += count
        return block.between(0, count)


class ReplayTransducer:
    """The transducer of a recording: each reading comes as long after the start as when recorded."""

    def __init__(self, recording: Recording, clock: Clock, uri: str) -> None:
        """Run on `clock`, under the address `uri`. Raises SetupError for a recording without readings."""
        self._blocks = recording.blocks()
        self._readings = RecordedReadings(self._blocks)
        first_ns = self._readings.next_received_ns()
        if recording.info is None or first_ns is None:
            raise SetupError(f"{recording.folder} holds no readings to replay; give a session with forces")
        # A replay counts as simulated if any part of the session was.
        self.info: TransducerInfo = replace(
            recording.info, uri=uri, driver="replay", simulated=recording.simulated or recording.info.simulated
        )
        self._name = str(recording.folder)
        self._clock = clock
        self._first_ns = first_ns
        self._shift_ns: int | None = None  # from the recorded clock to ours
        self._stopped_ns: int | None = None  # on the recorded clock
        self._losses = [event for event in recording.events if event.kind == "losses"]
        self._lag_ms = 0.0

    @property
    def health(self) -> Health:
        """Totals so far of lost and doubtful readings, each counted when the recording reported it."""
        return replace(
            health_of(event for event in self._losses if event.readings <= self._readings.position),
            received=self._readings.position,
            lag_ms=self._lag_ms,
        )

    def start(self) -> None:
        """Start: the first reading is due now."""
        self._shift_ns = self._clock.now_ns() - self._first_ns

    def read(self, timeout: float) -> ReadingBlock:
        """Return the readings that are due, after at most `timeout` [s]. Raises LinkLost after the last reading."""
        shift = self._shift_ns
        if shift is None:
            return ReadingBlock.empty()
        if self._stopped_ns is not None:
            return self._shift(self._readings.take_until(self._stopped_ns), shift)
        next_ns = self._readings.next_received_ns()
        if next_ns is None:
            raise LinkLost(f"the recording {self._name} ends here")
        wait = (next_ns + shift - self._clock.now_ns()) * 1e-9
        if wait > 0.0:
            self._clock.sleep(min(wait, timeout))
        return self._shift(self._readings.take_until(self._clock.now_ns() - shift), shift)

    def stop(self) -> None:
        """Stop: later readings are not handed over."""
        if self._stopped_ns is None and self._shift_ns is not None:
            self._stopped_ns = self._clock.now_ns() - self._shift_ns

    def close(self) -> None:
        """Stop, and close the recording."""
        self.stop()
        self._blocks.close()

    def _shift(self, block: ReadingBlock, shift_ns: int) -> ReadingBlock:
        if not len(block):
            return block
        block = replace(block, received_ns=block.received_ns + shift_ns)
        self._lag_ms = (self._clock.now_ns() - int(block.received_ns[-1])) * 1e-6
        return block
