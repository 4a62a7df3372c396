"""What a blinded session says of its stimuli once the study's key was opened."""

from dataclasses import replace

from sessions.plan.blinding import Key
from sessions.recording.derived import load_derived
from sessions.recording.errors import RecordingError
from sessions.recording.log import trial_records
from sessions.recording.reader import Recording

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
