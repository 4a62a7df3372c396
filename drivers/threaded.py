"""What all drivers share whose readings a thread of their own takes: handing over, stopping, closing."""

import threading
import time
from abc import ABC, abstractmethod

from drivers.clock import Clock
from drivers.readings import ReadingBlock
from drivers.transducer import LinkLost, SetupError, TransducerInfo


class ThreadedTransducer(ABC):
    """One device whose thread, begun by `start`, takes what comes until `_stopping` is set."""

    _tick = 0.05  # longest wait, and so for a stop [real s]

    def __init__(self, info: TransducerInfo, clock: Clock) -> None:
        """Take an identified device."""
        self._info = info
        self._clock = clock
        self._lock = threading.Lock()  # over all that _digest touches
        self._arrived = threading.Event()  # something is pending, or the stream has ended
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._ended: Exception | None = None  # why the stream ended, when nobody had stopped it
        self._ready: list[ReadingBlock] = []
        self._lag_ms = 0.0

    @property
    def info(self) -> TransducerInfo:
        """Identity, calibration and settings, as found at opening."""
        return self._info

    def read(self, timeout: float) -> ReadingBlock:
        """Return all readings not yet handed over, waiting up to `timeout` session seconds for the first."""
        deadline = time.monotonic() + timeout / self._clock.factor
        while True:
            self._arrived.clear()
            streaming = self._thread is not None and self._thread.is_alive()
            with self._lock:
                self._digest(end=not streaming)
                blocks, self._ready = self._ready, []
            if blocks:
                block = ReadingBlock.joined(blocks)
                self._lag_ms = (self._clock.now_ns() - int(block.received_ns[-1])) * 1e-6
                return block
            if not streaming and self._ended is not None:
                raise LinkLost(str(self._ended))
            remaining = deadline - time.monotonic()
            if not streaming or remaining <= 0.0:
                return ReadingBlock.empty()
            self._arrived.wait(min(remaining, self._tick))

    def _reset(self) -> None:
        """Forget what an earlier stream left. Raises SetupError while one runs."""
        if self._thread is not None:
            raise SetupError(f"{self._info.uri} is streaming already; stop it before starting it again")
        self._arrived.clear()
        self._stopping.clear()
        self._ended = None
        self._ready = []
        self._lag_ms = 0.0

    def stop(self) -> None:
        """End streaming; what had arrived can still be read. Harmless when repeated."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def close(self) -> None:
        """Stop; port and thread are given back. Harmless when repeated."""
        self.stop()

    @abstractmethod
    def _digest(self, *, end: bool = False) -> None:
        """Turn what the thread has taken into readings that are ready; nothing more comes at the `end`. Lock held."""
