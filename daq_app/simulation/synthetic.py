"""A complete study of simulated people, from plan to sealed folders, with its ground truth and faults.

Ten subjects stroke and score the ten surfaces of the paper. Fingers differ in friction, transducers in calibration,
people in their use of the scale. Scores follow the maker's index and the friction of the subject's own finger,
drift within a block and carry over from one trial to the next. No model of the finger is involved.

The ten people of a study are a sample of a population, to which its intervals refer, on the same ten surfaces.
`relations` computes the population values from many more people, each with their own finger and order.
"""

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from daq_app.console import Console, RecordingKept
from daq_app.simulation.wiring import INPUT, Connection, SimulatedPeople, connect, simulated_surface
from drivers.clock import Clock, SimulatedClock
from sessions.file_access import holds_something, write_json
from sessions.plan.plan import Block, Frame, SessionPlan, Trial
from sessions.plan.protocols.planning import VisitSetting, plan
from sessions.plan.protocols.protocol import protocol
from sessions.prediction import PredictionOptions
from sessions.prediction.scenes import seds_at
from sessions.recording import FleetingWriter, RecordingError, SessionWriter, Setting, provenance
from sessions.recording.archive import seal
from sessions.recording.schema import LIVE_FILE
from sessions.report.contents import GroundTruth
from sessions.run import steps
from sessions.run.resuming import RESUMABLE
from sessions.run.runner import RunnerSettings, SessionEnd, Status, run_session
from sessions.statistics.findings import GROUND_TRUTH_FILE, VisitFaults
from sessions.statistics.visit import EXCLUSIONS
from sessions.strokes.stroke import FIXED, AreaLaw
from simulators.bench import Bench, BenchSettings, DirectTransducer
from simulators.stroke import Surface
from simulators.subject import SimulatedSubject, SubjectSettings

PROTOCOL = "sensotact-friction"
SUBJECTS = 10
STROKING = 3  # the subject who strokes on the transducer


def conduct(
    plan: SessionPlan,
    folder: Path,
    people: SimulatedPeople,
    console: Console,
    *,
    settings: Sequence[Setting] = (),
    run: RunnerSettings | None = None,
    durable: bool = True,
) -> SessionEnd:
    """Record the session of these people in `folder` and seal it after any ending, unless it can be resumed.

    With `durable` False nothing waits for the disk. Raises RecordingError if the folder cannot be used or the disk
    is full, and KeyboardInterrupt if the user stopped it, after sealing.
    """
    transducer = None if people.connected is None else people.connected.transducer
    info = None if transducer is None else transducer.info
    came_from = provenance(people.clock, settings)
    writer_type = SessionWriter if durable else FleetingWriter
    writer = writer_type.create(folder, plan, info, came_from, subject_simulated=True, clock=people.clock)

    def show(status: Status) -> None:
        fraction = 0.0 if status.trial is None else (status.trial - 1) / status.trials
        console.progress(fraction, f"{plan.subject}: {status.state}, {status.safe.readings} readings safe")

    end = run_session(plan, writer, people, transducer, settings=run, progress=show)
    if end.cause not in RESUMABLE:
        seal(writer.folder)
    if end.cause == "stopped":
        raise KeyboardInterrupt
    return end


@contextmanager
def recordings_in(folder: Path) -> Generator[None]:
    """Guard work that records into `folder`. Raises RecordingError if that is not empty.

    If the user stops the work after it has recorded data, raises RecordingKept instead of KeyboardInterrupt.
    """
    if holds_something(folder):
        raise RecordingError(f"{folder} is not empty; give a new folder, because nothing is overwritten")
    try:
        yield
    except KeyboardInterrupt:
        if not holds_something(folder):
            raise
        raise RecordingKept(f"stopped; what was recorded is in {folder}", "stopped", folder=str(folder)) from None


class StudyCutShort(Exception):
    """A visit ended before its last trial; its recording is kept."""


@dataclass(frozen=True, slots=True)
class Study:
    """The folders of the visits, and the ground truth of the one with forces."""

    scores: tuple[Path, ...]  # a folder per subject
    forces: Path
    ground_truth: tuple[GroundTruth, ...]  # a row per trial
    readings: int
    lost: int


def simulated_study(parent: Path, seed: int, clock: Clock, console: Console) -> Study:
    """Record every visit in its own folder below `parent`. The same seed gives the same people and surfaces.

    Raises RecordingError if `parent` cannot be used, StudyCutShort if a visit ended early.
    """
    study_protocol = protocol(PROTOCOL)

    def visit(session_plan: SessionPlan, folder: Path, people: SimulatedPeople) -> SessionEnd:
        end = conduct(session_plan, folder, people, console, settings=[Setting("study seed", seed, "", "set")])
        if not end.complete:
            raise StudyCutShort(f"{end.reason}; what was recorded is in {folder.parent}")
        return end

    scores: list[Path] = []
    for number in range(1, SUBJECTS + 1):
        subject, subject_seed = f"S{number:02d}", 100 * seed + number
        scores.append(parent / f"{subject}-scores")
        people = SimulatedPeople(SimulatedSubject(subject_seed), clock)
        visit(plan(study_protocol, subject, subject_seed, forces=False), scores[-1], people)
    subject, subject_seed = f"S{STROKING:02d}", 100 * seed + STROKING
    folder = parent / f"{subject}-forces"
    with connect(f"sim:?seed={seed}&rate=200", clock) as bench:
        people = SimulatedPeople(SimulatedSubject(subject_seed), clock, bench)
        setting = VisitSetting(frame=bench.frame)
        end = visit(plan(study_protocol, subject, subject_seed + 1, setting=setting), folder, people)
        assert bench.bench is not None  # `sim:` has one
        strokes = zip(people.stroke_trials, bench.bench.ground_truth(), strict=True)
        last = {trial.number: stroke for trial, stroke in strokes}  # of each trial
        ground_truth = tuple(
            GroundTruth(trial, stroke.mu, stroke.tau_max, stroke.speed, stroke.direction)
            for trial, stroke in last.items()
        )
    return Study(tuple(scores), folder, ground_truth, end.readings, end.health.lost)


DAMAGED = "S11"
PEOPLE = SubjectSettings(
    gain=0.75, gain_spread=0.05, offset_spread=3.0, judgement_noise=4.0, friction_weight=0.3, drift=0.4,
    carry_over=0.04, moisture=0.08,
)  # fmt: skip
CALIBRATION = 0.01  # standard deviation of each axis's gain about 1 [-]
_LIGHT = 0.15  # peak normal force of a stroke that presses too lightly [N]
_TICK = 0.1  # between two polls of the transducer [s of the session's clock]: five times the interval used with people


_DECISIONS = """# SIMULATED: decisions about a simulated study

[[exclude]]
subject = "S07"
why = "used both scales backwards, and said so afterwards"
who = "simulated experimenter"
"""
FAULTS: Mapping[str, VisitFaults] = {
    "S02": VisitFaults(lost=3, expected="trial 3: lost_readings"),
    "S04": VisitFaults(frozen=6, expected="trial 6: frozen_sensor"),
    "S05": VisitFaults(light=2, expected="trial 2: too_little_force"),
    "S06": VisitFaults(unanswered=8, expected="trial 8 has no score"),
    "S07": VisitFaults(reversed=True, expected="the scale was used backwards"),
    "S09": VisitFaults(aborted=9, expected="trials 9 and 10 were not done"),
}


def synthetic_study(parent: Path, seed: int, console: Console, subjects: int = SUBJECTS) -> None:
    """Write the study below `parent`: a folder per visit, a damaged one, decisions, and the ground truth.

    The same seed gives the same readings and answers. Raises RecordingError if `parent` cannot be used.
    """
    strokes = [_visit(parent, seed, number, console) for number in range(1, subjects + 1)]
    (parent / DAMAGED).mkdir()
    (parent / DAMAGED / LIVE_FILE).write_bytes((parent / "S01" / LIVE_FILE).read_bytes()[:1000])
    (parent / EXCLUSIONS).write_text(_DECISIONS, encoding="utf-8")
    faults = {code: fault for code, fault in FAULTS.items() if int(code[1:]) <= subjects}
    faults[DAMAGED] = VisitFaults(expected="the file is damaged")
    truth = {
        "SIMULATED": "SIMULATED: this is the ground truth of a simulated study",
        "seed": seed,
        "score": true_slopes(PEOPLE),
        "people": asdict(PEOPLE),
        "calibration_sd": CALIBRATION,
        "spoilt": {code: asdict(fault) for code, fault in faults.items()},
        "strokes": [row for rows in strokes for row in rows],
    }
    write_json(parent / GROUND_TRUTH_FILE, truth)


def true_slopes(people: SubjectSettings) -> dict[str, Any]:
    """Return the slopes of these people's scores on index, µ by descriptor, trial position and previous index."""
    judgements = {name: SimulatedSubject(0, people).by_friction(name) for name in ("stickiness", "slipperiness")}
    by_index = people.gain * (1.0 - people.friction_weight)
    return {"gain": by_index, "friction": judgements, "drift": people.drift, "carry_over": people.carry_over}


def _visit(parent: Path, seed: int, number: int, console: Console) -> list[dict[str, Any]]:
    """Record one subject's visit and return its ground truth, a row per stroke."""
    subject, subject_seed = f"S{number:02d}", 100 * seed + number
    faults = FAULTS.get(subject, VisitFaults(expected=""))
    a, b, c, d, e, f = np.random.default_rng([subject_seed, 7]).normal(1.0, CALIBRATION, 6).tolist()
    bench = Bench(subject_seed, BenchSettings(gains=(a, b, c, d, e, f)))
    clock = SimulatedClock()
    transducer = DirectTransducer(bench, clock, lost=faults.lost, frozen=faults.frozen)
    settings = replace(PEOPLE, gain=-PEOPLE.gain) if faults.reversed else PEOPLE
    setting = VisitSetting(frame=Frame("-z", "set", bench.settings.height, "set"))
    session_plan = plan(protocol(PROTOCOL), subject, subject_seed, setting=setting)
    person = SimulatedSubject(subject_seed, settings)
    people = SyntheticPeople(person, clock, Connection(transducer, bench, transducer.now), session_plan, faults)
    study, run = [Setting("study seed", seed, "", "set")], RunnerSettings(tick=_TICK)
    conduct(session_plan, parent / subject, people, console, settings=study, run=run, durable=False)
    rows: list[dict[str, Any]] = []
    for trial, stroke in zip(people.stroke_trials, bench.ground_truth(), strict=True):
        stimulus = {"descriptor": trial.stimulus.descriptor, "index": trial.stimulus.index}
        truth = {name: getattr(stroke, name) for name in ("mu", "tau_max", "speed", "direction")}
        rows.append({"subject": subject, "trial": trial.number, **stimulus, **truth, **people.true_judgement(trial)})
    return rows


class SyntheticPeople(SimulatedPeople):
    """Simulated people with their own finger and calibration, and with the faults of their visit."""

    def __init__(
        self, subject: SimulatedSubject, clock: Clock, bench: Connection, session_plan: SessionPlan, faults: VisitFaults
    ) -> None:
        super().__init__(subject, clock, bench, self._perceived_surface)
        self._plan, self._faults = session_plan, faults

    def show(self, command: steps.Command) -> None:
        """Carry out the command, except for the faults of the visit."""
        match command:
            case steps.AskMount(trial) if trial.number == self._faults.aborted:
                self.put(steps.Abort("the subject had to leave"))
            case steps.AskScore(trial) if trial.number == self._faults.unanswered:
                self.put(steps.Scored(None, (), None, 0, None, INPUT), self.judgement_s)
            case _:
                super().show(command)

    def score(self, trial: Trial) -> float:
        """Return the score of a trial, with drift within its block and carry-over from the previous trial."""
        _, position, previous_index = self._order(trial)
        return self.subject.score(self.surface(trial), self.repetition(trial), position, previous_index)

    def true_judgement(self, trial: Trial) -> dict[str, Any]:
        """Return a trial's depth, its position, the previous index, and the score without noise."""
        block, position, previous_index = self._order(trial)
        score = self.subject.expected_score(self.surface(trial), position, previous_index)
        return {"indentation": block.indentation, "place": position, "before": previous_index, "score": score}

    def _order(self, trial: Trial) -> tuple[Block, int, int | None]:
        """Return a trial's block, its position there from 0, and the index stroked before it, None for the first."""
        block = next(block for block in self._plan.blocks if trial in block.trials)
        position = block.trials.index(trial)
        return block, position, block.trials[position - 1].stimulus.known_index if position else None

    def _perceived_surface(self, trial: Trial) -> Surface:
        surface = self.subject.perceived_surface(simulated_surface(trial))
        light = _LIGHT / surface.peak_normal_force if trial.number == self._faults.light else 1.0
        return replace(surface, tau_max=surface.tau_max * light)


# ---- relation of scores to the model's SEDs in the population: the truth of the study's headline

Load = tuple[float, float, float, int, float]  # mu [-], tau_max [MPa], depth [mm], direction, speed [mm/s]
SedsAt = Callable[[Sequence[Load]], Sequence[float | None]]

SAMPLE_SIZE = 2000  # people
_FIRST = 1_000_000  # first seed, beyond those of a study's people
_FINGERS = np.linspace(-4.0, 4.0, 9)  # friction of the solved fingers, in its standard deviations between people


def population_relations(
    people: Mapping[str, float], options: PredictionOptions, area: AreaLaw
) -> dict[str, dict[str, float]]:
    """Return the relation for each descriptor with the SEDs of the published finger, which simulated people have.

    Empty with a law of the area, which gives another tau_max than the true one, and at finite strain, where most
    sticky surfaces have no full slip.
    """
    if options.kinematics == "finite" or area != FIXED:
        return {}
    return relations(SubjectSettings(**people), lambda loads: seds_at(loads, options))


def relations(people: SubjectSettings, seds: SedsAt) -> dict[str, dict[str, float]]:
    """Return r and slope of single scores on SED for each descriptor whose surfaces all have full slip.

    r pools all trials within people and includes the noise of judgement [-]. The slope is the mean of people's own
    slopes, without drift and carry-over [points per kPa]: a mixed model with random slopes estimates that mean.
    """
    by_descriptor: dict[str, dict[str, float]] = {}
    for block in plan(protocol(PROTOCOL), "S00", 0).blocks:
        surfaces = [simulated_surface(trial) for trial in block.trials]
        seds_of_finger = seds_of_fingers(surfaces, block, people.moisture, seds)
        if seds_of_finger is not None:
            by_descriptor[surfaces[0].descriptor] = _relation(people, surfaces, seds_of_finger)
    return by_descriptor


def seds_of_fingers(
    surfaces: Sequence[Surface], block: Block, moisture: float, seds: SedsAt
) -> Callable[[float], Sequence[float]] | None:
    """Return a function from a finger's relative friction to the SED [kPa] of each surface; None without full slip."""
    times = np.exp(moisture * _FINGERS) if moisture else np.ones(1)
    loads = [
        (surface.mu * factor, surface.tau_max * factor, block.indentation, surface.direction, surface.speed)
        for factor, surface in product(times.tolist(), surfaces)
    ]
    answers = [sed for sed in seds(loads) if sed is not None]
    if len(answers) < len(loads):
        return None
    table = 1e3 * np.array(answers).reshape(len(times), len(surfaces))
    if not moisture:
        return lambda _: table[0].tolist()
    spline = CubicSpline(np.log(times), table)
    return lambda factor: np.asarray(spline(math.log(factor))).tolist()


def _relation(
    people: SubjectSettings, surfaces: Sequence[Surface], seds: Callable[[float], Sequence[float]]
) -> dict[str, float]:
    products = np.zeros((2, 2))  # of SED and score, each without the person's own mean
    slopes: list[float] = []  # of each person
    draw = np.random.default_rng(0)
    for seed in range(_FIRST, _FIRST + SAMPLE_SIZE):
        person = SimulatedSubject(seed, people)
        perceived = [person.perceived_surface(surface) for surface in surfaces]
        order: list[int] = draw.permutation(len(surfaces)).tolist()
        previous_indices: list[int | None] = [None, *(surfaces[i].index for i in order[:-1])]
        scores = np.empty(len(surfaces))
        for place, (i, last) in enumerate(zip(order, previous_indices, strict=True)):
            scores[i] = person.expected_score(perceived[i], place, last)
        rows = np.array([seds(perceived[0].mu / surfaces[0].mu), scores])
        rows -= rows.mean(axis=1, keepdims=True)
        products += rows @ rows.T
        by_surface = np.array([person.expected_score(surface) for surface in perceived])
        slopes.append(float(rows[0] @ by_surface / (rows[0] @ rows[0])))
    noise = people.judgement_noise**2 * SAMPLE_SIZE * (len(surfaces) - 1)
    r = products[0, 1] / math.sqrt(products[0, 0] * (products[1, 1] + noise))
    return {"r": float(r), "slope": float(np.mean(slopes))}
