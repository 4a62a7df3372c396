"""What the page of a new session asks for, and what is wrong with it: a sentence for each field. No Qt."""

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

PILOT, PILOTS = "PILOT", "pilots"  # code of the simulated subject, and folder below that of the sessions
_NUMBERS = {
    "height": tr_noop("A height is a number of millimetres from −{highest:.0f} to {highest:.0f}, or left empty."),
    "area": tr_noop("An area is a number of mm² from {least:.0f} to {most:.0f}, or left empty."),
}
_LONGEST_LIST = 20  # sessions that were cut short, at most


@dataclass(frozen=True, slots=True)
class SessionForm:
    """What stands on the page; everything as it was typed."""

    subject: str = ""
    protocol: str = "sensotact-friction"
    study: str = ""
    folder: str = "recordings"
    seed: str = ""  # empty: a new one
    stroking_hand: Hand | None = None
    answering_hand: Hand | None = None
    forces: bool = True
    height: str = ""  # of the stimulus's face above the transducer's origin [mm]; empty: as bench or protocol state it
    normal: str = ""  # axis along which pressing is positive, one of AXES; empty: likewise
    area: str = ""  # of finger and surface [mm2], for tau_max; empty: likewise
    pre_evaluation: bool = False  # every stimulus judged once before all else
    practice: bool = False  # before the trials that count
    language: str = ""  # that the subject reads, its code; empty: the protocol's own
    simulated: bool = False  # the subject's judgement too, where the bench is simulated
    tablet: str = ""  # why the subject's page is on no tablet, where it should be
    pilot: bool = False  # kept apart from what people do, in no study

    @property
    def root_folder(self) -> Path:
        """Return the folder that it names; as it was typed where it begins with the home of nobody."""
        folder = Path(self.folder.strip() or ".")
        try:
            return folder.expanduser()
        except RuntimeError:
            return folder

    @property
    def parent_folder(self) -> Path:
        """Return the folder in which the session gets its own."""
        return self.root_folder / self.study.strip()


class Refusal(dict[str, str]):
    """Why no session can begin: a sentence for each field that is wrong, by its name."""


@dataclass(frozen=True, slots=True)
class Bench:
    """What the page needs to know of the bench."""

    connected: bool = False
    simulated: bool = False
    frame: Frame | None = None
    rate: float = float("nan")  # readings a second as set [Hz]; nan where unknown


@dataclass(frozen=True, slots=True)
class Enrolment:
    """What the study that a form names says of its subject."""

    protocol: str  # the study's own, which holds for all its sessions
    sentence: str
    may_enrol: bool = False  # the subject is a code that nobody in the study has borne
    enrolled: bool = False  # the subject's session can begin


@dataclass(frozen=True, slots=True)
class UnfinishedSession:
    """A session that was cut short and can go on."""

    folder: Path
    description: str


def bench_of(bench: BenchState) -> Bench:
    """Return what the page needs to know of the bench that the window shows."""
    simulated = bench.info is not None and bench.info.simulated and bench.frame is not None
    rate = float("nan") if bench.info is None else bench.info.rate
    return Bench(bench.link == "open", simulated, bench.frame, rate)


def pilot_form(form: SessionForm, bench: Bench) -> SessionForm:
    """Return the form that pilots the protocol of a form, or of its study: nobody is named and nobody is needed.

    A connected simulated bench is stroked; else scores alone are piloted, for no simulated hand strokes a real one.
    """
    forces = form.forces and bench.simulated
    return replace(form, subject=PILOT, forces=forces, height="", normal="", area="", simulated=True, pilot=True)


def check_form(
    form: SessionForm, bench: Bench, now: datetime, new_seed: int, settings: tuple[Setting, ...] = ()
) -> StartSession | Refusal:
    """Return the request that begins the session, or what is wrong with the form.

    `new_seed` is used where the form names none; `settings` are kept with the session beside the page's own. In a
    study, protocol, seed and the subject's own finger are those that were decided at its enrolment.
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
    """Return everything that keeps a session from beginning; `record` is the form's enrolment."""
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
    """Return the phases that may precede the main trials in the protocol of the study, or else of the form."""
    try:
        return phases_before(_protocol(form))
    except (StudyError, SettingsError, OSError):
        return ()


def subject_texts(form: SessionForm) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the languages that the form's protocol has, its own first, and what of it is read in the form's."""
    try:
        original = _protocol(form)
        version = original.in_language(form.language) if form.language in original.languages else original
    except (StudyError, SettingsError, OSError):
        return (), ()
    texts = [(block.instruction, block.question, *(block.scale_ends or ())) for block in version.blocks]
    return original.languages, tuple(chain.from_iterable(texts))


def enrolment(form: SessionForm) -> Enrolment | None:
    """Return what the study that the form names says of the subject; None where it names none that was made."""
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
    """Enrol the form's subject in its study, without measures of its finger; return why it failed, or ""."""
    try:
        enrol(form.parent_folder, form.subject.strip(), Body())
    except (StudyError, SettingsError, OSError) as error:
        return _sentence(error)
    return ""


def _choose_protocol(form: SessionForm, new_seed: int) -> tuple[Protocol, int, Body | None, StudyPlace | None]:
    """Return protocol, seed, the subject's finger and its place, from the study if there is one, else the form."""
    study = _study(form)
    if study is None:
        return protocol(form.protocol), int(form.seed) if form.seed.strip() else new_seed, None, None
    if form.pilot:
        return study.protocol, new_seed, None, None
    return enrolled_visit(form.parent_folder, form.subject.strip())


def _study(form: SessionForm) -> Study | None:
    """Return the study that a form names; None where it names none that was made."""
    folder = form.parent_folder
    return open_study(folder) if form.study.strip() and is_study(folder) else None


def _protocol(form: SessionForm) -> Protocol:
    """Return the protocol of the study that a form names, or else its own."""
    study = _study(form)
    return protocol(form.protocol) if study is None else study.protocol


def unfinished_sessions(folder: Path) -> tuple[UnfinishedSession, ...]:
    """Return the sessions below a folder (or a study in it) that were cut short and can go on, the newest first."""
    unfinished: list[UnfinishedSession] = []
    modified: dict[Path, float] = {}
    with suppress(OSError):  # a folder that cannot be read, or that goes meanwhile
        for file in (*folder.glob("*/session.sqlite"), *folder.glob("*/*/session.sqlite")):
            modified[file] = file.stat().st_mtime
    for file in sorted(modified, key=lambda file: -modified[file]):
        if len(unfinished) == _LONGEST_LIST:
            break
        try:
            if is_sealed(file.parent) or is_in_use(file):
                continue
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
        unfinished.append(UnfinishedSession(file.parent, description))
    return tuple(unfinished)


def _local_time(stamp: object) -> str:
    """Return day and time of this computer's zone; a dash where nothing readable is recorded.

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
    """Return why no session can be kept below a folder, "" where it can."""
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
    """Return a number as it was typed, a comma for a point too; None where it is none, or may be either of two."""
    size = typed_number(_without_sign(text))
    return -size if size is not None and text.strip().startswith(("-", "−")) else size


def _without_sign(text: str) -> str:
    return text.strip().removeprefix("+").removeprefix("-").removeprefix("−")


def _doubt(text: str) -> str:
    """Return what to type in place of a number whose comma may group thousands, "" for any other."""
    meanings = two_meanings(_without_sign(text))
    return "" if meanings is None else tr(" Type {whole} or {fraction}.", whole=meanings[0], fraction=meanings[1])


def _sentence(error: Exception) -> str:
    return sentence(failure_sentence(error) if isinstance(error, OSError) else str(error))
