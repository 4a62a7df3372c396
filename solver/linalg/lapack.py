"""LAPACK's routines as SciPy wraps them, without the rest of `scipy.linalg`, whose import takes longer than a solve."""

from typing import Any

from solver.extension import extension


def _loaded() -> Any:  # noqa: ANN401 - C
    try:
        return extension("scipy.linalg._flapack")
    except ImportError:  # a SciPy that is laid out otherwise, or whose libraries it must find first
        from scipy.linalg import lapack

        return lapack


_wrappers = _loaded()
dgesv, dgetrf, dgetrs = _wrappers.dgesv, _wrappers.dgetrf, _wrappers.dgetrs
dposv, dpotrs = _wrappers.dposv, _wrappers.dpotrs
