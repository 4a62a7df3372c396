"""A scene file that is asked for its finger alone: what trials bring themselves is neither needed nor taken."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sessions.toml_file import from_toml, text_of
from solver import Scene

# Every scene has them, and `sessions.prediction.scenes` puts those of the trials in their place.
_OF_TRIALS: Mapping[str, Mapping[str, Any]] = {"friction": {"mu": 0.0}, "loading": {"indentation": 1.0}}
_OF_OPTIONS = ("kinematics", "course", "evidence")


def finger_in(path: Path) -> tuple[Scene, str]:
    """Return the scene whose finger, materials, receptor and tolerance a file tells, and what of it is not taken.

    The file may lack friction and loading. "" where all that it holds is taken. Raises FileNotFoundError, and
    SettingsError for anything wrong in what is taken.
    """
    text = text_of(path)
    scene = from_toml(text, Scene, str(path), instead=_OF_TRIALS)
    document = tomllib.loads(text)
    ignored = [f"[{name}]" for name in _OF_TRIALS if name in document]
    ignored += [f"solve.{name}" for name in _OF_OPTIONS if name in document.get("solve", {})]
    if not ignored:
        return scene, ""
    are = "is" if len(ignored) == 1 else "are"
    return scene, (
        f"{path}: {', '.join(ignored)} {are} not taken: each trial brings its own friction and loading, and strain "
        "and course are options of the verb"
    )
