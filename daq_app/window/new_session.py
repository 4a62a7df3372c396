"""The form of a new session, and its check, with a sentence for each wrong field. No Qt."""

import os
import re
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import chain
from pathlib import Path

from daq_app.recorder.messages import Kind, People, StartSession
from daq_app.window.state import BenchState
from daq_app.wording import sentence, tr, tr_noop, two_meanings, typed_number
from sessions.file_access import failure_sentence
from sessions.plan.plan import NORMALS, Frame, Hand, Phase
from sessions.plan.protocols.planning import Body, StudyPlace, VisitSetting, is_code, plan
from sessions.plan.protocols.protocol import AREAS, HEIGHTS, LARGEST_SEED, Protocol, phases_before, protocol
from sessions.plan.study import Study, StudyError, enrol, enrolled_visit, is_study, open_study
from sessions.recording import Recording, RecordingError, Setting
from sessions.recording.manifest import is_sealed
from sessions.recording.recovery import is_in_use
from sessions.recording.storage import check_room
from sessions.run.resuming import check_resumable
from sessions.toml_file import SettingsError

PILOT, PILOTS = "PILOT", "pilots"  # code of the simulated subject, and subfolder of the sessions' folder
_NUMBERS = {
    "height": tr_noop("A height is a number of millimetres from −{highest:.0f} to {highest:.0f}, or left empty."),
    "area": tr_noop("An area is a number of mm² from {least:.0f} to {most:.0f}, or left empty."),
}
_LONGEST_LIST = 20  # most unfinished sessions listed


@dataclass(frozen=True, slots=True)
class SessionForm:
    """The entries of the page, as typed."""

    subject: str = ""
    protocol: str = "sensotact-friction"
    study: str = ""
    folder: str = "recordings"
    seed: str = ""  # empty: a new one
    stroking_hand: Hand | None = None
    answering_hand: Hand | None = None
    forces: bool = True
    height: str = ""  # of the stimulus's face above the transducer's origin [mm]; empty: from bench or protocol
    normal: str = ""  # axis along which pressing is positive, one of AXES; empty: from bench or protocol
    area: str = ""  # of finger and surface [mm2], for tau_max; empty: from the protocol
    pre_evaluation: bool = False  # every stimulus judged once before everything else
    practice: bool = False  # before the trials that count
    language: str = ""  # code of the subject's language; empty: the protocol's own
    simulated: bool = False  # simulate the subject's judgement too, on a simulated bench
    tablet: str = ""  # why the subject's page is not on a tablet, if it should be
    pilot: bool = False  # kept apart from real sessions, in no study

    @property
    def root_folder(self) -> Path:
        """Return the folder named; as typed if it begins with an unknown user's home."""
        folder = Path(self.folder.strip() or ".")
        try:
            return folder.expanduser()
        except RuntimeError:
            return folder

    @property
    def parent_folder(self) -> Path:
        """Return the folder in which the session's folder is created."""
        return self.root_folder / self.study.strip()


class Refusal(dict[str, str]):
    """Why no session can begin: a sentence for each wrong field, by its name."""


@dataclass(frozen=True, slots=True)
class Bench:
    """The bench's properties that matter to the form."""

    connected: bool = False
    simulated: bool = False
    frame: Frame | None = None
    rate: float = float("nan")  # readings a second as set [Hz]; nan if unknown


@dataclass(frozen=True, slots=True)
class Enrolment:
    """The enrolment of a form's subject in its study."""

    protocol: str  # the study's own, which applies to all its sessions
    sentence: str
    may_enrol: bool = False  # the subject's code was never used in the study
    enrolled: bool = False  # the subject's session can begin


@dataclass(frozen=True, slots=True)
class UnfinishedSession:
    """A session that was cut short and can be resumed."""

    folder: Path
    description: str
    in_use: bool = False  # a recorder still writes it: of another window, or of one that is gone
    uri: str = ""  # address of its transducer; "" without one


def bench_of(bench: BenchState) -> Bench:
    """Return the form's view of the bench that the window shows."""
    simulated = bench.info is not None and bench.info.simulated and bench.frame is not None
    rate = float("nan") if bench.info is None else bench.info.rate
    return Bench(bench.link == "open", simulated, bench.frame, rate)


def pilot_form(form: SessionForm, bench: Bench) -> SessionForm:
    """Return the form of a pilot of a form's or its study's protocol, which needs no subject.

    A pilot uses a connected simulated bench, else records scores only: no simulated hand strokes a real bench.
    """
    forces = form.forces and bench.simulated
    return replace(form, subject=PILOT, forces=forces, height="", normal="", area="", simulated=True, pilot=True)


def check_form(
    form: SessionForm, bench: Bench, now: datetime, new_seed: int, settings: tuple[Setting, ...] = ()
) -> StartSession | Refusal:
    """Return the request that begins the session, or the errors of the form.

    `new_seed` is used if the form names none; `settings` are kept with the session in addition to the page's. In a
    study, protocol, seed and the subject's own finger are those of the enrolment.
    """
    if wrong := _refusals(form, bench):
        return wrong
    phases_wanted: dict[Phase, bool] = {"pre-evaluation": form.pre_evaluation, "practice": form.practice, "main": True}
    phases: list[Phase] = [phase for phase, included in phases_wanted.items() if included]
    frame, area = (bench.frame, _number(form.area)) if form.forces else (None, None)
    setting = VisitSetting(frame, area, form.stroking_hand, form.answering_hand, form.language or None)
    try:
        session_protocol, seed, body, study_place = _choose_protocol(form, new_seed)
        session_plan = plan(
            session_protocol, form.subject.strip(), seed, forces=form.forces, setting=setting,
            phases=phases if len(phases) > 1 else None, body=body, place=study_place,
        )  # fmt: skip
    except StudyError as error:
        return Refusal({"subject": _sentence(error)})
    except (SettingsError, OSError) as error:
        return Refusal({"protocol": _sentence(error)})
    if form.forces:
        normal = form.normal if form.normal in NORMALS else None
        height = _number(form.height) or 0.0 if form.height.strip() else None
        session_plan = replace(session_plan, frame=session_plan.frame.with_values(normal, height, "measured"))
    folder = (form.root_folder / PILOTS if form.pilot else form.parent_folder) / session_plan.folder_name(now)
    hand: Kind = "simulated hand" if form.forces and bench.simulated else "people"
    people = People("simulated people" if form.simulated else hand, seed, session_protocol.simulated_friction)
    page_settings = [Setting("seed", seed, "", "set" if form.seed.strip() and study_place is None else "default")]
    if form.study.strip() and not form.pilot:
        page_settings.append(Setting("study", form.study.strip(), "", "set"))
    return StartSession(session_plan, str(folder), people, (*page_settings, *settings))


def refusals(form: SessionForm, bench: Bench, record: Enrolment | None) -> Refusal:
    """Return everything that prevents a session from beginning; `record` is the form's enrolment."""
    wrong = _refusals(form, bench)
    if form.tablet and not form.simulated:
        wrong["tablet"] = form.tablet
    if record is None:
        try:
            protocol(form.protocol)
        except (SettingsError, OSError) as error:
            wrong["protocol"] = _sentence(error)
    elif not record.enrolled:
        wrong.setdefault("subject" if record.protocol else "study", record.sentence)
    if wrong:
        return wrong
    session = check_form(form, bench, datetime.now(), 0)
    if isinstance(session, Refusal):
        return session
    try:
        check_room(Path(session.folder).absolute().parent, session.plan, bench.rate if form.forces else None)
    except (RecordingError, OSError) as error:
        return Refusal({"folder": _sentence(error)})
    return wrong


def optional_phases(form: SessionForm) -> tuple[Phase, ...]:
    """Return the phases that may precede the main trials in the protocol of the study, or of the form without one."""
    try:
        return phases_before(_protocol(form))
    except (StudyError, SettingsError, OSError):
        return ()


def subject_texts(form: SessionForm) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the languages of the form's protocol, its own first, and its texts in the form's language."""
    try:
        original = _protocol(form)
        version = original.in_language(form.language) if form.language in original.languages else original
    except (StudyError, SettingsError, OSError):
        return (), ()
    texts = [(block.instruction, block.question, *(block.scale_ends or ())) for block in version.blocks]
    return original.languages, tuple(chain.from_iterable(texts))


def enrolment(form: SessionForm) -> Enrolment | None:
    """Return the subject's enrolment in the form's study; None if the form names no existing study."""
    try:
        study = _study(form)
    except (StudyError, SettingsError, OSError) as error:
        return Enrolment("", _sentence(error))
    if study is None:
        return None
    subject, name = form.subject.strip(), study.protocol.name
    if not is_code(subject.strip()):
        return Enrolment(name, tr("A study of protocol {name}: give the code of one of its subjects.", name=name))
    if subject not in study.members:
        sentence_text = tr("{subject} is not enrolled in this study ({name}) yet.", subject=subject, name=name)
        return Enrolment(name, sentence_text, may_enrol=True)
    try:
        member = study.member(subject)
    except StudyError as error:
        return Enrolment(name, _sentence(error))
    remark = "" if study.key_sha256 is None or study.unblinded else tr("; blinded: codes alone are shown")
    sentence_text = tr(
        "{subject} is enrolled: protocol {name}, row {row}{blinded}.",
        subject=subject, name=name, row=study.row(member.slot), blinded=remark,
    )  # fmt: skip
    return Enrolment(name, sentence_text, enrolled=True)


def enrol_subject(form: SessionForm) -> str:
    """Enrol the form's subject in its study, without measurements of the finger; return why it failed, or ""."""
    try:
        enrol(form.parent_folder, form.subject.strip(), Body())
    except (StudyError, SettingsError, OSError) as error:
        return _sentence(error)
    return ""


def _choose_protocol(form: SessionForm, new_seed: int) -> tuple[Protocol, int, Body | None, StudyPlace | None]:
    """Return protocol, seed, the subject's finger and study place, from the study if there is one, else the form."""
    study = _study(form)
    if study is None:
        return protocol(form.protocol), int(form.seed) if form.seed.strip() else new_seed, None, None
    if form.pilot:
        return study.protocol, new_seed, None, None
    return enrolled_visit(form.parent_folder, form.subject.strip())


def _study(form: SessionForm) -> Study | None:
    """Return the study that a form names; None if there is no such study."""
    folder = form.parent_folder
    return open_study(folder) if form.study.strip() and is_study(folder) else None


def _protocol(form: SessionForm) -> Protocol:
    """Return the protocol of the form's study, or without a study its own."""
    study = _study(form)
    return protocol(form.protocol) if study is None else study.protocol


def unfinished_sessions(folder: Path) -> tuple[UnfinishedSession, ...]:
    """Return the resumable sessions below a folder or a study in it, the newest first."""
    unfinished: list[UnfinishedSession] = []
    modified: dict[Path, float] = {}
    with suppress(OSError):  # a folder that is unreadable or disappears
        for file in (*folder.glob("*/session.sqlite"), *folder.glob("*/*/session.sqlite")):
            modified[file] = file.stat().st_mtime
    for file in sorted(modified, key=lambda file: -modified[file]):
        if len(unfinished) == _LONGEST_LIST:
            break
        try:
            if is_sealed(file.parent):
                continue
            in_use = is_in_use(file)
            recording = Recording.open(file.parent)
            check_resumable(recording)
        except (RecordingError, OSError):
            continue
        subject, trials = recording.plan.subject, recording.trials
        number = sum(record.outcome not in ("open", "skipped") for record in trials)
        start = _local_time(recording.provenance.get("created_utc"))
        description = tr(
            "{subject}, {begun}: trials done {done} of {count}",
            subject=subject, begun=start, done=number, count=len(trials),
        )  # fmt: skip
        uri = "" if recording.info is None else recording.info.uri
        unfinished.append(UnfinishedSession(file.parent, description, in_use, uri))
    return tuple(unfinished)


def _local_time(stamp: object) -> str:
    """Return date and time in this computer's zone; a dash for an unreadable stamp.

    >>> _local_time("2026-11-26T19:51:33"), _local_time(None)
    ('2026-11-26 19:51', '–')
    """
    try:
        return datetime.fromisoformat(str(stamp)).astimezone().strftime("%Y-%m-%d %H:%M")
    except ValueError:
        return "–"


def _refusals(form: SessionForm, bench: Bench) -> Refusal:
    wrong = Refusal()
    if not is_code(form.subject.strip()):
        wrong["subject"] = tr("Give a code of letters, digits, - and _ (at most 32), never a name.")
    if re.search(r"[/\\]|^\.", form.study.strip()):
        wrong["study"] = tr("A study's name has no slash in it and does not begin with a dot.")
    seed = form.seed.strip()
    if seed and not (seed.isascii() and seed.isdigit() and int(seed) <= LARGEST_SEED):
        wrong["seed"] = tr(
            "A seed is a whole number from 0 to {largest}; leave it empty for a new one.", largest=LARGEST_SEED
        )
    for name, text, (least, most) in (("height", form.height, HEIGHTS), ("area", form.area, AREAS)):
        value = _number(text)
        if text.strip() and (value is None or not least <= value <= most):
            wrong[name] = tr(_NUMBERS[name], highest=most, least=least, most=most) + _doubt(text)
    if unusable := _why_unusable(form.root_folder):
        wrong["folder"] = unusable
    if form.forces and not bench.connected:
        wrong["forces"] = tr("No transducer is connected: connect one, or choose scores only.")
    if form.simulated and form.forces and bench.connected and not bench.simulated:
        wrong["simulated"] = tr("Only the simulated bench can be stroked by a simulated subject.")
    return wrong


def _why_unusable(folder: Path) -> str:
    """Return why no session can be kept below a folder, or ""."""
    try:
        nearest = next((path for path in (folder, *folder.parents) if path.exists()), folder)
        if not nearest.is_dir():
            return tr("{place} is a file: choose a folder.", place=nearest)
    except OSError as error:
        return _sentence(error)
    if str(folder).startswith("~") or not os.access(nearest, os.W_OK):
        return tr("Nothing can be written in {place}: choose another folder.", place=folder)
    return ""


def _number(text: str) -> float | None:
    """Return a typed number, with a decimal point or comma; None if it is not a number or ambiguous."""
    size = typed_number(_without_sign(text))
    return -size if size is not None and text.strip().startswith(("-", "−")) else size


def _without_sign(text: str) -> str:
    return text.strip().removeprefix("+").removeprefix("-").removeprefix("−")


def _doubt(text: str) -> str:
    """Return advice for a number whose comma may group thousands, "" for any other."""
    meanings = two_meanings(_without_sign(text))
    return "" if meanings is None else tr(" Type {whole} or {fraction}.", whole=meanings[0], fraction=meanings[1])


def _sentence(error: Exception) -> str:
    return sentence(failure_sentence(error) if isinstance(error, OSError) else str(error))
