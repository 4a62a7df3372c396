"""Builds real or simulated parts. Whoever runs a session reaches the simulators through here alone."""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from drivers.address import check_options, parse_address, without_tool
from drivers.catalog import open_transducer
from drivers.clock import Clock
from drivers.transducer import SetupError, Transducer
from sessions.plan.plan import Frame, Trial
from sessions.recording import Recording
from sessions.recording.replay import ReplayTransducer
from sessions.run import steps
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox
from simulators.serving import TimetableError, serve_digital_ft, serve_net_ft, serve_serial_ft
from simulators.stroke import Surface, paper_surfaces
from simulators.subject import SimulatedSubject

__all__ = [
    "Connected",
    "DueEvents",
    "SimulatedHand",
    "SimulatedPeople",
    "TimetableError",
    "connected",
    "itself",
    "planted_surface",
    "serve_digital_ft",
    "serve_net_ft",
    "serve_serial_ft",
]

SIMULATED = "sim"
REPLAY = "replay:"  # and the path of a session folder
JUDGING = 0.8  # from lift to score [s]; an unloaded stretch in which drift shows
INPUT = "simulated"
_OPTIONS = frozenset({"seed", "rate", "tool"})


@dataclass(frozen=True, slots=True)
class Connected:
    """An opened transducer, and the bench behind it where that is simulated in this process."""

    transducer: Transducer
    bench: Bench | None = None
    bench_now: Callable[[], float] | None = None  # the bench's time [s]
    recorded_frame: Frame | None = None  # of a recording that is replayed

    @property
    def frame(self) -> Frame | None:
        """How the axes of a simulated or recorded bench lie to its face; None for a real one, which cannot tell."""
        if self.bench is None:
            return self.recorded_frame
        return Frame("-z", "set", self.bench.settings.height, "set")


@contextmanager
def connected(uri: str, clock: Clock) -> Generator[Connected]:
    """Open the transducer at `uri` and close it in any case.

    `sim:?seed=7&rate=200` is the simulated bench: a box on loopback, read by the very driver a real box is read by.
    `replay:recordings/P07` is the transducer of a recording, speaking as it spoke then. Raises SetupError or LinkLost
    as the driver does, RecordingError for a folder that holds no recording.
    """
    if uri.startswith(REPLAY):
        recording = Recording.open(Path(uri.removeprefix(REPLAY)))
        replayed = ReplayTransducer(recording, clock, uri)
        try:
            yield Connected(replayed, recorded_frame=recording.plan.frame)
        finally:
            replayed.close()
        return
    address = parse_address(uri)
    if address.scheme != SIMULATED:
        transducer = open_transducer(uri, clock)
        try:
            yield Connected(transducer)
        finally:
            transducer.close()
        return
    check_options(address, _OPTIONS)
    without_tool(address)  # refused in terms of this address
    bench = Bench(address.number("seed", 0, 0, 2**31 - 1))
    box = NetFtBox(bench, clock, rate=address.number("rate", 200, 1, 7000))
    box.start()
    try:
        tool = f"&tool={address.options['tool']}" if "tool" in address.options else ""
        with connected(box.uri + tool, clock) as inner:
            yield Connected(inner.transducer, bench, box.now)
    finally:
        box.close()


Planted = Sequence[tuple[str, int, float]]  # descriptor, index and friction of surfaces that a protocol plants [-]
Known = Callable[[Trial], Trial]  # a trial with the index of its stimulus


def itself(trial: Trial) -> Trial:
    """Return the trial: its stimulus is known."""
    return trial


class SimulatedHand:
    """Mounts and strokes the simulated bench when a session asks for it, and does nothing else: people do the rest."""

    def __init__(self, subject_seed: int, bench: Connected, known: Known = itself, planted: Planted = ()) -> None:
        """Let the subject of that seed stroke; `known` tells a blinded stimulus, `planted` the friction of some.

        Raises SetupError where the bench is not simulated in this process.
        """
        if bench.bench is None or bench.bench_now is None:
            raise SetupError("a simulated hand strokes the simulated bench only: connect sim:")
        self._subject = SimulatedSubject(subject_seed)
        self._bench = bench.bench
        self._now = bench.bench_now
        self._known, self._planted = known, planted
        self._takes: dict[int, int] = {}  # by trial number

    def show(self, command: steps.Command) -> None:
        """Do what the command asks a hand for."""
        match command:
            case steps.AskMount(trial):
                self._bench.mount(self._surface(trial))
            case steps.AskStroke(trial):
                self._takes[trial.number] = self._takes.get(trial.number, 0) + 1
                stroke = self._subject.stroke(self._surface(trial), self._takes[trial.number])
                self._bench.begin_stroke(stroke, self._now())
            case _:
                pass

    def poll(self) -> tuple[steps.Event, ...]:
        """Return nothing: the transducer measures what a hand does."""
        return ()

    def _surface(self, trial: Trial) -> Surface:
        return planted_surface(self._known(trial), self._planted)


class DueEvents:
    """Events that come up when their time has come, in the order they were put in."""

    def __init__(self, clock: Clock) -> None:
        """Tell time by `clock`."""
        self.clock = clock
        self._due: list[tuple[int, steps.Event]] = []  # session clock [ns]

    def put(self, event: steps.Event, after: float = 0.0) -> None:
        """Let an event come up in `after` seconds of the clock."""
        self._due.append((self.clock.now_ns() + int(after * 1e9), event))

    def poll(self) -> tuple[steps.Event, ...]:
        """Return what has come up by now, once."""
        now_ns = self.clock.now_ns()
        done = tuple(event for due, event in self._due if due <= now_ns)
        self._due = [(due, event) for due, event in self._due if due > now_ns]
        return done


class SimulatedPeople(DueEvents):
    """Experimenter and subject in one, for a session nobody sits at: they do at once what is asked of them.

    With a bench the subject strokes it, and judges when the finger has left; without one it strokes and judges unseen.
    """

    def __init__(
        self,
        subject_seed: int,
        clock: Clock,
        bench: Connected | None = None,
        known: Known = itself,
        planted: Planted = (),
    ) -> None:
        """Let the subject of that seed stroke the bench, where there is one; for the others see `SimulatedHand`."""
        super().__init__(clock)
        self._subject = SimulatedSubject(subject_seed)
        self._hand = (
            None if bench is None or bench.bench is None else SimulatedHand(subject_seed, bench, known, planted)
        )
        self._known, self._planted = known, planted
        self._takes: dict[int, int] = {}  # by trial number

    def show(self, command: steps.Command) -> None:
        """Do what the command asks for."""
        if self._hand is not None:
            self._hand.show(command)
        match command:
            case steps.AskBegin():
                self.put(steps.Begin())
            case steps.AskMount(trial):
                self.put(steps.StimulusMounted(trial.stimulus.code))
            case steps.AskStroke(trial):
                self._takes[trial.number] = self._takes.get(trial.number, 0) + 1
                if self._hand is None:
                    self.put(steps.StrokeDone())
            case steps.AskScore() | steps.AskNumber() | steps.AskChoice():
                self.put(self._judgement(command), after=self._judging)
            case steps.AskRest(None):
                self.put(steps.Resume())
            case steps.AskFinish():
                self.put(steps.Finish())
            case _:
                pass

    def _judgement(self, command: steps.AskScore | steps.AskNumber | steps.AskChoice) -> steps.Event:
        """Return what the subject answers."""
        at = self.clock.now_ns() * 1e-9 + self._judging
        match command:
            case steps.AskScore(trial):
                score = self._judged(trial)
                return steps.Scored(score, ((at, score),), at, 0, None, INPUT)
            case steps.AskNumber(trial):
                number = self._subject.number(self._surface(trial), self._takes[trial.number])
                return steps.MagnitudeEstimate(number, at, 0, None, INPUT)
            case steps.AskChoice(first, second):
                more = self._more(first, second)
                return steps.PairedChoice("first" if more else "second", at, 0, None, INPUT)

    def _more(self, first: Trial, second: Trial) -> bool:
        """Say whether the first of two has more: of friction where one is a standard, else of its descriptor."""
        if first.standard or second.standard:
            take = self._takes[second.number]
            return self._subject.more_friction(self._surface(first), self._surface(second), second.number, take)
        return self._judged(first) > self._judged(second)

    @property
    def _judging(self) -> float:
        return JUDGING if self._hand else 0.0

    def _judged(self, trial: Trial) -> float:
        return self._subject.score(self._surface(trial), self._takes[trial.number])

    def _surface(self, trial: Trial) -> Surface:
        return planted_surface(self._known(trial), self._planted)


def planted_surface(trial: Trial, planted: Planted = ()) -> Surface:
    """Return the simulated surface of a trial, stroked as the trial asks.

    The simulated bench holds the ten surfaces of sensotact-friction. For any other stimulus the one with the nearest
    index stands in, of the same descriptor where there is one, so that every protocol can be rehearsed. Where a
    protocol has planted friction of its own, that surface is as slippery as it says, and pressed as hard.
    """
    stimulus = trial.stimulus
    surfaces = paper_surfaces().values()
    alike = [surface for surface in surfaces if surface.descriptor == stimulus.descriptor]
    surface = min(alike or surfaces, key=lambda one: abs(one.index - stimulus.known_index))
    surface = replace(surface, direction=trial.direction)
    for descriptor, index, mu in planted:
        if (descriptor, index) == (stimulus.descriptor, stimulus.known_index):
            return replace(surface, mu=mu, tau_max=surface.tau_max * mu / surface.mu, index=index)
    return surface
