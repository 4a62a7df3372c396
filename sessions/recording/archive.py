"""Sealing of an ended session: an HDF5 copy compared with the live file, a description, a manifest."""

import json
from collections.abc import Iterator
from pathlib import Path

from sessions.file_access import json_value, put_in_place, read_within_limit, remedy, write_whole
from sessions.recording.derived import ABSENT, unlike
from sessions.recording.manifest import (
    SEALED,
    changed_files,
    description,
    head_of_manifest,
    is_sealed,
    list_in_manifest,
)
from sessions.recording.reader import Recording
from sessions.recording.recovery import fold_log
from sessions.recording.schema import (
    DESCRIPTION_FILE,
    MANIFEST_FILE,
    SEALED_FILE,
    DiskRefused,
    RecordingError,
)
from sessions.recording.sealed_copy import differences, write_copy
from sessions.recording.storage import release_reserve


def seal(folder: Path) -> None:
    """Write the sealed copy, the description and the manifest of an ended session next to its live file.

    The live file becomes read-only, and a write-ahead log left by a crash is folded in. The session counts as sealed
    only after the copy was read again and equals the live file, reading by reading. Raises RecordingError.
    """
    if is_sealed(folder):
        raise RecordingError(f"{folder} is sealed already: {MANIFEST_FILE} lists its files")
    fold_log(folder, Recording.open(folder).events)
    release_reserve(folder)
    recording = Recording.open(folder)
    unfinished = folder / f".{SEALED_FILE}.part"
    try:
        for copy in (folder / SEALED_FILE, folder / DESCRIPTION_FILE):  # left by an interrupted sealing
            if copy.exists():
                copy.chmod(0o644)  # some systems remove no read-only file
                copy.unlink()
        unfinished.unlink(missing_ok=True)
        write_copy(recording, unfinished)
        put_in_place(unfinished, folder / SEALED_FILE)
        unequal = next(differences(recording), None)
        if unequal is not None:
            raise RecordingError(
                f"{folder} could not be sealed: {unequal}; the live file is untouched, "
                "'daq-app resume --end' seals it again"
            )
        write_whole(folder / DESCRIPTION_FILE, json.dumps(description(recording), indent=1).encode() + b"\n")
        for name in SEALED:
            (folder / name).chmod(0o444)
        list_in_manifest(folder, SEALED, head_of_manifest(recording))
    except (OSError, RuntimeError) as error:  # h5py raises either when the disk is full
        unfinished.unlink(missing_ok=True)
        advice = remedy(error)
        raise DiskRefused(
            f"{folder} could not be sealed ({error}); the live file is untouched: {advice}, and seal it again "
            "with 'daq-app resume --end'",
            f"({error}); {advice}",
        ) from error


def problems(folder: Path) -> tuple[str, ...]:
    """Return a sentence for each fault of a session's files; none for an intact sealed session.

    Checks the SHA-256 of each file, the CRC-32 of each block and event, and each number of the HDF5 copy and of the
    description against the live file. Raises RecordingError where the recording cannot be read at all.
    """
    recording = Recording.open(folder)
    if not is_sealed(folder):
        seals = "" if recording.end is None else f"; 'daq-app resume {folder} --end' seals it"
        return (*recording.losses, f"the session was never sealed: there is no {MANIFEST_FILE}{seals}")
    return (*changed_files(recording), *recording.losses, *differences(recording), *_contradictions(recording))


def _contradictions(recording: Recording) -> Iterator[str]:
    """Yield a sentence for each part of `session.json` that differs from the live file."""
    path = recording.folder / DESCRIPTION_FILE
    if not path.is_file():
        return  # the manifest reports it
    try:
        stored = json_value(read_within_limit(path))
    except (OSError, ValueError) as error:
        yield f"{DESCRIPTION_FILE} cannot be read ({error})"
        return
    current = json.loads(json.dumps(description(recording)))
    for name, stored_value, _ in unlike(stored, current, ""):
        if stored_value is not ABSENT:  # else an older version did not write it
            yield f"{name.removeprefix('.') or 'all'} of {DESCRIPTION_FILE} differs from the live file"
