"""Import of sessions exported by this program: read, written as a session, and compared."""

import csv
import errno
import importlib
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

from drivers.clock import StillClock
from drivers.readings import ReadingBlock
from sessions.exchange import FORMATS
from sessions.exchange.csv_text import ImportRefused
from sessions.file_access import as_type, holds_something, name_failure, remedy, whole_folder, write_whole
from sessions.plan.plan import SessionPlan
from sessions.recording.derived import GAIN_ERROR, bytes_of
from sessions.recording.head import info_from_dict, software_versions
from sessions.recording.log import LoggedEvent
from sessions.recording.manifest import Digest, different, digest_of
from sessions.recording.reader import Recording
from sessions.recording.replay import RecordedReadings
from sessions.recording.schema import LIVE_FILE, NotEmpty, RecordingError, check_format
from sessions.recording.writer import SessionWriter
from sessions.strokes.decisions import DECISIONS


@dataclass(frozen=True, slots=True)
class Head:
    """An export's data on the session other than readings and events, as plain data."""

    simulated: str | None  # the sentence
    plan: Mapping[str, Any]
    transducer: Mapping[str, Any] | None
    provenance: Mapping[str, Any]
    losses: tuple[str, ...]  # of the session that was exported
    digest: Digest | None  # None where the export has none


@dataclass(frozen=True, slots=True)
class ExportedSession:
    """A session in an export."""

    form: str  # name of the export
    path: Path
    head: Head
    events: tuple[LoggedEvent, ...]
    blocks: Callable[[], Iterator[ReadingBlock]]  # the readings in order, read on demand
    side_files: Mapping[str, bytes]  # files with people's settings and decisions, by name


def side_files(folder: Path) -> dict[str, bytes]:
    """Return a session's files with people's settings and decisions, by name. Raises RecordingError."""
    contents = {name: bytes_of(folder / name) for name in (DECISIONS, GAIN_ERROR)}
    return {name: content for name, content in contents.items() if content}


def head_of(description: Mapping[str, Any]) -> Head:
    """Return the head in a `session.json`. Raises ValueError for a foreign or later format."""
    check_format(description.get("format"))
    digests = description["sha256"]
    return Head(
        description.get("SIMULATED"),
        description["plan"],
        description["transducer"],
        description["provenance"],
        tuple(description["losses"]),
        Digest(description["readings"], dict(digests["columns"]), digests["events"]),
    )


def restore(session: ExportedSession, folder: Path) -> tuple[str, ...]:
    """Write an exported session into a new folder, and return a sentence for each difference.

    Losses before the export, and changes after it, are written into the log, so that every later reader sees them.
    Raises RecordingError where the folder cannot be written, ValueError where the export is damaged.
    """
    head = session.head
    plan = as_type(head.plan, SessionPlan)
    info = info_from_dict(head.transducer) if head.transducer else None
    earlier = cast("list[Any]", head.provenance.get("restored_from", []))
    source = {
        "format": session.form,
        "name": session.path.name,
        "restored_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "software": software_versions(),
    }
    writer = SessionWriter.create(
        folder,
        plan,
        info,
        {**head.provenance, "restored_from": [*earlier, source]},
        subject_simulated="subject" in (head.simulated or ""),
        clock=StillClock(session.events[-1].time_ns if session.events else 0),
    )
    with closing(writer):
        readings = RecordedReadings(session.blocks())
        for event in session.events:  # in the order in which both were recorded
            for block in readings.blocks_up_to(event.readings):
                writer.readings(block)
            writer.event(event.kind, event.trial, event.data, time_ns=event.time_ns, commit=False)
        for block in readings.blocks_up_to(None):
            writer.readings(block)
        writer.commit()
        recording = Recording.open(folder)
        problems = [sentence for sentence in head.losses if sentence not in recording.losses]
        source_digest = digest_of(session.blocks(), session.events)
        digest = digest_of(recording.blocks(), recording.events)
        changes = different(head.digest or source_digest, digest)
        problems += [f"since it was exported: {sentence}" for sentence in changes]
        if digest != source_digest:
            problems.append("what was written is not what the export holds")
        for sentence in problems:
            writer.event("not_restored", data={"sentence": sentence}, commit=False)
    for name, content in session.side_files.items():
        write_whole(folder / name, content)
    return tuple(problems)


_DAMAGED = (
    *(OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, RuntimeError, MemoryError),
    *(csv.Error, zlib.error),
)


@dataclass(frozen=True, slots=True)
class RestoreResult:
    """The amount of data restored from an export, and the differences."""

    readings: int
    events: int
    differences: tuple[str, ...]  # a sentence for each difference from the recording


def read_export(path: Path) -> ExportedSession | None:
    """Return the session in an export of this program; None for other files, as a CSV file. Raises ImportRefused."""
    if (path / LIVE_FILE).exists():
        raise ImportRefused(f"{path} is a session folder already: every verb takes it as it is")
    if path.name == LIVE_FILE:
        raise ImportRefused(f"{path} is the live file of a session: every verb takes its folder, {path.parent}")
    modules = {name: importlib.import_module(module) for name, module in FORMATS.items()}
    restored = {name: module for name, module in modules.items() if hasattr(module, "find")}
    for module in restored.values():
        file = module.find(path)
        if file is not None and path.exists():
            try:
                return module.read(file)
            except _DAMAGED as error:
                raise _refusal(f"{path} cannot be read as an export", error) from error
    if path.suffix == ".nwb" or any(path.glob("*.nwb")):
        raise ImportRefused(f"{path} is an export for other programs alone; give one of {', '.join(restored)}")
    if path.is_dir():
        raise ImportRefused(f"{path} holds no export of this program; give one of {', '.join(restored)}, or a CSV file")
    return None


def import_session(source: ExportedSession, folder: Path) -> RestoreResult:
    """Make a session folder from an export; a damaged export leaves nothing behind.

    Raises ImportRefused for a damaged export, RecordingError for a folder that cannot be written.
    """
    if holds_something(folder):
        raise NotEmpty(folder)
    try:
        with ExitStack() as stack:
            with name_failure(RecordingError, f"{folder} cannot be made"):
                unfinished = stack.enter_context(whole_folder(folder))
            differences = restore(source, unfinished)
    except FileExistsError as error:
        raise NotEmpty(folder) from error
    except _DAMAGED as error:
        raise _refusal(f"{source.path} is damaged", error) from error
    recording = Recording.open(folder)
    return RestoreResult(sum(len(block) for block in recording.blocks()), len(recording.events), differences)


def _refusal(problem: str, error: Exception) -> ImportRefused:
    """Return a refusal of an export: the problem, its cause and the remedy."""
    cause, advice = " ".join(str(error).split()), "export the session anew"
    if isinstance(error, KeyError):
        cause += " is missing"
    if isinstance(error, OSError) and error.filename and error.strerror:
        cause = f"{Path(error.filename).name}: {error.strerror.lower()}"
    if isinstance(error, OSError) and error.errno not in (None, errno.ENOENT):
        advice = remedy(error)
    return ImportRefused(f"{problem} ({cause}); {advice}")
