"""A study: one protocol, the subjects and their rows, and the folder with its SQLite file and sealed key.

A study is the list of what happened in it, in order. Several programs may enrol at once: each change is one transaction
that first locks the file.
"""

import base64
import hashlib
import json
import secrets
import sqlite3
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Annotated, Any
from zlib import crc32

import msgspec

from sessions.file_access import (
    DATABASE_FAILURES,
    as_type,
    json_object,
    limit_values,
    name_failure,
    read_within_limit,
    write_whole,
)
from sessions.plan.orders import opaque_codes, shuffle
from sessions.plan.plan import Trial
from sessions.plan.protocols.planning import CODE_RULE, Body, StudyPlace, check_body, design_rows, is_code
from sessions.plan.protocols.protocol import Labels, Protocol, new_protocol
from sessions.toml_file import SettingsError, from_toml


class KeyedStimulus(msgspec.Struct, frozen=True):
    """The stimulus that bears a code."""

    descriptor: str
    index: int


class Key(msgspec.Struct, frozen=True):
    """Which stimulus bears which code, throughout a study."""

    salt: str  # random, hexadecimal: without it the few possible keys could be tried one by one
    stimuli: dict[str, KeyedStimulus]  # by code

    @property
    def sha256(self) -> str:
        """Return the SHA-256 of the UTF-8 text "salt", then a line "code descriptor index" each, codes sorted."""
        stimuli = (f"{code} {s.descriptor} {s.index}" for code, s in sorted(self.stimuli.items()))
        lines = [self.salt, *stimuli]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()

    def seal(self) -> str:
        """Return the key as Base64 of JSON, which reveals nothing to someone who opens the file by chance."""
        return base64.b64encode(json.dumps(self.to_dict()).encode()).decode()

    @property
    def labels(self) -> Labels:
        """Return the code of each stimulus."""
        return {(stimulus.descriptor, stimulus.index): code for code, stimulus in self.stimuli.items()}

    @staticmethod
    def unseal(text: str) -> "Key":
        """Return the key in a text written by `seal`. Raises ValueError for any other text."""
        return as_type(json_object(base64.b64decode(text, validate=True)), Key)

    def to_dict(self) -> dict[str, Any]:
        """Return the key as plain data, codes sorted."""
        return msgspec.to_builtins(self, order="sorted")

    def reveal(self, trial: Trial) -> Trial:
        """Return a trial with the index of its stimulus. Raises ValueError where the key lacks its code."""
        stimulus = self.stimuli.get(trial.stimulus.code)
        if stimulus is None:
            raise ValueError(f"the key has no stimulus {trial.stimulus.code}")
        return replace(trial, stimulus=replace(trial.stimulus, index=stimulus.index))


class StudyError(Exception):
    """Something that a study does not allow, or a study that cannot be read; the message says what to do."""


@dataclass(frozen=True, slots=True)
class StudyEvent:
    """One thing that happened in a study."""

    number: int  # from 1, without gaps
    utc: str
    kind: str  # created, enrolled, withdrawn, labels_told, unblinded
    subject: str  # code; empty where it is about no subject
    data: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Member:
    """One subject of a study."""

    subject: str  # a code, never a name
    slot: Annotated[int, msgspec.Meta(ge=0)]  # reserved, from 0; given back on withdrawal
    body: Body  # values of the subject
    withdrawn: str | None = None  # why; None while enrolled


@dataclass(frozen=True, slots=True)
class Study:
    """The present state of a study."""

    name: str
    protocol: Protocol
    seed: int
    key_sha256: str | None  # of the sealed key; None: not blinded
    events: tuple[StudyEvent, ...]

    @property
    def members(self) -> dict[str, Member]:
        """Return everybody who was ever enrolled, by code, in the order of enrolment."""
        members: dict[str, Member] = {}
        for event in self.events:
            if event.kind == "enrolled":
                entry = {"subject": event.subject, "slot": event.data["slot"], "body": event.data["body"]}
                members[event.subject] = msgspec.convert(entry, Member)
            elif event.kind == "withdrawn":
                members[event.subject] = replace(members[event.subject], withdrawn=str(event.data["reason"]))
        return members

    @property
    def unblinded(self) -> bool:
        """Say whether the key of the whole study was opened."""
        return any(event.kind == "unblinded" and event.data.get("session") is None for event in self.events)

    @property
    def rows(self) -> int | None:
        """Return the number of rows of the design; None where each order is drawn independently."""
        return design_rows(self.protocol)

    def member(self, subject: str) -> Member:
        """Return a subject that is enrolled. Raises StudyError."""
        member = self.members.get(subject)
        if member is None:
            raise StudyError(f"{subject} is not enrolled in {self.name}: 'daq-app enrol' reserves a row")
        if member.withdrawn is not None:
            raise StudyError(f"{subject} was withdrawn from {self.name} ({member.withdrawn}); enrol under another code")
        return member

    def row(self, slot: int) -> int:
        """Return the row of the design, from 1, of a slot.

        Slots fill in turn. Each round of the design has its rows in a random order; without one the slot is the row.
        """
        if self.rows is None:
            return slot + 1
        cycles, within = divmod(slot, self.rows)
        return shuffle(range(self.rows), self.seed, f"rows/{cycles}")[within] + 1

    def session_seed(self, slot: int) -> int:
        """Return the seed of a slot's other random choices, the same for all visits of a subject."""
        digest = hashlib.sha256(f"{self.seed}/slot/{slot}".encode()).digest()
        return int.from_bytes(digest[:4], "big") % 2**31

    def place(self, member: Member, key: Key | None) -> StudyPlace:
        """Return the place of a subject, from which its plan is made; `key` is needed where the study is blinded."""
        labels = self.protocol.labels if key is None else key.labels
        sealed = None if self.unblinded else self.key_sha256
        return StudyPlace(self.name, member.slot, self.row(member.slot), self.seed, labels, sealed)


def free_slot(members: Sequence[Member]) -> int:
    """Return the first free slot; slots given back are reused first."""
    slots = {member.slot for member in members if member.withdrawn is None}
    return next(slot for slot in count() if slot not in slots)


def check_code(label: str, code: str) -> None:
    """Raise SettingsError unless `code` meets `CODE_RULE`; `label` names it."""
    if not is_code(code):
        raise SettingsError(f'{label} "{code}" is not allowed: {CODE_RULE}')


STUDY_FILE = "study.sqlite"
KEY_FILE = "sealed-key.json"
_VERSION = 1
_HEAD_NAMES = ("version", "protocol", "seed", "key_sha256")  # input of the head's check sum, in this order
_PATIENCE = 10.0  # waiting for another program that is enrolling [s]

_TABLES = (
    # protocol (its TOML text), seed, key_sha256; crc32 covers the other values
    "CREATE TABLE head (name TEXT PRIMARY KEY, value TEXT NOT NULL)",
    """CREATE TABLE events (
        number INTEGER PRIMARY KEY, -- from 1 without gaps
        utc TEXT NOT NULL,
        kind TEXT NOT NULL,         -- created, enrolled, withdrawn, labels_told, unblinded
        subject TEXT NOT NULL,      -- code; empty where it is about no subject
        data TEXT NOT NULL          -- JSON object; crc32 in it is that of all else, absent in older files
    )""",
)


def is_study(folder: Path) -> bool:
    """Say whether a folder holds a study."""
    return (folder / STUDY_FILE).is_file()


def create_study(folder: Path, protocol_text: str, seed: int, *, blinded: bool, source: str = "the protocol") -> Study:
    """Create the folder of a new study; its protocol cannot change later. Raises StudyError, SettingsError.

    `source` names the file of the protocol in error messages.
    """
    protocol = new_protocol(protocol_text, source)
    check_code("the name of the study's folder", folder.name)
    adaptive = next((block.name for block in protocol.blocks if block.adaptive is not None), None)
    if blinded and adaptive is not None:
        raise StudyError(f"{adaptive} is adaptive and needs to know which stimulus is which: make the study unblinded")
    key = _new_key(protocol) if blinded else None
    folder.mkdir(parents=True, exist_ok=True)
    try:
        (folder / STUDY_FILE).touch(exist_ok=False)  # only one of two programs succeeds
    except FileExistsError:
        refusal = f"{folder} is a study already, and its protocol is fixed: enrol without --protocol"
        raise StudyError(refusal) from None
    values = (str(_VERSION), protocol_text, str(seed), "" if key is None else key.sha256)
    head: dict[str, str] = dict(zip(_HEAD_NAMES, values, strict=True))
    try:
        with _transaction(folder) as connection:
            for table in _TABLES:
                connection.execute(table)
            head["crc32"] = str(_check_sum(*head.values()))
            connection.executemany("INSERT INTO head VALUES (?, ?)", head.items())
            if key is not None:  # before the commit: a blinded study without its key is lost
                document = {"what": "which stimulus bears which code; 'daq-app unblind' opens it", "sealed": key.seal()}
                write_whole(folder / KEY_FILE, json.dumps(document, indent=1).encode() + b"\n")
            _tell(connection, "created", "", {"protocol": protocol.name, "blinded": blinded})
    except BaseException:  # half a study would block the next try
        for name in (STUDY_FILE, KEY_FILE):
            (folder / name).unlink(missing_ok=True)
        with suppress(OSError):  # where the folder holds something else
            folder.rmdir()
        raise
    return open_study(folder)


def open_study(folder: Path) -> Study:
    """Return the present state of a study. Raises StudyError."""
    if not is_study(folder):
        raise StudyError(f"{folder} is no study: there is no {STUDY_FILE}; 'daq-app enrol' with --protocol makes one")
    with _reading(folder) as connection:
        return _study(connection, folder)


def enrol(folder: Path, subject: str, body: Body) -> Member:
    """Reserve a place for a subject, and return it. Raises StudyError, SettingsError for a value out of range."""
    check_code("the subject", subject)

    def choose(study: Study) -> tuple[str, Mapping[str, Any]]:
        check_body(body, study.protocol)
        if subject in study.members:
            raise StudyError(f"{subject} was enrolled in {study.name} before: every subject has a code of its own")
        return "enrolled", {"slot": free_slot(list(study.members.values())), "body": msgspec.to_builtins(body)}

    return _add_event(folder, subject, choose).members[subject]


def withdraw(folder: Path, subject: str, reason: str) -> Member:
    """Withdraw a subject: its slot becomes free, its recordings stay. Raises StudyError."""
    if not reason.strip():
        raise StudyError("say why the subject is withdrawn")

    def choose(study: Study) -> tuple[str, Mapping[str, Any]]:
        return "withdrawn", {"slot": study.member(subject).slot, "reason": reason}

    return _add_event(folder, subject, choose).members[subject]


def note(folder: Path, kind: str, data: Mapping[str, Any]) -> Study:
    """Record that the labels were shown, or that a key was opened, and return the study."""
    return _add_event(folder, "", lambda _: (kind, data))


def enrolled_visit(folder: Path, subject: str) -> tuple[Protocol, int, Body, StudyPlace]:
    """Return protocol, seed, body and place of a subject's visit, as fixed by the enrolment. Raises StudyError."""
    study = open_study(folder)
    member = study.member(subject)
    return study.protocol, study.session_seed(member.slot), member.body, study.place(member, study_key(folder))


def study_key(folder: Path) -> Key | None:
    """Return the key of a blinded study, for the program alone; None where it is not blinded. Raises StudyError."""
    sha256 = open_study(folder).key_sha256
    if sha256 is None:
        return None
    path = folder / KEY_FILE
    with name_failure(StudyError, f"{path} cannot be read"):
        content = read_within_limit(path)
    try:
        key = Key.unseal(json_object(content)["sealed"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StudyError(f"{path} cannot be read ({error}); restore it from a copy") from error
    if key.sha256 != sha256:
        raise StudyError(f"{path} is not the key that was sealed: its SHA-256 differs; restore it from a copy")
    return key


def _new_key(protocol: Protocol) -> Key:
    stimuli = [KeyedStimulus(*stimulus) for stimulus in protocol.labels]
    codes = opaque_codes(len(stimuli), secrets.randbelow(2**31))
    return Key(secrets.token_hex(16), dict(zip(codes, stimuli, strict=True)))


def _add_event(folder: Path, subject: str, choose: Callable[[Study], tuple[str, Mapping[str, Any]]]) -> Study:
    """Add the event that `choose` returns for the present study, in one transaction."""
    open_study(folder)  # reports a folder that is no study
    with _transaction(folder) as connection:
        kind, data = choose(_study(connection, folder))
        _tell(connection, kind, subject, data)
        return _study(connection, folder)


def _tell(connection: sqlite3.Connection, kind: str, subject: str, data: Mapping[str, Any]) -> None:
    (last_number,) = connection.execute("SELECT coalesce(max(number), 0) FROM events").fetchone()
    utc = datetime.now(UTC).isoformat(timespec="seconds")
    data = {**data, "crc32": _check_sum(last_number + 1, utc, kind, subject, json.dumps(data))}
    text = json.dumps(data, ensure_ascii=False, allow_nan=False)
    connection.execute("INSERT INTO events VALUES (?, ?, ?, ?, ?)", (last_number + 1, utc, kind, subject, text))


def _check_sum(*values: object) -> int:
    return crc32("\n".join(map(str, values)).encode())


def _event(number: int, utc: str, kind: str, subject: str, text: str) -> StudyEvent:
    """Return an event as it was stored. Raises ValueError where it is damaged."""
    data = json_object(text)
    if data.pop("crc32", None) not in (None, _check_sum(number, utc, kind, subject, json.dumps(data))):
        raise ValueError(f"event {number} is not what it was")
    row = (number, utc, kind, subject, data)
    return StudyEvent(*msgspec.convert(row, tuple[int, str, str, str, dict[str, Any]]))


def _study(connection: sqlite3.Connection, folder: Path) -> Study:
    path = folder / STUDY_FILE
    head = dict(connection.execute("SELECT name, value FROM head").fetchall())
    if head.get("version") != str(_VERSION):
        raise StudyError(f"{path} is of version {head.get('version')}; this program reads {_VERSION}")
    events = connection.execute("SELECT number, utc, kind, subject, data FROM events ORDER BY number").fetchall()
    check_sum = head.pop("crc32", None)  # none in older files
    try:
        if check_sum not in (None, str(_check_sum(*(head[name] for name in _HEAD_NAMES)))):
            raise ValueError("its head is not what it was")
        study = Study(
            name=folder.resolve().name,
            protocol=from_toml(str(head["protocol"]), Protocol, f"{path}: the protocol"),
            seed=int(head["seed"]),
            key_sha256=head["key_sha256"] or None,
            events=tuple(_event(*row) for row in events),
        )
        _ = study.members, study.unblinded  # incomplete events fail here, not where they are used
    except (ValueError, KeyError, TypeError, msgspec.ValidationError) as error:
        raise StudyError(f"{path} is damaged ({error}); restore it from a copy") from error
    return study


@contextmanager
def _reading(folder: Path) -> Generator[sqlite3.Connection]:
    path = folder / STUDY_FILE
    with name_failure(StudyError, f"{path} cannot be read", failures=DATABASE_FAILURES):
        path.open("rb").close()  # raises the cause, which SQLite does not report
        address = f"{path.resolve().as_uri()}?mode=rw"  # rolls back an interrupted change; read-only where the file is
        with closing(limit_values(sqlite3.connect(address, uri=True, timeout=_PATIENCE))) as connection:
            yield connection


@contextmanager
def _transaction(folder: Path) -> Generator[sqlite3.Connection]:
    """Open a connection in one transaction, committed as a whole or not at all."""
    path = folder / STUDY_FILE
    with (
        name_failure(StudyError, f"{path} cannot be changed", ", and repeat", (sqlite3.Error,)),
        closing(limit_values(sqlite3.connect(path, timeout=_PATIENCE, isolation_level=None))) as connection,
    ):
        connection.execute("PRAGMA synchronous=FULL")
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield connection
        except BaseException:
            connection.execute("ROLLBACK")
            raise
        connection.execute("COMMIT")
