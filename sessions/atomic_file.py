"""Files that are there whole or not at all."""

import json
import os
from collections.abc import Mapping
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
    new = path.with_name(f".{path.name}.part")
    try:
        with open_new(new) as file:
            file.write(content)
    except OSError:  # a full disk, on which a part of the file would only take room
        new.unlink(missing_ok=True)
        raise
    put_in_place(new, path)


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
