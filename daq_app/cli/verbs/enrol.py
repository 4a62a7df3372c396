"""Enrol a subject in a study: a row of its design is reserved, and released when the subject is withdrawn.

A study is a folder. --protocol makes it, and fixes its protocol; --blind hides which stimulus has which code until
'daq-app unblind' opens the key. Without --subject the study is printed.
"""

import argparse
import secrets
from dataclasses import asdict
from pathlib import Path
from typing import Any

from daq_app.cli.options import add_body_arguments, add_seed, body_of
from daq_app.console import DONE, Console, WrongValue, table
from sessions.file_access import check_replaceable, write_whole
from sessions.plan import study as studies
from sessions.plan.protocols.protocol import protocol_file
from sessions.plan.study import Member, Study, StudyError
from sessions.toml_file import text_of

EXAMPLE = "daq-app enrol studies/friction --subject P07 --finger tip_radius=6.5 contact_angle=40"
LABELS = "For whoever puts the labels on."  # the first line of their file
_COLUMNS = ["subject", "row", "own finger, angle, depths", "withdrawn"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", type=Path, metavar="STUDY", help="the study's folder")
    parser.add_argument("--protocol", metavar="PROTOCOL", help="make the study: a built-in protocol, or a TOML file")
    add_seed(parser, "seed of a new study's orders (a random one, which is recorded)", None, 2**31 - 1)
    parser.add_argument("--blind", action="store_true", help="for a new study: show codes only until it is unblinded")
    parser.add_argument("--subject", metavar="CODE", help="a code, never a name")
    add_body_arguments(parser)
    parser.add_argument("--withdraw", metavar="REASON", help="withdraw the subject; its row is released")
    meaning = "write the code of each stimulus, for the person who labels them"
    parser.add_argument("--labels", type=Path, metavar="FILE", help=meaning)


def run(options: argparse.Namespace, console: Console) -> int:
    folder: Path = options.study
    _refuse_mixtures(options)
    if options.labels is not None:
        check_replaceable(options.labels, LABELS)
    body = body_of(options)
    if options.protocol is not None:
        file = protocol_file(options.protocol)
        seed = secrets.randbelow(2**31) if options.seed is None else options.seed
        studies.create_study(folder, text_of(file), seed, blinded=options.blind, source=str(file))
    member = None
    if options.withdraw is not None:
        member = studies.withdraw(folder, options.subject, options.withdraw)
    elif options.subject is not None:
        member = studies.enrol(folder, options.subject, body)
    if options.labels is not None:
        _write_labels(folder, options.labels)
        console.note(f"{options.labels} says which stimulus has which code: give it to the person who labels them")
    _show(studies.open_study(folder), member, console)
    return DONE


def _refuse_mixtures(options: argparse.Namespace) -> None:
    making = options.protocol is not None
    if making and studies.is_study(options.study):
        raise StudyError(f"{options.study} is a study already, and its protocol is fixed: enrol without --protocol")
    if (options.blind or options.seed is not None) and not making:
        raise WrongValue("--blind and --seed are decided when a study is made: give --protocol")
    if options.withdraw is not None and options.subject is None:
        raise WrongValue("--withdraw needs --subject")
    if (options.finger or options.depth) and (options.subject is None or options.withdraw is not None):
        raise WrongValue("--finger and --depth describe a subject that is being enrolled: give --subject")


def _write_labels(folder: Path, path: Path) -> None:
    """Write the code of each stimulus to a file, and record in the study that it was written."""
    key, study = studies.study_key(folder), studies.open_study(folder)
    labels = study.protocol.labels if key is None else key.labels
    lines = [f"{descriptor} {index}: {code}" for (descriptor, index), code in labels.items()]
    if key is not None:
        studies.note(folder, "labels_told", {})
    write_whole(path, "\n".join([LABELS, *lines, ""]).encode())


def _show(study: Study, member: Member | None, console: Console) -> None:
    rows = [_row(study, entry) for entry in study.members.values()]
    console.result(
        study=study.name,
        protocol=study.protocol.name,
        blinded=study.key_sha256 is not None and not study.unblinded,
        rows=study.rows,
        subject=None if member is None else _row(study, member),
        subjects=rows,
    )
    design = "random orders" if study.rows is None else f"a Williams design of {study.rows} rows"
    blind = "" if study.key_sha256 is None else ", unblinded" if study.unblinded else ", blinded"
    console.say(f"{study.name}: {study.protocol.name}, {design}{blind}")
    cells = [[row["subject"], str(row["row"]), row["own"] or "–", row["withdrawn"] or "–"] for row in rows]
    console.say(table(cells, header=_COLUMNS) if cells else "nobody is enrolled")


def _row(study: Study, member: Member) -> dict[str, Any]:
    body = member.body
    measures = {**asdict(body.finger), "contact_angle": body.contact_angle}
    measures |= {f"depth of {block}": depth for block, depth in body.indentations.items()}
    own = ", ".join(f"{name} {value:g}" for name, value in measures.items() if value is not None)
    return {"subject": member.subject, "row": study.row(member.slot), "own": own, "withdrawn": member.withdrawn}
