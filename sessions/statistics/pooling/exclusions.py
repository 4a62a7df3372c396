"""Who is left out of a study's result, why, and who decided it: a file kept by people beside the sessions."""

from dataclasses import dataclass
from pathlib import Path

from sessions.toml_file import NotAllowed, load_toml

EXCLUSIONS = "exclusions.toml"


@dataclass(frozen=True, slots=True)
class Exclusion:
    """One decision: every visit of a subject stays out, or its scores and strokes on one descriptor."""

    subject: str
    why: str
    who: str
    descriptor: str = ""  # "" for all

    def __post_init__(self) -> None:
        """Refuse a decision that nobody made or nobody can follow."""
        for key, allowed in (("subject", "a subject's code"), ("why", "the reason"), ("who", "who decided it")):
            if not getattr(self, key).strip():
                raise NotAllowed(key, getattr(self, key), f"{allowed}, not empty")


@dataclass(frozen=True, slots=True)
class Exclusions:
    """The file."""

    exclude: tuple[Exclusion, ...] = ()


def exclusions_in(folder: Path) -> tuple[Exclusion, ...]:
    """Return the decisions kept in a study's folder, none where there is no file. Raises SettingsError."""
    path = folder / EXCLUSIONS
    return load_toml(path, Exclusions).exclude if path.is_file() else ()


def decided(exclusions: tuple[Exclusion, ...], subject: str, descriptor: str) -> Exclusion | None:
    """Return the decision that leaves a subject's trials on a descriptor out, None where there is none."""
    return next((e for e in exclusions if e.subject == subject and e.descriptor in ("", descriptor)), None)
