"""An export of this program becomes a session again: which export it is, and what came of it."""

import csv
import errno
import shutil
import zlib
from dataclasses import dataclass
from pathlib import Path

from sessions.exchange import bids, csv_folder, hdf5
from sessions.exchange.csv_rows import ImportRefused
from sessions.exchange.exported import ExportedSession, restore
from sessions.file_access import remedy
from sessions.recording import Recording, RecordingError
from sessions.recording.schema import DESCRIPTION_FILE, LIVE_FILE, SEALED_FILE

_DAMAGED = (
    *(OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, RuntimeError, MemoryError),
    *(csv.Error, zlib.error),
)


@dataclass(frozen=True, slots=True)
class Restored:
    """What came back."""

    readings: int
    events: int
    differences: tuple[str, ...]  # what is not as it was recorded, a sentence each


def exported(path: Path) -> ExportedSession | None:
    """Return the session in an export of ours; None for anything else, such as a CSV file. Raises ImportRefused."""
    if (path / LIVE_FILE).exists():
        raise ImportRefused(f"{path} is a session folder already: every verb takes it as it is")
    reader, file = None, path
    if path.suffix in {".h5", ".hdf5"}:
        reader = hdf5.read
    elif (path / SEALED_FILE).is_file():
        reader, file = hdf5.read, path / SEALED_FILE
    elif (path / "dataset_description.json").is_file():
        reader = bids.read
    elif (path / DESCRIPTION_FILE).is_file():
        reader = csv_folder.read
    elif path.is_dir():
        raise ImportRefused(f"{path} holds no export of this program; give one, or a CSV file")
    if reader is None:
        return None
    try:
        return reader(file)
    except _DAMAGED as error:
        raise ImportRefused(f"{path} cannot be read as an export ({_said(error)}); {_mended(error)}") from error


def import_session(source: ExportedSession, folder: Path) -> Restored:
    """Make a session folder of an export; nothing is left behind where it is damaged.

    Raises ImportRefused for a damaged export, RecordingError for a folder that cannot be written.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise RecordingError(f"{folder} is not empty; give a new folder, for nothing is written over")
    part = folder.with_name(f".{folder.name}.part")
    try:
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)  # fails where a link stands there, which would lead elsewhere
        differences = restore(source, part)
        if folder.exists():
            folder.rmdir()
        part.replace(folder)
    except _DAMAGED as error:
        raise ImportRefused(f"{source.path} is damaged ({_said(error)}); {_mended(error)}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    made = Recording.open(folder)
    return Restored(sum(len(block) for block in made.blocks()), len(made.events), differences)


def _mended(error: Exception) -> str:
    told = isinstance(error, OSError) and error.errno not in (None, errno.ENOENT)
    return remedy(error) if told else "export the session anew"


def _said(error: Exception) -> str:
    sentence = " ".join(str(error).split())
    return f"{sentence} is missing" if isinstance(error, KeyError) else sentence
