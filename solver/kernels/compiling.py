"""How the loops are compiled and kept on disk, and the words they share."""

import logging
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys
from numpy.typing import NDArray

Array = NDArray[np.float64]
Narrow = NDArray[np.int32]
Wide = NDArray[np.int64]
Flags = NDArray[np.bool_]
States = NDArray[np.int8]
Compiled = TypeVar("Compiled", bound=Callable[..., Any])

HELD_X, HELD_Y = 1, 2  # of a node of the skin that is held; both: their sum
OPEN, STICK, SLIP, CAP = 0, 1, 2, 3  # states of a node of the skin
_FAST = {"contract", "reassoc", "arcp", "nsz"}  # nan and infinity keep their meaning


class _Kept(FunctionCache):
    """Machine code on disk, read without what numba knows of Python's and NumPy's functions.

    Numba loads all of that first, SciPy's linear algebra with it, which takes longer than a solve. Only compiling needs
    it, and loads it itself.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:  # noqa: ANN401 - numba declares no types
        """Return the code for argument types `sig`; None where it is not on disk."""
        # what loops need while they run: the memory of arrays
        rtsys.initialize(target_context)  # pyright: ignore[reportUnknownMemberType]
        with self._guard_against_spurious_io_errors():
            kept = super()._load_overload(sig, target_context)  # pyright: ignore
        if kept is None:
            _tell()
        return kept  # pyright: ignore


@cache
def _tell() -> None:
    """Say, once a process, why the first run ever takes so long."""
    logging.getLogger(__name__).warning("Compiling the loops, once on this machine: a minute, more if it is busy.")


def compiled(function: Compiled) -> Compiled:
    """Return `function` compiled when first called, kept on disk; numba itself declares no types.

    What a loop calls is compiled into it. Else each loop's code would hold a copy of what it calls, optimised once
    more, the copy a process loads first would serve all, and last bits would fall by what was called first.
    """
    loop: Any = numba.njit(fastmath=_FAST, forceinline=True)(function)  # pyright: ignore
    loop._cache = _Kept(function)  # noqa: SLF001 - what njit(cache=True) does, with its own class
    return loop
