"""Bounded reading of files, atomic writing of files and folders, and remedies for file errors."""

import errno
import gzip
import json
import math
import os
import re
import secrets
import shutil
import sqlite3
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NoReturn, TypeVar, cast

import msgspec

LARGEST_TEXT = 4 * 2**20  # of a file that people write [bytes]: the longest built-in protocol is a thousandth of it
LARGEST_TABLE = 512 * 2**20  # of a CSV file [bytes]: an hour of readings at 2 kHz with seven columns
LARGEST_DOCUMENT = 256 * 2**20  # of a file that programs write [bytes]: a session of an hour takes a tenth of it

LONGEST_LINE = 2**24  # of a table [characters]: an answer with 100 000 positions takes a quarter
MOST_PACKED = 300  # largest ratio of unpacked to packed size [-]: about 10 for readings, 1000 for zeros
# Raised on opening or reading a database; the second where the name of a damaged table is not UTF-8.
DATABASE_FAILURES = (sqlite3.Error, UnicodeDecodeError, OSError)

_RESTORE = "restore it from a copy"
_OF_NEW = dict.fromkeys((errno.ENOENT, errno.EISDIR, errno.ENOTDIR, errno.EEXIST), "check its name") | {
    errno.EFBIG: "raise the limit of the size of files"
}
_OTHER = "check its name, its disk and who may use it"
_REMEDIES: tuple[tuple[str, tuple[int, ...], tuple[int, ...]], ...] = (  # for what the system and SQLite report
    ("free space on the disk", (errno.ENOSPC, errno.EDQUOT), (sqlite3.SQLITE_FULL,)),
    (
        "permit reading and writing there",
        (errno.EACCES, errno.EPERM, errno.EROFS),
        (sqlite3.SQLITE_PERM, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_AUTH),
    ),
    ("check the disk and its cable", (errno.EIO,), (sqlite3.SQLITE_IOERR,)),
    ("end the program that uses it", (errno.EBUSY,), (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)),
    ("give the file that was meant", (errno.EFBIG, errno.EISDIR, errno.ENOTDIR, errno.EEXIST), ()),
    ("restore it from a copy, or give another name", (errno.ENOENT,), ()),
    (_OTHER, (), (sqlite3.SQLITE_CANTOPEN,)),
)
_BY_ERRNO = {number: advice for advice, numbers, _ in _REMEDIES for number in numbers}
_BY_SQLITE = {code: advice for advice, _, codes in _REMEDIES for code in codes}


def read_within_limit(path: Path, limit: int = LARGEST_DOCUMENT) -> bytes:
    """Return the bytes of a file, which may be a pipe. Raises OSError, also where there are more than `limit`."""
    with path.open("rb") as file:
        if os.fstat(file.fileno()).st_size <= limit and len(content := file.read(limit + 1)) <= limit:
            return content
    raise OSError(errno.EFBIG, f"it holds more than {limit / 2**20:.0f} MB", str(path))


def open_new(path: Path) -> BinaryIO:
    """Create a file for writing; a file or link of that name is removed first, and no link is followed."""
    path.unlink(missing_ok=True)
    return path.open("xb")


def gzip_lines(path: Path) -> Iterator[str]:
    """Yield the lines of a table packed by gzip. Raises OSError, ValueError where it unpacks to too much."""
    size, limit = 0, MOST_PACKED * path.stat().st_size + LARGEST_TEXT
    with gzip.open(path, "rt", encoding="utf-8") as file:
        while line := file.readline(LONGEST_LINE):
            size += len(line)
            if len(line) == LONGEST_LINE or size > limit:
                raise ValueError(f"{path.name} unpacks to more than readings can")
            yield line


def limit_values(connection: sqlite3.Connection) -> sqlite3.Connection:
    """Limit the size of a connection's values, let it return texts that are no UTF-8, and return it."""
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_DOCUMENT)
    # A damaged text then fails its check sum alone, instead of making its whole table unreadable.
    connection.text_factory = partial(str, encoding="utf-8", errors="surrogateescape")
    return connection


def remedy(error: Exception, *, new: bool = False) -> str:
    """Return the remedy for a file that could not be read or written, or a `new` one that could not be created.

    >>> remedy(OSError(errno.EIO, "")), remedy(PermissionError(errno.EACCES, ""))
    ('check the disk and its cable', 'permit reading and writing there')
    """
    if isinstance(error, (sqlite3.Error, UnicodeDecodeError)):
        code: int | None = getattr(error, "sqlite_errorcode", None)  # None where Python raised the error itself
        return _RESTORE if code is None else _BY_SQLITE.get(code & 0xFF, _RESTORE)  # the low byte is the kind
    number: int | None = getattr(error, "errno", None)
    if number is None and (match := re.search(r"errno = (\d+)", str(error))):  # as HDF5 reports it
        number = int(match.group(1))
    return (_BY_ERRNO | _OF_NEW if new else _BY_ERRNO).get(number or 0, _OTHER)


def failure_sentence(error: OSError) -> str:
    """Return a sentence about a file that could not be read or written: its name, the cause and the remedy.

    >>> failure_sentence(FileNotFoundError(errno.ENOENT, "No such file or directory", "a/b.png"))
    'a/b.png: no such file or directory; check its name'
    """
    if error.filename is None or error.strerror is None:
        return str(error)
    return f"{error.filename}: {error.strerror[:1].lower()}{error.strerror[1:]}; {remedy(error, new=True)}"


@contextmanager
def name_failure(
    error_type: type[Exception],
    problem: str,
    advice: str = "",
    failures: tuple[type[Exception], ...] = (OSError,),
    *,
    new: bool = False,
) -> Generator[None]:
    """Raise `error_type` for a failure inside, with a sentence of `problem`, cause, remedy and `advice`."""
    try:
        yield
    except failures as error:
        cause = getattr(error, "strerror", None) or error
        raise error_type(f"{problem} ({cause}); {remedy(error, new=new)}{advice}") from error


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write indented JSON in UTF-8. Raises ValueError for nan and infinities, which JSON lacks."""
    path.write_text(json_text(document), encoding="utf-8")


def json_text(document: Mapping[str, Any]) -> str:
    """Return indented JSON. Raises ValueError for nan and infinities, which JSON lacks."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_whole(path: Path, content: bytes) -> None:
    """Replace the content of the file at `path` atomically: a reader sees the old or the new.

    A device or a pipe, such as /dev/null, is written to directly.
    """
    if path.exists() and not path.is_file():
        path.write_bytes(content)
        return
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open_new(temporary) as file:
            file.write(content)
        put_in_place(temporary, path)
    except OSError as error:  # as on a full disk, where half a file would only take space
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        error.filename, error.filename2 = str(path), None  # the name that people know
        raise


class NotOurs(Exception):
    """A file of another origin would be overwritten; the message names it and says what to do."""


_MARK_LINES = 3  # lines at the head of a file: in our pictures the mark is in the third
_MARK_BYTES = 4096  # bytes that hold them


def check_replaceable(path: Path, mark: str, *companions: Path) -> None:
    """Raise NotOurs where a file that would be written over is not ours: no line at its head begins with `mark`.

    `companions` are written after it and bear no mark: they are ours where it is.
    """
    head = b""
    if path.is_file() or path.is_dir():
        with name_failure(NotOurs, f"{path} cannot be written over"), path.open("rb") as file:
            head = file.read(_MARK_BYTES)
    if any(line.startswith(mark.encode()) for line in head.splitlines()[:_MARK_LINES]):
        return
    for file in (*([path] if head else []), *companions):
        if file.exists():
            raise NotOurs(f"{file} holds something else, so it is left alone: choose another file or folder")


def holds_something(folder: Path) -> bool:
    """Say whether a new folder would replace something at `folder`."""
    return folder.exists() and (not folder.is_dir() or any(folder.iterdir()))


@contextmanager
def whole_folder(folder: Path) -> Generator[Path]:
    """Lend a new folder that takes the name `folder`, free or empty so far, once it is complete; else it is removed.

    Of two at the same time the first to be complete gets the name; the other raises FileExistsError.
    """
    temporary = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.part")
    try:
        temporary.mkdir(parents=True)  # fails on a link, which would lead elsewhere
        yield temporary
        if holds_something(folder):
            raise FileExistsError(errno.EEXIST, "another program has written there meanwhile", str(folder))
        if folder.exists():
            folder.rmdir()
        temporary.replace(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def whole_or_nothing(folder: Path, unless: type[Exception]) -> Generator[None]:
    """Remove a new folder where the code inside fails: its content also exists elsewhere.

    Where the code raises `unless`, the content belongs to another program and stays.
    """
    is_new = not holds_something(folder)
    try:
        yield
    except unless:
        raise
    except BaseException:
        if is_new:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def put_in_place(finished: Path, path: Path) -> None:
    """Give a finished file its name, after it is safe on the disk."""
    with finished.open("rb+") as file:
        os.fsync(file.fileno())
    finished.replace(path)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Make the names in `folder` survive a power cut, where the system lets a folder be synced."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def one_at_a_time(folder: Path) -> Generator[None]:
    """Let only one program at a time change the files of a folder, where the system locks folders."""
    if os.name != "posix":
        yield
        return
    import fcntl

    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # not supported on some network disks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


T = TypeVar("T")


def json_object(text: str | bytes) -> dict[str, Any]:
    """Return the object in a JSON text. Raises ValueError for anything else, nan and endless nesting included."""
    value = json_value(text)
    if not isinstance(value, dict):
        raise ValueError("it holds no names")
    return cast("dict[str, Any]", value)


def json_value(text: str | bytes) -> object:
    """Return the value in a JSON text. Raises ValueError for invalid JSON, nan and endless nesting included."""
    try:
        return json.loads(text, parse_constant=_no_number, parse_float=_finite)
    except RecursionError as error:
        raise ValueError("lists or objects are nested too deep") from error


def leaves(document: Mapping[str, Any], within: str = "") -> Iterator[tuple[str, Any]]:
    """Yield each leaf of a document with its dotted name.

    >>> list(leaves({"a": {"b": 1, "c": {"d": [2]}}}))
    [('a.b', 1), ('a.c.d', [2])]
    """
    for name, value in document.items():
        if isinstance(value, Mapping):
            yield from leaves(cast("Mapping[str, Any]", value), f"{within}{name}.")
        else:
            yield f"{within}{name}", value


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number that this program stores")


def _finite(text: str) -> float:
    number = float(text)
    return number if math.isfinite(number) else _no_number(text)


def as_type(value: object, form: type[T]) -> T:
    """Return plain data as the type `form`. Raises ValueError that names the part of another type."""
    try:
        return msgspec.convert(value, form)
    except msgspec.ValidationError as error:
        raise ValueError(str(error).replace("`$.", "`")) from error
