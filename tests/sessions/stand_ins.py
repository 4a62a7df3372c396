"""Stand-ins for the runner's world: a clock that the test sets, a transducer, an experimenter with a subject."""

import numpy as np

from drivers.calibration import Calibration
from drivers.clock import SimulatedClock
from drivers.readings import ReadingBlock
from drivers.transducer import Health, LinkLost, TransducerInfo
from sessions.run import steps

RATE = 200.0
CALIBRATION = Calibration(
    "FT1", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.array([50.0, 50, 70, 500, 500, 500]), "typed in"
)
INFO = TransducerInfo(
    "test://", "test", "stand-in", "FT1", True, RATE, 7000.0, CALIBRATION, {"filter": "none", "bias": "off"}
)


class ResumableClock(SimulatedClock):
    """A simulated clock that is recorded as a real one, so that its session can go on."""

    factor = 1.0


class StandIn:
    """A transducer at 200 Hz on the clock of the test. `touches` press it: (from, to, newtons), session clock [ns].

    In the spans of `dropouts` (from, to) it sends zeros, with a status that marks them as invalid.
    """

    def __init__(self, clock, *, seed=0, lost=(), link_lost_after=None, rate_words=""):
        self.clock = clock
        self.info = INFO
        self.touches = []
        self.dropouts = []
        self.sent = 0
        self.lost = set(lost)  # sequence numbers that never arrive
        self.link_lost_after = link_lost_after  # readings
        self.rate_words = rate_words  # from the 400th reading on
        self.streaming = False
        self.began_ns = None
        self._noise = np.random.default_rng(seed)
        self._lost_so_far = 0

    @property
    def health(self):
        off = int(bool(self.rate_words) and self.sent > 400)
        words = self.rate_words if off else ""
        return Health(self.sent - self._lost_so_far, self._lost_so_far, off_rate=off, rate_words=words)

    def start(self):
        self.began_ns = self.clock.now_ns()
        self.streaming = True

    def stop(self):
        self.streaming = False

    def close(self):
        self.stop()

    def read(self, timeout):
        due = int((self.clock.at_ns - self.began_ns) * 1e-9 * RATE) if self.streaming else self.sent
        if due == self.sent and timeout:
            self.clock.sleep(timeout)
        if self.link_lost_after is not None:
            due = min(due, self.link_lost_after)
            if self.sent >= self.link_lost_after:
                raise LinkLost("the cable was pulled")
        numbers = np.array([i for i in range(self.sent, due) if i not in self.lost], np.int64)
        self._lost_so_far += due - self.sent - len(numbers)
        self.sent = max(due, self.sent)
        received = self.began_ns + (numbers * (1e9 / RATE)).astype(np.int64)
        force = self._noise.normal(0.1, 0.004, len(numbers))  # a bias of 0.1 N, noise 4 mN
        for begin, end, newtons in self.touches:
            force += newtons * ((received >= begin) & (received < end))
        raw = np.zeros((len(numbers), 6))
        raw[:, 2] = np.round(-force * 1e6)
        status = numbers * 0
        for begin, end in self.dropouts:
            status[(received >= begin) & (received < end)] = 1
        raw[status != 0] = 0.0
        return ReadingBlock(numbers, numbers * 35, status, numbers / RATE, received, raw)


class Hands:
    """Does what is asked, a little later; `instead` maps the type of a command to a function that makes the events."""

    def __init__(self, clock, transducer=None, instead=None):
        self.clock = clock
        self.transducer = transducer
        self.instead = instead or {}
        self.display = []
        self.events = []  # (due, event)

    def show(self, command):
        self.display.append(command)
        now = self.clock.at_ns
        make = self.instead.get(type(command))
        events = make(command) if make else None
        for event in self.answers(command, now) if events is None else events:
            self.events.append((now + 200_000_000, event))

    def answers(self, command, now):
        match command:
            case steps.AskBegin():
                return [steps.Begin()]
            case steps.AskMount(trial):
                return [steps.StimulusMounted(trial.stimulus.code)]
            case steps.AskStroke():
                if self.transducer is None:
                    return [steps.StrokeDone()]
                self.stroke(now)
            case steps.AskScore(trial):
                return [steps.Scored(float(trial.stimulus.index))]
            case steps.AskNumber(trial):
                return [steps.MagnitudeEstimate(trial.stimulus.index + 1.0)]
            case steps.AskChoice(first, second):
                return [steps.PairedChoice("first" if first.stimulus.index > second.stimulus.index else "second")]
            case steps.AskRest(None):
                return [steps.Resume()]
            case steps.AskFinish():
                return [steps.Finish()]
        return []

    def stroke(self, now, newtons=2.0):
        self.transducer.touches.append((now + 300_000_000, now + 900_000_000, newtons))

    def poll(self):
        due = [event for at, event in self.events if at <= self.clock.at_ns]
        self.events = [(at, event) for at, event in self.events if at > self.clock.at_ns]
        return due
