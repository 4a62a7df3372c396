"""The description of a session, `session.json`, and its digest: the SHA-256 of each column and of the log."""

from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from drivers.readings import ReadingBlock
from sessions.recording.head import json_text
from sessions.recording.log import LoggedEvent, TrialRecord
from sessions.recording.reader import Recording
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
