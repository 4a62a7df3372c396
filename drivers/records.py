"""Records of a stream that numbers nothing: what a decoder hands on."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """Whole records in the order they came; n of them, possibly none."""

    raw: NDArray[np.float64]  # (n, 6) six raw numbers
    status: NDArray[np.int64]  # (n,) as the device sent it, 0 = healthy
    damaged: NDArray[np.int64]  # (n,) records that came broken between the one before and this one

    @staticmethod
    def of(raw: list[tuple[int, ...]], status: list[int], damaged: list[int]) -> "Records":
        """Return records from lists."""
        return Records(
            np.array(raw, np.float64).reshape(-1, 6), np.array(status, np.int64), np.array(damaged, np.int64)
        )


class RecordDecoder(Protocol):
    """Turns the bytes of one stream into records, however the bytes were cut. Never raises."""

    @property
    def malformed(self) -> int:
        """Records that came broken so far, those at the end of the stream included."""
        ...

    def feed(self, data: bytes) -> Records:
        """Take what arrived and return every record it completes."""
        ...
