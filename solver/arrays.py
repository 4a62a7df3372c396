"""Types of arrays that every module shares."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Narrow = NDArray[np.int32]
Flags = NDArray[np.bool_]
