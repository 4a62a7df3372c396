"""Visits of a study joined by the subject's code, and what blinded ones say once the study's key was opened."""

from dataclasses import replace
from pathlib import Path

from sessions.plan.study import Key, StudyError
from sessions.recording.derived import load_derived
from sessions.recording.log import trial_records
from sessions.recording.reader import Recording
from sessions.recording.schema import LIVE_FILE, RecordingError

UNBLINDING = "unblinding.json"  # in a session's folder, once its key was opened


def revealed(recording: Recording) -> Recording:
    """Return a session with all that is known of its stimuli by now: a blinded one as it is, until its key was opened.

    Raises RecordingError where the opened key is not the one that was sealed.
    """
    if not recording.plan.blinded:
        return recording
    stored = load_derived(recording.folder, UNBLINDING)
    if stored is None:
        return recording
    path = recording.folder / UNBLINDING
    try:
        key = Key.from_dict(stored["key"])
        if key.sha256 != recording.plan.key_sha256:
            raise ValueError("its SHA-256 is not that in the plan")
        plan = key.plan(recording.plan)
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(f"{path} is not the key that was sealed ({error}); unblind the session anew") from error
    return replace(recording, plan=plan, trials=trial_records(plan, recording.events))


def sessions_of(folder: Path, subject: str | None = None) -> tuple[Recording, ...]:
    """Return the sessions in a study's folder, by name, those of one subject where a code is given."""
    paths = sorted(path.parent for path in folder.glob(f"*/{LIVE_FILE}"))
    recordings = (revealed(Recording.open(path)) for path in paths)
    return tuple(recording for recording in recordings if subject in (None, recording.plan.subject))


def force_visit(folder: Path, subject: str) -> Recording:
    """Return the visit in which a subject stroked on the transducer: the latest that came to its end.

    Raises StudyError where there is none.
    """
    visits = [recording for recording in sessions_of(folder, subject) if recording.plan.forces]
    if not visits:
        raise StudyError(f"{subject} has no visit with forces in {folder}: run one with --device, or give another code")
    return max(visits, key=lambda v: (bool((v.end or {}).get("complete")), str(v.provenance.get("created_utc", ""))))


def score_visits(folder: Path, besides: Recording | None = None) -> tuple[Recording, ...]:
    """Return every visit of every subject in which scores were given on the line, but for the one named."""
    return tuple(
        recording
        for recording in sessions_of(folder)
        if any(record.score is not None for record in recording.trials)
        and (besides is None or recording.folder.resolve() != besides.folder.resolve())
    )
