"""The live model's process, and its client in the window: at most one batch is under way, and no call waits."""

import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from daq_app.child_process import Child, give_way
from daq_app.recorder.messages import Live
from daq_app.window import live_model as m
from daq_app.wording import tr
from sessions.plan.plan import Frame, SessionPlan

Connection = Any  # one end of a pipe; its type differs between systems
_OLDEST = 2.0  # older forces are dropped if the model does not keep up [s]


def run(connection: Connection) -> None:
    """Serve the window until it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the window decides when this ends
    give_way()
    # Loaded in this process only: the window does not need the solver, and opens sooner without it.
    from daq_app.window.live_follower import Follower
    from solver import SceneError
    from solver.mesh import MeshError

    follower: Follower | None = None
    lock = threading.Lock()

    def send(message: m.Ready | m.Provisional | m.SettledSolve) -> None:
        with lock, suppress(OSError):  # a closed window is noticed below
            connection.send(message)

    def solve(solver: Callable[[], m.SettledSolve]) -> None:
        send(solver())

    with suppress(EOFError, OSError):
        while True:
            match connection.recv():
                case m.Use() as use:
                    try:
                        if follower is None or not follower.follows(use):  # meshing is slow
                            follower = Follower(use)
                        problem = ""
                    except (SceneError, MeshError) as error:
                        follower, problem = None, str(error)
                    send(m.Ready(problem))
                case m.Forces() as forces if follower is not None:
                    send(follower.take(forces))
                case m.Settle() as request:
                    if follower is not None:  # in parallel with following the next stroke
                        threading.Thread(target=solve, args=(follower.settled_solver(request),), daemon=True).start()
                case _:
                    send(m.Ready(tr("no finger to follow")))


class LiveModel:
    """The window's client of the live model. `add` and `poll` never wait."""

    def __init__(self) -> None:
        self.provisional: m.Provisional | None = None  # the newest
        self.settled: m.SettledSolve | None = None  # of the last stroke; None once another begins
        self.problem = ""  # why there are no predictions; empty if there are
        self.predictions = 0  # number received
        self._child: Child | None = None
        self._under_way = 0
        self._unsent: list[m.Forces] = []
        self._requests: list[m.Use | m.Forces | m.Settle] = []
        self._steady: tuple[float, float] | None = None  # steady window of the last stroke, until the next contact
        self._plan: SessionPlan | None = None
        self.kinematics: m.Kinematics = "small"  # the requested one

    def prepare(self) -> None:
        """Start the process, which follows the published finger until a plan gives another."""
        if self._child is None:
            self._child = Child(run, name="live model")
            self._under_way, self.problem = 0, ""
            self._use()

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.close()
        self._child = None

    def follow(self, plan: SessionPlan | None) -> None:
        """Follow the finger of another plan."""
        self._plan, self.settled, self._steady = plan, None, None
        if self._child is None and self.problem:
            self.prepare()  # restarts a process that has ended
        else:
            self._use()

    def follow_at(self, kinematics: m.Kinematics) -> None:
        """Follow the same finger with other kinematics."""
        if kinematics != self.kinematics:
            self.kinematics = kinematics
            self._use()

    def add(self, live: Live, frame: Frame) -> None:
        """Take readings."""
        forces = None if self._child is None else m.forces_of(live, frame)
        if forces is None:
            return
        if self._unsent and self._unsent[-1].stream != forces.stream:
            self._unsent.clear()
        self._unsent.append(forces)
        while len(self._unsent) > 1 and forces.time[-1] - self._unsent[0].time[0] > _OLDEST:
            self._unsent.pop(0)

    def settle(self, request: m.Settle) -> None:
        """Request the full solve of a stroke, after the forces added so far."""
        if self._child is not None:
            self._requests += [m.join_forces(self._unsent), request] if self._unsent else [request]
            self._unsent = []

    def poll(self) -> tuple[m.Provisional, ...]:
        """Receive messages, send waiting requests, and return the new predictions."""
        if self._child is None:
            return ()
        news: list[m.Provisional] = []
        try:
            while (message := self._child.receive()) is not None:
                self._under_way -= not isinstance(message, m.SettledSolve)  # a full solve comes at any time
                self._take(message)
                news += [message] if isinstance(message, m.Provisional) else []
            if not self._under_way:
                self._send(self._child)
        except (EOFError, OSError):
            self.close()
            self.problem = tr("the live model has stopped; it starts again with the next session")
        return tuple(news)

    def _take(self, message: m.Ready | m.Provisional | m.SettledSolve) -> None:
        match message:
            case m.Ready(problem):
                self.problem = problem
            case m.Provisional():
                self.provisional = message
                self.predictions += 1
                if message.sed.any():  # its forces are later than the stroke: the finger touches again
                    self.settled = self._steady = None
            case m.SettledSolve():
                if message.steady == self._steady:  # a slow one may belong to an earlier stroke
                    self.settled = message

    def _send(self, child: Child) -> None:
        if self._requests:
            request = self._requests.pop(0)
            if isinstance(request, m.Forces) and self.problem:
                return
            child.send(request)
            if isinstance(request, m.Settle):
                self.settled, self._steady = None, request.steady
                return
        elif self._unsent and not self.problem:
            child.send(m.join_forces(self._unsent))
            self._unsent = []
        else:
            return
        self._under_way = 1

    def _use(self) -> None:
        self.provisional = None  # of another finger
        self._requests = [m.Use(self._plan, self.kinematics)]
