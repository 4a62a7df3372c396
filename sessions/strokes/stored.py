"""What `analysis.json` must hold so that whatever reads it finds what it looks for."""

from collections.abc import Mapping
from typing import Any

import msgspec

from sessions.file_access import complete
from sessions.strokes.bootstrap import StrokeIntervals
from sessions.strokes.bootstrap_settings import BootstrapSettings
from sessions.strokes.decisions import Decision
from sessions.strokes.flaws import Flaw
from sessions.strokes.friction import FrictionParameters
from sessions.strokes.stroke import Stroke
from sessions.toml_file import SettingsError, from_table

# What documents of older programs lack: before 2026-11-23 the first four were not drawn, before 2026-11-25 the others
# were not stored. Once no such document is read, this goes.
_NEWER = (
    *("cross_talk", "tilt", "tilt_error", "tilt_origin", "tilt_presses"),
    *("top_alike", "most_alike", "least_free", "climb_ends", "detector", "climb"),
    *("onset_fewest", "onset_most", "onset_steep", "onset_reach"),
)
_DEFAULTS = {name: getattr(BootstrapSettings(), name) for name in _NEWER}
_REPLACED = ("tilt_from_presses",)  # of documents from before 2026-11-25; `tilt_presses` says how many


class _Intervals(msgspec.Struct):
    kind: str
    settings: dict[str, Any]  # checked below, without what an older program did not draw
    strokes: tuple[StrokeIntervals, ...]


class _Settings(msgspec.Struct):
    settings: BootstrapSettings


class _Analysis(msgspec.Struct):
    """The parts of an analysis that the program itself reads."""

    made_by: dict[str, str]
    strokes: tuple[Stroke, ...]
    friction: tuple[FrictionParameters, ...]
    flaws: tuple[Flaw, ...]
    interval: str
    decisions: tuple[Decision, ...]
    bootstrap: _Intervals


def check_analysis(document: Mapping[str, Any]) -> None:
    """Raise ValueError where a document is no analysis that this program writes: where, and what is expected."""
    analysis = complete(document, _Analysis)
    if len(analysis.bootstrap.strokes) != len(analysis.strokes):
        raise SettingsError("it has intervals of another number of strokes")
    beyond = [row.stroke for row in analysis.friction if not 0 <= row.stroke < len(analysis.strokes)]
    if beyond:
        raise SettingsError(f"it gives the friction of stroke {beyond[0]}, which it does not hold")
    complete({"settings": {**_DEFAULTS, **analysis.bootstrap.settings}}, _Settings)
    bootstrap_settings(analysis.bootstrap.settings)


def bootstrap_settings(stored: Mapping[str, Any]) -> BootstrapSettings:
    """Return the settings of stored intervals; what an older program did not draw has its default.

    Raises SettingsError.
    """
    current = {name: value for name, value in stored.items() if name not in _REPLACED}
    return from_table(current, BootstrapSettings, "bootstrap")
