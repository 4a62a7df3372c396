"""The paper's study on simulated people: ten subjects score ten surfaces, one repeats the strokes on a transducer."""

from dataclasses import dataclass
from pathlib import Path

from daq_app.console import Console
from daq_app.simulation.conduct import Participants, conduct
from daq_app.simulation.wiring import Connected, SimulatedPeople, connected
from drivers.clock import Clock
from sessions.plan.protocols import VisitSetting, plan, protocol
from sessions.recording import Recording, Setting
from sessions.report.contents import Planted
from sessions.run.runner import SessionEnd

PROTOCOL = "sensotact-friction"
SUBJECTS = 10
STROKING = 3  # the subject who strokes on the transducer


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
