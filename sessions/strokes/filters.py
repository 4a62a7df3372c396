"""A zero-phase low-pass filter and peaks that stand out, by SciPy's compiled loops.

They are loaded without the rest of `scipy.signal`, whose import takes ten times as long as the analysis of a session.
A SciPy that is laid out otherwise is asked by its front door.
"""

import sys
from functools import cache
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def low_pass(values: Array, cut_off: float, rate: float, padding: int) -> Array:
    """Return values (n, k) through a second-order Butterworth low-pass, forwards and then backwards.

    One pass is 3 dB down at `cut_off` [Hz], by the bilinear transform for readings at `rate` [Hz]. Both ends are
    carried on by `padding` < n readings, turned about the end; the filter begins settled on the first of them.
    """
    bent = float(np.tan(np.pi * cut_off / rate))
    whole = 1.0 + np.sqrt(2.0) * bent + bent * bent
    gain = bent * bent / whole
    back, further = 2.0 * (bent * bent - 1.0) / whole, (1.0 - np.sqrt(2.0) * bent + bent * bent) / whole
    sections = np.array([[gain, 2.0 * gain, gain, 1.0, back, further]])
    compiled = _compiled("_sosfilt", "_sosfilt")
    if compiled is None:
        from scipy import signal

        return signal.sosfiltfilt(sections, values, axis=0, padlen=padding)
    first, last = 2.0 * values[:1] - values[padding:0:-1], 2.0 * values[-1:] - values[-2 : -padding - 2 : -1]
    rows = np.ascontiguousarray(np.concatenate([first, values, last]).T)  # (k, n + 2 padding), filtered in place
    settled = np.array([1.0 - gain, gain - further])  # what the filter holds of a value that never changed
    for _ in range(2):
        compiled(sections, rows, (rows[:, :1] * settled)[:, None, :])
        rows = np.ascontiguousarray(rows[:, ::-1])
    return rows.T[padding : len(rows[0]) - padding]


def peaks(values: Array) -> tuple[NDArray[np.intp], Array]:
    """Return where values (n,) are greatest among their neighbours (p,), and how far each stands out of them (p,)."""
    maxima, prominences = (_compiled("_peak_finding_utils", name) for name in ("_local_maxima_1d", "_peak_prominences"))
    if maxima is None or prominences is None:
        from scipy import signal

        places, properties = signal.find_peaks(values, prominence=0.0)
        return places, properties["prominences"]
    places = maxima(values)[0]
    return places, prominences(values, places, -1)[0]


@cache
def _compiled(module: str, function: str) -> Any:  # noqa: ANN401 - compiled, without types
    """Return a compiled function of `scipy.signal`, None where this SciPy has it elsewhere."""
    name = f"scipy.signal.{module}"
    if name not in sys.modules:
        package = find_spec("scipy")
        folder = Path(package.origin).parent / "signal" if package is not None and package.origin else Path()
        spec = PathFinder.find_spec(name, [str(folder)])
        if spec is None or spec.loader is None:
            return None
        loaded = module_from_spec(spec)
        try:
            spec.loader.exec_module(loaded)
        except ImportError:  # a SciPy whose libraries it must find first
            return None
        sys.modules[name] = loaded
    return getattr(sys.modules[name], function, None)
