"""How good the last stroke was, said while the stimulus is still mounted: the analysis of its take, in few words."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq_app.wording import tr, tr_noop
from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan, Trial
from sessions.strokes import AnalysisSettings, FlawName, FrictionParameters
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.stroke import Stroke

KEEP_OFF = tr_noop("Keep the finger off until the stroke.")
FELL = 0.5  # a normal force that falls by this share along the steady window is worth a word [-]

# Few words for what an experimenter can do something about, and what to do, as a command to whoever runs the session.
# The other flaws show their own sentence. Where there is no command, the advice is another stroke.
FLAWS: Mapping[FlawName, tuple[str, str]] = {
    FlawName.NO_STROKE: tr_noop(("no stroke was found", "Stroke once, firmly, and lift.")),
    FlawName.NO_STEADY_SLIDING: tr_noop(("no steady window", "Slide further, at one speed.")),
    FlawName.ROLLED: tr_noop(("too short a way: the finger may only roll", "Slide further, not roll.")),
    FlawName.SECOND_STROKE: tr_noop(("second stroke", "Stroke once, then lift.")),
    FlawName.WRONG_DIRECTION: tr_noop(("wrong direction", "Stroke the way the arrow points.")),
    FlawName.TOO_LITTLE_FORCE: tr_noop(("pressed too lightly", "Press harder.")),
    FlawName.NO_UNLOADED_STRETCH: (tr_noop("no unloaded stretch before the stroke"), KEEP_OFF),
    FlawName.BEGINS_IN_CONTACT: (tr_noop("the finger touched before the stroke"), KEEP_OFF),
    FlawName.ENDS_IN_CONTACT: tr_noop(("the finger had not left", "Lift the finger at the end.")),
    FlawName.NOT_LIFTED: tr_noop(("the finger was not lifted between strokes", "Lift the finger between strokes.")),
    FlawName.DIRECTION_TURNS: tr_noop(("the direction turned", "Stroke straight, one way.")),
    FlawName.SATURATED: tr_noop(("the transducer was overloaded", "Press less, and check the transducer.")),
    FlawName.DEVICE_FAULT: tr_noop(("the transducer reported a fault", "Check the transducer first.")),
    FlawName.LOST_READINGS: (tr_noop("readings were lost"), ""),
    FlawName.DRIFT: tr_noop(("the zero drifted", "Zero again, hands off.")),
    FlawName.FROZEN: tr_noop(("the transducer stood still", "Connect the transducer again first.")),
    FlawName.DEAD: tr_noop(("the transducer is dead", "Connect the transducer again first.")),
}
LEAVING = tr_noop("pressed less than half as hard at the end")
PRESS_ON = tr_noop("Keep pressing until the end.")
PICTURE = ("N", "T", "mu", "speed")  # rows of a stroke's picture


@dataclass(frozen=True, slots=True, eq=False)
class StrokePicture:
    """The course of a stroke with some time around it, n readings, as it is shown when its trial is inspected."""

    time: NDArray[np.float64]  # (n,) [s, device time]
    values: NDArray[np.float64]  # (4, n) rows of PICTURE: N, T [N], mu [-], speed [mm/s]; nan where it means nothing
    onset: float | None  # [s, device time]
    lift: float | None
    means: tuple[float | None, ...]  # of the rows of PICTURE over the steady window


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
    advice: str = ""  # what to do about the worst, one sentence
    picture: StrokePicture | None = None
    redo: bool = False  # another stroke mends the worst


def stroke_quality(
    block: ReadingBlock, plan: SessionPlan, info: TransducerInfo, trial: Trial, settings: AnalysisSettings | None = None
) -> Quality:
    """Return the quality of the stroke in the readings of one take, judged as the analysis of a recording judges it."""
    analysis = analyse_blocks([(trial, block)], plan, info, settings or AnalysisSettings())
    stroke = analysis.strokes[0] if analysis.strokes else None
    flaws = sorted(analysis.flaws, key=lambda flaw: ("refused", "doubtful", "note").index(flaw.grade))
    mentioned = [flaw for flaw in flaws if flaw.grade != "note" or flaw.name in FLAWS]
    remarks: list[tuple[str, str, str, str]] = []  # grade, few words, at length, and what to do
    for flaw in mentioned:
        short, advice = FLAWS.get(flaw.name, (flaw.name.value.replace("_", " "), ""))
        remarks.append((flaw.grade, short, flaw.sentence, advice))
    fell = None if stroke is None else _fell(stroke)
    if fell is not None and fell >= FELL:
        share = 100 * (1 - fell)
        at_length = tr("The normal force ended at {share:.0f} % of what it was: the finger was leaving.", share=share)
        refusals = sum(grade == "refused" for grade, *_ in remarks)
        remarks.insert(refusals, ("doubtful", LEAVING, at_length, PRESS_ON))
    words = list(dict.fromkeys(short for _, short, _, _ in remarks))
    sentences = [at_length for _, _, at_length, _ in remarks]
    advice = remarks[0][3] if remarks else ""
    grades = {flaw.grade for flaw in mentioned}
    grade = "refused" if "refused" in grades else "doubtful" if words else "good"
    if stroke is None:
        known = tuple(words) or FLAWS[FlawName.NO_STROKE][:1]
        advice = advice or FLAWS[FlawName.NO_STROKE][1]
        return Quality("refused", known, tuple(sentences), None, None, None, None, None, advice=advice, redo=True)
    mends = bool(advice) and remarks[0][0] != "note"
    return Quality(
        grade, tuple(words), tuple(sentences), stroke.steady, stroke.mu_dynamic, stroke.mu_dynamic_interval,
        stroke.speed, fell, analysis.friction[0], stroke.normal_force, advice, _picture(stroke), mends,
    )  # fmt: skip


def in_newtons(info: TransducerInfo) -> TransducerInfo:
    """Return the transducer as if it gave its wrench: for readings that were already made newtons."""
    known = info.calibration
    as_wrench = Calibration(known.serial, "N, N mm", np.eye(6), known.rated, known.source)
    return replace(info, calibration=as_wrench)


def _picture(stroke: Stroke) -> StrokePicture | None:
    """Return what is shown of a stroke later; None where nothing of its course is known."""
    curve = stroke.curve
    if curve is None:
        return None
    values = np.vstack([curve.normal, curve.tangential, curve.ratio, curve.speed])
    means = (stroke.normal_force, stroke.tangential_force, stroke.mu_dynamic, stroke.speed)
    return StrokePicture(curve.time, values, stroke.onset, stroke.lift, means)


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
