"""Participants, apparatus, exclusions, and all that is needed to repeat the analysis, with commands."""

import hashlib
import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import Any

from sessions.file_access import leaves
from sessions.plan.plan import Block, Origin
from sessions.prediction import SED, PredictionOptions, SessionPrediction, with_own_finger
from sessions.prediction.afferent import AfferentSettings, usual_settings
from sessions.recording.head import calibration_hash
from sessions.recording.manifest import file_sha256
from sessions.recording.reader import Recording
from sessions.recording.schema import LIVE_FILE
from sessions.report.contents import Fact, StrokeFinding, TextFile
from sessions.report.wording import correlation, direction, full_stop
from sessions.statistics.multiverse import PATHS, Values
from sessions.statistics.scores import ScoreTable, grades_of, reversed_subjects
from sessions.strokes.analysis import Analysis
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.stroke import PLANNED_AT, AreaLaw
from sessions.toml_file import toml_text


def session_commands(
    recording: Recording,
    analysis: Analysis,
    prediction: SessionPrediction | None = None,
    afferent: AfferentSettings | None = None,
    paths: Mapping[int, Values] | None = None,
    scores: Sequence[str] = (),
    response: str = SED.name,
) -> tuple[str, ...]:
    """Return the commands, for the folder of the sessions; `scores` are the names of further visits."""
    name = shlex.quote(recording.folder.name)
    settings = analysis_arguments(analysis.settings.area, analysis.settings.gain_error)
    seed = analysis.settings.bootstrap_seed
    seed_option = ["--bootstrap-seed", str(seed)] if seed else []  # later verbs read it from the results of the first
    lines = [["verify", name], ["analyse", name, *settings, *seed_option]]
    report = ["report", name, "-o", "report.html"]
    if prediction is not None:
        file = scene_file(recording, prediction)
        scene = [] if file is None else ["--scene", shlex.quote(file.name)]
        variants = ["--variants", "both"] if prediction.options.variants == "both" else []
        model, firing = model_arguments(prediction.options), _afferent_arguments(afferent)
        lines.append(["predict", name, *model, *scene, *variants, *firing, *settings])
    if paths is not None:
        small = sum(path.kinematics == "small" for path in PATHS)
        finite = any(len(values) > small for values in paths.values())
        report += ["--paths", "finite"] if finite else ["--paths"]
    if response != SED.name:
        report += ["--quantity", response]
    if scores:
        report += ["--scores", *map(shlex.quote, scores)]
    return tuple(" ".join(["daq-app", *arguments]) for arguments in (*lines, report))


def scene_file(recording: Recording, prediction: SessionPrediction | None) -> TextFile | None:
    """Return the scene file with the finger of a prediction; None where the session itself defines that finger."""
    if prediction is None or prediction.options.scene is None:
        return None
    if with_own_finger(replace(prediction.options, scene=None), recording.plan) == prediction.options:
        return None
    text = toml_text(prediction.options.scene)
    return TextFile(f"{recording.folder.name}-scene.toml", text, hashlib.sha256(text.encode()).hexdigest())


def model_arguments(options: PredictionOptions) -> list[str]:
    """Return the arguments of 'daq-app predict' for a model, without its finger.

    >>> model_arguments(PredictionOptions(kinematics="finite", indentation=1.0))
    ['--kinematics', 'finite', '--indentation', '1.0']
    """
    return [
        *(["--kinematics", options.kinematics] if options.kinematics != "small" else []),
        *(["--tau", options.tau_reading] if options.tau_reading != "computed" else []),
        *([] if options.indentation is None else ["--indentation", repr(float(options.indentation))]),
        *(["--intervals"] if options.variant_intervals else []),
    ]


def analysis_arguments(law: AreaLaw, gain_error: float | None) -> list[str]:
    """Return the arguments for a law of the contact area and a calibration error [-], which is typed in per cent.

    >>> analysis_arguments(AreaLaw("power", 0.5, 3.0), 0.003)
    ['--area', '0.5', '--area-force', '3.0', '--calibration-error', '0.3']
    """
    arguments: list[str] = []
    if law.law != "fixed":
        arguments += ["--area", "hertz" if law.law == "hertz" else repr(float(law.exponent))]
        arguments += [] if law.force == PLANNED_AT else ["--area-force", repr(float(law.force))]
    return arguments if gain_error is None else [*arguments, "--calibration-error", f"{100.0 * gain_error:.12g}"]


def _afferent_arguments(settings: AfferentSettings | None) -> list[str]:
    if settings is None:
        return []
    arguments, usual = ["--afferent"], usual_settings(settings.quantity)
    for field in fields(settings):
        value = getattr(settings, field.name)
        if field.name == "quantity":
            arguments += ["--quantity", value] if value != SED.name else []
        elif value != getattr(usual, field.name):
            is_seed = field.name == "seed"
            arguments += ["--afferent-seed", str(value)] if is_seed else ["--afferent-set", f"{field.name}={value!r}"]
    return arguments


_ORIGIN: dict[Origin, str] = {"measured": "measured", "set": "set", "default": "default: nobody set it"}


def people(recording: Recording, tables: Sequence[ScoreTable]) -> tuple[Fact, ...]:
    """Return the participants and their tasks."""
    plan = recording.plan
    subjects = sorted({table.subject for table in tables if table.scores})
    facts = [Fact("subject", plan.subject)] if plan.subject else []
    if subjects:
        sessions = sum(bool(table.scores) for table in tables)
        count_text = "in one session" if sessions == 1 else f"in {sessions} sessions"
        facts.append(Fact("subjects who scored", f"{len(subjects)}: {', '.join(subjects)}", count_text))
    if plan.blocks:
        facts.append(Fact("protocol", plan.protocol))
        facts.append(Fact("stimulus order", plan.order_rule, f"seed {plan.seed}"))
    facts += [Fact(block.name, _block(block)) for block in plan.blocks]
    lengths = {"tip radius": plan.finger.tip_radius, "width": plan.finger.width}
    facts += [Fact(f"the subject's finger: {name}", f"{mm:g} mm", "measured") for name, mm in lengths.items() if mm]
    if plan.contact_angle_origin == "measured":
        facts.append(Fact("contact angle", f"{plan.contact_angle:g}°", "measured"))
    grades = grades_of(recording.trials)
    facts += [Fact(f"pre-evaluation of {descriptor}", sentence) for descriptor, sentence in grades.items()]
    if plan.masking:
        facts.append(Fact("masking of sounds", plan.masking))
    return tuple(facts)


def _block(block: Block) -> str:
    indices = sorted({trial.stimulus.known_index for trial in block.trials})
    stimuli = f"{'Stimulus' if len(indices) == 1 else 'Stimuli'} {', '.join(map(str, indices))}"
    low, high = block.scale_ends
    ticks = f", {block.ticks} marks" if block.ticks else ""
    task = f"scale: 0 “{low}”, 100 “{high}”{ticks}" if low else f"asked: “{block.question}”"
    depth = f"; depth {block.indentation:g} mm, measured" if block.indentation_origin == "measured" else ""
    return f"{block.instruction} {stimuli}, stroked {direction(block.direction)}; {task}{depth}."


def apparatus(recording: Recording, analysis: Analysis) -> tuple[Fact, ...]:
    """Return the apparatus, its settings and the processing of its readings."""
    info, plan = recording.info, recording.plan
    if info is None:
        return (Fact("transducer", "none: a visit for scores only"),)
    rate = "unknown" if math.isnan(info.rate) else f"{info.rate:g} readings a second"
    clock: Mapping[str, Any] = recording.provenance.get("clock", {})
    area = f"{plan.contact_area:g} mm², {analysis.settings.area.sentence}"
    facts = [
        Fact("transducer", f"{info.model}, serial number {info.serial}", f"driver {info.driver}"),
        Fact("rate", rate),
        Fact("calibration", info.calibration.source, f"readings in {info.calibration.raw_unit}"),
        Fact("normal axis", f"pressing is positive along {plan.frame.normal}", _ORIGIN[plan.frame.normal_origin]),
        Fact("height of the face", f"{plan.frame.height:g} mm above the origin", _ORIGIN[plan.frame.height_origin]),
        Fact("contact area", area, _ORIGIN[plan.contact_area_origin]),
        Fact("tilt of the face", *_tilt(analysis)),
        Fact("filter", analysis.filtered),
        Fact("interval of µ", analysis.bootstrap.kind),
    ]
    factor = clock.get("factor", 1.0)
    if factor != 1.0:
        speed_text = f"{factor:g} times as fast as the wall clock" if factor else "which moves when it is waited on"
        facts.append(Fact("clock", f"simulated time, {speed_text}"))
    return tuple(fact for fact in facts if fact.value)


def _tilt(analysis: Analysis) -> tuple[str, str]:
    """Return the tilt of the face, "" where unknown, and whether it was levelled."""
    tilt, x_y = analysis.tilt, analysis.settings.tilt
    levelling = "not levelled" if x_y == (0.0, 0.0) else f"levelled by {_angle(x_y[0])}° and {_angle(x_y[1])}°"
    if tilt is None:
        return ("" if x_y == (0.0, 0.0) else f"{_angle(x_y[0])}° to +x and {_angle(x_y[1])}° to +y"), levelling
    (low_x, high_x), (low_y, high_y) = tilt.x_interval, tilt.y_interval
    along = f"{_angle(tilt.lean[0])}° ({_angle(low_x)} to {_angle(high_x)}) to +x"
    across = f"{_angle(tilt.lean[1])}° ({_angle(low_y)} to {_angle(high_y)}) to +y"
    return f"{along}, {across}", f"{tilt.kind}; {levelling}"


def _angle(degrees: float) -> str:
    return f"{degrees:.2g}".replace("-", "−")


def exclusion_sentences(recording: Recording, analysis: Analysis, strokes: Sequence[StrokeFinding]) -> tuple[str, ...]:
    """Return a sentence for each exclusion from the results, with its author and reason."""
    sentences = [full_stop(f"By {decision.sentence}") for decision in analysis.decisions if decision.leaves_out]
    for record in recording.trials:
        number = record.trial.number
        for take in record.other_takes:
            reason = take.discard_reason
            cause = "the recording ended in it" if reason is None else f"discarded: {reason}"
            sentences.append(f"Take {take.number} of trial {number} does not count ({cause}); its readings are kept.")
        sentences += [f"Trial {number} was skipped."] if record.outcome == "skipped" else []
    for name, quantity in (("mu_dynamic", "dynamic friction"), ("speed", "speed")):
        without = [str(stroke.number) for stroke in strokes if getattr(stroke, name) is None]
        if without:
            stroke_names = f"stroke{'s' if len(without) > 1 else ''} {', '.join(without)}"
            sentences.append(f"No {quantity} is given for {stroke_names}: the flaws below and the tables say why.")
    return tuple(sentences)


def remarks(recording: Recording, analysis: Analysis, tables: Sequence[ScoreTable]) -> tuple[str, ...]:
    """Return sentences on missing data, decisions on what counts, and doubts."""
    sentences = [f"Lost: {loss}." for loss in recording.losses]
    sentences += [full_stop(f"By {decision.sentence}") for decision in analysis.decisions if not decision.leaves_out]
    sentences += [table.other_answers for table in tables if table.other_answers]
    for record in recording.trials:
        number = record.trial.number
        if record.outcome == "not answered":
            answer_noun = "score" if record.trial.answer == "line" else "answer"
            sentences.append(f"Trial {number} has no {answer_noun}: the subject did not answer.")
        elif record.outcome == "open":
            sentences.append(f"Trial {number} was not done: the session ended before.")
    sentences += [
        f"The {descriptor} scores of {subject} fall as the index rises (r = {correlation(r)}): the scale may have been "
        "used backwards, or they may follow no order; they are kept as given."
        for subject, descriptor, r in reversed_subjects(tables)
    ]
    return tuple(sentences)


def reproduction_facts(recording: Recording, analysis: Analysis) -> tuple[Fact, ...]:
    """Return everything that influenced the numbers; defaults are marked."""
    provenance, info = recording.provenance, recording.info
    facts = [
        Fact("session folder", recording.folder.name),
        Fact("recording", f"SHA-256 {file_sha256(recording.folder / LIVE_FILE)}", LIVE_FILE),
        Fact("recorded", str(provenance.get("created_utc", "at an unknown time")), "UTC"),
        Fact("recorded by", ", ".join(f"{name} {version}" for name, version in provenance.get("software", {}).items())),
        Fact("machine", ", ".join(f"{name} {value}" for name, value in provenance.get("machine", {}).items())),
    ]
    if recording.plan.blocks:
        plan = f"{recording.plan.protocol}, seed {recording.plan.seed}"
        facts.append(Fact("plan", plan, "all of it in session.json"))
    if info is not None:
        facts.append(Fact("transducer's address", info.uri))
        facts.append(Fact("calibration matrix", f"SHA-256 {calibration_hash(info.calibration)}"))
        facts += [Fact(f"transducer: {name}", value) for name, value in sorted(info.settings.items())]
    settings: Mapping[str, Mapping[str, Any]] = provenance.get("settings", {})
    facts += [
        Fact(name, f"{entry.get('value')} {entry.get('unit', '')}".strip(), _ORIGIN.get(entry.get("origin", "set"), ""))
        for name, entry in settings.items()
    ]
    if info is not None:
        usual = dict(leaves(asdict(AnalysisSettings())))
        analysis_settings = (
            f"{name} {f'{value:g}' if isinstance(value, float) else value}{'' if value == usual[name] else ' (set)'}"
            for name, value in leaves(asdict(analysis.settings))
        )
        facts.append(Fact("analysis", "; ".join(analysis_settings)))
    return tuple(fact for fact in facts if fact.value)
