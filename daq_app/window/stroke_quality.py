"""How good the last stroke was, said while the stimulus is still mounted: the analysis of its take, in few words."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan, Trial
from sessions.strokes import AnalysisSettings, FlawName, FrictionParameters
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.flaws import Flaw
from sessions.strokes.stroke import Stroke

FELL = 0.5  # a normal force that falls by this share along the steady window is worth a word [-]

# Few words for what an experimenter can do something about; the others are told by their own sentence.
WORDS = {
    FlawName.NO_STROKE: "no stroke was found",
    FlawName.NO_STEADY_SLIDING: "no steady window",
    FlawName.ROLLED: "too short a way: the finger may only roll",
    FlawName.SECOND_STROKE: "second stroke",
    FlawName.WRONG_DIRECTION: "wrong direction",
    FlawName.TOO_LITTLE_FORCE: "pressed too lightly",
    FlawName.NO_UNLOADED_STRETCH: "no unloaded stretch before the stroke",
    FlawName.BEGINS_IN_CONTACT: "the finger touched before the stroke",
    FlawName.ENDS_IN_CONTACT: "the finger had not left",
    FlawName.NOT_LIFTED: "the finger was not lifted between strokes",
    FlawName.DIRECTION_TURNS: "the direction turned",
    FlawName.SATURATED: "the transducer was overloaded",
    FlawName.DEVICE_FAULT: "the transducer told of a fault",
    FlawName.LOST_READINGS: "readings were lost",
    FlawName.DRIFT: "the zero drifted",
    FlawName.FROZEN: "the transducer stood still",
    FlawName.DEAD: "the transducer is dead",
}


@dataclass(frozen=True, slots=True)
class Quality:
    """What is known of a stroke before it is scored. Provisional: the analysis of the recording is what counts."""

    grade: Literal["good", "doubtful", "refused"]
    words: tuple[str, ...]  # what is wrong, the worst first; none for a good stroke
    sentences: tuple[str, ...]  # the same at length
    steady: tuple[float, float] | None  # [s, device time]
    mu: float | None  # mean of T/N over the steady window [-]
    interval: tuple[float, float] | None
    speed: float | None  # [mm/s]
    fell: float | None  # by what share N fell from the first to the last quarter of the steady window [-]
    friction: FrictionParameters | None = None  # that the model is to get
    normal_force: float | None = None  # mean over the steady window [N]


def stroke_quality(
    block: ReadingBlock,
    plan: SessionPlan,
    info: TransducerInfo,
    trial: Trial,
    settings: AnalysisSettings | None = None,
) -> Quality:
    """Return the quality of the stroke in the readings of one take, judged as the analysis of a recording judges it."""
    analysis = analyse_blocks([(trial, block)], plan, info, settings or AnalysisSettings())
    stroke = analysis.strokes[0] if analysis.strokes else None
    flaws = sorted(analysis.flaws, key=lambda flaw: ("refused", "doubtful", "note").index(flaw.grade))
    told = [flaw for flaw in flaws if flaw.grade != "note" or flaw.name in WORDS]
    words = list(dict.fromkeys(_words(flaw) for flaw in told))
    sentences = [flaw.sentence for flaw in told]
    fell = None if stroke is None else _fell(stroke)
    if fell is not None and fell >= FELL:
        words.append("normal force fell by half")
        sentences.append(f"The normal force ended at {100 * (1 - fell):.0f} % of what it was: the finger was leaving.")
    grades = {flaw.grade for flaw in told}
    grade = "refused" if "refused" in grades else "doubtful" if words else "good"
    if stroke is None:
        return Quality(
            "refused", tuple(words) or ("no stroke was found",), tuple(sentences), None, None, None, None, None
        )
    return Quality(
        grade,
        tuple(words),
        tuple(sentences),
        stroke.steady,
        stroke.mu_dynamic,
        stroke.mu_dynamic_interval,
        stroke.speed,
        fell,
        analysis.friction[0],
        stroke.normal_force,
    )


def in_newtons(info: TransducerInfo) -> TransducerInfo:
    """Return the transducer as if it gave its wrench: for readings that were already made newtons."""
    known = info.calibration
    as_wrench = Calibration(known.serial, "N, N mm", np.eye(6), known.rated, known.source)
    return replace(info, calibration=as_wrench)


def _words(flaw: Flaw) -> str:
    return WORDS.get(flaw.name, flaw.name.value.replace("_", " "))


def _fell(stroke: Stroke) -> float | None:
    """Return by what share N fell from the first to the last quarter of the steady window; None without one."""
    if stroke.steady is None or stroke.curve is None:
        return None
    inside = (stroke.curve.time >= stroke.steady[0]) & (stroke.curve.time <= stroke.steady[1])
    normal = stroke.curve.normal[inside]
    normal = normal[np.isfinite(normal)]
    if not len(normal):
        return None
    quarter = max(len(normal) // 4, 1)
    return float(1.0 - np.median(normal[-quarter:]) / np.median(normal[:quarter]))
