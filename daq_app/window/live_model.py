"""The live model's messages: measured forces in, the SED and a picture out, and their texts. No solver."""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from daq_app.recorder.messages import Live
from daq_app.window.live_trace import LiveTrace
from daq_app.wording import errors_text, tr, tr_noop
from drivers.arrays import Array, Indices, Mask
from sessions.plan.plan import Frame, SessionPlan
from sessions.strokes import FrictionParameters
from sessions.strokes.forces import in_face_frame
from sessions.strokes.stroke import digits

Kinematics = Literal["small", "finite"]

_STEP = 0.005  # readings within this time are one step of the model [s]: 200 a second
_GAP = 0.1  # predictions further apart have a gap between them [s]
MODEL_CHANNELS = ("SED", "SED instead")  # the latter at small strain, where finite strain is requested but out of reach
_KINEMATICS = {"small": tr_noop("small strain"), "finite": tr_noop("finite strain")}


@dataclass(frozen=True, slots=True)
class Use:
    """Follow the finger of this plan from now on, or without a plan the published finger."""

    plan: SessionPlan | None
    kinematics: Kinematics


@dataclass(frozen=True, slots=True)
class Ready:
    """The finger is ready; otherwise `problem` says why not."""

    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """n measured forces, at most 200 a second."""

    time: Array  # (n,) [s, device time]
    normal: Array  # (n,) [N], positive when pressing
    pull: Array  # (n,) tangential force of the surface on the finger along +x [N]
    received_ns: int  # when the newest reached the computer [ns, session clock]
    stream: int  # increases when time restarts


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A finger's drawing data; the surface is y = 0."""

    nodes: Array  # (n, 2) [mm]
    faces: Indices  # (f, 3 or 4); empty if only the outline is known
    sed: Array  # (f,) [MPa]
    outline: Array  # (w, 2) deformed skin [mm]
    lost: tuple[float, float] | None = None  # most compressed point [mm] of a state without a continuation


@dataclass(frozen=True, slots=True, eq=False)
class Provisional:
    """The provisional prediction for one batch of forces."""

    time: Array  # (n,) [s, device time]
    sed: Array  # (n,) at the receptor [MPa]; 0 without contact, nan beyond the model's reach
    row: Array  # (r,) along the skin at the receptor's depth, at `solver.prediction.ROW` [MPa]
    picture: Picture
    depth: float  # of the bone, below first contact [mm]
    mu: float  # used so far [-]
    kinematics: Kinematics  # the requested one
    instead: Mask  # (n,) True for values at small strain, where forces are too large for finite strain
    received_ns: int
    stream: int

    @property
    def beyond(self) -> bool:
        """Say whether the newest forces are beyond the model's reach."""
        return bool(np.isnan(self.sed[-1]))


@dataclass(frozen=True, slots=True, eq=False)
class Settle:
    """Request for the full solve of a stroke, which replaces the provisional values."""

    plan: SessionPlan
    friction: FrictionParameters
    normal_force: float  # mean over the steady window [N]
    steady: tuple[float, float]  # window of the stroke, over which the provisional value is averaged [s, device time]


@dataclass(frozen=True, slots=True, eq=False)
class SettledSolve:
    """The full solve of a stroke, with the mean of its live values."""

    steady: tuple[float, float]  # of the stroke [s, device time]
    sed: float | None  # [MPa]; None for the `reason` given
    error: float | None  # its estimated relative error [-]
    provisional: float | None  # mean live value over the steady window [MPa]; None if there was none
    row: Array  # (r,) [MPa]
    picture: Picture | None  # of the full solve; if it failed, of the last followed state
    depth: float | None  # [mm]
    kinematics: Kinematics
    reason: str = ""
    effect: str = ""  # the largest omitted effect; empty without an estimate

    @property
    def difference(self) -> float | None:
        """Return the excess of the provisional value, relative to the full solve [-]; None if either is missing.

        >>> SettledSolve((1.2, 2.0), 0.004, 0.01, 0.005, np.empty(0), None, 2.0, "small").difference
        0.25
        """
        if not self.sed or self.provisional is None:
            return None
        return float(f"{self.provisional / self.sed - 1.0:.6g}")


def forces_of(live: Live, frame: Frame) -> Forces | None:
    """Return the forces of a message, means of the sound readings in each step; None if there are none."""
    healthy = live.status == 0
    if not healthy.any():
        return None
    wrench = in_face_frame(live.wrench[healthy], frame)
    time = live.time[healthy]
    rows = np.column_stack([time, wrench[:, :3]])
    starts = np.flatnonzero(np.diff(np.floor(time / _STEP), prepend=-np.inf) > 0)
    mean = np.add.reduceat(rows, starts, axis=0) / np.diff(starts, append=len(rows))[:, None]
    tangential = np.hypot(mean[:, 1], mean[:, 2])
    # The finger pushes the stimulus along Fx; the stimulus pulls it back.
    pull = -np.copysign(tangential, mean[:, 1])
    return Forces(mean[:, 0], -mean[:, 3], pull, int(live.received_ns[-1]), live.stream)


def join_forces(batches: list[Forces]) -> Forces:
    """Join several batches of one stream."""
    names = ("time", "normal", "pull")
    arrays: dict[str, Any] = {name: np.concatenate([getattr(batch, name) for batch in batches]) for name in names}
    return replace(batches[-1], **arrays)


@dataclass(frozen=True, slots=True)
class ModelText:
    """A line over the picture."""

    text: str
    state: Literal["none", "provisional", "instead", "beyond", "failed", "settled"]


def model_text(
    provisional: Provisional | None, settled: SettledSolve | None, problem: str, *, silent: bool = False
) -> ModelText:
    """Return the text about the displayed picture; a `silent` transducer measures nothing now."""
    if problem:
        return ModelText(tr("No live model: {problem}.", problem=problem), "none")
    if settled is not None:
        return ModelText(_settled_text(settled), "failed" if settled.sed is None else "settled")
    if silent:
        return ModelText(tr("Nothing is measured that the model could follow."), "none")
    if provisional is None:
        return ModelText(tr("The live model is starting."), "none")
    if provisional.beyond:
        return ModelText(tr("These forces are beyond the reach of the model."), "beyond")
    if provisional.sed[-1] <= 0.0:
        text = tr("Model at {kinematics}: nothing touches.", kinematics=tr(_KINEMATICS[provisional.kinematics]))
        return ModelText(text, "none")
    start = tr(
        "PROVISIONAL  SED {kpa}{errors} · at the measured force, {depth:.1f} mm deep · ",
        kpa=_kpa(float(provisional.sed[-1])), errors=errors_text(None), depth=provisional.depth,
    )  # fmt: skip
    if provisional.instead[-1]:
        text = tr("{known}small strain: these forces are beyond the reach of finite strain", known=start)
        return ModelText(text, "instead")
    return ModelText(start + tr(_KINEMATICS[provisional.kinematics]), "provisional")


def _settled_text(settled: SettledSolve) -> str:
    live = "" if settled.provisional is None else tr(" · shown live {kpa}", kpa=_kpa(settled.provisional))
    strain, picture, depth = tr(_KINEMATICS[settled.kinematics]), settled.picture, settled.depth
    if settled.sed is None:
        lost = picture is not None and picture.lost is not None
        note = tr("; ⊗ marks its most squeezed tissue") if lost else ""
        last = tr_noop(" Shown is the last state that was followed, {depth:.1f} mm deep{marked}.")
        last_state = "" if depth is None else tr(last, depth=depth, marked=note)
        form = tr_noop("No full solve at {how}{shown}. {reason}{kept}")
        return tr(form, how=strain, shown=live, reason=settled.reason, kept=last_state)
    if (difference := settled.difference) is not None:
        live += f" ({digits(100 * difference, 1, '+')} %)"
    return tr(
        "Full solve  SED {kpa}{errors} · at the measured force, {how}{shown}",
        kpa=_kpa(settled.sed), errors=errors_text(settled.error, settled.effect), how=strain, shown=live,
    )  # fmt: skip


def _kpa(sed: float) -> str:
    return f"{1000 * sed:.2f} kPa"


class ModelTrace(LiveTrace):
    """The SED at the receptor over the last minute [kPa], for a plot."""

    def __init__(self) -> None:
        super().__init__(1.0 / _STEP, channels=len(MODEL_CHANNELS), gap=_GAP)
        self._stream: int | None = None

    def add_prediction(self, latest: Provisional) -> None:
        """Add a prediction to the trace."""
        if latest.stream != self._stream:
            self._stream = latest.stream
            self.clear()
        sed = 1000.0 * latest.sed
        self.add(latest.time, np.stack([np.where(latest.instead, np.nan, sed), np.where(latest.instead, sed, np.nan)]))
