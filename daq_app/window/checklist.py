"""The conditions for beginning a session, card by card, each with one line on what is missing. No Qt."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from daq_app.window.new_session import Bench, Enrolment, SessionForm, enrolment, refusals
from daq_app.wording import tr, tr_noop
from sessions.plan.protocols.planning import is_code
from sessions.plan.study import is_study

CARD_FIELDS: Mapping[str, tuple[str, ...]] = {
    tr_noop("Study and protocol"): ("study", "protocol", "seed"),
    tr_noop("Subject"): ("subject",),
    tr_noop("Transducer"): ("forces", "simulated", "height", "area"),
    tr_noop("Subject's screen"): ("tablet",),
    tr_noop("Disk"): ("folder",),
}  # fields of each card, the worst first


@dataclass(frozen=True, slots=True)
class Card:
    """One card of the checklist."""

    name: str
    ready: bool
    text: str  # what is missing; or useful information
    field: str = ""  # the first wrong one


def checklist(form: SessionForm, bench: Bench, screen: str) -> tuple[Card, ...]:
    """Return the cards; `screen` describes the calibration of the subject's line."""
    record = enrolment(form)
    wrong = refusals(form, bench, record)
    notes = {
        "Study and protocol": _study_note(form, record),
        "Subject": _subject_note(form, record),
        "Transducer": "" if not form.forces or not bench.simulated else tr("The simulated bench."),
        "Subject's screen": screen,
    }
    cards: list[Card] = []
    for name, fields in CARD_FIELDS.items():
        first = next((field for field in fields if field in wrong), "")
        cards.append(Card(name, not first, wrong.get(first, notes.get(name, "")), first))
    return tuple(cards)


def first_missing(cards: tuple[Card, ...]) -> Card | None:
    """Return the next card to complete: the transducer's if it is missing, else the first that is not ready."""
    gaps = [card for card in cards if not card.ready]
    return next((card for card in gaps if card.field == "forces"), gaps[0] if gaps else None)


def headline(cards: tuple[Card, ...], subject: str) -> str:
    """Return the sentence for the next step."""
    first = first_missing(cards)
    match first:
        case None:
            return tr("Press Enter to start the session of {subject}.", subject=subject.strip())
        case Card(field="forces"):
            return tr("Connect a transducer, or choose scores only.")
        case Card(field="subject") if not is_code(subject.strip()):
            return tr("Give the subject's code, then press Enter to start.")
        case _:
            return tr("Complete the card “{name}”.", name=tr(first.name))


def codes_in(folder: Path) -> tuple[str, ...]:
    """Return the codes of the subjects that have sessions in a folder, one for each session."""
    try:
        names = sorted(file.parent.name for file in folder.glob("*/session.*") if file.stem == "session")
    except OSError:
        return ()
    matches = (re.fullmatch(r"(.+)_[^_]+_\d{8}T\d{6}", name) for name in dict.fromkeys(names))
    return tuple(match[1] for match in matches if match is not None)


def next_code(codes: tuple[str, ...]) -> str:
    """Return the code after the one with the highest final number; "P01" if there is none.

    >>> next_code(("P01", "P09", "pilot")), next_code(())
    ('P10', 'P01')
    """
    pairs = [match.groups() for code in codes if (match := re.fullmatch(r"(.*?)(\d{1,9})", code))]
    if not pairs:
        return "P01"
    prefix, digits = max(pairs, key=lambda pair: int(pair[1]))
    return f"{prefix}{int(digits) + 1:0{len(digits)}d}"


def studies_in(folder: Path) -> tuple[str, ...]:
    """Return the names of the studies in a folder."""
    try:
        return tuple(sorted(child.name for child in folder.iterdir() if child.is_dir() and is_study(child)))
    except OSError:
        return ()


def _study_note(form: SessionForm, record: Enrolment | None) -> str:
    name = form.study.strip()
    if not name:
        return ""
    if record is not None:
        return tr("A study of protocol {protocol}.", protocol=record.protocol)
    names = ", ".join(studies_in(form.parent_folder.parent))
    elsewhere = tr(" Studies there: {there}.", there=names) if names else ""
    return tr("“{name}” is no study: sessions go to a plain folder, by this page's protocol.", name=name) + elsewhere


def _subject_note(form: SessionForm, record: Enrolment | None) -> str:
    if record is not None:
        return record.sentence
    subject = form.subject.strip()
    if not (visits := codes_in(form.parent_folder).count(subject)):
        return ""
    return tr("Sessions of {subject} here already: {before}. Is it the same person?", subject=subject, before=visits)
