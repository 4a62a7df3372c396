"""How numba compiles the loops, once on a machine, and the types and constants they share."""

import os
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager, suppress
from hashlib import blake2b
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

States = NDArray[np.int8]
Loop = TypeVar("Loop", bound=Callable[..., Any])
Result = TypeVar("Result")

HELD_X, HELD_Y = 1, 2  # of a node of the skin that is held; both: their sum
OPEN, STICK, SLIP, SHEAR_LIMITED = 0, 1, 2, 3  # states of a node of the skin
# nan and infinity keep their meaning
_OPTIONS: dict[str, Any] = {
    "fastmath": {"contract", "reassoc", "arcp", "nsz"}, "error_model": "numpy", "no_cfunc_wrapper": True,
}  # fmt: skip
_FOLDER = Path(__file__).parent
_ARRAYS = _FOLDER.parent / "arrays.py"  # what the loops take


def _cache_folder() -> Path:
    """Return where numba keeps compiled loops: one folder for each version of their sources.

    Numba looks at a loop's own file alone to see whether its code is out of date, and not at what the loop calls. The
    folder is the first of these in which nobody but the user may write, since the process runs what lies there: the one
    that the environment variable NUMBA_CACHE_DIR names, one beside the sources, one among the user's own caches, and
    else an empty one of this process, in which everything is compiled again.
    """
    from platformdirs import user_cache_path

    sources = blake2b(digest_size=8)
    for file in (*sorted(_FOLDER.glob("*.py")), _ARRAYS):
        sources.update(file.read_bytes())
    version = f"solver-{sources.hexdigest()}"
    named = os.environ.get("NUMBA_CACHE_DIR")
    places = [_FOLDER / "__pycache__"] if only_mine(_FOLDER) else []
    places.append(user_cache_path("daq-app", appauthor=False))
    if named:
        places.insert(0, Path(named).parent if Path(named).name == version else Path(named))
    for place in places:
        with suppress(OSError):
            (place / version).mkdir(mode=0o700, parents=True, exist_ok=True)
            if all(only_mine(folder) for folder in (place, place / version)):
                return place / version
    return Path(mkdtemp(prefix="daq-app-"))


def only_mine(folder: Path) -> bool:
    """Return whether this user may write in `folder` and no other may, where the system has owners of files."""
    if not os.access(folder, os.W_OK) or not hasattr(os, "getuid"):
        return os.access(folder, os.W_OK)
    status = folder.stat()
    return status.st_uid == os.getuid() and not status.st_mode & 0o022


os.environ["NUMBA_CACHE_DIR"] = str(_cache_folder())  # numba reads it once, when it is imported
_numba: Any = import_module("numba")
_caching: Any = import_module("numba.core.caching")
events: Any = import_module("numba.core.event")


class _SharedCache(_caching.FunctionCache):
    """Numba's cache on disk, which processes that start together write one after the other.

    Numba reads the index of a loop, adds an entry, and writes it back: two processes at once could lose an entry, or
    point it to the other's code.
    """

    def save_overload(self, sig: object, data: object) -> None:
        """Keep compiled code and its entry in the index."""
        with _alone(Path(os.environ["NUMBA_CACHE_DIR"])):
            _caching.FunctionCache.save_overload(self, sig, data)


@contextmanager
def _alone(folder: Path) -> Generator[None]:
    """Keep other processes of this machine out until the block ends, where the system has such locks."""
    with ExitStack() as held:
        try:
            from fcntl import LOCK_EX, flock

            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            flock(held.enter_context((folder / "lock").open("w")), LOCK_EX)
        except (ImportError, OSError):  # no such locks here: code may be compiled once more
            pass
        yield


def compile_loop(function: Loop) -> Loop:
    """Return `function` as a loop that numba compiles when Python first calls it, and keeps on disk.

    In another loop that calls it, it is copied: of two versions of it in two loops, the one that a process loads first
    would serve both, so that the last bits of a result would depend on what was called before, and on whether this
    process compiled or loaded them. A division by zero makes infinity: to raise would take a branch each time, and a
    sixth more time to compile.
    """
    loop = _numba.njit(**_OPTIONS, inline="always")(function)
    loop._cache = _SharedCache(function)  # noqa: SLF001 - what `cache=True` does, with a lock
    return cast("Loop", loop)


def subroutine(function: Loop) -> Loop:
    """Return `function` as a part of loops, into which LLVM copies it; Python cannot call it.

    That takes less time to compile than to copy its source, but hides the shapes of small arrays from LLVM.
    """
    return cast("Loop", _numba.njit(**_OPTIONS, no_cpython_wrapper=True, forceinline=True)(function))


def bind_arguments(loop: Callable[..., Result], *last: object) -> Callable[..., Result]:
    """Return `loop` with its `last` arguments given for good, so that only the first are looked at in every call.

    For numba to look at thirty arrays takes five times as long as to hand them over, and as long as a tenth of the
    work on a small mesh.
    """
    ending = tuple([_kind(argument) for argument in last])
    mine: dict[tuple[object, ...], Callable[..., Result]] = {}

    def call(*first: object) -> Result:
        key = tuple([_kind(argument) for argument in first])
        entry = mine.get(key)
        if entry is None:
            entry = mine[key] = _entry(loop, (key, ending), (*first, *last))
        return entry(*first, *last)

    return call


def _entry(loop: Callable[..., Result], kinds: tuple[object, ...], arguments: tuple[object, ...]) -> Callable[..., Any]:
    """Return the code of a loop for arguments of these `kinds`, compiled or loaded where it is not there yet."""
    entry = _ENTRIES.get((loop, *kinds))
    if entry is None:
        dispatcher: Any = loop
        types = tuple(_numba.typeof(argument) for argument in arguments)
        dispatcher.compile(types)  # or load
        entry = _ENTRIES[loop, *kinds] = dispatcher.overloads[types].entry_point
    return entry


def _kind(argument: Any) -> object:  # noqa: ANN401 - an array, a number, or a tuple of both
    """Return what tells apart the types that numba knows, found faster than these."""
    kind: object = argument.__class__
    if kind is np.ndarray:
        return _array_kind(argument)
    if not isinstance(argument, tuple):
        return kind
    parts = cast("tuple[Any, ...]", argument)
    return kind, *[_array_kind(one) if one.__class__ is np.ndarray else one.__class__ for one in parts]


def _array_kind(array: Any) -> object:  # noqa: ANN401 - of any type
    return array.dtype.num, array.ndim, array.flags.num


_ENTRIES: dict[tuple[object, ...], Callable[..., Any]] = {}  # by loop and the kinds of its arguments
