"""Connects real, simulated or replayed transducers and people: sessions reach the simulators only through here."""

from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from drivers.address import check_form, parse_address, without_tool
from drivers.catalog import open_transducer
from drivers.clock import Clock
from drivers.transducer import Transducer
from sessions.plan.plan import Frame, Trial
from sessions.recording import Recording
from sessions.recording.replay import ReplayTransducer
from sessions.run import steps
from sessions.toml_file import load_toml
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox
from simulators.serving import WIRES as WIRES  # the verb serves them
from simulators.serving import Script, Timetable, TimetableError, timetable_in
from simulators.serving import serve as serve
from simulators.stroke import Surface, paper_surfaces
from simulators.subject import SimulatedSubject

_SIMULATED = "sim"
REPLAY = "replay:"  # followed by the path of a session folder
JUDGING = 0.8  # from lift to score [s]; an unloaded stretch that reveals drift
INPUT = "simulated"
_OPTIONS = frozenset({"seed", "rate", "tool"})


@dataclass(frozen=True, slots=True)
class Connection:
    """An open transducer, and its bench if that is simulated in this process."""

    transducer: Transducer
    bench: Bench | None = None
    bench_now: Callable[[], float] | None = None  # the bench's time [s]
    recorded_frame: Frame | None = None  # of a replayed recording

    @property
    def frame(self) -> Frame | None:
        """Orientation of a simulated or recorded bench's axes to its face; None for a real bench (unknown)."""
        if self.bench is None:
            return self.recorded_frame
        return Frame("-z", "set", self.bench.settings.height, "set")


def load_timetable(path: Path) -> Timetable:
    """Return the timetable in a TOML file. Raises OSError, SettingsError, and TimetableError that names the file."""
    script = load_toml(path, Script)
    try:
        return timetable_in(script)
    except TimetableError as wrong:
        raise TimetableError(f"{path}: {wrong}") from wrong


@contextmanager
def connect(uri: str, clock: Clock) -> Generator[Connection]:
    """Yield the open transducer at `uri`, and close it afterwards.

    `sim:?seed=7&rate=200` is the simulated bench: a box on loopback, read by the same driver as a real box.
    `replay:recordings/P07` is the transducer of a recording, with the same output as then. Raises SetupError or
    LinkLost as the driver does, RecordingError for a folder without a recording.
    """
    if uri.startswith(REPLAY):
        recording = Recording.open(Path(uri.removeprefix(REPLAY)))
        with closing(ReplayTransducer(recording, clock, uri)) as transducer:
            yield Connection(transducer, recorded_frame=recording.plan.frame)
        return
    address = parse_address(uri)
    if address.scheme != _SIMULATED:
        with closing(open_transducer(uri, clock, f"{_SIMULATED}:", REPLAY)) as transducer:
            yield Connection(transducer)
        return
    check_form(address, "sim:?seed=7&rate=200", _OPTIONS)
    without_tool(address)  # an error names this address
    bench = Bench(address.number("seed", 0, 0, 2**31 - 1))
    box = NetFtBox(bench, clock, rate=address.number("rate", 200, 1, 7000))
    box.start()
    with closing(box):
        tool = f"&tool={address.options['tool']}" if "tool" in address.options else ""
        with connect(box.uri + tool, clock) as inner:
            yield Connection(inner.transducer, bench, box.now)


def simulated_surface(trial: Trial, friction: Sequence[tuple[str, int, float]] = ()) -> Surface:
    """Return the simulated surface of a trial, stroked as the trial asks.

    The simulated bench holds the ten surfaces of sensotact-friction. Any other stimulus is replaced by the one with
    the nearest index, of the same descriptor if possible, so that every protocol can be rehearsed. A protocol
    may set `friction`, as descriptor, index and mu [-]: such a surface is pressed as hard as its substitute.
    """
    stimulus = trial.stimulus
    surfaces = paper_surfaces().values()
    alike = [surface for surface in surfaces if surface.descriptor == stimulus.descriptor]
    surface = min(alike or surfaces, key=lambda candidate: abs(candidate.index - stimulus.known_index))
    surface = replace(surface, direction=trial.direction)
    for descriptor, index, mu in friction:
        if (descriptor, index) == (stimulus.descriptor, stimulus.known_index):
            return replace(surface, mu=mu, tau_max=surface.tau_max * mu / surface.mu, index=index)
    return surface


SurfaceOf = Callable[[Trial], Surface]


class SimulatedHand:
    """Mounts and strokes on the simulated bench when a session asks for it; people do the rest."""

    def __init__(
        self, subject: SimulatedSubject, bench: Connection | None, surface: SurfaceOf = simulated_surface
    ) -> None:
        """Let the subject stroke the `surface` of each trial; without a (simulated) bench no readings result."""
        self.subject, self.surface = subject, surface
        self.connected = bench
        self.stroke_trials: list[Trial] = []  # in order, once per take
        self._strokes = Counter[tuple[str, int]]()  # on each surface
        self._repetitions: dict[int, int] = {}  # of its surface in the last stroke of each trial

    def show(self, command: steps.Command) -> None:
        """Carry out the part of a command that concerns a hand."""
        bench = None if self.connected is None else self.connected.bench
        match command:
            case steps.AskMount(trial) if bench is not None:
                bench.mount(self.surface(trial))
            case steps.AskStroke(trial):
                self.count_stroke(trial)
                if bench is not None and self.connected is not None and self.connected.bench_now is not None:
                    stroke = self.subject.stroke(self.surface(trial), self.repetition(trial))
                    bench.begin_stroke(stroke, self.connected.bench_now())

    def take(self, trial: Trial) -> int:
        """Return the number of strokes of a trial."""
        return sum(stroke_trial.number == trial.number for stroke_trial in self.stroke_trials)

    def count_stroke(self, trial: Trial) -> None:
        """Note a stroke that begins, or one from before the session was interrupted."""
        surface = self.surface(trial)
        self.stroke_trials.append(trial)
        self._strokes[surface.descriptor, surface.index] += 1
        self._repetitions[trial.number] = self._strokes[surface.descriptor, surface.index]

    def repetition(self, trial: Trial) -> int:
        """Return how often the surface of a trial had been stroked in this visit by its last stroke; 0 before it."""
        return self._repetitions.get(trial.number, 0)

    def poll(self) -> tuple[steps.Event, ...]:
        """Return no events: the transducer measures the hand."""
        return ()


class SimulatedPeople(SimulatedHand):
    """A simulated experimenter and subject, who answer every command of an unattended session immediately.

    With a bench the subject strokes it and judges after the lift. Without one there are no readings.
    """

    def __init__(
        self,
        subject: SimulatedSubject,
        clock: Clock,
        bench: Connection | None = None,
        surface: SurfaceOf = simulated_surface,
    ) -> None:
        """Let the subject answer on the session's clock; the other arguments are those of `SimulatedHand`."""
        super().__init__(subject, bench, surface)
        self.clock = clock
        self.judgement_s = JUDGING if bench else 0.0  # from lift to judgement [s]
        self._due: list[tuple[int, steps.Event]] = []  # session clock [ns]

    def put(self, event: steps.Event, delay: float = 0.0) -> None:
        """Schedule an event in `delay` seconds of the clock."""
        self._due.append((self.clock.now_ns() + int(delay * 1e9), event))

    def poll(self) -> tuple[steps.Event, ...]:
        """Return the events now due, once, in the order in which they were scheduled."""
        now_ns = self.clock.now_ns()
        events = tuple(event for due, event in self._due if due <= now_ns)
        self._due = [(due, event) for due, event in self._due if due > now_ns]
        return events

    def show(self, command: steps.Command) -> None:
        """Carry out a command."""
        super().show(command)
        match command:
            case steps.AskBegin():
                self.put(steps.Begin())
            case steps.AskMount(trial):
                self.put(steps.StimulusMounted(trial.stimulus.code))
            case steps.AskStroke(trial) if self.connected is None:
                self.put(steps.StrokeDone())
            case steps.AskScore() | steps.AskNumber() | steps.AskChoice():
                self.put(self._judgement(command), delay=self.judgement_s)
            case steps.AskRest(None):
                self.put(steps.Resume())
            case steps.AskFinish():
                self.put(steps.Finish())

    def score(self, trial: Trial) -> float:
        """Return the score of a trial, whose last take is judged."""
        return self.subject.score(self.surface(trial), self.repetition(trial))

    def _judgement(self, command: steps.AskScore | steps.AskNumber | steps.AskChoice) -> steps.Event:
        time = self.clock.now_ns() * 1e-9 + self.judgement_s
        match command:
            case steps.AskScore(trial):
                score = self.score(trial)
                return steps.Scored(score, ((time, score),), time, 0, None, INPUT)
            case steps.AskNumber(trial):
                number = self.subject.number(self.surface(trial), self.repetition(trial))
                return steps.MagnitudeEstimate(number, time, 0, None, INPUT)
            case steps.AskChoice(first, second):
                return steps.PairedChoice("first" if self._more(first, second) else "second", time, 0, None, INPUT)

    def _more(self, first: Trial, second: Trial) -> bool:
        """Say whether the first of two has more: friction if one is a standard, else of its descriptor."""
        if first.standard or second.standard:
            surfaces = self.surface(first), self.surface(second)
            return self.subject.more_friction(*surfaces, second.number, self.take(second))
        return self.score(first) > self.score(second)
