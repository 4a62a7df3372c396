"""What a recording holds in a few numbers: the SHA-256 of each column of its readings, and of its event log."""

from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from drivers.readings import ReadingBlock
from sessions.recording.head import json_text
from sessions.recording.log import LoggedEvent
from sessions.recording.schema import COLUMNS


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
