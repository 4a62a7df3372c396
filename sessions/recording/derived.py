"""Files stored next to a recording: derived numbers, whether they are reproduced, and the opened key."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, cast

from msgspec import to_builtins

from sessions.file_access import as_type, json_object, json_text, name_failure, read_within_limit, write_whole
from sessions.plan.study import Key
from sessions.recording.head import software_versions
from sessions.recording.log import trial_records
from sessions.recording.manifest import SEALED, is_sealed, list_in_manifest
from sessions.recording.reader import Recording
from sessions.recording.schema import LIVE_FILE, MANIFEST_FILE, RecordingError
from sessions.toml_file import SettingsError

T = TypeVar("T")
RECORDED = (*SEALED, MANIFEST_FILE)


def store_derived(folder: Path, name: str, data: Mapping[str, Any]) -> Path:
    """Store `data` as the JSON file `name` (e.g. "analysis.json") with the software versions; return its path.

    Raises ValueError where `data` holds nan or an infinity: an unknown value is None.
    """
    document = {**Recording.open(folder).mark, "made_by": software_versions(), **data}
    return _store(folder, name, json_text(document).encode())


def store_page(folder: Path, name: str, page: str) -> Path:
    """Store a page such as "report.html", which itself says what was simulated; return its path."""
    return _store(folder, name, page.encode())


def load_derived(folder: Path, name: str) -> dict[str, Any] | None:
    """Return the document stored by `store_derived`, None where there is none. Raises RecordingError when damaged."""
    path = folder / name
    if not path.is_file():
        return None
    try:
        return json_object(bytes_of(path))
    except ValueError as error:
        raise RecordingError(f"{path} is damaged ({error}); delete it, and make it anew from the recording") from error


def bytes_of(path: Path) -> bytes:
    """Return the bytes of a file, none where there is no file. Raises RecordingError where it cannot be read."""
    with name_failure(RecordingError, f"{path} cannot be read"):
        return read_within_limit(path) if path.is_file() else b""


def _store(folder: Path, name: str, content: bytes) -> Path:
    if name in RECORDED or not re.fullmatch(r"[a-z0-9][a-z0-9_-]*\.[a-z0-9]+", name):
        raise ValueError(f"{name} is no name for a file made from a recording")
    path = folder / name
    with name_failure(RecordingError, f"{path} cannot be written", new=True):
        write_whole(path, content)
        if is_sealed(folder):
            list_in_manifest(folder, (name,))
    return path


GAIN_ERROR = "calibration-error.json"
_LARGEST = 0.2  # that may be set [-]


def gain_error_set(folder: Path) -> float | None:
    """Return the standard uncertainty of each axis' gain [-] last set for the session in a folder; None if never set.

    Raises RecordingError where the file is damaged: the default must not replace a value that was set.
    """
    try:
        stored = load_derived(folder, GAIN_ERROR)
        return None if stored is None else parse_gain_error(stored.get("gain_error"))
    except (RecordingError, SettingsError) as damaged:
        raise RecordingError(
            f"{folder / GAIN_ERROR} is damaged, and what was set for the session is not known: set it anew with "
            "'daq-app analyse --calibration-error PERCENT', or delete the file to use the assumed error"
        ) from damaged


def set_gain_error(folder: Path, gain_error: float) -> None:
    """Store the standard uncertainty of each axis' gain [-] for the session in a folder. Raises RecordingError."""
    store_derived(folder, GAIN_ERROR, {"gain_error": gain_error})


def parse_gain_error(stored: object) -> float | None:
    """Return a stored gain error [-], None where none was set. Raises SettingsError where it is not allowed."""
    if stored is None:
        return None
    if not isinstance(stored, int | float) or not 0.0 <= stored <= _LARGEST:
        raise SettingsError(f"gain_error = {stored!r} is not allowed: a number from 0 to {_LARGEST:g}")
    return float(stored)


MADE_BY = "made_by"  # software versions in a stored document
TIMINGS = frozenset({"wall_s", "setup_s", "estimate_s", "evidence_s", MADE_BY, "SIMULATED"})  # not results of a session
_MOST_NAMED = 20  # differences listed in full


ABSENT = object()  # in place of a value under a name that a document lacks


def unlike(stored: Any, fresh: Any, path: str, but: frozenset[str] = frozenset()) -> Iterator[tuple[str, Any, Any]]:  # noqa: ANN401  JSON values
    """Yield place, stored value and present value of each difference; names in `but` are ignored."""
    if isinstance(stored, Mapping) and isinstance(fresh, Mapping):
        stored_map, fresh_map = cast("Mapping[str, Any]", stored), cast("Mapping[str, Any]", fresh)
        for key in sorted({*stored_map, *fresh_map} - but, key=_rank):
            yield from unlike(stored_map.get(key, ABSENT), fresh_map.get(key, ABSENT), f"{path}.{key}", but)
        return
    if isinstance(stored, (list, tuple)) and isinstance(fresh, (list, tuple)):
        stored_list, fresh_list = cast("Sequence[Any]", stored), cast("Sequence[Any]", fresh)
        if len(stored_list) == len(fresh_list):
            for i, (old, new) in enumerate(zip(stored_list, fresh_list, strict=True)):
                yield from unlike(old, new, f"{path}[{i}]", but)
            return
    if stored != fresh or isinstance(stored, bool) != isinstance(fresh, bool):
        yield path, stored, fresh


def complete(document: Mapping[str, Any], form: type[T]) -> T:
    """Return a document that the program wrote itself, as the type `form`.

    A field may be missing only where its default is None. Raises ValueError as `as_type` does.
    """
    value = as_type(document, form)
    for name, stored, default in unlike(document, to_builtins(value), ""):
        if stored is ABSENT and default is not None:
            raise ValueError(f"Object missing required field `{name.removeprefix('.')}`")
    return value


def differences(stored: object, fresh: object, path: str) -> Iterator[str]:
    """Yield a sentence for each value that now differs from the stored one; timings are left out.

    >>> list(differences({"a": [1.0, 2.0], "wall_s": 3}, {"a": [1.0, 2.5], "wall_s": 4}, "x"))
    ['x.a[1] was stored as 2.0 and comes out as 2.5 (+25 %)']
    """
    for name, old, new in unlike(stored, fresh, path, TIMINGS):
        if old is ABSENT or new is ABSENT:
            yield f"{name} is {'new' if old is ABSENT else 'no longer made'}"
        elif isinstance(old, (list, tuple)) and isinstance(new, (list, tuple)):
            entries = len(cast("Sequence[Any]", old)), len(cast("Sequence[Any]", new))
            yield f"{name} was stored with {entries[0]} entries and comes out with {entries[1]}"
        else:
            scalable = isinstance(old, float) and isinstance(new, float) and old != 0.0
            change = f" ({100.0 * (new / old - 1.0):+.3g} %)" if scalable else ""
            yield f"{name} was stored as {old!r} and comes out as {new!r}{change}"


def _rank(key: str) -> tuple[int, str]:
    """Return the sort key of a name among differences: inputs first, derived values last."""
    return (0 if key in ("settings", "options", "decisions") else 2 if key == "bootstrap" else 1), key


def explain_differences(name: str, stored: Mapping[str, Any], present: Mapping[str, str]) -> str:
    """Return a sentence on what changed since a document was made that is not reproduced.

    >>> explain_differences("a.json", {"made_by": {"numpy": "1", "scipy": "2"}}, {"numpy": "1", "scipy": "3"})
    'a.json was made by other versions: scipy 2 then and 3 now'
    """
    software: Any = stored.get(MADE_BY)
    versions: Mapping[str, Any] = cast("Mapping[str, Any]", software) if isinstance(software, Mapping) else {}
    if not versions:
        return f"{name} does not say what made it"
    changes = [
        f"{library} {versions.get(library, 'absent')} then and {present.get(library, 'absent')} now"
        for library in {**versions, **present}
        if versions.get(library) != present.get(library)
    ]
    if not changes:
        return (
            f"{name} was made by the same versions as now: the document, the recording or the program was changed since"
        )
    return f"{name} was made by other versions: {', '.join(changes)}"


def first_sentences(sentences: Sequence[str]) -> tuple[str, ...]:
    """Return the first of many sentences, and the number of the rest."""
    omitted = len(sentences) - _MOST_NAMED
    return tuple(sentences) if omitted <= 0 else (*sentences[:_MOST_NAMED], f"and {omitted} more numbers differ")


UNBLINDING = "unblinding.json"  # in a session's folder, once its key was opened


def reveal(recording: Recording) -> Recording:
    """Return a session, with its indices once its key was opened. Raises RecordingError for a wrong key."""
    if not recording.plan.blinded:
        return recording
    stored = load_derived(recording.folder, UNBLINDING)
    if stored is None:
        return recording
    path = recording.folder / UNBLINDING
    try:
        key = as_type(stored["key"], Key)
        if key.sha256 != recording.plan.key_sha256:
            raise ValueError("its SHA-256 is not that in the plan")
        plan = recording.plan.with_trials(key.reveal)
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(
            f"{path} is not the key that was sealed ({error}); delete it, and unblind the session anew"
        ) from error
    return replace(recording, plan=plan, trials=trial_records(plan, recording.events))


def session_folders(folder: Path) -> tuple[Path, ...]:
    """Return the session folders in a folder, by name, including those without their recording. Raises OSError."""
    return tuple(sorted(path for path in folder.iterdir() if _may_hold_session(path)))


def _may_hold_session(path: Path) -> bool:
    """Return whether a path is a session folder, or one that lost its recording or is not readable."""
    if not path.is_dir():
        return path.is_symlink() and not path.exists() and not path.name.startswith(".")  # to a disk that is absent
    if not os.access(path, os.R_OK | os.X_OK):
        return True
    return any(os.path.lexists(path / name) for name in (LIVE_FILE, MANIFEST_FILE))  # an export has neither


def sessions_of(folder: Path) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Return the sessions in a study's folder, by name, and a sentence for each that cannot be read."""
    recordings: list[Recording] = []
    unreadable: list[str] = []
    for path in session_folders(folder):
        try:
            recordings.append(reveal(Recording.open(path)))
        except RecordingError as error:
            unreadable.append(str(error))
    return tuple(recordings), tuple(unreadable)


def force_visit(recordings: Sequence[Recording], subject: str) -> Recording | None:
    """Return a subject's visit with the transducer: the latest complete one, else the latest, if any."""
    visits = [visit for visit in recordings if visit.plan.subject == subject and visit.plan.forces]
    visits.sort(key=lambda v: (bool((v.end or {}).get("complete")), str(v.provenance.get("created_utc", ""))))
    return visits[-1] if visits else None
