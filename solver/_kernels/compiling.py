"""How the loops are compiled, once on a machine, and the words they share."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, update_wrapper
from importlib import import_module
from pathlib import Path
from threading import Lock
from types import FunctionType
from typing import Any, ClassVar, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from solver._kernels import keeping
from solver.progress import aside
from solver.uninterrupted import beside

Array = NDArray[np.float64]
Narrow = NDArray[np.int32]
Wide = NDArray[np.int64]
Flags = NDArray[np.bool_]
States = NDArray[np.int8]
Compiled = TypeVar("Compiled", bound=Callable[..., Any])
Result = TypeVar("Result")

HELD_X, HELD_Y = 1, 2  # of a node of the skin that is held; both: their sum
OPEN, STICK, SLIP, SHEAR_LIMITED = 0, 1, 2, 3  # states of a node of the skin
_FAST = {"contract", "reassoc", "arcp", "nsz"}  # nan and infinity keep their meaning
_ONE_BY_ONE = Lock()  # neither numba's compiler nor LLVM's linker likes company


def compiled(function: Compiled) -> Compiled:
    """Return `function` as a compiled loop: numba compiles it where its machine code is not kept on disk.

    What a loop calls is compiled into it. Else each loop's code would hold a copy of what it calls, optimised once
    more, the copy a process loads first would serve all, and last bits would fall by what was called first.
    """
    return cast("Compiled", Loop(cast("FunctionType", function)))


class Loop:
    """A compiled loop. What is kept on disk is called without numba, whose import takes longer than a solve."""

    _all: ClassVar[list["Loop"]] = []
    _compiled: ClassVar[int] = 0  # in this process

    def __init__(self, function: FunctionType) -> None:
        """Compile nothing yet."""
        self.function = function
        self._entries: dict[tuple[object, ...], Callable[..., Any]] = {}
        self._without_numba = True  # until that is seen to fail
        self._all.append(self)
        update_wrapper(self, function)

    def __call__(self, *given: object) -> Any:  # noqa: ANN401 - each returns what its function says
        """Call the code for arguments of these types; it believes what it is told of them, so all are looked at."""
        kinds = _kinds(given)
        entry = self._entries.get(kinds)
        if entry is None:
            entry = self._entries[kinds] = self.entry(given)
        return entry(*given)

    def entry(self, given: tuple[object, ...]) -> Callable[..., Any]:
        """Return the code for arguments of the types of those `given`. Raises TypeError where loops take none such."""
        for number, argument in enumerate(given):
            if not isinstance(argument, np.ndarray | np.number | np.bool | bool | int | float):
                kind = type(argument).__name__
                raise TypeError(
                    f"argument {number} of {self.function.__name__} is a {kind}; loops take numbers and arrays"
                )
        types = tuple(_type_name(a) for a in given)
        if types not in self._entries and not self._found(types):  # kinds of numbers may differ where types do not
            _warn()
            Loop._compiled += 1
            with aside(self._told()):
                beside(lambda: self._compile(types))
        return self._entries[types]

    def _found(self, types: tuple[str, ...]) -> bool:
        """Take the code for arguments of these `types` from the disk; return whether it was there."""
        with _ONE_BY_ONE:
            if types not in self._entries:
                kept = self._kept(types)
                if kept is not None:
                    self._entries[types] = kept
            return types in self._entries

    def _kept(self, types: tuple[str, ...]) -> Callable[..., Any] | None:
        """Return the code that is on the disk, None where there is none.

        Where it is not known how to link it without numba, or that fails, numba does all its own way.
        """
        if self._without_numba and keeping.known():
            try:
                return keeping.linked(self._place(types))
            except Exception:  # noqa: BLE001 - whatever it is: numba can do
                pass
        self._without_numba = False
        dispatcher = self.dispatcher(cached=True)
        kept = Path(dispatcher.stats.cache_path or "").glob(f"*{self.function.__name__}-*.nbi")
        return dispatcher if any(kept) else None

    def _compile(self, types: tuple[str, ...]) -> None:
        """Compile for arguments of these `types`, unless another thread just has, and keep the code on disk."""
        with _ONE_BY_ONE:
            if types in self._entries:
                return
            if self._without_numba:
                with suppress(Exception):  # as above
                    entry, made = self._made(types)
                    keeping.keep(self._place(types), *made)
                    self._entries[types] = entry
                    return
            dispatcher = self.dispatcher(cached=True)
            dispatcher.compile(_signature(types))
            self._entries[types] = dispatcher

    def _place(self, types: tuple[str, ...]) -> keeping.Place:
        name = f"{Path(self.function.__code__.co_filename).stem}.{self.function.__name__}"
        return keeping.Place(name, types, self.sources())

    def _told(self) -> str:
        """Say which loop is being compiled: its number in this process, of all that are called by no other."""
        inside = {called.function for one in self._all for called in one.calls()}
        most = max(len({one.function for one in self._all} - inside), Loop._compiled)
        return f"compiling {self.function.__name__}, loop {Loop._compiled} of {most} at most, once on this machine"

    def _made(self, types: tuple[str, ...]) -> tuple[Callable[..., Any], tuple[bytes, str, str, list[str]]]:
        """Compile for arguments of these `types`; return the code to call, and what `keeping.keep` asks for."""
        signature = _signature(types)
        dispatcher = self.dispatcher(cached=False)
        dispatcher.compile(signature)
        made: Any = dispatcher.overloads[signature]
        code, module = made.library.serialize_using_object_code()[2]
        assert not made.environment.consts, "a loop may not return a new array: it would need numba to run"
        functions: Any = import_module("llvmlite.binding").parse_bitcode(module).functions
        declared = [str(one.name) for one in functions if one.is_declaration]
        outside = [name for name in declared if not name.startswith("llvm.")]
        return made.entry_point, (code, made.fndesc.llvm_cpython_wrapper_name, made.fndesc.env_name, outside)

    @cache  # noqa: B019 - loops live as long as the process
    def dispatcher(self, *, cached: bool) -> Any:  # noqa: ANN401 - numba declares no types
        """Return numba's own view of this loop, and of the loops that it calls; `cached` on disk in numba's way."""
        numba: Any = import_module("numba")
        others: dict[str, Any] = {loop.function.__name__: loop.dispatcher(cached=cached) for loop in self.calls()}
        known: dict[str, Any] = self.function.__globals__ | others
        twin = FunctionType(self.function.__code__, known, self.function.__name__)
        return numba.njit(fastmath=_FAST, forceinline=True, cache=cached)(twin)

    def sources(self) -> frozenset[str]:
        """Return the files that this loop is made of: its own, this one, and those of the loops it calls."""
        return frozenset({__file__, self.function.__code__.co_filename}).union(*(c.sources() for c in self.calls()))

    def calls(self) -> Iterator["Loop"]:
        """Return the loops that it calls, which are compiled into it."""
        named = (self.function.__globals__.get(name) for name in self.function.__code__.co_names)
        return (one for one in named if isinstance(one, Loop))


def _signature(types: tuple[str, ...]) -> Any:  # noqa: ANN401 - numba declares no types
    return import_module("numba.core.sigutils").normalize_signature(f"({', '.join(types)},)")[0]


def ending(loop: Callable[..., Result], *last: object) -> Callable[..., Result]:
    """Return `loop` with its `last` arguments given for good, so that only the first are looked at in every call.

    To look at thirty arrays takes as long as a tenth of the work on a small mesh.
    """
    entries: dict[tuple[object, ...], Callable[..., Result]] = {}

    def call(*first: object) -> Result:
        kinds = _kinds(first)
        entry = entries.get(kinds)
        if entry is None:
            entry = entries[kinds] = cast("Loop", loop).entry((*first, *last))
        return entry(*first, *last)

    return call


def _kinds(given: tuple[object, ...]) -> tuple[object, ...]:
    return tuple([(a.dtype.num, a.ndim, a.flags.c_contiguous) if type(a) is np.ndarray else type(a) for a in given])


def _type_name(argument: object) -> str:
    """Return what numba calls the type of an argument.

    >>> _type_name(np.zeros((2, 3))), _type_name(np.zeros(4, np.int32)[::2]), _type_name(np.float64(0.5))
    ('float64[:, ::1]', 'int32[:]', 'float64')
    """
    if isinstance(argument, np.ndarray):
        array = cast("NDArray[Any]", argument)
        last = "::1" if array.flags.c_contiguous else ":"
        return f"{_scalar_name(array.dtype)}[{', '.join([':'] * (array.ndim - 1) + [last])}]"
    return _scalar_name(np.dtype(type(argument)))


def _scalar_name(dtype: "np.dtype[Any]") -> str:
    return {"b": "boolean", "i": f"int{8 * dtype.itemsize}", "f": f"float{8 * dtype.itemsize}"}[dtype.kind]


@cache
def _warn() -> None:
    """Say, once a process, why the first run ever takes so long."""
    import logging

    logging.getLogger(__name__).warning("Compiling the loops, once on this machine: a minute, more if it is busy.")
