"""What `analysis.json` must hold so that whatever reads it finds what it looks for."""

from collections.abc import Mapping
from typing import Any

import msgspec

from sessions.json_document import complete
from sessions.strokes.bootstrap import BootstrapSettings, StrokeIntervals
from sessions.strokes.decisions import Decision
from sessions.strokes.flaws import Flaw
from sessions.strokes.friction import FrictionParameters
from sessions.strokes.stroke import Stroke
from sessions.toml_file import SettingsError, from_table


class _Intervals(msgspec.Struct):
    kind: str
    settings: dict[str, Any]  # checked below: one of an older program lacks what was not drawn then
    strokes: tuple[StrokeIntervals, ...]


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
    held = complete(document, _Analysis)
    if len(held.bootstrap.strokes) != len(held.strokes):
        raise SettingsError("it has intervals of another number of strokes")
    beyond = [row.stroke for row in held.friction if not 0 <= row.stroke < len(held.strokes)]
    if beyond:
        raise SettingsError(f"it tells the friction of stroke {beyond[0]}, which it does not hold")
    from_table(document["bootstrap"]["settings"], BootstrapSettings, "bootstrap")
