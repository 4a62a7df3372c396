"""Description of a session: `session.json`, digests of columns and log, and the manifest of SHA-256 sums."""

import hashlib
import json
from collections.abc import Container, Iterable, Iterator
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from drivers.readings import ReadingBlock
from sessions.file_access import as_type, json_object, name_failure, one_at_a_time, read_within_limit, write_whole
from sessions.recording.head import compact_json
from sessions.recording.log import LoggedEvent, TrialRecord
from sessions.recording.reader import Recording
from sessions.recording.schema import (
    COLUMNS,
    DESCRIPTION_FILE,
    LIVE_FILE,
    MANIFEST_FILE,
    SEALED_FILE,
    RecordingError,
)

SEALED = (LIVE_FILE, SEALED_FILE, DESCRIPTION_FILE)


@dataclass(frozen=True, slots=True)
class Digest:
    """Two recordings with equal digests hold the same readings and events, bit for bit."""

    readings: int
    columns: dict[str, str]  # hexadecimal SHA-256 by name of the column
    events: str  # hexadecimal SHA-256 of the log


def digest_of(blocks: Iterable[ReadingBlock], events: Iterable[LoggedEvent]) -> Digest:
    """Return the digest of readings and events.

    A column is hashed as little-endian numbers, an event as compact JSON [time_ns, kind, trial, data] and line feed.
    """
    sums = {name: sha256() for name in COLUMNS}
    count = 0
    for block in blocks:
        count += len(block)
        for name, dtype in COLUMNS.items():
            sums[name].update(getattr(block, name).astype(dtype, copy=False).tobytes())
    log = sha256()
    for event in events:
        log.update(compact_json([event.time_ns, event.kind, event.trial, dict(event.data)]).encode() + b"\n")
    return Digest(count, {name: digest.hexdigest() for name, digest in sums.items()}, log.hexdigest())


def content_sha256(recording: Recording) -> str:
    """Return the SHA-256 of plan, readings and events, independent of file formats: it survives export and import."""
    content = [recording.head["plan"], asdict(digest_of(recording.blocks(), recording.events))]
    return sha256(compact_json(content).encode()).hexdigest()


def different(stored: Digest, computed: Digest) -> Iterable[str]:
    """Yield a sentence for each part in which two digests differ."""
    if stored.readings != computed.readings:
        yield f"there were {stored.readings} readings and there are {computed.readings}"
    for name, digest in stored.columns.items():
        if digest != computed.columns.get(name):
            yield f"{name} of the readings is not what it was"
    if stored.events != computed.events:
        yield "the event log is not what it was"


def description(recording: Recording) -> dict[str, Any]:
    """Return the content of `session.json`: everything but readings and events, and the digest of these."""
    digest = digest_of(recording.blocks(), recording.events)
    return {
        **head_of_manifest(recording),
        "plan": recording.head["plan"],
        "transducer": recording.head["transducer"],
        "provenance": dict(recording.provenance),
        "trials": [_trial(record) for record in recording.trials],
        "readings": digest.readings,
        "events": len(recording.events),
        "sha256": {"columns": digest.columns, "events": digest.events},
        "ended": recording.end,
        "losses": list(recording.losses),
        "flaws": list(recording.flaws),
    }


def _trial(record: TrialRecord) -> dict[str, Any]:
    return {
        **{name: getattr(record.trial, name) for name in ("number", "block", "phase")},
        **asdict(record.trial.stimulus),
        "outcome": record.outcome,
        "score": record.score,
        "free_number": record.number,
        "choice": record.choice,
        "compared_with": record.trial.compared_with,
        "take": record.take.number if record.take else None,
        "start_ns": record.start_ns,
        "stop_ns": record.stop_ns,
        "other_takes": [
            {"number": t.number, "start_ns": t.start_ns, "stop_ns": t.stop_ns, "discarded": t.discard_reason}
            for t in record.other_takes
        ],
    }


def is_sealed(folder: Path) -> bool:
    """Say whether a session was sealed: sealing writes the manifest last."""
    return (folder / MANIFEST_FILE).exists()


def head_of_manifest(recording: Recording) -> dict[str, Any]:
    """Return the head of a manifest, as in the live file: what was simulated, and the format."""
    return {**recording.mark, "format": recording.head["format"]}


def list_in_manifest(folder: Path, names: Iterable[str], head: dict[str, Any] | None = None) -> None:
    """List the files `names` in the manifest with their present content; other entries stay.

    With a `head` a new manifest is begun. Raises RecordingError for a damaged manifest, OSError.
    """
    with one_at_a_time(folder):
        document = _manifest(folder) if head is None else head
        files: dict[str, Any] = document.get("files", {})
        for name in names:
            path = folder / name
            files[name] = {"sha256": file_sha256(path), "bytes": path.stat().st_size}
        document = {**document, "files": dict(sorted(files.items()))}
        write_whole(folder / MANIFEST_FILE, json.dumps(document, indent=1).encode() + b"\n")


def changed_files(recording: Recording, names: Container[str] | None = None) -> Iterator[str]:
    """Yield a sentence for each listed file that is missing or changed, and one for a damaged manifest.

    With `names` only these files are read.
    """
    try:
        document = _manifest(recording.folder)
    except RecordingError as damaged:
        yield str(damaged)
        return
    for name, digest in document.pop("files").items():
        path = recording.folder / name
        if names is not None and name not in names:
            continue
        if not path.is_file():
            yield f"{name} is listed in {MANIFEST_FILE} and missing"
        elif file_sha256(path) != digest["sha256"] or path.stat().st_size != digest["bytes"]:
            yield f"{name} is not what it was when it was listed: its SHA-256 or size differs from {MANIFEST_FILE}"
    if document != head_of_manifest(recording):
        yield f"the head of {MANIFEST_FILE} differs from the live file"


def seal_differences(*recordings: Recording) -> tuple[str, ...]:
    """Return a sentence for each sealed recording that is not as it was sealed.

    It reads each sealed file once, for its SHA-256; `archive.problems` also compares every number.
    """
    sealed = (recording for recording in recordings if is_sealed(recording.folder))
    changes = ((recording.folder.name, next(changed_files(recording, SEALED), "")) for recording in sealed)
    advice = "'daq-app verify' names every difference"
    return tuple(
        f"The recording {name} is not as it was sealed ({change}); {advice}." for name, change in changes if change
    )


class _ListedFile(msgspec.Struct):
    sha256: str
    bytes: int


def _manifest(folder: Path) -> dict[str, Any]:
    """Return the content of the manifest. Raises RecordingError when it cannot be read."""
    path = folder / MANIFEST_FILE
    with name_failure(RecordingError, f"{path} cannot be read"):
        content = read_within_limit(path)
    try:
        document = json_object(content)
        as_type(document["files"], dict[str, _ListedFile])
    except (ValueError, KeyError) as error:
        raise RecordingError(f"{path} cannot be read ({error}); restore the folder from a copy") from error
    return document


def file_sha256(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal. Raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
