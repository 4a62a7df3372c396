"""What a recorder tells in the course of a session, for tests of what the window makes of it."""

from dataclasses import MISSING, fields, replace

import numpy as np

from daq_app.recorder import messages as m
from daq_app.window.course_state import Quality, Remark
from daq_app.window.state import AppState, fold
from drivers.calibration import Calibration
from drivers.transducer import Health, TransducerInfo
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Acknowledged, LoggedEvent
from sessions.run import steps
from sessions.run.runner import SessionEnd, Status
from sessions.strokes.stroke import Stroke, StrokeCurve

CALIBRATION = Calibration(
    "FT1", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.array([36.0] * 3 + [500.0] * 3), "typed"
)
INFO = TransducerInfo("net-ft://192.168.1.1", "net-ft", "Net F/T", "FT1", False, 7000.0, 7000.0, CALIBRATION)
PLAN = plan(protocol("sensotact-friction"), "P07", 7)
FIRST, SECOND = PLAN.trials[:2]
VALUES = {"steady": (2.0, 3.5), "mu_dynamic": 0.44, "mu_dynamic_interval": (0.438, 0.444), "speed": 21.0}
STROKE = Stroke(**dict.fromkeys(f.name for f in fields(Stroke) if f.default is f.default_factory is MISSING) | VALUES)
GOOD = Quality((), STROKE, fell=0.08)
FLAW = Remark("refused", "no steady window", "", "")
BAD = Quality((FLAW,), replace(STROKE, steady=None, mu_dynamic=None), fell=0.08)


def stroke_at(time):
    """Return a stroke whose course is known at n times, with means that are not its own."""
    ones, pairs = np.ones(time.size), np.ones((time.size, 2))
    curve = StrokeCurve(time, ones, ones, ones, pairs, ones, pairs, ones, (0.0, 0.0), 1.0)
    means = {"normal_force": 1.234, "tangential_force": 0.5, "mu_dynamic": 0.41, "speed": 20.6}
    return replace(STROKE, onset=time[0] + 0.5, lift=time[-1] - 0.5, curve=curve, **means)


def after(*messages, state=None):
    state = AppState() if state is None else state
    for message in messages:
        state = fold(state, message)
    return state


def log(kind, trial=None, **data):
    return LoggedEvent(1, 0, kind, trial, 0, data)


def health_report(load, peak=None):
    return m.HealthReport(Health(), 7000.0, load, peak or load, 0)


def status(safe_ns, state="mounting"):
    return Status(state, 1, 10, 100, 0, 2.0, Acknowledged(100, 3, safe_ns))


BEGINNING = (m.Device(INFO, None), m.SessionBegun("recordings/P07", PLAN, "people", None, 0), steps.AskBegin())
MOUNT = (*BEGINNING, steps.ShowInstruction(PLAN.blocks[0]), steps.AskMount(FIRST))
TARE = (*MOUNT, steps.StartTake(1, 1), steps.MeasureZero())
READY = (*TARE, steps.AskStroke(FIRST))
TOUCH = (*READY, log("contact_onset", 1, time=1.5, noticed=1.51))
SCORE = (*TOUCH, log("finger_lifted", 1, time=3.6, noticed=3.7), steps.AskScore(FIRST, ("low end", "high end")))
PAUSED = (*MOUNT, log("pause", 1))
CLOSING = (*BEGINNING, steps.AskFinish())
END = SessionEnd("every trial is done", "finished", True, 100, Health())
LOST = SessionEnd("the cable was pulled", "device", False, 100, Health(lost=3))
CODE = FIRST.stimulus.code
