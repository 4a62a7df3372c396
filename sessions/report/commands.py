"""What to type to get the numbers of a page again: every option that is not the usual one."""

import hashlib
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

from sessions.prediction import SED, PredictionOptions, SessionPrediction, with_own_finger
from sessions.prediction.afferent import AfferentSettings, usual_settings
from sessions.recording.reader import Recording
from sessions.report.contents import TextFile
from sessions.statistics.multiverse import PATHS, Values
from sessions.strokes.analysis import Analysis
from sessions.strokes.contact_area import PLANNED_AT, AreaLaw
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
    """Return the commands, to be typed where the session folders lie; `scores` are the names of further visits."""
    name = shlex.quote(recording.folder.name)
    settings = (*area_words(analysis.settings.area), *calibration_words(analysis.settings.gain_error))
    seed = analysis.settings.bootstrap_seed
    seeded = ["--bootstrap-seed", str(seed)] if seed else []  # the later verbs take it from what the first has kept
    lines = [["verify", name], ["analyse", name, *settings, *seeded]]
    report = ["report", name, "-o", "report.html"]
    if prediction is not None:
        file = scene_file(recording, prediction)
        scene = [] if file is None else ["--scene", shlex.quote(file.name)]
        variants = prediction.options.variants
        sided = ["--variants", "both"] if variants == "both" else []
        words = [*model_words(prediction.options), *scene, *sided, *_afferent_words(afferent), *settings]
        lines.append(["predict", name, *words])
    if paths is not None:
        small = sum(path.kinematics == "small" for path in PATHS)
        finite = any(len(values) > small for values in paths.values())
        report += ["--paths", "finite"] if finite else ["--paths"]
    if response != SED.name:
        report += ["--quantity", response]
    if scores:
        report += ["--scores", *map(shlex.quote, scores)]
    return tuple(" ".join(["daq-app", *words]) for words in (*lines, report))


def scene_file(recording: Recording, prediction: SessionPrediction | None) -> TextFile | None:
    """Return the scene file that gives the finger of a prediction; None where that is what the session itself gives."""
    if prediction is None or prediction.options.scene is None:
        return None
    if with_own_finger(replace(prediction.options, scene=None), recording.plan) == prediction.options:
        return None
    text = toml_text(prediction.options.scene)
    return TextFile(f"{recording.folder.name}-scene.toml", text, hashlib.sha256(text.encode()).hexdigest())


def model_words(options: PredictionOptions) -> list[str]:
    """Return what asks 'daq-app predict' for a model, but for its finger.

    >>> model_words(PredictionOptions(kinematics="finite", indentation=1.0))
    ['--kinematics', 'finite', '--indentation', '1.0']
    """
    return [
        *(["--kinematics", options.kinematics] if options.kinematics != "small" else []),
        *(["--tau", options.tau_reading] if options.tau_reading != "computed" else []),
        *([] if options.indentation is None else ["--indentation", repr(float(options.indentation))]),
        *(["--intervals"] if options.variant_intervals else []),
    ]


def area_words(law: AreaLaw) -> list[str]:
    """Return what asks for a law of the contact area.

    >>> area_words(AreaLaw("power", 0.5, 3.0))
    ['--area', '0.5', '--area-force', '3.0']
    """
    if law.law == "fixed":
        return []
    force = [] if law.force == PLANNED_AT else ["--area-force", repr(float(law.force))]
    return ["--area", "hertz" if law.law == "hertz" else repr(float(law.exponent)), *force]


def calibration_words(gain_error: float | None) -> list[str]:
    """Return what asks for a calibration error, in per cent as the option takes it.

    >>> calibration_words(0.003)
    ['--calibration-error', '0.3']
    """
    return [] if gain_error is None else ["--calibration-error", f"{100.0 * gain_error:.12g}"]


def _afferent_words(settings: AfferentSettings | None) -> list[str]:
    if settings is None:
        return []
    words, usual = ["--afferent"], usual_settings(settings.quantity)
    for field in fields(settings):
        value = getattr(settings, field.name)
        if field.name == "quantity":
            words += ["--quantity", value] if value != SED.name else []
        elif value != getattr(usual, field.name):
            seed = field.name == "seed"
            words += ["--afferent-seed", str(value)] if seed else ["--afferent-set", f"{field.name}={value!r}"]
    return words
