"""An export of this program becomes a session again: which export it is, and what came of it."""

import csv
import errno
import importlib
import shutil
import zlib
from dataclasses import dataclass
from pathlib import Path

from sessions.exchange import FORMATS
from sessions.exchange.csv_text import ImportRefused
from sessions.exchange.exported import ExportedSession, restore
from sessions.file_access import remedy
from sessions.recording import Recording, RecordingError
from sessions.recording.schema import LIVE_FILE

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
    for module in map(importlib.import_module, FORMATS.values()):
        file = module.find(path) if hasattr(module, "find") else None
        if file is not None:
            try:
                return module.read(file)
            except _DAMAGED as error:
                sentence = f"{path} cannot be read as an export ({_sentence(error)}); {_remedy(error)}"
                raise ImportRefused(sentence) from error
    if path.is_dir():
        raise ImportRefused(f"{path} holds no export of this program; give one, or a CSV file")
    return None


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
        raise ImportRefused(f"{source.path} is damaged ({_sentence(error)}); {_remedy(error)}") from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    restored = Recording.open(folder)
    return Restored(sum(len(block) for block in restored.blocks()), len(restored.events), differences)


def _remedy(error: Exception) -> str:
    if isinstance(error, OSError) and error.errno not in (None, errno.ENOENT):
        return remedy(error)
    return "export the session anew"


def _sentence(error: Exception) -> str:
    sentence = " ".join(str(error).split())
    return f"{sentence} is missing" if isinstance(error, KeyError) else sentence
