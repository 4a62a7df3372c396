"""A new HDF5 file on a disk that may fill up."""

# pyright: reportMissingTypeStubs=false

import io
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py


class _Disk(io.RawIOBase):
    """Takes what HDF5 writes, and keeps the first failure: told of it, the library leaves a file it cannot close."""

    def __init__(self, path: Path) -> None:
        """Make the file."""
        self.failure: OSError | None = None
        self._file = path.open("x+b", buffering=0)

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """Go to a place in the file."""
        return self._file.seek(offset, whence)

    def readinto(self, buffer: Any, /) -> int | None:  # noqa: ANN401  whatever has a buffer
        """Read from there."""
        return self._file.readinto(buffer)

    def write(self, data: Any, /) -> int:  # noqa: ANN401
        """Write there, and say that all was written."""
        rest = memoryview(data).cast("B")
        count = len(rest)
        try:
            while self.failure is None and rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self.failure = error
        return count

    def truncate(self, size: int | None = None, /) -> int:
        """Give the file this size."""
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return size or 0

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()


@contextmanager
def new_hdf5(path: Path, **more: Any) -> Generator[h5py.File]:  # noqa: ANN401  what h5py.File takes
    """Lend a new HDF5 file. Raises OSError once it is closed where the disk did not take all."""
    with _Disk(path) as disk:
        try:
            with h5py.File(disk, "w", **more) as file:
                yield file
        except Exception:  # of whatever kind, when what was not written is read again
            if disk.failure is None:
                raise
        if disk.failure is not None:
            raise disk.failure
