"""A recorder that is played: reports made up in advance, and readings of the simulated bench, without any process."""

import numpy as np

from daq_app.recorder import messages as m
from drivers.calibration import Calibration
from drivers.transducer import Health, TransducerInfo
from sessions.plan.plan import Frame
from sessions.plan.protocols import VisitSetting, plan, protocol
from sessions.recording import Acknowledged, LoggedEvent
from sessions.run import steps
from sessions.run.runner import SessionEnd, Status
from simulators.bench import RATED, Bench
from simulators.stroke import Stroke, paper_surfaces

RATE = 7000.0
FRAME = Frame("-z", "set", 20.0, "set")
CALIBRATION = Calibration("FT12345", "N, N mm", np.eye(6), np.array(RATED), "FT12345.cal, made 2025-11-03")
INFO = TransducerInfo("sim:", "sim", "SIMULATED Net F/T SI-36-0.5", "FT12345", True, RATE, RATE, CALIBRATION)
PLAN = plan(protocol("sensotact-friction"), "P07", 7, setting=VisitSetting(frame=FRAME, stroking_hand="right"))
FOLDER = "recordings/P07_sensotact-friction_20260301T143005"


class PlayedRecorder:
    """What the window sends is noted and answered by nobody."""

    pid = 0

    def __init__(self) -> None:
        """Start with nothing to say."""
        self.sent: list[object] = []
        self._waiting: list[m.Report] = []
        self._bench = Bench(3)
        self._last = 0

    def play(self, *reports: m.Report) -> None:
        """Say these at the next poll."""
        self._waiting += reports

    def stroke(self, trial: int, at: float) -> None:
        """Have the finger stroke the surface of a trial at an instant [s, device time]."""
        chosen = PLAN.trials[trial - 1]
        surface = paper_surfaces()[chosen.stimulus.descriptor, chosen.stimulus.index]
        self._bench.mount(surface)
        self._bench.begin_stroke(Stroke(surface.peak_normal_force, surface.speed, chosen.direction), at)

    def readings(self, until: float) -> None:
        """Say every reading up to an instant [s, device time], a tenth of a second a message."""
        while self._last < until * RATE:
            number = np.arange(self._last, min(self._last + int(RATE / 10), int(until * RATE) + 1))
            time = number / RATE
            wrench = self._bench.wrench(time)
            status = np.zeros(len(number), np.int64)
            self._waiting.append(m.Live(1, number, time, number, wrench, status, (0.0,) * 6))
            self._last = int(number[-1]) + 1

    def send(self, request: object) -> None:
        """Note it."""
        self.sent.append(request)

    def poll(self, timeout: float = 0.0) -> tuple[m.Report, ...]:  # noqa: ARG002  nothing is waited for
        """Return what is to be said."""
        said, self._waiting = tuple(self._waiting), []
        return said

    def close(self) -> None:
        """Do nothing."""

    def leave(self) -> None:
        """Do nothing."""


def health(**counts: int) -> m.HealthReport:
    """Return a report of a bench that is well, save for these counts."""
    totals = Health(received=123_456, lag_ms=2.0, **counts)
    return m.HealthReport(totals, 6999.7, (0.0,) * 6, (0.0,) * 6, 0)


def logged(kind: str, trial: int | None = None, **data: object) -> LoggedEvent:
    """Return a line of the log."""
    return LoggedEvent(1, 0, kind, trial, 0, data)


def status(safe_ns: int) -> Status:
    """Return a status whose acknowledgement has come so far; commands alone reach the course."""
    return Status("", 1, 10, 1000, 0, 2.0, Acknowledged(1000, 3, safe_ns))


def scored(trial: int, score: float) -> tuple[m.Report, ...]:
    """Return what is said when a trial is scored."""
    return (logged("scored", trial, score=score), logged("take_kept", trial, take=1))


TARED = m.Tared((0.008, -0.007, -0.061, 1.2, -0.4, 0.02), (0.0041,) * 3 + (0.052,) * 3, (0.0,) * 6, 7000, 1.0)
OPEN = (m.Device(INFO, FRAME), health(), TARED)
SIMULATED = "SIMULATED transducer and hand"
BEGUN = (m.SessionBegun(FOLDER, PLAN, "simulated hand", SIMULATED, 0, 1.0), steps.AskBegin(), status(1))
ENDED = m.SessionEnded(FOLDER, SessionEnd("every trial is done", "finished", True, 900_000, Health()), False)
GONE = "the transducer does not answer; check its power and the cable"
LOST = SessionEnd(GONE, "device", False, 90_000, Health(lost=12))
CUT = m.SessionEnded(FOLDER, LOST, True)
