"""How the loops are compiled, and the words they share."""

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Narrow = NDArray[np.int32]
Wide = NDArray[np.int64]
Compiled = TypeVar("Compiled", bound=Callable[..., Any])

OPEN, STICK, SLIP, CAP = 0, 1, 2, 3  # states of a node of the skin
_FAST = {"contract", "reassoc", "arcp", "nsz"}  # nan and infinity keep their meaning


def compiled(function: Compiled) -> Compiled:
    """Return `function` compiled when first called, kept on disk; numba itself declares no types."""
    return numba.njit(cache=True, fastmath=_FAST)(function)  # pyright: ignore
