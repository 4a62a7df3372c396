"""LAPACK's routines as SciPy wraps them, without the rest of `scipy.linalg`, whose import takes longer than a solve."""

import sys
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from types import ModuleType

_NAME = "scipy.linalg._flapack"


def _loaded() -> ModuleType:
    """Return the wrappers: SciPy's own module, under its own name, whoever imports it first."""
    if _NAME in sys.modules:
        return sys.modules[_NAME]
    package = find_spec("scipy")
    folder = Path(package.origin).parent / "linalg" if package is not None and package.origin else Path()
    spec = PathFinder.find_spec(_NAME, [str(folder)])
    try:
        if spec is None or spec.loader is None:
            raise ImportError(f"{_NAME} is not in {folder}")
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    except ImportError:  # a SciPy that is laid out otherwise, or whose libraries it must find first
        from scipy.linalg import lapack

        return lapack
    sys.modules[_NAME] = module
    return module


_wrappers = _loaded()
dgesv, dgetrf, dgetrs = _wrappers.dgesv, _wrappers.dgetrf, _wrappers.dgetrs
dposv, dpotrs = _wrappers.dposv, _wrappers.dpotrs
