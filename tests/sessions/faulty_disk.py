"""A file layer under SQLite that fails on demand: the n-th write or sync, or every byte beyond a quota.

It wraps SQLite's own layer (sqlite3_vfs) in the library that Python's sqlite3 uses, hence only where that is a shared
one. Layout of the structures: sqlite3.h, versions 1 to 3 of sqlite3_vfs and sqlite3_io_methods.
"""

import ctypes
import ctypes.util
import sqlite3
from contextlib import contextmanager

OK, FULL = 0, 13
IOERR_WRITE, IOERR_FSYNC = 10 | (3 << 8), 10 | (4 << 8)
Pointer = ctypes.c_void_p
WRITE = ctypes.CFUNCTYPE(ctypes.c_int, Pointer, Pointer, ctypes.c_int, ctypes.c_int64)
SYNC = ctypes.CFUNCTYPE(ctypes.c_int, Pointer, ctypes.c_int)
TRUNCATE = ctypes.CFUNCTYPE(ctypes.c_int, Pointer, ctypes.c_int64)
OPEN = ctypes.CFUNCTYPE(
    ctypes.c_int, Pointer, Pointer, Pointer, ctypes.c_int, Pointer
)  # SQLite keeps the name's address


class Methods(ctypes.Structure):
    """sqlite3_io_methods, of which three entries are replaced."""

    _fields_ = (
        ("version", ctypes.c_int),
        ("close", Pointer),
        ("read", Pointer),
        ("write", WRITE),
        ("truncate", TRUNCATE),
        ("sync", SYNC),
        ("others", Pointer * 13),
    )


class File(ctypes.Structure):
    """sqlite3_file: the pointer to its methods comes first."""

    _fields_ = (("methods", ctypes.POINTER(Methods)),)


class Layer(ctypes.Structure):
    """sqlite3_vfs."""

    _fields_ = (
        ("version", ctypes.c_int),
        ("file_size", ctypes.c_int),
        ("longest_name", ctypes.c_int),
        ("next", Pointer),
        ("name", ctypes.c_char_p),
        ("data", Pointer),
        ("open", OPEN),
        ("others", Pointer * 15),
    )


class FaultyDisk:
    """What the layer counts and when it fails; `fail` takes ("write" or "sync", its number) and returns a code."""

    def __init__(self, fail):
        self.fail = fail
        self.calls = 0
        self._methods = {}  # methods by the address of the original ones; kept alive

    def wrap(self, file):
        """Put our methods into an opened file."""
        original = file.contents.methods
        address = ctypes.addressof(original.contents)
        if address not in self._methods:
            mine = Methods()
            ctypes.memmove(ctypes.byref(mine), original, ctypes.sizeof(Methods))
            mine.write = WRITE(self._failing("write", original.contents.write))
            mine.sync = SYNC(self._failing("sync", original.contents.sync))
            self._methods[address] = mine
        file.contents.methods = ctypes.pointer(self._methods[address])

    def _failing(self, what, original):
        def call(*arguments):
            self.calls += 1
            code = self.fail(what, self.calls, arguments)
            return original(*arguments) if code == OK else code

        return call


def library():
    """Return the SQLite library Python uses; None where it cannot be reached."""
    name = ctypes.util.find_library("sqlite3")
    if name is None:
        return None
    sqlite = ctypes.CDLL(name)
    sqlite.sqlite3_libversion.restype = ctypes.c_char_p
    sqlite.sqlite3_vfs_find.restype = ctypes.POINTER(Layer)
    sqlite.sqlite3_vfs_find.argtypes = (ctypes.c_char_p,)
    sqlite.sqlite3_vfs_register.argtypes = (ctypes.POINTER(Layer), ctypes.c_int)
    sqlite.sqlite3_vfs_unregister.argtypes = (ctypes.POINTER(Layer),)
    # Ours only when Python's own connections see what is registered with it.
    return sqlite if sqlite.sqlite3_libversion().decode() == sqlite3.sqlite_version and _is_shared(sqlite) else None


def _is_shared(sqlite):
    probe = _copy(sqlite)
    probe.name = b"daq-app probe"
    sqlite.sqlite3_vfs_register(ctypes.byref(probe), 0)
    try:
        sqlite3.connect("file::memory:?vfs=daq-app%20probe", uri=True).close()
    except sqlite3.OperationalError:
        return False
    finally:
        sqlite.sqlite3_vfs_unregister(ctypes.byref(probe))
    return True


def _copy(sqlite):
    layer = Layer()
    ctypes.memmove(ctypes.byref(layer), sqlite.sqlite3_vfs_find(None), ctypes.sizeof(Layer))
    return layer


@contextmanager
def faulty_disk(fail):
    """Let every SQLite file opened inside go through a disk that fails as `fail` says."""
    sqlite = library()
    disk = FaultyDisk(fail)
    usual_layer = sqlite.sqlite3_vfs_find(None)
    layer = _copy(sqlite)
    layer.name = b"faulty"
    usual_open = usual_layer.contents.open

    def open_file(_this, name, file, flags, out_flags):
        code = usual_open(ctypes.addressof(usual_layer.contents), name, file, flags, out_flags)
        handle = ctypes.cast(file, ctypes.POINTER(File))
        if code == OK and handle.contents.methods:
            disk.wrap(handle)
        return code

    layer.open = OPEN(open_file)
    sqlite.sqlite3_vfs_register(ctypes.byref(layer), 1)
    try:
        yield disk
    finally:
        sqlite.sqlite3_vfs_unregister(ctypes.byref(layer))
        sqlite.sqlite3_vfs_register(usual_layer, 1)
