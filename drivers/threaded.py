"""Base of drivers with a reading thread: start, handing over, stop and close."""

import threading
import time
from abc import ABC, abstractmethod
from typing import Any

from drivers import deadline
from drivers.clock import Clock
from drivers.deadline import Deadline, Stopped
from drivers.readings import ReadingBlock
from drivers.transducer import DeviceFault, Health, LinkLost, SetupError, StatusCount, TransducerInfo

_LEAVING = 0.9  # for the thread to end before it is abandoned in a call to its device [real s]


class ThreadedTransducer(ABC):
    """One device whose thread, begun by `start`, takes data until `stopping` is set."""

    longest_wait = 0.05  # longest wait, and so the longest delay of a stop [real s]

    def __init__(self, info: TransducerInfo, clock: Clock, opening: Deadline | None = None) -> None:
        """Take an identified device; subclasses call `reset`. The time of `opening` counts for the first start."""
        self._spent = 0.0 if opening is None else opening.spent
        self.info = info  # from opening
        self.clock = clock
        self.lock = threading.Lock()  # over all that `digest` touches
        self.news = threading.Event()  # something is pending, or the stream has ended
        self.stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._last_thread: threading.Thread | None = None  # stopped last; may still wait for the device

    def totals(self, **counts: Any) -> Health:  # noqa: ANN401 - fields of Health
        """Return totals: those of all drivers, and `counts`. Call with the lock held."""
        statuses = self._statuses
        return Health(
            received=self._received,
            saturated=statuses.verdicts["saturated"],
            doubtful=statuses.verdicts["doubtful"],
            noted=statuses.verdicts["note"],
            flagged=dict(statuses.flagged),
            lag_ms=self._lag_ms,
            **counts,
        )

    def hand_over(self, block: ReadingBlock) -> None:
        """Make readings available to `read`. Call with the lock held."""
        self._received += len(block)
        self._statuses.take(block.status)
        self._ready.append(block)

    def start(self) -> None:
        """Start the stream. Raises LinkLost, SetupError or DeviceFault when no reading arrives in time."""
        self.reset()
        patience, self._spent = deadline.CONNECTING - self._spent, 0.0
        first_reading_by, self.begin_by = Deadline(patience), Deadline(patience, self.stopping)
        name = f"{self.info.driver} {self.info.serial}".strip()
        thread = self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        try:
            thread.start()
            while not self.has_come() and self.ended is None and thread.is_alive():
                if first_reading_by.remaining <= 0.0:
                    self.ended = LinkLost(self.never_came(first_reading_by.spent))
                self.news.wait(deadline.TICK)
                self.news.clear()
            self.check_first()
        except BaseException:
            self.stop()
            raise

    def check_first(self) -> None:
        """Raise an error if the stream is unusable. A loss after the first readings is left to `read`."""
        if self.ended is not None and not (isinstance(self.ended, LinkLost) and self.has_come()):
            raise self.ended

    def read(self, timeout: float) -> ReadingBlock:
        deadline = time.monotonic() + timeout / self.clock.factor
        while True:
            self.news.clear()
            streaming = self._thread is not None and self._thread.is_alive()
            with self.lock:
                self.digest(end=not streaming)
                blocks, self._ready = self._ready, []
            if blocks:
                block = ReadingBlock.concatenate(blocks)
                self._lag_ms = (self.clock.now_ns() - int(block.received_ns[-1])) * 1e-6
                return block
            if not streaming and self.ended is not None:
                raise LinkLost(str(self.ended))
            remaining_s = deadline - time.monotonic()
            if not streaming or remaining_s <= 0.0:
                return ReadingBlock.empty()
            self.news.wait(min(remaining_s, self.longest_wait))

    def reset(self) -> None:
        """Clear the state of an earlier stream. Raises SetupError while one runs or still holds the device."""
        if self._thread is not None:
            raise SetupError(f"{self.info.uri} is streaming already; stop it before starting it again")
        if self._last_thread is not None and self._last_thread.is_alive():
            raise SetupError(f"{self.info.uri} still holds up the stream before; open it anew, or pull its plug")
        self.news.clear()
        self.stopping.clear()
        self.ended: Exception | None = None  # why the stream ended, where nobody stopped it
        self._ready: list[ReadingBlock] = []
        self._received = 0
        self._statuses = StatusCount(self.info.status)
        self._lag_ms = 0.0

    def stop(self) -> None:
        self.stopping.set()
        if self._thread is not None:
            self._last_thread, self._thread = self._thread, None
            _await_end(self._last_thread, Deadline(_LEAVING))

    def close(self) -> None:
        self.stop()

    def _run(self) -> None:
        """Run the thread, and store in `ended` why the stream ended, unless it was stopped."""
        try:
            self.run()
        except Stopped:
            pass
        except (LinkLost, SetupError, DeviceFault) as error:
            self.ended = error if self.info.uri in str(error) else type(error)(f"{self.info.uri}: {error}")
        except Exception as error:  # noqa: BLE001 - an internal error must not look like a silent device
            self.ended = LinkLost(f"{self.info.uri}: unexpected {type(error).__name__} ({error}); open it anew")
        finally:
            self.news.set()

    @abstractmethod
    def run(self) -> None:
        """Start the stream by `begin_by`, and take data until `stopping` is set.

        Raises LinkLost, SetupError or DeviceFault if the stream ends without a stop.
        """

    @abstractmethod
    def has_come(self) -> bool:
        """Say whether a reading has arrived."""

    @abstractmethod
    def never_came(self, seconds: float) -> str:
        """Return a sentence on why no reading arrived within `seconds`."""

    @abstractmethod
    def digest(self, *, end: bool = False) -> None:
        """Turn data of the thread into readings; no more follow at the `end`. Call with the lock held."""


def _await_end(thread: threading.Thread, limit: Deadline) -> None:
    """Wait for a thread to end, even if its start was interrupted before it ran."""
    while limit.remaining > 0.0:
        try:
            thread.join(limit.remaining)
        except RuntimeError:  # join refuses a thread that has not started
            time.sleep(deadline.TICK)
        else:
            return
