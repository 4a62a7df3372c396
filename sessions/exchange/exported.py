"""A session that was exported by this program comes back whole: read, written as a session, and compared."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

from drivers.clock import StillClock
from drivers.readings import ReadingBlock
from sessions.atomic_file import write_whole
from sessions.recording.calibration_uncertainty import GAIN_ERROR
from sessions.recording.digests import Digest, different, digest_of
from sessions.recording.head import info_from_dict, plan_from_dict
from sessions.recording.log import LoggedEvent
from sessions.recording.provenance import software_versions
from sessions.recording.reader import Recording
from sessions.recording.schema import FORMAT, FORMAT_VERSION
from sessions.recording.writer import SessionWriter
from sessions.strokes.decisions import DECISIONS


@dataclass(frozen=True, slots=True)
class Head:
    """What an export says of the session besides readings and events, as plain data."""

    simulated: str | None  # the sentence
    plan: Mapping[str, Any]
    transducer: Mapping[str, Any] | None
    provenance: Mapping[str, Any]
    losses: tuple[str, ...]  # of the session that was exported
    digest: Digest | None  # None where the export tells none


@dataclass(frozen=True, slots=True)
class ExportedSession:
    """A session as an export holds it."""

    form: str  # name of the export
    path: Path
    head: Head
    events: tuple[LoggedEvent, ...]
    blocks: Callable[[], Iterator[ReadingBlock]]  # the readings in their order, read when asked for
    decisions: bytes = b""  # what people decided, as the file holds it
    gain_error: bytes = b""  # how uncertain the calibration is, as somebody set it: the file


def head_of(description: Mapping[str, Any]) -> Head:
    """Return the head that a `session.json` tells. Raises ValueError where it is none of ours, or a later one."""
    made: Mapping[str, Any] = description.get("format") or {}
    if made.get("name") != FORMAT or int(made.get("version", 0)) > FORMAT_VERSION:
        raise ValueError(f"it holds {made or 'no format'}; this program reads '{FORMAT}' up to {FORMAT_VERSION}")
    told = description["sha256"]
    return Head(
        description.get("SIMULATED"),
        description["plan"],
        description["transducer"],
        description["provenance"],
        tuple(description["losses"]),
        Digest(description["readings"], dict(told["columns"]), told["events"]),
    )


def restore(exported: ExportedSession, folder: Path) -> tuple[str, ...]:
    """Write an exported session into a new folder, and return a sentence for each thing that is not as it was.

    What had been lost before the export, and what was changed after it, is written into the log and so named ever
    after. Raises RecordingError where the folder cannot be written, ValueError where the export is damaged.
    """
    head = exported.head
    plan = plan_from_dict(head.plan)
    info = info_from_dict(head.transducer) if head.transducer else None
    earlier = cast("list[Any]", head.provenance.get("restored_from", []))
    source = {
        "format": exported.form,
        "name": exported.path.name,
        "restored_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "software": software_versions(),
    }
    writer = SessionWriter.create(
        folder,
        plan,
        info,
        {**head.provenance, "restored_from": [*earlier, source]},
        subject_simulated="subject" in (head.simulated or ""),
        clock=StillClock(exported.events[-1].time_ns if exported.events else 0),
    )
    try:
        _write(exported, writer)
        writer.commit()
        made = Recording.open(folder)
        found = [sentence for sentence in head.losses if sentence not in made.losses]
        source_digest = digest_of(exported.blocks(), exported.events)
        written = digest_of(made.blocks(), made.events)
        found += [f"since it was exported: {told}" for told in different(head.digest or source_digest, written)]
        if written != source_digest:
            found.append("what was written is not what the export holds")
        for sentence in found:
            writer.event("not_restored", data={"sentence": sentence}, commit=False)
    finally:
        writer.close()
    if exported.decisions:
        write_whole(folder / DECISIONS, exported.decisions)
    if exported.gain_error:
        write_whole(folder / GAIN_ERROR, exported.gain_error)
    return tuple(found)


def _write(exported: ExportedSession, writer: SessionWriter) -> None:
    """Write readings and events in the order in which they were recorded."""
    blocks = exported.blocks()
    waiting = ReadingBlock.empty()
    handed = 0
    for event in exported.events:
        while handed < event.readings:
            if not len(waiting):
                waiting = next(blocks, ReadingBlock.empty())
                if not len(waiting):
                    break
            count = min(len(waiting), event.readings - handed)
            writer.readings(waiting.between(0, count))
            waiting = waiting.between(count, len(waiting))
            handed += count
        writer.event(event.kind, event.trial, event.data, time_ns=event.time_ns, commit=False)
    writer.readings(waiting)
    for block in blocks:
        writer.readings(block)
