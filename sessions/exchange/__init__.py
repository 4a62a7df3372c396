"""Files for others: the list of exports, and what each of them is given.

A format is a module with `write(source, folder, progress)`; one that can be imported again has
`find(path)`, which returns what it reads or None, and `read(path)` too.
A newcomer in `FORMATS` is tested before anyone writes a test for it (`docs/how-to/add-an-export.md`).
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sessions.file_access import holds_something, name_failure, whole_folder
from sessions.recording import Recording

Progress = Callable[[float], None]  # part done, 0 to 1

# Name to module. A module is imported only when its format is asked for.
FORMATS: Mapping[str, str] = {
    "csv": "sessions.exchange.csv_folder",
    "bids": "sessions.exchange.bids",
    "hdf5": "sessions.exchange.hdf5",
    "nwb": "sessions.exchange.nwb",
}


class ExportError(Exception):
    """A session cannot be exported; one sentence says why and what to do."""


@dataclass(frozen=True, slots=True)
class ExportSource:
    """A session and the numbers made from it."""

    recording: Recording
    analysis: Mapping[str, Any]  # as `analysis.json` holds it, `made_by` included
    prediction: Mapping[str, Any] | None  # as `prediction.json` holds it; None where nothing was predicted


def export(source: ExportSource, name: str, folder: Path, progress: Progress = lambda _: None) -> Path:
    """Write a session in the format called `name` into `folder`, which is new or empty, and return it.

    The folder appears when it is whole: stopped half-way nothing is left. Raises ExportError.
    """
    if holds_something(folder):
        raise ExportError(f"{folder} is not empty; give a new folder, for nothing is written over")
    with (
        name_failure(ExportError, f"{folder} cannot be written", ", or give another folder", new=True),
        whole_folder(folder) as unfinished,
    ):
        importlib.import_module(FORMATS[name]).write(source, unfinished, progress)
    return folder
