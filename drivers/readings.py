"""Raw readings as a transducer gave them, in blocks."""

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class ReadingBlock:
    """Consecutive readings of one transducer; n of them, possibly none. Arrays are read-only."""

    sequence: NDArray[np.int64]  # (n,) record number given by the device, unwrapped; missing numbers are lost readings
    counter: NDArray[np.int64]  # (n,) the device's own clock ticks, unwrapped (its rate: `TransducerInfo.counter_rate`)
    status: NDArray[np.int64]  # (n,) status word as the device sent it, 0 = healthy
    time: NDArray[np.float64]  # (n,) [s] on the device's clock, 0 at the first reading of the stream
    received_ns: NDArray[np.int64]  # (n,) [ns] session clock when the reading's bytes arrived
    raw: NDArray[np.float64]  # (n, 6) six raw numbers: counts or volts (`Calibration.raw_unit`), exactly representable

    def __post_init__(self) -> None:
        """Check that the columns belong together and make them read-only views."""
        n = len(self.sequence)
        for field in fields(self):
            column = getattr(self, field.name)
            expected = (n, 6) if field.name == "raw" else (n,)
            if column.shape != expected:
                raise ValueError(f"{field.name} has shape {column.shape}, not {expected}")
            view = column.view()
            view.flags.writeable = False
            object.__setattr__(self, field.name, view)

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.sequence)

    def between(self, start: int, stop: int) -> "ReadingBlock":
        """Return the readings at positions start <= i < stop."""
        return ReadingBlock(**{f.name: getattr(self, f.name)[start:stop] for f in fields(self)})

    @staticmethod
    def empty() -> "ReadingBlock":
        """Return a block of no readings."""
        whole = np.empty(0, np.int64)
        return ReadingBlock(whole, whole, whole, np.empty(0), whole, np.empty((0, 6)))

    @staticmethod
    def joined(blocks: Iterable["ReadingBlock"]) -> "ReadingBlock":
        """Return the readings of all blocks, in the order given."""
        kept = [block for block in blocks if len(block)]
        if not kept:
            return ReadingBlock.empty()
        names = [f.name for f in fields(ReadingBlock)]
        return ReadingBlock(**{name: np.concatenate([getattr(block, name) for block in kept]) for name in names})
