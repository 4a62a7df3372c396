"""The trials of a session as a strip of tiles, and what is shown of the one that somebody inspects. No Qt."""

from dataclasses import dataclass
from typing import Literal

from daq_app.window.course_state import SessionState, TrialState
from daq_app.window.stroke_quality import PICTURE, Quality, StrokePicture
from daq_app.wording import tr, tr_noop

TileKind = Literal["done", "redone", "flawed", "current", "skipped", "coming"]
KINDS: dict[TileKind, tuple[str, str]] = {  # a shape that shows the state without colour, and the state in words
    "done": ("✓", tr_noop("done")),
    "redone": ("↻", tr_noop("done again")),
    "flawed": ("!", tr_noop("done, its stroke has a flaw")),
    "current": ("▶", tr_noop("in hand")),
    "skipped": ("–", tr_noop("skipped")),
    "coming": ("○", tr_noop("still to come")),
}
DIGITS_AND_UNITS = {"N": (2, "N"), "T": (2, "N"), "mu": (2, ""), "speed": (0, "mm/s")}  # of the rows of PICTURE


@dataclass(frozen=True, slots=True)
class Tile:
    """One trial: its shape and words tell its state without colour."""

    number: int
    code: str
    kind: TileKind

    @property
    def words(self) -> str:
        """Return the trial and its state for a screen reader.

        >>> Tile(3, "D86", "flawed").words
        'trial 3, D86: done, its stroke has a flaw'
        """
        return tr("trial {number}, {code}: {state}", number=self.number, code=self.code, state=tr(KINDS[self.kind][1]))


@dataclass(frozen=True, slots=True)
class Inspection:
    """What is shown of one trial: never what is measured now."""

    number: int
    heading: str
    verdict: str  # one line; or why there is none
    grade: Literal["none", "good", "doubtful", "refused"]
    details: str  # every flaw at length, the worst first
    cells: tuple[tuple[str, str], ...]  # row of PICTURE and its mean over the steady window with its unit; "–": none
    picture: StrokePicture | None
    steady: tuple[float, float] | None  # [s, device time]


def tiles(session: SessionState) -> tuple[Tile, ...]:
    """Return a tile for each trial, in the order of the plan."""
    return tuple(Tile(t.trial.number, t.code, _kind(session, t)) for t in session.trials)


def inspection(session: SessionState, number: int) -> Inspection | None:
    """Return what is shown of a trial; None where the session has no trial of that number."""
    trial = session.of(number)
    if trial is None:
        return None
    again = tr(", take {takes}", takes=trial.takes) if trial.takes > 1 else ""
    state = tr(KINDS[_kind(session, trial)][1])
    heading = tr("Trial {number}, {code}{again}: {state}", number=number, code=trial.code, again=again, state=state)
    shown = session.plan.shown.experimenter
    if trial.answer is not None and "answer" in shown:
        heading = f"{heading}, {trial.answer}"
    details = tr("Its take before was discarded: {why}.", why=trial.discarded.rstrip(".")) if trial.discarded else ""
    quality = trial.quality
    if "forces" not in shown:
        return _without(number, heading, tr("Forces are not shown in this protocol."), details)
    if quality is None:
        return _without(number, heading, _why_none(session, trial), details)
    picture = quality.picture
    means = (None,) * len(PICTURE) if picture is None else picture.means
    cells = tuple((name, _value(name, mean)) for name, mean in zip(PICTURE, means, strict=True))
    at_length = " ".join((*quality.sentences, details)).strip()
    return Inspection(number, heading, verdict(quality), quality.grade, at_length, cells, picture, quality.steady)


def verdict(quality: Quality) -> str:
    """Return one verdict on a stroke: whether it is to be done again, the worst flaw, then what to do.

    >>> verdict(Quality("refused", ("pressed too lightly",), (), None, None, None, None, None, advice="Press harder."))
    'Redo: pressed too lightly. Press harder.'
    """
    if not quality.words:
        return tr("Good")
    opening = tr("Redo") if quality.grade == "refused" or quality.redo else tr("Doubtful")
    return f"{opening}: {tr(quality.words[0]).rstrip('.')}. {tr(quality.advice)}".strip()


def _kind(session: SessionState, trial: TrialState) -> TileKind:
    if trial.trial.number == session.trial and session.phase != "ended":
        return "current"
    if trial.outcome != "done":
        return trial.outcome
    if trial.quality is not None and trial.quality.words:
        return "flawed"
    return "redone" if trial.takes > 1 else "done"


def _why_none(session: SessionState, trial: TrialState) -> str:
    if not session.plan.forces:
        return tr("No forces are recorded in this session.")
    if trial.outcome == "coming":
        return tr("Its stroke is still to come.")
    if trial.outcome == "skipped":
        return tr("It was left out: no stroke of it counts.")
    return tr("Its stroke was recorded, and this window has not looked at it: Review shows it after the session.")


def _without(number: int, heading: str, why: str, details: str) -> Inspection:
    return Inspection(number, heading, why, "none", details, tuple((name, "–") for name in PICTURE), None, None)


def _value(name: str, mean: float | None) -> str:
    if mean is None:
        return "–"
    digits, unit = DIGITS_AND_UNITS[name]
    return f"{round(mean, digits) + 0.0:.{digits}f} {unit}".strip().replace("-", "−")
