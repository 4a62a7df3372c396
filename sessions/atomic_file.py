"""Files and folders that are there whole or not at all."""

import json
import os
import shutil
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sessions.file_access import open_new


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write a JSON text of people's size: indented, UTF-8. Raises ValueError for nan and infinities: JSON has none."""
    path.write_text(json_text(document), encoding="utf-8")


def json_text(document: Mapping[str, Any]) -> str:
    """Return a JSON text of people's size: indented. Raises ValueError for nan and infinities: JSON has none."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_whole(path: Path, content: bytes) -> None:
    """Put `content` into the file at `path` in place of what it held: a reader sees the old or the new."""
    new = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open_new(new) as file:
            file.write(content)
        put_in_place(new, path)
    except OSError:  # a full disk, on which a part of the file would only take room
        new.unlink(missing_ok=True)
        raise


def holds_something(folder: Path) -> bool:
    """Say whether there is anything at `folder` that a new folder would replace."""
    return folder.exists() and (not folder.is_dir() or any(folder.iterdir()))


@contextmanager
def whole_folder(folder: Path) -> Generator[Path]:
    """Lend a folder that gets the name of `folder`, new or empty, once it is whole; else nothing of it is left."""
    part = folder.with_name(f".{folder.name}.part")
    try:
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)  # fails where a link stands there, which would lead elsewhere
        yield part
        if folder.exists():
            folder.rmdir()
        part.replace(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def put_in_place(new: Path, path: Path) -> None:
    """Give a finished file its name, after it is safe on the disk."""
    with new.open("rb+") as file:
        os.fsync(file.fileno())
    new.replace(path)
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
