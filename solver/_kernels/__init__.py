"""The compiled loops of the solver (numba, cached on disk), and the types and constants they share.

No other module is compiled. Tests compare the loops with plain NumPy versions.
"""

import gc
import os
import signal
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from hashlib import blake2b
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp
from types import FrameType
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from solver.progress import interlude

States = NDArray[np.int8]
Loop = TypeVar("Loop", bound=Callable[..., Any])
Result = TypeVar("Result")

HELD_X, HELD_Y = 1, 2  # flags of a skin node with a prescribed displacement; their sum for both directions
OPEN, STICK, SLIP, SHEAR_LIMITED = 0, 1, 2, 3  # contact states of a skin node
# all of fastmath except nnan and ninf: nan and infinity keep their meaning
_OPTIONS: dict[str, Any] = {
    "fastmath": {"contract", "reassoc", "arcp", "nsz"}, "error_model": "numpy", "no_cfunc_wrapper": True,
}  # fmt: skip
_FOLDER = Path(__file__).parent
_ARRAYS = _FOLDER.parent / "arrays.py"  # types of the loops' arguments


def _cache_folder() -> Path:
    """Return the folder where numba keeps compiled loops: one for each version of their sources.

    To see whether code is outdated, numba checks only the file of a loop, not the functions that the loop calls. The
    process runs the code in the folder, so only the user may have write access. The first such folder is used: the one
    in the environment variable NUMBA_CACHE_DIR, one next to the sources, or one among the user's caches. Without any,
    this process gets an empty folder and compiles everything again.
    """
    from platformdirs import user_cache_path

    sources = blake2b(digest_size=8)
    for file in (*sorted(_FOLDER.glob("*.py")), _ARRAYS):
        sources.update(file.read_bytes())
    version = f"solver-{sources.hexdigest()}"
    setting = os.environ.get("NUMBA_CACHE_DIR")
    user_cache = user_cache_path("daq-app", appauthor=False)
    places = [_FOLDER / "__pycache__", user_cache] if is_private(_FOLDER) else [user_cache]
    if setting:
        places.insert(0, Path(setting).parent if Path(setting).name == version else Path(setting))
    for place in places:
        with suppress(OSError):
            place.mkdir(mode=0o700, parents=True, exist_ok=True)  # `mode` does not apply to new parents
            if place == user_cache:
                place.chmod(0o700)  # another program, or an earlier run, may have made it open to a group
            (place / version).mkdir(mode=0o700, exist_ok=True)
            if all(is_private(folder) for folder in (place, place / version)):
                return place / version
    return Path(mkdtemp(prefix="daq-app-"))


def is_private(folder: Path) -> bool:
    """Return whether only this user may write in `folder`; on systems without file owners, whether this user may."""
    if not os.access(folder, os.W_OK) or not hasattr(os, "getuid"):
        return os.access(folder, os.W_OK)
    status = folder.stat()
    return status.st_uid == os.getuid() and not status.st_mode & 0o022


os.environ["NUMBA_CACHE_DIR"] = str(_cache_folder())  # numba reads it once, at import
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")  # numba colours even errors that it handles
_numba: Any = import_module("numba")
_caching: Any = import_module("numba.core.caching")
events: Any = import_module("numba.core.event")


class _SharedCache(_caching.FunctionCache):
    """Numba's cache on disk with a lock, so that concurrent processes write one after the other.

    Numba reads the index of a loop, adds an entry, and writes it back. Two concurrent processes could lose an entry, or
    make it point to the other's code.
    """

    def save_overload(self, sig: object, data: object) -> None:
        """Save compiled code and its index entry."""
        with _alone(Path(os.environ["NUMBA_CACHE_DIR"])):
            _caching.FunctionCache.save_overload(self, sig, data)


@contextmanager
def _alone(folder: Path) -> Generator[None]:
    """Hold an exclusive lock on `folder` until the block ends, on systems with file locks."""
    with ExitStack() as resources:
        try:
            from fcntl import LOCK_EX, flock

            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            flock(resources.enter_context((folder / "lock").open("w")), LOCK_EX)
        except (ImportError, OSError):  # no file locks here: a loop may be compiled twice
            pass
        yield


def compile_loop(function: Loop) -> Loop:
    """Return `function` as a loop that numba compiles at the first call from Python and caches on disk.

    A loop that calls another loop inlines its source. Without inlining, the version that a process loads first would
    serve all callers. The last bits of a result would then depend on earlier calls, and on whether the process compiled
    or loaded the code. A division by zero gives infinity: an exception would need a branch each time, and a sixth more
    time to compile.
    """
    loop = _numba.njit(**_OPTIONS, inline="always")(function)
    loop._cache = _SharedCache(function)  # noqa: SLF001 - as `cache=True`, with a lock
    return cast("Loop", loop)


def subroutine(function: Loop) -> Loop:
    """Return `function` as a subroutine that LLVM inlines into loops; Python cannot call it.

    It compiles faster than inlined source, once for all loops that call it.
    """
    return cast("Loop", _numba.njit(**_OPTIONS, no_cpython_wrapper=True, forceinline=True)(function))


def bind_arguments(loop: Callable[..., Result], *last: object) -> Callable[..., Result]:
    """Return `loop` with its `last` arguments bound, so that a call inspects the types of the first ones only.

    For thirty arrays, numba's inspection takes five times as long as passing them: a tenth of the work on a small mesh.
    """
    last_kinds = tuple([_kind(argument) for argument in last])
    entries: dict[tuple[object, ...], Callable[..., Result]] = {}

    def call(*first: object) -> Result:
        key = tuple([_kind(argument) for argument in first])
        entry = entries.get(key)
        if entry is None:
            entry = entries[key] = _entry(loop, (key, last_kinds), (*first, *last))
        return entry(*first, *last)

    return call


def _entry(loop: Callable[..., Result], kinds: tuple[object, ...], arguments: tuple[object, ...]) -> Callable[..., Any]:
    """Return the compiled code of a loop for arguments of these `kinds`; compile or load it at first use."""
    entry = _ENTRIES.get((loop, *kinds))
    if entry is None:
        dispatcher: Any = loop
        types = tuple(_numba.typeof(argument) for argument in arguments)
        dispatcher.compile(types)  # or load
        entry = _ENTRIES[loop, *kinds] = dispatcher.overloads[types].entry_point
    return entry


def _kind(argument: Any) -> object:  # noqa: ANN401 - an array, a number, or a tuple of both
    """Return a key that distinguishes numba's types; it is faster to compute than the types."""
    kind: object = argument.__class__
    if kind is np.ndarray:
        return _array_kind(argument)
    if not isinstance(argument, tuple):
        return kind
    parts = cast("tuple[Any, ...]", argument)
    return kind, *[_array_kind(part) if part.__class__ is np.ndarray else part.__class__ for part in parts]


def _array_kind(array: Any) -> object:  # noqa: ANN401 - of any type
    return array.dtype.num, array.ndim, array.flags.num


_ENTRIES: dict[tuple[object, ...], Callable[..., Any]] = {}  # by loop and the kinds of its arguments


class _Compilation(events.Listener):
    """Report which loop numba compiles, and deliver a Ctrl-C that arrives during the compilation.

    Python raises KeyboardInterrupt between two bytecodes. Where LLVM calls back into Python, the exception is printed
    and lost, so it is raised again once the loop is compiled.
    """

    def __init__(self) -> None:
        self._count = 0
        self._open: ExitStack | None = None
        self._loop: object = None
        self._stopped = False

    def on_start(self, event: Any) -> None:  # noqa: ANN401 - numba declares no types
        """Report the loop whose compilation starts, unless it is part of another loop's compilation."""
        loop = event.data["dispatcher"]
        if self._open is not None or loop.py_func.__module__.rpartition(".")[0] != __name__:
            return
        _warn()
        self._count += 1
        self._loop, self._open = loop, ExitStack()
        doing = f"compiling {loop.py_func.__name__}, loop number {self._count}, once on this machine"
        self._open.enter_context(interlude(doing))
        if gc.isenabled():  # numba makes millions of permanent objects: scanning them costs a sixth of the time
            gc.disable()
            self._open.callback(gc.enable)
        self._hear_ctrl_c()

    def on_end(self, event: Any) -> None:  # noqa: ANN401 - numba declares no types
        """Restore the previous progress report; raise KeyboardInterrupt if Ctrl-C came during the compilation."""
        if self._open is None or event.data["dispatcher"] is not self._loop:
            return
        opened, self._open = self._open, None
        opened.close()
        if self._stopped:
            self._stopped = False
            raise KeyboardInterrupt

    def _hear_ctrl_c(self) -> None:
        in_main = threading.current_thread() is threading.main_thread()
        if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler or self._open is None:
            return

        def stop(number: int, frame: FrameType | None) -> None:
            self._stopped = True
            signal.default_int_handler(number, frame)

        signal.signal(signal.SIGINT, stop)
        self._open.callback(signal.signal, signal.SIGINT, signal.default_int_handler)


@cache
def _warn() -> None:
    """Log, once per process, why the first run takes longer."""
    import logging

    logging.getLogger(__name__).warning("Compiling the loops, once on this machine: half a minute if it is not busy.")


events.register("numba:compile", _Compilation())
