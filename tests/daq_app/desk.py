"""A client of the recorder with people in front of it, for tests."""

import time
from dataclasses import replace

from daq_app.recorder.messages import Connect, People, StartSession
from sessions.plan.plan import Frame
from sessions.plan.protocols.planning import VisitSetting, plan
from sessions.plan.protocols.protocol import protocol
from sessions.run.steps import AskBegin, AskFinish, AskMount, AskScore, Begin, Finish, Scored, StimulusMounted

PACE = 20.0
DEADLINE = 60.0  # of a machine that hangs, not of a slow one [s]
PLAN = plan(protocol("sensotact-friction"), "S01", 3, setting=VisitSetting(frame=Frame("-z", "set", 20.0, "set")))
SHORT = replace(PLAN, blocks=(replace(PLAN.blocks[0], trials=PLAN.blocks[0].trials[:3]),))


class Desk:
    """A client with people in front of it, who do what is asked; `instead` maps a command's type to what they do."""

    def __init__(self, recorder, instead=None):
        self.recorder = recorder
        self.instead = instead or {}
        self.reports = []
        self.queue = []

    def begin(self, folder, people="simulated hand"):
        """Open the simulated bench and begin the short session in `folder`."""
        self.recorder.send(Connect("sim:?seed=7&rate=100"))
        self.recorder.send(StartSession(SHORT, str(folder), People(people, 7)))

    def until(self, kind, number=1):
        """Go on until so many more reports of a kind came, and return the last."""
        deadline = time.monotonic() + DEADLINE
        while time.monotonic() < deadline:
            self.queue += self.recorder.poll(0.0 if self.queue else 0.05)
            while self.queue:
                report = self.queue.pop(0)
                self.reports.append(report)
                self.answer(report)
                number -= isinstance(report, kind)
                if number == 0:
                    return report
        raise AssertionError(f"no {kind} came; the last were {[type(r).__name__ for r in self.reports[-8:]]}")

    def answer(self, report):
        if type(report) in self.instead:
            self.instead[type(report)](report)
            return
        match report:
            case AskBegin():
                self.recorder.send(Begin())
            case AskMount(trial):
                self.recorder.send(StimulusMounted(trial.stimulus.code))
            case AskScore(trial):
                self.recorder.send(Scored(float(trial.stimulus.index)))
            case AskFinish():
                self.recorder.send(Finish())

    def of(self, kind):
        return [report for report in self.reports if isinstance(report, kind)]
