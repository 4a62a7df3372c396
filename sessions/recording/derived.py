"""What is kept beside a recording: numbers made from it, and the calibration's uncertainty that somebody set."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sessions.atomic_file import write_whole
from sessions.file_access import read_limited, remedy
from sessions.json_document import json_object
from sessions.recording.manifest import is_sealed, list_in_manifest
from sessions.recording.provenance import software_versions
from sessions.recording.reader import Recording
from sessions.recording.schema import DESCRIPTION_FILE, LIVE_FILE, MANIFEST_FILE, SEALED_FILE, RecordingError
from sessions.toml_file import SettingsError

RECORDED = (LIVE_FILE, SEALED_FILE, DESCRIPTION_FILE, MANIFEST_FILE)


def store_derived(folder: Path, name: str, data: Mapping[str, Any]) -> Path:
    """Store `data` as the JSON file `name` (e.g. "analysis.json") with the versions of what made it; return its path.

    Raises ValueError where `data` holds nan or an infinity: what is not known is None.
    """
    simulated = Recording.open(folder).simulated_sentence
    head: dict[str, Any] = {"SIMULATED": simulated} if simulated else {}
    document = {**head, "made_by": software_versions(), **data}
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    return _store(folder, name, text.encode() + b"\n", simulated)


def store_page(folder: Path, name: str, page: str) -> Path:
    """Store a page such as "report.html", which itself says where it was simulated; return its path."""
    return _store(folder, name, page.encode(), Recording.open(folder).simulated_sentence)


def load_derived(folder: Path, name: str) -> dict[str, Any] | None:
    """Return what `store_derived` stored under `name`; None where nothing was. Raises RecordingError when damaged."""
    path = folder / name
    if not path.is_file():
        return None
    try:
        return json_object(read_limited(path))
    except ValueError as error:
        raise RecordingError(f"{path} is damaged ({error}); make it anew from the recording") from error
    except OSError as error:
        raise RecordingError(f"{path} cannot be read ({error.strerror}); {remedy(error)}") from error


def bytes_of(path: Path) -> bytes:
    """Return the bytes of a file, none where there is no file. Raises RecordingError where it cannot be read."""
    try:
        return read_limited(path) if path.is_file() else b""
    except OSError as error:
        raise RecordingError(f"{path} cannot be read ({error.strerror}); {remedy(error)}") from error


def _store(folder: Path, name: str, content: bytes, simulated: str | None) -> Path:
    if name in RECORDED or not re.fullmatch(r"[a-z0-9][a-z0-9_-]*\.[a-z0-9]+", name):
        raise ValueError(f"{name} is no name for a file made from a recording")
    path = folder / name
    try:
        write_whole(path, content)
        if is_sealed(folder):
            list_in_manifest(folder, (name,), simulated)
    except OSError as error:
        raise RecordingError(f"{path} cannot be written ({error.strerror}); {remedy(error)}") from error
    return path


GAIN_ERROR = "calibration-error.json"
LARGEST = 0.2  # that may be set [-]


def gain_error_set(folder: Path) -> float | None:
    """Return the standard uncertainty of each axis' gain [-] last set for the session in a folder; None: nobody did.

    Raises RecordingError where the file is damaged: what somebody set is not replaced by what nobody did.
    """
    try:
        stored = load_derived(folder, GAIN_ERROR)
        return None if stored is None else checked_gain_error(stored.get("gain_error"))
    except (RecordingError, SettingsError) as damaged:
        raise RecordingError(
            f"{folder / GAIN_ERROR} is damaged, and what was set for the session is not known: set it anew with "
            "'daq-app analyse --calibration-error PERCENT', or delete the file to go on with what is assumed"
        ) from damaged


def set_gain_error(folder: Path, gain_error: float) -> None:
    """Keep the standard uncertainty of each axis' gain [-] for the session in a folder. Raises RecordingError."""
    store_derived(folder, GAIN_ERROR, {"gain_error": gain_error})


def checked_gain_error(stored: object) -> float | None:
    """Return a stored gain error [-], None where none was set. Raises SettingsError where it is no such number."""
    if stored is None:
        return None
    if not isinstance(stored, int | float) or not 0.0 <= stored <= LARGEST:
        raise SettingsError(f"gain_error = {stored!r} is not allowed: a number from 0 to {LARGEST:g}")
    return float(stored)
