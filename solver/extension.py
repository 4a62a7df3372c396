"""C extensions of other packages, without the rest of these, whose import takes longer than a solve."""

import sys
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from typing import Any


def extension(name: str) -> Any:  # noqa: ANN401 - C
    """Return the C extension of this dotted name: its package's own module, whoever imports it first.

    Raises ImportError where it is not there, or where it does not load without its package.

    >>> extension("scipy.linalg._flapack").__name__
    'scipy.linalg._flapack'
    """
    if name not in sys.modules:
        package, *folders = name.split(".")[:-1]
        folder = package_folder(package).joinpath(*folders)
        spec = PathFinder.find_spec(name, [str(folder)])
        if spec is None or spec.loader is None:
            raise ImportError(f"{name} is not in {folder}")
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules[name] = module
    return sys.modules[name]


def package_folder(package: str) -> Path:
    """Return where a package is installed, without importing it. Raises ModuleNotFoundError."""
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(f"{package} is not installed", name=package)
    return Path(spec.submodule_search_locations[0])
