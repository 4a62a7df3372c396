"""A whole study of simulated people, from plan to sealed folders: what was planted and spoilt is known.

Ten subjects stroke and score the ten surfaces of the paper. Fingers differ in friction, transducers in calibration,
people in how they use the scale; scores follow the maker's index and the friction that a subject's own finger feels,
drift within a block and carry over from one trial to the next. Nobody here knows of a model of the finger.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from daq_app.console import Console
from daq_app.simulation.wiring import Connected, DueEvents, SimulatedPeople, connected, planted_surface
from drivers.clock import Clock, SimulatedClock
from drivers.transducer import Transducer
from sessions.file_access import write_json
from sessions.plan.plan import Block, Frame, SessionPlan, Trial
from sessions.plan.protocols import VisitSetting, plan, protocol
from sessions.recording import FleetingWriter, Recording, RecordingError, SessionWriter, Setting, provenance
from sessions.recording.archive import seal
from sessions.recording.schema import LIVE_FILE
from sessions.report.contents import Planted
from sessions.run import steps
from sessions.run.resuming import RESUMABLE
from sessions.run.runner import Operator, RunnerSettings, SessionEnd, Status, run_session
from sessions.statistics.findings import Spoilt
from sessions.statistics.visit import EXCLUSIONS
from simulators.bench import Bench, BenchSettings, DirectTransducer, Hurt, PlantedStroke
from simulators.stroke import Surface
from simulators.subject import SimulatedSubject, SubjectSettings

PROTOCOL = "sensotact-friction"
SUBJECTS = 10
STROKING = 3  # the subject who strokes on the transducer


class Participants(NamedTuple):
    """Who and what takes part in a session: whoever strokes and scores, the transducer, and the clock of both."""

    operator: Operator
    transducer: Transducer | None  # None for a visit that only scores
    clock: Clock


def conduct(
    plan: SessionPlan,
    folder: Path,
    taking_part: Participants,
    console: Console,
    *,
    settings: Sequence[Setting] = (),
    run: RunnerSettings | None = None,
    durable: bool = True,
) -> SessionEnd:
    """Run the session into `folder` and seal it, however it ended, unless it can be resumed.

    With `durable` False nothing waits for the disk.

    Raises RecordingError when the folder cannot be used or the disk takes no more.
    """
    operator, transducer, clock = taking_part
    info = None if transducer is None else transducer.info
    came_from = provenance(clock, settings)
    kind = SessionWriter if durable else FleetingWriter
    writer = kind.create(folder, plan, info, came_from, subject_simulated=True, clock=clock)

    def show(status: Status) -> None:
        done = 0.0 if status.trial is None else (status.trial - 1) / status.trials
        console.progress(done, f"{plan.subject}: {status.state}, {status.safe.readings} readings safe")

    end = run_session(plan, writer, operator, transducer, settings=run, progress=show)
    if end.cause not in RESUMABLE:
        seal(writer.folder)
    return end


class StudyCutShort(Exception):
    """A visit ended before its last trial; what was recorded until then is kept."""


@dataclass(frozen=True, slots=True)
class Study:
    """Where the visits lie, and what was planted in the one with forces."""

    scored: tuple[Path, ...]  # a folder a subject
    stroked: Path
    planted: tuple[Planted, ...]  # a row a trial
    readings: int
    lost: int


def simulated_study(out: Path, seed: int, clock: Clock, console: Console) -> Study:
    """Run every visit into a folder of its own below `out`. The same seed gives the same people and surfaces.

    Raises RecordingError where `out` cannot be used, StudyCutShort where a visit did not come to its end.
    """
    chosen = protocol(PROTOCOL)
    scored: list[Path] = []
    for number in range(1, SUBJECTS + 1):
        subject = f"S{number:02d}"
        folder = out / f"{subject}-scores"
        people = SimulatedPeople(_seed(seed, number), clock)
        planned = plan(chosen, subject, _seed(seed, number), forces=False)
        end = conduct(planned, folder, Participants(people, None, clock), console, settings=[_study_seed(seed)])
        _check(end, folder)
        scored.append(folder)
    subject = f"S{STROKING:02d}"
    folder = out / f"{subject}-forces"
    with connected(f"sim:?seed={seed}&rate=200", clock) as bench:
        people = SimulatedPeople(_seed(seed, STROKING), clock, bench)
        planned = plan(chosen, subject, _seed(seed, STROKING) + 1, setting=VisitSetting(frame=bench.frame))
        taking_part = Participants(people, bench.transducer, clock)
        end = conduct(planned, folder, taking_part, console, settings=[_study_seed(seed)])
        _check(end, folder)
        planted = _planted(bench, Recording.open(folder))
    return Study(tuple(scored), folder, planted, end.readings, end.health.lost)


def _check(end: SessionEnd, folder: Path) -> None:
    if not end.complete:
        raise StudyCutShort(f"{end.reason}; what was recorded is in {folder.parent}")


def _seed(study: int, subject: int) -> int:
    """Return a seed of one subject's own."""
    return study * 100 + subject


def _study_seed(seed: int) -> Setting:
    return Setting("study seed", seed, "", "set")


def _planted(bench: Connected, recording: Recording) -> tuple[Planted, ...]:
    """Return what the bench planted, trial by trial."""
    strokes = {} if bench.bench is None else {(s.surface.descriptor, s.surface.index): s for s in bench.bench.planted()}
    rows: list[Planted] = []
    for record in recording.trials:
        stimulus = record.trial.stimulus
        stroke = strokes.get((stimulus.descriptor, stimulus.known_index))
        if stroke is not None:
            rows.append(Planted(record.trial.number, stroke.mu, stroke.tau_max, stroke.speed, stroke.direction))
    return tuple(rows)


PLANTED = "planted.json"
DAMAGED = "S11"
PEOPLE = SubjectSettings(
    gain=0.75,
    gain_spread=0.05,
    offset_spread=3.0,
    judgement_noise=4.0,
    friction_weight=0.3,
    drift=0.4,
    carry_over=0.04,
    moisture=0.08,
)
CALIBRATION = 0.01  # standard deviation of each axis' gain about 1 [-]
LIGHT = 0.15  # peak normal force of a stroke that presses too lightly [N]
JUDGING = 0.8  # from lift to score [s]
TICK = 0.1  # between two looks at the transducer [s of the session's clock]: five times as seldom as with people


SPOILT: Mapping[str, Spoilt] = {
    "S02": Spoilt(lost=3, expected="trial 3: lost_readings"),
    "S04": Spoilt(frozen=6, expected="trial 6: frozen_sensor"),
    "S05": Spoilt(light=2, expected="trial 2: too_little_force"),
    "S06": Spoilt(unanswered=8, expected="trial 8 has no score"),
    "S07": Spoilt(reversed=True, expected="the scale was used backwards"),
    "S09": Spoilt(aborted=9, expected="trials 9 and 10 were not done"),
}


def synthetic_study(out: Path, seed: int, console: Console, subjects: int = SUBJECTS) -> None:
    """Write the study below `out`: a folder a visit, one that is damaged, decisions, and `planted.json`.

    The same seed gives the same readings and answers. Raises RecordingError where `out` cannot be used.
    """
    if out.exists() and any(out.iterdir()):
        raise RecordingError(f"{out} is not empty; give a new folder, for nothing is written over")
    planted = [_visit(out, seed, number, console) for number in range(1, subjects + 1)]
    (out / DAMAGED).mkdir()
    (out / DAMAGED / LIVE_FILE).write_bytes((out / "S01" / LIVE_FILE).read_bytes()[:1000])
    (out / EXCLUSIONS).write_text(_decisions(), encoding="utf-8")
    write_json(
        out / PLANTED,
        {
            "SIMULATED": "SIMULATED: this is what was planted in a simulated study",
            "seed": seed,
            "score": planted_slopes(PEOPLE),
            "people": asdict(PEOPLE),
            "calibration_sd": CALIBRATION,
            "spoilt": {
                **{code: asdict(spoilt) for code, spoilt in SPOILT.items() if int(code[1:]) <= subjects},
                DAMAGED: asdict(Spoilt(expected="the file is damaged")),
            },
            "strokes": [row for rows in planted for row in rows],
        },
    )


def planted_slopes(people: SubjectSettings) -> dict[str, Any]:
    """Return the slopes of these people's scores on index, µ by descriptor, trials before and index before."""
    judgements = {name: SimulatedSubject(0, people).by_friction(name) for name in ("stickiness", "slipperiness")}
    by_index = people.gain * (1.0 - people.friction_weight)
    return {"gain": by_index, "friction": judgements, "drift": people.drift, "carry_over": people.carry_over}


def _decisions() -> str:
    """Return the file of decisions that the experimenter of such a study would keep."""
    return (
        "# SIMULATED: decisions about a simulated study\n\n[[exclude]]\n"
        'subject = "S07"\nwhy = "used both scales backwards, and said so afterwards"\nwho = "simulated experimenter"\n'
    )


def _visit(out: Path, seed: int, number: int, console: Console) -> list[dict[str, Any]]:
    """Record one subject's visit and return what was planted in it, a row a stroke."""
    subject, own = f"S{number:02d}", seed * 100 + number
    spoilt = SPOILT.get(subject, Spoilt(expected=""))
    gains = np.random.default_rng([own, 7]).normal(1.0, CALIBRATION, 6)
    a, b, c, d, e, f = gains.tolist()
    bench = Bench(own, BenchSettings(gains=(a, b, c, d, e, f)))
    clock = SimulatedClock()
    transducer = DirectTransducer(bench, clock, Hurt(_one(spoilt.lost), _one(spoilt.frozen)))
    settings = replace(PEOPLE, gain=-PEOPLE.gain) if spoilt.reversed else PEOPLE
    setting = VisitSetting(frame=Frame("-z", "set", bench.settings.height, "set"))
    planned = plan(protocol(PROTOCOL), subject, own, setting=setting)
    people = SyntheticPeople(SimulatedSubject(own, settings), bench, transducer, clock, planned, spoilt)
    provenance = [Setting("study seed", seed, "", "set")]
    taking_part = Participants(people, transducer, clock)
    conduct(
        planned, out / subject, taking_part, console, settings=provenance, run=RunnerSettings(tick=TICK), durable=False
    )
    return [
        {**_row(subject, trial, stroke), **people.meant(trial)}
        for trial, stroke in zip(people.stroked, bench.planted(), strict=True)
    ]


def _one(number: int) -> frozenset[int]:
    return frozenset((number,)) if number else frozenset()


def _row(subject: str, trial: Trial, stroke: PlantedStroke) -> dict[str, Any]:
    return {
        "subject": subject,
        "trial": trial.number,
        "descriptor": trial.stimulus.descriptor,
        "index": trial.stimulus.index,
        "mu": stroke.mu,
        "tau_max": stroke.tau_max,
        "speed": stroke.speed,
        "direction": stroke.direction,
    }


class SyntheticPeople(DueEvents):
    """Experimenter and subject in one, on a bench in simulated time."""

    def __init__(
        self,
        subject: SimulatedSubject,
        bench: Bench,
        transducer: DirectTransducer,
        clock: Clock,
        planned: SessionPlan,
        spoilt: Spoilt,
    ) -> None:
        super().__init__(clock)
        self._subject, self._bench, self._transducer = subject, bench, transducer
        self._plan, self._spoilt = planned, spoilt
        self.stroked: list[Trial] = []

    def show(self, command: steps.Command) -> None:
        """Do what the command asks for."""
        match command:
            case steps.AskBegin():
                self.put(steps.Begin())
            case steps.AskMount(trial) if trial.number == self._spoilt.aborted:
                self.put(steps.Abort("the subject had to leave"))
            case steps.AskMount(trial):
                self._bench.mount(self._perceived(trial))
                self.put(steps.StimulusMounted(trial.stimulus.code))
            case steps.AskStroke(trial):
                stroke = self._subject.stroke(self._perceived(trial))
                self._bench.begin_stroke(stroke, self._transducer.now())
                self.stroked.append(trial)
            case steps.AskScore(trial):
                self.put(self._scored(trial), JUDGING)
            case steps.AskFinish():
                self.put(steps.Finish())
            case _:
                pass

    def meant(self, trial: Trial) -> dict[str, Any]:
        """Return a trial's depth, its place, what was stroked before, and the score without noise."""
        block, place, before = self._order(trial)
        score = self._subject.meant(self._subject.perceived(planted_surface(trial)), place, before)
        return {"indentation": block.indentation, "place": place, "before": before, "score": score}

    def _order(self, trial: Trial) -> tuple[Block, int, int | None]:
        """Return a trial's block, its place in it from 0, and the index stroked before it."""
        block = next(block for block in self._plan.blocks if trial in block.trials)
        place = block.trials.index(trial)
        return block, place, block.trials[place - 1].stimulus.known_index if place else None

    def _perceived(self, trial: Trial) -> Surface:
        surface = self._subject.perceived(planted_surface(trial))
        light = LIGHT / surface.peak_normal_force if trial.number == self._spoilt.light else 1.0
        return replace(surface, tau_max=surface.tau_max * light)

    def _scored(self, trial: Trial) -> steps.Scored:
        _, place, before = self._order(trial)
        at = self.clock.now_ns() * 1e-9 + JUDGING
        if trial.number == self._spoilt.unanswered:
            return steps.Scored(None, (), None, 0, None, "simulated")
        score = self._subject.score(self._subject.perceived(planted_surface(trial)), 1, place, before)
        return steps.Scored(score, ((at, score),), at, 0, None, "simulated")
