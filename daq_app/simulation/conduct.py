"""A session of simulated people from plan to sealed folder, in this process, and the paper's study made of such."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from daq_app.console import Console
from daq_app.simulation.wiring import Connected, SimulatedPeople, connected
from drivers.clock import Clock
from drivers.transducer import Transducer
from sessions.plan.plan import SessionPlan
from sessions.plan.protocols import VisitSetting, plan, protocol
from sessions.recording import FleetingWriter, Recording, SessionWriter, Setting, provenance
from sessions.recording.archive import seal
from sessions.report.contents import Planted
from sessions.run.resuming import RESUMABLE
from sessions.run.runner import Operator, RunnerSettings, SessionEnd, Status, run_session

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
