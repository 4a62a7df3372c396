"""LAPACK's routines as SciPy wraps them, without the rest of `scipy.linalg`, whose import takes longer than a solve."""

import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

import scipy

_NAME = "scipy.linalg._flapack"


def _loaded() -> ModuleType:
    """Return the wrappers: SciPy's own module, under its own name, whoever imports it first."""
    if _NAME in sys.modules:
        return sys.modules[_NAME]
    folder = Path(scipy.__file__).parent / "linalg"
    spec = PathFinder.find_spec(_NAME, [str(folder)])
    if spec is None or spec.loader is None:  # a SciPy that is laid out otherwise
        from scipy.linalg import lapack

        return lapack
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules[_NAME] = module
    return module


_wrappers = _loaded()
dgesv, dgetrf, dgetrs = _wrappers.dgesv, _wrappers.dgetrf, _wrappers.dgetrs
dposv, dpotrs = _wrappers.dposv, _wrappers.dpotrs
