"""The description of a session, `session.json`: all that is known of it besides readings and events."""

from typing import Any

from sessions.recording.digests import digest_of
from sessions.recording.log import TrialRecord
from sessions.recording.reader import Recording


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
    """Return a trial as `session.json` tells it."""
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
