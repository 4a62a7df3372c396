"""A transducer that feels the simulated bench without any wire, in simulated time: for whole studies within seconds.

Readings can be lost, and the sensor can freeze, in the middle of chosen strokes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.calibration import Calibration
from drivers.clock import Clock
from drivers.readings import ReadingBlock
from drivers.transducer import Health, TransducerInfo
from simulators.bench import RATED, Bench

RATE = 200.0  # readings a second
MIDDLE = (0.3, 0.7)  # part of a stroke's slide in which it is hurt [-]
_SCALE = np.array([1e-6] * 3 + [1e-3] * 3)  # one count [N, N mm]


@dataclass(frozen=True, slots=True)
class Hurt:
    """What goes wrong, by number of the stroke on the bench, from 1."""

    lost: frozenset[int] = frozenset()  # readings of its middle never arrive
    frozen: frozenset[int] = frozenset()  # the sensor repeats one reading through its middle


class DirectTransducer:
    """The bench as a transducer; it reads whatever simulated time has brought."""

    def __init__(self, bench: Bench, clock: Clock, hurt: Hurt | None = None) -> None:
        """Feel `bench`, whose time begins with the stream."""
        calibration = Calibration(
            f"SIM{bench.seed}", "counts", np.diag(_SCALE), np.array(RATED), "of the simulated bench"
        )
        self.info = TransducerInfo(
            f"bench:{bench.seed}", "direct", "simulated bench", calibration.serial, True, RATE, RATE, calibration
        )
        self._bench = bench
        self._clock = clock
        self._hurt = hurt or Hurt()
        self._began_ns: int | None = None
        self._stopped = False
        self._sent = 0
        self._lost = 0

    @property
    def health(self) -> Health:
        """Totals so far."""
        return Health(received=self._sent - self._lost, lost=self._lost)

    def now(self) -> float:
        """Return the bench's time [s]."""
        return 0.0 if self._began_ns is None else (self._clock.now_ns() - self._began_ns) * 1e-9

    def start(self) -> None:
        """Begin the stream."""
        self._began_ns = self._clock.now_ns()

    def stop(self) -> None:
        """End the stream."""
        self._stopped = True

    def close(self) -> None:
        """End the stream."""
        self.stop()

    def read(self, timeout: float) -> ReadingBlock:
        """Return the readings that are due, waiting up to `timeout` [s] for the first."""
        if self._began_ns is None or self._stopped:
            return ReadingBlock.empty()
        if self._due == self._sent:
            self._clock.sleep(timeout)
        numbers = np.arange(self._sent, self._due, dtype=np.int64)
        self._sent += len(numbers)
        kept = numbers[~self._within(numbers / RATE, self._hurt.lost)]
        self._lost += len(numbers) - len(kept)
        time = kept / RATE
        instants = np.where(self._within(time, self._hurt.frozen)[:, None], self._frozen_at(time), time[:, None])[:, 0]
        counts = np.rint(self._bench.wrench(instants) / _SCALE)
        received = self._began_ns + np.rint(time * 1e9).astype(np.int64)
        return ReadingBlock(kept, kept, np.zeros_like(kept), time, received, counts)

    @property
    def _due(self) -> int:
        """Readings from 0 that have been taken by now."""
        return int(self.now() * RATE) + 1

    def _within(self, time: NDArray[np.float64], strokes: frozenset[int]) -> NDArray[np.bool_]:
        """Say which instants (n,) [s] lie in the middle of one of the strokes."""
        inside = np.zeros(len(time), np.bool_)
        for start, stop in self._middles(strokes):
            inside |= (time >= start) & (time < stop)
        return inside

    def _frozen_at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the instant (n, 1) [s] whose reading is repeated."""
        at = time[:, None].copy()
        for start, stop in self._middles(self._hurt.frozen):
            at[(time >= start) & (time < stop)] = start
        return at

    def _middles(self, strokes: frozenset[int]) -> list[tuple[float, float]]:
        """Return the middle stretches [s, bench] of those of the strokes that were begun."""
        begun = self._bench.planted() if strokes else ()
        chosen = [stroke for number, stroke in enumerate(begun, 1) if number in strokes]
        return [(s.slip + MIDDLE[0] * (s.lift - s.slip), s.slip + MIDDLE[1] * (s.lift - s.slip)) for s in chosen]
