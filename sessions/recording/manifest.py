"""The manifest of a sealed session: the SHA-256 of each of its files."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sessions.atomic_file import write_whole
from sessions.file_access import read_limited, remedy
from sessions.json_document import json_object
from sessions.recording.schema import MANIFEST_FILE, RecordingError


def is_sealed(folder: Path) -> bool:
    """Say whether a session was sealed: the manifest is the last thing that sealing writes."""
    return (folder / MANIFEST_FILE).exists()


def list_in_manifest(
    folder: Path, names: Iterable[str], simulated: str | None, form: Mapping[str, Any] | None = None
) -> None:
    """Take the files called `names` into the manifest as they are now; the others stay as listed.

    A new manifest says of itself what the live file does: what was `simulated`, and its format.
    """
    sealed = is_sealed(folder)
    files: dict[str, Any] = _files(folder) if sealed else {}
    head = _head_of(folder) if sealed else {**_simulated(simulated), "format": form}
    for name in names:
        path = folder / name
        files[name] = {"sha256": file_sha256(path), "bytes": path.stat().st_size}
    document = {**head, "files": dict(sorted(files.items()))}
    write_whole(folder / MANIFEST_FILE, json.dumps(document, indent=1).encode() + b"\n")


def changed_files(folder: Path, simulated: str | None, form: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a sentence for each listed file that is gone or not what it was, and one for a damaged manifest.

    `simulated` and `form` are what the live file says at its head.
    """
    problems: list[str] = []
    try:
        files = _files(folder)
    except RecordingError as damaged:
        return (str(damaged),)
    for name, digest in files.items():
        path = folder / name
        if not path.is_file():
            problems.append(f"{name} is listed in {MANIFEST_FILE} and missing")
        elif file_sha256(path) != digest["sha256"] or path.stat().st_size != digest["bytes"]:
            problems.append(
                f"{name} is not what it was when it was listed: its SHA-256 or size differs from {MANIFEST_FILE}"
            )
    if _head_of(folder) != {**_simulated(simulated), "format": form}:
        problems.append(f"the head of {MANIFEST_FILE} differs from the live file")
    return tuple(problems)


def _simulated(sentence: str | None) -> dict[str, Any]:
    return {"SIMULATED": sentence} if sentence else {}


def _head_of(folder: Path) -> dict[str, Any]:
    """Return what stands before the files in a manifest that can be read."""
    document = json_object(read_limited(folder / MANIFEST_FILE))
    return {name: value for name, value in document.items() if name != "files"}


def _files(folder: Path) -> dict[str, Any]:
    """Return what the manifest lists. Raises RecordingError when it cannot be read."""
    path = folder / MANIFEST_FILE
    try:
        files = json_object(read_limited(path))["files"]
        return {str(name): {"sha256": str(entry["sha256"]), "bytes": entry["bytes"]} for name, entry in files.items()}
    except OSError as error:
        raise RecordingError(f"{path} cannot be read ({error.strerror}); {remedy(error)}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RecordingError(f"{path} cannot be read ({error}); restore the folder from a copy") from error


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal. Raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
