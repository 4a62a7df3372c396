"""The calibration's uncertainty that somebody set for a session: in a file of its own, for nothing else tells it."""

from pathlib import Path

from sessions.recording.derived import load_derived, store_derived
from sessions.recording.errors import RecordingError
from sessions.toml_file import SettingsError

GAIN_ERROR = "calibration-error.json"
LARGEST = 0.2  # that may be set [-]


def gain_error_set(folder: Path) -> float | None:
    """Return the standard uncertainty of each axis' gain [-] last set for the session in a folder; None: nobody did.

    Raises RecordingError where the file is damaged: what somebody set is not replaced by what nobody did.
    """
    try:
        stored = load_derived(folder, GAIN_ERROR)
        return None if stored is None else checked_gain_error(stored.get("gain_error"))
    except (RecordingError, SettingsError) as damaged:
        raise RecordingError(
            f"{folder / GAIN_ERROR} is damaged, and what was set for the session is not known: set it anew with "
            "'daq-app analyse --calibration-error PERCENT', or delete the file to go on with what is assumed"
        ) from damaged


def set_gain_error(folder: Path, gain_error: float) -> None:
    """Keep the standard uncertainty of each axis' gain [-] for the session in a folder. Raises RecordingError."""
    store_derived(folder, GAIN_ERROR, {"gain_error": gain_error})


def checked_gain_error(stored: object) -> float | None:
    """Return a stored gain error [-], None where none was set. Raises SettingsError where it is no such number."""
    if stored is None:
        return None
    if not isinstance(stored, int | float) or not 0.0 <= stored <= LARGEST:
        raise SettingsError(f"gain_error = {stored!r} is not allowed: a number from 0 to {LARGEST:g}")
    return float(stored)
