"""Predictions sealed before unblinding, and their sentence in a report.

The seal is a file in the session's folder with the predictions, their SHA-256 and the time. `daq-app unblind` writes
the SHA-256 of that file with the key it opens, so that a later or changed seal is detected.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any, cast

from sessions.file_access import as_type
from sessions.recording import Recording, RecordingError
from sessions.recording.derived import UNBLINDING, load_derived, store_derived

SEAL = "sealed-prediction.json"
SEAL_NUMBERS = ("trial", "mu", "tau_max", "indentation", "direction", "sed")
_SAME = 1e-12  # relative difference allowed to numbers from another machine [-]


def seal_prediction(recording: Recording, prediction: Mapping[str, Any]) -> str:
    """Seal the result of `SessionPrediction.to_dict` in the session's folder; return the SHA-256 of its numbers.

    Raises RecordingError where a seal exists, which is never replaced, or where writing fails.
    """
    check_unsealed(recording)
    numbers = [{name: row[name] for name in SEAL_NUMBERS} for row in prediction["trials"]]
    sha256 = digest(numbers)
    document = {
        "sealed_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "blinded": recording.plan.key_sha256 is not None and load_derived(recording.folder, UNBLINDING) is None,
        "sha256": sha256,
        "numbers": numbers,
        "options": prediction["options"],
    }
    store_derived(recording.folder, SEAL, document)
    return sha256


def check_unsealed(recording: Recording) -> None:
    """Raise RecordingError where a seal is there."""
    earlier = load_derived(recording.folder, SEAL)
    if earlier is not None:
        raise RecordingError(
            f"{recording.folder / SEAL}: sealed on {earlier.get('sealed_utc')}, and none is sealed over it"
        )


def digest(numbers: Sequence[Mapping[str, Any]]) -> str:
    """Return the SHA-256 of the numbers as JSON, names sorted, no spaces.

    >>> digest([])[:8]
    '4f53cda1'
    """
    text = json.dumps(list(numbers), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def sealed_sentence(recording: Recording, current: Sequence[Mapping[str, Any]]) -> str:
    """Return whether the predictions in a report (`SEAL_NUMBERS` of each) were sealed, when, and whether blinded.

    An unreadable seal proves nothing and is no error.
    """
    try:
        seal = load_derived(recording.folder, SEAL)
        numbers = [] if seal is None else as_type(seal.get("numbers"), list[dict[str, Any]])
    except (RecordingError, ValueError):
        return f"A seal of predictions is there, but {SEAL} is damaged and proves nothing; restore a copy of it."
    if seal is None:
        return "The predictions were made after the scores had been given, and had not been sealed before."
    sha256 = str(seal.get("sha256"))
    if digest(numbers) != sha256:
        return f"A seal of predictions is there, but its numbers are not those of its SHA-256: {SEAL} was changed."
    time_text = f"sealed on {seal.get('sealed_utc')} (SHA-256 {sha256[:16]}…)"
    rows = zip(numbers, current, strict=False)
    agree = len(numbers) == len(current) and all(
        _agree(sealed.get(name), row[name]) for sealed, row in rows for name in SEAL_NUMBERS
    )
    comparison = "the predictions shown are those" if agree else "the predictions shown were made later and differ"
    return f"Predictions were {time_text} {_how_blind(recording, blinded=bool(seal.get('blinded')))}; {comparison}."


def _how_blind(recording: Recording, *, blinded: bool) -> str:
    if not blinded:
        return "when nothing hid which score belongs to which stimulus"
    unblinding = load_derived(recording.folder, UNBLINDING)
    if unblinding is None:
        return "while the key of the stimuli was sealed, as it still is"
    content = (recording.folder / SEAL).read_bytes()
    seals: Any = unblinding.get("made_before")
    if not isinstance(seals, dict) or cast("dict[str, Any]", seals).get(SEAL) != hashlib.sha256(content).hexdigest():
        return "but the record of unblinding does not hold this seal: it was made or changed after the key was opened"
    return f"while the key of the stimuli was sealed; it was opened on {unblinding.get('unblinded_utc')}"


def _agree(sealed: object, current: object) -> bool:
    if isinstance(sealed, float | int) and isinstance(current, float | int):
        return math.isclose(sealed, current, rel_tol=_SAME)
    return sealed == current
