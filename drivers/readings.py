"""Raw readings: the blocks of a transducer, and the records that a decoder makes from a stream."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from drivers.arrays import Array, Indices, Mask


@dataclass(frozen=True, slots=True, eq=False)
class ReadingBlock:
    """Consecutive readings of one transducer; n of them, possibly none. Arrays are read-only."""

    sequence: Indices  # (n,) record number given by the device, unwrapped; missing numbers are lost readings
    counter: Indices  # (n,) ticks of the device's own clock, unwrapped (its rate: `TransducerInfo.counter_rate`)
    status: Indices  # (n,) status word as the device sent it, 0 = healthy
    time: Array  # (n,) [s] on the device's clock, 0 at the first reading of the stream
    received_ns: Indices  # (n,) [ns] session clock when the reading's bytes arrived
    raw: Array  # (n, 6) six raw values: counts or volts (`Calibration.raw_unit`), exactly representable

    def __post_init__(self) -> None:
        n = len(self.sequence)
        for name in _COLUMNS:
            column = getattr(self, name)
            shape = (n, 6) if name == "raw" else (n,)
            if column.shape != shape:
                raise ValueError(f"{name} has shape {column.shape}, not {shape}")
            view = column.view()
            view.flags.writeable = False
            object.__setattr__(self, name, view)

    def __len__(self) -> int:
        return len(self.sequence)

    def between(self, start: int, stop: int) -> "ReadingBlock":
        """Return the readings at positions start <= i < stop."""
        return ReadingBlock(**{name: getattr(self, name)[start:stop] for name in _COLUMNS})

    def where(self, mask: Mask) -> "ReadingBlock":
        """Return the readings that a mask (n,) marks."""
        return ReadingBlock(**{name: getattr(self, name)[mask] for name in _COLUMNS})

    @staticmethod
    def empty() -> "ReadingBlock":
        """Return a block of no readings."""
        integers = np.empty(0, np.int64)
        return ReadingBlock(integers, integers, integers, np.empty(0), integers, np.empty((0, 6)))

    @staticmethod
    def concatenate(blocks: Iterable["ReadingBlock"]) -> "ReadingBlock":
        """Return the readings of all blocks, in the order given."""
        non_empty = [block for block in blocks if len(block)]
        if not non_empty:
            return ReadingBlock.empty()
        return ReadingBlock(
            **{name: np.concatenate([getattr(block, name) for block in non_empty]) for name in _COLUMNS}
        )


_COLUMNS = tuple(field.name for field in fields(ReadingBlock))


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """Whole records in order of arrival; n of them, possibly none."""

    raw: Array  # (n, 6) six raw values
    status: Indices  # (n,) as the device sent it, 0 = healthy
    damaged: Indices  # (n,) broken records between the previous one and this one

    @staticmethod
    def of(raw: Sequence[tuple[float, ...]], status: list[int], damaged: list[int]) -> "Records":
        """Return records from lists."""
        return Records(
            np.array(raw, np.float64).reshape(-1, 6), np.array(status, np.int64), np.array(damaged, np.int64)
        )


class RecordDecoder(Protocol):
    """Turns the bytes of one stream into records, independently of how the bytes are split. Never raises."""

    @property
    def malformed(self) -> int:
        """Broken records so far, including those at the end of the stream."""

    def feed(self, data: bytes) -> Records:
        """Take bytes and return every record they complete."""
