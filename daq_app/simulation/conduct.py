"""One session from plan to sealed folder in this process, for simulated people. All others use the recorder."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from daq_app.console import Console
from drivers.clock import Clock
from drivers.transducer import Transducer
from sessions.plan.plan import SessionPlan
from sessions.recording import FleetingWriter, SessionWriter, Setting, provenance
from sessions.recording.archive import seal
from sessions.run.resuming import RESUMABLE
from sessions.run.runner import Operator, RunnerSettings, SessionEnd, Status, run_session


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
