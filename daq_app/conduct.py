"""One session from plan to sealed folder: what `run` and `demo` share."""

from collections.abc import Sequence
from pathlib import Path

from daq_app.console import Console
from drivers.clock import Clock
from drivers.transducer import Transducer
from sessions.plan import SessionPlan
from sessions.recording import SessionWriter, Setting, provenance
from sessions.recording.archive import seal
from sessions.runner import Operator, Resumed, SessionEnd, Status, run_session


def conduct(
    plan: SessionPlan,
    folder: Path,
    operator: Operator,
    transducer: Transducer | None,
    clock: Clock,
    console: Console,
    *,
    subject_simulated: bool,
    settings: Sequence[Setting] = (),
) -> SessionEnd:
    """Run the session into `folder` and seal it, however it ended, unless the transducer was lost: it can be resumed.

    Raises RecordingError when the folder cannot be used or the disk takes no more.
    """
    info = None if transducer is None else transducer.info
    came_from = provenance(clock, settings)
    writer = SessionWriter.create(folder, plan, info, came_from, subject_simulated=subject_simulated, clock=clock)
    return carried_on(plan, writer, operator, transducer, clock, console, shown=subject_simulated)


def carried_on(
    plan: SessionPlan,
    writer: SessionWriter,
    operator: Operator,
    transducer: Transducer | None,
    clock: Clock,
    console: Console,
    *,
    shown: bool,
    resumed: Resumed | None = None,
) -> SessionEnd:
    """Run a session that is being written, from its beginning or from where it was cut short, and seal it."""

    def told(status: Status) -> None:
        done = 0.0 if status.trial is None else (status.trial - 1) / status.trials
        console.progress(done, f"{plan.subject}: {status.state}, {status.safe.readings} readings safe")

    end = run_session(plan, writer, operator, transducer, clock, resumed=resumed, progress=told if shown else _silent)
    if end.cause != "device":
        seal(writer.folder)
    return end


def _silent(_: Status) -> None:
    """Show nothing: people at a terminal are being asked things there."""
