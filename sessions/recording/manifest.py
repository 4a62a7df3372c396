"""What describes a session: `session.json`, digests of columns and log, and the manifest with each file's SHA-256."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from drivers.readings import ReadingBlock
from sessions.file_access import json_object, read_limited, remedy, write_whole
from sessions.recording.head import json_text
from sessions.recording.log import LoggedEvent, TrialRecord
from sessions.recording.reader import Recording
from sessions.recording.schema import COLUMNS, MANIFEST_FILE, RecordingError


@dataclass(frozen=True, slots=True)
class Digest:
    """Two recordings with equal digests hold the same readings and events, bit for bit."""

    readings: int
    columns: dict[str, str]  # hexadecimal SHA-256 by name of the column
    events: str  # hexadecimal SHA-256 of the log

    def to_dict(self) -> dict[str, Any]:
        """Return it as `session.json` holds it."""
        return {"readings": self.readings, "columns": self.columns, "events": self.events}


def digest_of(blocks: Iterable[ReadingBlock], events: Iterable[LoggedEvent]) -> Digest:
    """Return the digest of readings and events.

    A column is digested as little-endian numbers, reading after reading; an event as the compact JSON of
    [time_ns, kind, trial, data] and a line feed.
    """
    sums = {name: sha256() for name in COLUMNS}
    count = 0
    for block in blocks:
        count += len(block)
        for name, kind in COLUMNS.items():
            sums[name].update(getattr(block, name).astype(kind, copy=False).tobytes())
    log = sha256()
    for event in events:
        log.update(json_text([event.time_ns, event.kind, event.trial, dict(event.data)]).encode() + b"\n")
    return Digest(count, {name: digest.hexdigest() for name, digest in sums.items()}, log.hexdigest())


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
    """Return what `session.json` says: all but the readings and the events, and the digest of those."""
    digest = digest_of(recording.blocks(), recording.events)
    return {
        **({"SIMULATED": recording.simulated_sentence} if recording.simulated_sentence else {}),
        "format": recording.head["format"],
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
        "number": record.trial.number,
        "block": record.trial.block,
        "phase": record.trial.phase,
        "descriptor": record.trial.stimulus.descriptor,
        "index": record.trial.stimulus.index,
        "code": record.trial.stimulus.code,
        "outcome": record.outcome,
        "score": record.score,
        "free_number": record.number,
        "choice": record.choice,
        "compared_with": record.trial.compared_with,
        "take": record.take.number if record.take else None,
        "start_ns": record.start_ns,
        "stop_ns": record.stop_ns,
        "other_takes": [
            {"number": take.number, "start_ns": take.start_ns, "stop_ns": take.stop_ns, "discarded": take.discarded}
            for take in record.other_takes
        ],
    }


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
