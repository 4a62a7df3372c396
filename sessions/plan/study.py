"""A study: one protocol, its design's rows, and who is enrolled in which. What happened in it, in order, tells all."""

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Annotated, Any

import msgspec

from sessions.plan.orders import shuffled
from sessions.plan.plan import SessionPlan, Trial
from sessions.plan.protocols import Body, Labels, Protocol, StudyPlace, design_rows, is_code


@dataclass(frozen=True, slots=True)
class Key:
    """Which stimulus bears which code, throughout a study."""

    salt: str  # hexadecimal, by chance: without it the few possible keys could be tried one by one
    stimuli: Mapping[str, tuple[str, int]]  # code -> descriptor and index

    @property
    def sha256(self) -> str:
        """Return the SHA-256 of the UTF-8 text "salt", then a line "code descriptor index" each, codes sorted."""
        lines = [self.salt, *(f"{code} {of} {index}" for code, (of, index) in sorted(self.stimuli.items()))]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()

    def sealed(self) -> str:
        """Return the key as a text that reveals nothing to whoever opens its file by chance (Base64 of JSON)."""
        return base64.b64encode(json.dumps(self.to_dict()).encode()).decode()

    @staticmethod
    def opened(sealed: str) -> "Key":
        """Return the key that `sealed` gave the text for. Raises ValueError where it is none."""
        return Key.from_dict(json.loads(base64.b64decode(sealed, validate=True)))

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        stimuli = {code: {"descriptor": of, "index": index} for code, (of, index) in sorted(self.stimuli.items())}
        return {"salt": self.salt, "stimuli": stimuli}

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> "Key":
        """Return the key that `to_dict` gave `data` for. Raises ValueError where it is none."""
        try:
            stimuli = {code: (str(of["descriptor"]), int(of["index"])) for code, of in data["stimuli"].items()}
            return Key(str(data["salt"]), stimuli)
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"this is no key of a study ({error})") from error

    def of(self, trial: Trial) -> Trial:
        """Return a trial with the index of its stimulus. Raises ValueError where the key lacks its code."""
        stimulus = self.stimuli.get(trial.stimulus.code)
        if stimulus is None:
            raise ValueError(f"the key has no stimulus {trial.stimulus.code}")
        return replace(trial, stimulus=replace(trial.stimulus, index=stimulus[1]))

    def plan(self, plan: SessionPlan) -> SessionPlan:
        """Return a blinded plan with the index of every stimulus."""
        return replace(plan, blocks=tuple(replace(b, trials=tuple(map(self.of, b.trials))) for b in plan.blocks))


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
    body: Body  # what is the subject's own
    withdrawn: str | None = None  # why; None while enrolled


@dataclass(frozen=True, slots=True)
class Study:
    """A study as it stands."""

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
                before = members[event.subject]
                members[event.subject] = Member(before.subject, before.slot, before.body, str(event.data["reason"]))
        return members

    @property
    def unblinded(self) -> bool:
        """Say whether the key of the whole study was opened."""
        return any(event.kind == "unblinded" and event.data.get("session") is None for event in self.events)

    @property
    def rows(self) -> int | None:
        """Return how many rows the design has; None where every order is drawn for itself."""
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
        """Return the row of the design, from 1, that a slot stands for.

        Slots are filled one after the other. Each round of the design has its rows in an order by chance; where there
        is no design the slot itself is the row.
        """
        if self.rows is None:
            return slot + 1
        cycles, within = divmod(slot, self.rows)
        return int(shuffled(range(self.rows), self.seed, f"rows/{cycles}")[within]) + 1

    def session_seed(self, slot: int) -> int:
        """Return the seed of what else chance decides for a slot: the same for all visits of a subject."""
        digest = hashlib.sha256(f"{self.seed}/slot/{slot}".encode()).digest()
        return int.from_bytes(digest[:4], "big") % 2**31

    def place(self, member: Member, key: Key | None) -> StudyPlace:
        """Return the place of a subject, from which its plan is made; `key` is needed where the study is blinded."""
        labels = self.protocol.labels if key is None else labels_of(key)
        sealed = None if self.unblinded else self.key_sha256
        return StudyPlace(self.name, member.slot, self.row(member.slot), self.seed, labels, sealed)


def free_slot(members: Sequence[Member]) -> int:
    """Return the first slot that nobody holds: one that was given back comes first."""
    slots = {member.slot for member in members if member.withdrawn is None}
    return next(slot for slot in count() if slot not in slots)


def labels_of(key: Key) -> Labels:
    """Return the code of each stimulus."""
    return {stimulus: code for code, stimulus in key.stimuli.items()}


def check_code(what: str, code: str) -> None:
    """Raise StudyError unless `code` is one: no name, nothing a file's name could not hold."""
    if not is_code(code):
        raise StudyError(f'{what} "{code}" is not allowed: a code of letters, digits, - and _, never a name')
