"""The live model: its messages and their texts, its own process, and its client in the window, where nothing waits."""

import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from daq_app.child_process import Child, give_way
from daq_app.recorder.messages import Live
from daq_app.window.live_trace import LiveTrace
from daq_app.wording import errors_text, tr, tr_noop
from drivers.arrays import Array, Indices, Mask
from sessions.plan.plan import Frame, SessionPlan
from sessions.strokes import FrictionParameters
from sessions.strokes.forces import in_face_frame

Connection = Any  # one end of a pipe; its type is another one on each system
Kinematics = Literal["small", "finite"]

_STEP = 0.005  # readings within this time are one step of the model [s]: 200 a second
_OLDEST = 2.0  # forces older than this are dropped, where the model does not keep up [s]
_GAP = 0.1  # predictions further apart have a gap between them [s]
MODEL_CHANNELS = ("SED", "SED instead")  # the latter at small strain, where finite strain is asked for and out of reach
_KINEMATICS = {"small": tr_noop("small strain"), "finite": tr_noop("finite strain")}


@dataclass(frozen=True, slots=True)
class Use:
    """Follow the finger of this plan from now on; without one, the published finger."""

    plan: SessionPlan | None
    kinematics: Kinematics


@dataclass(frozen=True, slots=True)
class Ready:
    """The finger is made; `problem` says why there is none."""

    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """Measured forces, n of them, at most 200 a second."""

    time: Array  # (n,) [s, device time]
    normal: Array  # (n,) [N], positive when pressing
    pull: Array  # (n,) of the surface on the finger along +x [N]
    received_ns: int  # when the newest reached the computer [ns, session clock]
    stream: int  # grows where time restarts


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A finger as it is drawn: the surface is y = 0."""

    nodes: Array  # (n, 2) [mm]
    faces: Indices  # (f, 3 or 4); none where only the outline is known
    sed: Array  # (f,) [MPa]
    outline: Array  # (w, 2) deformed skin [mm]
    lost: tuple[float, float] | None = None  # where tissue is squeezed most [mm], of a state that led nowhere


@dataclass(frozen=True, slots=True, eq=False)
class Provisional:
    """What the model says now, of one batch of forces."""

    time: Array  # (n,) [s, device time]
    sed: Array  # (n,) at the receptor [MPa]; 0 where nothing touches, nan beyond the model's reach
    row: Array  # (r,) along the skin at the receptor's depth, at `solver.prediction.ROW` [MPa]
    picture: Picture
    depth: float  # of the bone, below first touch [mm]
    mu: float  # taken so far [-]
    kinematics: Kinematics  # that is asked for
    instead: Mask  # (n,) where small strain tells, the forces being beyond the reach of finite strain
    received_ns: int
    stream: int

    @property
    def beyond(self) -> bool:
        """Say whether the newest forces are beyond the model's reach."""
        return bool(np.isnan(self.sed[-1]))


@dataclass(frozen=True, slots=True, eq=False)
class Settle:
    """Asks for the full solve of a stroke, to replace what was provisional."""

    plan: SessionPlan
    friction: FrictionParameters
    normal_force: float  # mean over the steady window [N]
    steady: tuple[float, float]  # window of the stroke, over which the provisional value is averaged [s, device time]


@dataclass(frozen=True, slots=True, eq=False)
class SettledSolve:
    """The full solve of a stroke, with the mean of what was shown live."""

    steady: tuple[float, float]  # of the stroke [s, device time]
    sed: float | None  # [MPa]; None where `reason` says why
    error: float | None  # its estimated relative error [-]
    provisional: float | None  # mean over the steady window of what was shown [MPa]; None where nothing was
    row: Array  # (r,) [MPa]
    picture: Picture | None  # of the full solve; where it failed, of the last state that was followed
    depth: float | None  # [mm]
    kinematics: Kinematics
    reason: str = ""
    effect: str = ""  # of what the model leaves out, the greatest; empty without an estimate

    @property
    def difference(self) -> float | None:
        """Return by which part of the full solve the provisional value is larger [-]; None where one is missing.

        >>> SettledSolve((1.2, 2.0), 0.004, 0.01, 0.005, np.empty(0), None, 2.0, "small").difference
        0.25
        """
        if not self.sed or self.provisional is None:
            return None
        return float(f"{self.provisional / self.sed - 1.0:.6g}")


def forces_of(live: Live, frame: Frame) -> Forces | None:
    """Return the forces of a message, means of the healthy readings in each step; None where there is none."""
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
    """Return several batches of one stream as one."""
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
    """Return the text about the displayed picture; where the transducer is `silent`, nothing is measured now."""
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
        live += f" ({100 * difference:+.1f} %)".replace("-", "−")
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


def run(connection: Connection) -> None:
    """Serve the window until it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the window decides when this ends
    give_way()
    # Loaded in the process alone: the window has no need of the solver, and opens sooner without it.
    from daq_app.window.live_follower import Follower
    from solver import SceneError
    from solver.mesh import MeshError

    follower: Follower | None = None
    lock = threading.Lock()

    def send(message: Ready | Provisional | SettledSolve) -> None:
        with lock, suppress(OSError):  # a window that is gone is noticed below
            connection.send(message)

    def solve(solver: Callable[[], SettledSolve]) -> None:
        send(solver())

    with suppress(EOFError, OSError):
        while True:
            match connection.recv():
                case Use() as use:
                    try:
                        if follower is None or not follower.follows(use):  # meshing takes its time
                            follower = Follower(use)
                        problem = ""
                    except (SceneError, MeshError) as error:
                        follower, problem = None, str(error)
                    send(Ready(problem))
                case Forces() as forces if follower is not None:
                    send(follower.take(forces))
                case Settle() as request:
                    if follower is not None:  # beside the next stroke, which is followed meanwhile
                        threading.Thread(target=solve, args=(follower.settled_solver(request),), daemon=True).start()
                case _:
                    send(Ready(tr("no finger to follow")))


class LiveModel:
    """The live model as the window sees it: one batch is under way at a time. `add` and `poll` never wait for it."""

    def __init__(self) -> None:
        self.provisional: Provisional | None = None  # the newest
        self.settled: SettledSolve | None = None  # of the last stroke; None again once another begins
        self.problem = ""  # why there are no predictions; empty where all is well
        self.predictions = 0  # that came so far
        self._child: Child | None = None
        self._under_way = 0
        self._unsent: list[Forces] = []
        self._requests: list[Use | Forces | Settle] = []
        self._steady: tuple[float, float] | None = None  # steady window of the last stroke, until another touch
        self._plan: SessionPlan | None = None
        self.kinematics: Kinematics = "small"  # that is asked for

    def prepare(self) -> None:
        """Start the process; it follows the published finger until a plan states another."""
        if self._child is None:
            self._child = Child(run, name="live model")
            self._under_way, self.problem = 0, ""
            self._use()

    def close(self) -> None:
        """Let it end."""
        if self._child is not None:
            self._child.close()
        self._child = None

    def follow(self, plan: SessionPlan | None) -> None:
        """Follow the finger of another plan."""
        self._plan, self.settled, self._steady = plan, None, None
        if self._child is None and self.problem:
            self.prepare()  # one that has ended gets another chance with the next session
        else:
            self._use()

    def follow_at(self, kinematics: Kinematics) -> None:
        """Follow the same finger in this kinematics."""
        if kinematics != self.kinematics:
            self.kinematics = kinematics
            self._use()

    def add(self, live: Live, frame: Frame) -> None:
        """Take readings."""
        forces = None if self._child is None else forces_of(live, frame)
        if forces is None:
            return
        if self._unsent and self._unsent[-1].stream != forces.stream:
            self._unsent.clear()
        self._unsent.append(forces)
        while len(self._unsent) > 1 and forces.time[-1] - self._unsent[0].time[0] > _OLDEST:
            self._unsent.pop(0)

    def settle(self, request: Settle) -> None:
        """Ask for the full solve of a stroke, once all that was added until now was followed."""
        if self._child is not None:
            self._requests += [join_forces(self._unsent), request] if self._unsent else [request]
            self._unsent = []

    def poll(self) -> tuple[Provisional, ...]:
        """Take what came, and send what waits; return the predictions that are new."""
        if self._child is None:
            return ()
        news: list[Provisional] = []
        try:
            while (message := self._child.receive()) is not None:
                self._under_way -= not isinstance(message, SettledSolve)  # it comes when it comes
                self._take(message)
                news += [message] if isinstance(message, Provisional) else []
            if not self._under_way:
                self._send(self._child)
        except (EOFError, OSError):
            self.close()
            self.problem = tr("the live model has stopped; it starts again with the next session")
        return tuple(news)

    def _take(self, message: Ready | Provisional | SettledSolve) -> None:
        match message:
            case Ready(problem):
                self.problem = problem
            case Provisional():
                self.provisional = message
                self.predictions += 1
                if message.sed.any():  # its forces came after the stroke: something touches again
                    self.settled = self._steady = None
            case SettledSolve():
                if message.steady == self._steady:  # a slow one may be of a stroke before
                    self.settled = message

    def _send(self, child: Child) -> None:
        if self._requests:
            request = self._requests.pop(0)
            if isinstance(request, Forces) and self.problem:
                return
            child.send(request)
            if isinstance(request, Settle):
                self.settled, self._steady = None, request.steady
                return
        elif self._unsent and not self.problem:
            child.send(join_forces(self._unsent))
            self._unsent = []
        else:
            return
        self._under_way = 1

    def _use(self) -> None:
        self.provisional = None  # of another finger
        self._requests = [Use(self._plan, self.kinematics)]
