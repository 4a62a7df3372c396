"""The calibration's uncertainty that somebody set for a session: kept with its analysis, and taken from there."""

from pathlib import Path
from typing import Any, cast

from sessions.recording.derived import load_derived
from sessions.recording.errors import RecordingError
from sessions.toml_file import SettingsError

ANALYSIS = "analysis.json"
LARGEST = 0.2  # that may be set [-]


def gain_error_set(folder: Path) -> float | None:
    """Return the standard uncertainty of each axis' gain [-] last set for the session in a folder; None: nobody did."""
    try:
        stored = load_derived(folder, ANALYSIS) or {}
        settings: Any = stored.get("settings")
        return checked_gain_error(
            cast("dict[str, Any]", settings).get("gain_error") if isinstance(settings, dict) else None
        )
    except (RecordingError, SettingsError):  # damaged: it tells nothing, and is made anew
        return None


def checked_gain_error(stored: object) -> float | None:
    """Return a stored gain error [-], None where none was set. Raises SettingsError where it is no such number."""
    if stored is None:
        return None
    if not isinstance(stored, int | float) or not 0.0 <= stored <= LARGEST:
        raise SettingsError(f"{ANALYSIS}: gain_error = {stored!r} is not allowed: a number from 0 to {LARGEST:g}")
    return float(stored)
