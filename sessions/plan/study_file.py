"""The folder of a study: one SQLite file with what happened, the sealed key, and a folder for each session.

Several programs may enrol at once: each change is one transaction that begins by taking the file for itself.
"""

import json
import secrets
import sqlite3
from collections.abc import Callable, Generator, Mapping
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from sessions.atomic_file import write_whole
from sessions.file_access import DATABASE_FAILURES, bounded, read_limited, remedy
from sessions.json_document import json_object
from sessions.plan.orders import opaque_codes
from sessions.plan.protocols import Body, Protocol
from sessions.plan.protocols.planning import check_body
from sessions.plan.study import Key, Member, Study, StudyError, StudyEvent, check_code, free_slot
from sessions.toml_file import NotAllowed, SettingsError, from_toml

STUDY_FILE = "study.sqlite"
KEY_FILE = "sealed-key.json"
VERSION = 1
PATIENCE = 10.0  # waiting for another program that is enrolling [s]

TABLES = (
    "CREATE TABLE head (name TEXT PRIMARY KEY, value TEXT NOT NULL)",  # protocol (its TOML text), seed, key_sha256
    """CREATE TABLE events (
        number INTEGER PRIMARY KEY, -- from 1 without gaps
        utc TEXT NOT NULL,
        kind TEXT NOT NULL,         -- created, enrolled, withdrawn, labels_told, unblinded
        subject TEXT NOT NULL,      -- code; empty where it is about no subject
        data TEXT NOT NULL          -- JSON object
    )""",
)


def is_study(folder: Path) -> bool:
    """Say whether a folder is that of a study."""
    return (folder / STUDY_FILE).is_file()


def create_study(folder: Path, protocol_text: str, seed: int, *, blinded: bool) -> Study:
    """Make the folder of a new study, whose protocol is fixed from now on. Raises StudyError, SettingsError."""
    protocol = from_toml(protocol_text, Protocol, "the protocol")
    check_code("the name of the study's folder", folder.name)
    if is_study(folder):
        raise StudyError(f"{folder} is a study already, and its protocol is fixed: enrol without --protocol")
    adaptive = next((block.name for block in protocol.blocks if block.adaptive is not None), None)
    if blinded and adaptive is not None:
        raise StudyError(f"{adaptive} is adaptive and needs to know which stimulus is which: make the study unblinded")
    key = _new_key(protocol) if blinded else None
    folder.mkdir(parents=True, exist_ok=True)
    head = {
        "version": str(VERSION),
        "protocol": protocol_text,
        "seed": str(seed),
        "key_sha256": "" if key is None else key.sha256,
    }
    with _changing(folder) as connection:
        for table in TABLES:
            connection.execute(table)
        connection.executemany("INSERT INTO head VALUES (?, ?)", head.items())
        if key is not None:  # before the study counts as made: without its key it would be lost
            document = {"what": "which stimulus bears which code; 'daq-app unblind' opens it", "sealed": key.sealed()}
            write_whole(folder / KEY_FILE, json.dumps(document, indent=1).encode() + b"\n")
        _tell(connection, "created", "", {"protocol": protocol.name, "blinded": blinded})
    return open_study(folder)


def open_study(folder: Path) -> Study:
    """Return a study as it stands. Raises StudyError."""
    if not is_study(folder):
        raise StudyError(f"{folder} is no study: there is no {STUDY_FILE}; 'daq-app enrol' with --protocol makes one")
    with _reading(folder) as connection:
        return _study(connection, folder)


def enrol(folder: Path, subject: str, body: Body) -> Member:
    """Reserve a place for a subject, and return it. Raises StudyError, SettingsError for a value out of range."""
    check_code("the subject", subject)

    def choose(study: Study) -> tuple[str, Mapping[str, Any]]:
        try:
            check_body(body, study.protocol)
        except NotAllowed as error:
            raise SettingsError(str(error)) from error
        if subject in study.members:
            raise StudyError(f"{subject} was enrolled in {study.name} before: every subject has a code of its own")
        return "enrolled", {"slot": free_slot(list(study.members.values())), "body": msgspec.to_builtins(body)}

    return _changed(folder, subject, choose).members[subject]


def withdraw(folder: Path, subject: str, reason: str) -> Member:
    """Take a subject out of the study: the place is given back, what was recorded stays. Raises StudyError."""
    if not reason.strip():
        raise StudyError("say why the subject is withdrawn")

    def choose(study: Study) -> tuple[str, Mapping[str, Any]]:
        return "withdrawn", {"slot": study.member(subject).slot, "reason": reason}

    return _changed(folder, subject, choose).members[subject]


def note(folder: Path, kind: str, data: Mapping[str, Any]) -> Study:
    """Record that the labels were shown, or that a key was opened, and return the study."""
    return _changed(folder, "", lambda _: (kind, data))


def study_key(folder: Path) -> Key | None:
    """Return the key of a blinded study, for the program alone; None where it is not blinded. Raises StudyError."""
    expected = open_study(folder).key_sha256
    if expected is None:
        return None
    path = folder / KEY_FILE
    try:
        key = Key.opened(json_object(read_limited(path))["sealed"])
    except OSError as error:
        raise StudyError(f"{path} cannot be read ({error.strerror}); {remedy(error)}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StudyError(f"{path} cannot be read ({error}); restore it from a copy") from error
    if key.sha256 != expected:
        raise StudyError(f"{path} is not the key that was sealed: its SHA-256 differs; restore it from a copy")
    return key


def _new_key(protocol: Protocol) -> Key:
    """Deal codes to the stimuli by chance that nobody knows."""
    stimuli = list(protocol.labels)
    codes = opaque_codes(len(stimuli), secrets.randbelow(2**31))
    return Key(secrets.token_hex(16), dict(zip(codes, stimuli, strict=True)))


def _changed(folder: Path, subject: str, choose: Callable[[Study], tuple[str, Mapping[str, Any]]]) -> Study:
    """Add the event that `choose` makes of the study as it stands, while nobody else can change it."""
    open_study(folder)  # says what is wrong where it is none
    with _changing(folder) as connection:
        _tell(connection, *_ordered(subject, *choose(_study(connection, folder))))
        return _study(connection, folder)


def _ordered(subject: str, kind: str, data: Mapping[str, Any]) -> tuple[str, str, Mapping[str, Any]]:
    return kind, subject, data


def _tell(connection: sqlite3.Connection, kind: str, subject: str, data: Mapping[str, Any]) -> None:
    (last,) = connection.execute("SELECT coalesce(max(number), 0) FROM events").fetchone()
    utc = datetime.now(UTC).isoformat(timespec="seconds")
    text = json.dumps(data, ensure_ascii=False, allow_nan=False)
    connection.execute("INSERT INTO events VALUES (?, ?, ?, ?, ?)", (last + 1, utc, kind, subject, text))


def _study(connection: sqlite3.Connection, folder: Path) -> Study:
    path = folder / STUDY_FILE
    head = dict(connection.execute("SELECT name, value FROM head").fetchall())
    if head.get("version") != str(VERSION):
        raise StudyError(f"{path} is of version {head.get('version')}; this program reads {VERSION}")
    events = connection.execute("SELECT number, utc, kind, subject, data FROM events ORDER BY number").fetchall()
    try:
        study = Study(
            name=folder.resolve().name,
            protocol=from_toml(str(head["protocol"]), Protocol, f"{path}: the protocol"),
            seed=int(head["seed"]),
            key_sha256=head["key_sha256"] or None,
            events=tuple(
                StudyEvent(*msgspec.convert((*row, json_object(data)), tuple[int, str, str, str, dict[str, Any]]))
                for *row, data in events
            ),
        )
        _ = study.members, study.unblinded  # whatever their events lack is found here, and not where they are used
    except (ValueError, KeyError, TypeError, msgspec.ValidationError) as error:
        raise StudyError(f"{path} is damaged ({error}); restore it from a copy") from error
    return study


@contextmanager
def _reading(folder: Path) -> Generator[sqlite3.Connection]:
    """Lend a connection that changes nothing."""
    path = folder / STUDY_FILE
    try:
        path.open("rb").close()  # says why it cannot be read, which SQLite does not
        address = f"{path.resolve().as_uri()}?mode=ro"
        with closing(bounded(sqlite3.connect(address, uri=True, timeout=PATIENCE))) as connection:
            yield connection
    except DATABASE_FAILURES as error:
        raise StudyError(f"{path} cannot be read ({error}); {remedy(error)}") from error


@contextmanager
def _changing(folder: Path) -> Generator[sqlite3.Connection]:
    """Lend a connection in a transaction of its own, which is kept as a whole or not at all."""
    path = folder / STUDY_FILE
    try:
        with closing(bounded(sqlite3.connect(path, timeout=PATIENCE, isolation_level=None))) as connection:
            connection.execute("PRAGMA synchronous=FULL")
            connection.execute("BEGIN IMMEDIATE")
            try:
                yield connection
            except BaseException:
                connection.execute("ROLLBACK")
                raise
            connection.execute("COMMIT")
    except sqlite3.Error as error:
        raise StudyError(f"{path} cannot be changed ({error}); {remedy(error)}, and repeat") from error
