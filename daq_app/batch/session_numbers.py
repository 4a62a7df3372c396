"""What one session brings to a study, computed where it lies or from its files alone, as on a worker far away."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sessions.prediction.sealed_predictions import SEAL
from sessions.recording import Recording
from sessions.recording.derived import GAIN_ERROR
from sessions.recording.provenance import software_versions
from sessions.recording.schema import LIVE_FILE
from sessions.recording.visits import UNBLINDING
from sessions.statistics.pooling.visit import VisitOptions, visit_of
from sessions.strokes.decisions import DECISIONS

# All that a visit's numbers come from.
CONTENT = (LIVE_FILE, f"{LIVE_FILE}-wal", UNBLINDING, SEAL, DECISIONS, GAIN_ERROR)

Answer = tuple[str, dict[str, Any] | str]  # session, and what it brings or why it brings nothing


def content_of(session: Path) -> dict[str, bytes]:
    """Return the files of a session that its numbers come from. Raises OSError."""
    return {name: (session / name).read_bytes() for name in CONTENT if (session / name).is_file()}


def computed(folder: Path, options: VisitOptions) -> Answer:
    """Return what the session in a folder brings; for a worker: nothing is raised."""
    try:
        return folder.name, visit_of(Recording.open(folder), options, software_versions()).to_dict()
    except Exception as error:  # noqa: BLE001  one bad session must not stop the rest
        sentence = " ".join(str(error).split()) or type(error).__name__
        return folder.name, sentence.replace(str(folder), folder.name)  # the same wherever it was computed


def computed_from(name: str, content: Mapping[str, bytes], options: VisitOptions) -> Answer:
    """Return what a session brings whose files were sent: a worker needs no disk in common with us."""
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / name
        folder.mkdir()
        for file, data in content.items():
            (folder / file).write_bytes(data)
        return computed(folder, options)
