"""Exports: their list, and the input of each.

A format is a module with `write(source, folder, progress)`. One that can be imported again also has `find(path)`, which
returns the path to read or None, and `read(path)`. A new entry of `FORMATS` is tested automatically
(`docs/how-to/add-an-export.md`).
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sessions.file_access import holds_something, name_failure, whole_folder
from sessions.recording import Recording

Progress = Callable[[float], None]  # part done, 0 to 1

# Name to module. A module is imported only when its format is used.
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
    """A session and its results."""

    recording: Recording
    analysis: Mapping[str, Any]  # as in `analysis.json`, with `made_by`
    prediction: Mapping[str, Any] | None  # as in `prediction.json`; None without predictions


def export(source: ExportSource, name: str, folder: Path, progress: Progress = lambda _: None) -> Path:
    """Write a session in the format called `name` into `folder`, which is new or empty, and return it.

    The folder appears once it is complete; an interrupted export leaves nothing. Raises ExportError.
    """
    if holds_something(folder):
        raise ExportError(f"{folder} is not empty; give a new folder, because nothing is overwritten")
    with (
        name_failure(ExportError, f"{folder} cannot be written", ", or give another folder", new=True),
        whole_folder(folder) as unfinished,
    ):
        importlib.import_module(FORMATS[name]).write(source, unfinished, progress)
    return folder
