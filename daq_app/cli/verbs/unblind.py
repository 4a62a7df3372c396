"""Open the sealed key of a blinded study, or for one of its sessions: from then on stimuli are shown by their index.

The study and each session's folder record who opened the key and when, and each session the SHA-256 of every result
computed before: blind conclusions remain provable. This cannot be undone.
"""

import argparse
import hashlib
from datetime import UTC, datetime
from pathlib import Path

from daq_app.console import DONE, FLAWED, Console
from sessions.plan.study import Key, StudyError, check_code, is_study, note, open_study, study_key
from sessions.recording import Recording, RecordingError
from sessions.recording.derived import RECORDED, UNBLINDING, load_derived, sessions_of, store_derived
from sessions.recording.manifest import is_sealed

EXAMPLE = "daq-app unblind studies/friction --by E02"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", type=Path, metavar="SESSION|STUDY")
    parser.add_argument("--by", required=True, metavar="CODE", help="who opens the key: a code, never a name")
    meaning = "the study of a session stored elsewhere (the folder above)"
    parser.add_argument("--study", type=Path, metavar="DIR", help=meaning)


def run(options: argparse.Namespace, console: Console) -> int:
    path: Path = options.path
    check_code("--by", options.by)
    is_study_folder = is_study(path)
    folder = path if is_study_folder else options.study or path.resolve().parent
    sessions, unreadable = sessions_of(path) if is_study_folder else ((Recording.open(path),), ())
    if not is_study_folder and sessions[0].plan.blinded and not is_study(folder):
        raise StudyError(f"{folder} is not a study: give the folder of {path.name}'s study with --study")
    key = study_key(folder) if is_study_folder or sessions[0].plan.blinded else None
    if key is None:
        raise StudyError(f"{path} is not blinded: there is nothing to open")
    recordings, refusals = _select(sessions, key, alone=not is_study_folder)
    refusals += unreadable
    if not is_study_folder and refusals:
        raise RecordingError(refusals[0])
    if is_study_folder and open_study(folder).unblinded and not recordings:
        refusals_text = f": {'; '.join(refusals)}" if refusals else ", and so was each of its sessions"
        raise StudyError(f"{folder} was unblinded before{refusals_text}")
    utc = datetime.now(UTC).isoformat(timespec="seconds")
    note(folder, "unblinded", {"by": options.by, "session": None if is_study_folder else path.resolve().name})
    names: list[str] = []
    for recording in recordings:
        # Numbers and pages derived from the session while it was blinded.
        files = [path for path in sorted(recording.folder.iterdir()) if path.is_file() and path.name not in RECORDED]
        results = [path for path in files if path.suffix in (".json", ".jsonl", ".html")]
        made_before = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in results}
        document = {"unblinded_utc": utc, "by": options.by, "made_before": made_before, "key": key.to_dict()}
        try:
            store_derived(recording.folder, UNBLINDING, document)
            names.append(recording.folder.name)
        except RecordingError as error:
            if not is_study_folder:
                raise
            refusals.append(str(error))
    console.result(study=str(folder), sessions=names, left_out=refusals, by=options.by, utc=utc)
    console.say(f"unblinded by {options.by}: {', '.join(names) or 'the study alone'}", *refusals)
    if not is_study_folder:
        console.say("labels are the same throughout the study: anyone who saw this session's stimuli knows them all")
    return FLAWED if refusals else DONE


def _select(sessions: tuple[Recording, ...], key: Key, *, alone: bool) -> tuple[list[Recording], list[str]]:
    """Return the sessions to unblind, and a sentence for each that cannot be; `alone`: one session was named."""
    recordings: list[Recording] = []
    refusals: list[str] = []
    for recording in sessions:
        name = recording.folder.name
        if not recording.plan.blinded:
            refusals += [f"{name} is not blinded"] if alone else []
        elif load_derived(recording.folder, UNBLINDING) is not None:
            refusals += [f"{name} was unblinded before"] if alone else []
        elif recording.plan.key_sha256 != key.sha256:
            refusals.append(f"{name} was blinded with another key: name its study with --study")
        elif not is_sealed(recording.folder):
            refusals.append(
                f"{name} stays blinded: it has not ended; end it ('daq-app resume --end') and unblind again"
            )
        else:
            recordings.append(recording)
    return recordings, refusals
