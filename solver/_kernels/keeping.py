"""Machine code of the loops: kept on disk, and linked into a process by LLVM alone, without numba.

What numba makes of a loop is an object file whose function takes Python's arguments, numbers and arrays, and asks for
a few helpers: Python's, the C library's, and those of three C extensions of numba. These three are loaded without the
rest of it. Numba promises none of this, so code is only ever linked with the very version that made it, and only where
all that it asks for is known; otherwise the loop is compiled again, in the process that wants it.
"""

import builtins
import ctypes
import json
import os
import re
import sys
import sysconfig
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import blake2b
from importlib import import_module
from pathlib import Path
from typing import Any

from solver.extension import extension, package_folder

_EXTENSIONS = {  # of numba, and what it calls their helpers
    "numba._helperlib": "numba_",
    "numba._dynfunc": "numba_",
    "numba.core.runtime._nrt_python": "NRT_",
}
_ENDING = ".loop"
KNOWN = ("0.68",)  # numbers of numba, but for the last, whose code was watched being linked; on Linux


def known() -> bool:
    """Return whether code of this numba, on this system, may be linked without it."""
    version = re.search(rb'"version": "(\d+\.\d+)\.', _content(package_folder("numba") / "_version.py"))
    return sys.platform == "linux" and version is not None and version[1].decode() in KNOWN


@dataclass(frozen=True)
class Place:
    """Where the code of a loop is kept."""

    name: str  # module.function
    types: tuple[str, ...]  # of its arguments
    sources: frozenset[str]  # the files it is made of

    @cached_property
    def label(self) -> str:
        """Beginning of the file's name: the loop, for whom, and for which arguments."""
        return f"{self.name}-{_digest(*_machine(), *(t.encode() for t in self.types))}-"

    @cached_property
    def file(self) -> str:
        """Name of the file, which changes with the sources."""
        return f"{self.label}{_digest(*(_content(source) for source in sorted(self.sources)))}{_ENDING}"

    def folders(self) -> Iterator[Path]:
        """Return the folders it may be in: beside Python's own compiled code; the user's, where nobody may write there.

        The environment variable NUMBA_CACHE_DIR, which numba knows, stands before them.
        """
        if told := os.environ.get("NUMBA_CACHE_DIR"):
            yield Path(told)
        yield Path(__file__).parent / "__pycache__"
        from platformdirs import user_cache_path

        yield user_cache_path("daq-app", appauthor=False)


def linked(place: Place) -> Callable[..., Any] | None:
    """Return the kept code as a function; None where there is none that can be linked here."""
    for folder in place.folders():
        kept = _read(folder / place.file)
        if kept is not None:
            return _linked(place, *kept)
    return None


def keep(place: Place, code: bytes, wrapper: str, environment: str, outside: list[str]) -> None:
    """Keep an object file in the first folder that takes it, in place of those of earlier sources.

    `wrapper` is the function in it that takes Python's arguments, `environment` the variable that points to its
    globals, `outside` the functions it asks for.
    """
    from tempfile import mkstemp

    told = {"digest": _digest(code), "wrapper": wrapper, "environment": environment, "outside": outside}
    for folder in place.folders():
        with suppress(OSError):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle, name = mkstemp(dir=folder)  # others may be writing the same
            os.close(handle)
            new = Path(name)
            try:
                new.write_bytes(json.dumps(told).encode() + b"\n" + code)
                new.replace(folder / place.file)
            finally:
                new.unlink(missing_ok=True)
            for other in folder.glob(f"{place.label}*{_ENDING}"):
                if other.name != place.file:
                    other.unlink(missing_ok=True)
            return


def _read(file: Path) -> tuple[bytes, str, str, list[str]] | None:
    """Return what `keep` was given; None where the file is not there, or is not what `keep` wrote."""
    try:
        head, _, code = file.read_bytes().partition(b"\n")
        told = json.loads(head)
        if told["digest"] != _digest(code):
            return None
        return code, told["wrapper"], told["environment"], told["outside"]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _linked(place: Place, code: bytes, wrapper: str, environment: str, outside: list[str]) -> Callable[..., Any] | None:
    llvm, engine = _llvm(), _engine()
    if any(llvm.address_of_symbol(name) is None for name in outside):
        return None  # LLVM would end the process
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    dynamic: Any = extension("numba._dynfunc")
    around = dynamic.Environment({})
    ctypes.c_void_p.from_address(engine.get_global_value_address(environment)).value = id(around)
    module, name = sys.modules[__name__], place.name.rpartition(".")[2]
    return dynamic.make_function(
        module, name, place.name, engine.get_function_address(wrapper), around, (engine, around)
    )


@cache
def _engine() -> Any:  # noqa: ANN401 - llvmlite declares no types
    """Return LLVM's linker, with the helpers that numba's code asks for."""
    llvm = _llvm()
    for name, prefix in _EXTENSIONS.items():
        for helper, address in extension(name).c_helpers.items():
            llvm.add_symbol(helper if helper.startswith("_") else prefix + helper, address)
    for name, one in vars(builtins).items():
        if isinstance(one, type) and issubclass(one, BaseException):
            llvm.add_symbol(f"PyExc_{name}", id(one))
    llvm.add_symbol("_Py_NoneStruct", id(None))
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(opt=3, jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


@cache
def _machine() -> tuple[bytes, ...]:
    """Return what code is made for and by: this processor, Python, numba and LLVM."""
    llvm = _llvm()
    processor = f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"
    python = f"{sys.version} {sysconfig.get_platform()}"
    linker: str = import_module("llvmlite").__version__
    return processor.encode(), python.encode(), linker.encode(), _content(package_folder("numba") / "_version.py")


def _llvm() -> Any:  # noqa: ANN401 - llvmlite declares no types
    return import_module("llvmlite.binding")


@cache
def _content(file: str | Path) -> bytes:
    return Path(file).read_bytes()


def _digest(*parts: bytes) -> str:
    return blake2b(b"\0".join(parts), digest_size=8).hexdigest()
